"""From cells to walls: who borders on whom, how thick the walls between are, and what is one zone."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Polygon

from tests.builders.kinds.values import OUTSIDE, Cell, Storey, Wall

EPS = 1e-3
SHORTEST = 1e-6  # noding leaves borders of rounding, which are no wall


def borders(shapes: list[Polygon]) -> list[tuple[LineString, int, int]]:
    """The straight borders of a partition: each with the shape to its left and to its right (OUTSIDE where none)."""
    lines = shapely.node(shapely.MultiLineString([s.exterior for s in shapes]))
    tree, found = shapely.STRtree(shapes), []
    merged: dict[tuple[int, int], list[LineString]] = {}
    for line in shapely.get_parts(shapely.unary_union(lines)):
        for a, b in zip(line.coords[:-1], line.coords[1:], strict=True):
            start, end = np.array(a), np.array(b)
            along = (end - start) / np.hypot(*(end - start))
            if along[0] < -1e-9 or (abs(along[0]) <= 1e-9 and along[1] < 0):
                start, end, along = end, start, -along
            middle, left = (start + end) / 2, np.array([-along[1], along[0]])
            sides = tuple(inside(shapes, tree, middle + s * EPS * left) for s in (1, -1))
            merged.setdefault(sides, []).append(LineString([start, end]))
    for (left_, right_), pieces in merged.items():
        found += [(straight, left_, right_) for straight in straight_runs(pieces)]
    return sorted(found, key=lambda f: (f[0].coords[0], f[0].coords[-1]))


def inside(shapes: list[Polygon], tree: shapely.STRtree, point: np.ndarray) -> int:
    """Which shape holds a point."""
    here = shapely.Point(point)
    return next((int(k) for k in sorted(tree.query(here)) if shapes[k].contains(here)), OUTSIDE)


def straight_runs(pieces: list[LineString]) -> list[LineString]:
    """Join pieces that go on in one direction."""
    runs = list(pieces)
    changed = True
    while changed:
        changed = False
        for i, first in enumerate(runs):
            for j, second in enumerate(runs):
                if i != j and near(first.coords[-1], second.coords[0]) and parallel(first, second):
                    joined = LineString([first.coords[0], second.coords[-1]])
                    runs = [r for k, r in enumerate(runs) if k not in {i, j}] + [joined]
                    changed = True
                    break
            if changed:
                break
    return runs


def near(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether two points are one."""
    return abs(a[0] - b[0]) < 1e-7 and abs(a[1] - b[1]) < 1e-7


def parallel(a: LineString, b: LineString) -> bool:
    """Whether two lines have one direction."""
    u, v = (np.subtract(g.coords[-1], g.coords[0]) / g.length for g in (a, b))
    return bool(abs(u[0] * v[1] - u[1] * v[0]) < 1e-6 and u @ v > 0)


def storey_of(
    cells: list[Cell],
    merged: list[tuple[int, int]],
    outer_m: float,
    inner_m: float,
    height: float,
    party_m: float = 0.0,
) -> Storey:
    """Walls of their thickness on all borders but those of merged cells; ``party_m`` is that between units."""
    apart = {frozenset(pair) for pair in merged}
    walls = []
    for line, left, right in borders([c.polygon for c in cells]):
        if frozenset((left, right)) in apart or line.length < SHORTEST:
            continue
        thickness = outer_m if OUTSIDE in (left, right) else inner_m
        if party_m and OUTSIDE not in (left, right) and cells[left].unit != cells[right].unit:
            thickness = party_m
        a, b = (tuple(float(v) for v in p) for p in (line.coords[0], line.coords[-1]))
        walls.append(Wall(a, b, thickness, (left, right)))
    return Storey(tuple(cells), tuple(walls), (), height, tuple(zones(len(cells), merged)))


def zones(count: int, merged: list[tuple[int, int]]) -> list[tuple[int, ...]]:
    """Groups of cells that are joined, directly or by way of others."""
    group = list(range(count))
    for i, j in merged:
        old, new = group[j], group[i]
        group = [new if g == old else g for g in group]
    return [tuple(k for k in range(count) if group[k] == g) for g in sorted(set(group))]
