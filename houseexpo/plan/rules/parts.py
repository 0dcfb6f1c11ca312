"""Rules about everything but the rings: ids, labels, boxes, rooms, doors, objects, navigability."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import dist
from typing import Final

from houseexpo.plan.categories import LABELS
from houseexpo.plan.model import PlanData
from houseexpo.plan.parts import RADII_M
from houseexpo.plan.rules.rings import Broken

TILE_M2: Final = 0.05
_CM: Final = 0.01
_SPECK_M2: Final = 0.01  # the area that rounding to centimetres moves along a wall
_PUBLISHED_ID: Final = re.compile(r"[0-9a-f]{32}")
_RADII: Final = frozenset(f"{radius:.2f}" for radius in RADII_M)


def identity(plan: PlanData) -> Iterator[Broken]:
    """A published id has 32 hex digits."""
    if not _PUBLISHED_ID.fullmatch(plan.id):
        yield "id", f"expected 32 hex digits, found {plan.id!r}"


def count(plan: PlanData) -> Iterator[Broken]:
    """``room_num`` is 1 or more, and a published ring has 4 vertices or more."""
    if plan.room_num < 1:
        yield "room_num", f"expected 1 or more, found {plan.room_num}"
    if len(plan.verts) < 4 and not plan.rooms:
        yield "verts", f"expected 4 vertices or more, found {len(plan.verts)}"


def labels(plan: PlanData) -> Iterator[Broken]:
    """Labels of boxes are among the 25."""
    for label in plan.room_category:
        if label not in LABELS:
            yield f"room_category.{label}", "expected one of the 25 labels, found another word"


def boxes(plan: PlanData) -> Iterator[Broken]:
    """A box runs from its least to its greatest corner."""
    for label, found in plan.room_category.items():
        for i, (x1, y1, x2, y2) in enumerate(found):
            if not (x1 < x2 and y1 < y2):
                yield f"room_category.{label}[{i}]", f"expected x1 < x2 and y1 < y2, found {[x1, y1, x2, y2]}"


def rooms(plan: PlanData) -> Iterator[Broken]:
    """Rooms are valid, lie in the free space, do not overlap, and together with the doors cover it (to 0.05 m2)."""
    import shapely

    shapes = [room.polygon for room in plan.rooms]
    for i, shape in enumerate(shapes):
        if not shape.is_valid:
            yield f"rooms[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(shape)}"
            return
    doors = [door.polygon for door in plan.doors if door.kind != "entrance" and door.polygon.is_valid]
    together = shapely.union_all([*shapes, *doors])
    overlap = sum(shape.area for shape in shapes) - shapely.union_all(shapes).area
    if overlap > _SPECK_M2:
        yield "rooms", f"expected rooms that do not overlap, found {overlap:.3f} m2 in two of them"
    outside = shapely.union_all(shapes).difference(plan.free_space).area
    if outside > _SPECK_M2:
        yield "rooms", f"expected rooms inside the free space, found {outside:.3f} m2 outside"
    gap = plan.free_space.symmetric_difference(together).area
    if gap > TILE_M2:
        yield "rooms", f"expected rooms and doors to tile the free space to {TILE_M2} m2, found {gap:.3f} m2 off"


def doors(plan: PlanData) -> Iterator[Broken]:
    """A door's width is the length of its segment, and its segment crosses its polygon.

    An opening may have any width: the pipeline finds gaps of up to 1.5 m, but the source may state a wider opening.
    """
    import shapely

    for i, door in enumerate(plan.doors):
        if not door.polygon.is_valid:
            yield f"doors[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(door.polygon)}"
            continue
        length = dist(*door.segment)
        if abs(length - door.width) > 2 * _CM:
            yield f"doors[{i}].width", f"expected the segment's length, {length:.2f} m, found {door.width:.2f} m"
        if shapely.LineString(door.segment).interpolate(0.5, normalized=True).distance(door.polygon) > 2 * _CM:
            yield f"doors[{i}].segment", "expected it to run through the door's polygon, found it elsewhere"


def objects(plan: PlanData) -> Iterator[Broken]:
    """An object's footprint is a simple ring outside the free space, apart from rounding along its edge."""
    import shapely

    for i, thing in enumerate(plan.objects):
        if not thing.polygon.is_valid:
            yield f"objects[{i}].polygon", f"expected a simple ring, found {shapely.is_valid_reason(thing.polygon)}"
            continue
        free = thing.polygon.intersection(plan.free_space).area
        if free > _SPECK_M2 + _CM * thing.polygon.length:
            yield f"objects[{i}].polygon", f"expected an obstacle, found {free:.3f} m2 of free space in it"


def reach(plan: PlanData) -> Iterator[Broken]:
    """Navigability is given for the six radii, and shares lie between 0 and 1."""
    if plan.navigability and set(plan.navigability) != _RADII:
        yield "navigability", f"expected the radii {', '.join(sorted(_RADII))}, found {', '.join(plan.navigability)}"
    for radius, found in plan.navigability.items():
        if not 0 <= found.largest_share <= 1:
            yield f"navigability.{radius}.largest_share", f"expected 0 to 1, found {found.largest_share}"
