"""What the kinds of houses are made from: a storey as cells, walls and openings, and parts of triangles.

Frame: metres, x right and y up in the plan, z up, the storey's floor at z = 0. A cell's polygon runs along the centre
lines of its walls; a room is what the walls' bodies leave of its cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import shapely
import trimesh
from shapely import Polygon

Point = tuple[float, float]
OUTSIDE = -1
OpeningKind = Literal["door", "opening", "window", "french", "entrance"]
LEADS_IN = ("door", "opening")
"""Kinds of opening between two rooms; the others lead, or look, outside."""


@dataclass(frozen=True)
class Cell:
    """A room up to its walls' centre lines; ``unit`` numbers the flats of a building.

    ``floor`` is False over a void.
    """

    label: str
    polygon: Polygon
    unit: int = 0
    floor: bool = True


@dataclass(frozen=True)
class Wall:
    """A straight wall between two cells (or a cell and OUTSIDE), left and right of the way from ``a`` to ``b``.

    ``height`` is None where the wall reaches the ceiling. ``glass`` marks full-height glazing.
    """

    a: Point
    b: Point
    thickness: float
    sides: tuple[int, int]
    height: float | None = None
    glass: bool = False

    @property
    def outer(self) -> bool:
        """Whether one side is the outside."""
        return OUTSIDE in self.sides

    @property
    def length(self) -> float:
        """Metres from end to end."""
        return math.dist(self.a, self.b)

    @cached_property
    def along(self) -> np.ndarray:
        """Unit vector from ``a`` to ``b``."""
        return (np.array(self.b) - self.a) / self.length

    @cached_property
    def across(self) -> np.ndarray:
        """Unit vector to the left of ``along``."""
        return np.array([-self.along[1], self.along[0]])

    def at(self, s: float, t: float = 0.0) -> np.ndarray:
        """The plan point ``s`` along and ``t`` to the left."""
        return np.array(self.a) + s * self.along + t * self.across

    def strip(self, start: float, end: float, depth: float | None = None, shift: float = 0.0) -> Polygon:
        """The rectangle from ``start`` to ``end``, as deep as the wall or as told, ``shift`` to the left."""
        half = (self.thickness if depth is None else depth) / 2
        corners = ((start, -half), (end, -half), (end, half), (start, half))
        return Polygon([self.at(s, t + shift) for s, t in corners])


@dataclass(frozen=True)
class Leaf:
    """Where a door's leaf hangs: ``hinge`` at 0 (start) or 1 of its opening; ``swing`` +1 opens it to the left."""

    hinge: int = 0
    swing: int = 1
    thickness: float = 0.04


@dataclass(frozen=True)
class Opening:
    """A hole in a wall: from ``start`` to ``end`` along it, ``sill`` to ``head`` above the floor."""

    wall: int
    start: float
    end: float
    kind: OpeningKind
    sill: float
    head: float
    leaves: tuple[Leaf, ...] = ()

    @property
    def width(self) -> float:
        """Metres from jamb to jamb."""
        return self.end - self.start

    @property
    def centre(self) -> float:
        """Metres along the wall."""
        return (self.start + self.end) / 2


@dataclass(frozen=True, eq=False)
class Storey:
    """One storey of one or several units.

    ``zones`` are groups of cells between which no wall stands; ``pillars`` stand free or against a wall.
    """

    cells: tuple[Cell, ...]
    walls: tuple[Wall, ...]
    openings: tuple[Opening, ...]
    height: float
    zones: tuple[tuple[int, ...], ...]
    pillars: tuple[Polygon, ...] = ()

    @cached_property
    def wall_area(self) -> shapely.Geometry:
        """All walls' bodies in the plan, corners filled."""
        return shapely.union_all([*(self.body(k) for k in range(len(self.walls))), *self.pillars])

    @cached_property
    def joints(self) -> dict[Point, list[int]]:
        """Which walls end at a point (to a tenth of a millimetre)."""
        found: dict[Point, list[int]] = {}
        for k, wall in enumerate(self.walls):
            for end in (wall.a, wall.b):
                found.setdefault(joint(end), []).append(k)
        return found

    def body(self, index: int) -> Polygon:
        """A wall's rectangle, drawn out at each end by half of the thickest wall that it meets there at an angle."""
        wall = self.walls[index]
        return wall.strip(-self.reach(index, wall.a), wall.length + self.reach(index, wall.b))

    def reach(self, index: int, end: Point) -> float:
        """How far a wall's body runs beyond one of its ends to fill the corner there."""
        wall, most = self.walls[index], 0.0
        for k in self.joints[joint(end)]:
            other = self.walls[k]
            sine = abs(float(wall.along[0] * other.along[1] - wall.along[1] * other.along[0]))
            if k == index or sine < 0.02 or other.thickness < wall.thickness - 1e-9:
                continue
            cosine = abs(float(wall.along @ other.along))
            most = max(most, (other.thickness - wall.thickness * cosine) / 2 / sine)
        return most

    @cached_property
    def rooms(self) -> tuple[Polygon, ...]:
        """What the walls leave of each cell (its largest piece)."""
        return tuple(largest(c.polygon.difference(self.wall_area)) for c in self.cells)

    @cached_property
    def footprint(self) -> shapely.Geometry:
        """Cells and walls together."""
        cells = [c.polygon for c in self.cells]
        return shapely.union_all([*cells, self.wall_area]).buffer(0.001, join_style="mitre").simplify(0.002)

    def on(self, wall: int) -> list[Opening]:
        """The openings of a wall in their order along it."""
        return sorted((o for o in self.openings if o.wall == wall), key=lambda o: o.start)

    def gap(self, opening: Opening, extra: float = 0.0) -> Polygon:
        """The plan rectangle of an opening, from one face of the wall to the other and ``extra`` beyond."""
        wall = self.walls[opening.wall]
        return wall.strip(opening.start, opening.end, wall.thickness + 2 * extra)

    def with_openings(self, openings: list[Opening]) -> Storey:
        """The same storey with other openings."""
        return replace(self, openings=tuple(openings))


def largest(shape: shapely.Geometry) -> Polygon:
    """The largest polygon of a shape."""
    polygons = [g for g in shapely.get_parts(shape) if isinstance(g, Polygon)]
    return max(polygons, key=lambda g: g.area, default=Polygon())


def joint(point: Point) -> Point:
    """A point as a key."""
    return round(point[0], 4), round(point[1], 4)


@dataclass(frozen=True, eq=False)
class Part:
    """A thing of a house: triangles, its name and material in the file, and what it is ("wall", "leaf", ...)."""

    name: str
    mesh: trimesh.Trimesh
    role: str
    material: str = ""


@dataclass(frozen=True, eq=False)
class Member:
    """A made house: the file, and what each of its storeys holds, in the form of a case.

    ``up`` and ``unit_m`` say how the file's axes and lengths are to be read, which a reader has to find out.
    """

    path: Path
    truths: tuple[dict[str, Any], ...]
    about: str
    up: str
    unit_m: float
