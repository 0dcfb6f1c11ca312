"""Views that are the caller's own, whose memory is used again when he holds them no more.

They are drawn there at once: to copy them afterwards takes a tenth of a step. Fresh memory would cost as much again:
the system hands it out page by page, zeroed.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.step_pool import ARRAYS

Array = npt.NDArray[Any]


class _Memory(np.ndarray):
    """Owns memory: a view of a view holds the first view where the owner is of another kind, as here, or the owner."""


class ViewBuffers:
    """Arrays for views, as many as the kernels take: one to write, and some that the caller may hold."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        memory = [_Memory(shape, np.uint8) for _ in range(ARRAYS)]
        self.written: tuple[Array, ...] = tuple(owner.view(np.ndarray) for owner in memory)
        """What the kernels write, which hold it while they run."""
        self.lent: tuple[Array, ...] = tuple(owner.view(np.ndarray) for owner in memory)
        """The same memory for the caller: whoever holds a view of one holds it itself, and only the caller does."""

    def free(self, besides: int = -1) -> int:
        """Return which array the caller does not hold, ``besides`` one that he is to get; -1 where there is none."""
        holders = _holders(self.lent)
        if besides >= 0:
            holders[besides] = 0
        return holders.index(_NOBODY) if _NOBODY in holders else -1


def _holders(arrays: tuple[Array, ...]) -> list[int]:
    """Return how many references there are to each array."""
    return [sys.getrefcount(array) for array in arrays]


_NOBODY = _holders((np.empty(0),))[0]
"""What is counted where only a tuple holds an array; how many of our own count with it is the interpreter's affair."""
