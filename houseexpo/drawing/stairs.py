"""Draw the stairs of a plan as lines: treads, and an arrow from where one steps on; and say if it leads up or down.

A plan says where stairs are: in a room that the source calls so, as furniture, or as an opening in the floor above.
It does not say where they turn, so that follows from the shape and from the side at which they are open to a room.

A1  Open at the end of a slim rectangle, a stair is straight; of a broad one, it has two flights with a landing between.
A2  Open at a long side, it begins with winders at the nearer end.
A3  Going up one keeps right in two flights, going down left, so that both storeys show the same stair.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.plan import Room
from houseexpo.plan.model import PlanData
from houseexpo.tolerances import ENTRANCE_TOUCH_M

if TYPE_CHECKING:
    from shapely import Polygon

Points = npt.NDArray[np.float64]

_GOING_M: Final = 0.26  # a tread is about as deep
_FLIGHTS_M: Final = 1.6  # from this width on there is place for two flights
_LANDING_M: Final = 0.9  # the depth of the landing between them
_MOST_M: Final = (3.4, 8.0)  # what is broader or longer is more than a stair
_FILLED: Final = 0.9  # the share of its rectangle that a stair fills
_HEAD_M: Final = 0.15  # the length and half the breadth of an arrow's head, and its distance from the ends


class DrawnStair(NamedTuple):
    """A stair: its treads as lines (n, 2), the arrow and its head, metres; how broad a flight is; if it leads down."""

    treads: list[Points]
    way: Points
    head: Points
    broad_m: float
    is_down: bool


def is_stair(room: Room) -> bool:
    """Return whether the source calls a room a stair, and nothing else."""
    return [word.lower() for word in room.source_labels] in [["stair"], ["stairs"]]


def stair_lines(plan: PlanData) -> Iterator[Points]:
    """Yield the lines of all stairs, (n, 2) metres: treads, and for each an arrow and its head."""
    for stair in drawn_stairs(plan):
        yield from (*stair.treads, stair.way, stair.head)


def drawn_stairs(plan: PlanData) -> Iterator[DrawnStair]:
    """Yield the stairs of a plan as they are drawn."""
    for shape, foot, is_down in _stairs(plan):
        found = _place(shape, foot)
        if found is not None:
            (corner, inward, along), deep, wide, at = found
            frame = np.array([inward, along])
            *treads, way, head = (
                corner + np.array(line, dtype=np.float64) @ frame for line in _lines(deep, wide, at, is_down=is_down)
            )
            broad = min(wide, deep)
            yield DrawnStair(treads, way, head, broad if broad < _FLIGHTS_M else broad / 2, is_down)


def _stairs(plan: PlanData) -> Iterator[tuple[Polygon, Points, bool]]:
    """Yield the area of each stair, the middle of its edge at a room, and whether it leads down from there."""
    import shapely

    for room in plan.rooms:
        doors = [door for door in plan.doors if room.id in door.rooms and None not in door.rooms]
        if doors and is_stair(room):
            yield room.polygon, np.mean(doors[0].segment, axis=0), False
    for thing in plan.objects:
        if thing.label == "stairs":
            near = plan.free_space.buffer(ENTRANCE_TOUCH_M).intersection(thing.polygon.exterior)
            edges = shapely.get_parts(shapely.line_merge(near))
            if len(edges):
                longest = edges[int(np.argmax(shapely.length(edges)))]
                middle = shapely.get_coordinates(longest.interpolate(0.5, normalized=True))[0]
                yield thing.polygon, middle, thing.is_stairwell


def _place(shape: Polygon, foot: Points) -> tuple[tuple[Points, Points, Points], float, float, float] | None:
    """Return a corner at the foot, the directions inward and along, depth, width, and where the foot is along it."""
    import shapely

    box = shapely.oriented_envelope(shape)
    if box.geom_type != "Polygon" or shape.area < _FILLED * box.area:
        return None
    corners = shapely.get_coordinates(shapely.orient_polygons(box))[:4]
    sides = [shapely.LineString([corners[k], corners[(k + 1) % 4]]) for k in range(4)]
    k = int(np.argmin(shapely.distance(sides, shapely.Point(foot))))
    a, b, c = corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4]
    wide, deep = float(np.hypot(*(b - a))), float(np.hypot(*(c - b)))
    if min(wide, deep) > _MOST_M[0] or max(wide, deep) > _MOST_M[1] or min(wide, deep) < 3 * _HEAD_M:
        return None
    along = (b - a) / wide
    return (a, (c - b) / deep, along), deep, wide, float((foot - a) @ along)


def _lines(deep: float, wide: float, at: float, *, is_down: bool) -> Iterator[list[tuple[float, float]]]:
    """Yield treads and arrow in a frame whose first axis leads from the foot's side inward, the second along it."""
    if wide > deep and wide > _FLIGHTS_M:  # A2
        turn = deep * float(np.tan(np.pi / 6))
        fan = [[(0.0, deep), (turn, 0.0)], [(0.0, deep), (deep, deep - turn)]]
        treads = [[(0.0, v), (deep, v)] for v in (deep, *_steps(deep, wide))]
        way = [(_HEAD_M, deep / 2), (deep / 2, deep / 2), (deep / 2, wide - _HEAD_M)]
        lines, flip = [*fan, *treads], at > wide / 2
    elif wide < _FLIGHTS_M:  # A1
        lines = [[(u, 0.0), (u, wide)] for u in _steps(0.0, deep)]
        way, flip = [(_HEAD_M, wide / 2), (deep - _HEAD_M, wide / 2)], False
    else:
        turn = deep - min(_LANDING_M, deep / 2)
        lines = [[(0.0, wide / 2), (turn, wide / 2)], *([(u, 0.0), (u, wide)] for u in [*_steps(0.0, turn), turn])]
        end = (turn + deep) / 2
        way = [(_HEAD_M, wide / 4), (end, wide / 4), (end, 3 * wide / 4), (_HEAD_M, 3 * wide / 4)]
        flip = is_down  # A3
    (x, y), (u, v) = way[-2:]
    du, dv = (_HEAD_M * float(np.sign(each)) for each in (u - x, v - y))
    head = [(u - du + dv / 2, v - dv + du / 2), (u, v), (u - du - dv / 2, v - dv - du / 2)]
    for line in (*lines, way, head):
        yield [(u, wide - v) for u, v in line] if flip else line


def _steps(start: float, end: float) -> list[float]:
    """Return where treads end between two places."""
    number = max(round((end - start) / _GOING_M), 1)
    return [start + k * (end - start) / number for k in range(1, number)]
