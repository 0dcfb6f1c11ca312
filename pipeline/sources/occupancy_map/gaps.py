"""Find gaps in the straight walls of a map, as end points in cells: ways through, at which ``rooms`` may part rooms.

A wide doorway is hardly narrower than the corridor before it, so that the clearance does not show it
(``narrow_places``). The corridor's wall does: its face is straight, before the gap and behind it. ROSE2 (Luperto et
al., 2022) divides maps along the lines of their walls; here a line counts only where it has a gap.

R1  Lines run along the main direction of the map's walls, or across it. A face is the edge of free cells, ``FACE_M``
    long or longer; all faces within ``BAND_M`` of each other are on one line.
R2  A gap is free along the line for ``NARROWEST_M`` to ``WIDEST_M``.
R3  Faces make up ``SUPPORT`` of the line over ``REACH_M`` before the gap and behind it, and ``EACH_SIDE`` of either.
R4  On the side of the face, the space goes on along the wall, and on the other side it is wider than the gap. Where the
    walls of rooms are in line across a corridor, neither is so.
R5  Of gaps that are in the way of each other, within ``APART_M``, the one with more support counts.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

FACE_M: Final = 0.3
BAND_M: Final = 0.1
NARROWEST_M: Final = 0.5
WIDEST_M: Final = 3.0
REACH_M: Final = 3.0
SUPPORT: Final = 0.5
EACH_SIDE: Final = 0.3
BEFORE_M: Final = 0.3
BEHIND_M: Final = (0.3, 0.6, 1.0)
"""R4: how far from the line the space before a gap is looked at, and that behind it."""
WIDER_M: Final = 0.4
APART_M: Final = 1.0
EXACT: Final = 0.01
"""How much a face in the very row of a gap counts for R5."""
STRAIGHT_RAD: Final = 1e-3


def find_gaps(free: Bools, cell_m: float, angle: float) -> Floats:
    """Return the gaps (n, 2, 2) in the lines of walls: the (across, down) of their ends, in cells.

    ``free`` (rows, cols) are the cells of a map, ``cell_m`` wide; ``angle`` is the main direction of its walls, radians
    from -pi / 4 to pi / 4.
    """
    turned, back = free, None
    if abs(angle) > STRAIGHT_RAD:
        turned, back = _turn_cells(free, angle)
    found = []
    for across in (False, True):
        grid = np.ascontiguousarray(turned.T) if across else turned
        for way in (1, -1):
            gaps = _gaps_below_faces(grid[::way], cell_m)
            if way < 0:
                gaps[..., 1] = len(grid) - 1 - gaps[..., 1]
            found.append(gaps[..., ::-1] if across else gaps)
    gaps = np.concatenate(found)
    return gaps if back is None else gaps @ back[:, :2].T + back[:, 2]


def _turn_cells(free: Bools, angle: float) -> tuple[Bools, Floats]:
    """Return the cells with the walls along the axes, and the way back (2, 3) of points (across, down)."""
    rows, cols = free.shape
    side = int(np.ceil(np.hypot(rows, cols))) + 2
    turn = np.asarray(cv2.getRotationMatrix2D(((cols - 1) / 2, (rows - 1) / 2), np.degrees(angle), 1.0), np.float64)
    turn[:, 2] += (side - cols) / 2, (side - rows) / 2
    shades = cv2.warpAffine(free.view(np.uint8) * np.uint8(255), turn, (side, side), flags=cv2.INTER_LINEAR)
    return shades > 127, np.asarray(cv2.invertAffineTransform(turn), np.float64)


def _gaps_below_faces(free: Bools, cell_m: float) -> Floats:
    """Return the gaps in lines along the rows, of faces with the free cells below them."""
    face = np.zeros_like(free)
    face[:-1] = ~free[:-1] & free[1:]
    lines = _face_lines(face, cell_m)
    reach = max(round(REACH_M / cell_m), 1)
    found: list[tuple[float, int, int, int]] = []
    for row in np.flatnonzero(lines.sum(axis=1) >= 2 * SUPPORT * reach).tolist():
        runs = _runs(free[row] & ~lines[row])
        width_m = (runs[:, 1] - runs[:, 0]) * cell_m
        runs = runs[(width_m >= NARROWEST_M) & (width_m <= WIDEST_M)]  # R2
        total = np.concatenate([[0], np.cumsum(lines[row])])
        before = (total[runs[:, 0]] - total[np.maximum(runs[:, 0] - reach, 0)]) / reach
        after = (total[np.minimum(runs[:, 1] + reach, len(total) - 1)] - total[runs[:, 1]]) / reach
        enough = (np.minimum(before, after) >= EACH_SIDE) & (before + after >= 2 * SUPPORT)  # R3
        for k in np.flatnonzero(enough).tolist():
            first, last = runs[k].tolist()
            if _widens(free, row, first, last, cell_m):
                exact = face[row, max(first - reach, 0) : last + reach].mean()  # of rows in a band, that of the face
                found.append((float(before[k] + after[k] + EXACT * exact), row, first, last))
    return _apart(found, APART_M / cell_m)


def _face_lines(face: Bools, cell_m: float) -> Bools:
    """R1: return which cells (rows, cols) lie on a line of faces."""
    thick = cv2.dilate(face.view(np.uint8), np.ones((3, 1), np.uint8))
    length = 2 * max(round(FACE_M / 2 / cell_m), 1) + 1  # odd: OpenCV opens with an even one askew
    long = cv2.morphologyEx(thick, cv2.MORPH_OPEN, np.ones((1, length), np.uint8))
    band = 2 * max(round(BAND_M / cell_m), 1) - 1
    return np.asarray(cv2.dilate(long, np.ones((band, 1), np.uint8)).view(bool))


def _runs(flags: Bools) -> Ints:
    """Return the first and the last plus one (n, 2) of runs of true."""
    return np.flatnonzero(np.diff(np.concatenate([[0], flags.view(np.int8), [0]]))).reshape(-1, 2)


def _widens(free: Bools, row: int, first: int, last: int, cell_m: float) -> bool:
    """R4."""
    step = max(round(BEFORE_M / cell_m), 1)
    if min(_beyond(free, row + step, first, last)) * cell_m < WIDER_M:
        return False
    steps = (max(round(away / cell_m), 1) for away in BEHIND_M)
    return any(sum(_beyond(free, row - step, first, last)) * cell_m >= WIDER_M for step in steps)


def _beyond(free: Bools, row: int, first: int, last: int) -> tuple[int, int]:
    """Return how many cells of a row are free beyond both ends of a gap, seen from its middle; negative within it."""
    middle = (first + last) // 2
    if not 0 <= row < len(free) or not free[row, middle]:
        return first - middle, middle - last
    taken = ~free[row]
    ahead, back = taken[middle:], taken[middle::-1]
    right = int(ahead.argmax()) if ahead.any() else len(ahead)
    left = int(back.argmax()) if back.any() else len(back)
    return first - (middle - left + 1), middle + right - last


def _apart(found: list[tuple[float, int, int, int]], apart: float) -> Floats:
    """R5: return the gaps (n, 2, 2) that stay, of (support, row, first, last)."""
    kept: list[tuple[int, int, int]] = []
    for _, row, first, last in sorted(found, key=lambda gap: (-gap[0], *gap[1:])):
        if all(abs(row - there) > apart or last <= start or first >= end for there, start, end in kept):
            kept.append((row, first, last))
    return np.array([[(first - 1, row), (last, row)] for row, first, last in kept], np.float64).reshape(-1, 2, 2)
