"""Copies of big arrays whose memory is used again when nobody holds them any more.

Fresh memory for a batch of observations costs as much as making them: the system hands it out page by page, zeroed.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

_MOST = 8  # copies that are kept; a caller who holds more pays for fresh memory


class Copies:
    """Copies of arrays of one shape and type."""

    def __init__(self) -> None:
        self._kept: list[npt.NDArray[Any]] = []

    def of(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a copy; it is the caller's, with all its views, for as long as one of them lives."""
        for k in range(len(self._kept)):
            if _holders(self._kept, k) == _NOBODY:
                np.copyto(self._kept[k], array)
                return self._kept[k]
        fresh = array.copy()
        if len(self._kept) < _MOST:
            self._kept.append(fresh)
        return fresh


def _holders(arrays: list[npt.NDArray[Any]], k: int) -> int:
    """Return how many references there are to an array."""
    return sys.getrefcount(arrays[k])


_NOBODY = _holders([np.empty(0)], 0)
"""What is counted where only the list holds an array; how many of our own count with it is the interpreter's affair."""
