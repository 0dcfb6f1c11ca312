"""Grids of cells: where they stand in a plan (``frame``), and what of it each cell shows (``raster``)."""
