"""Find which robots of a team hear each other, and let them copy each other's maps, for many teams at once.

An exchange is that of ``teams.Team.exchange`` with relative poses that are known, for many teams:

R1  All robots send what they knew before the exchange.
R2  A robot copies known cells into its unknown ones, from the robots that it hears in the order of their numbers.
R3  It copies at most ``most`` cells from each, row by row; the rest comes in later exchanges.

Only chunks of cells are looked at in which a robot may know something that the other has not been told (``pending``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import CHUNK, CHUNK_BITS, FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.team_step import TeamKnowledge, TeamObstacles
from houseexpo.pseudoslam.kernels.types import Counts, Floats, Grid, Rows
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
    """Write who hears whom (R, R), symmetric, 0 on the diagonal; return whether each robot reaches each other one.

    Parameters
    ----------
    walls
        (rows, cols), not 0 for what does not move.
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
        (N, 2); (N, R, R), who hears whom, which is written, as is (N,), whether each robot reaches each other one; and
        (N,), not 0 for teams that exchange.
    """
    robots = others.places.shape[1]
    for i in range(first, end):
        if wanted[i] == 0:
            continue
        row = i * robots
        rows, cols = sizes[row, 0], sizes[row, 1]
        walls = others.walls[i, : rows * cols].reshape((rows, cols))
        joined[i] = find_heard(link, walls, others.places[row], fading_db[i], heard[i])
        if shared.pending.shape[3] > 0 and _any_of(heard[i]):
            maps, seen = known[row : row + robots], observable[row]
            _exchange(maps, seen, counts[row : row + robots], rows * cols, heard[i], shared.pending[i], link.most)


@njit(cache=True, nogil=True)
def _any_of(heard: Grid) -> bool:
    for i in range(len(heard)):
        for j in range(i):
            if heard[i, j] != 0:
                return True
    return False


@njit(cache=True, nogil=True)
def _exchange(maps: Grid, observable: Grid, counts: Rows, cells: int, heard: Grid, pending: Grid, most: int) -> None:
    """Exchange the maps of one team's robots (R, cells), by R1 to R3."""
    robots, chunks = len(maps), (cells + CHUNK - 1) >> CHUNK_BITS
    before, taken = np.empty((robots, CHUNK), np.uint8), np.zeros((robots, robots), np.int64)
    some, source = np.empty(CHUNK, np.uint8), np.empty(robots, np.int64)
    for start in range(0, chunks, CHUNK):
        wide = min(CHUNK, chunks - start)
        if not _waits(heard, pending, start, wide, some):
            continue
        for k in range(wide):
            if some[k] == 0:
                continue
            chunk = start + k
            low = chunk << CHUNK_BITS
            size = min(CHUNK, cells - low)
            for i in range(robots):
                source[i] = -1
                for t in range(size):
                    before[i, np.uint64(t)] = maps[i, np.uint64(low + t)]
            for i in range(robots):
                own, count = maps[i], counts[i, 0]
                for j in range(robots):
                    if heard[i, j] == 0 or pending[i, j, chunk] == 0:
                        continue
                    pending[i, j, chunk] = 0
                    new = _copy(own, before[j], observable, count, low, size, most - taken[i, j])
                    if new < 0:  # R3
                        new = most - taken[i, j]
                        pending[i, j, chunk] = 1
                    taken[i, j] += new
                    if new > 0:
                        source[i] = j if source[i] == -1 else -2
            for i in range(robots):
                if source[i] != -1:  # others have not been told, but for the only one who told it
                    for j in range(robots):
                        if j != i and j != source[i]:  # numba has no sets of numbers
                            pending[j, i, chunk] = 1


@njit(cache=True, nogil=True)
def _waits(heard: Grid, pending: Grid, start: int, wide: int, some: Grid) -> bool:
    """Write which of the chunks from ``start`` on wait for a pair of robots that hear each other; return if some do."""
    some[:] = 0
    for i in range(len(heard)):
        for j in range(len(heard)):
            if heard[i, j] != 0:
                for k in range(wide):
                    some[np.uint64(k)] |= pending[i, j, np.uint64(start + k)]
    found = np.uint8(0)
    for k in range(wide):
        found |= some[np.uint64(k)]
    return bool(found != 0)


@njit(inline="always")
def _copy(own: Grid, other: Grid, observable: Grid, count: Rows, low: int, size: int, most: int) -> int:
    """Copy known cells of a chunk into the unknown ones of a map; return how many, -1 for more than ``most``."""
    missing = np.uint8(0)
    for t in range(size):  # known cells have all bits of FREE
        missing = np.uint8(missing | (other[np.uint64(t)] & ~own[np.uint64(low + t)] & FREE))
    new = 0
    if missing:
        for t in range(size):
            cell = np.uint64(low + t)
            if own[cell] == UNKNOWN and other[np.uint64(t)] != UNKNOWN:
                if new == most:
                    return -1
                own[cell] = other[np.uint64(t)]
                new += 1
                count.known += 1
                count.covered += int(observable[cell])
    return new


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
