"""Numbers in groups, against networkx, and that planning does not load it."""

from __future__ import annotations

import subprocess
import sys

import networkx as nx
import numpy as np

from pipeline.geometry.groups import Groups, connected_groups


def test_numbers_that_pairs_connect_are_in_one_group() -> None:
    assert connected_groups(6, [(4, 1), (5, 4), (0, 3)]) == [[0, 3], [1, 4, 5], [2]]
    assert connected_groups(0, []) == []


def test_groups_are_the_connected_components() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        count = int(rng.integers(1, 40))
        pairs = rng.integers(0, count, (int(rng.integers(0, 40)), 2)).tolist()
        graph = nx.Graph(pairs)
        graph.add_nodes_from(range(count))
        assert connected_groups(count, pairs) == sorted(sorted(part) for part in nx.connected_components(graph))


def test_joining_says_whether_there_were_two_groups() -> None:
    groups = Groups(3)
    assert groups.join(0, 2)
    assert not groups.join(2, 0)
    assert groups.of(2) == groups.of(0) != groups.of(1)


def test_planning_loads_no_library_of_graphs() -> None:
    """It takes a fifth of what a worker loads."""
    said = "import sys, pipeline.algorithm, pipeline.batch.planning; print('networkx' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", said], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"
