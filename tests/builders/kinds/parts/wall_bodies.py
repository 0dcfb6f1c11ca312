"""Walls as solids, in the ways in which programs make them, holes left open.

``boxes``: each straight run of wall as boxes between, under and over its openings, overlapping at corners.
``holes``: each run one exact solid with its openings cut out.
``butted``: the same without overlaps: where two runs meet, one ends at the other's face.
``courses``: level courses of the whole house, one over another, from one height of sills and heads to the next.
``one``: a single exact solid.
"""

from __future__ import annotations

import itertools
import math

import manifold3d
import shapely
import trimesh

from tests.builders.kinds.parts.solids3d import mesh_of, prism, solid
from tests.builders.kinds.values import Opening, Storey, Wall

STYLES = ("boxes", "holes", "butted", "courses", "one")
CUT_M = 0.02
"""How far an opening's body reaches beyond the wall's faces when it is cut out."""


def wall_bodies(storey: Storey, style: str, foot: float = 0.0, top: float | None = None) -> list[trimesh.Trimesh]:
    """The walls from ``foot`` to ``top`` (the storey's height by default) in one of the STYLES."""
    high = storey.height if top is None else top
    if style == "courses":
        return courses(storey, foot, high)
    if style == "one":
        whole = solid(storey.wall_area, foot, high)
        return [mesh_of(whole - manifold3d.Manifold.batch_boolean(holes(storey, high), manifold3d.OpType.Add))]
    made = [prism(p, foot, high) for p in storey.pillars]
    if style == "butted":
        return made + butted(storey, foot, high)
    for run, openings, before, after in runs(storey):
        if style == "boxes":
            made += boxes(run, openings, before, after, foot, run.height or high)
        else:
            made.append(with_holes(run, openings, before, after, foot, run.height or high))
    return made


def butted(storey: Storey, foot: float, high: float) -> list[trimesh.Trimesh]:
    """Runs one against another: each gives way to those before it."""
    made, taken = [], shapely.Polygon()
    for run, openings, before, after in runs(storey):
        area = run.strip(-before, run.length + after).difference(taken)
        whole = solid(area, foot, high)
        for o in openings:
            whole -= hole(run, o, high)
        made.append(mesh_of(whole))
        taken = taken.union(area)
    return [m for m in made if len(m.faces)]


def holes(storey: Storey, high: float) -> list[manifold3d.Manifold]:
    """The bodies of all openings; an opening as high as the wall is cut right through."""
    return [hole(storey.walls[o.wall], o, high) for o in storey.openings] or [manifold3d.Manifold()]


def hole(wall: Wall, opening: Opening, high: float) -> manifold3d.Manifold:
    """The body of an opening."""
    area = wall.strip(opening.start, opening.end, wall.thickness + 2 * CUT_M)
    low = opening.sill if opening.sill > 0 else -1.0
    return solid(area, low, opening.head if opening.head < high - 1e-6 else high + 1.0)


def courses(storey: Storey, foot: float, high: float) -> list[trimesh.Trimesh]:
    """The house in level courses."""
    heights = sorted({foot, high} | {v for o in storey.openings for v in (o.sill, o.head) if foot < v < high})
    made = []
    for low, up in itertools.pairwise(heights):
        gaps = [storey.gap(o, CUT_M) for o in storey.openings if o.sill < up - 1e-9 and o.head > low + 1e-9]
        made.append(prism(storey.wall_area.difference(shapely.union_all(gaps)), low, up))
    return made


def runs(storey: Storey) -> list[tuple[Wall, list[Opening], float, float]]:
    """Walls of one thickness that go on in one line, as one; with their openings and the reach of both ends."""
    left, found = set(range(len(storey.walls))), []
    while left:
        first = min(left)
        group = [first]
        left.discard(first)
        while following := [k for k in sorted(left) if goes_on(storey.walls[group[-1]], storey.walls[k])]:
            group.append(following[0])
            left.discard(following[0])
        while leading := [k for k in sorted(left) if goes_on(storey.walls[k], storey.walls[group[0]])]:
            group.insert(0, leading[0])
            left.discard(leading[0])
        start, end = storey.walls[group[0]], storey.walls[group[-1]]
        run = Wall(start.a, end.b, start.thickness, start.sides, start.height, start.glass)
        openings = []
        for k in group:
            shift = math.dist(run.a, storey.walls[k].a)
            openings += [Opening(-1, o.start + shift, o.end + shift, o.kind, o.sill, o.head) for o in storey.on(k)]
        ends = storey.reach(group[0], start.a), storey.reach(group[-1], end.b)
        found.append((run, openings, *ends))
    return found


def goes_on(one: Wall, other: Wall) -> bool:
    """Whether a wall ends where another begins, in the same direction and body."""
    same = (one.thickness, one.height, one.glass) == (other.thickness, other.height, other.glass)
    return same and math.dist(one.b, other.a) < 1e-6 and float(one.along @ other.along) > 1 - 1e-9


def boxes(
    run: Wall, openings: list[Opening], before: float, after: float, foot: float, high: float
) -> list[trimesh.Trimesh]:
    """A run in boxes."""
    made, at = [], -before
    for o in sorted(openings, key=lambda o: o.start):
        if o.start > at + 1e-6:
            made.append(prism(run.strip(at, o.start), foot, high))
        if o.sill > foot + 1e-6:
            made.append(prism(run.strip(o.start, o.end), foot, o.sill))
        if o.head < high - 1e-6:
            made.append(prism(run.strip(o.start, o.end), o.head, high))
        at = o.end
    if run.length + after > at + 1e-6:
        made.append(prism(run.strip(at, run.length + after), foot, high))
    return made


def with_holes(
    run: Wall, openings: list[Opening], before: float, after: float, foot: float, high: float
) -> trimesh.Trimesh:
    """A run as one solid with holes."""
    whole = solid(run.strip(-before, run.length + after), foot, high)
    for o in openings:
        whole -= hole(run, o, high)
    return mesh_of(whole)
