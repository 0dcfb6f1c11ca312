"""Find which robots of a team hear each other, and let them copy each other's maps, for many teams at once.

R1  All robots send what they knew before the exchange.
R2  A robot copies known cells into its unknown ones, from the robots that it hears in the order of their numbers.

Only chunks are examined in which a robot may know cells that the other robot has not received (``pending``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import CHUNK, CHUNK_BITS
from houseexpo.pseudoslam.kernels.team_step import EVERYONE, TeamKnowledge, TeamObstacles, copy_known_cells
from houseexpo.pseudoslam.kernels.types import Bits, Counts, Floats, Grid, Rows

NONE, ALWAYS, RANGE, SIGHT, SIGNAL = range(5)
"""Values of ``RadioParams.model``, in the order of the names of ``teams.tasks.Model``."""


class RadioParams(NamedTuple):
    """The parameters of a radio, which ``teams.tasks.Radio`` describes."""

    model: int
    cell_m: float
    range_m: float
    power_dbm: float
    threshold_dbm: float
    loss_db: float
    reference_m: float
    air_exponent: float
    wall_exponent: float
    wall_unit_m: float


@njit(cache=True, nogil=True)
def received_dbm(link: RadioParams, air_m: float, wall_m: float) -> float:
    """Return the received power after lengths in air and in walls."""
    loss = link.loss_db
    if wall_m > 0.0:
        loss += 10.0 * link.wall_exponent * math.log10(max(wall_m / link.wall_unit_m, 1.0))
    if air_m >= link.reference_m:
        loss += 10.0 * link.air_exponent * math.log10(air_m / link.reference_m)
    return link.power_dbm - loss


@njit(cache=True, nogil=True)
def find_heard(link: RadioParams, walls: Grid, places: Floats, heard: Grid) -> bool:
    """Write who hears whom (R, R), symmetric, 0 on the diagonal; return whether each robot reaches every other one.

    Parameters
    ----------
    walls
        (rows, cols), not 0 for static obstacles.
    places
        (R, 2), pixels.
    """
    robots = len(places)
    for i in range(robots):
        heard[i, i] = 0
        for j in range(i):
            heard[i, j] = heard[j, i] = _hears(link, walls, places[i], places[j])
    reached, number = np.zeros(robots, np.uint8), 1
    reached[0] = 1
    for _ in range(robots):
        before = number
        for i in range(robots):
            if reached[i] != 0:
                for j in range(robots):
                    if heard[i, j] != 0 and reached[j] == 0:
                        reached[j] = 1
                        number += 1
        if number == before:
            break
    return number == robots


@njit(cache=True, nogil=True)
def _hears(link: RadioParams, walls: Grid, one: Floats, other: Floats) -> bool:
    if link.model <= ALWAYS:
        return link.model == ALWAYS
    way_m = math.hypot(other[0] - one[0], other[1] - one[1]) * link.cell_m
    if link.model == SIGNAL:
        wall_m = length_in_walls(walls, one[0], one[1], other[0], other[1]) * link.cell_m
        return received_dbm(link, way_m - wall_m, wall_m) > link.threshold_dbm
    if way_m > link.range_m:
        return False
    return link.model == RANGE or length_in_walls(walls, one[0], one[1], other[0], other[1]) == 0.0


@njit(cache=True, nogil=True)
def exchange_maps(
    known: Grid, observable: Grid, counts: Rows, sizes: Counts, others: TeamObstacles, shared: TeamKnowledge,
    link: RadioParams, heard: Grid, joined: Grid, wanted: Grid, first: int, end: int,
) -> None:  # fmt: skip
    """Let the robots of the ``wanted`` teams exchange their maps, and count what is new to them.

    Parameters
    ----------
    known, observable, counts, sizes
        Arrays of the pool of all robots (N * R, ...).
    heard, joined, wanted
        ``heard`` (N, R, R), who hears whom, and ``joined`` (N,), whether each robot reaches every other one, are
        written. ``wanted`` (N,) is not 0 for teams that exchange.
    """
    robots = others.places.shape[1]
    for i in range(first, end):
        if wanted[i] == 0:
            continue
        row = i * robots
        rows, cols = sizes[row, 0], sizes[row, 1]
        walls = others.walls[i, : rows * cols].reshape((rows, cols))
        joined[i] = find_heard(link, walls, others.places[row], heard[i])
        if shared.pending.shape[2] > 0:
            maps, seen = known[row : row + robots], observable[row]
            own_counts, cells = counts[row : row + robots], rows * cols
            _exchange(maps, seen, own_counts, cells, heard[i], shared.pending[i], shared.waiting[i])


@njit(cache=True, nogil=True)
def _exchange(
    maps: Grid, observable: Grid, counts: Rows, cells: int, heard: Grid, pending: Bits, waiting: Bits
) -> None:
    """Exchange the maps of one team's robots (R, cells), by R1 and R2."""
    robots, chunks = len(maps), (cells + CHUNK - 1) >> CHUNK_BITS
    listeners = np.zeros(robots, np.int64)
    for j in range(robots):
        for i in range(robots):
            listeners[j] |= np.int64(heard[i, j] != 0) << i
    before = np.empty((robots, CHUNK), np.uint8)
    for group in range((chunks + CHUNK - 1) >> CHUNK_BITS):
        waits = 0
        for j in range(robots):
            waits |= waiting[j, group] & listeners[j]
        if waits == 0:
            continue
        start = group << CHUNK_BITS
        stop = min(start + CHUNK, chunks)
        for chunk in range(start, stop):
            waits = 0
            for j in range(robots):
                waits |= pending[j, np.uint64(chunk)] & listeners[j]
            if waits != 0:
                _exchange_chunk(maps, observable, counts, cells, chunk, pending, listeners, before)
        for j in range(robots):
            left = np.uint16(0)
            for chunk in range(start, stop):
                left = np.uint16(left | pending[j, np.uint64(chunk)])
            waiting[j, group] = left


