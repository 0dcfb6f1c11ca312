"""Find the narrow places of a room, whatever the shape of its jambs: frames, columns, or the ragged walls of a map.

N1  A room that shrinks by half of a width at all of its edges falls apart where it is narrower than this width. Between
    two such parts a line lies from the nearest wall to the one across, along an axis of the plan if that is as short.
N2  At both sides of the line the room is wider than there, unlike where a corridor turns, or its walls are uneven.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import shapely
from shapely import LineString, Polygon

from houseexpo.service.review.question import PASSAGE_M, WIDEST_WALL_M
from houseexpo.service.review.wall_ends import JAGS_M
from houseexpo.tolerances import GRID_M

_WIDTHS_M: Final = (0.8, 1.1, 1.5, 2.0, 2.6)
"""Widths at which a room is tried, metres: each is a third more than the one before, up to that of an opening."""
_WIDER: Final = 1.1
"""A room is wider beside a narrow place by this factor. With it, 16 narrow places are asked about in the right plans of
the corpus, not 47 as before; if two rooms of such a plan are made one, 172 of 190 passages are found, not 177."""
_ALONG_AXIS: Final = 1.1
"""A line along an axis of the plan may be longer by this factor."""


def narrow_places(room: Polygon) -> Iterator[LineString]:
    """Yield the narrow places of a room, as wide as an opening, the same one several times (N1, N2)."""
    shape = shapely.simplify(room, JAGS_M)
    edge = shape.boundary
    for width in _WIDTHS_M:
        parts = shapely.get_parts(shapely.buffer(shape, -width / 2, quad_segs=2))
        pairs = shapely.STRtree(parts).query(parts, predicate="dwithin", distance=width + WIDEST_WALL_M).T
        between = [shapely.shortest_line(parts[a], parts[b]) for a, b in pairs if a < b]
        for middle in shapely.line_interpolate_point(
            [line for line in between if shape.covers(line)], 0.5, normalized=True
        ):
            line = _across(middle, shape, edge)
            if line is not None and PASSAGE_M[0] <= line.length <= PASSAGE_M[1] and is_wider_beside(shape, line):
                yield line


def _across(middle: shapely.Point, shape: Polygon, edge: shapely.Geometry) -> LineString | None:
    """N1."""
    at, near = np.array(middle.coords[0]), shapely.get_coordinates(shapely.shortest_line(edge, middle))[0]
    away = np.hypot(*(at - near))
    if away < GRID_M:
        return None
    way = (at - near) / away * 2 * PASSAGE_M[1]
    aside = np.array([-way[1], way[0]])
    before = shapely.intersection(edge, Polygon([at, at + way - aside, at + way + aside]))
    if before.is_empty:
        return None
    line = LineString([near, shapely.get_coordinates(shapely.shortest_line(middle, before))[1]])
    for axis in np.eye(2) * 2 * PASSAGE_M[1]:
        chords = shapely.get_parts(shapely.intersection(LineString([at - axis, at + axis]), shape)).tolist()
        straight = min(chords, key=lambda chord: chord.distance(middle), default=line)
        if straight.length <= _ALONG_AXIS * line.length:
            return straight
    return line


def is_wider_beside(room: Polygon, line: LineString) -> bool:
    """N2. Return whether a line parts a room, and a circle wider than the line fits into both parts, near the line."""
    near = shapely.intersection(parts_beside(room, line), line.buffer(2 * line.length))
    return len(near) == 2 and not shapely.is_empty(shapely.buffer(near, -line.length / 2 * _WIDER)).any()


def parts_beside(room: Polygon, line: LineString) -> list[Polygon]:
    """Return the two largest parts into which a line parts a room, the larger one first; one if it does not."""
    strip = line.buffer(JAGS_M, cap_style="square")  # a line between corners may miss them a little
    return sorted(shapely.get_parts(shapely.difference(room, strip)).tolist(), key=lambda part: -part.area)[:2]


def is_one_doorway(edge: shapely.Geometry, line: LineString, other: LineString) -> bool:
    """Return whether two lines lie in one doorway, no deeper than wide, whose jambs lie on ``edge``, a room's edge."""
    if line.distance(other) > line.length:
        return False
    jambs = shapely.difference(shapely.convex_hull(shapely.union(line, other)).boundary, shapely.union(line, other))
    return bool(jambs.length > 0 and shapely.covers(edge, jambs))
