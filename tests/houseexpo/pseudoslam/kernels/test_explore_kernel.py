"""The explorer that is compiled whole does what the explorer in Python does, step by step."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.pseudoslam.agents.chooser import Chooser
from houseexpo.pseudoslam.agents.exploring import Explorer
from houseexpo.pseudoslam.agents.frontier import NearestFrontier
from houseexpo.pseudoslam.agents.protocol import Robot, knowledge_of
from houseexpo.pseudoslam.config import NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.explore import CHOICE, ENDED, NOTHING
from houseexpo.pseudoslam.kernels.planning.outlook import OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.scoring import Scorer, best_of
from houseexpo.pseudoslam.learning.choosing import INFORMATION, NEAREST
from houseexpo.pseudoslam.learning.explorations import Explorations
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator

CONFIG = SimulatorConfig(pixels_per_metre=12.5)
ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (3, 8), (3, 2), (9, 2), (9, 0)], 1, {})
POCKET = FloorPlan("pocket", [(0, 0), (0, 6), (10, 6), (10, 0), (6, 0), (6, 4.5), (5.8, 4.5), (5.8, 0)], 1, {})


def random_scorer(seed: int) -> Scorer:
    rng = np.random.default_rng(seed)
    n = len(OUTLOOKS)
    return Scorer(*(rng.normal(0.0, 0.5, shape) for shape in ((n,), (5, n), (5,), (4, 5), (4,), (4,))))


def course_of(explorer: Explorer, plan: FloorPlan, seed: int, most: int) -> tuple[list[int], list[float], bool]:
    """What the explorer in Python does: cells seen and pixels gone after each step, and whether it was done."""
    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    covered, gone = [int(state.counts.covered)], [0.0]
    while len(covered) <= most and covered[-1] < math.ceil(0.985 * state.observable_cells):
        action = explorer(None, knowledge_of(simulator, state))
        if action is None:
            return covered, gone, True
        simulator.step(state, ACTIONS[action])
        covered.append(int(state.counts.covered))
        gone.append(float(state.episode.readings[0].path_length))
    return covered, gone, False


def check(plan: FloorPlan, scorer: Scorer, explorer: Explorer, seed: int, most: int) -> None:
    explorations = Explorations(CONFIG, most)
    walk = explorations.begin(plan, np.random.default_rng(seed))
    ended = explorations.go(walk, scorer)
    covered, gone, done = course_of(explorer, plan, seed, most)
    assert walk.steps == len(covered) - 1
    assert walk.course.covered[: walk.steps + 1].tolist() == covered
    assert walk.course.gone_px[: walk.steps + 1].tolist() == gone
    assert ended == (NOTHING if done else ENDED)


@pytest.mark.parametrize("plan", [ANGLE, POCKET], ids=lambda plan: plan.id)
@pytest.mark.parametrize("seed", [0, 1])
def test_it_goes_as_the_nearest_frontier_explorer_does(plan: FloorPlan, seed: int) -> None:
    check(plan, NEAREST, NearestFrontier(Robot(CONFIG), 0), seed, 300)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_goes_as_a_chooser_does(seed: int) -> None:
    scorer = random_scorer(seed)
    check(POCKET, scorer, Chooser(Robot(CONFIG), 0, scorer), seed, 300)


@pytest.mark.slow
def test_it_goes_as_choosers_do_in_published_houses(published_lines: list[bytes]) -> None:
    for i in range(12):
        scorer = random_scorer(i) if i % 2 else INFORMATION
        check(decode(published_lines[i]), scorer, Chooser(Robot(CONFIG), 0, scorer), i, 500)


def test_it_stops_at_choices_and_goes_on_from_there() -> None:
    """Choice by choice, each the best, is the same as all at once; a copy changes nothing."""
    explorations = Explorations(CONFIG, 300)
    whole, parts = (explorations.begin(POCKET, np.random.default_rng(0)) for _ in range(2))
    explorations.go(whole, INFORMATION)
    for _ in itertools.count():
        if explorations.go(parts, INFORMATION, choices=0) != CHOICE:
            break
        best = int(parts.errand.scores.argmax())
        explorations.go(parts.copy(), INFORMATION, first=parts.choices - 1)
        explorations.go(parts, INFORMATION, first=best, choices=1)
    assert parts.steps == whole.steps
    assert parts.course.covered.tolist() == whole.course.covered.tolist()


def test_the_best_score_wins_and_of_equal_ones_the_first() -> None:
    outlooks, scores = np.zeros((16, len(OUTLOOKS))), np.zeros(16)
    outlooks[:4, OUTLOOKS.index("rank")] = 0.3, 0.1, 0.1, 0.2
    assert best_of(outlooks, 4, NEAREST, scores) == 1
    assert scores[:4].tolist() == [-0.3, -0.1, -0.1, -0.2]
    scorer = random_scorer(3)
    first = np.maximum(scorer.first @ outlooks[:4].T + scorer.first_bias[:, None], 0)
    second = np.maximum(scorer.second @ first + scorer.second_bias[:, None], 0)
    best_of(outlooks, 4, scorer, scores)
    assert scores[:4] == pytest.approx(scorer.line @ outlooks[:4].T + scorer.last @ second)


def test_the_worth_of_a_walk_is_its_area_and_its_metres() -> None:
    explorations = Explorations(CONFIG, 8)
    walk = explorations.begin(ANGLE, np.random.default_rng(0))
    cells = walk.state.observable_cells
    walk.state.episode.counts["steps"] = 4
    walk.course.covered[:5] = np.array([0.5, 0.5, 0.75, 1.0, 1.0]) * cells
    walk.course.gone_px[:5] = np.array([0, 1, 2, 3, 4]) * 12.5
    area, metres = explorations.worth(walk)
    assert area == pytest.approx((0.5 + 0.5 + 0.75 + 1.0 + 4 * 1.0) / 8, abs=1e-3)
    assert metres == 3.0
    assert explorations.worth(walk, since=2) == pytest.approx(((0.75 + 1.0 + 4 * 1.0) / 8, 1.0), abs=1e-3)
    walk.course.covered[:5] = np.array([0.5, 0.5, 0.5, 0.5, 0.6]) * cells
    assert explorations.worth(walk)[1] == pytest.approx(4.0 + 0.3 * 150, abs=0.5)


def test_what_it_cannot_do_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected a sensor without errors"):
        Explorations(SimulatorConfig(noise=NoiseConfig(laser_m=0.01)), 100)
