"""Distance utility (Kulich, Faigl and Preucil, 2011): go to the first frontier of a short tour of all of them.

Going to a near frontier may leave others behind and cost the way back, which nearest-frontier exploration ignores.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.agents.exploring import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.kernels.planning.known_ways import find_ways
from houseexpo.pseudoslam.kernels.planning.tour import short_tour
from houseexpo.pseudoslam.kernels.types import NO_WAY, KnownWays, Rows, known_ways_of

_TOURED: Final = 12
"""The number of frontiers in the tour: those that ``find_frontiers`` ranks first."""


class Tour(Explorer):
    """An explorer that goes to the first frontier of a tour: nearest neighbours, then 2-opt, by paths on its map."""

    def __init__(self, robot: Robot, seed: int) -> None:
        super().__init__(robot, seed)
        self._ways: KnownWays | None = None

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:  # noqa: ARG002  # others use it
        """Return the first frontier of the tour from the robot."""
        if self._ways is None or len(self._ways.ways) < known.size:
            self._ways = known_ways_of(known.size)
        first = frontiers[:_TOURED]
        lengths = np.zeros((len(first) + 1, len(first) + 1))
        lengths[0, 1:] = lengths[1:, 0] = first["way"]
        goals = first["goal"].tolist()
        for i, goal in enumerate(goals[:-1], start=1):
            row, col = divmod(goal, known.shape[1])
            find_ways(known, col + 0.5, row + 0.5, self.radius_px, -1, self._ways)
            lengths[i, i + 1 :] = lengths[i + 1 :, i] = reached(self._ways, goals[i:])
        return int(short_tour(lengths)[1]) - 1


def reached(ways: KnownWays, cells: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the distances to cells (flat indices), very large ones for those that cannot be reached."""
    found: npt.NDArray[np.float64] = ways.ways[np.asarray(cells)].astype(np.float64)
    found[found < 0] = NO_WAY
    return found