@njit(cache=True, nogil=True)
def _exchange_chunk(
    maps: Grid, observable: Grid, counts: Rows, cells: int, chunk: int, pending: Bits, listeners: Counts, before: Grid
) -> None:
    """Exchange one chunk of the maps, and note who has not been told of it; ``before`` is working memory."""
    robots, low = len(maps), chunk << CHUNK_BITS
    size = min(CHUNK, cells - low)
    for j in range(robots):  # R1
        for t in range(size):
            before[j, np.uint64(t)] = maps[j, np.uint64(low + t)]
    untold = np.zeros(robots, np.int64)
    for i in range(robots):
        source, count = -1, counts[i, 0]
        for j in range(robots):
            if (pending[j, chunk] & listeners[j]) >> i & 1 == 0:
                continue
            pending[j, chunk] &= EVERYONE & ~(1 << i)
            own = maps[i, low : low + size]
            new, covered = copy_known_cells(own, before[j], observable[low : low + size], 0, size)
            count.known += new
            count.covered += covered
            if new > 0:
                source = j if source == -1 else -2
        if source != -1:  # tell the others, except for the only robot that sent it
            untold[i] |= EVERYONE & ~(1 << i) & ~(1 << source if source >= 0 else 0)
    for j in range(robots):
        pending[j, chunk] |= untold[j]


@njit(cache=True, nogil=True)
def length_in_walls(occupied: Grid, x: float, y: float, to_x: float, to_y: float) -> float:
    """Return how much of the straight line between two points, which are on the grid, lies in occupied cells, pixels.

    The line is followed from cell to cell (Amanatides and Woo, 1987).
    """
    rows, cols = occupied.shape
    way = math.hypot(to_x - x, to_y - y)
    if way == 0.0:
        return 0.0
    right, down = (to_x - x) / way, (to_y - y) / way
    row, col = int(y), int(x)
    next_x = math.inf if right == 0.0 else ((col + 1 - x) if right > 0.0 else (col - x)) / right
    next_y = math.inf if down == 0.0 else ((row + 1 - y) if down > 0.0 else (row - y)) / down
    step_x = math.inf if right == 0.0 else abs(1.0 / right)
    step_y = math.inf if down == 0.0 else abs(1.0 / down)
    gone, found = 0.0, 0.0
    while gone < way and 0 <= row < rows and 0 <= col < cols:
        until = min(next_x, next_y, way)
        if occupied[row, col] != 0:
            found += until - gone
        gone = until
        if next_x <= next_y:
            col += 1 if right > 0.0 else -1
            next_x += step_x
        else:
            row += 1 if down > 0.0 else -1
            next_y += step_y
    return found
