"""Frontiers as actions: what they do, what is said of them, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import GoalConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.planning import MapPlanner
from houseexpo.pseudoslam.tasks import Exploration, Task
from tests.builders.robot_maps import reach_of
from tests.builders.simulations import SMALL_PLANNER, env_of, hut, native

pytestmark = pytest.mark.slow  # the kernels of planners' actions take half a minute to compile

HALL = hut("hall", 9.0)  # wider than the laser sees
STEPWISE = PlanningConfig(max_steps=1)


@pytest.mark.parametrize("task", ["Exploration", "Navigation"])
def test_gymnasium_finds_no_fault(task: str) -> None:
    check_env(env_of("frontier", task).unwrapped, skip_render_check=True)


def test_the_nearest_frontier_again_and_again_sees_the_whole_house() -> None:
    env = env_of("frontier", dataset=HALL, success_coverage=0.95)
    for seed in range(5):
        _, info = env.reset(seed=seed)
        assert info["primitive_steps"] == 0
        steps, way, actions = 0, 0.0, 0
        ended = False
        while not ended:
            _, _, terminated, truncated, info = env.step(0)
            steps, way, actions = steps + info["primitive_steps"], way + info["travelled_m"], actions + 1
            ended = terminated or truncated
            assert info["outcome"] in {"arrived", "seen", "done"}
        state = env.unwrapped.state
        assert info["is_success"]
        assert info["outcome"] == "done"
        assert info["collisions"] == 0
        assert steps == state.counts.steps
        assert way == pytest.approx(state.episode.readings["path_length"][0] / 16.0)
        assert actions < steps / 2


def test_rewards_are_the_sum_over_the_steps() -> None:
    env = env_of("frontier", dataset=HALL)
    _, info = env.reset(seed=3)
    for _ in range(5):
        before = info["explored_m2"]
        _, reward, _, _, info = env.step(1)
        assert reward == pytest.approx(info["explored_m2"] - before)


def test_time_counts_steps_not_actions() -> None:
    env = env_of("frontier", dataset=HALL, config=replace(SMALL_PLANNER, max_steps=25), success_coverage=None)
    env.reset(seed=0)
    steps, truncated = 0, False
    while not truncated:
        assert steps < 25
        _, _, terminated, truncated, info = env.step(0)
        steps += info["primitive_steps"]
        assert not terminated
    assert steps == 25


def test_an_action_takes_no_more_steps_than_it_may() -> None:
    env = env_of("frontier", dataset=HALL, planning=PlanningConfig(max_steps=4))
    env.reset(seed=0)
    outcomes = []
    for _ in range(12):
        *_, info = env.step(0)
        assert 1 <= info["primitive_steps"] <= 4
        outcomes.append((info["primitive_steps"], info["outcome"]))
    assert (4, "limit") in outcomes


def test_what_is_observed_is_what_the_map_shows() -> None:
    """Features of the frontiers that a planner of its own finds, in the robot's frame; the mask; the rest is 0."""
    env = env_of("frontier", dataset=HALL, planning=PlanningConfig(frontiers=6))
    observation, _ = env.reset(seed=1)
    planner = MapPlanner(SMALL_PLANNER, most=6)
    for action in (0, 1, 0, 0):
        observation, *_ = env.step(action)
        state = env.unwrapped.state
        x, y, heading = state.believed_px.tolist()
        table = planner.frontiers(state.known, x, y)
        assert observation["action_mask"].tolist() == [1] * len(table) + [0] * (6 - len(table))
        assert env.unwrapped.action_masks().tolist() == observation["action_mask"].astype(bool).tolist()
        assert not observation["frontiers"][len(table) :].any()
        for one, (ahead, left, way, size, valid) in zip(table, observation["frontiers"].tolist(), strict=False):
            row, col = divmod(int(one.middle), state.known.shape[1])
            assert state.known[row, col] == UNKNOWN
            towards = heading + math.atan2(left, ahead)
            assert x + 16 * math.hypot(ahead, left) * math.cos(towards) == pytest.approx(col + 0.5, abs=1e-3)
            assert y - 16 * math.hypot(ahead, left) * math.sin(towards) == pytest.approx(row + 0.5, abs=1e-3)
            assert (way, size, valid) == pytest.approx((one.way / 70 / 16, one.cells / 16, 1.0))


def test_where_there_is_no_frontier_the_robot_turns_left() -> None:
    env = env_of("frontier", dataset=HALL)
    env.reset(seed=1)
    heading, place = env.unwrapped.state.pose_px[2], env.unwrapped.state.pose_px[:2].copy()
    observation, _, _, _, info = env.step(15)
    assert observation["action_mask"][15] == 0
    assert (info["outcome"], info["primitive_steps"], info["travelled_m"]) == ("nothing", 1, 0.0)
    turned = math.remainder(env.unwrapped.state.pose_px[2] - heading, 2 * math.pi)
    assert turned == pytest.approx(math.radians(10))
    assert (env.unwrapped.state.pose_px[:2] == place).all()


