"""Maps of robots, drawn as text and at random, and slow twins of what is planned by them."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

UNKNOWN, FREE, OBSTACLE = 0, 127, 255
SIGNS = {"?": UNKNOWN, ".": FREE, "#": OBSTACLE}


def drawn(*lines: str) -> np.ndarray:
    """A map as one draws it: ? unknown, . free, # obstacle."""
    return np.array([[SIGNS[sign] for sign in line] for line in lines], np.uint8)


def random_map(seed: int, rows: int = 24, cols: int = 33) -> np.ndarray:
    """Rectangles of free cells with walls and holes, some of them on the rim of the grid."""
    rng = np.random.default_rng(seed)
    known = np.zeros((rows, cols), np.uint8)
    for _ in range(int(rng.integers(2, 6))):
        row, col = int(rng.integers(-2, rows - 5)), int(rng.integers(-2, cols - 5))
        high, wide = rng.integers(4, 14, 2).tolist()
        known[max(row, 0) : row + high, max(col, 0) : col + wide] = FREE
    known[rng.random(known.shape) < 0.02] = OBSTACLE
    known[rng.random(known.shape) < 0.02] = UNKNOWN
    known[:, int(rng.integers(cols))] = rng.choice([FREE, UNKNOWN, OBSTACLE])
    return known


def random_place(known: np.ndarray, seed: int) -> tuple[float, float]:
    """(x, y) in a free cell, or anywhere where there is none."""
    rng = np.random.default_rng(seed)
    cells = np.argwhere(known == FREE)
    row, col = rng.choice(cells if len(cells) else np.argwhere(np.ones_like(known))).tolist()
    right, down = rng.random(2).tolist()
    return col + right, row + down


def reach_of(row: int, col: int, x: float, y: float) -> float:
    """How far the square of a cell is from a point."""
    return math.hypot(max(col - x, x - col - 1, 0.0), max(row - y, y - row - 1, 0.0))


def slow_standing(known: np.ndarray, x: float, y: float, radius: float) -> np.ndarray:
    """Cell by cell, in whose middle a disc meets none that is closed (R1 to R3 of ``known_ways``)."""
    rows, cols = known.shape
    closed = known != FREE
    for row, col in product(range(rows), range(cols)):
        if reach_of(row, col, x, y) < radius - 1e-9:
            closed[row, col] = False
    closed[[0, -1]] = closed[:, [0, -1]] = True
    shut = np.argwhere(closed)
    standing = np.zeros(known.shape, bool)
    for row, col in product(range(rows), range(cols)):
        off = np.maximum(np.abs(shut - (row, col)) - 0.5, 0.0)
        standing[row, col] = not (np.hypot(*off.T) < radius - 1e-9).any()
    return standing


def slow_ways(standing: np.ndarray, x: float, y: float, radius: float) -> np.ndarray:
    """The ways (R4, R5) by SciPy: -1 where the robot may not stand, infinite where it cannot get to."""
    rows, cols = standing.shape
    edges: list[tuple[int, int, int]] = []
    for row, col in np.argwhere(standing).tolist():
        for down, right in product((-1, 0, 1), (-1, 0, 1)):
            r, c = row + down, col + right
            if (down or right) and 0 <= r < rows and 0 <= c < cols and standing[r, c]:
                across = down != 0 and right != 0
                if not across or (standing[row, c] and standing[r, col]):
                    edges.append((row * cols + col, r * cols + c, 99 if across else 70))
    here = math.floor(y), math.floor(x)
    places = np.argwhere(standing)
    away = np.abs(places - here).max(axis=1, initial=0)
    beside = [standing[r, here[1]] and standing[here[0], c] for r, c in places[away <= 1].tolist()]
    straight = (places[away <= 1] == here).any(axis=1)
    starts = places[away <= 1][straight | np.array(beside, bool)]
    off = np.hypot(places[:, 1] + 0.5 - x, places[:, 0] + 0.5 - y)
    if not len(starts):
        near = away <= math.ceil(radius) + 2
        if near.any():
            starts = places[near][[off[near].argmin()]]
    source = rows * cols
    edges += [(source, r * cols + c, round(70 * math.hypot(c + 0.5 - x, r + 0.5 - y))) for r, c in starts.tolist()]
    found = np.full(rows * cols + 1, np.inf)
    if edges:
        one, other, length = np.array(edges).T
        # SciPy takes 0 for no edge: ways are a little longer, and whole again
        graph = coo_matrix((length + 1e-9, (one, other)), (source + 1, source + 1)).tocsr()
        found = dijkstra(graph, indices=source)
    ways = np.where(np.isfinite(found), np.round(found), np.inf)[:-1].reshape(rows, cols)
    return np.where(standing, ways, -1.0)


def slow_clear(known: np.ndarray, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether the line between two middles passes free squares only, by fractions, square by square."""
    ends = {one, other}
    down, right = other[0] - one[0], other[1] - one[1]
    rows = range(min(one[0], other[0]), max(one[0], other[0]) + 1)
    cols = range(min(one[1], other[1]), max(one[1], other[1]) + 1)
    for row, col in product(rows, cols):
        if (row, col) not in ends and known[row, col] != FREE and _crosses(one, (down, right), row, col):
            return False
    for row, col in product(rows[:-1], cols[:-1]):  # the corner below and to the right of a cell
        if (2 * (row - one[0]) + 1) * right == (2 * (col - one[1]) + 1) * down and down * right != 0:
            falls = (down > 0) == (right > 0)
            beside = ((row, col + 1), (row + 1, col)) if falls else ((row, col), (row + 1, col + 1))
            if all(known[cell] != FREE for cell in beside):
                return False
    return True


def _crosses(start: tuple[int, int], way: tuple[int, int], row: int, col: int) -> bool:
    """Whether a line from a middle passes the inside of a square."""
    first, last = Fraction(0), Fraction(1)
    for at, along, low in ((start[0], way[0], row), (start[1], way[1], col)):
        near, far = Fraction(2 * (low - at) - 1, 2), Fraction(2 * (low - at) + 1, 2)
        if along == 0:
            if not near < 0 < far:
                return False
            continue
        one, other = near / along, far / along
        first, last = max(first, min(one, other)), min(last, max(one, other))
    return first < last


def slow_clusters(known: np.ndarray, reach: int | None = None) -> list[list[tuple[int, int]]]:
    """Unknown cells beside free ones, in clusters (R1, R2 of ``frontiers``), by their first cells; None: endless."""
    rows, cols = known.shape
    edges = np.zeros(known.shape, bool)
    for row, col in np.argwhere(known == UNKNOWN).tolist():
        for r, c in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
            edges[row, col] |= 0 <= r < rows and 0 <= c < cols and known[r, c] == FREE
    clusters = []
    while edges.any():
        row, col = np.argwhere(edges)[0].tolist()
        near = np.zeros(edges.shape, bool)
        far = max(rows, cols) if reach is None else reach
        near[max(row - far, 0) : row + far + 1, max(col - far, 0) : col + far + 1] = True
        labels, _ = label(edges & near, np.ones((3, 3)))
        cluster = labels == labels[row, col]
        clusters.append([(r, c) for r, c in np.argwhere(cluster).tolist()])
        edges &= ~cluster
    return clusters


def slow_by_mean(cluster: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The cells, nearest to their mean first, of several equally near the first row by row."""
    n, row, col = len(cluster), sum(cell[0] for cell in cluster), sum(cell[1] for cell in cluster)
    return sorted(sorted(cluster), key=lambda cell: (cell[0] * n - row) ** 2 + (cell[1] * n - col) ** 2)
