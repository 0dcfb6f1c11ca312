"""Placement of obstacles: shapes as cells, obstacles, and randomly drawn cells."""