def test_in_a_house_that_is_known_the_first_choice_is_allowed_though_there_is_none() -> None:
    env = env_of("frontier", config=replace(SMALL_PLANNER, known_map=True), success_coverage=None)
    observation, _ = env.reset(seed=0)
    assert observation["action_mask"].tolist() == [1] + [0] * 15
    assert not observation["frontiers"].any()
    *_, info = env.step(0)
    assert info["outcome"] == "nothing"


def test_the_robot_enters_nothing_that_its_map_does_not_show_free() -> None:
    """Step by step: its disc meets cells that were free on the map before the step, or that it covered."""
    env = env_of("frontier", dataset=HALL, planning=STEPWISE, success_coverage=None)
    radius = 0.2 * 16 - 1e-6
    rng = np.random.default_rng(0)
    moved = 0
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        action = 0
        for step in range(60):
            state = env.unwrapped.state
            before, place = state.known.copy(), state.pose_px.copy()
            mask = observation["action_mask"]
            if step % 20 == 0 or not mask[action]:
                action = int(rng.choice(np.flatnonzero(mask)))
            observation, _, _, _, info = env.step(action)
            x, y, _ = state.pose_px.tolist()
            moved += (x, y) != tuple(place[:2].tolist())
            for row in range(int(y - radius), int(y + radius) + 1):
                for col in range(int(x - radius), int(x + radius) + 1):
                    if reach_of(row, col, x, y) < radius and before[row, col] != FREE:
                        assert before[row, col] != OBSTACLE
                        assert reach_of(row, col, *place[:2].tolist()) < radius + 1e-5
            assert info["collisions"] == 0
    assert moved > 30


def test_a_goal_on_a_known_map_is_the_last_choice() -> None:
    config = replace(SMALL_PLANNER, known_map=True)
    env = env_of("frontier", "Navigation", config=config, planning=PlanningConfig(frontiers=3))
    for seed in range(6):
        observation, info = env.reset(seed=seed)
        assert observation["action_mask"].tolist() == [0, 0, 0, 1]
        assert observation["frontiers"][3, :2] == pytest.approx(observation["goal"], abs=1 / 16)
        before = info["to_goal_m"]
        _, reward, terminated, _, info = env.step(3)
        assert terminated
        assert info["is_success"]
        assert info["outcome"] == "done"
        assert info["spl"] > 0.85
        assert reward == pytest.approx(before - info["to_goal_m"] + 2.5)


def test_a_goal_on_an_unknown_map_is_no_choice_until_there_is_a_way() -> None:
    config = replace(SMALL_PLANNER, goal=GoalConfig(least_way_m=100.0), known_map=False)
    env = env_of("frontier", "Navigation", dataset=HALL, config=config, planning=PlanningConfig(frontiers=5))
    seen = set()
    for seed in range(8):
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            seen.add(int(observation["action_mask"][5]))
            action = 5 if observation["action_mask"][5] else 0
            observation, _, ended, truncated, info = env.step(action)
            assert not truncated
        assert info["is_success"]
    assert seen == {0, 1}


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95, 1.0])
def test_enough_cells_are_the_fewest_that_succeed(share: float) -> None:
    task: Task = Exploration(share)
    for cells in (1, 7, 1000, 12345):
        enough = task.enough_cells(cells)
        assert enough / cells >= share
        assert (enough - 1) / cells < share
    assert Exploration(None).enough_cells(10) > 10**12


def test_masks_are_told_as_sb3_contrib_asks() -> None:
    env = native("Exploration", 3, "SameStep", dataset=HALL, config=SMALL_PLANNER, actions="frontier")
    observation, _ = env.reset(seed=0)
    masks = env.unwrapped.action_masks()
    assert masks.dtype == bool
    assert np.array_equal(masks, observation["action_mask"].astype(bool))
    assert all(np.array_equal(env.unwrapped.action_masks(i), masks[i]) for i in range(3))
    assert all(map(np.array_equal, env.unwrapped.call("action_masks"), masks))
    env.close()


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (16, "the number of a frontier, 0 to 15"),
        (-1, "the number of a frontier"),
        (0.0, "the number of a frontier"),
        ([0, 1], "shape"),
    ],
)
def test_what_is_no_action_is_refused(action: Any, words: str) -> None:
    env = env_of("frontier").unwrapped
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=words):
        env.step(np.array(action))


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"ObstacleAvoidance .* do not add up"):
        env_of("frontier", "ObstacleAvoidance")
    with pytest.raises(ConfigError, match="planning: expected actions='frontier'"):
        env_of("discrete", planning=PlanningConfig())
    with pytest.raises(ConfigError, match="expected a PlanningConfig"):
        env_of("frontier", planning=3)
    for name, value in (
        ("frontiers", 0),
        ("max_steps", 0),
        ("large_m", -1.0),
        ("settled_m", math.nan),
    ):
        with pytest.raises(ConfigError, match=f"planning.{name}"):
            PlanningConfig(**{name: value})
