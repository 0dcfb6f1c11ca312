"""The adapter for other people's graphs: its explorer goes from node to node and gives up what it cannot see."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from research.graph_environments import Graph, GraphExplorer

EVERY = 10
"""Cells between two nodes."""


class Hall:
    """A hall of 24 x 24 m in which a robot sees 6.4 m far, with nodes each 4 m, and a spot that nobody sees."""

    cell_m = 0.4

    def __init__(self) -> None:
        self.truth = np.full((62, 62), 255)
        self.truth[[0, -1]] = self.truth[:, [0, -1]] = 1
        self.belief = np.full(self.truth.shape, 127)
        self.metres, self.cell = 0.0, np.array([10.0, 10.0])
        self._scan()

    def _scan(self) -> None:
        rows, cols = np.ogrid[:62, :62]
        seen = np.hypot(cols - self.cell[0], rows - self.cell[1]) <= 16
        seen[35:37, 35:37] = False
        self.belief[seen] = self.truth[seen]
        self._places = np.array([[x, y] for x in range(10, 60, EVERY) for y in range(10, 60, EVERY)], float)
        self._places = self._places[[self.belief[int(y), int(x)] == 255 for x, y in self._places]]
        self.utility = np.array([np.count_nonzero(self._round(place) == 127) for place in self._places])

    def _round(self, place: np.ndarray) -> np.ndarray:
        col, row = place.astype(int)
        return self.belief[max(row - 9, 0) : row + 10, max(col - 9, 0) : col + 10]

    @property
    def done(self) -> bool:
        return np.count_nonzero(self.belief == 127) == 4

    def graph(self) -> Graph:
        off = np.linalg.norm(self._places[:, None] - self._places[None], axis=2)
        return Graph(self._places, np.where(off <= 1.5 * EVERY, off * self.cell_m, 0.0), self.utility)

    def move(self, node: int) -> None:
        self.metres += float(np.linalg.norm(self._places[node] - self.cell)) * self.cell_m
        self.cell = self._places[node]
        self._scan()


@pytest.mark.parametrize("name", ["frontier", "information", "chooser"])
def test_an_explorer_sees_a_hall_from_the_nodes_of_a_graph(name: str) -> None:
    hall, explorer = Hall(), GraphExplorer(name, Hall.cell_m)
    before = [hall.cell]
    for _ in range(40):
        if hall.done:
            break
        hall.move(explorer.next(hall, hall.graph()))  # type: ignore[arg-type]  # what it uses of an environment
        before.append(hall.cell)
    assert hall.done  # although the spot stays unknown
    assert hall.metres < 150
    assert all(not np.array_equal(one, other) for one, other in pairwise(before))


def test_a_policy_that_chooses_no_frontiers_is_refused() -> None:
    with pytest.raises(ConfigError, match="policies that choose frontiers, found 'forward'"):
        GraphExplorer("forward", 0.4)
