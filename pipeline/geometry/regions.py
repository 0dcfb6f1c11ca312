"""Bounded pieces of the free space between walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import Shapes, mitred, overlap, overlaps, polygons_of, subtract, united

OUTSIDE = -1
WALL = -2
SPECK_M2 = 0.05


def enclosed(walls: BaseGeometry) -> tuple[BaseGeometry, list[Polygon]]:
    """The walls, and every piece of free space that they close all round, largest first.

    Specks (cracks between pieces of one wall) count as wall, and are filled.
    """
    parts = polygons_of(walls)
    holes = [hole for part in parts for hole in shapely.polygons(shapely.get_rings(part)[1:])]
    if not holes:
        return walls, []
    free: list[Polygon] = []
    hole_of, part_in = shapely.STRtree(parts).query(holes, predicate="contains")
    for k, hole in enumerate(holes):
        standing = [Polygon(parts[i].exterior) for i in part_in[hole_of == k]]  # its own holes come by themselves
        free += polygons_of(subtract(hole, united(standing))) if standing else [hole]
    free.sort(key=lambda p: (-p.area, p.bounds))
    rooms = [p for p in free if p.area > SPECK_M2]
    specks = free[len(rooms) :]
    return (united([walls, *specks]) if specks else walls), rooms


def filled(walls: BaseGeometry) -> BaseGeometry:
    """The walls and all that they close."""
    return united(Polygon(part.exterior) for part in polygons_of(walls))


def opened(shape: BaseGeometry, width_m: float) -> BaseGeometry:
    """The shape without what is thinner than ``width_m`` (morphological opening, square corners)."""
    eroded = mitred(shape, -width_m / 2)
    if eroded.is_empty:
        return eroded
    grown = mitred(eroded, width_m / 2 + 1e-6)
    return overlap(grown, shape)


def each_opened(shapes: Sequence[BaseGeometry], width_m: float) -> Shapes:
    """``opened`` for each of the shapes."""
    given = np.array(shapes, dtype=np.object_)
    return overlaps(mitred(mitred(given, -width_m / 2), width_m / 2 + 1e-6), given)


def too_narrow(shapes: Sequence[Polygon], width_m: float) -> npt.NDArray[np.bool_]:
    """For each of the shapes whether nothing of it is as wide as ``width_m``: opened, it would be empty."""
    return np.asarray(shapely.is_empty(mitred(np.array(shapes, dtype=np.object_), -width_m / 2)), np.bool_)


def locate(points: npt.NDArray[np.float64], rooms: list[Polygon], walls: BaseGeometry) -> npt.NDArray[np.int64]:
    """For each point (n, 2): the index of the room that holds it, WALL, or OUTSIDE."""
    found = np.full(len(points), OUTSIDE, np.int64)
    if not len(points):
        return found
    geometry = shapely.points(points)
    shapely.prepare(walls)
    found[shapely.intersects(walls, geometry)] = WALL
    if rooms:
        which, room = shapely.STRtree(rooms).query(geometry, predicate="intersects").astype(np.int64)
        found[which[::-1]] = room[::-1]
    return found
