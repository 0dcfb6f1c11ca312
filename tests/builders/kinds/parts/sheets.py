"""Sheets: a room's walls, floor and ceiling as single faces, with holes where its openings are."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import shapely
import trimesh
from shapely import LineString, Polygon

from tests.builders.kinds.parts.solids3d import joined, polygons, upright
from tests.builders.kinds.values import Opening, Storey


def sheet_ring(
    storey: Storey, polygon: Polygon, openings: Sequence[Opening], low: float, high: float, inward: bool = True
) -> list[trimesh.Trimesh]:
    """Sheets round a polygon; a sheet has a hole where it lies on the face of a wall with an opening there."""
    rings = [polygon.exterior, *polygon.interiors]
    made = []
    for ring in rings:
        turned = shapely.geometry.polygon.orient(Polygon(ring)).exterior
        points = np.asarray(turned.coords)
        for a, b in itertools.pairwise(points):
            ends = (a, b) if inward is not (ring is polygon.exterior) else (b, a)
            made += sheet(storey, ends[0], ends[1], openings, low, high)
    return made


def sheet(
    storey: Storey, a: np.ndarray, b: np.ndarray, openings: Sequence[Opening], low: float, high: float
) -> list[trimesh.Trimesh]:
    """One straight face with the holes of the openings whose gap touches it."""
    line, length = LineString([a, b]), float(np.hypot(*(b - a)))
    if length < 1e-6:
        return []
    holes = []
    for o in openings:
        touched = line.intersection(storey.gap(o, 0.01))
        if touched.length > 0.05 and touched.length > 0.5 * o.width:
            s = sorted(line.project(shapely.Point(p)) for p in (touched.coords[0], touched.coords[-1]))
            holes.append((s[0], s[1], o.sill, o.head))
    along, at, made = (b - a) / length, 0.0, []
    for start, end, sill, head in sorted(holes):
        if start > at + 1e-6:
            made.append(upright(a + at * along, a + start * along, low, high))
        if sill > low + 1e-6:
            made.append(upright(a + start * along, a + end * along, low, sill))
        if head < high - 1e-6:
            made.append(upright(a + start * along, a + end * along, head, high))
        at = max(at, end)
    if length > at + 1e-6:
        made.append(upright(a + at * along, b, low, high))
    return made


def jambs(storey: Storey, opening: Opening, high: float) -> trimesh.Trimesh:
    """The faces inside an opening: two jambs, the head, and the sill of a window."""
    gap = shapely.geometry.polygon.orient(storey.gap(opening))
    p = np.asarray(gap.exterior.coords)[:-1]
    wall = storey.walls[opening.wall]
    first, second = sides_across(p, wall.along)
    parts = [upright(*first, opening.sill, opening.head), upright(*second, opening.sill, opening.head)]
    quad = [0, 1, 2], [0, 2, 3]
    levels = [z for z, there in ((opening.head, opening.head < high - 1e-6), (opening.sill, opening.sill > 0)) if there]
    parts += [trimesh.Trimesh(np.column_stack([p, np.full(4, z)]), quad, process=False) for z in levels]
    return joined(parts)


def sides_across(ring: np.ndarray, along: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """The two sides of a rectangle that run across a direction."""
    sides = [(ring[k], ring[(k + 1) % 4]) for k in range(4)]
    return sorted(sides, key=lambda s: abs(float((s[1] - s[0]) @ along) / float(np.hypot(*(s[1] - s[0])))))[:2]


def facade(storey: Storey) -> list[Polygon]:
    """The outer faces' polygons."""
    return [Polygon(p.exterior) for p in polygons(storey.footprint)]


def zone_areas(storey: Storey) -> list[Polygon]:
    """The rooms of each zone as one polygon."""
    grown = [[storey.rooms[k].buffer(0.002, join_style="mitre") for k in zone] for zone in storey.zones]
    return [shapely.union_all(rooms).buffer(-0.002, join_style="mitre") for rooms in grown]
