"""Configurations in files: the published simulator's keys, and our own."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import (
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import (
    Circle,
    Ellipse,
    Obstacle,
    ObstaclesConfig,
    Polygon,
    RandomObstacles,
    Rectangle,
)
from houseexpo.pseudoslam.config.yaml_files import read_yaml_config
from houseexpo.pseudoslam.simulator import Simulator

PUBLISHED: dict[str, Any] = {
    "json_dir": "HouseExpo/json/",
    "map_id_set": "HouseExpo/map_id_train.txt",
    "meter2pixel": 20,
    "mode": 0,
    "obstacle": {"number": 3, "size": {"min": 0.2, "max": 0.6}},
    "robotRadius": 0.2,
    "stepLength": {"linear": 0.3, "angular": 15},
    "startPose": {"x": 0.9, "y": -0.5, "theta": 90},
    "resetRandomPose": 0,
    "laser": {"range": 5, "fov": 180, "resolution": 0.7, "noiseSigma": 0.1},
    "slamError": {"linear": 2, "angular": 1.5},
    "stateSize": {"x": 7, "y": 7},
}


def written(folder: Path, content: object) -> Path:
    path = folder / "config.yaml"
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return path


def changed(**other: Any) -> dict[str, Any]:
    return {**PUBLISHED, **other}


def test_published_keys_are_converted(tmp_path: Path) -> None:
    config = SimulatorConfig.from_yaml(written(tmp_path, PUBLISHED))
    assert config == SimulatorConfig(
        pixels_per_metre=20,
        robot=RobotConfig(radius_m=0.2, step_m=0.3, turn_deg=15),
        laser=LaserConfig(range_m=5, fov_deg=180, resolution_deg=0.7),
        noise=NoiseConfig(laser_m=0.1 / 20, registration_m=2 / 20, registration_deg=1.5),
        observation=ObservationConfig(size_m=7),
        start=StartConfig(random=False, x_m=0.9, y_m=-0.5, heading_deg=90, origin="centre"),
        obstacles=ObstaclesConfig(
            random=RandomObstacles(number=(3, 3), size_m=(0.4, 1.2), shapes=("rectangle", "ellipse", "circle"))
        ),
    )
    assert config.side_px == 2 * int(7 * 20 / 2)


def test_what_is_left_out_keeps_its_default(tmp_path: Path) -> None:
    config = SimulatorConfig.from_yaml(written(tmp_path, {"mode": 1, "obstacle": {"number": 0}, "resetRandomPose": 1}))
    assert config == SimulatorConfig(known_map=True, start=StartConfig(origin="centre"))
    assert not SimulatorConfig.from_yaml(written(tmp_path, {"startPose": {"x": 1}})).start.random


def test_it_says_what_it_made_of_them(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = written(tmp_path, PUBLISHED)
    with caplog.at_level(logging.INFO, "houseexpo.pseudoslam"):
        SimulatorConfig.from_yaml(path)
    _, notes = read_yaml_config(SimulatorConfig, path)
    assert [record.getMessage() for record in caplog.records] == [f"{path}: {note}" for note in notes]
    assert len(notes) == 22
    said = "\n".join(notes)
    for line in (
        "json_dir: 'HouseExpo/json/' is left out; the houses are an argument, `dataset`",
        "laser.noiseSigma: 0.1 -> noise.laser_m: 0.005 (from pixels; along each ray, and not rounded to whole ones)",
        "slamError.linear: 2 -> noise.registration_m: 0.1 (from pixels; without its simulator's hidden factor 0.1)",
        "obstacle.size.max: 0.6 -> obstacles.random.size_m[1]: 1.2 (a half length; ",
    ):
        assert line in said


@pytest.mark.slow
def test_a_published_file_can_be_simulated(tmp_path: Path) -> None:
    config = SimulatorConfig.from_yaml(written(tmp_path, changed(obstacle={"number": 0})))
    simulator = Simulator.of(FloorPlan("hall", [(2, 1), (2, 5), (10, 5), (10, 1)], 1, {}), config)
    x, y, heading = simulator.pose(simulator.start(np.random.default_rng(0)))
    assert (x, y) == pytest.approx((6.9, 2.5))  # from the middle
    assert heading == pytest.approx(1.5707963)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (changed(noise=1), "expected the published simulator's keys or those of SimulatorConfig, found both"),
        (changed(robotSize=1), "unknown key 'robotSize'; did you mean 'robotRadius'? Known: json_dir, map_id_set"),
        (changed(laser={"reach": 5}), "unknown key 'laser.reach'; known: laser.range, laser.fov, laser.resolution"),
        (changed(laser=5), "laser: expected a mapping of range, fov, resolution, noiseSigma; found 5"),
        (changed(robotRadius="20 cm"), "robotRadius: expected a finite number, found '20 cm'"),
        (changed(robotRadius=-1), "robotRadius: robot.radius_m: expected more than 0, found -1"),
        (changed(meter2pixel=0), "meter2pixel: expected more than 0, found 0"),
        (changed(mode=2), "mode: expected 0 or 1, found 2"),
        (changed(mode=[0]), "mode: expected 0 or 1, found [0]"),
        (changed(stateSize={"x": 7, "y": 5}), "stateSize.y: expected x's 7, found 5"),
        (changed(obstacle={"number": 2.5}), "obstacle.number: obstacles.random.number: expected whole numbers"),
        (changed(stepLength={"linear": None}), "stepLength.linear: expected a finite number, found None"),
        ({"robot": {"radius": 0.2}}, "unknown key 'robot.radius'; did you mean 'robot.radius_m'"),
        ({"robots": 2}, "unknown key 'robots'; did you mean 'robot'? Known: pixels_per_metre, robot, laser, noise"),
        ({"robot": {"radius_m": "wide"}}, "robot.radius_m: expected a finite number, found 'wide'"),
        ({"known_map": "yes, please"}, "known_map: expected true or false, found 'yes, please'"),
        ({"trajectories": 3}, "trajectories: expected a list, found 3"),
        ({"obstacles": {"placed": [{"x_m": 1, "y_m": 1}]}}, "obstacles.placed[0].shape: expected a value, found none"),
        (
            {"obstacles": {"placed": [{"x_m": 1, "y_m": 1, "shape": {"cube": {}}}]}},
            "unknown key 'obstacles.placed[0].shape.cube'; known: obstacles.placed[0].shape.rectangle",
        ),
        ("- 1\n- 2\n", "configuration: expected a mapping of pixels_per_metre, robot"),
        ("a: [1, 2\nb: 3\n", "expected YAML, found: while parsing a flow sequence"),
        ("\x00", "expected YAML, found: unacceptable character"),
        ("a: 2020-99-99", "expected YAML, found: month must be in 1..12"),
    ],
)
def test_what_cannot_be_is_refused_by_file_and_key(tmp_path: Path, content: object, text: str) -> None:
    path = written(tmp_path, content)
    with pytest.raises(ConfigError) as caught:
        SimulatorConfig.from_yaml(path)
    assert str(caught.value).startswith(f"{path}: {text}")


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.yaml: expected a readable file, found: No such file"):
        SimulatorConfig.from_yaml(tmp_path / "none.yaml")


FULL = SimulatorConfig(
    pixels_per_metre=20.0,
    laser=LaserConfig(rule="rays"),
    noise=NoiseConfig(laser_m=0.02, drop_out=0.1),
    start=StartConfig(random=False, x_m=1.0, origin="centre"),
    goal=GoalConfig(radius_m=0.5),
    obstacles=ObstaclesConfig(
        placed=(
            Obstacle(Circle(0.3), 1.0, 2.0),
            Obstacle(Rectangle(0.3, 0.4), 1.5, 2.0, 30.0),
            Obstacle(Ellipse(0.3, 0.4), 2.5, 2.0),
            Obstacle(Polygon(((0.0, 0.0), (0.4, 0.0), (0.0, 0.4))), 3.0, 3.0),
        ),
        random=RandomObstacles(number=(1, 2), shapes=("circle",)),
    ),
    people=PeopleConfig(number=2),
    trajectories=(Trajectory(Circle(0.2), (0.0, 4.0), ((1.0, 1.0, 0.0), (3.0, 1.0, 0.0)), loop=True),),
    known_map=True,
)


@pytest.mark.parametrize("config", [SimulatorConfig(), FULL])
def test_our_own_keys_come_back_from_a_file(tmp_path: Path, config: SimulatorConfig) -> None:
    assert SimulatorConfig.from_mapping(config.to_mapping()) == config
    path = written(tmp_path, config.to_mapping())
    assert read_yaml_config(SimulatorConfig, path) == (config, [])
    assert SimulatorConfig.from_yaml(written(tmp_path, "")) == SimulatorConfig()
