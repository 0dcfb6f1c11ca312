"""Grids of cells: their position in a plan (``frame``), and masks of the plan on them (``raster``)."""
