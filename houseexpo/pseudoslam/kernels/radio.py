"""Find which robots of a team hear each other, and let them copy each other's maps, for many teams at once.

An exchange is the one of ``teams.Team.exchange`` with known relative poses, for many teams:

R1  All robots send what they knew before the exchange.
R2  A robot copies known cells into its unknown ones, from the robots that it hears in the order of their numbers.
R3  It copies at most ``most`` cells from each, row by row; the rest comes in later exchanges.

Only chunks are examined in which a robot may know cells that the other robot has not received (``pending``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import CHUNK, CHUNK_BITS, FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.team_step import EVERYONE, TeamKnowledge, TeamObstacles, copy_known_cells
from houseexpo.pseudoslam.kernels.types import Bits, Counts, Floats, Grid, Rows
from houseexpo.pseudoslam.kernels.walls import length_in_walls

NONE, ALWAYS, RANGE, SIGHT, SIGNAL = range(5)
"""Values of ``RadioParams.model``, in the order of the names of ``teams.radio.Model``."""


class RadioParams(NamedTuple):
    """The parameters of a radio, which ``teams.radio.Radio`` describes."""

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
    most: int
    """The largest number of cells that a robot receives from another in a step."""


@njit(cache=True, nogil=True)
def received_dbm(link: RadioParams, air_m: float, wall_m: float, air_fading_db: float, wall_fading_db: float) -> float:
    """Return the received power after lengths in air and in walls, and fading in both."""
    loss = link.loss_db
    if wall_m > 0.0:
        loss += 10.0 * link.wall_exponent * math.log10(max(wall_m / link.wall_unit_m, 1.0)) + wall_fading_db
    if air_m >= link.reference_m:
        loss += 10.0 * link.air_exponent * math.log10(air_m / link.reference_m) + air_fading_db
    return link.power_dbm - loss


@njit(cache=True, nogil=True)
def find_heard(link: RadioParams, walls: Grid, places: Floats, fading_db: Floats, heard: Grid) -> bool:
    """Write who hears whom (R, R), symmetric, 0 on the diagonal; return whether each robot reaches every other one.

    Parameters
    ----------
    walls
        (rows, cols), not 0 for static obstacles.
    places
        (R, 2), pixels.
    fading_db
        (2,), additional losses in air and in walls.
    """
    robots = len(places)
    for i in range(robots):
        heard[i, i] = 0
        for j in range(i):
            heard[i, j] = heard[j, i] = _hears(link, walls, places[i], places[j], fading_db)
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
def _hears(link: RadioParams, walls: Grid, one: Floats, other: Floats, fading_db: Floats) -> bool:
    if link.model <= ALWAYS:
        return link.model == ALWAYS
    way_m = math.hypot(other[0] - one[0], other[1] - one[1]) * link.cell_m
    if link.model == SIGNAL:
        wall_m = length_in_walls(walls, one[0], one[1], other[0], other[1]) * link.cell_m
        return received_dbm(link, way_m - wall_m, wall_m, fading_db[0], fading_db[1]) > link.threshold_dbm
    if way_m > link.range_m:
        return False
    return link.model == RANGE or length_in_walls(walls, one[0], one[1], other[0], other[1]) == 0.0


@njit(cache=True, nogil=True)
def exchange_maps(
    known: Grid, observable: Grid, counts: Rows, sizes: Counts, others: TeamObstacles, shared: TeamKnowledge,
    link: RadioParams, fading_db: Floats, heard: Grid, joined: Grid, wanted: Grid, first: int, end: int,
) -> None:  # fmt: skip
    """Let the robots of the ``wanted`` teams exchange their maps, and count what is new to them.

    Parameters
    ----------
    known, observable, counts, sizes
        Arrays of the pool of all robots (N * R, ...).
    fading_db, heard, joined, wanted
        ``fading_db`` is (N, 2). ``heard`` (N, R, R), who hears whom, and ``joined`` (N,), whether each robot reaches
        every other one, are written. ``wanted`` (N,) is not 0 for teams that exchange.
    """
    robots = others.places.shape[1]
    for i in range(first, end):
        if wanted[i] == 0:
            continue
        row = i * robots
        rows, cols = sizes[row, 0], sizes[row, 1]
        walls = others.walls[i, : rows * cols].reshape((rows, cols))
        joined[i] = find_heard(link, walls, others.places[row], fading_db[i], heard[i])
        if shared.pending.shape[2] > 0:
            maps, seen = known[row : row + robots], observable[row]
            own_counts, cells = counts[row : row + robots], rows * cols
            _exchange(maps, seen, own_counts, cells, heard[i], shared.pending[i], shared.waiting[i], link.most)


@njit(cache=True, nogil=True)
def _exchange(
    maps: Grid, observable: Grid, counts: Rows, cells: int, heard: Grid, pending: Bits, waiting: Bits, most: int
) -> None:
    """Exchange the maps of one team's robots (R, cells), by R1 to R3."""
    robots, chunks = len(maps), (cells + CHUNK - 1) >> CHUNK_BITS
    listeners = np.zeros(robots, np.int64)
    for j in range(robots):
        for i in range(robots):
            listeners[j] |= np.int64(heard[i, j] != 0) << i
    before, taken = np.empty((robots, CHUNK), np.uint8), np.zeros((robots, robots), np.int64)
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
                _exchange_chunk(maps, observable, counts, cells, chunk, pending, listeners, before, taken, most)
        for j in range(robots):
            left = np.uint16(0)
            for chunk in range(start, stop):
                left = np.uint16(left | pending[j, np.uint64(chunk)])
            waiting[j, group] = left


