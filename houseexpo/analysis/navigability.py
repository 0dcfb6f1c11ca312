"""Measure which areas a disc robot of a given radius can reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

from houseexpo.analysis.standing import Piece, Standing, eroded, straightened
from houseexpo.errors import PlanError
from houseexpo.plan import RADII_M, Navigability, PlanData, Reach

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon


def navigability(space: PlanData | Polygon | MultiPolygon, radii: Sequence[float] = RADII_M) -> Reach:
    """Measure the areas that a disc robot can reach, for each radius in metres.

    The result maps each radius, as text with two decimals (``"0.20"``), to three figures:

    1. ``components``: the centre of the disc can be in the free space eroded by the radius. This is the number of its
       connected pieces; pieces under 0.1 m2 are ignored, here and below.
    2. ``largest_share`` is the largest piece's share of the area of all pieces, 0.0 if there is none.
    3. ``narrowest`` is the width of the bottleneck of the largest piece, metres. The piece is eroded further until it
       splits in two; twice the radius at which it does is the narrowest place between any two of its points. If it
       never splits, there is no passage, and ``narrowest`` is the diameter of the widest disc that fits. A part counts
       if it outlasts the split by up to 0.05 m of radius.

    Walls are first straightened by at most 0.01 m, and ``narrowest`` is rounded to 0.01 m. The result agrees with exact
    geometry for a disc that is wider or narrower than a passage by more than 0.02 m.

    Raises
    ------
    PlanError
        A radius is negative or not finite.
    """
    if odd := [radius for radius in radii if not 0 <= radius < math.inf]:
        raise PlanError(f"expected radii of 0 m or more, found {odd[0]!r}", "navigability")
    standing = Standing(straightened(space.free_space if isinstance(space, PlanData) else space))
    said = cache(Navigability)  # most radii of a plan have the same figures
    found = {}
    for radius in radii:
        pieces = standing.pieces(radius)
        narrowest = standing.width(pieces[0], radius) if pieces else 0.0
        found[f"{radius:.2f}"] = said(len(pieces), _largest_share(pieces), round(narrowest, 2))
    return Reach(found)


def standing_pieces(space: Polygon | MultiPolygon, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 0.1 m2."""
    return eroded(straightened(space), radius_m)


def _largest_share(pieces: Sequence[Piece]) -> float:
    """Return the share of the largest piece, which comes first, in the area of all."""
    if len(pieces) <= 1:
        return float(len(pieces))
    return round(float(pieces[0].polygon.area / sum(piece.polygon.area for piece in pieces)), 4)
