"""Make the closed triangle mesh of a wall's slab with its holes."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from pipeline.sources.homes.level import WALL_TOP_M, Meshed
from tests.builders.suncg_houses.walls import Hole, Slab

_Indices: TypeAlias = npt.NDArray[np.int64]


def slab_mesh(slab: Slab, holes: list[Hole]) -> Meshed:
    """Return a closed mesh of a slab: a grid through the holes' edges, without the fields that are holes."""
    at = sorted({*slab.span, *(value for hole in holes for value in hole[:2])})
    up = sorted({0.0, WALL_TOP_M, *(value for hole in holes for value in hole[2:])})
    cut = frozenset(
        (i, j)
        for low, high, bottom, top in holes
        for i in range(at.index(low), at.index(high))
        for j in range(up.index(bottom), up.index(top))
    )
    line, level, side, faces = _grid(len(at) - 1, len(up) - 1, cut)
    along, height = np.array(at)[line], np.array(up)[level]
    points = np.empty((len(along), 3))
    points[:, :2] = slab.plan(along, np.array(slab.offset)[side])
    points[:, 2] = height
    return points, np.stack([along, height], axis=1), faces


@lru_cache(maxsize=4096)
def _grid(columns: int, rows: int, cut: frozenset[tuple[int, int]]) -> tuple[_Indices, _Indices, _Indices, _Indices]:
    """Return line, level and side of each node, and the faces of ``columns`` by ``rows`` fields less those cut.

    Sides are 0 (right) and 1 (left). Each field has a face on either side, and a reveal wherever it borders on a hole
    or on the end of the slab.
    """
    fields = {(i, j) for i in range(columns) for j in range(rows)} - cut
    quads = []
    for i, j in sorted(fields):
        right = [((i + a) * (rows + 1) + j + b) * 2 for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        quads += [right, [node + 1 for node in reversed(right)]]
        for k, neighbour in enumerate(((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j))):
            if neighbour not in fields:
                a, b = right[k], right[(k + 1) % 4]
                quads.append([b, a, a + 1, b + 1])
    quad = np.array(quads)
    line, level, side = np.indices((columns + 1, rows + 1, 2)).reshape(3, -1)
    return line, level, side, np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
