"""The motions of numbered actions, for many robots at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from houseexpo.pseudoslam.kernels.types import Counts, Floats


@njit(cache=True, nogil=True)
def look_up(actions: Counts, table: Floats, motions: Floats, ahead: npt.NDArray[np.bool_]) -> int:
    """Write the motions (N, 2) of actions (N,), which are rows of a table, and which actions are the first one.

    Return the index of an action that is not in the table, -1 if all are.
    """
    for i in range(len(actions)):
        action = actions[i]
        if action < 0 or action >= len(table):
            return i
        motions[i, 0], motions[i, 1] = table[action, 0], table[action, 1]
        ahead[i] = action == 0
    return -1
