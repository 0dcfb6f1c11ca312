"""The compiled A* against its slow twin: Dijkstra's algorithm of networkx on a graph of free cells."""

import os
import subprocess
import sys
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from pipeline.kernels.astar import octile, shortest_path

PICTURES = {
    "open": ["......", "......", "......"],
    "a wall with a door": ["...#...", "...#...", "...#...", ".......", "...#..."],
    "corners are not cut": [".#.", "...", ".#."],
    "a diagonal wall": ["..#...", ".#....", "#....."],
    "a maze": [".#...#.", ".#.#.#.", ".#.#.#.", "...#..."],
    "one cell": ["."],
}


def mask(rows: list[str]) -> np.ndarray:
    return np.array([[cell == "." for cell in row] for row in rows])


def grid_graph(free: np.ndarray) -> nx.Graph:
    """Free cells as nodes, steps as edges weighted by their length."""
    graph = nx.Graph()
    graph.add_nodes_from(map(tuple, np.argwhere(free).tolist()))
    for row, col in list(graph):
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            corners = {(row + down, col), (row, col + right), (row + down, col + right)}
            if corners <= set(graph):
                graph.add_edge((row, col), (row + down, col + right), weight=np.hypot(down, right))
    return graph


def check(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> None:
    graph = grid_graph(free)
    path = [tuple(cell) for cell in shortest_path(free, *start, *goal).tolist()]
    if not nx.has_path(graph, start, goal):
        assert path == []
        return
    assert (path[0], path[-1]) == (start, goal)
    assert nx.path_weight(graph, path, "weight") == pytest.approx(nx.dijkstra_path_length(graph, start, goal), abs=1e-9)


@pytest.mark.parametrize("name", PICTURES)
def test_every_pair_of_cells_of_a_small_grid(name: str) -> None:
    free = mask(PICTURES[name])
    cells = [tuple(cell) for cell in np.argwhere(free).tolist()]
    for start in cells[:: max(1, len(cells) // 6)]:
        for goal in cells:
            check(free, start, goal)


def test_random_grids() -> None:
    rng = np.random.default_rng(7)
    for _ in range(25):
        free = rng.random(rng.integers(3, 12, 2)) < 0.65
        cells = [tuple(cell) for cell in np.argwhere(free).tolist()]
        check(free, cells[0], cells[-1])


def test_walls_that_touch_by_a_corner_let_nobody_through() -> None:
    assert not len(shortest_path(mask([".#", "#."]), 0, 0, 1, 1))


def test_the_path_is_the_same_each_time_and_runs_straight_where_it_can() -> None:
    free = np.ones((4, 9), bool)
    assert shortest_path(free, 2, 1, 2, 7).tolist() == [[2, c] for c in range(1, 8)]
    assert shortest_path(free, 0, 0, 3, 8).tolist() == shortest_path(free, 0, 0, 3, 8).tolist()


@pytest.mark.parametrize(
    ("rows", "cols", "length"), [(0, 0, 0.0), (0, -3, 3.0), (4, 4, 4 * 2**0.5), (-2, 5, 3 + 8**0.5)]
)
def test_the_octile_distance(rows: int, cols: int, length: float) -> None:
    assert octile(rows, cols) == pytest.approx(length)


@pytest.mark.slow
@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="this is that run")
def test_all_this_holds_uncompiled_too() -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        command, cwd=root, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
