"""A map has room for all that noise moves: walls at its edge are kept as well as those inside."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import (
    Differential,
    LaserConfig,
    NoiseConfig,
    Odometry,
    RobotConfig,
    SimulatorConfig,
)
from houseexpo.pseudoslam.kernels.hashing import normal
from houseexpo.pseudoslam.kernels.mapping import OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.worlds.cache import MOST_SIGMA, load_static_world, margin_px, world_for
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS
from tests.builders.simulations import hall, wander
from tests.builders.tries import slow_but

ROOM = hall(7.0, 5.0)
TWO_ROOMS = FloorPlan(
    "two", [(0, 0), (0, 5), (9, 5), (9, 0)], 1, {}, holes=[[(4, 0.5), (4.2, 0.5), (4.2, 4.0), (4, 4.0)]]
)
DRIFTS = {
    "shares": NoiseConfig(odometry_way=0.05, odometry_turn=0.05, odometry_deg_per_m=1.0),
    "rotations": NoiseConfig(odometry_model=Odometry(0.001, 0.001, 0.001, 0.001)),
    "gyroscope": NoiseConfig(odometry_bias_deg_s=0.01),
    "slip": NoiseConfig(slip=0.01),
}


def walls_kept(noise: NoiseConfig, starts: int = 60) -> tuple[float, float]:
    """Return how many wall cells first scans draw with noise, as a share of those without: of all, and the least."""
    counts = []
    for given in (NoiseConfig(), noise):
        simulator = Simulator.of(ROOM, SimulatorConfig(noise=given))
        states = (simulator.start(np.random.default_rng(seed)) for seed in range(starts))
        counts.append([int((state.known == OBSTACLE).sum()) for state in states])
    exact, noisy = np.array(counts)
    return float(noisy.sum() / exact.sum()), float((noisy / exact).min())


@pytest.mark.parametrize(
    "noise",
    [
        NoiseConfig(registration_m=0.05),
        NoiseConfig(registration_m=0.1, registration_deg=1),
        NoiseConfig(registration_m=0.5),
    ],
)
def test_walls_at_the_edge_are_kept(noise: NoiseConfig) -> None:
    kept, least = walls_kept(noise)
    assert kept == pytest.approx(1.0, abs=0.03)
    assert least > 0.8


def test_no_draw_of_a_scan_leaves_the_map() -> None:
    noises = (
        NoiseConfig(registration_m=0.5), NoiseConfig(registration_deg=40.0), NoiseConfig(laser_m=1.0),
        NoiseConfig(max_range=0.3), NoiseConfig(laser_m=0.3, registration_m=0.3, registration_deg=5.0, max_range=0.1),
    )  # fmt: skip
    for noise in noises:
        simulator = Simulator.of(ROOM, SimulatorConfig(10.0, noise=noise))
        assert not any(simulator.start(np.random.default_rng(seed)).counts.lost for seed in range(100)), noise


def test_no_normal_draw_exceeds_its_bound() -> None:
    assert math.isclose(MOST_SIGMA, math.sqrt(-2.0 * math.log(0.5 / 2**32)))
    assert max(abs(normal(7, i)) for i in range(100_000)) < MOST_SIGMA


@pytest.mark.parametrize("motion", slow_but(["discrete", "differential"], "discrete"))
@pytest.mark.parametrize("name", slow_but(DRIFTS, "shares", "wheels, random"))
def test_drift_stays_on_the_map(name: str, motion: str) -> None:
    """Episodes as long as the margin is made for, of a robot that wanders; drives have a kernel that compiles long."""
    drive = Differential() if motion == "differential" else None
    config = SimulatorConfig(
        8.0, RobotConfig(drive=drive), LaserConfig(5.0, 180.0, 2.0), noise=DRIFTS[name], max_steps=300, step_s=0.5
    )
    simulator, rng, lost, drift = Simulator.of(TWO_ROOMS, config), np.random.default_rng(1), 0, 0.0
    for _ in range(12):
        state = simulator.start(rng)
        if drive:
            for _ in range(config.max_steps):
                turning = 1.5 * (1.0 if state.blocked else float(rng.normal(0.0, 0.3)))
                simulator.drive(state, 0.0 if state.blocked else 0.26, float(np.clip(turning, -1.8, 1.8)))
        else:
            wander(simulator, state, rng, config.max_steps)
        lost += int(state.counts.lost)
        drift = max(drift, math.dist(simulator.pose(state)[:2], simulator.believed_pose(state)[:2]))
    assert lost == 0
    assert drift > 0.05  # it did drift


def test_what_lies_beyond_the_margin_is_counted() -> None:
    config = SimulatorConfig(8.0, noise=NoiseConfig(odometry_way=0.3, odometry_turn=0.3), max_steps=2)
    simulator, rng = Simulator.of(ROOM, config), np.random.default_rng(0)
    state = simulator.start(rng)
    assert state.counts.lost == 0
    wander(simulator, state, rng, 400)
    assert state.counts.lost > 0


def test_without_noise_nothing_changes() -> None:
    config = SimulatorConfig()
    one, other = load_static_world(ROOM, config), world_for(ROOM, config)
    assert one.frame == other.frame
    assert (one.occupied == other.occupied).all()


def test_a_margin_moves_no_place() -> None:
    """Starts are the same places in metres, and what the robot can see is the same."""
    config = SimulatorConfig(10.0)
    noisy = replace(config, noise=NoiseConfig(registration_m=0.1, odometry_way=0.01))
    plain, wide = Simulator.of(ROOM, config), Simulator.of(ROOM, noisy)
    house = wide.world.inside_margin
    assert wide.world.margin_px > 5
    for name in ("occupied", "traversable", "observable"):
        assert (getattr(wide.world, name)[house] == getattr(plain.world, name)).all(), name
    assert (
        wide.world.occupied.sum() - plain.world.occupied.sum() == wide.world.occupied.size - plain.world.occupied.size
    )
    for seed in range(5):
        one, other = (s.start(np.random.default_rng(seed)) for s in (plain, wide))
        assert plain.pose(one) == pytest.approx(wide.pose(other), abs=1e-9)
        assert one.observable_cells == other.observable_cells


def test_a_known_map_has_nothing_in_the_margin() -> None:
    config = SimulatorConfig(10.0, known_map=True, noise=NoiseConfig(registration_m=0.1))
    simulator = Simulator.of(ROOM, config)
    state = simulator.start(np.random.default_rng(0))
    margin = simulator.world.margin_px
    assert (state.known[: margin // 2] == UNKNOWN).all()
    assert state.counts.known >= (simulator.world.occupied.shape[0] - 2 * margin) ** 2


def test_a_margin_is_bounded() -> None:
    """By the house's diagonal and by the largest grid."""
    wild = NoiseConfig(odometry_turn=1.0, odometry_way=1.0)
    config = SimulatorConfig(10.0, noise=wild, max_steps=10**6)
    assert margin_px(config, 60, 80) == 101
    rows = math.isqrt(MAX_WORLD_CELLS) - 10
    assert margin_px(config, rows, rows) == 5
    assert margin_px(config, rows + 20, rows) == 0
