"""Compiled inner loops: arrays and scalars in and out; no checks, no random numbers, no objects.

Positions are pixels: x across, y down, cell (row, col) spans [col, col + 1) x [row, row + 1). Headings are radians,
counter-clockwise as one sees the grid with row 0 at the top. Grids are flat (rows * cols) where a cell is one number.
"""

from houseexpo.pseudoslam.kernels.collector import rest_while_compiling

rest_while_compiling(__name__)
