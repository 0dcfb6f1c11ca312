"""Find gaps in the straight walls of a map, as end points in cells: ways through, at which ``rooms`` may part rooms.

A wide doorway is hardly narrower than the corridor before it, so that the clearance does not show it
(``narrow_places``). The corridor's wall does: its face is straight, before the gap and behind it. ROSE2 (Luperto et
al., 2022) divides maps along the lines of their walls; here a line counts only where it has a gap.

R1  Lines run along the main direction of the map's walls, or across it. A face is the edge of free cells, ``RUN_M``
    long or longer; all faces within ``HAND_M`` of each other are on one line. So are those of what stands alone: a wall
    that a robot saw as dashes is told from clutter by its line.
R2  A gap is free along the line for ``NARROWEST_GAP_M`` to ``REACH_M``, or free but for what is unseen between rays.
R3  Faces make up ``MOST`` of the line over ``REACH_M`` before the gap and behind it, and ``SOME`` of either.
R4  On the side of the face, the space goes on along the wall, and on the other side it is wider than the gap. Neither
    holds where the walls of rooms are in line across a corridor.
R5  Of gaps within ``AROUND_M`` of each other, the gap with more support counts. This includes the gaps in the two faces
    of one wall.
R6  Where a piece that stands alone is the end of a gap, the wall goes on over it.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import LinearRing, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import polygons_of
from pipeline.sources.tolerances import NARROWEST_DOOR_M, TURN_RAD
from pipeline.tolerances import AROUND_M, BESIDE_M, HAND_M, MOST, RUN_M, SOME

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

NARROWEST_GAP_M: Final = 0.5
REACH_M: Final = 3.0
BEHIND_M: Final = (0.3, 0.6, 1.0)
"""R4: how far from the line the space before a gap is looked at, and that behind it."""
GAP_WIDER_M: Final = 0.4
EXACT: Final = 0.01
"""How much a face in the very row of a gap counts for R5."""


class _Gap(NamedTuple):
    """A gap in a row of cells: the first and the last plus one, and the same with the pieces of wall beside it."""

    support: float
    row: int
    gap: tuple[int, int]
    wall: tuple[int, int]


def find_gaps(free: Bools, cell_m: float, angle: float, *, bare: Bools, seen: Bools) -> tuple[Floats, Floats]:
    """Return the gaps (n, 2, 2) in the lines of walls, and these with the pieces of wall beside them (n, 2, 2; R6).

    Both are the (across, down) of their ends, in cells. ``free`` (rows, cols) are the cells of a map, ``cell_m`` wide,
    also those under clutter; ``bare`` those that are free of it; ``seen`` those that are free or between rays.
    ``angle`` is the main direction of the walls, radians from -pi / 4 to pi / 4.
    """
    cells, back, corner = [free, seen, bare], None, (0, 0)
    if abs(angle) > TURN_RAD:
        turned = [_turn_cells(each, angle) for each in cells]
        cells, corner = _without_margin([each for each, _ in turned], round(REACH_M / cell_m) + 1)
        back = turned[0][1]
    gaps, walls = [np.zeros((0, 2, 2))], [np.zeros((0, 2, 2))]
    for across in (False, True):
        grids = [cv2.transpose(each.view(np.uint8)).view(bool) if across else each for each in cells]
        last = len(grids[0]) - 1
        below = _gaps_below_faces([each[::-1] for each in grids], cell_m)
        found = _gaps_below_faces(grids, cell_m) + [gap._replace(row=last - gap.row) for gap in below]
        for gap in _apart(found, AROUND_M / cell_m):
            for ends, (first, end) in ((gaps, gap.gap), (walls, gap.wall)):
                line = np.array([[(first - 1, gap.row), (end, gap.row)]], np.float64)
                ends.append(line[..., ::-1] if across else line)
    both = np.concatenate(gaps) + corner, np.concatenate(walls) + corner
    return both if back is None else (both[0] @ back[:, :2].T + back[:, 2], both[1] @ back[:, :2].T + back[:, 2])


def _turn_cells(free: Bools, angle: float) -> tuple[Bools, Floats]:
    """Return the cells with the walls along the axes, and the way back (2, 3) of points (across, down)."""
    rows, cols = free.shape
    side = int(np.ceil(np.hypot(rows, cols))) + 2
    turn = np.asarray(cv2.getRotationMatrix2D(((cols - 1) / 2, (rows - 1) / 2), np.degrees(angle), 1.0), np.float64)
    turn[:, 2] += (side - cols) / 2, (side - rows) / 2
    shades = cv2.warpAffine(free.view(np.uint8) * np.uint8(255), turn, (side, side), flags=cv2.INTER_LINEAR)
    return shades > 127, np.asarray(cv2.invertAffineTransform(turn), np.float64)


def _without_margin(grids: list[Bools], margin: int) -> tuple[list[Bools], tuple[int, int]]:
    """Return what of grids (rows, cols) is near their true cells, and the (across, down) of its first cell.

    The space between a turned map and the square around it is up to half of the square.
    """
    boxes = [cv2.boundingRect(each.view(np.uint8)) for each in grids]
    left, top = (max(min(box[k] for box in boxes) - margin, 0) for k in (0, 1))
    right, bottom = (max(box[k] + box[k + 2] for box in boxes) + margin for k in (0, 1))
    return [each[top:bottom, left:right] for each in grids], (left, top)


def _gaps_below_faces(grids: list[Bools], cell_m: float) -> list[_Gap]:
    """Return the gaps in lines along the rows, of faces with the free cells below; ``grids``: free, seen and bare."""
    free, seen, bare = grids
    face = np.zeros_like(free)
    face[:-1] = bare[1:] > bare[:-1]
    lines = _face_lines(face, cell_m)
    reach = max(round(REACH_M / cell_m), 1)
    rows = np.flatnonzero(np.count_nonzero(lines, axis=1) >= 2 * MOST * reach)
    of_rows = lines[rows]
    total = np.zeros((len(rows), lines.shape[1] + 1), np.int32)
    np.cumsum(of_rows, axis=1, dtype=np.int32, out=total[:, 1:])
    found: list[_Gap] = []
    for open_ in (free, seen):
        at, first, end = _runs(open_[rows] > of_rows)
        wide = ((end - first) * cell_m >= NARROWEST_GAP_M) & ((end - first) * cell_m <= REACH_M)  # R2
        at, first, end = at[wide], first[wide], end[wide]
        before = (total[at, first] - total[at, np.maximum(first - reach, 0)]) / reach
        after = (total[at, np.minimum(end + reach, lines.shape[1])] - total[at, end]) / reach
        enough = (np.minimum(before, after) >= SOME) & (before + after >= 2 * MOST)  # R3
        for k in np.flatnonzero(enough).tolist():
            row, start, stop = int(rows[at[k]]), int(first[k]), int(end[k])
            if _widens(open_, row, start, stop, cell_m):
                exact = face[row, max(start - reach, 0) : stop + reach].mean()  # of rows in a band, that of the face
                support = float(before[k] + after[k] + EXACT * exact)
                found.append(_Gap(support, row, (start, stop), _with_pieces(lines[row] & free[row], start, stop)))
    return found


def _with_pieces(pieces: Bools, first: int, last: int) -> tuple[int, int]:
    """Return the first and the last plus one of a gap with the pieces of wall beside it, of a row (cols)."""
    while first > 0 and pieces[first - 1]:
        first -= 1
    while last < len(pieces) and pieces[last]:
        last += 1
    return first, last


def _face_lines(face: Bools, cell_m: float) -> Bools:
    """Return which cells (rows, cols) lie on a line of faces."""
    thick = cv2.dilate(face.view(np.uint8), np.ones((3, 1), np.uint8))
    length = 2 * max(round(RUN_M / 2 / cell_m), 1) + 1  # odd: OpenCV opens with an even one askew
    long = cv2.morphologyEx(thick, cv2.MORPH_OPEN, np.ones((1, length), np.uint8))
    band = 2 * max(round(HAND_M / cell_m), 1) - 1
    return np.asarray(cv2.dilate(long, np.ones((band, 1), np.uint8)).view(bool))


def _runs(flags: Bools) -> tuple[Ints, Ints, Ints]:
    """Return the row (n,) of each run of true in rows of cells, its first cell, and its last plus one."""
    rows, cols = flags.shape
    apart = np.zeros((rows, cols + 1), bool)  # no run goes on into the next row
    apart[:, :-1] = flags
    line = apart.ravel()
    ends = np.flatnonzero(line[1:] != line[:-1]) + 1
    if len(line) and line[0]:
        ends = np.concatenate([[0], ends])
    row, first = np.divmod(ends[::2], cols + 1)
    return row, first, ends[1::2] - row * (cols + 1)


def _widens(free: Bools, row: int, first: int, last: int, cell_m: float) -> bool:
    """Return whether the space goes on along the wall on the face's side, and is wider than the gap on the other."""
    step = max(round(BESIDE_M / cell_m), 1)
    if min(_beyond(free, row + step, first, last)) * cell_m < GAP_WIDER_M:
        return False
    steps = (max(round(away / cell_m), 1) for away in BEHIND_M)
    return any(sum(_beyond(free, row - step, first, last)) * cell_m >= GAP_WIDER_M for step in steps)


