"""Find where a drawn line meets the rooms of a plan: in a wall between two rooms, in an outer wall, or on a floor.

R1  A line within ``SNAP_M`` of a wall, and roughly parallel to it, is moved into the wall and turned parallel to it. A
    wall between two different spaces takes precedence over a nearer wall inside one room, such as a door leaf.
R2  In a wall, the opening is the clear part of the line: there, both faces are as far apart as in the middle.
R3  On a floor, the line ends at the walls that it crosses. Its ends are extended to the walls, if these are at most
    ``ONWARD_M`` away, and the line parts the room.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections.draft import Draft, DraftRoom, Vector

SNAP_M: Final = 0.25
"""A line drawn within this distance of a wall is meant to lie in it, metres: a hand's breadth plus half the wall."""
ONWARD_M: Final = 1.0
"""The longest wall that a door on a floor adds at each end, metres: the wall beside a doorway in a corner."""
WALL_REACH_M: Final = 1.2
"""The thickest wall that a door goes through, metres: in old houses."""
MEETS_M: Final = 1e-4
"""Shapes nearer than this touch, metres: a hundredth of the grid."""
STEP_M: Final = 0.1
"""Where a wall's face jumps by more than this, another wall begins, metres: a hand's breadth."""
SAID_WALL_M: Final = 0.1
"""The thickness of a wall that a person draws as a line, metres."""
SQUARE: Final = math.cos(math.radians(5.0))
"""Cosine of the angle within which a line drawn by hand is meant to be parallel or square to a wall."""
ALONG: Final = math.cos(math.radians(15.0))
"""Cosine of the angle within which a line drawn near a wall runs along it."""
_SAMPLE_M: Final = 0.01
_SAME_LINE_M: Final = 0.01
"""Ends of a drawing's line that are said again differ by less, metres: pages round to millimetres."""
_AT_WALL_M: Final = 0.05
"""An end within this distance of a wall meets it, metres: half of ``SAID_WALL_M``, so the drawn wall reaches it."""


