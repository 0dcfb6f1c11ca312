r"""Find the narrow places of a free space (polygon): radius of the widest disc that fits through, and middle (metres).

A passage runs from a corner to another corner or to a wall; ``navigability`` finds from them which robots fit through.

::

    ======A                          A, B  corners that project into the space
    wall  |\
    ======A-B===                     A-B   a passage from corner to corner
          :  wall
    ......:.............             A..:  a passage from a corner straight to a wall
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.tolerances import SAME_M

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Floats = npt.NDArray[np.float64]


class Passages(NamedTuple):
    """Passages, sorted: ``radius`` (k,) of the widest disc that fits through, and ``middle`` (k, 2), both in metres."""

    radius: Floats
    middle: Floats


class _Edges(NamedTuple):
    """Edges with the free space on their left: start (n, 2), length (n,), unit vector (n, 2), previous edge (n,)."""

    start: Floats
    length: Floats
    unit: Floats
    before: npt.NDArray[np.int64]


def find_passages(space: Polygon | MultiPolygon, widest_m: float = np.inf) -> Passages:
    """Find the passages of a valid shape (metres, no vertex repeated), up to a width.

    The area in which the centre of a growing disc can be splits only where two walls touch the disc on opposite sides.
    Each passage therefore

    P1  starts at a corner that projects into the space, in the sector between the perpendiculars to its two walls,
    P2  ends at another such corner, or at the foot of the perpendicular to a wall,
    P3  and is the diameter of a disc that no wall reaches into.

    The area need not split when a passage closes, since there may be another way around.
    """
    import shapely

    edges = _edges(space)
    start, unit = edges.start, edges.unit
    arriving = unit[edges.before]
    juts = arriving[:, 0] * unit[:, 1] < arriving[:, 1] * unit[:, 0]
    corner, leaving, back = start[juts], unit[juts], -arriving[juts]
    found = _to_corners(corner, leaving, back, widest_m), _to_walls(corner, leaving, back, edges, widest_m)
    radius, middle = (np.concatenate(both) for both in zip(*found, strict=True))
    open_ = shapely.distance(space.boundary, shapely.points(middle)) > radius - SAME_M  # P3
    radius, middle = radius[open_], middle[open_]
    order = np.argsort(radius, kind="stable")
    return Passages(radius[order], middle[order])


def _edges(space: Polygon | MultiPolygon) -> _Edges:
    import shapely

    rings = shapely.get_rings(shapely.get_parts(shapely.orient_polygons(space)))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    real = ring[1:] == ring[:-1]  # other pairs would lead from ring to ring
    along, start = (points[1:] - points[:-1])[real], points[:-1][real]
    last = np.cumsum(np.bincount(ring) - 1) - 1
    before = np.arange(-1, len(start) - 1)
    before[np.append(0, last + 1)[:-1]] = last
    length = np.hypot(along[:, 0], along[:, 1])
    return _Edges(start, length, along / length[:, None], before)


def _to_corners(corner: Floats, leaving: Floats, back: Floats, widest_m: float) -> tuple[Floats, Floats]:
    """Return radii and middles from corner to corner; ``leaving`` and ``back`` are the directions of its walls."""
    ahead = leaving @ corner.T < (_dot(leaving, corner) + SAME_M)[:, None]
    ahead &= back @ corner.T < (_dot(back, corner) + SAME_M)[:, None]
    one, other = np.nonzero(ahead & ahead.T)  # P1 at either end
    one, other = one[one < other], other[one < other]
    across = corner[other] - corner[one]
    width = np.hypot(across[:, 0], across[:, 1])
    near = width <= widest_m
    return width[near] / 2.0, (corner[one] + across / 2.0)[near]


def _to_walls(corner: Floats, leaving: Floats, back: Floats, edges: _Edges, widest_m: float) -> tuple[Floats, Floats]:
    """Return radii and middles of passages from a corner to the foot of a perpendicular."""
    start, length, unit, _ = edges
    left = np.stack([-unit[:, 1], unit[:, 0]])
    away = corner @ left - _dot(start, left.T)
    meets = (away > 0.0) & (away <= widest_m)
    meets &= (leaving @ left > -SAME_M) & (back @ left > -SAME_M)  # P1
    which, wall = np.nonzero(meets)
    along = _dot(corner[which] - start[wall], unit[wall])
    foot = (along > -SAME_M) & (along < length[wall] + SAME_M)  # P2
    which, wall = which[foot], wall[foot]
    radius = away[which, wall] / 2.0
    return radius, corner[which] - radius[:, None] * left.T[wall]


def _dot(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", one, other))
