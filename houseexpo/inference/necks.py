"""Candidates for doors: two fronts that face each other through the thickness of a wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.inference.fronts import Fronts, find_fronts
from houseexpo.inference.rays import Floats, Walls

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

JAG_M: Final = 0.012
"""Steps in a wall up to this size, metres, are straightened first; the thinnest walls (0.02 m) are preserved."""

DEEPEST_M: Final = 0.8
_THICKEST_M: Final = 0.5  # most walls are thinner, and deeper passages need better evidence
_COMMON_M: Final = 1.1  # most doors are narrower, and wider ones need better evidence
_SHALLOWEST_M: Final = 0.005
_FACING: Final = -0.95  # cosine: opposite within 18 degrees
_ASIDE: Final = 0.35  # of the width
_WIDER_M: Final = 0.12
_THIN_M: Final = 0.3
_HINT_M: Final = 0.015


@dataclass(frozen=True, eq=False)
class Neck:
    """A candidate: its two fronts (2, 2, 2) in the same direction, and the unit vectors (2, 2) from them into it.

    ``width`` and ``depth`` are in metres; ``room`` is the width of the narrower of the two spaces in front of it;
    ``whole`` is the number of jambs where a wall ends; a candidate with a lower ``cost`` is more likely a door.
    """

    fronts: Floats
    into: Floats
    width: float
    depth: float
    room: float
    whole: int
    cost: float

    @property
    def middle(self) -> Floats:
        """The middle of the candidate (2,), metres."""
        return np.asarray(self.fronts.mean(axis=(0, 1)))

    @property
    def segment(self) -> Floats:
        """The line (2, 2) from jamb to jamb on the wall's centre line, metres."""
        return np.asarray(self.fronts.mean(axis=0))


def find_necks(space: Polygon | MultiPolygon) -> list[Neck]:
    """Return all candidates of a free space (metres), the most likely first.

    R1  Two fronts lie opposite each other, at most 0.8 m apart, and the line of sight between them is free.
    R2  A jamb is *whole* if a wall ends there with both corners. A passage along a wall has one whole jamb. One between
        two walls, each of which starts where the other ends, has none, which is the weakest evidence.
    R3  The space is wider by 0.12 m on both sides. If a narrow passage through a thin wall has a whole jamb, one side
        need only be slightly wider, as in a closet that is hardly wider than its door.
    R4  A wide passage must have a whole jamb. One that is deeper than most walls must be narrow and have a whole jamb.
    """
    import shapely

    shape = shapely.simplify(space, JAG_M)
    walls = Walls(shape)
    fronts = find_fronts(shape, walls)
    first, second = _opposite(fronts)
    to = fronts.middle[second] - fronts.middle[first]
    span = np.hypot(*to.T)
    clear = walls.distance(fronts.middle[first], to / span[:, None]) > span
    found = (_neck(fronts, i, j) for i, j in zip(first[clear].tolist(), second[clear].tolist(), strict=True))
    return sorted((n for n in found if n is not None), key=lambda n: (n.cost, *n.middle))


def _opposite(fronts: Fronts) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return pairs of fronts that may be the two faces of one wall (R1)."""
    from scipy.spatial import cKDTree

    if not len(fronts.line):
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    pairs = cKDTree(fronts.middle).query_pairs(1.5 * DEEPEST_M, output_type="ndarray")
    i, j = pairs.T
    to = fronts.middle[j] - fronts.middle[i]
    depth = (to * fronts.into[i]).sum(axis=1)
    aside = np.abs(to[:, 0] * fronts.into[i, 1] - to[:, 1] * fronts.into[i, 0])
    facing = (fronts.into[i] * fronts.into[j]).sum(axis=1) < _FACING
    near = (
        (depth > _SHALLOWEST_M) & (depth <= DEEPEST_M) & (aside < _ASIDE * np.minimum(fronts.width[i], fronts.width[j]))
    )
    return i[facing & near], j[facing & near]


def _neck(fronts: Fronts, i: int, j: int) -> Neck | None:
    """Return the candidate between two fronts, or None if it violates R3 or R4."""
    line, width = fronts.line[[i, j]], fronts.width[[i, j]]
    corner = fronts.is_corner[[i, j]]
    if (line[0, 1] - line[0, 0]) @ (line[1, 1] - line[1, 0]) < 0:
        line[1], corner[1] = line[1, ::-1], corner[1, ::-1].copy()
    whole = int(corner.all(axis=0).sum())  # R2
    depth = float((line[1] - line[0]).mean(axis=0) @ fronts.into[i])
    across = float(width.min())
    widens = np.sort(fronts.room[[i, j]] - width)
    narrow = across <= _COMMON_M and whole > 0
    if widens[0] < (_HINT_M if narrow and depth <= _THIN_M else _WIDER_M) or widens[1] < _WIDER_M:  # R3
        return None
    if not narrow and (depth > _THICKEST_M or (across > _COMMON_M and not whole)):  # R4
        return None
    cost = across + 0.5 * depth + 0.35 * (2 - whole) + float(np.ptp(width)) - 0.3 * min(float(widens[0]), 0.5)
    return Neck(line, fronts.into[[i, j]], across, depth, float(fronts.room[[i, j]].min()), whole, cost)
