"""Floors, ceilings, roofs and stairs."""

from __future__ import annotations

import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from shapely import box

from tests.builders.kinds.solids3d import prism
from tests.builders.kinds.values import Storey

RISER_M = 0.175


def floor_slab(storey: Storey, thickness: float, top: float = 0.0) -> trimesh.Trimesh:
    """A slab under a storey, open where a stair comes up."""
    voids = [c.polygon for c in storey.cells if not c.floor]
    wells = shapely.union_all(voids).difference(storey.wall_area) if voids else shapely.Polygon()
    return prism(storey.footprint.difference(wells), top - thickness, top)


def flight(below: Storey, above: Storey, rise: float) -> list[trimesh.Trimesh]:
    """The steps of a straight flight in the stair's room, up to the landing of the storey above."""
    stair = next(k for k, c in enumerate(below.cells) if c.label == "Stair")
    landing = next(k for k, c in enumerate(above.cells) if c.label == "Stair")
    void = next(k for k, c in enumerate(above.cells) if not c.floor)
    room = below.rooms[stair]
    way = np.array(above.rooms[landing].centroid.coords[0]) - above.rooms[void].centroid.coords[0]
    axis = int(np.argmax(np.abs(way)))
    sign = float(np.sign(way[axis]))
    x1, y1, x2, y2 = above.rooms[void].bounds
    low, high = (x1, x2) if axis == 0 else (y1, y2)
    count = max(3, round(rise / RISER_M))
    run = min(0.28, (high - low) / count)
    side = float(min(1.05, (y2 - y1 if axis == 0 else x2 - x1)))
    steps = []
    for k in range(count - 1):
        end = (high - k * run, high - (k + 1) * run) if sign > 0 else (low + (k + 1) * run, low + k * run)
        a, b = end[1], end[0]
        area = box(a, y2 - side, b, y2) if axis == 0 else box(x1, a, x1 + side, b)
        z = rise * (count - 1 - k) / count
        steps.append(prism(area.intersection(room.buffer(0.02)), max(0.0, z - 0.2), z))
    return steps


def pitched_roof(storey: Storey, base: float, rng: Generator) -> trimesh.Trimesh:
    """A gable roof of two sloped slabs over the footprint's box, with eaves."""
    x1, y1, x2, y2 = storey.footprint.bounds
    eave, slope, thick = 0.4, float(rng.uniform(0.5, 1.0)), 0.2
    half = (y2 - y1) / 2 + eave
    top = base + half * slope
    profile = [(y1 - eave, base), ((y1 + y2) / 2, top), (y2 + eave, base)]
    points = [(x, y, z + d) for d in (0.0, thick) for x in (x1 - eave, x2 + eave) for y, z in profile]
    quads = [(0, 1, 4, 3), (1, 2, 5, 4), (6, 9, 10, 7), (7, 10, 11, 8), (0, 6, 7, 1), (1, 7, 8, 2), (3, 4, 10, 9),
             (4, 5, 11, 10), (0, 3, 9, 6), (2, 8, 11, 5)]  # fmt: skip
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return trimesh.Trimesh(np.array(points), np.array(faces), process=False)
