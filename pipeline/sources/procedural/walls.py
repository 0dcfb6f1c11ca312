"""Walls: a pair of slabs for each edge of each cell, and the holes in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.procedural.borders import Edges
from pipeline.sources.procedural.values import (
    DOOR_HEAD_M,
    SILL_M,
    SLAB_M,
    WINDOW_HEAD_M,
    WINDOW_LOW_M,
    Opening,
    Wall,
)

Hole = tuple[float, float, float, float]
"""From, to along the slab, and from, to in height."""

_REACH_M = 0.12  # an opening passes through every slab whose centre line is this near
_SKEWED_SHARE, _SHIFTED_SHARE = 0.05, 0.08
_DRIFT_M = 0.03  # a skewed wall's ends are no further from its line


@dataclass(frozen=True)
class Slab:
    """A box in the plan: along ``axis`` from ``span[0]`` to ``span[1]``, to the left from ``offset[0]`` to ``[1]``."""

    inside: bool
    origin: npt.NDArray[np.float64]
    axis: npt.NDArray[np.float64]
    span: tuple[float, float]
    offset: tuple[float, float]

    def plan(self, at: npt.NDArray[np.float64], side: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the plan points (n, 2) at distances ``at`` along and ``side`` to the left."""
        normal = np.array([-self.axis[1], self.axis[0]])
        plan: npt.NDArray[np.float64] = self.origin + at[:, None] * self.axis + side[:, None] * normal
        return plan

    def corners(self) -> npt.NDArray[np.float64]:
        """Return the four plan corners."""
        (a, b), (low, high) = self.span, self.offset
        return self.plan(np.array([a, b, b, a]), np.array([low, low, high, high]))


def build_walls(edges: Edges, inner: set[int], rng: np.random.Generator) -> list[Wall]:
    """Give every edge its wall; of those that lie between rooms (``inner``) a few are skewed or shifted."""
    walls = []
    for edge, length in enumerate(edges.length.tolist()):
        ends = SLAB_M * np.abs(np.tan(edges.turn[edge] / 2))
        shift = skew = 0.0
        draw = rng.random()
        if edge in inner and length > 1.0:
            if draw < _SKEWED_SHARE:
                skew = float(rng.uniform(-1, 1)) * min(np.radians(1.0), 2 * _DRIFT_M / length)
            elif draw < _SKEWED_SHARE + _SHIFTED_SHARE:
                shift = float(rng.uniform(-0.01, 0.01))
        start, direction = tuple(edges.start[edge].tolist()), tuple(edges.direction[edge].tolist())
        walls.append(
            Wall(int(edges.cell[edge]), start, direction, length, (float(ends[0]), float(ends[1])), shift, skew)
        )
    return walls


def slabs_of(wall: Wall) -> Iterator[Slab]:
    """Yield the slabs of a wall that are built: inside and outside, piece by piece."""
    origin, axis = _frame(wall)
    at = -wall.ends[0]
    for low, high in [*wall.missing, (wall.length + wall.ends[1], np.inf)]:
        if low - at > 0.02:
            yield Slab(True, origin, axis, (at, low), (0.0, SLAB_M))
            yield Slab(False, origin, axis, (at, low), (-SLAB_M, 0.0))
        at = high


def solid_plan(walls: tuple[Wall, ...]) -> shapely.Geometry:
    """Return the plan area of all walls as if nothing were missing and no opening cut."""
    whole = [
        Slab(True, *_frame(wall), (-wall.ends[0], wall.length + wall.ends[1]), (-SLAB_M, SLAB_M)) for wall in walls
    ]
    return shapely.union_all(shapely.polygons(np.array([slab.corners() for slab in whole])))


def holes_in(slab: Slab, openings: list[Opening]) -> list[Hole]:
    """Return the holes that openings make in a slab, in order along it."""
    (x, y), (dx, dy) = slab.origin.tolist(), slab.axis.tolist()
    holes = []
    for opening in openings:
        rx, ry = opening.centre[0] - x, opening.centre[1] - y
        parallel = abs(opening.direction[0] * dx + opening.direction[1] * dy) > 0.99
        if not parallel or abs(ry * dx - rx * dy) >= _REACH_M:
            continue
        middle = rx * dx + ry * dy
        low, high = middle - opening.width / 2, middle + opening.width / 2
        if slab.span[0] < low and high < slab.span[1]:
            heights = (WINDOW_LOW_M, WINDOW_HEAD_M) if opening.kind == "window" else (SILL_M, DOOR_HEAD_M)
            holes.append((low, high, *heights))
    return sorted(holes)


def _frame(wall: Wall) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return where a wall starts and which way it runs, shift and skew included."""
    (x, y), (dx, dy), half = wall.start, wall.direction, wall.length / 2
    c, s = np.cos(wall.skew), np.sin(wall.skew)
    ax, ay = dx * c - dy * s, dx * s + dy * c
    middle = x + dx * half - dy * wall.shift, y + dy * half + dx * wall.shift
    return np.array([middle[0] - ax * half, middle[1] - ay * half]), np.array([ax, ay])
