"""The scan by rays draws the published simulator's map, cell by cell; ``test_corrected`` has what departs from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from houseexpo.floorplan import decode
from houseexpo.pseudoslam.config import LaserConfig, ObservationConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from tests.builders.scans import BLOCKED, OPEN, UNCERTAIN, PublishedMap, crop_ties, slow_crop

RESOLUTIONS = (10.0, 16.0, 25.0, 40.0)
ROBOTS = (RobotConfig(), RobotConfig(step_m=0.7, turn_deg=25.0), RobotConfig(step_m=0.05, turn_deg=3.0))


def in_its_values(known: np.ndarray) -> np.ndarray:
    """0, 127 and 255 as the published simulator has them."""
    values = np.full(256, 1)
    values[[0, 127, 255]] = UNCERTAIN, OPEN, BLOCKED
    return values[known]


def pose(state: State) -> tuple[float, float, float]:
    x, y, heading = state.pose_px.tolist()
    return x, y, heading


def follow(line: bytes, pixels_per_metre: float, seed: int, steps: int) -> None:
    """Run both side by side for some steps, forward mostly, turning where blocked."""
    config = SimulatorConfig(
        pixels_per_metre=pixels_per_metre,
        laser=LaserConfig(rule="rays", range_m=(5.0, 2.0)[seed % 2], resolution_deg=(0.7, 1.0)[seed % 2]),
        robot=ROBOTS[seed % 3],
        observation=ObservationConfig(size_m=(4.0, 6.99)[seed % 2]),
    )
    simulator, rng = Simulator.of(decode(line), config), np.random.default_rng(seed)
    state = simulator.start(rng)
    published = PublishedMap(simulator.world.occupied, config)
    published.look(pose(state))
    for _ in range(steps):
        assert np.array_equal(in_its_values(state.known), published.known)
        shown = slow_crop(state.known, *pose(state), published.side)
        differ = state.view != shown
        assert not (differ & ~crop_ties(*pose(state), published.side)).any()
        before, area = pose(state), simulator.explored_m2(state)
        turn = state.blocked or rng.random() < 0.3
        simulator.step(state, ("left", "right")[int(rng.integers(2))] if turn else "forward")
        reward = published.move(before, pose(state))
        assert simulator.explored_m2(state) - area == pytest.approx(reward, abs=1e-9)
    assert np.array_equal(in_its_values(state.known), published.known)
    assert (published.known != UNCERTAIN).any()


def test_the_map_is_the_published_one_on_published_plans(published_lines: Sequence[bytes]) -> None:
    for i, line in enumerate(published_lines[:12]):
        follow(line, RESOLUTIONS[i % 4], seed=i, steps=12)


@pytest.mark.slow
@pytest.mark.parametrize("pixels_per_metre", RESOLUTIONS)
def test_the_map_is_the_published_one_on_200_plans(published_lines: Sequence[bytes], pixels_per_metre: float) -> None:
    for i, line in enumerate(published_lines[:200]):
        follow(line, pixels_per_metre, seed=i, steps=20 if pixels_per_metre < 20 else 8)


def test_a_turn_through_half_a_circle_is_seen_all_the_way(published_lines: Sequence[bytes]) -> None:
    config = SimulatorConfig(16.0, RobotConfig(turn_deg=170.0), LaserConfig(rule="rays", fov_deg=30.0))
    simulator = Simulator.of(decode(published_lines[1]), config)
    state = simulator.start(np.random.default_rng(0))
    published = PublishedMap(simulator.world.occupied, config)
    published.look(pose(state))
    for _ in range(3):
        before = pose(state)
        simulator.step(state, "left")
        published.move(before, pose(state))
        assert np.array_equal(in_its_values(state.known), published.known)
    assert state.counts[4] == 1 + 3 * 17
