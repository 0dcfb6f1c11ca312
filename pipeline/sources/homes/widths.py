"""Widths of a home's doors: the narrowest, the widest and the mean are drawn together with what else a home is like.

Most houses have doors of one or two makes, which differ by a centimetre; between the two ends widths are those of
published doors.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pipeline.sources.homes.values import DoorWish
from pipeline.sources.homes.wishes import table

_SETS = 24
_AGAIN = (0.2, 0.95)
_STEP_M = 0.01
_ALONE_M = 0.7
"""Narrower doors are seldom more than one in a house."""
_ONE_MAKE_M, _NEAR_M = 0.03, 0.05


def door_widths(count: int, asked: DoorWish, rng: np.random.Generator) -> list[float]:
    """Return the widths of ``count`` doors, ascending, metres: of several sets the one whose mean is nearest."""
    low, high = asked.least_m, _widest(asked, rng)
    if count < 3:
        return [low, high][:count]
    keys, shares = _between(low, high)
    sets = rng.choice(keys, (_SETS, count - 2), p=shares)
    apart = rng.integers(0, 3, sets.shape) * _STEP_M
    like = np.where(rng.random(sets.shape) < asked.share, high - apart, low + apart)  # of the widest's make, or not
    again = (rng.random(sets.shape) < rng.uniform(*_AGAIN, (_SETS, 1))) & (like >= _ALONE_M)
    sets = np.clip(np.where(again, like, sets), low, high)
    means = (sets.sum(axis=1) + low + high) / count
    best = sets[int(np.argmin(np.abs(means - (low + asked.share * (high - low)))))]
    return sorted([low, *best.tolist(), high])


def _widest(asked: DoorWish, rng: np.random.Generator) -> float:
    """Return a width that doors have, near what is asked; of doors of one make the very one."""
    most = asked.least_m + asked.range_m
    if asked.range_m <= _ONE_MAKE_M:
        return most
    keys, shares = _between(asked.least_m, np.inf)
    shares = shares * np.exp(-0.5 * ((keys - most) / _NEAR_M) ** 2)
    return float(rng.choice(keys, p=shares / shares.sum())) if shares.sum() > 0 else most


def _between(low: float, high: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return published widths from one to another, and how often each is; the ends where there is none."""
    known = np.array([(float(width), share) for width, share in table()["door_widths_m"].items()])
    keys, shares = known[(known[:, 0] >= low - 1e-9) & (known[:, 0] <= high + 1e-9)].T
    if not len(keys):
        return np.array([low, high]), np.array([0.5, 0.5])
    return keys, shares / shares.sum()
