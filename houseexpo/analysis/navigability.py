"""What a disc robot of a given radius can reach."""

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
    """Measure what a disc robot can reach, for each radius (metres; the keys have two decimals).

    1. The disc's centre can stand on the free space eroded by the radius; its connected pieces are counted, specks
       under 0.1 m2 left out (here and in all that follows).
    2. ``largest_share`` is the biggest piece's share of the pieces' area, 0.0 where there is none.
    3. ``narrowest`` is the width of the bottleneck of the biggest piece, metres: erode it further until it falls into
       two pieces; twice the radius at which it does is the narrowest place that must be passed to get between any two
       of its places. A piece that never falls apart has no passage; its narrowest is the widest disc that fits.
       A place counts where it outlives the split by up to 0.05 m of radius.

    Walls are straightened by at most 0.01 m first and ``narrowest`` is given to 0.01 m; a disc that is wider or
    narrower than a passage by more than 0.02 m is judged as exact geometry judges it.

    Raises
    ------
    PlanError
        A radius is negative or not finite.
    """
    if odd := [radius for radius in radii if not 0 <= radius < math.inf]:
        raise PlanError(f"expected radii of 0 m or more, found {odd[0]!r}", "navigability")
    standing = Standing(straightened(space.free_space if isinstance(space, PlanData) else space))
    said = cache(Navigability)  # most radii say the same of a plan
    found = {}
    for radius in radii:
        pieces = standing.pieces(radius)
        narrowest = standing.width(pieces[0], radius) if pieces else 0.0
        found[f"{radius:.2f}"] = said(len(pieces), _largest_share(pieces), round(narrowest, 2))
    return Reach(found)


def standing_pieces(space: Polygon | MultiPolygon, radius_m: float) -> list[Polygon]:
    """Return the pieces in which the centre of a disc can stand, the biggest first; specks under 0.1 m2 left out."""
    return eroded(straightened(space), radius_m)


def _largest_share(pieces: Sequence[Piece]) -> float:
    """Return the biggest piece's share of the area; it comes first."""
    if len(pieces) <= 1:
        return float(len(pieces))
    return round(float(pieces[0].polygon.area / sum(piece.polygon.area for piece in pieces)), 4)
