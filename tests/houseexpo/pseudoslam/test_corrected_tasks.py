"""What the original simulator gets wrong and ours does not, from its rewards on (numbers 8 to 13)."""

from __future__ import annotations

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
    LaserConfig,
    SimulatorConfig,
)
from houseexpo.pseudoslam.worlds.world import make_world
from tests.builders.simulations import PLAIN, at, started


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
