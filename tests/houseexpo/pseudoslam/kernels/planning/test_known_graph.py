"""The graph of places on a robot's map, against slow twins."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.pseudoslam.kernels.planning.graph import build_graph, record_visit
from houseexpo.pseudoslam.kernels.planning.paths import find_distances
from houseexpo.pseudoslam.kernels.planning.planner_types import VISITED, Graph, GraphRules, new_graph
from houseexpo.pseudoslam.kernels.types import NO_WAY, new_path_scratch
from tests.builders.robot_maps import FREE, random_map, random_place, slow_clear, slow_clusters
from tests.builders.tries import tries

SIDE, RANGE, RADIUS = 4, 9.0, 1.2
RULES = GraphRules(SIDE, RANGE, RADIUS)
NOTHING = np.zeros(0, np.int32)
SEEDS = st.integers(0, 10**6)


def drawn_graph(known: np.ndarray, x: float, y: float, graph: Graph) -> np.ndarray:
    """Draw it; return the ways, infinite where there is none."""
    memory = new_path_scratch(known.size)
    find_distances(known, x, y, RADIUS, -1, memory)
    build_graph(known, graph, RULES, NOTHING, memory)
    ways = memory.ways[: known.size].reshape(known.shape).astype(float)
    return np.where((ways < 0) | (ways == NO_WAY), np.inf, ways)


def slow_nodes(ways: np.ndarray) -> list[tuple[int, int]]:
    """Of each block the cell nearest to its middle that has a way; by the ways, then by blocks."""
    rows, cols = ways.shape
    found = []
    for top in range(0, rows, SIDE):
        for left in range(0, cols, SIDE):
            cells = [
                (top + i, left + j) for i in range(SIDE) for j in range(SIDE) if top + i < rows and left + j < cols
            ]
            cells = [cell for cell in cells if np.isfinite(ways[cell])]
            if cells:
                middle = top + (SIDE - 1) / 2, left + (SIDE - 1) / 2
                best = min(cells, key=lambda cell: (math.dist(cell, middle) ** 2, cell))
                found.append((ways[best], (top, left), best))
    return [cell for _, _, cell in sorted(found)]


def slow_stands(ways: np.ndarray, standing: np.ndarray, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether a line between middles lies in standing cells, looked at twice a cell, but for where it begins."""
    length = math.dist(one, other)
    n = math.ceil(2 * length)
    for k in range(n + 1):
        if k / n * length > 1.5:
            row, col = (a + 0.5 + k / n * (b - a) for a, b in zip(one, other, strict=True))
            if not standing[math.floor(row), math.floor(col)]:
                return False
    return True


@tries(40)
@given(SEEDS)
def test_it_is_what_its_twins_say(seed: int) -> None:
    known = random_map(seed)
    x, y = random_place(known, seed)
    graph = new_graph(50, 6)
    ways = drawn_graph(known, x, y, graph)
    cols = known.shape[1]
    expected = slow_nodes(ways)[:50]
    n = len(expected)
    assert graph.state["nodes"][0] == n
    assert [divmod(int(node.cell), cols) for node in graph.nodes[:n]] == expected
    assert (graph.nodes["cell"][n:] == -1).all()
    assert graph.nodes["way"][:n].tolist() == [ways[cell] for cell in expected]
    memory = new_path_scratch(known.size)
    find_distances(known, x, y, RADIUS, -1, memory)
    standing = memory.ways.reshape(known.shape) >= 0
    edges = [cell for cluster in slow_clusters(known) for cell in cluster]
    for i, one in enumerate(expected):
        near = []
        for j, other in enumerate(expected):
            off = max(abs(other[0] // SIDE - one[0] // SIDE), abs(other[1] // SIDE - one[1] // SIDE))
            if i != j and off <= 2 and slow_stands(ways, standing, one, other):
                near.append((math.dist(one, other) ** 2, j))
        neighbours = [j for _, j in sorted((round(off), j) for off, j in near)][:6]
        assert graph.edges[i].tolist() == neighbours + [-1] * (6 - len(neighbours))
        stride = max(-(-len(edges) // 48), 1)
        seen = [
            cell for cell in sorted(edges)[::stride] if math.dist(cell, one) <= RANGE and slow_clear(known, one, cell)
        ]
        assert graph.nodes["utility"][i] == stride * len(seen)


def test_of_many_frontiers_some_stand_for_the_others() -> None:
    """A room of 90 x 90 cells in the unknown: 360 cells of frontiers, of which every eighth is looked at."""
    known = np.zeros((110, 110), np.uint8)
    known[10:100, 10:100] = FREE
    graph = new_graph(600, 4)
    memory = new_path_scratch(known.size)
    find_distances(known, 55.0, 55.0, RADIUS, -1, memory)
    build_graph(known, graph, GraphRules(SIDE, 1000.0, RADIUS), NOTHING, memory)
    seen = graph.nodes["utility"][: graph.state["nodes"][0]]
    assert (seen % 8 == 0).all()
    assert seen.max() == 360


def test_there_is_room_for_the_nearest_nodes_only() -> None:
    known = np.full((30, 60), FREE, np.uint8)
    every, few = new_graph(300, 4), new_graph(7, 4)
    for graph in (every, few):
        drawn_graph(known, 12.3, 8.7, graph)
    assert every.state["nodes"][0] > 7
    assert few.state["nodes"][0] == 7
    assert few.nodes["cell"].tolist() == every.nodes["cell"][:7].tolist()
    assert few.edges.max() == 6


def test_where_the_robot_has_been_is_remembered() -> None:
    known = np.full((30, 60), FREE, np.uint8)
    graph = new_graph(300, 4)
    for x, y in ((12.3, 8.7), (13.0, 9.0), (40.1, 20.2)):
        record_visit(graph, x, y, 60, RULES)
    assert graph.state["visits"][0] == 2, "two places are in one block"
    drawn_graph(known, 40.1, 20.2, graph)
    been = graph.nodes["cell"][graph.nodes["visited"] == 1].tolist()
    assert sorted((cell // 60 // SIDE, cell % 60 // SIDE) for cell in been) == [(2, 3), (5, 10)]
    assert graph.nodes["visited"][0] == 1


def test_the_places_that_are_remembered_are_the_last() -> None:
    graph = new_graph(10, 4)
    for k in range(VISITED + 3):
        record_visit(graph, SIDE * (k % 50) + 0.5, SIDE * (k // 50) + 0.5, SIDE * 50, RULES)
    assert graph.state["visits"][0] == VISITED + 3
    assert sorted(graph.visited.tolist()) == list(range(3, VISITED + 3))


def test_on_a_map_without_a_place_to_stand_there_is_no_node() -> None:
    graph = new_graph(10, 4)
    drawn_graph(np.full((12, 12), 255, np.uint8), 500.0, 5.0, graph)
    assert graph.state["nodes"][0] == 0
    assert (graph.edges == -1).all()
