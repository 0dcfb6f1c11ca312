"""N environments at once are N single ones, to the last bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.config import (
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    Odometry,
    SimulatorConfig,
)
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.tasks import ObstacleAvoidance
from tests.builders.simulations import HUTS, assert_same, assert_same_step, flat, hut, native, singles

NOISE = NoiseConfig(0.02, 0.01, 0.2, 0.05, 0.05, 1.0, 0.05, 0.02)
SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=32), max_steps=11)
AVOIDING = replace(ObstacleAvoidance.default, pixels_per_metre=16.0, max_steps=11)
LONG = replace(SMALL, max_steps=60)
HOUSES = [*HUTS, hut("hall", 9.0)]
ALPHAS = Odometry(0.1, 0.1, 0.1, 0.1)
PEOPLE = PeopleConfig(2, speed_m_s=1.0, away_m=0.5)
ACROSS = Trajectory(Circle(0.2), (0, 2, 4), ((1, 1, 0), (3, 1, 0), (1, 1, 0)), loop=True)
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "exploration": ("Exploration", {"dataset": HUTS, "config": SMALL}),
    "exploration, noise, people, dict": (
        "Exploration",
        {"dataset": HUTS, "config": replace(SMALL, noise=NOISE, people=PEOPLE), "observation": "dict"},
    ),
    "exploration, rays, noise, continuous": (
        "Exploration",
        {
            "dataset": HUTS,
            "config": replace(SMALL, noise=NOISE, laser=LaserConfig(rule="rays"), trajectories=(ACROSS,)),
            "actions": "continuous",
        },
    ),
    "a model of odometry, slip and bias": (
        "Exploration",
        {"dataset": HUTS, "config": replace(SMALL, noise=NoiseConfig(odometry_model=ALPHAS, slip=0.1))},
    ),
    "a drive with noise and people": (
        "Exploration",
        {
            "dataset": HUTS,
            "config": replace(SMALL, noise=NoiseConfig(odometry_model=ALPHAS, odometry_bias_deg_s=0.5), people=PEOPLE),
            "motion": "ackermann",
        },
    ),
    "a differential drive": ("Navigation", {"dataset": HUTS, "config": SMALL, "motion": "differential"}),
    "avoidance": ("ObstacleAvoidance", {"config": AVOIDING}),
    "avoidance, ends on collision, continuous, dict": (
        "ObstacleAvoidance",
        {"config": AVOIDING, "terminate_on_collision": True, "actions": "continuous", "observation": "dict"},
    ),
    "navigation": ("Navigation", {"dataset": HUTS, "config": SMALL}),
    "navigation, rooms": (
        "Navigation",
        {
            "dataset": [flat()],
            "config": replace(SMALL, max_steps=9, goal=GoalConfig(kind="room", names=("Bedroom", "Kitchen"))),
        },
    ),
    "navigation, furniture, scales": (
        "Navigation",
        {
            "dataset": [flat()],
            "config": replace(SMALL, max_steps=9, goal=GoalConfig(kind="object", names=("bed", "chair", "stove"))),
            "observation": "scales",
        },
    ),
    "frontiers": ("Exploration", {"dataset": HOUSES, "config": LONG, "actions": "frontier", "success_coverage": 0.95}),
    "frontiers, noise, people, dict": (
        "Exploration",
        {
            "dataset": HOUSES,
            "config": replace(LONG, noise=NOISE, people=replace(PEOPLE, number=1)),
            "observation": "dict",
            "actions": "frontier",
            "planning": PlanningConfig(frontiers=4, max_steps=9),
        },
    ),
    "frontiers, rays, navigation": (
        "Navigation",
        {
            "dataset": HOUSES,
            "config": replace(LONG, laser=LaserConfig(rule="rays")),
            "actions": "frontier",
            "planning": PlanningConfig(frontiers=3),
        },
    ),
    "navigation, all at once": (
        "Navigation",
        {
            "dataset": HUTS,
            "config": replace(
                SMALL,
                noise=NOISE,
                people=replace(PEOPLE, number=1),
                known_map=True,
                obstacles=ObstaclesConfig(random=RandomObstacles((1, 2), (0.2, 0.4))),
            ),
            "actions": "continuous",
            "observation": "dict",
        },
    ),
}


OWN_KERNELS = ("a drive with noise and people", "a differential drive", *(case for case in CASES if "frontier" in case))
"""No other quick test needs their kernels, which take ten seconds and more to compile."""


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[pytest.mark.slow] if case in OWN_KERNELS else []) for case in CASES]
)
def test_it_is_single_environments_step_by_step(case: str, mode: str) -> None:
    task, given = CASES[case]
    many, each = native(task, 5, mode, **given), singles(task, 5, mode, **given)
    found = many.reset(seed=5)
    assert_same_step(found, each.reset(seed=5), "reset")
    many.action_space.seed(1)
    rng, ends = np.random.default_rng(0), 0
    for step in range(30):
        actions = many.action_space.sample()
        if given.get("actions") == "frontier":  # mostly one that there is
            there = [int(rng.choice(np.flatnonzero(mask))) for mask in found[0]["action_mask"]]
            actions = np.where(rng.random(5) < 0.9, there, actions)
        found = many.step(actions)
        assert_same_step(found, each.step(actions), step)
        ends += int((found[2] | found[3]).sum())
    assert ends >= 4
    assert_same_step(many.reset(), each.reset(), "reset without a seed")  # their generators go on
    many.close()
    each.close()


def test_without_automatic_resets_the_caller_says_which() -> None:
    given = CASES["exploration, noise, people, dict"][1]
    many, each = native("Exploration", 4, "Disabled", **given), singles("Exploration", 4, "Disabled", **given)
    assert_same_step(many.reset(seed=[3, 1, 4, 1]), each.reset(seed=[3, 1, 4, 1]))
    moves = np.random.default_rng(0)
    for step in range(25):
        actions = moves.integers(3, size=4)
        found = many.step(actions)
        assert_same_step(found, each.step(actions), step)
        ended = found[2] | found[3]
        mask = ended | (moves.random(4) < 0.1)  # running ones may be reset, too
        if mask.any():
            options = {"reset_mask": mask, "plan_id": "large"}
            seeds = [None, 7, None, step]
            one, other = (env.reset(seed=seeds, options=dict(options)) for env in (many, each))
            assert_same_step(one, other, f"{step}, reset")
            assert (one[1]["plan_id"][mask] == "large").all()


def test_the_number_of_threads_does_not_matter() -> None:
    task, given = CASES["navigation, all at once"]
    envs = [native(task, 5, threads=threads, **given) for threads in (1, 2, 3, None)]
    starts = [env.reset(seed=4) for env in envs]
    moves = np.random.default_rng(1)
    for start in starts[1:]:
        assert_same(starts[0], start)
    for _ in range(15):
        actions = moves.uniform(-1, 1, (5, 2)).astype(np.float32)
        first, *others = [env.step(actions) for env in envs]
        for other in others:
            assert_same(first, other)
    for env in envs:
        env.close()


def test_bigger_houses_make_the_pools_grow() -> None:
    given: dict[str, Any] = {"dataset": HUTS, "config": replace(SMALL, max_steps=99), "success_coverage": None}
    many, each = native("Exploration", 3, "Disabled", **given), singles("Exploration", 3, "Disabled", **given)
    for plan_id, which in (("small", [1, 1, 1]), ("large", [0, 1, 0]), ("small", [0, 1, 0]), ("middle", [1, 0, 1])):
        options = {"plan_id": plan_id, "reset_mask": np.array(which, bool)}
        one, other = (env.reset(seed=3, options=dict(options)) for env in (many, each))
        assert_same_step(one, other, plan_id)
        for _ in range(5):
            actions = np.array([0, 1, 0])
            assert_same_step(many.step(actions), each.step(actions), plan_id)
    for i, env in enumerate(each.envs):
        assert_same(many.unwrapped.state(i).known, env.unwrapped.state.known)
