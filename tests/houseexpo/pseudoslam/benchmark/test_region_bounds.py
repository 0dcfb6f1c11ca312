"""Bounds by regions: the search beside a slow twin, and beside shortest ways that an exhaustive search has found."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.worlds.world import make_world
from research import way_bounds
from research.region_bounds import choose_regions, fewest_moves
from research.shortest_tours import lattice_of, shortest_way
from research.way_bounds import bounds_m

RADIUS_M, RANGE_M = 0.2, 1.0
CROSS = FloorPlan(  # a room of 1 m with arms of 1.6 m
    "cross",
    [(1.6, 0), (1.6, 1.6), (0, 1.6), (0, 2.6), (1.6, 2.6), (1.6, 4.2), (2.6, 4.2), (2.6, 2.6), (4.2, 2.6), (4.2, 1.6),
     (2.6, 1.6), (2.6, 0)], 1, {},
)  # fmt: skip
ROOMS = FloorPlan(  # two rooms on one side of a corridor, with doors of 0.8 m
    "rooms",
    [(0, 0), (0, 0.8), (0.6, 0.8), (0.6, 1.0), (0, 1.0), (0, 2.4), (1.8, 2.4), (1.8, 1.0), (1.4, 1.0), (1.4, 0.8),
     (2.6, 0.8), (2.6, 1.0), (2.2, 1.0), (2.2, 2.4), (4.0, 2.4), (4.0, 1.0), (3.4, 1.0), (3.4, 0.8), (4.0, 0.8),
     (4.0, 0)], 1, {},
)  # fmt: skip


def slow_moves(squares: np.ndarray, start: tuple[int, int], views: np.ndarray, needed: int) -> int:
    """Search breadth-first over pairs of a square and a set."""

    def enter(square: tuple[int, int], held: frozenset[int]) -> frozenset[int]:
        return held | {i for i in range(len(views)) if views[i][square] and squares[square]}

    first = (start, enter(start, frozenset()))
    todo, seen = deque([(first, 0)]), {first}
    while todo:
        ((row, col), held), moves = todo.popleft()
        if len(held) >= needed:
            return moves
        for a in range(max(row - 1, 0), min(row + 2, squares.shape[0])):
            for b in range(max(col - 1, 0), min(col + 2, squares.shape[1])):
                state = ((a, b), enter((a, b), held))
                if squares[a, b] and state not in seen:
                    seen.add(state)
                    todo.append((state, moves + 1))
    return 0


@pytest.mark.parametrize("k", [1, 3, 5, 7, 8])
def test_the_search_is_that_of_its_slow_twin(k: int) -> None:
    rng = np.random.default_rng(k)
    for _ in range(8):
        squares = rng.random((9, 7)) < 0.75
        squares[4, 3] = True
        views = rng.random((k, 9, 7)) < 0.06
        needed = int(rng.integers(1, k + 1))
        assert fewest_moves(squares, (4, 3), views, needed) == slow_moves(squares, (4, 3), views, needed)


def test_regions_are_disjoint_and_of_one_size() -> None:
    squares, judged = np.ones((20, 20), bool), np.argwhere(np.ones((10, 10), bool))
    seen_from = np.zeros((100, 20, 20), bool)
    for k, (row, col) in enumerate(judged.tolist()):
        seen_from[k, max(2 * row - 2, 0) : 2 * row + 3, max(2 * col - 2, 0) : 2 * col + 3] = True
    regions = choose_regions(squares, (10, 10), seen_from, judged, 4)
    assert len(regions) > 2
    assert all(len(region) == 4 for region in regions)
    assert len(np.unique(np.concatenate(regions))) == 4 * len(regions)


@pytest.mark.slow
@pytest.mark.parametrize(("plan", "start"), [(CROSS, (2.1, 2.1)), (CROSS, (2.1, 0.5)), (ROOMS, (2.0, 0.4))])
def test_no_shortest_way_is_shorter_than_the_bound(
    plan: FloorPlan, start: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(way_bounds, "EVERY", 3)  # the cells of the exhaustive search
    world = make_world(plan, 25.0, RADIUS_M, RANGE_M)
    x, y = world.frame.pixels_from_points(start).tolist()
    lattice = lattice_of(world, (int(y), int(x)), RADIUS_M, RANGE_M, 0.8)
    ways_m, seen = bounds_m(world, x, y, RADIUS_M, RANGE_M)
    assert (np.diff(ways_m) > 0).all()
    assert (np.diff(seen) >= 0).all()
    single_m, single = bounds_m(world, x, y, RADIUS_M, RANGE_M, ())
    for share in (0.8, 0.9, 0.95):
        shortest = shortest_way(lattice, share)
        assert shortest.exact
        low, alone = ways_m[(seen >= share).argmax()], single_m[(single >= share).argmax()]
        assert alone <= low <= shortest.high
        if start == (2.1, 2.1) and share > 0.9:  # in the middle of the cross: every arm needs a way of its own
            assert low > 1.8 * alone
