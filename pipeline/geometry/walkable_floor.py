"""Find the floor on which a disc robot can stand: join rooms by passages, erode them by its radius, sample points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import erode
from pipeline.geometry.areas import (
    unite,
)
from pipeline.geometry.openings import strips_of
from pipeline.geometry.rooms_and_passages import Spaces
from pipeline.geometry.wall_sections import close_cracks
from pipeline.tolerances import (
    CM_M,
    MM_M,
    TINY_M2,
)

# ---------------------------------------------------------------------------------------------------------------------
# Where a disc robot can stand: free space drawn in by its radius, piece by piece.
# ---------------------------------------------------------------------------------------------------------------------


def walkable_floor(spaces: Spaces) -> BaseGeometry:
    """Return all rooms and the open passages between them, as one area."""
    strips = strips_of([p for p in spaces.passages if not p.leads_outside], deeper_m=CM_M)
    floor = unite([*spaces.rooms, *strips])
    return close_cracks(floor, MM_M) if spaces.joins else floor


def erode_floor(floor: BaseGeometry, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 10 cm2."""
    return sorted(erode(floor, radius_m, TINY_M2), key=lambda piece: (-piece.area, piece.bounds))


def sample_points(pieces: list[Polygon], count: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """``count`` points (n, 2) uniform over all pieces, and one more inside each."""
    low = np.min([p.bounds[:2] for p in pieces], axis=0)
    high = np.max([p.bounds[2:] for p in pieces], axis=0)
    whole = unite(pieces)
    shapely.prepare(whole)
    found: list[npt.NDArray[np.float64]] = []
    while sum(len(f) for f in found) < count:
        trial = rng.uniform(low, high, (4 * count, 2))
        found.append(trial[shapely.contains_xy(whole, trial[:, 0], trial[:, 1])])
    inside = shapely.get_coordinates([p.representative_point() for p in pieces])
    return np.concatenate([inside, np.concatenate(found)[:count]])


def nearest_piece(points: npt.NDArray[np.float64], pieces: list[Polygon]) -> npt.NDArray[np.int64]:
    """For each point (n, 2) the index of the nearest piece."""
    return np.asarray(shapely.STRtree(pieces).nearest(shapely.points(points)), np.int64)
