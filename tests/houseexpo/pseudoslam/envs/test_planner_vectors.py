"""Planners' actions in vector environments are those in single ones, to the last bit."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from tests.builders.simulations import HUTS, assert_same, assert_same_step, hut, native, singles

pytestmark = pytest.mark.slow  # the kernels of planners' actions take half a minute to compile

NOISE = NoiseConfig(0.02, 0.01, 0.2, 0.05, 0.05, 1.0, 0.05, 0.02)
SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=32), max_steps=60)
HOUSES = [*HUTS, hut("hall", 9.0)]
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "frontiers": (
        "Exploration",
        {"dataset": HOUSES, "config": SMALL, "actions": "frontier", "success_coverage": 0.95},
    ),
    "frontiers, noise, people, dict": (
        "Exploration",
        {
            "dataset": HOUSES,
            "config": replace(SMALL, noise=NOISE, people=PeopleConfig(1, speed_m_s=1.0, away_m=0.5)),
            "observation": "dict",
            "actions": "frontier",
            "planning": PlanningConfig(frontiers=4, max_steps=9),
        },
    ),
    "frontiers, rays, navigation": (
        "Navigation",
        {
            "dataset": HOUSES,
            "config": replace(SMALL, laser=LaserConfig(rule="rays")),
            "actions": "frontier",
            "planning": PlanningConfig(frontiers=3),
        },
    ),
}


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("case", CASES)
def test_it_is_single_environments_action_by_action(case: str, mode: str) -> None:
    task, given = CASES[case]
    many, each = native(task, 4, mode, **given), singles(task, 4, mode, **given)
    first = many.reset(seed=5)
    assert_same_step(first, each.reset(seed=5), "reset")
    many.action_space.seed(1)
    rng = np.random.default_rng(0)
    observation, ends = first[0], 0
    for step in range(30):
        actions = many.action_space.sample()
        if "action_mask" in observation:  # mostly ones that there are
            masks = observation["action_mask"].astype(bool)
            chosen = [int(rng.choice(np.flatnonzero(mask))) for mask in masks]
            actions = np.where(rng.random(4) < 0.9, chosen, actions)
        found = many.step(actions)
        assert_same_step(found, each.step(actions), step)
        observation = found[0]
        ends += int((found[2] | found[3]).sum())
    assert ends >= 4
    many.close()
    each.close()


def test_the_number_of_threads_does_not_matter() -> None:
    task, given = CASES["frontiers"]
    envs = [native(task, 5, threads=threads, **given) for threads in (1, 2, None)]
    starts = [env.reset(seed=4) for env in envs]
    for start in starts[1:]:
        assert_same(starts[0], start)
    for k in range(12):
        first, *others = [env.step(np.full(5, k % 3)) for env in envs]
        for other in others:
            assert_same_step(first, other, k)
    for env in envs:
        env.close()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])  # noqa: S301
def test_a_copy_goes_on_from_the_same_step(copied: Any) -> None:
    task, given = CASES["frontiers"]
    env = native(task, 3, **given)
    env.reset(seed=2)
    env.step(np.array([0, 1, 0]))
    other = copied(env)
    for k in range(10):
        assert_same_step(env.step(np.full(3, k % 2)), other.step(np.full(3, k % 2)), k)
    env.close()
    other.close()


def test_masks_are_told_as_sb3_contrib_asks() -> None:
    task, given = CASES["frontiers"]
    env = native(task, 3, "SameStep", **given)
    observation, _ = env.reset(seed=0)
    masks = env.unwrapped.action_masks()
    assert masks.dtype == bool
    assert np.array_equal(masks, observation["action_mask"].astype(bool))
    assert all(np.array_equal(env.unwrapped.action_masks(i), masks[i]) for i in range(3))
    assert all(map(np.array_equal, env.unwrapped.call("action_masks"), masks))
    env.close()
