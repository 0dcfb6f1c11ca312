"""Furniture put into the rooms of a storey: at walls, clear of doors and of each other; names in several languages."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from shapely import Polygon, box

from tests.builders.kinds.parts.furniture import SORTS, thing
from tests.builders.kinds.parts.openings import HALLS
from tests.builders.kinds.parts.solids3d import moved
from tests.builders.kinds.values import OUTSIDE, Storey

CLEAR_M = 0.75
"""How much of the floor before a door stays free."""

HIGH = {"lamp", "wall_shelf"}
TRIES = 25


PROGRAMS = {
    "Bedroom": ["bed", "wardrobe", "dresser", "chair", "lamp", "rug", "wall_shelf", "plant"],
    "Child_Room": ["bed", "desk", "shelf", "wardrobe", "lamp", "rug"],
    "Guest_Room": ["bed", "wardrobe", "chair", "lamp"],
    "Living_Room": [
        "sofa",
        "tv",
        "shelf",
        "coffee_table",
        "plant",
        "floor_lamp",
        "rug",
        "lamp",
        "chair",
        "dining_table",
    ],
    "Dining_Room": ["dining_table", "dresser", "lamp", "plant"],
    "Kitchen": ["kitchen", "dining_table", "lamp"],
    "Bathroom": ["toilet", "basin", "bathtub", "shower"],
    "Toilet": ["toilet", "basin"],
    "Office": ["desk", "shelf", "chair", "lamp", "plant"],
    "Garage": ["car", "shelf"],
    "Storage": ["shelf"],
    "Wardrobe": [],
    "Corridor": ["dresser", "lamp", "plant"],
}
"""What stands in a room of each label."""


@dataclass(frozen=True, eq=False)
class Thing:
    """A piece of furniture in its place."""

    sort: str
    mesh: trimesh.Trimesh
    room: int


def furnished(storey: Storey, rng: Generator, share: float = 0.8) -> list[Thing]:
    """Furniture for each room by its label; ``share`` of its programme, as far as there is space."""
    things = []
    for k, cell in enumerate(storey.cells):
        label = "Corridor" if cell.label in HALLS else cell.label
        if cell.floor and label in PROGRAMS and cell.label != "Stair":
            chosen = [s for s in PROGRAMS[label] if rng.random() < share]
            things += in_room(storey, k, chosen, rng)
    return things


def in_room(storey: Storey, index: int, sorts: list[str], rng: Generator) -> list[Thing]:
    """Place pieces one after another; what does not fit is left out."""
    room = storey.rooms[index]
    blocked = [clearance(storey, k) for k, o in enumerate(storey.openings) if index in storey.walls[o.wall].sides]
    taken, things = shapely.union_all([b for b in blocked if b is not None]), []
    for sort in sorts:
        for _ in range(TRIES):
            piece = thing(sort, rng, storey.height)
            found = place(room, piece, SORTS[sort].place, rng)
            if found is None:
                continue
            mesh, area = found
            free = sort in HIGH or sort == "rug" or not area.intersects(taken)
            if room.buffer(0.002).contains(area) and free:
                if sort not in HIGH and sort != "rug":
                    taken = taken.union(area)
                things.append(Thing(sort, mesh, index))
                break
    return things


def clearance(storey: Storey, number: int) -> Polygon | None:
    """The floor before a door that furniture leaves free; None for a window."""
    opening = storey.openings[number]
    if opening.kind == "window":
        return None
    wall = storey.walls[opening.wall]
    deep = max(CLEAR_M, opening.width / len(opening.leaves) if opening.leaves else 0.0)
    return wall.strip(opening.start - 0.05, opening.end + 0.05, wall.thickness + 2 * deep)


def place(room: Polygon, piece: trimesh.Trimesh, how: str, rng: Generator) -> tuple[trimesh.Trimesh, Polygon] | None:
    """A piece at a random place of its sort, and its footprint."""
    (x1, y1, _), (x2, y2, _) = piece.bounds
    if how == "wall":
        ring = np.asarray(shapely.geometry.polygon.orient(room).exterior.coords)
        k = int(rng.integers(len(ring) - 1))
        a, b = ring[k], ring[k + 1]
        length = float(np.hypot(*(b - a)))
        if length < x2 - x1 + 0.02:
            return None
        along = (b - a) / length
        s = rng.choice([-x1 + 0.01, length - x2 - 0.01, rng.uniform(-x1, length - x2)])
        gap = float(rng.choice([0.01, 0.02, 0.05]))
        spot = a + s * along + gap * np.array([-along[1], along[0]])
        turn = math.atan2(along[1], along[0])
    else:
        spot = np.array(room.representative_point().coords[0]) + rng.normal(0, 0.4, 2)
        turn = float(rng.choice([0.0, math.pi / 2]))
        spot = spot - turned(np.array([0.0, (y1 + y2) / 2]), turn)
    placed = moved(piece, float(spot[0]), float(spot[1]), 0.0, turn)
    corners = [turned(np.array(c), turn) + spot for c in box(x1, y1, x2, y2).exterior.coords]
    return placed, Polygon(corners)


def turned(point: np.ndarray, angle: float) -> np.ndarray:
    """A point turned about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def seen_from(storey: Storey, wall: int) -> int:
    """The cell on the inner side of an outer wall."""
    return next(s for s in storey.walls[wall].sides if s != OUTSIDE)
