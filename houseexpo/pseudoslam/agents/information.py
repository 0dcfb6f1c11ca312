"""Information gain (Gonzalez-Banos and Latombe, 2002): go where much is unknown and the path is short."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from houseexpo.pseudoslam.agents.exploring import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.kernels.planning.gain import unknown_in_sight
from houseexpo.pseudoslam.kernels.planning.plan import STRAIGHT
from houseexpo.pseudoslam.kernels.types import Rows

_PER_M: Final = 0.2
"""The factor exp(-0.2) of the gain for each metre of the path, as in the paper."""
_BEAMS: Final = 90
_LOOKED_AT: Final = 16
"""The number of frontiers whose gain is computed: those that ``find_frontiers`` ranks first."""


class InformationGain(Explorer):
    """An explorer that maximises A exp(-0.2 L) with A the unknown area visible from the goal, L the path's length."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        angles = np.arange(_BEAMS) * (2 * math.pi / _BEAMS)
        self._cos, self._sin = np.cos(angles), np.sin(angles)

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:  # noqa: ARG002  # others use it
        """Return the frontier with the greatest value, the first of equal ones."""
        first = frontiers[:_LOOKED_AT]
        worth = [
            unknown_in_sight(known, x + 0.5, y + 0.5, self.range_px, self._cos, self._sin)
            for y, x in zip(*np.divmod(first["goal"], known.shape[1]), strict=True)
        ]
        ways_m = first["way"] / (STRAIGHT * self.metre)
        return int(np.argmax(np.array(worth) * np.exp(-_PER_M * ways_m)))
