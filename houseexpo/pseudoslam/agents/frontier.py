"""Nearest frontier (Yamauchi, 1997): to the nearest place from which it can see beyond the edge of its map."""

from __future__ import annotations

from collections.abc import Iterator

from houseexpo.pseudoslam.agents.exploring import Explorer, Grid
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot, knowledge_of
from houseexpo.pseudoslam.kernels.types import Rows
from houseexpo.pseudoslam.simulator import ACTIONS, Action, Simulator
from houseexpo.pseudoslam.state import State


class NearestFrontier(Explorer):
    """Goes to the nearest long frontier, and to the specks in the end."""

    def choose(self, known: Grid, frontiers: Rows, info: Knowledge) -> int:
        """Return the first: they are ordered so."""
        del known, frontiers, info
        return 0


def frontier_walk(simulator: Simulator, state: State) -> Iterator[Action]:
    """Yield an explorer's actions by what the map shows at the time; take each before asking for the next.

    They end when nothing is left that it could see.
    """
    explorer = NearestFrontier(Robot(simulator.config), 0)
    while (action := explorer(None, knowledge_of(simulator, state))) is not None:
        yield ACTIONS[action]
