"""Copies of big arrays whose memory is used again when nobody holds them any more.

Fresh memory for a batch of observations costs as much as making them: the system hands it out page by page, zeroed.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

_MOST = 8  # copies that are kept; a caller who holds more pays for fresh memory
_OURS = 3  # references to a copy that nobody holds: the list's, the loop's, and the call's that counts them


class Copies:
    """Copies of arrays of one shape and type."""

    def __init__(self) -> None:
        self._kept: list[npt.NDArray[Any]] = []

    def of(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a copy; it is the caller's, with all its views, for as long as one of them lives."""
        for kept in self._kept:
            if sys.getrefcount(kept) == _OURS:
                np.copyto(kept, array)
                return kept
        fresh = array.copy()
        if len(self._kept) < _MOST:
            self._kept.append(fresh)
        return fresh
