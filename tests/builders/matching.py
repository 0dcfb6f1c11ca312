"""Rooms, doors, corners and angles that were found, against those that are known: the measures of several papers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import cv2
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
    hidden = replace(
        plan, rooms=(), doors=(), windows=(), frame=None, navigability=None, provenance=None, quality=None, objects=()
    )
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


# Precision and recall of rooms, corners and angles as Structured3D's evaluators define them.
#
# The plan and its truth are drawn on PIXELS x PIXELS pixels: the truth's box with MARGIN of its size on each side, each
# axis by its own scale, as in the density images of that data set.
#
# R1  A true room, the largest first, has the found one that overlaps it best, by more than half (IoU of pixels).
# R2  A found room counts if a true room has it, and if no other found one overlaps it (both drawn in by two pixels).
# R3  A corner of a found room that counts is right if it is the nearest to a corner of its true room, NEAR pixels away
#     at most.
# R4  So is its angle if the ring turns there by the same as at the true corner, to ALIKE degrees.


PIXELS, MARGIN = 256, 0.1
NEAR, ALIKE = 10.0, 5.0
Ring = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Counts:
    """How many are right, found and true; counts of several plans add up."""

    right: int = 0
    found: int = 0
    true: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.right + other.right, self.found + other.found, self.true + other.true)

    @property
    def precision(self) -> float:
        """Share of the found that is right."""
        return self.right / max(self.found, 1)

    @property
    def recall(self) -> float:
        """Share of the true that is right."""
        return self.right / max(self.true, 1)


def compare(found: Sequence[Ring], true: Sequence[Ring]) -> dict[str, Counts]:
    """Counts of rooms, corners and angles of rings (n, 2), unclosed, in the same metres."""
    low, high = (f(np.concatenate(true), axis=0) for f in (np.min, np.max))
    margin = MARGIN * (high - low)
    found, true = ([(ring - low + margin) / (high - low + 2 * margin) * PIXELS for ring in each]
                   for each in (found, true))  # fmt: skip
    found, true = ([np.round(ring) for ring in each] for each in (found, true))
    masks, wanted = [_drawn(ring) for ring in found], [_drawn(ring) for ring in true]
    owner: dict[int, int] = {}
    for k in sorted(range(len(true)), key=lambda k: -int(wanted[k].sum())):  # R1
        overlaps = [(mask & wanted[k]).sum() / ((mask | wanted[k]).sum() + 1) for mask in masks]
        best = int(np.argmax(overlaps)) if overlaps else -1
        if best >= 0 and overlaps[best] > 0.5:
            owner.setdefault(best, k)
    inner = [cv2.erode(mask, np.ones((5, 5), np.uint8)) for mask in masks]
    crossed = {k for k in range(len(masks)) for j in range(len(masks)) if j != k and (inner[k] & inner[j]).any()}
    corners = angles = 0
    for k, room in owner.items():
        if k not in crossed:  # R2
            right = _corners(found[k], true[room])
            corners, angles = corners + len(right), angles + sum(right.values())
    sizes = sum(map(len, found)), sum(map(len, true))
    return {
        "room": Counts(len(owner.keys() - crossed), len(found), len(true)),
        "corner": Counts(corners, *sizes),
        "angle": Counts(angles, *sizes),
    }


def _corners(found: Ring, true: Ring) -> dict[int, bool]:
    """R3, R4: the right corners of a found ring, and whether their angles are right too."""
    right: dict[int, bool] = {}
    turns, wanted = _turns(found), _turns(true)
    for k, corner in enumerate(true):
        distance = np.hypot(*(found - corner).T)
        nearest = int(np.argmin(distance))
        if distance[nearest] <= NEAR:
            right[nearest] = bool(abs(turns[nearest] - wanted[k]) <= ALIKE)
    return right


def _turns(ring: Ring) -> npt.NDArray[np.float64]:
    """By how many degrees a ring turns at each corner, left turns of a counter-clockwise ring positive."""
    into, out = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
    turns = np.rad2deg(np.arctan2(cross, (into * out).sum(axis=1)))
    return np.asarray(turns if turns.sum() > 0 else -turns, np.float64)


def _drawn(ring: Ring) -> npt.NDArray[np.uint8]:
    mask = np.zeros((PIXELS, PIXELS), np.uint8)
    cv2.fillPoly(mask, [ring.astype(np.int32)], 1)
    return mask


# How well rooms of a map agree with the true ones: the measures of ROSE2's evaluator, written anew.
#
# Definition: goldleaf3i/declutter-reconstruct, ``code/util/evaluation.py`` (ROSE2, Luperto et al., 2022). For each
# found room, the true room that it overlaps most counts, and for each true room, the found one. "Micro" there is the
# mean over the rooms, "macro" is by area.
#
# R1  True rooms of ``SMALLEST_PX`` pixels or fewer are left out; a found room counts whatever its size.
# R2  Precision is the overlap by the found room's size, recall by the true room's.
# R3  IoU is the overlap by what both cover; of equal overlaps, the first room counts.


Labels = npt.NDArray[np.integer]
SMALLEST_PX = 200


@dataclass(frozen=True)
class RoomScores:
    """The eight figures of ROSE2's tables, as shares; ``found`` and ``true`` are the numbers of rooms."""

    precision_micro: float
    precision_macro: float
    recall_micro: float
    recall_macro: float
    iou_found_mean: float
    iou_found: float
    iou_true_mean: float
    iou_true: float
    found: int
    true: int


def room_scores(found: Labels, true: Labels, smallest_px: int = SMALLEST_PX) -> RoomScores:
    """Compare labels (rows, cols), 0 for no room; raises ValueError if there is no room in either."""
    rows, cols = min(found.shape[0], true.shape[0]), min(found.shape[1], true.shape[1])
    found, true = found[:rows, :cols], true[:rows, :cols]
    shared = np.zeros((int(found.max()) + 1, int(true.max()) + 1), np.int64)
    np.add.at(shared, (found.ravel(), true.ravel()), 1)
    found_px, true_px = shared.sum(axis=1), shared.sum(axis=0)
    kept, asked = np.flatnonzero(found_px), np.flatnonzero(true_px > smallest_px)  # R1
    kept, asked = kept[kept > 0], asked[asked > 0]
    if not len(kept) or not len(asked):
        raise ValueError(f"{len(kept)} found and {len(asked)} true rooms")
    overlap = shared[np.ix_(kept, asked)]
    found_px, true_px = found_px[kept], true_px[asked]
    union = found_px[:, None] + true_px[None] - overlap
    p_micro, p_macro, f_mean, f_all = _best(overlap, union, found_px)
    r_micro, r_macro, t_mean, t_all = _best(overlap.T, union.T, true_px)
    return RoomScores(p_micro, p_macro, r_micro, r_macro, f_mean, f_all, t_mean, t_all, len(kept), len(asked))


def _best(overlap: Labels, union: Labels, size: Labels) -> tuple[float, float, float, float]:
    """R2, R3: for each row its best column."""
    best = overlap.argmax(axis=1)[:, None]
    most = np.take_along_axis(overlap, best, 1)[:, 0]
    both = np.where(most > 0, np.take_along_axis(union, best, 1)[:, 0], 1)
    return (
        float((most / size).mean()),
        float(most.sum() / size.sum()),
        float((most / both).mean()),
        float(most.sum() / both.sum()),
    )