@dataclass(frozen=True, eq=False)
class Strip:
    """A rectangle through or along a wall: its middle, the unit vector along it, its length and depth, metres."""

    centre: Vector
    along: Vector
    length: float
    depth: float

    @property
    def across(self) -> Vector:
        """The unit vector to the left of ``along``."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def ends(self) -> Vector:
        """The ends of its centre line (2, 2)."""
        half = self.along * self.length / 2
        return np.stack([self.centre - half, self.centre + half])

    def polygon(self, *, deeper_m: float = 0.0, longer_m: float = 0.0) -> Polygon:
        """Return the strip as a polygon, deeper and longer by some metres at each side."""
        half = self.across * (self.depth / 2 + deeper_m)
        a, b = self.ends + np.array([-self.along * longer_m, self.along * longer_m])
        return Polygon([a - half, b - half, b + half, a + half])

    def before(self, side: int, off_m: float) -> Vector:
        """Return a point in front of the middle of a face; ``side`` is -1 or 1, the left one."""
        return np.asarray(self.centre + side * self.across * (self.depth / 2 + off_m))


def strip_of(a: Vector, b: Vector, *, depth_m: float = 0.0) -> Strip:
    """Return the line between two points as a strip."""
    length = math.dist(a, b)
    return Strip((a + b) / 2, (b - a) / length, length, depth_m)


def dot(one: Vector, other: Vector) -> float:
    """Return the scalar product of two vectors, written out: libraries round it differently on other machines."""
    return float(one[0] * other[0] + one[1] * other[1])


@dataclass(frozen=True, eq=False)
class Faces:
    """The shapes beyond the two faces of a wall: their indices, -1 without a shape, and their distances, metres.

    ``clear`` is the clear part of the line (R2): its two ends, in metres from the middle of the line.
    """

    shapes: tuple[int, int]
    far: tuple[float, float]
    clear: tuple[float, float]


def faces_beside(strip: Strip, shapes: Sequence[Polygon]) -> Faces:
    """Return which shapes lie on both sides of a line in a wall, the right side first."""
    count = max(int(strip.length / _SAMPLE_M), 3)
    steps = (np.arange(count) + 0.5) / count * strip.length - strip.length / 2
    starts = strip.centre + steps[:, None] * strip.along
    near = [k for k, shape in enumerate(shapes) if shape.distance(shapely.LineString(strip.ends)) < WALL_REACH_M]
    found: list[tuple[int, float]] = []
    clear = np.ones(count, np.bool_)
    for side in (-1.0, 1.0):
        far = _distances(starts, side * strip.across, [shapes[k] for k in near])
        k = _in_front(far)
        if k is None:
            found.append((-1, 0.0))
            continue
        is_first = np.isfinite(far[:, k]) & (far[:, k] <= far.min(axis=1) + _SAMPLE_M)
        middle = _in_the_middle(far[:, k], is_first)
        clear &= is_first & (np.abs(far[:, k] - middle) <= STEP_M)
        found.append((near[k], middle))
    low, high = _longest_run(_without_leaves(clear))
    ends = low / count * strip.length - strip.length / 2, high / count * strip.length - strip.length / 2
    return Faces((found[0][0], found[1][0]), (found[0][1], found[1][1]), ends)


def _distances(starts: Vector, way: Vector, shapes: Sequence[Polygon]) -> npt.NDArray[np.float64]:
    """Return the distances (n, k) from points (n, 2) to k shapes in a direction, m; inf beyond ``WALL_REACH_M``."""
    rays = shapely.linestrings(np.stack([starts, starts + WALL_REACH_M * way], axis=1))
    if not shapes:
        return np.full((len(starts), 1), np.inf)
    hits = shapely.intersection(rays[:, None], np.array(shapes, np.object_)[None, :])
    far = shapely.distance(shapely.points(starts)[:, None], hits)
    return np.where(shapely.is_empty(hits), np.inf, far)


def _in_front(far: npt.NDArray[np.float64]) -> int | None:
    """Return the index of the shape that the middle ray meets first, else of the shape that most rays meet first."""
    first = np.where(np.isfinite(far.min(axis=1)), far.argmin(axis=1), -1)
    if (middle := int(first[len(first) // 2])) >= 0:
        return middle
    met = first[first >= 0]
    return int(np.bincount(met).argmax()) if len(met) else None


_LEAF: Final = round(1.5 * SAID_WALL_M / _SAMPLE_M)
"""Samples: what is thinner than a line that was read as a wall, and stands against a wall, leaves that wall one."""


def _in_the_middle(far: npt.NDArray[np.float64], is_first: npt.NDArray[np.bool_]) -> float:
    """Return the distance of a face in the middle of a line, else the median; a leaf that stands there counts not."""
    near = slice(max(len(far) // 2 - _LEAF, 0), len(far) // 2 + _LEAF + 1)
    there = far[near][is_first[near]]
    return float(np.median(there if len(there) > _LEAF // 2 else far[is_first]))


def _without_leaves(clear: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which samples are clear, also where a leaf stands between samples that are."""
    filled, gaps = clear.copy(), np.flatnonzero(clear)
    for low, high in itertools.pairwise(gaps.tolist()):
        if high - low <= _LEAF:
            filled[low:high] = True
    return filled


