"""How threads share a step's environments without the interpreter, its lock, or a call of the system.

All is said in one array of whole numbers, ``sync``. The leader posts a step: environments that nobody has taken. It
takes them one by one from the first on, the others from the last on, so that each has mostly those that it had before,
still in its cache. When none is left, the leader waits for those that the others are at; the others wait a while for
the next step, for to be woken would cost them as much as the step does.

The leader has work of its own, in Python. So it may post a step and rejoin it later, and the last views of a step may
be put off: it goes on without them, and comes back to finish what the others have not drawn meanwhile.

Arrays may be replaced between two steps. Then the leader raises the epoch, and who came for an older one leaves.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.runtime.atomic import add, get, pause, put, swap
from houseexpo.pseudoslam.kernels.types import Counts

OPEN, DONE, EPOCH, FAILED, NUMBER, VIEWS, LAG, SLOTS, PUT_OFF, TAKEN_UP, CAUGHT_UP, INSIDE = (
    0, 8, 16, 17, 18, 19, 20, 21, 24, 32, 40, 48,
)  # fmt: skip
"""What ``sync`` holds: the step and what is taken of it; environments done; the epoch; whether somebody failed; how
many environments there are; which array takes the views, -1 for the pool's own; how many views may be put off, and
where the list of them begins, a ring with room for all; how many were ever put off, taken up again and drawn; and, from
there on, whether a thread looks out or works. Words that many write lie apart.
"""
LEADER, REJOINING, FINISHING = 0, -1, -2
"""The thread that posts a step and takes part in it; the same one where it has posted it before, or wants its views."""
MAX_ENVS = (1 << 20) - 1
"""Environments that can be shared: bits of ``OPEN`` for those taken from either end; the rest count the steps."""
ONLY_VIEW = MAX_ENVS + 1
"""What is added to an environment of which nothing but the view is to be drawn."""
_BITS = 20
_SPIN_LIMIT = 1 << 14  # looks for a next step, of some 30 ns each
_NOTHING = -1  # in the list


def new_sync(number: int, threads: int, lag: int = 0) -> Counts:
    """Return what threads share of a batch of so many environments; no step is open.

    ``lag`` is how many views of a step may be put off.
    """
    sync = np.zeros(INSIDE + threads + number, np.int64)
    sync[OPEN] = sync[DONE] = sync[NUMBER] = number
    sync[VIEWS], sync[LAG], sync[SLOTS] = -1, lag, INSIDE + threads
    sync[INSIDE + threads :] = _NOTHING
    return sync


@njit(cache=True, nogil=True)
def post(sync: Counts) -> None:
    """Open a step to whoever looks out for one; the one before is done."""
    put(sync, DONE, 0)
    put(sync, OPEN, ((get(sync, OPEN) >> 2 * _BITS) + 1) << 2 * _BITS)


@njit(cache=True, nogil=True)
def untaken(sync: Counts) -> int:
    """Return how many environments of the step nobody has taken yet."""
    now = get(sync, OPEN)
    return int(sync[NUMBER]) - (now & MAX_ENVS) - (now >> _BITS & MAX_ENVS)


@njit(cache=True, nogil=True)
def outstanding(sync: Counts) -> int:
    """Return what the leader is to come back for: ``REJOINING`` or ``FINISHING``; 0 where the last step is done."""
    if get(sync, DONE) < sync[NUMBER]:
        return REJOINING
    return FINISHING if get(sync, CAUGHT_UP) < get(sync, PUT_OFF) else 0


@njit(inline="always")
def enter(sync: Counts, thread: int) -> None:
    """Begin: the leader with a new step, unless it comes back to one."""
    if thread == LEADER:
        post(sync)
    elif thread > LEADER:
        put(sync, INSIDE + thread, 1)


@njit(inline="always")
def take(sync: Counts, epoch: int, thread: int) -> int:
    """Return an environment that nobody has taken, with ``ONLY_VIEW`` where the rest is done.

    -1 where there is none, or none comes for a while.
    """
    looks = 0
    while True:
        now, view = get(sync, OPEN), get(sync, TAKEN_UP)
        is_view = view < get(sync, PUT_OFF)
        if get(sync, EPOCH) != epoch or get(sync, FAILED) != 0:  # asked after those: a later step is not taken then
            return -1
        first, last = now & MAX_ENVS, sync[NUMBER] - 1 - (now >> _BITS & MAX_ENVS)
        if first <= last:
            if swap(sync, OPEN, now, now + 1 if thread <= LEADER else now + (1 << _BITS)):
                found: int = first if thread <= LEADER else last
                return found
        elif is_view and (thread > LEADER or thread == FINISHING):
            if swap(sync, TAKEN_UP, view, view + 1):
                return _from_list(sync, view) + ONLY_VIEW
        elif thread <= LEADER or looks == _SPIN_LIMIT:
            return -1
        else:
            looks += 1
            pause()


@njit(inline="always")
def puts_off(sync: Counts, i: int) -> bool:
    """Put the view of an environment off, if it is one of the last; return whether."""
    if untaken(sync) >= sync[LAG]:
        return False
    put(sync, sync[SLOTS] + add(sync, PUT_OFF, 1) % sync[NUMBER], i)
    return True


@njit(inline="always")
def _from_list(sync: Counts, view: int) -> int:
    """Return the environment whose view was put off as the ``view``-th: it is written just after it is counted."""
    slot = sync[SLOTS] + view % sync[NUMBER]
    while get(sync, slot) == _NOTHING:
        pause()
    found: int = get(sync, slot)
    put(sync, slot, _NOTHING)
    return found


@njit(inline="always")
def leave(sync: Counts, thread: int) -> None:
    """End: the leader when all have stepped, or when all views are drawn if it has come back for them."""
    if thread > LEADER:
        put(sync, INSIDE + thread, 0)
    elif thread == FINISHING:
        while get(sync, CAUGHT_UP) < get(sync, PUT_OFF) and get(sync, FAILED) == 0:
            pause()
    else:
        while get(sync, DONE) < sync[NUMBER] and get(sync, FAILED) == 0:
            pause()


@njit(inline="always")
def done(sync: Counts, taken: int) -> None:
    """Say that what was taken is done."""
    add(sync, CAUGHT_UP if taken > MAX_ENVS else DONE, 1)
