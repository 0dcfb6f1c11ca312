"""What the original simulator gets wrong and ours does not, from its rewards on (numbers 8 to 13 of the list)."""

from __future__ import annotations

import math
import mmap
import resource
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.floorplan import decode
from houseexpo.pseudoslam.config import (
    GoalConfig,
    LaserConfig,
    ObservationConfig,
    SimulatorConfig,
)
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.worlds.world import make_world
from tests.builders.scans import slow_rays
from tests.builders.simulations import PLAIN, at, hall, started


def make(task: str, **other: Any) -> gymnasium.Env:
    return gymnasium.make(f"PseudoSLAM/{task}-v0", **other)


@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_8_no_reward_is_negative(published_lines: list[bytes], rule) -> None:
    """There: it counts a picture with the robot painted on it, and 3 to 8% of the rewards are."""
    config = SimulatorConfig(16.0, laser=LaserConfig(rule=rule), max_steps=300)
    env = make("Exploration", dataset=decode(published_lines[2]), config=config, success_coverage=None)
    _, info = env.reset(seed=0)
    start, rewards, rng = info["explored_m2"], [], np.random.default_rng(0)
    for _ in range(300):
        _, reward, *_, info = env.step(1 if info["collided"] or rng.random() < 0.2 else 0)
        rewards.append(reward)
    assert min(rewards) == 0.0
    assert sum(rewards) == pytest.approx(info["explored_m2"] - start)


def test_9_navigation_ends_at_a_goal_that_it_is_paid_for() -> None:
    """There: every step of the navigation mode says done, and there is no goal."""
    goal = GoalConfig(random=False, x_m=6.0, y_m=2.0)
    config = replace(at(1.0, 2.0, 0.0), goal=goal, known_map=True)
    env = make("Navigation", dataset=hall(), config=config)
    env.reset(seed=0)
    rewards, ends = [], []
    for _ in range(16):
        _, reward, terminated, *_, info = env.step(0)
        rewards.append(reward)
        ends.append(terminated)
    assert ends == [False] * 15 + [True]  # 4.8 of 5 m, within 0.3
    assert rewards[:15] == pytest.approx([0.3] * 15, abs=0.02)
    assert rewards[15] == pytest.approx(0.3 + 2.5, abs=0.02)
    assert info["spl"] == pytest.approx(1.0)


def test_9_avoidance_pays_for_what_is_new_and_for_motion_and_fines_collisions() -> None:
    """There: the paper's reward exists nowhere in the code."""
    config = at(1.0, 2.0, 0.0, SimulatorConfig(33.0, observation=ObservationConfig(3.0)))
    env = make("ObstacleAvoidance", dataset=hall(4.0, 4.0), config=config)
    env.reset(seed=0)
    rewards = []
    for action in [0] * 10 + [1] * 18:
        _, reward, *_, info = env.step(action)
        rewards.append(reward)
        if len(rewards) == 10:
            driven_m2 = info["explored_m2"]
    assert rewards[:6] == pytest.approx([0.1] * 6)  # going forward in what is known already
    assert rewards[9] == -1.0
    shown_m2 = info["explored_m2"] - driven_m2
    assert shown_m2 > 0.0
    assert sum(rewards[10:]) == pytest.approx(0.9 * shown_m2)  # what turns show, and nothing for going forward


