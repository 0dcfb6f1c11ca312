"""Find where the space on one side of a wall runs out to its other side: the gap that another wall must close.

R1  The space is the room in which both sides of the wall lie, or else all that lies outside the rooms. What stands
    there bounds it: walls of the source and whatever may close their gaps, and walls that were drawn.
R2  Of all ways from one side to the other, the widest counts, and on it the narrowest place. If that is shut, the next
    widest way counts, so that each further wall shuts one gap. A space that should be closed has the outside as its
    other side.
R3  If no place is narrower than the space beside the wall, the wall stands in the open; then the gap is that between
    one of its ends and the nearest other wall, the wider one of the two.
R4  A gap that is narrower than the shortest wall that can be drawn counts as shut: walls reach across it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections.openings import MEETS_M, SAID_WALL_M, WALL_REACH_M
from houseexpo.tolerances import MIN_DOOR_M

_CELL_M: Final = 0.05
"""The usual cell of a robot's map, metres; a finer gap is not seen."""
_MOST_CELLS: Final = 1_000_000
"""Some tenths of a second."""
_MOST_SHUT: Final = 8
"""Narrower gaps that are shut, one by one, before the search ends."""
_WIDER: Final = (1.2, 1.6, 2.4)
"""How far from the middle of a gap its jambs are looked for, in half widths: it may lie before a thick wall."""

Gap = tuple[tuple[float, float], tuple[float, float]]
_Floats = npt.NDArray[np.float64]
_Cell = tuple[int, int]


def find_gap(
    line: Sequence[Sequence[float]],
    rooms: Sequence[Polygon],
    standing: Iterable[BaseGeometry],
    drawn: Iterable[BaseGeometry] = (),
) -> Gap | None:
    """Return the ends of the gap that lets one walk from one side of a wall to the other, or None if there is none.

    Parameters
    ----------
    line
        The ends of the wall, or one point in a space that should be closed. All coordinates are metres of the plan.
    rooms
        The rooms of the plan, without the wall.
    standing
        The walls that stand, and whatever may close their gaps.
    drawn
        The walls that were drawn, and the openings and doors that wait for others; in a room they bound the space too.
    """
    ends = np.array(line, dtype=np.float64)
    is_wall = len(ends) > 1
    own = _wall_along(ends) if is_wall else Polygon()
    sides = _beside(ends) if is_wall else ends
    there = next((room for room in rooms if all(room.distance(Point(at)) < MEETS_M for at in sides)), None)
    if there is not None:  # R1
        around, barrier = there, shapely.union_all([there.boundary.buffer(MEETS_M), own, *drawn])
    else:
        barrier = shapely.union_all([*standing, *rooms, own, *drawn])
        if barrier.is_empty:
            return None
        around = shapely.box(*barrier.bounds).buffer(WALL_REACH_M, join_style="mitre")
    for _ in range(_MOST_SHUT):
        gap = _gap(ends, sides, around, barrier)
        if gap is None or math.dist(*gap) >= MIN_DOOR_M:
            return None if gap is None else _at_end(gap, ends)
        barrier = shapely.union(barrier, _wall_along(gap))  # R4
    return None


def _gap(ends: _Floats, sides: _Floats, around: Polygon, barrier: BaseGeometry) -> _Floats | None:
    """Return the ends of the narrowest place on the widest way (R2, R3)."""
    is_wall = len(ends) > 1
    field = _Field(around, barrier)
    starts = [field.widest_near(ends, at) for at in sides]
    starts += [] if is_wall else [field.widest_at_border()]
    if None in starts:
        return None
    narrow, is_joined = field.narrowest(*starts)  # type: ignore[arg-type]  # none is None
    if not is_joined:
        return None
    gap = None if narrow is None else _across(narrow, barrier)
    if gap is None and is_wall:
        gap = _onward(ends, shapely.difference(barrier, _wall_along(ends).buffer(SAID_WALL_M)))
    return gap


def _wall_along(ends: _Floats) -> Polygon:
    return LineString(ends).buffer(SAID_WALL_M / 2, cap_style="square")


def _at_end(gap: _Floats, ends: _Floats) -> Gap:
    """Return a gap beside an end of the wall moved to this end, so that the next wall continues it; rounded."""
    apart = np.linalg.norm(gap[:, None] - ends[None], axis=2)
    k, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
    if len(ends) > 1 and apart[k, j] < 2 * SAID_WALL_M:
        gap = gap + (ends[j] - gap[k])
    (a, b), (c, d) = (gap.round(3) + 0.0).tolist()
    return (a, b), (c, d)


def _beside(ends: _Floats) -> _Floats:
    """Return a point at each side of a wall."""
    along = (ends[1] - ends[0]) / max(math.dist(*ends), MEETS_M)
    away = np.array([-along[1], along[0]]) * (SAID_WALL_M + _CELL_M)
    return np.array([ends.mean(axis=0) + away, ends.mean(axis=0) - away])


