"""Compute means with 95% intervals by resampling the plans (bootstrap), and paired p-values; both with a fixed seed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.benchmark.measures import MEAN_DIGITS

DRAWS: Final = 2000
FLIPS: Final = 9999
_LEVELS: Final = (2.5, 97.5)
Floats = npt.NDArray[np.float64]


class Estimate(msgspec.Struct, frozen=True):
    """A mean over plans, its 95% interval, and the number of plans with a value; None if no plan has one."""

    mean: float | None
    low: float | None
    high: float | None
    number: int


def estimate_mean(values: Sequence[float | None]) -> Estimate:
    """Return the mean of the values that are not None, and its 95% interval from ``DRAWS`` resamplings of all plans.

    Resamplings without any value are left out.
    """
    given = np.array([np.nan if value is None else value for value in values], np.float64)
    number = int(np.count_nonzero(~np.isnan(given)))
    if not number:
        return Estimate(None, None, None, 0)
    mean, low, high = (float(row[0]) for row in estimate_column_means(given[:, None]))
    return Estimate(mean, low, high, number)


def estimate_mean_over_seeds(columns: Sequence[Sequence[float | None]]) -> Estimate:
    """Return the mean over plans and training seeds, from the values (plans,) of each seed; both are resampled."""
    if len(columns) == 1:
        return estimate_mean(columns[0])
    given = np.array([[np.nan if value is None else value for value in column] for column in columns], np.float64)
    has = ~np.isnan(given)
    if not has.any():
        return Estimate(None, None, None, 0)
    filled, weights = np.where(has, given, 0.0), _weights(given.shape[1])
    seeds = _weights(len(columns), 1)
    with np.errstate(invalid="ignore"):
        drawn = (seeds * (weights @ filled.T)).sum(axis=1) / (seeds * (weights @ has.T)).sum(axis=1)
    low, high = np.nanpercentile(drawn, _LEVELS)
    mean, low, high = (round(float(value), MEAN_DIGITS) for value in (filled.sum() / has.sum(), low, high))
    return Estimate(mean, low, high, int(has.any(axis=0).sum()))


def estimate_column_means(values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the mean and its interval for each column of (plans, columns); NaN means that a plan has no value."""
    has = ~np.isnan(values)
    filled = np.where(has, values, 0.0)
    weights = _weights(len(values))
    with np.errstate(invalid="ignore"):
        drawn = (weights @ filled) / (weights @ has)
    low, high = np.nanpercentile(drawn, _LEVELS, axis=0)
    mean = filled.sum(axis=0) / has.sum(axis=0)
    rounded = (np.round(each, MEAN_DIGITS) for each in (mean, low, high))
    return tuple(rounded)


def paired_p_value(differences: Sequence[float | None]) -> float | None:
    """Return the two-sided p-value of the mean of paired differences; None if there are none.

    It is that of the randomisation test by change of signs (Fisher, 1935), with ``FLIPS`` random changes of signs, of
    which the observed signs count as one more: no p-value is below 1 / (``FLIPS`` + 1).
    """
    given = np.array([value for value in differences if value is not None], np.float64)
    if not len(given):
        return None
    extreme = np.abs(_signs(len(given)) @ given) >= abs(given.sum()) - 1e-9 * np.abs(given).sum()
    return float((1 + np.count_nonzero(extreme)) / (1 + FLIPS))


def holm_correction(p_values: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number by the step-down method of Holm (1979), in the given order."""
    found, least = [0.0] * len(p_values), 0.0
    for rank, k in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        least = min(max(least, (len(p_values) - rank) * p_values[k]), 1.0)
        found[k] = least
    return found


@lru_cache(maxsize=4)
def _signs(number: int) -> Floats:
    """Return random signs, (FLIPS, number)."""
    rng = np.random.default_rng(0)
    return rng.choice(np.array([-1.0, 1.0]), (FLIPS, number))


@lru_cache(maxsize=8)
def _weights(number: int, seed: int = 0) -> Floats:
    """Return how often each plan is drawn in each resampling, (DRAWS, number)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(number, np.full(number, 1 / number), DRAWS).astype(np.float64)
