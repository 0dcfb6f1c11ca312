"""Walls of which a source shows the surfaces only: their bodies are what lies between and around the rooms' floors.

R1  Rooms whose floors meet have no wall between them; cracks of rounding are none either.
R2  What is narrower than WIDEST_M between floors is wall, and so is whatever they enclose (a shaft, a pillar).
R3  Around all of it goes an outer wall of OUTER_M.
R4  A door's hole goes on to the floors on both sides of it. One that each of its rooms has for itself is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import mitred, polygons_of
from pipeline.sources.drawn_storeys import Hole, Wall

WIDEST_M = 0.6
OUTER_M = 0.1
CRACK_M = 0.02
REACH_M = 0.7
APART_M = 0.4


def walls_around(floors: Sequence[Polygon], top_m: float) -> list[Wall]:
    """Return the walls of a storey, from its floor to ``top_m``."""
    floor = shapely.union_all(floors, grid_size=1e-4)
    whole = mitred(mitred(floor, CRACK_M / 2), -CRACK_M / 2)  # R1
    closed = mitred(mitred(whole, WIDEST_M / 2), -WIDEST_M / 2)  # R2
    filled = shapely.union_all([Polygon(part.exterior) for part in polygons_of(shapely.union(closed, whole))])
    solid = shapely.difference(mitred(filled, OUTER_M), whole)  # R3
    return [Wall(part, 0.0, top_m) for part in polygons_of(solid)]


def deepened(hole: Hole, walls: Sequence[Wall]) -> Hole | None:
    """R4, or None if the hole is in no wall."""
    step = REACH_M * np.array(hole.across)
    lane = shapely.convex_hull(shapely.union_all([translate(hole.shape, *step), translate(hole.shape, *-step)]))
    near = [wall.shape for wall in walls if wall.shape.intersects(lane)]
    parts = polygons_of(shapely.intersection(shapely.union_all(near), lane))
    beside = shapely.buffer(hole.shape, CRACK_M)
    through: BaseGeometry = shapely.union_all([part for part in parts if part.intersects(beside)])
    shape = shapely.convex_hull(through)
    return replace(hole, shape=shape) if isinstance(shape, Polygon) else None


def one_each(holes: Sequence[Hole]) -> list[Hole]:
    """R4: holes that lie beside each other, along most of their length, as one; a hole is wider than deep."""
    groups: list[list[Hole]] = []
    for hole in holes:
        near = next((group for group in groups if any(_is_one(other.shape, hole.shape) for other in group)), None)
        if near is None:
            groups.append([hole])
        else:
            near.append(hole)
    return [_united(group) for group in groups]


def _is_one(one: Polygon, other: Polygon) -> bool:
    shared = shapely.intersection(shapely.buffer(one, APART_M), other).area
    back = shapely.intersection(shapely.buffer(other, APART_M), one).area
    return bool(shared > 0.8 * other.area and back > 0.8 * one.area)


def _united(parts: Sequence[Hole]) -> Hole:
    box = shapely.minimum_rotated_rectangle(shapely.union_all([part.shape for part in parts]))
    sides = np.diff(shapely.get_coordinates(box)[:3], axis=0)
    lengths = np.hypot(*sides.T)
    x, y = sides[int(np.argmin(lengths))] / max(float(lengths.min()), 1e-9)
    low, high = min(part.bottom_m for part in parts), max(part.top_m for part in parts)
    return Hole(box, low, high, any(part.has_door for part in parts), (float(x), float(y)))
