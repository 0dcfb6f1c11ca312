"""Pairs of partial and complete maps: what is on them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.plan.parts import Room
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.io.pairs import ROOM_LABELS, PairConfig, simulate_pairs, stack_pairs
from houseexpo.pseudoslam.worlds.cache import world_for
from tests.builders.simulations import HUTS

FREE, OBSTACLE = 127, 255
COARSE = SimulatorConfig(pixels_per_metre=10.0)
SMALL = PairConfig(each=3, every=2, size_m=8.0, pixels=40, simulator=COARSE)
LEFT = Room(0, "Kitchen", [(0, 0), (0, 4), (3, 4), (3, 0)])
RIGHT = Room(1, "Bedroom", [(3.2, 0), (3.2, 4), (6, 4), (6, 0)])
TWO_ROOMS = FloorPlan(
    "two",
    [(0, 0), (0, 4), (3, 4), (3, 2.5), (3.2, 2.5), (3.2, 4), (6, 4), (6, 0), (3.2, 0), (3.2, 1.5), (3, 1.5), (3, 0)],
    2,
    {},
    rooms=(LEFT, RIGHT),
)


def at(x: float, y: float, heading_deg: float, **given: Any) -> PairConfig:
    start = StartConfig(random=False, x_m=x, y_m=y, heading_deg=heading_deg)
    return replace(SMALL, simulator=replace(COARSE, start=start, **given))


def test_the_window_is_the_map_and_the_house_with_the_robot_in_the_middle() -> None:
    """From (1, 2) in the room on the left, looking right, 5 pixels a metre, up is y."""
    config = replace(at(1.0, 2.0, 0.0), size_m=14.0, pixels=70)
    first, *_ = simulate_pairs(TWO_ROOMS, world_for(TWO_ROOMS, config.simulator), config, np.random.default_rng(0))
    assert first.pose == pytest.approx([1.0, 2.0, 0.0])
    assert first.believed == pytest.approx(first.pose)
    assert (first.steps, 0 < first.coverage < 1) == (0, True)
    middle, metre = 35, 5
    row, right = middle, lambda x: int(middle + (x - 1.0) * metre)
    complete, partial = first.complete, first.partial
    assert complete[row, right(0.5)] == FREE  # behind the robot: there, and not yet seen
    assert partial[row, right(0.5)] == 0
    assert partial[row, right(2.5)] == complete[row, right(2.5)] == FREE
    assert OBSTACLE in complete[row, right(5.9) : right(6.4)]
    assert complete[row, right(7.0)] == complete[0, 0] == 0  # outside
    assert complete[middle - 5, right(3.1)] == OBSTACLE  # the wall between the rooms, a metre above the door's middle
    known = partial != 0
    assert (partial[known] <= complete[known]).mean() > 0.99
    assert first.rooms[row, right(1.5)] == 1
    assert first.rooms[row, right(4.5)] == 2
    assert first.rooms[0, 0] == first.labels[0, 0] == 0
    assert ROOM_LABELS[first.labels[row, right(1.5)] - 1] == "Kitchen"
    assert ROOM_LABELS[first.labels[row, right(4.5)] - 1] == "Bedroom"


def test_the_plan_is_not_mirrored() -> None:
    """A hook whose only corner lies at high y."""
    hook = FloorPlan("hook", [(0, 0), (0, 6), (6, 6), (6, 5), (1.5, 5), (1.5, 0)], 1, {})
    config = replace(at(0.75, 3.0, 90.0), rooms=False, size_m=16.0, pixels=80)
    first, *_ = simulate_pairs(hook, world_for(hook, config.simulator), config, np.random.default_rng(0))
    rows, cols = np.nonzero(first.complete == FREE)
    assert rows[cols > 60].max() < 40  # what lies far to the right lies above the robot
    assert (first.rooms == 0).all()


def test_pairs_of_an_episode_know_more_and_more() -> None:
    config = replace(SMALL, each=6)
    found = list(simulate_pairs(HUTS[2], world_for(HUTS[2], COARSE), config, np.random.default_rng(3)))
    assert [pair.steps for pair in found] == [0, 2, 4, 6, 8, 10]
    assert all(one.coverage <= other.coverage for one, other in pairwise(found))
    assert found[-1].coverage > found[0].coverage
    for pair in found:
        known = pair.partial != 0
        assert (pair.partial[known] == pair.complete[known]).mean() > 0.95


def test_where_odometry_errs_the_house_is_laid_under_the_robot() -> None:
    noise = NoiseConfig(odometry_way=0.3, odometry_turn=0.9)
    config = replace(SMALL, each=8, every=6, simulator=replace(COARSE, noise=noise, laser=LaserConfig(8.0, 360.0)))
    found = list(simulate_pairs(HUTS[1], world_for(HUTS[1], config.simulator), config, np.random.default_rng(1)))
    off = [abs(math.remainder(float(pair.pose[2] - pair.believed[2]), 2 * math.pi)) for pair in found]
    assert off[0] == 0.0
    assert max(off) > 0.2
    last = found[int(np.argmax(off))]
    turn = float(last.pose[2] - last.believed[2])
    # ahead of the robot, in either picture, is the direction that odometry has; the wall is as far as it truly is
    ahead = np.array([math.cos(last.believed[2]), -math.sin(last.believed[2])])
    truly = np.array([math.cos(last.pose[2]), math.sin(last.pose[2])])
    assert ahead[0] == pytest.approx(math.cos(last.pose[2] - turn), abs=1e-6)
    ways = np.arange(0.0, 4.0, 0.05)
    places = last.pose[:2] + ways[:, None] * truly
    inside = ((places > 0) & (places < (1.6 * 4.5, 4.5))).all(axis=1)
    col, row = np.floor(20 + ways[:, None] * 5 * ahead).astype(int).T
    on = (col >= 0) & (col < 40) & (row >= 0) & (row < 40)
    assert ((last.complete[row[on], col[on]] == FREE) == inside[on]).mean() > 0.85


def test_arrays_are_what_the_configuration_says() -> None:
    for config in (SMALL, replace(SMALL, rooms=False)):
        found = list(simulate_pairs(HUTS[0], world_for(HUTS[0], COARSE), config, np.random.default_rng(0)))
        for pairs in (found, []):
            arrays = stack_pairs(pairs, config)
            assert {name: (str(array.dtype), array.shape[1:]) for name, array in arrays.items()} == config.arrays()
            assert {len(array) for array in arrays.values()} == {len(pairs)}


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"each": 0}, "each: expected a whole number of at least 1, found 0"),
        ({"every": 0}, "every: expected a whole number of at least 1, found 0"),
        ({"pixels": 1}, "pixels: expected a whole number of at least 2, found 1"),
        ({"size_m": 0.0}, "pairs.size_m: expected more than 0, found 0"),
    ],
)
def test_pairs_that_cannot_be_are_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        PairConfig(**given)
