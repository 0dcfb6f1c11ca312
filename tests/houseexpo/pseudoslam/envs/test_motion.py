"""Robots with a drive, in environments: arcs, ramps, turning circles, collisions, and what is refused."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import houseexpo.pseudoslam  # registers the environments
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import Ackermann, Differential, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv, ObstacleAvoidanceEnv
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.simulations import HUTS, at, hall, started

pytestmark = pytest.mark.slow  # the kernels of drives take a quarter of a minute to compile

QUICK = Differential(1.0, 180.0, 1e6, 1e6)
"""A drive that is as commanded at once."""
STIFF = Ackermann(0.4, 30.0, 1e6, 1.0, 1e6)


def robot(drive: Differential | Ackermann, **more: Any) -> SimulatorConfig:
    return SimulatorConfig(robot=RobotConfig(0.2, drive=drive), **more)


def test_a_constant_velocity_is_an_arc_of_its_radius() -> None:
    simulator, state, _ = started(at(4.0, 1.0, 0.0, robot(QUICK)))
    v, w = 0.6, 0.5
    for k in range(1, 13):  # along a circle of 1.2 m
        simulator.drive(state, v, w)
        angle = w * 0.5 * k
        x, y, heading = simulator.pose(state)
        assert (x, y) == pytest.approx((4.0 + v / w * math.sin(angle), 1.0 + v / w * (1 - math.cos(angle))), abs=1e-4)
        assert math.remainder(heading - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-4)
        assert not state.blocked
    assert state.episode.readings["path_length"][0] / 25.0 == pytest.approx(0.6 * 6.0, abs=1e-4)


def test_speed_and_turning_ramp_at_the_acceleration() -> None:
    drive = Differential(1.0, 90.0, 0.4, 45.0)
    simulator, state, _ = started(at(1.0, 2.0, 0.0, robot(drive)))
    for speed in (0.2, 0.4, 0.5, 0.5):
        simulator.drive(state, 0.5, 0.0)
        assert simulator.velocity(state) == (pytest.approx(speed), 0.0)
    # 0.5 m/s after 1.25 s, which took 0.3125 m; then 0.75 s at that speed
    assert simulator.pose(state) == pytest.approx((1.0 + 0.3125 + 0.375, 2.0, 0.0), abs=1e-9)
    for speed in (0.3, 0.1, 0.0):
        simulator.drive(state, 0.0, 0.0)
        assert simulator.velocity(state)[0] == pytest.approx(speed, abs=1e-12)
    assert simulator.pose(state)[0] == pytest.approx(1.6875 + 0.3125, abs=1e-9)  # braking takes as long
    simulator.drive(state, 0.0, math.pi / 2)
    assert simulator.velocity(state)[1] == pytest.approx(math.radians(22.5))
    assert simulator.pose(state)[2] == pytest.approx(math.radians(22.5) * 0.25)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_car_turns_no_tighter_than_its_least_radius(side: float, way: float) -> None:
    assert STIFF.least_radius_m == pytest.approx(0.4 / math.tan(math.radians(30.0)))
    simulator, state, _ = started(at(4.0, 2.0, 90.0, robot(STIFF)))
    centre = 4.0 - side * STIFF.least_radius_m, 2.0
    for _ in range(20):
        simulator.drive(state, way * 0.5, side * math.radians(30.0))
        x, y, heading = simulator.pose(state)
        assert math.hypot(x - centre[0], y - centre[1]) == pytest.approx(STIFF.least_radius_m, abs=1e-4)
        across = math.atan2(y - centre[1], x - centre[0]) + side * math.pi / 2
        assert math.remainder(heading - across, 2 * math.pi) == pytest.approx(0.0, abs=2e-4)
        assert not state.blocked


def test_a_car_steers_at_its_rate_and_stands_without_turning() -> None:
    simulator, state, _ = started(at(4.0, 2.0, 0.0, robot(Ackermann(steering_deg_s=20.0))))
    for angle in (10.0, 20.0, 24.0):
        simulator.drive(state, 0.0, math.radians(24.0))
        assert simulator.velocity(state) == (0.0, pytest.approx(math.radians(angle)))
    assert simulator.pose(state) == pytest.approx((4.0, 2.0, 0.0))


def test_at_a_wall_a_drive_stops_and_can_turn_away() -> None:
    simulator, state, _ = started(at(7.0, 2.0, 0.0, robot(QUICK)))
    simulator.drive(state, 1.0, 0.0)
    simulator.drive(state, 1.0, 0.0)
    x, y, _ = simulator.pose(state)
    assert (x, y) == pytest.approx((7.8, 2.0), abs=1e-4)
    assert state.blocked
    assert simulator.velocity(state) == (0.0, 0.0)
    assert int(state.counts.collisions) == 1
    for _ in range(3):
        simulator.drive(state, 0.5, math.pi / 2)
    assert not state.blocked
    assert simulator.pose(state)[1] > 2.1
    car, its, _ = started(at(7.79, 2.0, 0.0, robot(STIFF)))
    car.drive(its, 1.0, math.radians(30.0))
    assert its.blocked
    assert car.pose(its)[2] < 0.05
    car.drive(its, -1.0, 0.0)
    assert not its.blocked


def test_what_is_known_does_not_depend_on_the_slices() -> None:
    """A drive sees on its way what a robot sees that turns and moves exactly."""
    plan = hall(8.0, 4.0)
    driven, state, _ = started(at(2.0, 2.0, 0.0, robot(QUICK)), plan)
    exact, other, _ = started(at(2.0, 2.0, 0.0), plan)
    for _ in range(4):
        driven.drive(state, 0.6, 0.0)
        exact.move(other, 0.0, 0.3)
    assert (state.known == other.known).all()
    assert int(state.counts.scans) == int(other.counts.scans)


@pytest.mark.parametrize("motion", ["differential", "ackermann"])
@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
def test_gymnasium_finds_nothing_wrong(task: str, motion: str) -> None:
    env = gymnasium.make(f"PseudoSLAM/{task}-v0", dataset=HUTS, motion=motion)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)


def test_an_action_is_a_share_of_the_largest_speeds() -> None:
    config = at(2.0, 2.0, 0.0, robot(Differential(0.4, 90.0, 1e6, 1e6)))
    env = ExplorationEnv(hall(), config)
    observation, info = env.reset(seed=0)
    assert env.actions == "continuous"
    assert observation["velocity"].tolist() == [0.0, 0.0]
    observation, *_, info = env.step(np.array([0.5, -1.0], np.float32))
    assert observation["velocity"] == pytest.approx((0.2, -math.pi / 2))
    assert info["velocity"] == pytest.approx((0.2, -math.pi / 2))
    assert info["pose"][2] == pytest.approx(-math.pi / 4, abs=1e-4)
    assert isinstance(ExplorationEnv(hall(), config, observation="scales").reset(seed=0)[0], np.ndarray)


def test_the_full_step_of_a_reward_is_that_of_the_drive() -> None:
    config = robot(Differential(0.4, 90.0, 1e6, 1e6))
    env = ObstacleAvoidanceEnv(hall(), at(2.0, 2.0, 0.0, config), reward="way")
    env.reset(seed=0)
    assert config.full_step_m == 0.2
    for share in (1.0, 0.5):
        assert env.step(np.array([share, 0.0]))[1] == pytest.approx(share, abs=1e-4)


def test_motions_that_cannot_be_are_refused() -> None:
    for given, message in (
        ({"motion": "omni"}, "motion: expected one of discrete, differential, ackermann; found 'omni'"),
        ({"motion": "differential", "actions": "discrete"}, "a robot with a drive takes continuous actions"),
        ({"motion": "ackermann", "actions": "frontier"}, "a robot with a drive takes continuous actions"),
        ({"motion": "ackermann", "config": robot(QUICK)}, "expected that of config.robot.drive, 'differential'"),
        ({"motion": "discrete", "config": robot(QUICK)}, "expected that of config.robot.drive, 'differential'"),
    ):
        with pytest.raises(ConfigError, match=message):
            ExplorationEnv(hall(), **given)
    for drive, key in (
        (lambda: Differential(max_speed_m_s=-1.0), "differential.max_speed_m_s: expected more than 0"),
        (lambda: Differential(turn_acceleration_deg_s2=0.0), "turn_acceleration_deg_s2: expected more than 0"),
        (lambda: Ackermann(acceleration_m_s2=math.nan), "acceleration_m_s2: expected a finite number"),
        (lambda: Ackermann(max_steering_deg=90.0), "max_steering_deg: expected at most 80"),
        (lambda: Ackermann(wheelbase_m=0.0), "wheelbase_m: expected at least"),
        (lambda: RobotConfig(drive="differential"), "robot.drive: expected a Differential, an Ackermann or None"),  # type: ignore[arg-type]
        (lambda: robot(Differential(100.0), step_s=2.0), "step_s: a robot of 100 m/s goes more than 100 m"),
    ):
        with pytest.raises(ConfigError, match=key):
            drive()
    env = ExplorationEnv(hall(), motion="differential")
    env.reset(seed=0)
    for strange in (0, [0.0, 1.5], [math.nan, 0.0], [0.0]):
        with pytest.raises(ConfigError, match="action: expected"):
            env.step(np.array(strange))
    simulator, state, _ = started(robot(QUICK))
    with pytest.raises(ConfigError, match=r"takes commands; call drive\(\) instead"):
        simulator.step(state, "forward")
    with pytest.raises(ConfigError, match=r"expected at most 1 m/s and 3\.14159 rad/s, found 1\.5"):
        simulator.drive(state, 1.5, 0.0)
    simulator, state, _ = started(SimulatorConfig())
    with pytest.raises(ConfigError, match="expected a robot with a drive, found none"):
        simulator.drive(state, 0.1, 0.0)


def test_a_drive_is_read_and_written_with_the_configuration() -> None:
    config = SimulatorConfig.from_mapping({"robot": {"drive": {"ackermann": {"wheelbase_m": 0.5}}}})
    assert config.robot.drive == Ackermann(0.5)
    assert config.robot.motion == "ackermann"
    assert SimulatorConfig.from_mapping(config.to_mapping()) == config
    plain = SimulatorConfig()
    assert plain.to_mapping()["robot"]["drive"] is None
    assert SimulatorConfig.from_mapping(plain.to_mapping()) == plain
    with pytest.raises(ConfigError, match=r"robot\.drive"):
        SimulatorConfig.from_mapping({"robot": {"drive": {"omni": {}}}})
    assert houseexpo.pseudoslam.SimulatorConfig is SimulatorConfig
    assert replace(config.robot, drive=None).motion == "discrete"
    assert isinstance(Simulator.of(hall(), config), Simulator)
