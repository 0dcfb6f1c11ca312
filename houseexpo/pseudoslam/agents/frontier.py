"""Nearest frontier (Yamauchi, 1997): go to the nearest place from which the robot can see beyond its map's edge."""

from __future__ import annotations

from collections.abc import Iterator

from houseexpo.pseudoslam.agents.exploring import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot, knowledge_of
from houseexpo.pseudoslam.kernels.types import Rows
from houseexpo.pseudoslam.simulator import ACTIONS, Action, Simulator
from houseexpo.pseudoslam.state import State


class NearestFrontier(Explorer):
    """An explorer that goes to the nearest long frontier, and to the small ones at the end."""

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the first frontier, since they are in this order."""
        del known, frontiers, info
        return 0


def frontier_walk(simulator: Simulator, state: State) -> Iterator[Action]:
    """Yield the actions of an explorer for the current map; take each action before requesting the next one.

    They end when there is nothing left to see.
    """
    explorer = NearestFrontier(Robot(simulator.config), 0)
    while (action := explorer(None, knowledge_of(simulator, state))) is not None:
        yield ACTIONS[action]
