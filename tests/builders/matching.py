"""Pairs of what is true and what was found, one to one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment


def found_near(true: npt.ArrayLike, found: npt.ArrayLike, reach: float) -> int:
    """Return how many true points (n, 2) have a found one (m, 2) within reach, each found one for one at most."""
    one, other = (np.asarray(points, np.float64).reshape(-1, 2) for points in (true, found))
    far = np.linalg.norm(one[:, None] - other[None, :], axis=2)
    far[far > reach] = 1e6
    return int((far[linear_sum_assignment(far)] <= reach).sum())
