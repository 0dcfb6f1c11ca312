"""Robots' maps with known rooms or ways: drawn as text, drawn at random, Bormann's, made from plans."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import scipy.ndimage
from PIL import Image
from scipy.ndimage import label
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from houseexpo.grids import read_map

Bools = npt.NDArray[np.bool_]
Labels = npt.NDArray[np.int32]

CELL_M = 0.05
WHITE = 250
"""Bormann's maps are free where they are lighter."""
COLOURED = 229
"""ROSE2 takes what is lighter than this and than unknown space for free, and colours it."""
TRUE_PX = 200
LACKED = {"freiburg_building101": (0, 1)}
"""How many rows and columns at the top and at the left of a map of ROSE2's its truth lacks."""
SCALED = frozenset({"NOGT-intel_map"})
"""ROSE2's maps whose truth was scaled by a pixel."""
_TRUTH = "_gt_segmentation"


@dataclass(frozen=True, eq=False)
class TrueMap:
    """A map (rows, cols) with the number of the true room of each cell, 0 for none.

    ``coloured`` are the cells on which the truth has rooms, where these are not the free cells.
    """

    name: str
    free: Bools
    rooms: Labels
    coloured: Bools | None = None
    occupied: Bools | None = None


def grey(path: Path) -> npt.NDArray[np.uint8]:
    """Return a picture as grey."""
    return np.asarray(Image.open(path).convert("L"))


def bormann_maps(folder: Path, kind: str = "") -> Iterator[TrueMap]:
    """Yield Bormann's maps with truth, by name; ``kind`` is "", "_furnitures", "_trashbins" or both."""
    for truth in sorted(folder.glob(f"*{_TRUTH}.png")):
        name = truth.stem.removesuffix(_TRUTH) + kind
        picture = folder / f"{name}.png"
        if not picture.is_file():
            continue
        free = grey(picture) > WHITE
        if free.shape == grey(truth).shape:  # one of the furnished maps has another scale
            _, rooms = cv2.connectedComponents((grey(truth) > WHITE).view(np.uint8), connectivity=4)
            sizes = np.bincount(rooms.ravel())
            sizes[0] = 0
            true = np.where(sizes[rooms] > TRUE_PX, rooms, 0).astype(np.int32)
            yield TrueMap(name, free, true, occupied=read_map(picture, CELL_M).occupied)


def furnished(made: TrueMap, rng: np.random.Generator) -> TrueMap:
    """Put furniture into the rooms of a map: along walls, free in the room, and small things; doors stay passable."""
    taken = np.zeros_like(made.free)
    doors = made.free & (made.rooms == 0)
    from_door = scipy.ndimage.distance_transform_edt(~doors) * CELL_M
    from_wall = scipy.ndimage.distance_transform_edt(made.rooms > 0) * CELL_M
    for number, box in enumerate(scipy.ndimage.find_objects(made.rooms), 1):
        if box is None:
            continue
        room = made.rooms[box] == number
        if room.sum() * CELL_M**2 > 2.0:
            taken[box] |= _in_room(room, np.where(room, from_wall[box], 0.0), from_door[box], rng)
    return TrueMap(f"{made.name} furnished", made.free & ~taken, made.rooms)


def _in_room(room: Bools, from_wall: np.ndarray, from_door: np.ndarray, rng: np.random.Generator) -> Bools:
    down, right = np.gradient(from_wall)
    taken = np.zeros_like(room)
    row, col = np.nonzero(room)
    angle = rng.uniform(0, np.pi)
    corridor = from_wall.max() < 1.5 and len(row) * CELL_M**2 > 15.0  # people keep these clear
    wanted = rng.uniform(0.04, 0.2) * len(row) * (0.2 if corridor else 1.0)
    for _ in range(120):
        if taken.sum() > wanted:
            break
        k = rng.integers(len(row))
        middle = np.array([col[k], row[k]], float)
        turn = angle + rng.integers(4) * np.pi / 2
        if rng.random() < 0.2:
            long, deep = rng.uniform(0.1, 0.5, 2)
            turn = rng.uniform(0, np.pi)
        else:
            long, deep = rng.uniform(0.8, 2.4), rng.uniform(0.35, 0.9)
            if rng.random() < 0.2:
                long, deep = rng.uniform(1, 4), rng.uniform(0.3, 0.6)
            slope = np.array([right[row[k], col[k]], down[row[k], col[k]]])
            steep = np.hypot(*slope)
            if rng.random() < 0.75:  # against the wall
                if steep < 0.02:
                    continue
                middle -= slope / steep * (from_wall[row[k], col[k]] - deep / 2 - rng.choice([0, 0, 0, 0.1])) / CELL_M
                turn = np.arctan2(slope[1], slope[0]) + np.pi / 2
        box = cv2.boxPoints((tuple(middle.tolist()), (long / CELL_M, deep / CELL_M), float(np.degrees(turn))))
        piece = np.zeros(room.shape, np.uint8)
        cv2.fillPoly(piece, [np.rint(box).astype(np.int32)], 1)
        here = (piece > 0) & room
        if here.any() and from_door[here].min() > rng.choice([0.3, 0.6, 0.9]):
            taken |= here
    return taken


