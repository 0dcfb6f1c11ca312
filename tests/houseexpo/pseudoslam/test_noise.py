"""What a SLAM gets wrong: how much, where, and not at all where it is off."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import (
    Ackermann,
    Differential,
    LaserConfig,
    NoiseConfig,
    Odometry,
    RobotConfig,
    SimulatorConfig,
)
from houseexpo.pseudoslam.config.obstacles import Obstacle, ObstaclesConfig, Rectangle
from houseexpo.pseudoslam.kernels.episode import COUNTS, READINGS
from houseexpo.pseudoslam.kernels.odometry import draw_odometry_errors, grip_share
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from tests.builders.simulations import PLAIN, at, corner, hall, started, wander

NUMBERS = [f.name for f in fields(NoiseConfig) if f.name not in {"odometry_model", "slip"}]
EACH = [NoiseConfig(**{name: 5.0 if "deg" in name else 0.5}) for name in NUMBERS]
EACH.append(NoiseConfig(odometry_model=Odometry(0.5, 0.5, 0.5, 0.5)))


@pytest.mark.parametrize("pixels_per_metre", [40.0, 100.0])
def test_obstacles_move_along_their_rays_by_the_deviation_in_metres(pixels_per_metre: float) -> None:
    config = replace(PLAIN, pixels_per_metre=pixels_per_metre, laser=LaserConfig(3.0, 20.0, 0.5))
    simulator = Simulator.of(corner(), at(3.0, 2.0, 0.0, replace(config, noise=NoiseConfig(laser_m=0.05))))
    rng, found = np.random.default_rng(4), []
    for _ in range(60):
        cells = np.argwhere(simulator.start(rng).known == 255)
        x, y = (simulator.world.frame.points_from_cells(cells) - (3.0, 2.0)).T
        found.append(np.hypot(x, y) * (1 - (2.0 + 0.5 / pixels_per_metre) / x))  # beyond the wall, along the ray
    beyond = np.concatenate(found)
    assert beyond.mean() == pytest.approx(0, abs=0.005)
    assert math.sqrt(beyond.var() - 1 / 12 / pixels_per_metre**2) == pytest.approx(0.05, rel=0.08)


@pytest.mark.parametrize("angle", [0.0, 35.0, -110.0])
def test_obstacles_do_not_move_across_their_rays(angle: float) -> None:
    """A thin post, 2 m away in the open."""
    x, y = 4 + 2 * math.cos(math.radians(angle)), 4 + 2 * math.sin(math.radians(angle))
    post = ObstaclesConfig(placed=(Obstacle(Rectangle(0.1, 0.1), x, y),))
    config = SimulatorConfig(50.0, laser=LaserConfig(3.0, 40.0, 0.5), obstacles=post)
    plan = hall(8.0, 8.0)
    exact = measured(*started(at(4.0, 4.0, angle, config), plan)[:2])
    simulator = Simulator.of(plan, at(4.0, 4.0, angle, replace(config, noise=NoiseConfig(laser_m=0.2))))
    rng = np.random.default_rng(1)
    found = np.concatenate([measured(simulator, simulator.start(rng)) for _ in range(40)])
    assert found[:, 0].std() == pytest.approx(0.2, rel=0.15)
    across = np.abs(found[:, 1:] - exact[None, :, 1]).min(axis=1) * found[:, 0]  # to the nearest cell's direction
    assert across.max() <= 0.75 / 50  # half the diagonal of a cell


def measured(simulator: Simulator, state: State) -> np.ndarray:
    """(n, 2) distances in metres and directions of the obstacles on a map, as the robot sees them."""
    rows, cols = np.nonzero(state.known == 255)
    x, y, heading = state.pose_px.tolist()
    directions = np.arctan2(y - rows - 0.5, cols + 0.5 - x) - heading
    distances = np.hypot(cols + 0.5 - x, y - rows - 0.5) / simulator.config.pixels_per_metre
    return np.stack([distances, np.arctan2(np.sin(directions), np.cos(directions))], axis=1)


def test_a_wrong_registration_shifts_all_of_a_step_alike() -> None:
    noise = NoiseConfig(registration_m=0.1)
    config = replace(PLAIN, noise=noise, laser=LaserConfig(3.0, 30.0), robot=RobotConfig(turn_deg=40.0))
    simulator = Simulator.of(corner(), at(3.0, 2.0, -20.0, config))
    rng, found = np.random.default_rng(5), []
    for _ in range(400):
        state = simulator.start(rng)
        state.known[:] = 0
        simulator.step(state, "left")  # four scans
        wall = np.nonzero(state.known == 255)[1]
        assert np.ptp(wall) <= 1  # it stays straight, and thin
        found.append((wall.mean() - 126 - simulator.world.margin_px) / 25)
    assert np.std(found) == pytest.approx(0.1, rel=0.12)
    assert np.mean(found) == pytest.approx(0.0, abs=0.03)


def test_a_wrong_registration_turns_a_scan_about_the_robot() -> None:
    noise = NoiseConfig(registration_deg=2.0)
    simulator = Simulator.of(corner(), at(3.0, 2.0, 0.0, replace(PLAIN, noise=noise, laser=LaserConfig(3.0, 60.0))))
    rng, turns = np.random.default_rng(6), []
    for _ in range(300):
        rows, cols = np.nonzero(simulator.start(rng).known == 255)
        turns.append(math.degrees(math.atan(np.polyfit(rows, cols, 1)[0])))
    assert np.std(turns) == pytest.approx(2.0, rel=0.15)
    assert np.mean(turns) == pytest.approx(0.0, abs=0.4)


def drifts(noise: NoiseConfig, action: str, steps: int) -> np.ndarray:
    """(runs, 3): by how much odometry is off after so many steps: along x, along y, in heading."""
    config = SimulatorConfig(4.0, laser=LaserConfig(1.0, 20.0), noise=noise)
    simulator = Simulator.of(hall(16.0, 4.0), at(1.0, 2.0, 0.0, config))
    rng, found = np.random.default_rng(7), []
    for _ in range(400):
        state = simulator.start(rng)
        assert simulator.believed_pose(state) == simulator.pose(state)
        for _ in range(steps):
            simulator.step(state, action)
        assert state.counts[1] == 0
        off = np.subtract(simulator.believed_pose(state), simulator.pose(state))
        found.append((off[0], off[1], math.remainder(off[2], 2 * math.pi)))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [4, 36])
def test_odometry_drifts_as_the_root_of_the_way(steps: int) -> None:
    along = drifts(NoiseConfig(odometry_way=0.1), "forward", steps)
    assert along[:, 0].std() == pytest.approx(0.1 * 0.3 * math.sqrt(steps), rel=0.12)
    assert np.abs(along[:, 1:]).max() < 1e-9
    turned = drifts(NoiseConfig(odometry_turn=0.1), "left", steps)
    assert turned[:, 2].std() == pytest.approx(math.radians(1.0) * math.sqrt(steps), rel=0.12)
    assert np.abs(turned[:, :2]).max() < 1e-9
    swerved = drifts(NoiseConfig(odometry_deg_per_m=2.0), "forward", steps)
    assert swerved[:, 2].std() == pytest.approx(math.radians(0.6) * math.sqrt(steps), rel=0.12)
    assert swerved[:, 1].std() > 0.2 * 0.3 * steps * swerved[:, 2].std()


DRIVES = Differential(1.0, 90.0, 1e6, 1e6), Ackermann(0.4, 30.0, 1e6, 1.0, 1e6)


@pytest.mark.parametrize("drive", [None, *(pytest.param(drive, marks=pytest.mark.slow) for drive in DRIVES)])
def test_the_believed_pose_is_the_errors_one_after_the_other(drive: Differential | Ackermann | None) -> None:
    """Turned before, along the path with its turn and way stretched, and turned after."""
    noise = NoiseConfig(odometry_model=Odometry(0.01, 0.02, 0.01, 0.02), odometry_bias_deg_s=0.5, slip=0.1)
    config = at(2.0, 2.0, 20.0, SimulatorConfig(robot=RobotConfig(drive=drive), noise=noise))
    simulator, state, _ = started(config)
    errors, counts, readings = simulator.params.errors, np.zeros(1, COUNTS)[0], np.zeros(1, READINGS)[0]
    counts.key = int(state.counts.key)
    x, y, heading = true = simulator.pose(state)
    for k in range(1, 6):
        counts.steps = k
        held = grip_share(errors, counts.key, k)
        if drive:
            simulator.drive(state, 0.5, 0.4)
            turn, way = (0.2 if isinstance(drive, Differential) else math.tan(0.4) / 0.4 * 0.25), 0.25
        else:
            simulator.move(state, 0.2, 0.25)
            turn, way = 0.2, 0.25
        off = draw_odometry_errors(errors, counts, readings, turn, way * 25.0, drive is not None, 0.5)
        heading += off.before
        if drive is None:
            heading += turn + off.turn
        for _ in range(200):  # small steps of the reported arc, or of the way after the turn
            bend = 0.0 if drive is None else (turn + off.turn) / 200
            x += (way + off.way / 25.0) / 200 * math.cos(heading + bend / 2)
            y += (way + off.way / 25.0) / 200 * math.sin(heading + bend / 2)
            heading += bend
        heading += off.after
        found = simulator.believed_pose(state)
        assert found[:2] == pytest.approx((x, y), abs=2e-3)
        assert math.remainder(found[2] - heading, 2 * math.pi) == pytest.approx(0.0, abs=2e-4)
        now = simulator.pose(state)
        gone = math.hypot(now[0] - true[0], now[1] - true[1])
        half = turn * held / 2 if drive else 0.0
        assert gone == pytest.approx(way * held * (math.sin(half) / half if half else 1.0), abs=1e-4)
        assert math.remainder(now[2] - true[2] - turn * held, 2 * math.pi) == pytest.approx(0.0, abs=2e-4)
        true = now


def test_the_map_is_drawn_where_the_robot_believes_to_be() -> None:
    config = replace(PLAIN, laser=LaserConfig(3.0, 20.0), noise=NoiseConfig(odometry_way=0.5))
    simulator, rng, offs = Simulator.of(corner(), at(1.0, 2.0, 0.0, config)), np.random.default_rng(9), []
    for _ in range(20):
        state = simulator.start(rng)
        for _ in range(8):
            state.known[:] = 0
            simulator.step(state, "forward")
        offs.append(simulator.believed_pose(state)[0] - simulator.pose(state)[0])
        wall = np.nonzero(state.known == 255)[1]
        assert (wall.max() - 126 - simulator.world.margin_px) / 25 == pytest.approx(offs[-1], abs=0.05)
    assert max(map(abs, offs)) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_as_many_beams_are_lost_or_see_through_as_told(rule) -> None:
    plan = FloorPlan("long", [(0, 0), (0, 8), (12, 8), (12, 0)], 1, {})
    config = at(4.0, 4.0, 0.0, SimulatorConfig(20.0, laser=LaserConfig(3.0, 90.0, 1.0, rule)))
    exact = int((started(config, plan)[1].known > 0).sum())
    lost = Simulator.of(plan, replace(config, noise=NoiseConfig(drop_out=0.3)))
    rng = np.random.default_rng(8)
    shares = [(lost.start(rng).known > 0).sum() / exact for _ in range(30)]
    assert np.mean(shares) == pytest.approx(0.7, abs=0.04)
    near = replace(at(10.5, 4.0, 0.0, config), laser=LaserConfig(3.0, 60.0, 1.0, rule))
    walls = int((started(near, plan)[1].known == 255).sum())
    through = Simulator.of(plan, replace(near, noise=NoiseConfig(max_range=0.2)))
    states = [through.start(rng) for _ in range(30)]
    assert np.mean([(state.known == 255).sum() / walls for state in states]) == pytest.approx(0.8, abs=0.04)
    assert all(
        (state.known[:, 241 + through.world.margin_px] == 127).any() for state in states
    )  # the wall is free there


def end_of(config: SimulatorConfig) -> tuple[bytes, list[float]]:
    """The map of the house and the real pose after twenty steps, whatever the margin."""
    simulator, state, _ = started(config)
    wander(simulator, state, np.random.default_rng(3), 20)
    pose = np.round(simulator.pose(state), 9).tolist()
    return state.known[simulator.world.inside_margin].tobytes(), pose


def test_what_is_off_changes_nothing_bit_by_bit() -> None:
    plain = at(1.0, 2.0, 10.0)
    known, pose = end_of(plain)
    assert end_of(replace(plain, noise=NoiseConfig(*[0] * 8))) == (known, pose)
    assert end_of(replace(plain, noise=NoiseConfig(odometry_model=Odometry())))[1] == pose
    slipped = end_of(replace(plain, noise=NoiseConfig(slip=0.2)))
    assert slipped[0] != known
    assert slipped[1] != pose  # it goes less far than it is told
    for noise in EACH:
        noisy, same_pose = end_of(replace(plain, noise=noise))
        assert same_pose == pose  # the robot goes as it is told; only its map errs
        assert noisy != known


@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_the_way_of_merging_what_is_noisy_is_exact_where_nothing_errs(rule) -> None:
    config = replace(PLAIN, laser=LaserConfig(rule=rule))
    assert end_of(replace(config, noise=NoiseConfig(laser_m=1e-12))) == end_of(config)
