"""Compiled loops: arrays and scalars in and out, no checks, no objects; numba loads slowly, so import them late."""
