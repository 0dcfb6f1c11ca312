"""Find the gaps at which walls that end in a room part it: from each end to the nearest wall before it.

G1  A wall's end is an edge between two corners that jut into the room, shorter than the thickest wall and than half
    of the wall's faces beside it; a post has none. Its gap is the shortest line to a wall ahead of it, to
    one aside if that is clearly nearer, or to another wall's end, which may be farther.
G2  A gap is kept if the room, cut at all kept gaps together, has different parts at both of its sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Point, Polygon

from houseexpo.corrections.draft import Vector
from houseexpo.corrections.openings import ALONG, dot
from houseexpo.service.review.question import WIDEST_WALL_M
from houseexpo.tolerances import MIN_DOOR_M, SMALLEST_ROOM_M2

JAGS_M: Final = 0.05
"""Steps of a room's edge that are no corners, metres: a cell of most robots' maps, and half of a thin wall."""
_WIDEST_GAP_M: Final = 3.0
"""A wider gap is no doorway, metres: spaces that are open to each other."""
_LIKELIER: Final = 1.25
"""A gap to another wall's end, between two jambs, may be longer by this factor than one ahead of a wall, and that than
one aside."""
_BEYOND_END_M: Final = 0.02
"""What lies before a wall's end begins so far before it, metres."""


class Part(NamedTuple):
    """A part of a room, its area in m2, and the gaps between it and the other parts."""

    area: float
    point: Point
    gaps: tuple[LineString, ...]


@lru_cache(maxsize=256)
def parts_between_gaps(room: bytes) -> tuple[Part, ...]:
    """Return the parts of a room (WKB) between the gaps at its wall ends, the largest first; none if it is one."""
    shape = shapely.from_wkb(room)
    gaps = list(_gaps(shape))
    while gaps:  # G2
        cut = shapely.difference(shape, shapely.union_all([gap.buffer(JAGS_M, cap_style="square") for gap in gaps]))
        parts = [part for part in shapely.get_parts(cut).tolist() if part.area >= SMALLEST_ROOM_M2]
        if len(parts) < 2:
            break
        sides = [_parts_beside(gap, parts) for gap in gaps]
        parting = [gap for gap, (one, other) in zip(gaps, sides, strict=True) if one != other]
        if len(parting) == len(gaps):
            found = [
                Part(
                    part.area,
                    part.representative_point(),
                    tuple(gap for gap, at in zip(gaps, sides, strict=True) if k in at),
                )
                for k, part in enumerate(parts)
            ]
            return tuple(sorted((part for part in found if part.gaps), key=lambda part: -part.area))
        gaps = parting
    return ()


def _parts_beside(gap: LineString, parts: list[Polygon]) -> tuple[int, int]:
    a, b = shapely.get_coordinates(gap)
    across = np.array([a[1] - b[1], b[0] - a[0]]) / gap.length * 2 * JAGS_M
    one, other = (int(np.argmin(shapely.distance(parts, Point((a + b) / 2 + side * across)))) for side in (1, -1))
    return one, other


def _gaps(room: Polygon) -> Iterator[LineString]:
    """G1, the shortest first; of two in one place the first."""
    middles, ways = _wall_ends(room)
    seen, edge = shapely.buffer(room, JAGS_M), room.boundary
    found = []
    for middle, way in zip(middles, ways, strict=True):
        point, start = Point(middle), middle + way * _BEYOND_END_M
        across, onward = np.array([-way[1], way[0]]) * _WIDEST_GAP_M, start + way * _WIDEST_GAP_M
        ahead = Polygon([start, onward - across / 2, onward + across / 2])
        half = Polygon([start - across, onward - across, onward + across, start + across])
        lines: list[tuple[float, LineString]] = []  # each with its length, times how unlikely it is
        for area, factor in ((ahead, 1.0), (half, _LIKELIER)):
            before = shapely.intersection(edge, area)
            if not before.is_empty:
                line = LineString([middle, shapely.get_coordinates(shapely.shortest_line(point, before))[-1]])
                lines.append((line.length * factor, line))
        for other, its_way in zip(middles, ways, strict=True):
            apart = float(np.hypot(*(other - middle)))
            if MIN_DOOR_M <= apart <= _WIDEST_GAP_M and dot(other - middle, way) > 0 > dot(other - middle, its_way):
                line = LineString([middle, other])
                lines += [(apart / _LIKELIER, line)] if seen.covers(line) else []
        lines = [each for each in lines if each[1].length <= _WIDEST_GAP_M]
        found += [min(lines, key=lambda each: each[0])[1]] if lines else []
    kept: list[LineString] = []
    for gap in sorted(found, key=lambda each: each.length):
        if all(shapely.distance(gap.centroid, other.centroid) > MIN_DOOR_M for other in kept):
            kept.append(gap)
            yield gap


def rings_with_corners(room: Polygon) -> Iterator[tuple[Vector, Vector, npt.NDArray[np.bool_]]]:
    """Yield for each ring of a room its points (n, 2), the edges (n, 2) that begin there, and which points jut into it.

    The room lies to the left of its edges.
    """
    whole = shapely.orient_polygons(shapely.simplify(room, JAGS_M))
    for ring in (whole.exterior, *whole.interiors):
        points = np.array(ring.coords[:-1])
        edges = np.roll(points, -1, axis=0) - points
        before = np.roll(edges, 1, axis=0)
        turn = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0]
        juts = (turn < 0) & ((before * edges).sum(axis=1) < ALONG * np.hypot(*before.T) * np.hypot(*edges.T))
        yield points, edges, juts


def _wall_ends(room: Polygon) -> tuple[Vector, Vector]:
    """Return the middles (n, 2) of the ends of walls in a room, and the unit vectors in which the walls would go on."""
    middles, ways = [np.empty((0, 2))], [np.empty((0, 2))]
    for points, edges, juts in rings_with_corners(room):
        lengths = np.maximum(np.hypot(*edges.T), JAGS_M)
        units = edges / lengths[:, None]
        before, after = np.roll(units, 1, axis=0), np.roll(units, -1, axis=0)
        shorter = np.minimum(np.roll(lengths, 1), np.roll(lengths, -1))
        is_end = juts & np.roll(juts, -1) & (lengths <= WIDEST_WALL_M) & (2 * lengths <= shorter)
        onward = (before - after)[is_end]
        middles.append((points + edges / 2)[is_end])
        ways.append(onward / np.maximum(np.hypot(*onward.T), JAGS_M)[:, None])
    return np.concatenate(middles), np.concatenate(ways)
