from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import (
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig


def test_the_defaults_are_the_papers() -> None:
    config = SimulatorConfig()
    assert (config.robot.step_m, config.robot.turn_deg, config.max_steps) == (0.3, 10.0, 200)
    assert (config.laser.range_m, config.observation.size_m, config.laser.rule) == (5.0, 4.0, "sector")
    assert not config.noise.any


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: RobotConfig(radius_m=0), "robot.radius_m: expected more than 0, found 0"),
        (lambda: RobotConfig(radius_m=np.float32(0.5)), "found np.float32(0.5); convert it to a Python number"),
        (lambda: SimulatorConfig(max_steps=np.int64(9)), "found np.int64(9); convert it to a Python number"),
        (lambda: PeopleConfig(number=np.int64(3)), "found np.int64(3); convert it to a Python number with .item()"),
        (lambda: RobotConfig(step_m=math.nan), "robot.step_m: expected a finite number, found nan"),
        (lambda: RobotConfig(turn_deg="10"), "robot.turn_deg: expected a finite number, found '10'"),
        (lambda: LaserConfig(fov_deg=361), "laser.fov_deg: expected at most 360, found 361"),
        (lambda: LaserConfig(fov_deg=90, resolution_deg=100), "laser.resolution_deg: expected at most the field"),
        (lambda: LaserConfig(rule="beams"), "laser.rule: expected one of sector, rays; found 'beams'"),
        (lambda: NoiseConfig(laser_m=-1), "noise.laser_m: expected at least 0, found -1"),
        (lambda: StartConfig(origin="here"), "start.origin: expected one of plan, centre; found 'here'"),
        (lambda: SimulatorConfig(pixels_per_metre=0), "pixels_per_metre: expected more than 0, found 0"),
        (lambda: SimulatorConfig(max_steps=0), "max_steps: expected a whole number of at least 1, found 0"),
        (lambda: SimulatorConfig(observation=ObservationConfig(0.01)), "size_m: 0.01 m are fewer than two cells"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make()
    assert text in str(caught.value)


@pytest.mark.parametrize(("size", "side"), [(4.0, 100), (6.99, 174), (4.02, 100), (4.08, 102)])
def test_the_side_is_even(size: float, side: int) -> None:
    assert SimulatorConfig(observation=ObservationConfig(size)).side_px == side
