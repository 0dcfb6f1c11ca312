"""The explorer that is compiled whole does what the explorer in Python does, step by step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.pseudoslam.agents.explorers import Explorer, NearestFrontier
from houseexpo.pseudoslam.agents.learned import FrontierChooser
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge
from houseexpo.pseudoslam.config import NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.explore import ENDED, NOTHING, find_unseen_in_sight
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES, score_frontiers
from houseexpo.pseudoslam.kernels.types import Floats
from houseexpo.pseudoslam.learning.chooser_training import INFORMATION, NEAREST, HouseExplorer
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from houseexpo.pseudoslam.step_kernels import make_scratch
from tests.builders.scans import slow_sector

CONFIG = SimulatorConfig(pixels_per_metre=12.5)
ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (3, 8), (3, 2), (9, 2), (9, 0)], 1, {})
POCKET = FloorPlan("pocket", [(0, 0), (0, 6), (10, 6), (10, 0), (6, 0), (6, 4.5), (5.8, 4.5), (5.8, 0)], 1, {})


def random_weights(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(0.0, 0.5, len(FEATURES))


def course_of(explorer: Explorer, plan: FloorPlan, seed: int, most: int) -> tuple[list[int], list[float], bool]:
    """What the explorer in Python does: cells seen and pixels gone after each step, and whether it was done."""
    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    covered, gone = [int(state.counts.covered)], [0.0]
    while len(covered) <= most and covered[-1] < math.ceil(0.985 * state.observable_cells):
        action = explorer(None, make_knowledge(simulator, state))
        if action is None:
            return covered, gone, True
        simulator.step(state, ACTIONS[action])
        covered.append(int(state.counts.covered))
        gone.append(float(state.episode.readings[0].path_length))
    return covered, gone, False


def check(plan: FloorPlan, weights: Floats, explorer: Explorer, seed: int, most: int) -> None:
    explorations = HouseExplorer(CONFIG, most)
    walk = explorations.begin(plan, np.random.default_rng(seed))
    ended = explorations.go(walk, weights, seen=0.985)
    covered, gone, done = course_of(explorer, plan, seed, most)
    assert walk.steps == len(covered) - 1
    assert walk.course.covered[: walk.steps + 1].tolist() == covered
    assert walk.course.gone_px[: walk.steps + 1].tolist() == gone
    assert ended == (NOTHING if done else ENDED)


@pytest.mark.slow
@pytest.mark.parametrize("plan", [ANGLE, POCKET], ids=lambda plan: plan.id)
@pytest.mark.parametrize("seed", [0, 1])
def test_it_goes_as_the_nearest_frontier_explorer_does(plan: FloorPlan, seed: int) -> None:
    check(plan, NEAREST, NearestFrontier(Robot(CONFIG), 0), seed, 300)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_goes_as_a_chooser_does(seed: int) -> None:
    weights = random_weights(seed)
    check(POCKET, weights, FrontierChooser(Robot(CONFIG), 0, weights), seed, 300)


@pytest.mark.slow
def test_it_goes_as_choosers_do_in_published_houses(published_lines: list[bytes]) -> None:
    for i in range(12):
        weights = random_weights(i) if i % 2 else INFORMATION
        check(decode(published_lines[i]), weights, FrontierChooser(Robot(CONFIG), 0, weights), i, 500)


@pytest.mark.slow
def test_a_copy_of_a_walk_changes_nothing() -> None:
    explorations = HouseExplorer(CONFIG, 300)
    one, other = (explorations.begin(POCKET, np.random.default_rng(0)) for _ in range(2))
    explorations.go(one.copy(), random_weights(0))
    explorations.go(one, INFORMATION)
    explorations.go(other, INFORMATION)
    assert one.steps == other.steps > 0
    assert one.course.covered.tolist() == other.course.covered.tolist()


def test_the_best_score_wins_and_of_equal_ones_the_first() -> None:
    features, scores = np.zeros((16, len(FEATURES))), np.zeros(16)
    features[:4, FEATURES.index("rank")] = 0.3, 0.1, 0.1, 0.2
    assert score_frontiers(features, 4, NEAREST, scores) == 1
    assert scores[:4].tolist() == [-0.3, -0.1, -0.1, -0.2]
    weights, features = random_weights(3), np.random.default_rng(0).normal(size=features.shape)
    best = score_frontiers(features, 4, weights, scores)
    assert scores[:4] == pytest.approx(features[:4] @ weights)
    assert best == scores[:4].argmax()


@pytest.mark.slow
def test_the_way_to_90_percent_is_told_and_what_is_left_is_charged_for() -> None:
    explorations = HouseExplorer(CONFIG, 300)
    walk = explorations.begin(POCKET, np.random.default_rng(5))
    explorations.go(walk, INFORMATION)
    assert walk.coverage >= 0.9
    assert walk.course.covered[walk.steps - 1] < 0.9 * walk.state.observable_cells
    ways = explorations.way(POCKET, np.random.default_rng(5), NEAREST, INFORMATION)
    assert ways[1].tolist() == [walk.course.gone_px[walk.steps] / 12.5, walk.steps]
    short = HouseExplorer(CONFIG, 20).way(POCKET, np.random.default_rng(5), INFORMATION)[0]
    seen = walk.course.covered[20] / walk.state.observable_cells
    assert short == pytest.approx([walk.course.gone_px[20] / 12.5 + 150 * (0.9 - seen), 20 + 1000 * (0.9 - seen)])


def test_what_it_cannot_do_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected a laser that scans sectors without noise"):
        HouseExplorer(SimulatorConfig(noise=NoiseConfig(laser_m=0.01)), 100)


def test_what_is_unseen_in_sight_is_what_its_twin_says() -> None:
    rng, circle = np.random.default_rng(3), 2 * math.pi
    scratch = make_scratch(CONFIG)
    beside = 0
    for _ in range(12):
        known = rng.choice([UNKNOWN, FREE, OBSTACLE], (24, 31), p=[0.05, 0.9, 0.05]).astype(np.uint8)
        x, y, heading, range_px = rng.uniform((1, 1, -4, 3), (30, 23, 4, 13))
        known[int(y), int(x)] = FREE
        half, before, after = rng.uniform((0.2, 0, 0), (1.5, 1.5, 1.5))
        swept = heading - half - before, heading + half + after
        _, hit = slow_sector((known != FREE).astype(np.uint8), x, y, 0.0, math.pi, range_px)
        unknown = [(row, col) for row, col in hit if known[row, col] == UNKNOWN]
        angles = [math.atan2(y - row - 0.5, col + 0.5 - x) for row, col in unknown]
        outside = [a for a in angles if (a - swept[0]) % circle > swept[1] - swept[0]]
        found, left, right = find_unseen_in_sight(known, x, y, heading, half, range_px, swept, scratch)
        on_axes = sum(row == int(y) or col == int(x) for row, col in unknown)
        assert len(outside) <= found <= len(outside) + on_axes
        assert left == pytest.approx(max(((a - heading - half) % circle for a in outside), default=0.0))
        assert right == pytest.approx(max(((heading - half - a) % circle for a in outside), default=0.0))
        beside += len(outside)
    assert beside > 20
    everywhere = find_unseen_in_sight(known, x, y, heading, half, range_px, (heading, heading + circle), scratch)
    assert everywhere == (0, 0.0, 0.0)
