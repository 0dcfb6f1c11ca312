"""Furnish a finished plan: place furniture room by room, then cut it out of the plan and check the result.

1. Each room is furnished by its label (``room``), from one source of chance: a plan and a seed give the same furniture.
   In a home of one room, the living room has a bed. On stairs nothing stands.
2. Footprints are cut out of the outline, or become holes of it, and are cut out of the rooms (docs/format.md).
3. The plan keeps its bounds and stays in one piece, and a robot of 0.2 m gets wherever it got before, as
   ``houseexpo.analysis.navigability`` says. Rooms in which it does not are left empty; if that does not help, all are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.analysis.navigability import disc_centre_areas, navigability
from houseexpo.floorplan import FloorPlan
from houseexpo.inference.snapping import snap_polygon, snap_ring
from houseexpo.plan import NavigabilityByRadius, PlanObject, Room
from houseexpo.plan.ids import parts_of
from houseexpo.tolerances import ROBOT_M
from pipeline.furnish.catalogue import ONE_ROOM, WANTS, FurnitureWish
from pipeline.furnish.room import CM_PER_M, PlacedPiece, RoomFurnisher, has_simple_rings, round_to_cm

"""In the id of a storey of several, whose beds may be on another."""
_BESIDE_ONE_ROOM = frozenset(
    {
        "Bathroom",
        "Toilet",
        "Kitchen",
        "Hallway",
        "Hall",
        "Entryway",
        "Storage",
        "Wardrobe",
        "Balcony",
        "Terrace",
        "Loggia",
    }
)
"""What a home of one room may have beside that room."""
_Furniture = Mapping[int, list[PlacedPiece]]
"""By room."""


def draw_whether_furnished(share: float, rng: np.random.Generator) -> bool:
    """Return whether a plan is among the share, 0 to 1, that is furnished."""
    return bool(rng.random() < share)


def furnish_plan(plan: FloorPlan, rng: np.random.Generator) -> FloorPlan:
    """Return the plan with furniture as ``objects``; itself where nothing fits, or has furniture already."""
    if not plan.rooms or plan.furniture:
        return plan
    found = {room.id: _of_room(plan, room, rng) for room in plan.rooms}
    while any(found.values()):
        made = _cut(plan, found)
        wrong = set(found) if made is None else _unreached_rooms(plan, made)
        if made is not None and not wrong:
            return replace(made, navigability=navigability(made))
        found = {room: pieces for room, pieces in found.items() if room not in wrong}
    return plan


def _of_room(plan: FloorPlan, room: Room, rng: np.random.Generator) -> list[PlacedPiece]:
    """Return the furniture of a room."""
    doors, windows = ([hole for hole in holes if room.id in hole.rooms] for holes in (plan.doors, plan.windows))
    return RoomFurnisher(room, doors, _wants(plan, room), rng, windows).furnish()


def _wants(plan: FloorPlan, room: Room) -> tuple[FurnitureWish, ...]:
    """Return what a room may hold: a living room in a home of one room a bed, too, and a stair nothing."""
    if any("stair" in word.lower() for word in room.source_labels):
        return ()
    others = {each.label for each in plan.rooms if each.id != room.id}
    is_home = "Bathroom" in others and others <= _BESIDE_ONE_ROOM and not parts_of(plan.id).level
    return ONE_ROOM if is_home and room.label == "Living_Room" else WANTS.get(room.label, ())


def _cut(plan: FloorPlan, found: _Furniture) -> FloorPlan | None:
    """Return the plan with the pieces cut out (R2), or None if it is no plain polygon of the same bounds then."""
    shapes = {room: [shapely.box(*each.box.tolist()) for each in pieces] for room, pieces in found.items()}
    whole = round_to_cm(Polygon(plan.verts, plan.holes))
    outline = shapely.difference(whole, shapely.union_all([box for boxes in shapes.values() for box in boxes]))
    if not has_simple_rings(outline) or outline.bounds != whole.bounds:
        return None
    rooms = []
    for room in plan.rooms:
        left = shapely.difference(round_to_cm(room.polygon), shapely.union_all(shapes.get(room.id, [])))
        if not has_simple_rings(left):
            return None
        polygon, holes = snap_polygon(_in_metres(left))
        rooms.append(replace(room, ring=polygon, holes=holes))
    verts, holes = snap_polygon(_in_metres(outline))
    return replace(
        plan,
        verts=verts,
        holes=holes,
        rooms=tuple(rooms),
        objects=(*plan.objects, *_objects(found, len(plan.objects))),
        navigability=NavigabilityByRadius(),
    )


def _objects(found: _Furniture, first: int) -> list[PlanObject]:
    pieces = [(room, each) for room in sorted(found) for each in found[room]]
    rings = [snap_ring(_in_metres(shapely.box(*each.box.tolist())).exterior, clockwise=True) for _, each in pieces]
    return [
        PlanObject(number, each.piece.label, room, ring, each.piece.height / CM_PER_M)
        for number, ((room, each), ring) in enumerate(zip(pieces, rings, strict=True), first)
    ]


def _in_metres(shape: Polygon) -> Polygon:
    return shapely.transform(shape, lambda points: points / CM_PER_M)


def _unreached_rooms(before: FloorPlan, after: FloorPlan) -> set[int]:
    """Return the furnished rooms in which the robot does not get wherever it got before (R3)."""
    was, now = (disc_centre_areas(plan.free_space, ROBOT_M) for plan in (before, after))
    furnished_rooms = {thing.room for thing in after.objects if thing.room is not None}
    if not now:
        return furnished_rooms
    cut_off = now[1:] if len(now) > len(was) else []
    wrong = {
        room.id
        for room, shape in ((room, room.polygon) for room in before.rooms if room.id in furnished_rooms)
        if (was and shape.intersects(was[0]) and not shape.intersects(now[0]))
        or any(shape.intersects(part) for part in cut_off)
    }
    return wrong or (furnished_rooms if cut_off else wrong)
