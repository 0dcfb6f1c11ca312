"""Hold the simulator's compiled inner loops on arrays and scalars, without checks, random generators and objects.

Positions are in pixels: x across, y down; cell (row, col) covers [col, col + 1) x [row, row + 1). Headings are in
radians, counter-clockwise as seen with row 0 at the top. Grids are flat (rows * cols) if a cell is a single number.
"""

from pathlib import Path

from houseexpo.kernel_cache import make_cache_robust
from houseexpo.pseudoslam.kernels.compiling import watch_compiling

watch_compiling(__name__)
make_cache_robust(Path(__file__).parent)  # before any kernel is loaded from disk
