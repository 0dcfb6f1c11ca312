"""Measure how far the walls of two plans lie apart, in compiled loops.

``houseexpo.analysis.copies`` calls it. Edges are (n, 4) float64: x and y of both ends, metres.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

Edges = npt.NDArray[np.float64]


@njit(cache=True, nogil=True)
def squared_distance(x: float, y: float, edge: Edges) -> float:
    """Return the squared distance of a point from an edge (4,), m2."""
    along_x, along_y = edge[2] - edge[0], edge[3] - edge[1]
    length = along_x * along_x + along_y * along_y
    at = 0.0
    if length > 0.0:
        at = min(max(((x - edge[0]) * along_x + (y - edge[1]) * along_y) / length, 0.0), 1.0)
    off_x, off_y = edge[0] + at * along_x - x, edge[1] + at * along_y - y
    return float(off_x * off_x + off_y * off_y)


@njit(cache=True, nogil=True)
def all_near(edges: Edges, others: Edges, limit: float, step: float) -> bool:
    """Return whether the points of ``edges``, at most ``step`` metres apart, lie within ``limit`` of the others.

    A point is most often near the edge that the last one was near, or near one beside it: these are tried first.
    """
    count, near = len(others), 0
    for i in range(len(edges)):
        x, y = edges[i, 0], edges[i, 1]
        along_x, along_y = edges[i, 2] - x, edges[i, 3] - y
        parts = math.ceil(math.hypot(along_x, along_y) / step)
        for k in range(parts):
            here_x, here_y = x + along_x * k / parts, y + along_y * k / parts
            for beside in range(count):
                off = -(beside // 2) - 1 if beside % 2 else beside // 2
                at = (near + off) % count
                if squared_distance(here_x, here_y, others[at]) <= limit * limit:
                    near = at
                    break
            else:
                return False
    return True


@njit(cache=True, nogil=True)
def distances(points: Edges, edges: Edges) -> Edges:
    """Return the distance (n,) of each point (n, 2) from the nearest edge, metres."""
    found = np.empty(len(points))
    for i in range(len(points)):
        least = np.inf
        for j in range(len(edges)):
            least = min(least, squared_distance(points[i, 0], points[i, 1], edges[j]))
        found[i] = math.sqrt(least)
    return found