def noisy(made: TrueMap, rng: np.random.Generator) -> TrueMap:
    """Make walls rough, and sprinkle specks of obstacles and of free space, as a SLAM's map has them."""
    free = made.free.copy()
    rough = rng.choice([0.0, 0.6, 0.6, 1.2])
    if rough:
        inward = scipy.ndimage.distance_transform_edt(free) - scipy.ndimage.distance_transform_edt(~free)
        noise = scipy.ndimage.gaussian_filter(rng.normal(size=free.shape), rng.uniform(0.7, 3.0))
        free = inward + noise * (rough / noise.std()) > 0
    share = rng.choice([0.0, 1e-4, 1e-3])
    specks = rng.random(free.shape) < share
    free &= ~(scipy.ndimage.binary_dilation(specks) if rng.random() < 0.5 else specks)
    free |= rng.random(free.shape) < share / 3
    return TrueMap(f"{made.name} noisy", free, made.rooms)


def rose_maps(folder: Path) -> Iterator[TrueMap]:
    """Yield ROSE2's maps with truth, by name; as in ROSE2's evaluator, each colour but black is a room.

    Some truths are a pixel smaller or larger than the map, and get the map's size here: most have the map's upper left
    corner, one lacks the first column (LACKED), and one was scaled (SCALED). ROSE2's own pictures of rooms show which:
    they lie so, to the pixel, on cells of the map that are lighter than unknown space. Free cells are those of
    ``read_map``.
    """
    for truth in sorted(folder.glob("*_truth.png")):
        name = truth.stem.removesuffix("_truth")
        colours = np.asarray(Image.open(truth).convert("RGB")).astype(np.int32) @ (1 << 16, 1 << 8, 1)
        values, number = np.unique(colours, return_inverse=True)
        file = folder / f"{name}.png"
        read = read_map(file, CELL_M)
        free = read.free
        shades = grey(file)
        unknown = np.bincount(shades[shades < WHITE], minlength=COLOURED)[COLOURED // 2 :].argmax() + COLOURED // 2
        numbers = (number.reshape(colours.shape) + int(values[0] != 0)).astype(np.int32)
        coloured = shades > max(COLOURED, unknown)
        yield TrueMap(name, free, _on_map(numbers, name, free.shape), coloured, read.occupied)


def _on_map(numbers: Labels, name: str, shape: tuple[int, ...]) -> Labels:
    """Return the numbers of true rooms, of a picture, on the cells of ROSE2's map of this name and shape."""
    if name in SCALED:
        rows, cols = (np.rint(np.linspace(0, n - 1, m)).astype(int) for n, m in zip(numbers.shape, shape, strict=True))
        return numbers[rows][:, cols]
    rooms = np.zeros(shape, np.int32)
    down, right = LACKED.get(name, (0, 0))
    part = numbers[: shape[0] - down, : shape[1] - right]
    rooms[down : down + part.shape[0], right : right + part.shape[1]] = part
    return rooms


def true_doors(made: TrueMap) -> npt.NDArray[np.float64]:
    """Return the middles (n, 2) of the free cells between two true rooms, (across, down) in cells: strokes."""
    _, pieces, stats, middles = cv2.connectedComponentsWithStats(
        (made.free & (made.rooms == 0)).view(np.uint8), connectivity=8
    )
    found = []
    for number in range(1, len(stats)):
        left, top, wide, high, _ = stats[number].tolist()
        part = np.s_[max(top - 2, 0) : top + high + 2, max(left - 2, 0) : left + wide + 2]
        near = cv2.dilate((pieces[part] == number).view(np.uint8), np.ones((3, 3), np.uint8)) > 0
        if len(np.unique(made.rooms[part][near & (made.rooms[part] > 0)])) > 1:
            found.append(middles[number])
    return np.array(found).reshape(-1, 2)


# Maps of robots, drawn as text and at random, and slow twins of what is planned by them.


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
    """Cell by cell, in whose middle a disc meets none that is closed (R1 to R3 of ``kernels.planning.paths``)."""
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
