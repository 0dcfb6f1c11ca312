"""What clients need: masks of the discrete motions, from the robot's own map; maps as floats; infos without texts."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import NoiseConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.kernels.collision import free_distance, step_is_free
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from tests.builders.simulations import HUTS, assert_same, native, singles

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=60)
GIVEN: dict[str, Any] = {"dataset": HUTS, "config": SMALL, "success_coverage": None}


def single(**given: Any) -> gymnasium.Env:
    return gymnasium.make("PseudoSLAM/Exploration-v0", **{**GIVEN, **given}).unwrapped


def test_a_step_fits_if_no_obstacle_of_the_map_is_in_its_way() -> None:
    rng = np.random.default_rng(0)
    fits = []
    for _ in range(300):
        known = rng.choice(np.array([UNKNOWN, FREE, OBSTACLE], np.uint8), (30, 24), p=[0.3, 0.685, 0.015])
        x, y, heading, distance = *rng.uniform(4, 20, 2), rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 9)
        walls = (known == OBSTACLE).astype(np.uint8)
        way = free_distance(walls, x, y, np.cos(heading), -np.sin(heading), distance, 3.2)
        fits.append(step_is_free(known, x, y, heading, distance, 3.2))
        assert fits[-1] == (way == distance)
    assert 0.2 < np.mean(fits) < 0.8


def test_forward_is_forbidden_exactly_where_it_collides() -> None:
    """Without noise, all that can be in the way has been seen: the laser looks ahead."""
    env, rng = single(), np.random.default_rng(0)
    found = []
    for episode in range(4):
        env.reset(seed=episode)
        for _ in range(60):
            masks, action = env.action_masks(), int(rng.choice(3, p=[0.6, 0.2, 0.2]))
            assert masks[1:].all()
            collided = env.step(action)[4]["collided"]
            if action == 0:
                found.append((masks[0], collided))
    assert {(bool(allowed), collided) for allowed, collided in found} == {(True, False), (False, True)}


@pytest.mark.parametrize("more", [{}, {"observation": "dict"}, {"observation": "scales"}, {"layout": "HWC"}])
def test_the_mask_is_a_part_of_the_observation_where_it_is_asked_for(more: dict[str, Any]) -> None:
    env, plain = single(action_mask=True, **more), single(**more)
    space = env.observation_space
    assert space["action_mask"] == gymnasium.spaces.MultiBinary(3)
    seen, same = env.reset(seed=3)[0], plain.reset(seed=3)[0]
    for _ in range(30):
        assert seen in space
        assert seen["action_mask"].tolist() == env.action_masks().tolist()
        rest = {key: part for key, part in seen.items() if key != "action_mask"}
        assert_same(rest, same if isinstance(same, dict) else {"map": same})
        seen, same = env.step(0)[0], plain.step(0)[0]


@pytest.mark.parametrize("noise", [NoiseConfig(), NoiseConfig(laser_m=0.03, odometry_way=0.1)])
def test_single_and_vector_environments_agree(noise: NoiseConfig) -> None:
    config = SimulatorConfig(
        pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=20, noise=noise, people=PeopleConfig(1)
    )
    given = {**GIVEN, "config": config, "action_mask": True}
    many, alone = native("Exploration", 3, **given), singles("Exploration", 3, **given)
    one, other = many.reset(seed=5)[0], alone.reset(seed=5)[0]
    rng = np.random.default_rng(1)
    for _ in range(45):
        assert_same(one, other)
        assert np.array_equal(many.unwrapped.action_masks(), one["action_mask"].astype(bool))
        assert np.array_equal(many.unwrapped.action_masks(1), one["action_mask"][1].astype(bool))
        actions = rng.choice(3, 3, p=[0.7, 0.15, 0.15])
        one, other = many.step(actions)[0], alone.step(actions)[0]


@pytest.mark.parametrize(
    "more",
    [
        {"actions": "continuous"},
        pytest.param({"motion": "differential"}, marks=pytest.mark.slow),
    ],
)
def test_actions_without_numbers_have_no_mask(more: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="action_mask: expected actions="):
        single(action_mask=True, **more)
    env = single(**more)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="action_masks: expected actions="):
        env.action_masks()


@pytest.mark.parametrize("actions", ["discrete", pytest.param("frontier", marks=pytest.mark.slow)])
def test_infos_hold_numbers_only_where_that_is_asked_for(actions: str) -> None:
    given = {**GIVEN, "actions": actions, "text_info": False}
    envs, plain = (
        native("Exploration", 2, "SameStep", **given),
        native("Exploration", 2, **{**given, "text_info": True}),
    )
    infos, more = envs.reset(seed=0)[1], plain.reset(seed=0)[1]
    texts = {"plan_id", "outcome"} & set(more)
    assert set(more) - set(infos) == texts | {f"_{key}" for key in texts}
    final: dict[str, Any] = {}
    while not final:
        infos = envs.step(np.ones(2, np.int64))[4]
        assert not texts & set(infos)
        final = infos.get("final_info", {})
    assert {part.dtype.kind for part in final.values()} <= set("bif")
    env = single(actions=actions, text_info=False)
    assert not texts & set(env.reset(seed=0)[1])
    assert not texts & set(env.step(0)[4])


@pytest.mark.parametrize("more", [{}, {"observation": "dict"}, {"observation": "scales", "layout": "HWC"}])
def test_maps_are_floats_where_that_is_asked_for(more: dict[str, Any]) -> None:
    env, plain = single(float_maps=True, **more), single(**more)
    many = native("Exploration", 2, **GIVEN, float_maps=True, **more)
    seen, same, both = (each.reset(seed=2)[0] for each in (env, plain, many))
    for _ in range(3):
        assert seen in env.observation_space
        assert both in many.observation_space
        if not isinstance(seen, dict):
            seen, same, both = {"map": seen}, {"map": same}, {"map": both}
        for name in {"map", "global_map"} & seen.keys():
            assert seen[name].dtype == np.float32
            assert seen[name].max() == 1.0
            assert np.array_equal(np.rint(seen[name] * 255.0), same[name])
            assert np.array_equal(both[name][0], seen[name])
        seen, same, both = env.step(0)[0], plain.step(0)[0], many.step([0, 0])[0]
