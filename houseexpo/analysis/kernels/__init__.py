"""Hold loops that numba compiles: arrays and numbers in and out, no checks, no objects; their cache is set up here.

numba loads slowly, so import them late.
"""

from pathlib import Path

from houseexpo.kernel_cache import make_cache_robust

make_cache_robust(Path(__file__).parent)
