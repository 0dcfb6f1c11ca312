"""Pictures and overviews that are kept from step to step are those that are drawn anew from the whole map."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.envs.pictures import picture_scales
from houseexpo.pseudoslam.envs.slam_env import SlamEnv
from houseexpo.pseudoslam.kernels.mapping import draw_coarse_view, draw_overview
from houseexpo.pseudoslam.state import State

TWO_ROOMS = FloorPlan(
    "two", [(0, 0), (0, 7), (11, 7), (11, 0)], 1, {}, holes=[[(4, 0.5), (4.2, 0.5), (4.2, 5.5), (4, 5.5)]]
)
VIEW = ObservationConfig(5.0, global_size_m=15.0, global_cells=40, pixels=30, far_size_m=9.0)
PLAIN = SimulatorConfig(16.0, observation=VIEW)
CASES: dict[str, tuple[SimulatorConfig, dict[str, Any]]] = {
    "pixels": (PLAIN, {}),
    "scales": (PLAIN, {"observation": "scales"}),
    "dict": (PLAIN, {"observation": "dict"}),
    "near cell by cell": (replace(PLAIN, observation=replace(VIEW, pixels=None)), {"observation": "scales"}),
    "rays": (replace(PLAIN, laser=LaserConfig(rule="rays")), {"observation": "scales"}),
    "noise": (
        replace(PLAIN, noise=NoiseConfig(laser_m=0.05, registration_m=0.1, registration_deg=3.0, odometry_way=0.1)),
        {"observation": "scales"},
    ),
    "noise, dict": (replace(PLAIN, noise=NoiseConfig(registration_m=0.1, max_range=0.1)), {"observation": "dict"}),
    "people": (replace(PLAIN, people=PeopleConfig(2)), {"observation": "scales"}),
    "known map": (replace(PLAIN, known_map=True), {"observation": "scales"}),
    "known map, dict": (replace(PLAIN, known_map=True), {"observation": "dict"}),
}


def expected(state: State, config: SimulatorConfig, kind: str) -> dict[str, np.ndarray]:
    scales, view, start = picture_scales(config), config.observation, state.episode.readings[0]
    x, y, heading = state.believed_px.tolist()
    side = view.pixels or config.side_px
    out = np.zeros((3, side, side), np.uint8)
    cos, sin = math.cos(heading), math.sin(heading)
    draw_coarse_view(state.known, x, y, cos, sin, scales.near_px, out[0])
    draw_coarse_view(state.known, x, y, cos, sin, scales.far_px, out[1])
    draw_coarse_view(state.known, start.start_x, start.start_y, 0.0, 1.0, scales.whole_px, out[2])
    overview, (rows, cols) = np.zeros((view.global_cells,) * 2, np.uint8), state.known.shape
    side_px = view.global_size_m / view.global_cells * config.pixels_per_metre
    draw_overview(state.known, start.start_x, start.start_y, side_px, np.array([0, rows, 0, cols]), overview)
    first = 0 if view.pixels else 1  # cell by cell it is another kernel
    return {"map": out[first:] if kind == "scales" else out[first:1], "global_map": overview[None]}


def shown(seen: Any, kind: str, config: SimulatorConfig) -> dict[str, np.ndarray]:
    parts = seen if isinstance(seen, dict) else {"map": seen}
    first = 0 if config.observation.pixels else 1
    maps = {"map": parts["map"][first : 3 if kind == "scales" else 1]}
    return maps | ({"global_map": parts["global_map"]} if kind == "dict" else {})


@pytest.mark.slow  # each kernel is compiled
@pytest.mark.parametrize("name", CASES)
def test_what_is_kept_is_what_is_drawn_anew(name: str) -> None:
    config, given = CASES[name]
    kind = given.get("observation", "map")
    env: Any = gymnasium.make(
        "PseudoSLAM/Exploration-v0", dataset=TWO_ROOMS, config=config, success_coverage=None, **given
    )
    many: Any = gymnasium.make_vec(
        "PseudoSLAM/Exploration-v0", 2, dataset=TWO_ROOMS, config=config, success_coverage=None, **given
    )
    rng = np.random.default_rng(0)
    for seed in (0, 1, 2):  # later episodes begin with empty maps
        seen, _ = env.reset(seed=seed)
        both, _ = many.reset(seed=seed)
        for _ in range(40):
            wanted = expected(env.unwrapped.state, env.unwrapped.config, kind)
            for key, one in shown(seen, kind, config).items():
                assert np.array_equal(one, wanted[key]), key
            for i in range(2):
                state = many.unwrapped.state(i)
                part = {key: value[i] for key, value in (both if isinstance(both, dict) else {"map": both}).items()}
                for key, one in shown(part, kind, config).items():
                    assert np.array_equal(one, expected(state, config, kind)[key]), key
            action = int(rng.choice([0, 0, 0, 1, 2]))
            seen, *_ = env.step(action)
            both, *_ = many.step(np.array([action, 0]))


@pytest.mark.slow
def test_the_view_of_a_slams_map_is_that_of_its_map() -> None:
    config = replace(PLAIN, laser=LaserConfig(5.0, 180.0, 0.5), noise=NoiseConfig(odometry_way=0.02))
    env = SlamEnv(TWO_ROOMS, config, success_coverage=None)
    seen, _ = env.reset(seed=0)
    for action in [0, 0, 1, 1, 0, 0]:
        assert np.array_equal(np.asarray(seen), expected(env.state, env.config, "map")["map"])
        seen, *_ = env.step(action)


@pytest.mark.slow
def test_an_episode_in_the_house_of_the_last_one_is_one_in_a_new_environment() -> None:
    """Its rasters are not copied again, and its map is cleared only where the last one was drawn."""
    kwargs = {"dataset": TWO_ROOMS, "config": PLAIN, "success_coverage": None}
    used: Any = gymnasium.make("PseudoSLAM/Exploration-v0", **kwargs).unwrapped
    many: Any = gymnasium.make_vec("PseudoSLAM/Exploration-v0", 2, **kwargs).unwrapped
    used.reset(seed=5)
    many.reset(seed=5)
    for _ in range(30):
        used.step(0)
        many.step(np.array([0, 1]))
    used.reset(seed=9)
    many.reset(seed=9)
    fresh: Any = gymnasium.make("PseudoSLAM/Exploration-v0", **kwargs).unwrapped
    fresh.reset(seed=9)
    for state in (used.state, many.state(0)):
        for name in ("occupied", "observable", "known"):
            assert np.array_equal(getattr(state.episode, name), getattr(fresh.state.episode, name)), name
