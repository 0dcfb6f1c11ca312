"""Edges of cells, and which parts of them two cells share or the outside sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.procedural.values import Cell, Part

_NEAR_M = 1e-4


@dataclass(frozen=True, eq=False)
class Edges:
    """All edges of all cells, each with its cell on the left; arrays of one row an edge."""

    cell: npt.NDArray[np.int64]
    start: npt.NDArray[np.float64]
    direction: npt.NDArray[np.float64]
    length: npt.NDArray[np.float64]
    turn: npt.NDArray[np.float64]
    """(n, 2): by how much the outline turns at the edge's start and at its end, radians."""


@dataclass(frozen=True)
class Shared:
    """The part of ``edge`` (of cell ``cells[0]``) that cell ``cells[1]`` shares."""

    edge: int
    cells: tuple[int, int]
    part: Part


def edges_of(cells: list[Cell]) -> Edges:
    """List the edges of all cells, ring by ring."""
    owner, starts, ends, turns = [], [], [], []
    for index, cell in enumerate(cells):
        polygon = shapely.orient_polygons(cell.polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            points = shapely.get_coordinates(ring)[:-1]
            step = np.roll(points, -1, axis=0) - points
            heading = np.arctan2(step[:, 1], step[:, 0])
            turn = (heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi
            owner += [index] * len(points)
            starts.append(points)
            ends.append(np.roll(points, -1, axis=0))
            turns.append(np.stack([turn, np.roll(turn, -1)], axis=1))
    start, end = np.concatenate(starts), np.concatenate(ends)
    length = np.hypot(*(end - start).T)
    return Edges(np.array(owner), start, (end - start) / length[:, None], length, np.concatenate(turns))


def shared_parts(edges: Edges) -> list[Shared]:
    """Return each piece of border that two cells share, once from either side."""
    d = edges.direction
    opposite = d @ d.T < -1 + 1e-6
    relative = edges.start[None, :, :] - edges.start[:, None, :]  # [i, j]: from the start of i to the start of j
    off = np.abs(relative[:, :, 0] * d[:, None, 1] - relative[:, :, 1] * d[:, None, 0])
    high = np.einsum("ijk,ik->ij", relative, d)  # an opposite edge begins further on and ends before
    low = np.maximum(high - edges.length[None, :], 0.0)
    high = np.minimum(high, edges.length[:, None])
    meets = opposite & (off < _NEAR_M) & (high - low > _NEAR_M) & (edges.cell[:, None] != edges.cell[None, :])
    return [
        Shared(i, (int(edges.cell[i]), int(edges.cell[j])), (float(low[i, j]), float(high[i, j])))
        for i, j in np.argwhere(meets).tolist()
    ]


def outer_parts(edges: Edges, shared: list[Shared]) -> list[tuple[int, Part]]:
    """Return the parts of edges that no other cell shares: (edge, part)."""
    inner: dict[int, list[Part]] = {}
    for each in shared:
        inner.setdefault(each.edge, []).append(each.part)
    result = []
    for edge, length in enumerate(edges.length.tolist()):
        at = 0.0
        for low, high in [*sorted(inner.get(edge, [])), (length, length)]:
            if low - at > _NEAR_M:
                result.append((edge, (at, low)))
            at = max(at, high)
    return result
