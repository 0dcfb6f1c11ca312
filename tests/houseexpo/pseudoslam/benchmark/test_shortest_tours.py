"""The shortest way on which a share is seen: on graphs whose way is known, beside a search of all ways, in houses."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.worlds.world import make_world
from research.shortest_tours import Bounds, Lattice, lattice_of, shortest_way

STAR = Lattice(
    [[(1, 1.0), (2, 2.0), (3, 4.0)], [(0, 1.0)], [(0, 2.0)], [(0, 4.0)]],
    [0b0000000001, 0b0000000010, 0b0000001100, 0b1111110000],
    10,
)
"""From the middle, one cell is a metre away, two are 2 m and six 4 m: the last arm is not gone back."""


@pytest.mark.parametrize(
    ("share", "way"),
    [(0.1, 0.0), (0.2, 1.0), (0.3, 2.0), (0.4, 4.0), (0.7, 4.0), (0.8, 6.0), (0.9, 8.0), (1.0, 2 + 4 + 4.0)],
)
def test_a_star_shaped_graph_has_the_way_that_is_counted_by_hand(share: float, way: float) -> None:
    assert shortest_way(STAR, share) == Bounds(way, way)


def slow(lattice: Lattice, share: float, longest: float) -> float:
    """All ways, the shorter ones first."""
    best, open_now = math.inf, [(0.0, 0, lattice.views[0])]
    while open_now:
        length, node, seen = open_now.pop()
        if seen.bit_count() >= share * lattice.cells:
            best = min(best, length)
        elif length < min(longest, best):
            open_now += [(length + way, other, seen | lattice.views[other]) for other, way in lattice.edges[node]]
    return best


def test_random_graphs_have_the_way_of_a_search_of_all_ways() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        nodes = [(i, j) for i, j in product(range(3), range(3)) if rng.random() < 0.8 or (i, j) == (0, 0)]
        edges = [
            [
                (j, 1.0 + 0.1 * ((i * j) % 4))
                for j, other in enumerate(nodes)
                if abs(other[0] - node[0]) + abs(other[1] - node[1]) == 1
            ]
            for i, node in enumerate(nodes)
        ]
        views = [sum(1 << int(bit) for bit in rng.choice(20, 4, replace=False)) for _ in nodes]
        lattice = Lattice(edges, views, 20)
        for share in (0.3, 0.5, 0.6):
            found, way = shortest_way(lattice, share), slow(lattice, share, 7.0)
            if way < 7.0:
                assert found.low == pytest.approx(way)
                assert found.high == pytest.approx(way)
            else:
                assert found.low >= 7.0 - 1e-9


def test_what_cannot_be_seen_has_no_way_and_few_labels_give_an_interval() -> None:
    assert shortest_way(Lattice(STAR.edges, STAR.views, 11), 1.0) == Bounds(math.inf, math.inf)
    found = shortest_way(STAR, 1.0, most_labels=2)
    assert found.low <= 10.0 <= found.high
    assert found.low >= 4.0
    assert not found.exact


def test_an_l_shaped_corridor_is_seen_from_its_corner() -> None:
    """From 0.5 m behind its end, the corner's far side is 4 m away; the squares' middles are 0.24 m off at most."""
    plan = FloorPlan("L", [(0, 0), (0, 1), (4, 1), (4, 5), (5, 5), (5, 0)], 1, {})
    world = make_world(plan, 25.0, 0.2, 5.0)
    x, y = world.frame.pixel_from_point(0.5, 0.5)
    lattice = lattice_of(world, (int(y), int(x)), 0.2, 5.0)
    found = shortest_way(lattice, 0.99)
    assert found.exact
    assert 3.2 < found.low < 4.0
    assert shortest_way(lattice, 0.4).low == 0.0
    square = make_world(FloorPlan("square", [(0, 0), (0, 4), (4, 4), (4, 0)], 1, {}), 25.0, 0.2, 5.0)
    assert shortest_way(lattice_of(square, (50, 50), 0.2, 5.0), 1.0) == Bounds(0.0, 0.0)
