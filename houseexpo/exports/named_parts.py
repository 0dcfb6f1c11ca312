"""Divide a plan's floor and walls into parts with the names that programs read: floors of rooms, doorways, entrances.

N1  ``kitchen_floor_3`` is the floor of room 3. Its label comes first, since the last word says what the part is: a
    ``toilet_floor_4`` is a floor, a ``floor_4_toilet`` may be taken for a toilet.
N2  ``door_threshold_2`` is the floor in door 2, from jamb to jamb, ``opening_threshold_2`` that in an opening, and
    ``floor`` is what is under the walls.
N3  ``entrance_door_5`` is the shut door of entrance 5: what stands in the wall there, up to the height of doors.
The parts cover exactly what ``floor`` and ``walls`` would without them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely

from houseexpo.exports.openings import wall_openings
from houseexpo.exports.plan_bodies import PlanBodies
from houseexpo.tolerances import CRUMB_M2

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry


def room_floors(built: PlanBodies) -> dict[str, BaseGeometry]:
    """Return the floor of each room by its name (N1), metres; none for a plan without rooms."""
    return {f"{room.label.lower()}_floor_{room.id}": room.polygon for room in built.plan.rooms}


def doorway_floors(built: PlanBodies) -> dict[str, BaseGeometry]:
    """Return the floor in each doorway by its name (N2), metres; entrances, which are shut, have none."""
    kinds = {"opening": "opening", "cut": "opening", "door": "door"}
    return {f"{kinds[d.kind]}_threshold_{d.id}": d.polygon for d in built.plan.doors if d.kind in kinds}


def entrance_doors(built: PlanBodies, wall_thickness: float) -> dict[str, BaseGeometry]:
    """Return what stands in the wall at each entrance by its name (N3), metres."""
    if all(door.kind != "entrance" for door in built.plan.doors):
        return {}
    walls = shapely.union_all(built.walls)
    found = {}
    for each in wall_openings(built.plan, wall_thickness):
        if each.door.kind == "entrance":
            shape = shapely.intersection(walls, each.shape)
            if shape.area > CRUMB_M2:
                found[f"entrance_door_{each.door.id}"] = shape
    return found


def unnamed_floor(built: PlanBodies, parts: dict[str, BaseGeometry]) -> BaseGeometry:
    """Return the floor of the house without the parts that have names of their own, metres."""
    slab = shapely.union_all([built.space, *built.walls])
    return shapely.difference(slab, shapely.union_all(list(parts.values())))
