"""What can be seen, found the slow and obvious way."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.worlds.world import scan_buffers


def slow_visible(occupied: np.ndarray, traversable: np.ndarray, range_px: float) -> np.ndarray:
    """A look all round from the middle of every standing cell."""
    seen = np.zeros(occupied.size, np.uint8)
    runs, hit, slopes = scan_buffers(range_px)
    for row, col in np.argwhere(traversable).tolist():
        n_runs, _ = sector_scan(occupied, col + 0.5, row + 0.5, 0.0, math.pi, range_px, runs, hit, slopes)
        for first, last in runs[:n_runs].tolist():
            seen[first : last + 1] = 1
    return seen.reshape(occupied.shape)
