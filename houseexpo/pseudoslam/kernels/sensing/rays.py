"""Scan along rays: list the cells on the rays as the published simulator does, and measure exact ranges of beams.

In a scan of the published simulator, sample k of a ray is the cell whose centre is closest to the point k pixels along
it, for k from 0 to the rounded range. The first occupied one ends the ray and is also seen.

If nothing moves and the map has no errors, samples that the map shows as free need not be checked. In each quadrant
around the robot, a rectangle of free cells is found first, and rays start where they leave it. Since rooms are usually
rectangular, three of four samples are skipped.

The ranges of beams (``cast_beams``) are exact: cells are squares, and none on a beam is missed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import CHUNK_BITS, FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.tolerances import CORNER_PX
from houseexpo.pseudoslam.kernels.types import Cells, Floats, Grid, Runs, as_bool

_EVEN = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds like np.rint, half to even
_BLOCK, _FEW = 32, 12  # samples whose cells are computed together, as the processor does four at once; few near the end
_MIN = 1e-300  # for a ray along the grid, which never leaves it on the other axis


@njit(cache=True, nogil=True)
def ray_scan(
    occupied: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float,
    runs: Runs, hit: Cells,
) -> tuple[int, int]:  # fmt: skip
    """List the cells on the rays; those near the robot occur many times.

    Parameters
    ----------
    fan_cos, fan_sin
        (n,), the rays' directions relative to the heading.
    runs, hit
        Output: flat indices, with space for all samples of all rays, and for one per ray. A run is one cell.

    Returns
    -------
    The numbers of entries in ``runs`` and in ``hit``.
    """
    flat, (rows, cols) = occupied.ravel(), occupied.shape
    n = len(fan_cos)
    rights, ups, starts, stops = np.empty(n), np.empty(n), np.empty(n, np.int32), np.empty(n, np.int32)
    samples = _lay_rays(occupied, x, y, heading, fan_cos, fan_sin, range_px, as_bool(False), rights, ups, starts, stops)
    places, offsets = np.empty(_BLOCK), np.arange(_BLOCK).astype(np.float64)
    cells = places.view(np.uint32)
    n_runs, n_hit = 0, 0
    for i in range(n):
        k, safe, right, up = 0, stops[i], rights[i], ups[i]
        while k < samples:
            found = _find(places, offsets, x, y, right, up, k, safe, rows, cols, _BLOCK)
            if found == 0:
                break
            for t in range(found):
                cell = np.uint64(cells[np.uint64(2 * t)])
                if flat[cell] == 0:
                    runs[n_runs, 0], runs[n_runs, 1] = cell, cell
                    n_runs += 1
                    continue
                if k + t > 0:  # nothing is visible inside an obstacle
                    hit[n_hit] = cell
                    n_hit += 1
                k = samples
                break
            k += found
    return n_runs, n_hit


@njit(cache=True, nogil=True)
def merge_ray_scan(
    occupied: Grid, observable: Grid, known: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats,
    range_px: float, hit: Cells, settled: bool, fresh: Grid,
) -> tuple[int, int, int]:  # fmt: skip
    """Scan like ``ray_scan`` and set the free cells of the map directly, since listing them first takes twice as long.

    With ``settled``, the map is assumed to be correct, since nothing moves and it has no errors. Obstacles that it
    already contains are not listed in ``hit``. ``fresh`` is that of ``mapping.merge_cells``.

    Returns
    -------
    How many cells were unknown before, how many of those count, and the number of entries in ``hit``.
    """
    flat, counts, drawn, (rows, cols) = occupied.ravel(), observable.ravel(), known.ravel(), occupied.shape
    n = len(fan_cos)
    rights, ups, starts, stops = np.empty(n), np.empty(n), np.empty(n, np.int32), np.empty(n, np.int32)
    samples = _lay_rays(known, x, y, heading, fan_cos, fan_sin, range_px, settled, rights, ups, starts, stops)
    places, offsets = np.empty(_BLOCK), np.arange(_BLOCK).astype(np.float64)
    cells = places.view(np.uint32)
    most = _FEW if settled else _BLOCK  # if settled, rays start near the wall
    new, covered, n_hit = 0, 0, 0
    for i in range(n):
        k, safe, right, up = starts[i], stops[i], rights[i], ups[i]
        while k < samples:
            found = _find(places, offsets, x, y, right, up, k, safe, rows, cols, most)
            if found == 0:
                break
            for t in range(found):
                cell = np.uint64(cells[np.uint64(2 * t)])
                state = drawn[cell]
                if settled and state != UNKNOWN:
                    if state == FREE:
                        continue
                    k = samples
                    break
                if flat[cell] == 0:
                    if state == UNKNOWN:
                        new += 1
                        covered += int(counts[cell])
                        if len(fresh) > 0:
                            fresh[np.uint64(int(cell) >> CHUNK_BITS)] = 1
                    drawn[cell] = FREE
                    continue
                if k + t > 0:
                    hit[n_hit] = cell
                    n_hit += 1
                k = samples
                break
            k += found
    return new, covered, n_hit


@njit(cache=True, nogil=True)
def _lay_rays(
    known: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float, settled: bool,
    rights: Floats, ups: Floats, starts: Cells, stops: Cells,
) -> int:  # fmt: skip
    """Write for each ray its direction, right and up, and the first samples that need checks of two kinds.

    All four are (n,). Samples before the first of the two are in cells known to be free; those before the second are on
    the grid. Return the number of samples within range. All rays are computed together, four at a time.
    """
    rows, cols = known.shape
    cos, sin = math.cos(heading), math.sin(heading)
    x0, y0 = x - 0.5, y - 0.5  # cell centres at whole numbers
    col, row = int(x0 + _EVEN - _EVEN), int(y0 + _EVEN - _EVEN)
    inside = 0 <= col < cols and 0 <= row < rows
    samples = range_px + _EVEN - _EVEN + 1.0 if inside else 0.0
    room = np.full((4, 2), -1.0)  # for each quadrant, distances to the last free cell's centre across and along
    if settled and inside:
        for q in range(4):
            across, along = 1 - 2 * (q & 1), 1 - (q & 2)
            free_cols, free_rows = find_free_rectangle(known, col, row, across, along, int(range_px))
            room[q, 0], room[q, 1] = free_cols + (col - x0) * across, free_rows + (row - y0) * along
    (wide_se, high_se), (wide_sw, high_sw), (wide_ne, high_ne), (wide_nw, high_nw) = room
    east, south = cols - 1.0 - x0, rows - 1.0 - y0
    for k in range(len(fan_cos)):
        i = np.uint64(k)
        right, up = fan_cos[i] * cos - fan_sin[i] * sin, fan_sin[i] * cos + fan_cos[i] * sin
        is_west, is_north = right < 0.0, up > 0.0
        per_col, per_row = 1.0 / max(abs(right), _MIN), 1.0 / max(abs(up), _MIN)
        wide = (wide_nw if is_west else wide_ne) if is_north else (wide_sw if is_west else wide_se)
        high = (high_nw if is_west else high_ne) if is_north else (high_sw if is_west else high_se)
        stop = min((x0 if is_west else east) * per_col, (y0 if is_north else south) * per_row)
        rights[i], ups[i] = right, up
        starts[i] = np.int32(min(max(min(wide * per_col, high * per_row), 0.0), samples))
        stops[i] = np.int32(min(max(stop, 0.0), samples))
    return int(samples)


@njit(cache=True, nogil=True)
def find_free_rectangle(known: Grid, col: int, row: int, across: int, along: int, far: int) -> tuple[int, int]:
    """Return the columns and rows beyond a cell of the largest rectangle of free cells, -1 if there is none.

    ``across`` and ``along`` are 1 or -1: right or left, down or up. The rectangle has at most ``far`` cells per side.
    """
    rows, cols = known.shape
    flat = known.ravel()
    wide = min(far, cols - 1 - col if across > 0 else col)
    last = min(far, rows - 1 - row if along > 0 else row)
    best_wide, best_high, best = -1, -1, 0
    for high in range(last + 1):
        line = (row + high * along) * cols + col
        first = line if across > 0 else line - wide
        free = True
        for cell in range(first, first + wide + 1):
            free &= flat[np.uint64(cell)] == FREE
        if not free:
            wide = -1
            while flat[np.uint64(line + (wide + 1) * across)] == FREE:  # something is not
                wide += 1
        if (wide + 1) * (high + 1) > best:
            best_wide, best_high, best = wide, high, (wide + 1) * (high + 1)
        elif (wide + 1) * (last + 1) <= best:  # nor can be
            break
    return best_wide, best_high


@njit(inline="always")
def _find(
    places: Floats, offsets: Floats, x: float, y: float, right: float, up: float, k: int, safe: int,
    rows: int, cols: int, most: int,
) -> int:  # fmt: skip
    """Write the flat indices of up to ``most`` samples from k on to the lower halves of ``places``; return the number.

    Before ``safe`` they lie on the grid; after that they are computed one by one, up to the end of the grid.
    """
    x0, y0 = x - 0.5, y - 0.5
    first, width = float(k), float(cols)
    if k < safe:
        found = min(safe - k, most)
        for t in range(found):
            at = first + offsets[np.uint64(t)]
            col, row = x0 + at * right + _EVEN - _EVEN, y0 - at * up + _EVEN - _EVEN
            places[np.uint64(t)] = row * width + col + _EVEN
        return found
    col, row = x0 + first * right + _EVEN - _EVEN, y0 - first * up + _EVEN - _EVEN
    places[0] = row * width + col + _EVEN
    return 1 if 0.0 <= col < cols and 0.0 <= row < rows else 0


@njit(cache=True, nogil=True)
def cast_beams(
    occupied: Grid, x: float, y: float, heading: float, fan_cos: Floats, fan_sin: Floats, range_px: float, out: Floats
) -> None:
    """Write the distance along each beam in pixels, ``range_px`` if there is no obstacle within it.

    All are 0 inside an obstacle. A beam that leaves the grid, or starts outside it, hits nothing; one along the border
    of an obstacle or through its corner passes it.

    Parameters
    ----------
    occupied
        (rows, cols), not 0 for obstacles.
    fan_cos, fan_sin
        (n,), the beams' directions relative to the heading.
    out
        (n,), output.
    """
    cos, sin = math.cos(heading), math.sin(heading)
    for i in range(len(fan_cos)):
        right = fan_cos[i] * cos - fan_sin[i] * sin
        up = fan_sin[i] * cos + fan_cos[i] * sin
        out[i] = beam_length(occupied, x, y, right, -up, range_px)


@njit(cache=True, nogil=True)
def beam_length(occupied: Grid, x: float, y: float, right: float, down: float, range_px: float) -> float:
    """Return the length of a beam in the direction (``right``, ``down``, a unit vector), as defined by ``cast_beams``.

    It goes from cell to cell; ``to_x`` and ``to_y`` are the distances along the line to its next borders.
    """
    rows, cols = occupied.shape
    flat = occupied.ravel()
    col, row = math.floor(x), math.floor(y)
    step_x, step_y = (1 if right > 0.0 else -1), (1 if down > 0.0 else -1)
    wide = 1.0 / abs(right) if right != 0.0 else math.inf  # distance along the line between borders
    high = 1.0 / abs(down) if down != 0.0 else math.inf
    to_x = (col + 1 - x if step_x > 0 else x - col) * wide if right != 0.0 else math.inf
    to_y = (row + 1 - y if step_y > 0 else y - row) * high if down != 0.0 else math.inf
    gone = 0.0
    while gone < range_px and 0 <= col < cols and 0 <= row < rows:
        if flat[row * cols + col] != 0:
            return gone
        if to_x < to_y - CORNER_PX:
            gone = to_x
            to_x += wide
            col += step_x
        elif to_y < to_x - CORNER_PX:
            gone = to_y
            to_y += high
            row += step_y
        else:  # a corner is closed if both squares beside it are occupied
            gone = min(to_x, to_y)
            if _is_solid(occupied, row, col + step_x) and _is_solid(occupied, row + step_y, col):
                return min(gone, range_px)
            to_x += wide
            to_y += high
            col += step_x
            row += step_y
    return range_px


@njit(cache=True, nogil=True)
def _is_solid(occupied: Grid, row: int, col: int) -> bool:
    rows, cols = occupied.shape
    return bool(0 <= row < rows and 0 <= col < cols and occupied[row, col] != 0)
