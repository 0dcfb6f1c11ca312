"""Turn arguments of ``reset`` into a plan, seed and pose for each episode; plans not given are random or in turn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_one_of
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.worlds.cache import WorldCache
from houseexpo.pseudoslam.worlds.world import World

Order = Literal["random", "in_turn"]


class PlanChooser:
    """Chooses the worlds of episodes.

    Parameters
    ----------
    plan_ids
        Ids of the plans; None for all plans of the data set.
    order
        "random": a plan is drawn for each episode, all equally likely. "in_turn": plans are used in the order of the
        list, again from the first after the last one. All environments of a vector share one list, so that any
        successive episodes, in the order in which they begin, have different plans until all were used.

    Raises
    ------
    ConfigError
        An id is unknown, or there is no plan.
    """

    def __init__(self, worlds: WorldCache, plan_ids: Iterable[str] | None, order: Order) -> None:
        check_one_of(order, "plan_order", get_args(Order))
        self._worlds, self._order = worlds, order
        self.take(plan_ids)

    def take(self, plan_ids: Iterable[str] | None) -> None:
        """Use these plans from now on, starting with the first; None for all."""
        self.plan_ids = None if plan_ids is None else _id_list(plan_ids)
        self._numbers: Sequence[int] = range(len(self._worlds))
        if self.plan_ids is not None:
            self._numbers = [self._worlds.number_of(plan_id, "plan_ids") for plan_id in self.plan_ids]
        self._next = 0

    def start_over(self) -> None:
        """Start again with the first plan."""
        self._next = 0

    def draw(self, rng: np.random.Generator, plan_id: str | None) -> World:
        """Return the world of the given plan; if none is given, that of the next or of a random one."""
        if plan_id is not None:
            return self._worlds[self._worlds.number_of(plan_id)]
        if self._order == "random":
            return self._worlds[self._numbers[int(rng.integers(len(self._numbers)))]]
        number = self._numbers[self._next]
        self._next = (self._next + 1) % len(self._numbers)
        return self._worlds[number]


def _id_list(plan_ids: Iterable[str]) -> list[str]:
    """Return the ids as a list; raise ConfigError if they are not ids."""
    if isinstance(plan_ids, str) or not isinstance(plan_ids, Iterable):
        raise ConfigError(
            f"plan_ids: expected a list of plans' ids or None (all), found {plan_ids!r}; "
            "open_dataset(...).split(NAME).ids gives those of a list that comes with a data set"
        )
    ids = list(plan_ids)
    if not ids:
        raise ConfigError("plan_ids: expected at least one id, found none; leave it out to take all plans")
    return ids


Seeds = int | Sequence[int | None] | None
Pose: TypeAlias = tuple[float, float, float]
"""A pose: x, y in the plan's metres, heading in radians, counter-clockwise from x."""
OPTIONS = ("plan_id", "pose")
"""The keys of ``options``, other than the mask."""


def check_reset_options(options: Mapping[str, Any] | None, known: tuple[str, ...] = OPTIONS) -> dict[str, Any]:
    """Return a copy of the options; raise ConfigError if they are not a mapping or have an unknown key."""
    if not isinstance(options, (Mapping, type(None))):
        raise ConfigError(f"options: expected a dictionary or None, found {options!r}")
    found = dict(options or {})
    for key in found:
        if key not in known:
            raise ConfigError(f"options: unknown key {key!r}; known: {', '.join(map(repr, known))}")
    return found


def parse_vector_options(
    options: Mapping[str, Any] | None, number: int
) -> tuple[npt.NDArray[np.bool_], list[str | None], list[Pose | None]]:
    """Return which environments to reset, and a plan and a pose for each of them, None for a random one.

    Raise ConfigError like ``check_reset_options``, and if there is not one value for each environment.
    """
    given = check_reset_options(options, (*OPTIONS, "reset_mask"))
    which = parse_reset_mask(given.get("reset_mask"), number)
    return which, parse_plan_ids(given.get("plan_id"), number), parse_poses(given.get("pose"), number)


def parse_seeds(seed: Seeds, number: int) -> list[int | None]:
    """Return a seed for each environment; a single number gives this number and the following ones.

    Raise ConfigError for anything else.
    """
    if seed is None or isinstance(seed, (int, np.integer)):
        return [None if seed is None else int(seed) + i for i in range(number)]
    seeds = list(seed) if isinstance(seed, Iterable) else []
    if len(seeds) != number or not all(isinstance(one, (int, np.integer, type(None))) for one in seeds):
        raise ConfigError(f"seed: expected a whole number, a list of {number} of them or None, found {seed!r}")
    return [None if one is None else int(one) for one in seeds]


def parse_reset_mask(mask: object, number: int) -> npt.NDArray[np.bool_]:
    """Return the mask of environments to reset, by default all; raise ConfigError if it is not such a mask."""
    if mask is None:
        return np.ones(number, bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (number,) or not mask.any():
        raise ConfigError(
            f"options['reset_mask']: expected a boolean array of shape ({number},), not all False, found {mask!r}"
        )
    return mask


def parse_plan_ids(plan_id: object, number: int) -> list[str | None]:
    """Return a plan's id for each environment, None for a random one; raise ConfigError for anything else."""
    if plan_id is None or isinstance(plan_id, str):
        return [plan_id] * number
    ids = list(plan_id) if isinstance(plan_id, Iterable) else []
    if len(ids) != number or not all(one is None or isinstance(one, str) for one in ids):
        raise ConfigError(
            f"options['plan_id']: expected an id, or a list of {number} ids or None (a random plan), found {plan_id!r}"
        )
    return ids


def parse_pose(pose: object) -> Pose | None:
    """Return the pose at the start of an episode, None if none is given; raise ConfigError for anything else."""
    return None if pose is None else _pose(pose, f"(x, y, heading) in metres and radians or None, found {pose!r}")


def parse_poses(poses: object, number: int) -> list[Pose | None]:
    """Return a pose for each environment, from (3,) for all or from a list or array with one pose or None for each."""
    expected = f"(x, y, heading) in metres and radians, a list of {number} of them or None, found {poses!r}"
    if poses is None:
        return [None] * number
    parts = list(poses) if isinstance(poses, Iterable) else []
    if len(parts) == 3 and all(isinstance(part, (int, float, np.number)) for part in parts):
        return [_pose(parts, expected)] * number
    if len(parts) != number:
        raise ConfigError(f"options['pose']: expected {expected}")
    return [None if part is None else _pose(part, expected) for part in parts]


def _pose(pose: object, expected: str) -> Pose:
    """Return three finite numbers, with the heading in half a turn either way; such a heading is unchanged."""
    try:
        x, y, heading = (float(part) for part in pose)  # type: ignore[attr-defined]  # TypeError where it is no list
    except (TypeError, ValueError):
        raise ConfigError(f"options['pose']: expected {expected}") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(heading)):
        raise ConfigError(f"options['pose']: expected {expected}")
    return x, y, math.remainder(heading, 2.0 * math.pi)