class _Field:
    """The cells of a space, and how far each is from what stands there, in cells."""

    def __init__(self, around: Polygon, barrier: BaseGeometry) -> None:
        x1, y1, x2, y2 = around.bounds
        self._cell = max(_CELL_M, math.sqrt((x2 - x1) * (y2 - y1) / _MOST_CELLS))
        self._low = np.array([x1, y1])
        shape = math.ceil((y2 - y1) / self._cell) + 1, math.ceil((x2 - x1) / self._cell) + 1
        free = self._drawn(shape, around) & ~self._drawn(shape, barrier)
        self._far = _distances(free)

    def _drawn(self, shape: tuple[int, int], area: BaseGeometry) -> npt.NDArray[np.bool_]:
        image = np.zeros(shape, np.uint8)
        parts = [part for part in shapely.get_parts(area).tolist() if isinstance(part, Polygon)]
        rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
        cv2.fillPoly(image, [np.array(self._cells(shapely.get_coordinates(ring)), np.int32) for ring in rings], 1)
        return image.view(np.bool_)

    def _cells(self, points: _Floats) -> npt.NDArray[np.int64]:
        """Return the columns and rows of points."""
        return np.asarray((points - self._low) / self._cell).round().astype(np.int64)

    def widest_near(self, ends: _Floats, side: _Floats) -> _Cell | None:
        """Return the widest place at one side of a wall, no farther away than the wall is long, or of a point."""
        col, row = self._cells(side).tolist()
        middle, reach = self._cells(ends.mean(axis=0)), max(math.dist(ends[0], ends[-1]), 2 * _CELL_M) / self._cell
        rows, cols = np.ogrid[: self._far.shape[0], : self._far.shape[1]]
        away = side - ends.mean(axis=0)
        near = np.hypot(cols - middle[0], rows - middle[1]) <= reach
        if away.any():
            near &= (cols - middle[0]) * away[0] + (rows - middle[1]) * away[1] > 0
        _, part = cv2.connectedComponents((near & (self._far > 0)).view(np.uint8), connectivity=4)
        if not (0 <= row < part.shape[0] and 0 <= col < part.shape[1]) or not part[row, col]:
            return None
        return _largest(np.where(part == part[row, col], self._far, 0.0))

    def widest_at_border(self) -> _Cell | None:
        """Return the widest place at the border of the field."""
        edge: _Floats = np.zeros_like(self._far)
        edge[[0, -1]], edge[:, [0, -1]] = self._far[[0, -1]], self._far[:, [0, -1]]
        return _largest(edge)

    def narrowest(self, start: _Cell, end: _Cell) -> tuple[_Floats | None, bool]:
        """Return the narrowest place on the widest way between two cells, and whether there is a way (R2).

        The place is None if none is narrower than both cells.
        """
        low, high = 0.0, float(min(self._far[start], self._far[end]))
        if not self._joins(start, end, low):
            return None, False
        if self._joins(start, end, high - 0.5):
            return None, True
        while high - low > 0.1:  # cells
            middle = (low + high) / 2
            low, high = (middle, high) if self._joins(start, end, middle) else (low, middle)
        parts = self._parts(high)
        apart = _distances(parts != parts[start]) + _distances(parts != parts[end])
        way = self._parts(low)
        row, col = np.unravel_index(int(np.argmin(np.where(way == way[start], apart, np.inf))), way.shape)
        return self._low + np.array([col, row]) * self._cell, True

    def _joins(self, start: _Cell, end: _Cell, over: float) -> bool:
        parts = self._parts(over)
        return bool(parts[start] == parts[end] > 0)

    def _parts(self, over: float) -> npt.NDArray[np.int32]:
        """Return the connected parts that are farther than ``over`` cells from what stands there."""
        return np.asarray(cv2.connectedComponents((self._far > over).view(np.uint8), connectivity=4)[1], np.int32)


def _distances(mask: npt.NDArray[np.bool_]) -> _Floats:
    """Return how far each cell of a mask is from the cells outside it, in cells."""
    found = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(found, np.float64)


def _largest(values: _Floats) -> _Cell | None:
    row, col = np.unravel_index(int(np.argmax(values)), values.shape)
    return (int(row), int(col)) if values[row, col] > 0 else None


def _across(place: _Floats, barrier: BaseGeometry) -> _Floats | None:
    """Return the shortest line between what stands at two sides of a narrow place, None if only one side has walls."""
    point = Point(place)
    half_m = max(float(point.distance(barrier)), MEETS_M)
    for wider in _WIDER:
        near = shapely.get_parts(shapely.intersection(barrier, point.buffer(wider * half_m))).tolist()
        near.sort(key=point.distance)
        lines = (shapely.shortest_line(near[0], other) for other in near[1:])
        if found := min(
            (line for line in lines if line.length > half_m), key=lambda line: float(line.length), default=None
        ):
            return np.asarray(shapely.get_coordinates(found))
    return None


def _onward(ends: _Floats, others: BaseGeometry) -> _Floats | None:
    """Return the longer of the shortest lines from the wall's ends to what else stands; None where both meet it."""
    lines = [shapely.shortest_line(Point(end), others) for end in ends] if not others.is_empty else []
    widest = max(lines, key=lambda line: float(line.length), default=None)
    return None if widest is None or widest.length < MEETS_M else np.asarray(shapely.get_coordinates(widest))
