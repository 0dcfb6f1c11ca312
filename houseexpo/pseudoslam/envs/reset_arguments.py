"""What ``reset`` of a vector environment takes: seeds, plans, and a mask of those to reset."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError

Seeds = int | Sequence[int | None] | None


def seeds_of(seed: Seeds, number: int) -> list[int | None]:
    """Return a seed for each of so many environments; of one number they are it and those that follow.

    ConfigError for anything else.
    """
    if seed is None or isinstance(seed, (int, np.integer)):
        return [None if seed is None else int(seed) + i for i in range(number)]
    seeds = list(seed) if isinstance(seed, Iterable) else []
    if len(seeds) != number or not all(isinstance(one, (int, np.integer, type(None))) for one in seeds):
        raise ConfigError(f"seed: expected a whole number, a list of {number} of them or None, found {seed!r}")
    return [None if one is None else int(one) for one in seeds]


def mask_of(mask: object, number: int) -> npt.NDArray[np.bool_]:
    """Return which environments are to be reset, all where nothing is said; ConfigError where it is no such mask."""
    if mask is None:
        return np.ones(number, bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (number,) or not mask.any():
        raise ConfigError(
            f"options['reset_mask']: expected a boolean array of shape ({number},), not all False, found {mask!r}"
        )
    return mask


def plans_of(plan_id: object, number: int) -> list[str | None]:
    """Return a plan's id for each of so many environments, None for a random one; ConfigError for anything else."""
    if plan_id is None or isinstance(plan_id, str):
        return [plan_id] * number
    ids = list(plan_id) if isinstance(plan_id, Iterable) else []
    if len(ids) != number or not all(one is None or isinstance(one, str) for one in ids):
        raise ConfigError(
            f"options['plan_id']: expected an id, or a list of {number} ids or None (a random plan), found {plan_id!r}"
        )
    return ids
