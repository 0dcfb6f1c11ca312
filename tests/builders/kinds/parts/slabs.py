"""Floors, ceilings, roofs and stairs."""

from __future__ import annotations

import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from shapely import box

from tests.builders.kinds.parts.solids3d import prism
from tests.builders.kinds.values import Storey

RISER_M = 0.175


def floor_slab(storey: Storey, thickness: float, top: float = 0.0) -> trimesh.Trimesh:
    """A slab under a storey, open where a stair comes up."""
    voids = [c.polygon for c in storey.cells if not c.floor]
    wells = shapely.union_all(voids).difference(storey.wall_area) if voids else shapely.Polygon()
    return prism(storey.footprint.difference(wells), top - thickness, top)


def flight(above: Storey, rise: float) -> list[trimesh.Trimesh]:
    """The steps of a stair that turns back on a half landing, under the void of the storey above, from z = 0.

    It starts and ends at the landing of each storey, so that storeys can stand over one another.
    """
    landing = next(k for k, c in enumerate(above.cells) if c.label == "Stair")
    void = next(k for k, c in enumerate(above.cells) if not c.floor)
    x1, y1, x2, y2 = above.rooms[void].bounds
    way = np.array(above.rooms[void].centroid.coords[0]) - above.rooms[landing].centroid.coords[0]
    axis = int(np.argmax(np.abs(way)))
    if axis == 0:
        near, far, low, high = (x1, x2, y1, y2) if way[0] > 0 else (x2, x1, y1, y2)
    else:
        near, far, low, high = (y1, y2, x1, x2) if way[1] > 0 else (y2, y1, x1, x2)
    half, middle, sign = max(4, round(rise / RISER_M / 2)), (low + high) / 2, float(np.sign(far - near))
    run = (abs(far - near) - min(0.9, abs(far - near) / 3)) / half
    turn = near + sign * run * half

    def step(a: float, b: float, c: float, d: float, z: float) -> trimesh.Trimesh:
        (a, b), (c, d) = sorted((a, b)), sorted((c, d))
        return prism(box(a, c, b, d) if axis == 0 else box(c, a, d, b), max(0.0, z - 0.2), z)

    each, steps = rise / 2 / half, []
    for k in range(half):
        a, b = near + sign * run * k, near + sign * run * (k + 1)
        steps.append(step(a, b, low, middle - 0.05, each * (k + 1)))
        steps.append(step(a, b, middle + 0.05, high, rise - each * (k + 1)))
    return [*steps, step(turn, far, low, high, rise / 2)]


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
