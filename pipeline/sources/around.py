"""Walls of which a source shows the surfaces only: their bodies are what lies between and around the rooms' floors.

R1  Rooms whose floors meet have no wall between them; cracks of rounding are none either.
R2  What is narrower than WIDEST_M between floors is wall, and so is whatever they enclose (a shaft, a pillar).
R3  Around all of it goes an outer wall of OUTER_M.
R4  A door's hole goes on to the floors on both sides of it.
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
from pipeline.sources.drawn import Hole, Wall

WIDEST_M = 0.6
OUTER_M = 0.1
CRACK_M = 0.02
REACH_M = 0.7


def walls_around(floors: Sequence[Polygon], top_m: float) -> list[Wall]:
    """Return the walls of a storey, from its floor to ``top_m``."""
    floor = shapely.union_all(floors, grid_size=1e-4)
    whole = mitred(mitred(floor, CRACK_M / 2), -CRACK_M / 2)  # R1
    closed = mitred(mitred(whole, WIDEST_M / 2), -WIDEST_M / 2)  # R2
    filled = shapely.union_all([Polygon(part.exterior) for part in polygons_of(shapely.union(closed, whole))])
    solid = shapely.difference(mitred(filled, OUTER_M), whole)  # R3
    return [Wall(part, 0.0, top_m) for part in polygons_of(solid)]


def deepened(hole: Hole, walls: Sequence[Wall]) -> Hole | None:
    """R4; None where the hole is in no wall."""
    step = REACH_M * np.array(hole.across)
    lane = shapely.convex_hull(shapely.union_all([translate(hole.shape, *step), translate(hole.shape, *-step)]))
    near = [wall.shape for wall in walls if wall.shape.intersects(lane)]
    parts = polygons_of(shapely.intersection(shapely.union_all(near), lane))
    beside = shapely.buffer(hole.shape, CRACK_M)
    through: BaseGeometry = shapely.union_all([part for part in parts if part.intersects(beside)])
    shape = shapely.convex_hull(through)
    return replace(hole, shape=shape) if isinstance(shape, Polygon) else None
