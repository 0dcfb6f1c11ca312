"""Rooms and doors that were found, matched one to one with those that are known."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from houseexpo.floorplan import FloorPlan


class Matches(NamedTuple):
    """How many rooms and doors were known, found, and both."""

    rooms: int
    rooms_known: int
    rooms_found: int
    doors: int
    doors_known: int
    doors_found: int

    def rates(self) -> tuple[float, float, float, float]:
        """Recall and precision of the rooms, recall and precision of the doors."""
        return (
            self.rooms / max(1, self.rooms_known),
            self.rooms / max(1, self.rooms_found),
            self.doors / max(1, self.doors_known),
            self.doors / max(1, self.doors_found),
        )


def bare(plan: FloorPlan, *, holes: bool = True) -> FloorPlan:
    """The plan as published: rooms, doors and all else that docs/format.md adds are hidden; its holes too if asked."""
    hidden = replace(plan, rooms=(), doors=(), frame=None, navigability=None, provenance=None, quality=None, objects=())
    return hidden if holes else replace(hidden, holes=())


def matches(known: FloorPlan, found: FloorPlan) -> Matches:
    """Rooms match at an intersection over union of 0.6, inner doors where their centres lie within 0.35 m."""
    rooms = [
        (one.polygon.intersection(other.polygon).area / one.polygon.union(other.polygon).area, i, k)
        for (i, one), (k, other) in product(enumerate(known.rooms), enumerate(found.rooms))
    ]
    inner, ours = ([d for d in plan.doors if d.kind != "entrance"] for plan in (known, found))
    doors = [
        (-float(np.hypot(*(np.mean(one.segment, axis=0) - np.mean(other.segment, axis=0)))), i, k)
        for (i, one), (k, other) in product(enumerate(inner), enumerate(ours))
    ]
    return Matches(_pairs(rooms, 0.6), len(known.rooms), len(found.rooms), _pairs(doors, -0.35), len(inner), len(ours))


def total(found: list[Matches]) -> Matches:
    """All of them added up."""
    return Matches(*(sum(column) for column in zip(*found, strict=True)))


def which_near(true: npt.ArrayLike, found: npt.ArrayLike, reach: float) -> npt.NDArray[np.bool_]:
    """Return which found points (m, 2) have a true one (n, 2) within reach, each true one for one at most."""
    one, other = (np.asarray(points, np.float64).reshape(-1, 2) for points in (true, found))
    far = np.linalg.norm(one[:, None] - other[None, :], axis=2)
    far[far > reach] = 1e6
    i, k = linear_sum_assignment(far)
    near = np.zeros(len(other), np.bool_)
    near[k] = far[i, k] <= reach
    return near


def found_near(true: npt.ArrayLike, found: npt.ArrayLike, reach: float) -> int:
    """Return how many true points (n, 2) have a found one (m, 2) within reach, each found one for one at most."""
    return int(which_near(true, found, reach).sum())


def _pairs(scores: list[tuple[float, int, int]], least: float) -> int:
    """The number of one-to-one pairs, best first."""
    one: set[int] = set()
    other: set[int] = set()
    for score, i, k in sorted(scores, reverse=True):
        if score >= least and i not in one and k not in other:
            one.add(i)
            other.add(k)
    return len(one)
