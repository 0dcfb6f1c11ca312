"""What can be shown instead of the plain view: other sizes in pixels, several scales, channels last, presets."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import (
    GoalConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.config.simulator import PRESETS
from houseexpo.pseudoslam.envs.pictures import Pictures
from houseexpo.pseudoslam.kernels.mapping import draw_coarse_view
from tests.builders.simulations import HUTS, assert_same_step, native, singles

FREE, OBSTACLE = 127, 255
VIEW = ObservationConfig(4.0, global_size_m=24.0, pixels=40, far_size_m=12.0)
SMALL = SimulatorConfig(pixels_per_metre=20.0, observation=VIEW, max_steps=7)


def one(task: str = "Exploration", config: Any = SMALL, **given: Any) -> Any:
    return gymnasium.make(f"PseudoSLAM/{task}-v0", dataset=HUTS, config=config, **given)


@pytest.mark.parametrize("observation", ["map", "dict", "scales"])
@pytest.mark.parametrize("layout", ["CHW", "HWC"])
@pytest.mark.parametrize("task", ["Exploration", "Navigation"])
def test_gymnasium_finds_nothing_wrong(task: str, layout: str, observation: str) -> None:
    check_env(one(task, layout=layout, observation=observation).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("observation", ["map", "dict"])
def test_channels_last_are_the_same_maps(observation: str) -> None:
    for config in (SMALL, replace(SMALL, observation=ObservationConfig(3.0))):
        first, last = (one(config=config, observation=observation, layout=layout) for layout in ("CHW", "HWC"))
        seen, its = first.reset(seed=2)[0], last.reset(seed=2)[0]
        for key in ("map", "global_map") if observation == "dict" else (None,):
            chw, hwc = (seen, its) if key is None else (seen[key], its[key])
            assert np.array_equal(chw.transpose(1, 2, 0), hwc)
            assert hwc.shape[-1] == 1


def test_pixels_may_be_fewer_than_cells_and_keep_the_walls() -> None:
    env = one()
    env.reset(seed=1)
    observation, *_ = env.step(1)
    state, expected = env.unwrapped.state, np.empty((40, 40), np.uint8)
    x, y, heading = state.believed_px
    draw_coarse_view(state.known, x, y, math.cos(heading), math.sin(heading), 4.0 * 20 / 40, expected)
    assert observation.shape == (1, 40, 40)
    assert np.array_equal(observation[0], expected)
    assert {0, FREE, OBSTACLE} == set(np.unique(observation).tolist())


def test_several_scales_show_near_far_and_the_whole_map() -> None:
    """In the hut of 7.2 x 4.5 m, from (2, 1.5) heading right."""
    config = replace(SMALL, start=StartConfig(random=False, x_m=2.0, y_m=1.5), laser=replace(SMALL.laser, range_m=9.0))
    env = one("Navigation", replace(config, goal=GoalConfig(False, 6.0, 3.0)), observation="scales")
    env.reset(seed=0, options={"plan_id": "middle"})
    shown, *_, info = env.step(0)
    assert shown.shape == (5, 40, 40)
    assert info["pose"] == pytest.approx([2.3, 1.5, 0.0])
    near, far, whole, robot, goal = shown
    for picture, size_m in ((near, 4.0), (far, 12.0)):
        metre = 40 / size_m
        wall = np.flatnonzero((picture == OBSTACLE).any(axis=0))  # heading up: the wall below is on the right
        assert wall.max() == pytest.approx(20 + 1.5 * metre, abs=1.5)
    assert np.flatnonzero((far == OBSTACLE).any(axis=1)).min() == pytest.approx(20 - 4.9 * 40 / 12, abs=1.5)
    metre = 40 / 24  # the whole map stands round the start, the plan's x to the right
    rows, cols = np.nonzero(whole == OBSTACLE)
    assert (cols.min(), cols.max()) == pytest.approx((20, 20 + 5.2 * metre), abs=1.5)  # what lies behind is not seen
    assert (rows.min(), rows.max()) == pytest.approx((20 - 3 * metre, 20 + 1.5 * metre), abs=1.5)
    assert np.argwhere(robot == OBSTACLE).mean(axis=0) == pytest.approx([19.5, 19.5 + 0.3 * metre], abs=0.6)
    assert np.argwhere(robot == FREE).mean(axis=0)[1] > np.argwhere(robot == OBSTACLE).mean(axis=0)[1] + 1
    assert np.argwhere(goal).mean(axis=0) == pytest.approx([19.5 - 1.5 * metre, 19.5 + 4 * metre], abs=0.6)


def test_marks_lie_where_odometry_has_the_robot() -> None:
    noise = NoiseConfig(odometry_way=0.5, odometry_turn=0.5)
    env = one(config=replace(SMALL, noise=noise, max_steps=99), observation="scales")
    env.reset(seed=3)
    for step in range(60):
        shown, *_ = env.step([0, 0, 1][step % 3])
    state = env.unwrapped.state
    start, pixel = state.episode.readings[0], 24.0 * 20 / 40
    believed = 19.5 + (state.believed_px[:2] - (start.start_x, start.start_y)) / pixel
    assert np.hypot(*(state.believed_px - state.pose_px)[:2]) > 2 * pixel / 3
    assert np.argwhere(shown[3] == OBSTACLE).mean(axis=0)[::-1] == pytest.approx(believed, abs=0.6)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize(
    "given",
    [
        {"observation": "scales"},
        {"observation": "scales", "layout": "HWC", "task": "Navigation"},
        {"observation": "dict"},
        pytest.param(
            {"observation": "scales", "actions": "frontier", "reward": "coverage", "cost_per_metre": 0.01},
            marks=pytest.mark.slow,
        ),
        {"config": replace(SMALL, observation=ObservationConfig(3.0)), "observation": "scales"},
    ],
)
def test_vector_environments_show_what_single_ones_do(mode: str, given: dict[str, Any]) -> None:
    given = {"dataset": HUTS, "config": SMALL, **given}
    task = given.pop("task", "Exploration")
    ours, theirs = native(task, 3, mode, threads=2, **given), singles(task, 3, mode, **given)
    assert_same_step(ours.reset(seed=4), theirs.reset(seed=4))
    moves = np.random.default_rng(0)
    for step in range(20):
        actions = moves.integers(3, size=3)  # of frontiers too: there are 16
        assert_same_step(ours.step(actions), theirs.step(actions), step)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])  # noqa: S301
def test_a_copy_is_shown_the_same(copied: Any) -> None:
    env = native("Exploration", 2, "SameStep", dataset=HUTS, config=SMALL, observation="scales")
    env.reset(seed=0)
    env.step(np.zeros(2, np.int64))
    other = copied(env)
    for step in range(9):
        actions = np.array([step % 3, 1])
        assert_same_step(env.step(actions), other.step(actions), step)


def test_views_are_the_same_memory_where_nobody_wants_copies() -> None:
    env = native("Exploration", 2, dataset=HUTS, config=SMALL, observation="scales", copy=False)
    first, _ = env.reset(seed=0)
    second, *_ = env.step(np.ones(2, np.int64))
    assert np.shares_memory(first, second)
    kept = native("Exploration", 2, dataset=HUTS, config=SMALL, observation="scales")
    first, _ = kept.reset(seed=0)
    before = first.copy()
    second, *_ = kept.step(np.ones(2, np.int64))
    assert np.array_equal(first, before)
    assert not np.shares_memory(first, second)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_have_names(name: str) -> None:
    env, preset = one(config=name), PRESETS[name]
    laser, view = env.unwrapped.config.laser, env.unwrapped.config.observation
    assert (laser.range_m, laser.fov_deg, view.size_m) == (preset.range_m, preset.fov_deg, preset.size_m or 4.0)
    observation, _ = env.reset(seed=0)
    side = preset.pixels or 100
    assert observation.shape == (1, side, side)
    assert observation in env.observation_space
    if preset.fov_deg == 360:  # what lies behind is seen from the start
        assert (observation[0, side // 2 + 2 :] != 0).any()


def test_a_preset_keeps_the_rest_of_the_tasks_configuration() -> None:
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0", config="round-10m").unwrapped
    assert env.config.obstacles.random is not None
    assert env.config.pixels_per_metre == 33.0


@pytest.mark.parametrize(("task", "view_m"), [("Exploration", 4.0), ("ObstacleAvoidance", 3.0)])
def test_the_papers_preset_is_the_setting_of_its_experiments(task: str, view_m: float) -> None:
    given = {"dataset": HUTS} if task == "Exploration" else {}
    env = gymnasium.make(f"PseudoSLAM/{task}-v0", config="paper", **given).unwrapped
    config = env.config
    assert (config.laser.range_m, config.laser.fov_deg, config.observation.size_m) == (5.0, 180.0, view_m)
    assert config.max_steps == 200
    env.reset(seed=0)
    for step in range(1, 201):  # it ends neither at 95% nor by a collision
        *_, terminated, truncated, _ = env.step([0, 1, 0][step % 3])
        assert (terminated, truncated) == (False, step == 200)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            {"observation": "scales", "config": replace(SMALL, observation=ObservationConfig(4.0, far_size_m=4.0))},
            r"observation.far_size_m: expected more than size_m, 4, for several scales, found 4",
        ),
        ({"config": "wide"}, "config: expected a SimulatorConfig or one of paper, view-10m, .* found 'wide'"),
    ],
)
def test_what_there_is_not_is_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        one(**given)


@pytest.mark.parametrize("pixels", [1, 2.5, "64", True])
def test_a_number_of_pixels_is_a_whole_number(pixels: Any) -> None:
    with pytest.raises(ConfigError, match=r"observation\.pixels: expected a whole number of at least 2"):
        ObservationConfig(pixels=pixels)


def test_whole_numbers_have_no_kernel_compiled_once_more() -> None:
    view = ObservationConfig(4, global_size_m=24, far_size_m=12)
    whole = SimulatorConfig(
        pixels_per_metre=20, robot=RobotConfig(radius_m=1), observation=view, goal=GoalConfig(radius_m=1)
    )
    scales = Pictures(1, whole, several=True)._scales
    assert {type(value) for value in scales} == {float}
