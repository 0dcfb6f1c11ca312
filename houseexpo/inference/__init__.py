"""Find rooms and doors of a plan that has only an outline, such as the published plans.

``with_rooms`` looks for the features of a door in a drawing: walls that end opposite each other, or opposite another
wall, with wider space on both sides. Its docstring describes the method and its accuracy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt

from houseexpo.inference.division import FoundDoor, divide_into_rooms
from houseexpo.inference.openings import find_openings
from houseexpo.inference.snapping import snap_polygon
from houseexpo.inference.windows import place_windows
from houseexpo.plan import Box, Door, Room
from houseexpo.plan.model import PlanData
from houseexpo.plan.room_labels import UNLABELLED, canonical
from houseexpo.tolerances import BOX_COVERS, BOX_FITS, BOX_INSIDE, TINY

if TYPE_CHECKING:
    from shapely import Polygon

__all__ = ["with_rooms"]


Matrix = npt.NDArray[np.float64]
_Plan = TypeVar("_Plan", bound=PlanData)


def with_rooms(plan: _Plan) -> _Plan:
    """Return the plan with rooms and doors that are found from ``verts`` and ``holes`` alone.

    Rooms and doors that the plan already has are ignored and replaced.

    1. *Fronts*: where a wall ends, each of its faces is extended across the opening to the opposite wall, 0.4 to 2.2 m
       away.
    2. *Openings*: two fronts that face each other through the thickness of a wall (0.5 m; 0.8 m for a narrow door),
       with wider space in front of both. Two wall ends are better evidence than one wall end beside a straight wall,
       and narrow openings are better than wide ones.
    3. *Doors*: of openings that overlap, the most likely one. Each door must connect two rooms, must not open most of
       the wall between them, and must not leave a room under 0.8 m2. *Rooms* are the areas that the doors separate.
    4. *Labels*: each box of ``room_category`` belongs to the room that it fits best. A room may have several labels
       (``source_labels``; ``label`` is the best), and is "Unlabelled" without a box. Boxes never change the geometry.

    All doors have the kind "door", since an outline shows no lintels. None is an entrance, since an outline closes
    those. A gap wider than 2.2 m does not separate rooms. Rooms and doors cover the free space on the 1 cm grid and
    share vertices. Pieces of a repaired outline that only touch are separate rooms.

    Accuracy (``tests/benchmarks/test_bench_inference.py``): on 207 plans of the pipeline, given only ``verts`` and
    ``holes``, recall and precision of rooms and of doors are 0.99 or more. Without ``holes`` they are 0.93 and 0.99 for
    rooms, 0.93 and 1.00 for doors. On eight real houses they are 0.93 and 0.99 for rooms, 1.00 and 0.96 for doors. On
    2,000 published plans, the median difference between the number of rooms and ``room_num`` is 1: an outline shows
    neither free-standing walls nor the boundary of rooms at a gap wider than a door.

    Parameters
    ----------
    plan
        A plan of any kind; everything except its rooms and doors stays.

    Raises
    ------
    PlanError
        The outline cannot be repaired.

    Examples
    --------
    >>> left = [(4, 0), (0, 0), (0, 3), (4, 3), (4, 2)]
    >>> right = [(4.1, 2), (4.1, 3), (8, 3), (8, 0), (4.1, 0), (4.1, 1), (4, 1)]
    >>> plan = with_rooms(PlanData("two", left + right, 2, {"Kitchen": ((0, 0, 4.1, 3),)}))
    >>> [(room.label, round(room.area, 1)) for room in plan.rooms]
    [('Kitchen', 12.0), ('Unlabelled', 11.7)]
    >>> plan.doors
    (Door(0, 'door', 1.00 m, rooms 0 and 1),)
    """
    space = plan.free_space
    shapes, doorways = divide_into_rooms(space, find_openings(space))
    order = sorted(range(len(shapes)), key=lambda k: shapes[k].bounds)
    room_id = {k: i for i, k in enumerate(order)}
    names = _labels_of([shapes[k] for k in order], plan.room_category)
    rooms = []
    for i, k in enumerate(order):
        outline, holes = snap_polygon(shapes[k])
        rooms.append(Room(i, _label(names[i]), outline, holes, names[i]))
    doorways.sort(key=lambda d: d.polygon.bounds)
    doors = tuple(_door(i, found, room_id) for i, found in enumerate(doorways))
    windows = place_windows(plan.windows, rooms, plan.objects)
    return replace(plan, rooms=tuple(rooms), doors=doors, windows=windows)


def _label(names: tuple[str, ...]) -> str:
    return next((known for name in names if (known := canonical(name))), UNLABELLED)


def _door(door_id: int, found: FoundDoor, room_id: dict[int, int]) -> Door:
    (x1, y1), (x2, y2) = found.opening.segment.round(2).tolist()
    one, other = sorted(room_id[room] for room in found.rooms)
    return Door(
        id=door_id,
        kind="door",
        segment=((x1, y1), (x2, y2)),
        width=round(((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5, 2),
        ring=snap_polygon(found.polygon)[0],
        rooms=(one, other),
    )


def _labels_of(rooms: list[Polygon], category: Mapping[str, tuple[Box, ...]]) -> list[tuple[str, ...]]:
    """Return the labels of each room, the label of the best-fitting box first.

    A box contains a room of the source with its walls and with objects, which may extend beyond it. Equal boxes are one
    room with several labels.

    R1  Boxes and rooms are paired so that the sum of their intersections over union is largest.
    R2  A remaining box belongs to a room without a box that it covers, since objects may have enlarged the box.
    R3  If there is no such room, several rooms of the source are one here, and the box adds its labels to the room that
        it lies in.
    """
    words: dict[Box, list[str]] = {}
    for label, boxes in category.items():
        for box in boxes:
            words.setdefault(box, []).append(label)
    found: list[list[tuple[bool, float, str]]] = [[] for _ in rooms]
    if words and rooms:
        shared, fit, sizes = _overlaps(rooms, np.array(list(words)))
        paired = _pair_boxes(fit)
        for i, labels in enumerate(words.values()):
            room = paired.get(i)
            if room is None:
                room = _room_of_box(i, shared, fit, sizes, set(paired.values()))
            if room is not None:
                found[room] += [(i in paired, float(fit[i, room]), label) for label in labels]
    ordered = [sorted(names, key=lambda name: (not name[0], -name[1])) for names in found]
    return [tuple(dict.fromkeys(label for *_, label in names)) for names in ordered]


def _overlaps(rooms: list[Polygon], boxes: Matrix) -> tuple[Matrix, Matrix, tuple[Matrix, Matrix]]:
    """Return the shared area and the intersection over union (boxes, rooms), and the areas of boxes and rooms."""
    import shapely

    shapes = shapely.box(*boxes.T)
    box, room = shapely.STRtree(rooms).query(shapes, predicate="intersects")
    shared = np.zeros((len(shapes), len(rooms)))
    shared[box, room] = shapely.area(shapely.intersection(shapes[box], np.array(rooms)[room]))
    sizes = shapely.area(shapes), shapely.area(rooms)
    union = sizes[0][:, None] + sizes[1] - shared
    return shared, shared / np.maximum(union, TINY), sizes


def _pair_boxes(fit: Matrix) -> dict[int, int]:
    """Return the room of each box (R1)."""
    from scipy.optimize import linear_sum_assignment

    pairs = zip(*(k.tolist() for k in linear_sum_assignment(-fit)), strict=True)
    return {box: room for box, room in pairs if fit[box, room] > BOX_FITS}


def _room_of_box(box: int, shared: Matrix, fit: Matrix, sizes: tuple[Matrix, Matrix], taken: set[int]) -> int | None:
    """Return the room of a remaining box (R2, R3)."""
    covered = [k for k in range(len(sizes[1])) if k not in taken and shared[box, k] > BOX_COVERS * sizes[1][k]]
    if covered:
        return max(covered, key=lambda k: float(fit[box, k]))
    room = int(shared[box].argmax())
    return room if shared[box, room] > BOX_INSIDE * sizes[0][box] else None
