"""Compiled inner loops: arrays and scalars in and out; no checks, no random numbers, no objects.

Positions are pixels: x across, y down, cell (row, col) spans [col, col + 1) x [row, row + 1). Headings are radians,
counter-clockwise as one sees the grid with row 0 at the top. Grids are flat (rows * cols) where a cell is one number.
"""

from pathlib import Path

from houseexpo.kernel_cache import cache_safely
from houseexpo.pseudoslam.kernels.compiling import watch_compiling

watch_compiling(__name__)
cache_safely(Path(__file__).parent)  # before any kernel is looked for on disk
