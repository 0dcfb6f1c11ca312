"""Short tours and few viewing places, beside slow twins."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
import pytest

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.cover import greedy_cover, list_visible_cells, short_tour
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.step_kernels import make_scratch

CONFIG = SimulatorConfig(pixels_per_metre=10.0)


def lengths_between(places: np.ndarray) -> np.ndarray:
    return np.hypot(*(places[:, None] - places).transpose(2, 0, 1))


def length_of(order: list[int], lengths: np.ndarray) -> float:
    return float(sum(lengths[a, b] for a, b in pairwise(order)))


def slow_tour(lengths: np.ndarray) -> list[int]:
    """Nearest first, then turn any part round for as long as that helps."""
    order, rest = [0], list(range(1, len(lengths)))
    while rest:
        order.append(min(rest, key=lambda k: lengths[order[-1], k]))
        rest.remove(order[-1])
    better = True
    while better:
        better = False
        for i in range(1, len(order) - 1):
            for k in range(i + 1, len(order)):
                other = order[:i] + order[i : k + 1][::-1] + order[k + 1 :]
                if length_of(other, lengths) < length_of(order, lengths) - 1e-9:
                    order, better = other, True
    return order


@pytest.mark.parametrize("seed", range(20))
def test_a_tour_is_as_short_as_its_twins(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths = lengths_between(rng.random((int(rng.integers(1, 14)), 2)))
    order = short_tour(lengths).tolist()
    assert sorted(order) == list(range(len(lengths)))
    assert order[0] == 0
    assert length_of(order, lengths) == pytest.approx(length_of(slow_tour(lengths), lengths))


def test_a_tour_of_few_is_the_shortest_or_nearly() -> None:
    rng, excess = np.random.default_rng(1), []
    for _ in range(30):
        lengths = lengths_between(rng.random((7, 2)))
        best = min(length_of([0, *rest], lengths) for rest in permutations(range(1, 7)))
        excess.append(length_of(short_tour(lengths).tolist(), lengths) / best)
    assert min(excess) > 1 - 1e-9
    assert np.mean(excess) < 1.05


def test_a_tour_comes_back_for_nothing() -> None:
    """On a line, with the near end at -1 and the far one at 3: first the near one, for it costs a way back."""
    at = np.array([[0.0, 0.0], [3.0, 0.0], [-1.0, 0.0], [1.2, 0.0], [2.0, 0.0]])
    assert short_tour(lengths_between(at)).tolist() == [0, 2, 3, 4, 1]


def two_rooms() -> tuple[np.ndarray, np.ndarray]:
    """15 x 31 cells with a wall in the middle that has a gap at the top."""
    occupied = np.ones((15, 31), np.uint8)
    occupied[1:-1, 1:-1] = 0
    occupied[4:-1, 15] = 1
    return occupied, (occupied == 0).astype(np.uint8)


def seen_from(occupied: np.ndarray, wanted: np.ndarray, place: int, range_px: float) -> set[int]:
    scratch = make_scratch(CONFIG)
    row, col = divmod(place, occupied.shape[1])
    n, _ = sector_scan(
        occupied, col + 0.5, row + 0.5, 0.0, np.pi, range_px, scratch.runs, scratch.hit, scratch.slopes
    )  # fmt: skip
    cells = {cell for first, last in scratch.runs[:n] for cell in range(first, last + 1)}
    return {cell for cell in cells if wanted.flat[cell]}


def test_views_are_those_of_scans() -> None:
    occupied, wanted = two_rooms()
    wanted[7] = 0
    places = np.flatnonzero(occupied == 0)[::17].astype(np.int32)
    starts, views = np.zeros(len(places) + 1, np.int64), np.empty(100_000, np.int32)
    assert list_visible_cells(occupied, wanted, places, 12.0, make_scratch(CONFIG), starts, views)
    for i, place in enumerate(places.tolist()):
        found = views[starts[i] : starts[i + 1]].tolist()
        assert len(found) == len(set(found))
        assert set(found) == seen_from(occupied, wanted, place, 12.0)
    assert not list_visible_cells(occupied, wanted, places, 12.0, make_scratch(CONFIG), starts, views[:50])


def slow_cover(sets: list[set[int]], covered: set[int], least: int) -> list[int]:
    chosen: list[int] = []
    while True:
        gains = [len(one - covered) for one in sets]
        if not gains or max(gains) < least:
            return chosen
        chosen.append(gains.index(max(gains)))
        covered |= sets[chosen[-1]]


@pytest.mark.parametrize("least", [1, 3, 8])
def test_the_cover_is_its_twins(least: int) -> None:
    rng = np.random.default_rng(least)
    sets = [set(rng.choice(200, int(rng.integers(0, 40)), replace=False).tolist()) for _ in range(25)]
    starts = np.concatenate([[0], np.cumsum([len(one) for one in sets])])
    views = np.array([cell for one in sets for cell in sorted(one)], np.int32)
    covered = (rng.random(200) < 0.2).astype(np.uint8)
    expected = slow_cover(sets, set(np.flatnonzero(covered).tolist()), least)
    chosen = np.zeros(25, np.int64)
    assert chosen[: greedy_cover(starts, views, least, covered, chosen)].tolist() == expected
