"""Where a disc robot can stand: free space drawn in by its radius, piece by piece."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import erode
from pipeline.geometry.bridge import strips_of
from pipeline.geometry.overlay import united
from pipeline.geometry.spaces import Spaces
from pipeline.geometry.walls import close_cracks

SPECK_M2 = 1e-3
"""Smaller pieces, in m2, need no door; those that a plan counts have 0.1 m2 (``houseexpo.navigability``)."""
LAP_M = 0.01
SEAM_M = 1e-3
"""Rooms that meet without a wall may stand so far apart by rounding."""


def floor_of(spaces: Spaces) -> BaseGeometry:
    """All rooms and the open passages between them, as one area."""
    strips = strips_of([p.bridge for p in spaces.passages if not p.leads_outside], deeper_m=LAP_M)
    floor = united([*spaces.rooms, *strips])
    return close_cracks(floor, SEAM_M) if spaces.joins else floor


def standing_pieces(floor: BaseGeometry, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 10 cm2."""
    return sorted(erode(floor, radius_m, SPECK_M2), key=lambda piece: (-piece.area, piece.bounds))


def sample(pieces: list[Polygon], count: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """``count`` points (n, 2) uniform over all pieces, and one more inside each."""
    low = np.min([p.bounds[:2] for p in pieces], axis=0)
    high = np.max([p.bounds[2:] for p in pieces], axis=0)
    whole = united(pieces)
    shapely.prepare(whole)
    found: list[npt.NDArray[np.float64]] = []
    while sum(len(f) for f in found) < count:
        trial = rng.uniform(low, high, (4 * count, 2))
        found.append(trial[shapely.contains_xy(whole, trial[:, 0], trial[:, 1])])
    inside = shapely.get_coordinates([p.representative_point() for p in pieces])
    return np.concatenate([inside, np.concatenate(found)[:count]])


def piece_of(points: npt.NDArray[np.float64], pieces: list[Polygon]) -> npt.NDArray[np.int64]:
    """For each point (n, 2) the index of the nearest piece."""
    return np.asarray(shapely.STRtree(pieces).nearest(shapely.points(points)), np.int64)
