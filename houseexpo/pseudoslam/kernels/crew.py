"""How threads share a step's environments without the interpreter, its lock, or a call of the system.

All is said in one array of whole numbers, ``crew``. The leader posts a step: environments that nobody has taken. It
takes them one by one from the first on, the others from the last on, so that each has mostly those that it had before,
still in its cache. When none is left, the leader waits for those that the others are at; the others wait a while for
the next step, for to be woken would cost them as much as the step does.

Arrays may be replaced between two steps. Then the leader raises the epoch, and who came for an older one leaves.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.atomic import add, get, pause, put, swap
from houseexpo.pseudoslam.kernels.types import Counts

OPEN, DONE, EPOCH, FAILED, NUMBER, VIEWS, INSIDE = 0, 8, 16, 17, 18, 19, 24
"""What ``crew`` holds: the step and what is taken of it; environments done; the epoch; whether somebody failed; how
many environments there are; which array takes the views, -1 for the pool's own; and, from there on, whether a thread
looks out or works. Words that many write lie apart.
"""
MOST = (1 << 20) - 1
"""Environments that can be shared: bits of ``OPEN`` for those taken from either end; the rest count the steps."""
_BITS = 20
_PATIENCE = 1 << 14  # looks for a next step, of some 30 ns each


def new_crew(number: int, threads: int) -> Counts:
    """Return what threads share of a batch of so many environments; no step is open."""
    crew = np.zeros(INSIDE + threads, np.int64)
    crew[OPEN] = crew[NUMBER] = number
    crew[VIEWS] = -1
    return crew


@njit(inline="always")
def enter(crew: Counts, thread: int) -> None:
    """Begin: the leader, ``thread`` 0, with a new step."""
    if thread == 0:
        put(crew, DONE, 0)
        put(crew, OPEN, ((get(crew, OPEN) >> 2 * _BITS) + 1) << 2 * _BITS)
    else:
        put(crew, INSIDE + thread, 1)


@njit(inline="always")
def take(crew: Counts, epoch: int, thread: int) -> int:
    """Return an environment that nobody has taken; -1 where there is none, or none comes for a while."""
    looks = 0
    while True:
        now = get(crew, OPEN)
        if get(crew, EPOCH) != epoch or get(crew, FAILED) != 0:  # asked after ``now``: a later step is not taken then
            return -1
        first, last = now & MOST, crew[NUMBER] - 1 - (now >> _BITS & MOST)
        if first <= last:
            if swap(crew, OPEN, now, now + 1 if thread == 0 else now + (1 << _BITS)):
                found: int = first if thread == 0 else last
                return found
        elif thread == 0 or looks == _PATIENCE:
            return -1
        else:
            looks += 1
            pause()


@njit(inline="always")
def leave(crew: Counts, thread: int) -> None:
    """End: the leader when all is done."""
    if thread > 0:
        put(crew, INSIDE + thread, 0)
        return
    while get(crew, DONE) < crew[NUMBER] and get(crew, FAILED) == 0:
        pause()


@njit(inline="always")
def done(crew: Counts) -> None:
    """Say that an environment is done."""
    add(crew, DONE, 1)
