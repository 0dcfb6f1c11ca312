"""Compiled loops: arrays and scalars in and out, no checks, no objects; numba loads slowly, so import them late."""

from pathlib import Path

from houseexpo.kernel_cache import cache_safely

cache_safely(Path(__file__).parent)
