"""One obstacle placed as its slow twin would, and configurations of obstacles that cannot be."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.obstacles import Circle, Obstacle, ObstaclesConfig, Polygon, RandomObstacles
from houseexpo.pseudoslam.kernels.placement import CLOSES_OFF, FITS, OVERLAPS, place_obstacle
from houseexpo.pseudoslam.worlds.place_obstacles import _disc
from houseexpo.pseudoslam.worlds.world import traversable_cells


def test_one_obstacle_as_its_slow_twin_would() -> None:
    """Dilate all, label all, count all."""
    rng, verdicts = np.random.default_rng(5), Counter[int]()
    for _ in range(80):
        occupied = (rng.random((14, 18)) < 0.05).astype(np.uint8)
        occupied[[0, -1]] = occupied[:, [0, -1]] = 1
        radius, gap, least = rng.choice([0.5, 1.2]), rng.choice([0.0, 0.5, 1.5]), int(rng.integers(1, 9))
        traversable = traversable_cells(occupied, radius)
        if not traversable.any():
            continue
        row, col, high, wide = rng.integers((1, 1, 1, 1), (12, 10, 5, 17)).tolist()
        spans = np.array([(r, col, min(col + wide, 18)) for r in range(row, min(row + high, 14))], np.int32)
        expected = twin(occupied, traversable, spans, gap, radius, least)
        scratch = np.empty((3, occupied.size), np.int32)
        verdict = place_obstacle(
            occupied, traversable, spans, len(spans), _disc(gap, 1.0), _disc(radius, 0.5), least, scratch
        )
        assert verdict == expected[0]
        np.testing.assert_array_equal(occupied, expected[1])
        np.testing.assert_array_equal(traversable, expected[2])
        verdicts[verdict] += 1
    assert min(verdicts[verdict] for verdict in (FITS, OVERLAPS, CLOSES_OFF)) >= 5


def twin(
    occupied: np.ndarray, traversable: np.ndarray, spans: np.ndarray, gap: float, radius: float, least: int
) -> tuple[int, np.ndarray, np.ndarray]:
    """What ``place_obstacle`` does, one cell at a time."""
    cells = [(row, col) for row, first, last in spans.tolist() for col in range(first, last)]
    for (row, col), (r, c) in itertools.product(cells, np.argwhere(occupied).tolist()):
        apart = math.hypot(max(abs(row - r) - 1, 0), max(abs(col - c) - 1, 0))
        if (row, col) == (r, c) or apart < gap:
            return OVERLAPS, occupied, traversable
    left = traversable.copy()
    for (row, col), (r, c) in itertools.product(cells, np.argwhere(traversable).tolist()):
        if math.hypot(max(abs(row - r) - 0.5, 0), max(abs(col - c) - 0.5, 0)) < radius:
            left[r, c] = 0
    if (left != traversable).any():
        large = [piece for piece in pieces(left) if len(piece) >= least]
        if len(large) != 1:
            return CLOSES_OFF, occupied, traversable
        left[:] = 0
        left[tuple(zip(*large[0], strict=True))] = 1
    more = occupied.copy()
    more[tuple(zip(*cells, strict=True))] = 1
    return FITS, more, left


def pieces(cells: np.ndarray) -> list[set[tuple[int, int]]]:
    """The 4-connected pieces of the cells that are set."""
    left, found = set(map(tuple, np.argwhere(cells).tolist())), []
    while left:
        piece, edge = set(), {min(left)}
        while edge:
            piece |= edge
            edge = {(r + i, c + j) for r, c in edge for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1))} & (left - piece)
        found.append(piece)
        left -= piece
    return found


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RandomObstacles((5, 1)), r"obstacles.random.number: expected \(low, high\) with low at most high"),
        (lambda: RandomObstacles((-1, 1)), r"obstacles.random.number: expected at least 0, found -1"),
        (lambda: RandomObstacles((1, 2.5)), r"obstacles.random.number: expected whole numbers"),
        (lambda: RandomObstacles(5), r"obstacles.random.number: expected a list, found 5"),
        (lambda: RandomObstacles((1, 2, 3)), r"obstacles.random.number: expected \(low, high\), found"),
        (lambda: RandomObstacles(size_m=(0.0, 1.0)), r"obstacles.random.size_m: expected more than 0, found 0.0"),
        (lambda: RandomObstacles(size_m=(0.1, math.nan)), r"obstacles.random.size_m: expected a finite number"),
        (lambda: RandomObstacles(shapes=("blob",)), r"obstacles.random.shapes: .*rectangle.* found \('blob',\)"),
        (lambda: RandomObstacles(shapes=()), r"obstacles.random.shapes: expected some of"),
        (lambda: RandomObstacles(shapes="circle"), r"obstacles.random.shapes: expected a list, found 'circle'"),
        (lambda: RandomObstacles(gap_m=-0.1), r"obstacles.random.gap_m: expected at least 0"),
        (lambda: ObstaclesConfig(placed=(Circle(1.0),)), r"obstacles.placed\[0\]: expected an Obstacle, found Circle"),
        (lambda: ObstaclesConfig(random=3), r"obstacles.random: expected RandomObstacles or None, found 3"),
    ],
)
def test_bad_configurations_are_refused(make: object, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make()  # type: ignore[operator]


def test_lists_are_kept_as_tuples() -> None:
    config = ObstaclesConfig([Obstacle(Polygon([[0, 0], [1, 0], [0, 1]]), 1, 1)], RandomObstacles([1, 2], [0.1, 0.2]))
    assert hash(config)
    assert config.random == RandomObstacles((1, 2), (0.1, 0.2))
