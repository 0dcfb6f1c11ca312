"""Find the doorways of a map that was drawn, as four corners each, in cells: where the ends of walls face each other.

A map of walls alone (``RobotMap.walls_only``) is exact to a cell, so that nothing needs to be weighed
(``separation_odds``): a wall ends at a doorway, and its end is an edge as long as the wall is thick.

R1  A wall's end is an edge of the free cells, ``THINNEST_CELLS`` to ``THICKEST_M`` long, at which the wall turns a
    corner on both sides. A pillar, which is hardly longer than it is wide, has none.
R2  A doorway lies between two ends that face each other, ``NARROWEST_M`` to ``WIDEST_M`` apart, with free cells between
    them.
R3  An end that faces no other, but the face of a wall that runs across, at ``WIDEST_SIDE_DOOR_M`` at most, has a
    doorway too.
R4  Of doorways that lie over each other, the narrower one counts.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LinearRing, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import polygons_of

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

THINNEST_CELLS: Final = 1.5
THICKEST_M: Final = 0.5
NARROWEST_M: Final = 0.3
WIDEST_M: Final = 3.0
WIDEST_SIDE_DOOR_M: Final = 2.0
PILLAR: Final = 2.0
"""R1: a pillar's length, in widths."""
CORNER: Final = 0.8
"""R1: the least sine of the turn at a corner."""
ENDS_FACING: Final = 0.95
"""R2: the least cosine of the angle between the directions in which two ends look."""
BESIDE: Final = 0.5
"""R2: ends overlap by this share of the shorter one."""
STEPS_CELLS: Final = 0.75
"""What the edges of cells are simplified by."""
SKEW_CELLS: Final = 2.0
"""R3: how much farther the face is before one corner of the end than before the other."""
_STEP_CELLS: Final = 0.5


def area_of_cells(mask: Bools) -> BaseGeometry:
    """Return the area of cells (rows, cols), in cells: x is across, and y is up from the first row."""
    flat = np.pad(mask, ((0, 1), (0, 1))).view(np.int8)
    first = np.flatnonzero(np.diff(flat.ravel(), prepend=0) == 1)
    last = np.flatnonzero(np.diff(flat.ravel(), prepend=0) == -1)
    row, left = np.divmod(first, flat.shape[1])
    right = last - row * flat.shape[1]
    order = np.lexsort((row, right, left))
    row, left, right = row[order], left[order], right[order]
    begins = np.ones(len(row), bool)  # of equal runs below each other
    begins[1:] = (left[1:] != left[:-1]) | (right[1:] != right[:-1]) | (row[1:] != row[:-1] + 1)
    at = np.flatnonzero(begins)
    down = row[np.append(at[1:], len(row)) - 1] + 1 if len(row) else row
    return shapely.union_all(shapely.box(left[at], -down, right[at], -row[at]))


def find_doorways(free: Bools, cell_m: float) -> Floats:
    """Return the doorways (n, 4, 2) of free cells (rows, cols): their corners (across, down), in cells.

    The first two corners are those of a wall's end, the others lie opposite, so that the corners run around it.
    """
    ends, ways = _wall_ends(free, cell_m)
    found = _between_ends(free, ends, ways, cell_m) + _before_faces(free, ends, ways, cell_m)
    found.sort(key=lambda each: (each[0], *each[1].ravel().tolist()))
    kept: list[Floats] = []
    shapes: list[Polygon] = []
    for _, corners in found:  # R4
        shape = Polygon(corners).buffer(-STEPS_CELLS / 2)
        if not any(shape.intersects(other) for other in shapes):
            kept.append(corners * (1.0, -1.0))
            shapes.append(shape)
    return np.array(kept).reshape(-1, 4, 2)


def _wall_ends(free: Bools, cell_m: float) -> tuple[Floats, Floats]:
    """R1: return the ends (n, 2, 2), y up, in cells, with free cells on the left, and where they look (n, 2)."""
    found, looks = [], []
    for part in polygons_of(shapely.simplify(area_of_cells(free), STEPS_CELLS)):
        whole = shapely.orient_polygons(part)
        for ring in (whole.exterior, *(hole for hole in whole.interiors if not _is_pillar(hole))):
            points = shapely.get_coordinates(ring)[:-1]
            edges = np.roll(points, -1, axis=0) - points
            length = np.hypot(*edges.T)
            along = edges / np.maximum(length, 1e-9)[:, None]
            before = np.roll(along, 1, axis=0)
            turn = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0]
            is_end = (turn < -CORNER) & (np.roll(turn, -1) < -CORNER)
            is_end &= (length >= THINNEST_CELLS) & (length * cell_m <= THICKEST_M)
            found.append(np.stack([points, points + edges], axis=1)[is_end])
            looks.append(np.stack([-along[:, 1], along[:, 0]], axis=1)[is_end])
    if not found:
        return np.zeros((0, 2, 2)), np.zeros((0, 2))
    return np.concatenate(found), np.concatenate(looks)


def _is_pillar(hole: LinearRing) -> bool:
    """R1."""
    sides = np.diff(shapely.get_coordinates(shapely.minimum_rotated_rectangle(hole))[:3], axis=0)
    wide, long = sorted(np.hypot(*sides.T).tolist())
    return bool(long < PILLAR * wide)


def _between_ends(free: Bools, ends: Floats, looks: Floats, cell_m: float) -> list[tuple[float, Floats]]:
    """R2: return the width, in cells, and the corners (4, 2) of each doorway."""
    middle = ends.mean(axis=1)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    found = []
    for k in range(len(ends)):
        off = middle - middle[k]
        away = off @ looks[k]
        along = np.array([looks[k][1], -looks[k][0]])
        shared = (length + length[k]) / 2 - np.abs(off @ along)
        faces = (looks @ looks[k] < -ENDS_FACING) & (shared >= BESIDE * np.minimum(length, length[k]))
        faces &= (away * cell_m >= NARROWEST_M) & (away * cell_m <= WIDEST_M)
        faces &= (np.arange(len(ends)) > k) & (away - SKEW_CELLS <= _free_for(free, middle[k], looks[k]))
        found += [(float(away[i]), np.concatenate([ends[k], ends[i]])) for i in np.flatnonzero(faces).tolist()]
    return found


def _before_faces(free: Bools, ends: Floats, looks: Floats, cell_m: float) -> list[tuple[float, Floats]]:
    """R3: return the width, in cells, and the corners (4, 2) of each doorway."""
    found = []
    for end, look in zip(ends, looks, strict=True):
        inset = (end[1] - end[0]) * 0.1
        reach = [_free_for(free, corner, look) for corner in (end[0] + inset, end[1] - inset)]
        width = min(reach)
        if NARROWEST_M <= width * cell_m <= WIDEST_SIDE_DOOR_M and max(reach) - width <= SKEW_CELLS:
            found.append((width, np.concatenate([end, end[::-1] + width * look])))
    return found


def _free_for(free: Bools, start: Floats, look: Floats) -> float:
    """Return how far cells are free from a point (x, y up) in a direction, in cells."""
    steps = np.arange(_STEP_CELLS / 2, max(free.shape), _STEP_CELLS)  # none ends on the edge of a cell
    at = start + look * steps[:, None]
    cols, rows = np.floor(at[:, 0]).astype(int), np.floor(-at[:, 1]).astype(int)
    inside = (rows >= 0) & (rows < free.shape[0]) & (cols >= 0) & (cols < free.shape[1])
    taken = ~inside
    taken[inside] = ~free[rows[inside], cols[inside]]
    return float(steps[int(taken.argmax())] - _STEP_CELLS / 2) if taken.any() else float(max(free.shape))