@njit(cache=True, nogil=True)
def _exchange_chunk(
    maps: Grid, observable: Grid, counts: Rows, cells: int, chunk: int, pending: Bits, listeners: Counts, before: Grid,
    taken: Counts, most: int,
) -> None:  # fmt: skip
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
            left = most - taken[i, j]
            new, covered = _copy_at_most(maps[i], before[j], observable, low, size, left)
            if new > left:  # R3
                new = left
                untold[j] |= 1 << i
            count.known += new
            count.covered += covered
            taken[i, j] += new
            if new > 0:
                source = j if source == -1 else -2
        if source != -1:  # tell the others, except for the only robot that sent it
            untold[i] |= EVERYONE & ~(1 << i) & ~(1 << source if source >= 0 else 0)
    for j in range(robots):
        pending[j, chunk] |= untold[j]


@njit(inline="always")
def _copy_at_most(own: Grid, other: Grid, observable: Grid, low: int, size: int, most: int) -> tuple[int, int]:
    """Copy known cells of a chunk into the unknown ones of a map from ``low`` on, at most ``most`` of them.

    Return how many, or a larger number than ``most`` if there are more, and how many of those copied are observable.
    """
    part = own[low : low + size]
    if most >= size:
        return copy_known_cells(part, other, observable[low : low + size], 0, size)
    new, covered = 0, 0
    for t in range(size):
        if part[t] == UNKNOWN and other[t] != UNKNOWN:
            if new == most:
                return most + 1, covered
            part[t] = other[t]
            new += 1
            covered += int(observable[low + t])
    return new, covered


@njit(cache=True, nogil=True)
def copy_known_box(known: Grid, observable: Grid, other: Grid, box: Counts, most: int) -> tuple[int, int]:
    """Copy known cells of another map into the unknown cells of a map, row by row, at most ``most`` of them.

    Return the number of cells copied, and how many of them are observable.

    Parameters
    ----------
    known, observable, other
        (rows, cols), the map, which is changed; the cells that coverage counts; and the other map.
    box
        (4,), the first row and the end, the first column and the end, of the cells to look at.
    """
    new, covered = 0, 0
    for row in range(box[0], box[1]):
        own, others = known[row, box[2] : box[3]], other[row, box[2] : box[3]]
        missing = np.uint8(0)
        for k in range(len(own)):  # without a branch: most rows have nothing new
            missing = np.uint8(missing | (others[k] & ~own[k] & FREE))  # known cells have all bits of FREE
        if missing:
            for col in range(box[2], box[3]):
                if known[row, col] == UNKNOWN and other[row, col] != UNKNOWN:
                    if new == most:
                        return new, covered
                    known[row, col] = other[row, col]
                    new += 1
                    covered += int(observable[row, col])
    return new, covered