def test_10_every_cell_of_an_open_sector_is_decided_and_diagonal_walls_hold() -> None:
    """There: 15% of the sector lies between rays, and one looks through where two cells share a corner."""
    open_floor = hall(14.0, 14.0)
    states = [
        started(at(7.0, 7.0, 90.0, replace(PLAIN, laser=LaserConfig(rule=rule))), open_floor)[1]
        for rule in ("sector", "rays")
    ]
    rows, cols = np.mgrid[:352, :352]
    x, y, _ = states[0].pose_px
    sector = (np.hypot(cols + 0.5 - x, rows + 0.5 - y) <= 125) & (rows + 0.5 <= y)
    assert (states[0].known[sector] == 127).all()
    assert (states[1].known[sector] == 127).mean() < 0.9
    world = make_world(open_floor, 25.0, 0.2, 5.0)
    occupied = world.occupied.copy()
    occupied[np.arange(352), np.arange(352)] = 1
    simulator = Simulator(replace(world, occupied=occupied), at(9.0, 9.0, -135.0))
    state = simulator.start(np.random.default_rng(0))
    assert (state.known[cols < rows] == 0).all()
    assert (state.known[cols > rows] == 127).sum() > 5000
    leaks, _ = slow_rays(occupied, *state.pose_px, math.pi, math.radians(0.7), 125.0)
    assert any(col < row for row, col in leaks)


def test_10_inside_an_obstacle_nothing_is_seen() -> None:
    """There: it sees through everything."""
    simulator, state, _ = started(at(4.0, 2.0, 0.0))
    state.known[:] = 0
    state.occupied[45:55, 95:105] = 1
    simulator.move(state, 0.0, 0.0)
    assert not state.known.any()


def test_11_seeds_decide_and_plans_never_run_out() -> None:
    """There: the global state is seeded with 0, ``seed`` does nothing, and plans taken in order run out."""
    plans = [replace(hall(3.0 + k), id=f"hall-{k}") for k in range(3)]
    env = make("Exploration", dataset=plans)

    def first(seed: int) -> bytes:
        np.random.seed(0)  # noqa: NPY002  # what is global has no say
        observation, info = env.reset(seed=seed)
        return observation.tobytes() + info["pose"].tobytes()

    assert first(1) == first(1) != first(2)
    assert {env.reset()[1]["plan_id"] for _ in range(40)} == {"hall-0", "hall-1", "hall-2"}


def test_12_thin_walls_survive_at_a_coarse_grid() -> None:
    """There: a picture is shrunk, and a wall of 0.1 m has gaps or is gone at 16 px/m."""
    for x in np.arange(2.0, 2.1, 0.01).round(2).tolist():
        verts = [(0, 0), (0, 3), (x, 3), (x, 0.9), (x + 0.1, 0.9), (x + 0.1, 3), (4, 3), (4, 0)]
        world = make_world(FloorPlan("wall", verts, 1, {}), 16.0, 0.2, 5.0)
        assert world.occupied[1:34, 30:38].any(axis=1).all()
        assert world.occupied[1:34, 30:38].sum(axis=1).max() <= 2


@pytest.mark.skipif(not hasattr(mmap, "MADV_NOHUGEPAGE"), reason="counts pages, as Linux has them")
@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_13_a_step_touches_what_is_near_and_not_the_map(rule) -> None:
    """There: each step copies, dilates and counts the whole map.

    On fresh memory the system counts each page that is touched; a row of this map is a page and a half.
    """
    simulator, state, _ = started(at(4.0, 2.0, 0.0, replace(PLAIN, laser=LaserConfig(rule=rule))))
    simulator.move(state, 0.1, 0.1)
    side = 6000
    touched = []
    for _ in range(2):
        occupied, observable, known = (fresh_grid(side) for _ in range(3))
        episode = state.copy().episode._replace(occupied=occupied, observable=observable, known=known)
        episode.pose.view(np.float64)[:] = np.tile((side / 2, side / 2, 0.5), 2)
        far = replace(state, episode=episode)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        simulator.move(far, 0.1, 0.1)
        touched.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
        assert (known[2860:3140, 2860:3140] != 0).sum() == (known != 0).sum() > 20_000
    assert 200 < min(touched) < 3 * 2 * 270  # of 26,000


def fresh_grid(side: int) -> np.ndarray:
    """Zeros that no one has touched."""
    memory = mmap.mmap(-1, side * side)
    memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(memory, np.uint8).reshape(side, side)
