"""Precision and recall of rooms, corners and angles as Structured3D's evaluators define them.

The plan and its truth are drawn on PIXELS x PIXELS pixels: the truth's box with MARGIN of its size on each side, each
axis by its own scale, as in the density images of that data set.

R1  A true room, the largest first, has the found one that overlaps it best, by more than half (IoU of pixels).
R2  A found room counts if a true room has it, and if no other found one overlaps it (both drawn in by two pixels).
R3  A corner of a found room that counts is right if it is the nearest to a corner of its true room, NEAR pixels away at
    most.
R4  So is its angle if the ring turns there by the same as at the true corner, to ALIKE degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

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