def _beyond(free: Bools, row: int, first: int, last: int) -> tuple[int, int]:
    """Return how many cells of a row are free beyond both ends of a gap, seen from its middle; negative within it."""
    middle = (first + last) // 2
    if not 0 <= row < len(free) or not free[row, middle]:
        return first - middle, middle - last
    cells = free[row].tobytes()  # the search of bytes is quicker than that of arrays
    left, right = cells.rfind(0, 0, middle), cells.find(0, middle)
    return first - (left + 1), (right if right >= 0 else len(cells)) - last


def _apart(found: list[_Gap], apart: float) -> list[_Gap]:
    """Return the gaps that stay."""
    kept: list[_Gap] = []
    near: dict[int, list[_Gap]] = {}  # by bands of rows as wide as gaps are apart
    for gap in sorted(found, key=lambda gap: (-gap.support, gap.row, gap.gap)):
        first, last = gap.gap
        band = int(gap.row // apart)
        others = [other for each in (band - 1, band, band + 1) for other in near.get(each, ())]
        if all(abs(gap.row - other.row) > apart or last <= other.gap[0] or first >= other.gap[1] for other in others):
            kept.append(gap)
            near.setdefault(band, []).append(gap)
    return kept


# ---------------------------------------------------------------------------------------------------------------------
# Doorways of a map that was drawn, as four corners each, in cells: where the ends of walls face each other.
#
# A map of walls alone (``RobotMap.walls_only``) is exact to a cell, so that nothing needs to be weighed
# (``narrow_places``): a wall ends at a doorway, and its end is an edge as long as the wall is thick.
#
# R1  A wall's end is an edge of the free cells, ``THINNEST_CELLS`` to ``THICKEST_M`` long, at which the wall turns a
#     corner on both sides. A pillar, which is hardly longer than it is wide, has no ends.
# R2  A doorway lies between two ends that face each other, ``NARROWEST_DOOR_M`` to ``REACH_M`` apart, with free cells
#     between them.
# R3  An end that faces no other end, but the face of a crossing wall at most ``WIDEST_SIDE_DOOR_M`` away, has a doorway
#     too.
# R4  Of doorways that lie over each other, the narrower one counts.
# ---------------------------------------------------------------------------------------------------------------------

THINNEST_CELLS: Final = 1.5
THICKEST_M: Final = 0.5
WIDEST_SIDE_DOOR_M: Final = 2.0
CORNER: Final = 0.8
"""R1: the least sine of the turn at a corner."""
ENDS_FACING: Final = 0.95
"""R2: the least cosine of the angle between the directions in which two ends look."""
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
    """Return the ends (n, 2, 2), y up, in cells, with free cells on the left, and where they look (n, 2)."""
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
    """Return whether a ring is less than twice as long as wide."""
    sides = np.diff(shapely.get_coordinates(shapely.minimum_rotated_rectangle(hole))[:3], axis=0)
    wide, long = sorted(np.hypot(*sides.T).tolist())
    return bool(long < 2 * wide)  # R1: a pillar's length, in widths


def _between_ends(free: Bools, ends: Floats, looks: Floats, cell_m: float) -> list[tuple[float, Floats]]:
    """Return the width, in cells, and the corners (4, 2) of each doorway."""
    middle = ends.mean(axis=1)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    found = []
    for k in range(len(ends)):
        off = middle - middle[k]
        away = off @ looks[k]
        along = np.array([looks[k][1], -looks[k][0]])
        shared = (length + length[k]) / 2 - np.abs(off @ along)
        # R2: ends overlap by most of the shorter one
        faces = (looks @ looks[k] < -ENDS_FACING) & (shared >= MOST * np.minimum(length, length[k]))
        faces &= (away * cell_m >= NARROWEST_DOOR_M) & (away * cell_m <= REACH_M)
        faces &= (np.arange(len(ends)) > k) & (away - SKEW_CELLS <= _free_for(free, middle[k], looks[k]))
        found += [(float(away[i]), np.concatenate([ends[k], ends[i]])) for i in np.flatnonzero(faces).tolist()]
    return found


def _before_faces(free: Bools, ends: Floats, looks: Floats, cell_m: float) -> list[tuple[float, Floats]]:
    """Return the width, in cells, and the corners (4, 2) of each doorway."""
    found = []
    for end, look in zip(ends, looks, strict=True):
        inset = (end[1] - end[0]) * 0.1
        reach = [_free_for(free, corner, look) for corner in (end[0] + inset, end[1] - inset)]
        width = min(reach)
        if NARROWEST_DOOR_M <= width * cell_m <= WIDEST_SIDE_DOOR_M and max(reach) - width <= SKEW_CELLS:
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