def _longest_run(clear: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """Return the start and the end of the run of True values that contains the middle, else of the longest run."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], clear, [False]]).astype(np.int8)))
    runs = list(zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True))
    middle = len(clear) // 2
    return max(runs, key=lambda run: (run[0] <= middle < run[1], run[1] - run[0]), default=(0, 0))


def edges_of(shapes: Iterable[Polygon]) -> tuple[Vector, Vector]:
    """Return the starts and the ends (n, 2) of all edges of some polygons."""
    starts, ends = [np.empty((0, 2))], [np.empty((0, 2))]
    for ring in shapely.get_rings(list(shapes)):
        points = shapely.get_coordinates(ring)
        starts.append(points[:-1])
        ends.append(points[1:])
    return np.concatenate(starts), np.concatenate(ends)


def walls_beside(strip: Strip, rooms: Sequence[DraftRoom], reach_m: float) -> Iterator[tuple[Vector, Vector, float]]:
    """Yield the start, the direction and the distance of rooms' edges that run along a line, the nearest first.

    Only edges that lie beside the middle of the line count (R1).
    """
    starts, ends = edges_of(room.shape for room in rooms)
    lengths = np.hypot(*(ends - starts).T)
    starts, ends, lengths = starts[lengths > 0], ends[lengths > 0], lengths[lengths > 0]
    ways = (ends - starts) / lengths[:, None]
    at = ((strip.centre - starts) * ways).sum(axis=1)
    off = np.abs((strip.centre[0] - starts[:, 0]) * ways[:, 1] - (strip.centre[1] - starts[:, 1]) * ways[:, 0])
    fits = (np.abs((ways * strip.along).sum(axis=1)) > ALONG) & (at > -SNAP_M) & (at < lengths + SNAP_M)
    for k in np.argsort(np.where(fits, off, np.inf), kind="stable").tolist():
        if not fits[k] or off[k] > reach_m:
            break
        yield starts[k], ways[k] if dot(ways[k], strip.along) > 0 else -ways[k], float(off[k])


def drawn_walls(lines: Sequence[LineString], standing: BaseGeometry) -> list[Polygon]:
    """Return drawn walls as areas; an end within ``SNAP_M`` of a standing or another drawn wall is extended to it."""
    grown = [line.buffer(SAID_WALL_M / 2, cap_style="square", join_style="mitre") for line in lines]
    tree, reach_m = shapely.STRtree(grown), 2 * SNAP_M + SAID_WALL_M  # another wall may be extended itself
    for k, line in enumerate(lines):
        for end in (line.coords[0], line.coords[-1]):
            point = shapely.Point(end)
            near = sorted(tree.query(point, predicate="dwithin", distance=reach_m).tolist())
            others = shapely.union_all([standing, *(grown[j] for j in near if j != k)])
            if not others.is_empty and MEETS_M < others.distance(point) <= SNAP_M:
                onward = shapely.shortest_line(point, others)
                reached = onward.buffer(SAID_WALL_M / 2, cap_style="square", join_style="mitre")
                grown[k] = shapely.union(grown[k], reached)
    return grown


def drop_lines(lines: Sequence[LineString], said: Sequence[Vector]) -> tuple[list[LineString], list[int]]:
    """Return lines without one that lies as each of the ``said`` (2, 2) does, and the numbers of those that do so.

    Of two lines in one place, such as a wall and the edge of what stands at it, each is said by itself.
    """
    tree, gone, found = shapely.STRtree(list(lines)), set[int](), []
    for number, ends in enumerate(said):
        near = tree.query(shapely.Point(ends.mean(axis=0)), predicate="dwithin", distance=_SAME_LINE_M)
        for k in sorted(set(near.tolist()) - gone):
            points = shapely.get_coordinates(lines[k])
            if min(np.abs(points - each).max() for each in (ends, ends[::-1])) <= _SAME_LINE_M:
                gone.add(k)
                found.append(number)
                break
    return [line for k, line in enumerate(lines) if k not in gone], found


def bare_part(strip: Strip, lines: Sequence[LineString]) -> tuple[float, float]:
    """Return the longest part of a strip in which no line runs along it: its ends, metres from the middle."""
    area, half = strip.polygon(deeper_m=_AT_WALL_M), strip.length / 2
    spans = [(half, half)]
    for part in shapely.get_parts(shapely.intersection(area, [line for line in lines if line.intersects(area)])):
        points = shapely.get_coordinates(part)
        if part.length > 0 and abs(dot(points[-1] - points[0], strip.along)) > ALONG * part.length:
            at = (points - strip.centre) @ strip.along
            spans.append((float(at.min()), float(at.max())))
    low, best = -half, (-half, -half)
    for start, end in sorted(spans):
        best = max(best, (low, start), key=lambda each: each[1] - each[0])
        low = max(low, end)
    return best


def turn_square(strip: Strip, shape: Polygon) -> Strip:
    """Return a line turned about its middle until parallel or square to a room's nearest edge, if it nearly is."""
    starts, ends = edges_of([shape])
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    far = shapely.distance(shapely.LineString(strip.ends), lines)
    for k in np.argsort(far, kind="stable").tolist():
        length = math.dist(starts[k], ends[k])
        if length < SAID_WALL_M:
            continue
        way = (ends[k] - starts[k]) / length
        for each in (way, np.array([-way[1], way[0]])):
            turned = each if dot(each, strip.along) > 0 else -each
            if dot(turned, strip.along) > SQUARE:
                return Strip(strip.centre, turned, strip.length, strip.depth)
        break
    return strip


def extend_to_walls(strip: Strip, shape: Polygon) -> tuple[Strip, tuple[float, float]] | None:
    """Return the line from wall to wall of a room, and how far the walls lie beyond its ends, metres (R3).

    Its depth is that of the wall ends that it meets, else ``SAID_WALL_M``. A line that passes by a wall's end within
    ``SNAP_M`` is moved beside it. The result is None if a wall is too far.
    """
    if (found := _from_wall_to_wall(strip, shape)) is not None:
        return found
    for end in strip.ends:
        _, near = shapely.get_coordinates(shapely.shortest_line(shapely.Point(end), shape.boundary))
        aside = dot(near - end, strip.across)
        if 0 < abs(aside) <= SNAP_M:
            aside += math.copysign(_AT_WALL_M, aside)
            beside = replace(strip, centre=strip.centre + strip.across * aside)
            if (found := _from_wall_to_wall(beside, shape)) is not None:
                return found
    return None


def _from_wall_to_wall(strip: Strip, shape: Polygon) -> tuple[Strip, tuple[float, float]] | None:
    onward, depths, asides = [], [], []
    for side in (-1, 1):
        end = strip.centre + side * strip.along * strip.length / 2
        inner = end - side * strip.along * min(strip.length / 2, SNAP_M)
        ray = shapely.LineString([inner, end + side * strip.along * ONWARD_M])
        hit = shapely.intersection(ray, shape.boundary)
        places = [np.array(p) for p in shapely.get_coordinates(hit)]
        if hit.is_empty and shape.boundary.distance(shapely.Point(end)) <= _AT_WALL_M:
            places = [end]  # at a corner, along its edge: the ray just misses it
        if not shape.covers(shapely.Point(inner)):  # drawn past the wall
            back = shapely.intersection(shapely.LineString([inner, strip.centre]), shape.boundary)
            places = list(shapely.get_coordinates(back))
        if not places:
            return None
        first = min(places, key=lambda place: math.dist(inner, place))
        onward.append(dot(first - end, side * strip.along))
        if (face := _end_face(first, strip, shape)) is not None:
            depths.append(face[0])
            asides.append(face[1])
    depth = max(depths, default=SAID_WALL_M)
    aside = asides[depths.index(depth)] if depths else 0.0
    low, high = -strip.length / 2 - onward[0], strip.length / 2 + onward[1]
    centre = strip.centre + strip.along * (low + high) / 2 + strip.across * aside
    return Strip(centre, strip.along, high - low, depth), (onward[0], onward[1])


def _end_face(place: Vector, strip: Strip, shape: Polygon) -> tuple[float, float] | None:
    """Return the thickness of the wall that ends at a place and its middle's offset from the line, metres, or None."""
    starts, ends = edges_of([shape])
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    k = int(shapely.distance(shapely.Point(place), lines).argmin())
    length = math.dist(starts[k], ends[k])
    way = (ends[k] - starts[k]) / max(length, _SAMPLE_M)
    if abs(dot(way, strip.across)) < ALONG or not 0.02 <= length <= WALL_REACH_M / 2:
        return None
    aside = dot((starts[k] + ends[k]) / 2 - strip.centre, strip.across)
    return (length, aside) if abs(aside) <= SNAP_M else None


def depth_of_entrances(draft: Draft) -> float:
    """Return the median depth of the plan's entrances, metres, or twice ``SAID_WALL_M`` if it has none."""
    depths = [door.shape.area / door.width for door in draft.doors if door.rooms[1] is None and door.width > 0]
    return float(np.median(depths)) if depths else 2 * SAID_WALL_M
