"""Walls: a pair of slabs for each edge of each cell, and the closed mesh of a slab with its holes."""

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
    WALL_TOP_M,
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
        return self.origin + np.outer(at, self.axis) + np.outer(side, normal)

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


def slabs_of(wall: Wall, built: bool = True) -> Iterator[Slab]:
    """Yield the slabs of a wall: inside and outside, piece by piece; with ``built`` False as if nothing were missing."""
    turn = np.array([[np.cos(wall.skew), np.sin(wall.skew)], [-np.sin(wall.skew), np.cos(wall.skew)]])
    along = np.array(wall.direction)
    axis = along @ turn
    left = np.array([-along[1], along[0]])
    middle = np.array(wall.start) + along * wall.length / 2 + left * wall.shift
    pieces, at = [], -wall.ends[0]
    for low, high in [*(wall.missing if built else ()), (wall.length + wall.ends[1], np.inf)]:
        if low - at > 0.02:
            pieces.append((at, low))
        at = high
    for piece in pieces:
        for inside in (True, False):
            offset = (0.0, SLAB_M) if inside else (-SLAB_M, 0.0)
            yield Slab(inside, middle - axis * wall.length / 2, axis, piece, offset)


def solid_plan(walls: tuple[Wall, ...]) -> shapely.Geometry:
    """Return the plan area of all slabs as if nothing were missing and no opening cut."""
    corners = np.array([slab.corners() for wall in walls for slab in slabs_of(wall, built=False)])
    return shapely.union_all(shapely.polygons(corners), grid_size=1e-6)


def holes_in(slab: Slab, openings: tuple[Opening, ...]) -> list[Hole]:
    """Return the holes that openings make in a slab."""
    if not openings:
        return []
    relative = np.array([each.centre for each in openings]) - slab.origin
    normal = np.array([-slab.axis[1], slab.axis[0]])
    parallel = np.abs(np.array([each.direction for each in openings]) @ slab.axis) > 0.99
    at = relative @ slab.axis
    near = np.flatnonzero(parallel & (np.abs(relative @ normal) < _REACH_M))
    holes = []
    for k in near.tolist():
        opening, middle = openings[k], float(at[k])
        low, high = middle - opening.width / 2, middle + opening.width / 2
        if slab.span[0] < low and high < slab.span[1]:
            window = opening.kind == "window"
            heights = (WINDOW_LOW_M, WINDOW_HEAD_M) if window else (SILL_M, DOOR_HEAD_M)
            holes.append((low, high, *heights))
    return sorted(holes)


def slab_mesh(
    slab: Slab, holes: list[Hole]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return a closed mesh of a slab, faces outward.

    Returns
    -------
    points : (n, 3) array
        Plan x, plan y, height above the level's foot, metres.
    texture : (n, 2) array
        Metres along the wall and up.
    faces : (m, 3) array
        Counter-clockwise seen from outside, with x right, y away and height up.
    """
    at = np.unique([*slab.span, *(value for hole in holes for value in hole[:2])])
    up = np.unique([0.0, WALL_TOP_M, *(value for hole in holes for value in hole[2:])])
    solid = np.zeros((len(at) + 1, len(up) + 1), dtype=bool)  # a rim of nothing all round
    solid[1:-1, 1:-1] = True
    for low, high, bottom, top in holes:
        columns = slice(int(np.searchsorted(at, low)) + 1, int(np.searchsorted(at, high)) + 1)
        solid[columns, int(np.searchsorted(up, bottom)) + 1 : int(np.searchsorted(up, top)) + 1] = False
    n = len(up)

    def node(i: npt.NDArray[np.int64], j: npt.NDArray[np.int64], side: int) -> npt.NDArray[np.int64]:
        return (i * n + j) * 2 + side

    i, j = np.nonzero(solid[1:-1, 1:-1])
    quads = [
        np.stack([node(i, j, 0), node(i + 1, j, 0), node(i + 1, j + 1, 0), node(i, j + 1, 0)], axis=1),
        np.stack([node(i, j, 1), node(i, j + 1, 1), node(i + 1, j + 1, 1), node(i + 1, j, 1)], axis=1),
    ]
    across = solid[1:, 1:-1].astype(np.int8) - solid[:-1, 1:-1]  # +1: solid begins at this line
    upward = solid[1:-1, 1:].astype(np.int8) - solid[1:-1, :-1]
    for sign in (1, -1):
        i, j = np.nonzero(across == sign)
        quad = np.stack([node(i, j, 0), node(i, j + 1, 0), node(i, j + 1, 1), node(i, j, 1)], axis=1)
        quads.append(quad[:, ::sign])
        i, j = np.nonzero(upward == sign)
        quad = np.stack([node(i, j, 0), node(i, j, 1), node(i + 1, j, 1), node(i + 1, j, 0)], axis=1)
        quads.append(quad[:, ::sign])
    quad = np.concatenate(quads)
    faces = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    grid_at, grid_up = np.repeat(np.repeat(at, n), 2), np.repeat(np.tile(up, len(at)), 2)
    side = np.tile(np.array(slab.offset), len(at) * n)
    points = np.column_stack([slab.plan(grid_at, side), grid_up])
    return points, np.column_stack([grid_at, grid_up]), faces
