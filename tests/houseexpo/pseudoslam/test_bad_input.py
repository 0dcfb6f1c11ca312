"""What cannot be is refused by name: which key, what was found, what would do; and never by an endless loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError, DatasetError, HouseExpoError, PlanError
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
from houseexpo.pseudoslam.config.obstacles import Circle, Obstacle, ObstaclesConfig, Polygon, RandomObstacles, Rectangle
from houseexpo.pseudoslam.simulator import Simulator

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
WALL = FloorPlan("wall", [(0, 0), (0, 4), (3.9, 4), (3.9, 1), (4.1, 1), (4.1, 4), (8, 4), (8, 0)], 1, {})
CRACK = FloorPlan("crack", [(0.02, 0), (0.02, 4), (0.04, 4), (0.04, 0)], 1, {})
FIELD = FloorPlan("field", [(0, 0), (0, 60), (60, 60), (60, 0)], 1, {})
HUGE = FloorPlan("huge", [(0, 0), (0, 3000), (3000, 3000), (3000, 0)], 1, {})


def config(**given: Any) -> SimulatorConfig:
    return SimulatorConfig(**{"pixels_per_metre": 16.0, **given})


def start(x_m: float, y_m: float) -> dict[str, Any]:
    return {"start": StartConfig(random=False, x_m=x_m, y_m=y_m)}


def initial_state(plan: FloorPlan, **given: Any) -> None:
    simulator = Simulator.of(plan, config(**given))
    simulator.start(np.random.default_rng(0))


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: RobotConfig(radius_m=1e-9), "robot.radius_m: expected at least 0.01, found 1e-09"),
        (lambda: RobotConfig(radius_m=1e9), r"robot.radius_m: expected at most 10, found 1000000000\.0"),
        (lambda: RobotConfig(step_m=1e300), r"robot.step_m: expected at most 100, found 1e\+300"),
        (lambda: RobotConfig(turn_deg=361), "robot.turn_deg: expected at most 360, found 361"),
        (lambda: LaserConfig(resolution_deg=1e-9), "laser.resolution_deg: expected at least 0.005, found 1e-09"),
        (lambda: NoiseConfig(odometry_turn=1e300), r"noise.odometry_turn: expected at most 1000, found 1e\+300"),
        (lambda: ObservationConfig(global_cells=10**6), "observation.global_cells: .* at most 20000, found 1000000"),
        (lambda: SimulatorConfig(trajectories=None), "trajectories: expected a list, found None"),
        (lambda: GoalConfig(radius_m=1e9), "goal.radius_m: expected at most 1000, found"),
        (lambda: StartConfig(heading_deg=1e300), r"start.heading_deg: expected at most 360, found 1e\+300"),
        (lambda: config(step_s=1e9), "step_s: expected at most 60, found 1000000000.0"),
        (lambda: config(pixels_per_metre=1e5), "pixels_per_metre: expected at most 200, found 100000.0"),
        (lambda: config(observation=ObservationConfig(5000.0)), "pixels_per_metre: 16 makes the view 80000 cells wide"),
        (lambda: config(laser=LaserConfig(range_m=700.0)), "laser see 11200 of them far, .* a shorter range"),
        (lambda: PeopleConfig(radius_m=1e9), "people.radius_m: expected at most 10, found"),
        (lambda: RandomObstacles(number=(1, 10**9)), "obstacles.random.number: expected at most 10000, found"),
        (lambda: RandomObstacles(size_m=(1, 1e9)), "obstacles.random.size_m: expected at most 1000, found"),
        (lambda: RandomObstacles(gap_m=1e9), "obstacles.random.gap_m: expected at most 10, found"),
        (lambda: Circle(1e9), "circle.radius_m: expected at most 1000, found"),
        (lambda: Polygon(((0, 0), (1, 0), (0, 1e9))), r"polygon.points_m\[2\]: expected at most 1000, found"),
        (lambda: Trajectory(Circle(0.1), (0, 1e-9), ((1, 1, 0), (2, 1, 0))), r"poses\[1\]: .* at most 20"),
        (lambda: Trajectory(Circle(0.1), (0, 1e-9), ((1, 1, 0), (1, 1, 180))), r"poses\[1\]: from 0 s to 1e-09 s"),
    ],
)
def test_values_that_no_house_has_are_refused(make: Callable[[], object], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        make()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "given", "text"),
    [
        (HALL, {"robot": RobotConfig(radius_m=2.5)}, "robot.radius_m: .* 2.5 m fits nowhere in plan 'hall' .* smaller"),
        (HALL, {"robot": RobotConfig(radius_m=10.0)}, "robot.radius_m: .* 10 m fits nowhere"),
        (HALL, {"people": PeopleConfig(2, radius_m=10.0)}, "people.radius_m: people of radius 10 m fit nowhere"),
        (WALL, start(4.0, 2.0), r"start: a robot of radius 0.2 m does not fit at \(4, 2\) m in plan 'wall'; start at"),
        (WALL, start(3.8, 2.0), r"start: .* does not fit at \(3.8, 2\) m"),
        (WALL, start(-1.0, 2.0), r"start: .* does not fit at \(-1, 2\) m"),
        (WALL, start(1e300, 2.0), r"start: .* does not fit at \(1e\+300, 2\) m"),
        (WALL, {"goal": GoalConfig(False, 4.0, 2.0)}, r"goal: the robot cannot stand at \(4, 2\) m in plan 'wall'"),
        (
            WALL,
            {"obstacles": ObstaclesConfig((Obstacle(Rectangle(0.5, 0.5), 4.0, 2.0),))},
            r"obstacles.placed\[0\]: the rectangle at \(4, 2\) m in plan 'wall' overlaps a wall",
        ),
        (WALL, {"obstacles": ObstaclesConfig((Obstacle(Circle(0.3), 4.0, 0.4),))}, r"obstacles.placed\[0\]: .* closes"),
        (
            WALL,
            {"trajectories": (Trajectory(Circle(0.2), (0, 4), ((3, 3, 0), (5, 3, 0))),)},
            r"trajectories\[0\]: at 1\.\d+ s, at \(3\.\d+, 3\.00\) m, its shape meets .* 'wall'; move the trajectory",
        ),
        (HALL, {"people": PeopleConfig(200, least=200)}, "people.least: 200 people .* do not fit .* ask for fewer"),
        (FIELD, {"pixels_per_metre": 200.0}, r"pixels_per_metre: 200 makes 1.4e\+08 cells of plan 'field' \(60 x 60"),
        (HUGE, {}, r"pixels_per_metre: 16 makes 2.3e\+09 cells of plan 'huge' .* use a coarser grid"),
        (CRACK, {}, "plan 'crack': verts: expected free space, found no free cell at 16 px/m; use a finer grid"),
    ],
)
def test_what_a_house_cannot_give_is_refused(plan: FloorPlan, given: dict[str, Any], text: str) -> None:
    with pytest.raises((ConfigError, PlanError), match=text):
        initial_state(plan, **given)


def test_a_house_without_room_for_all_random_obstacles_gets_fewer() -> None:
    simulator = Simulator.of(HALL, config(obstacles=ObstaclesConfig(random=RandomObstacles((1, 400), size_m=(1, 1.5)))))
    numbers = [len(simulator.start(np.random.default_rng(seed)).obstacles) for seed in range(4)]
    assert min(numbers) >= 1
    assert max(numbers) < 40  # in 32 m2, half a square metre each at least


@pytest.mark.parametrize(("turn", "way"), [(math.nan, 0.0), (0.0, math.inf), (1e300, 0.0), (0.0, -1e300)])
def test_moves_are_finite(turn: float, way: float) -> None:
    simulator = Simulator.of(HALL, config())
    state = simulator.start(np.random.default_rng(0))
    with pytest.raises(ConfigError, match="action: expected at most a full turn and 100 m, found a turn of"):
        simulator.move(state, turn, way)
    simulator.move(state, 2 * math.pi, 100.0)  # as far as it goes
    assert state.blocked


@pytest.mark.slow
def test_the_largest_values_that_are_allowed_end() -> None:
    wild = config(
        robot=RobotConfig(step_m=100.0, turn_deg=360.0),
        noise=NoiseConfig(1000, 1000, 1000, 1000, 1000, 1000),
        laser=LaserConfig(resolution_deg=0.05),
    )
    simulator = Simulator.of(HALL, wild)
    state = simulator.start(np.random.default_rng(0))
    for action in ("forward", "left", "forward", "right", "forward"):
        simulator.step(state, action)
    assert np.isfinite(state.poses_px).all()


@pytest.mark.parametrize("dataset", [None, 5, [1], [], {}, [HALL, "hall"]])
def test_what_holds_no_plans_is_refused(dataset: object) -> None:
    with pytest.raises(ConfigError, match="dataset: expected"):
        gymnasium.make("PseudoSLAM/Exploration-v0", dataset=dataset)


def test_an_empty_folder_and_a_missing_path_are_named(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(DatasetError, match=f"{path.name}: expected .* check the path"):
            gymnasium.make("PseudoSLAM/Exploration-v0", dataset=path)
    (tmp_path / "plan.json").write_text('{"verts": [[0, 0], [1, 1]], "id": "broken"}')
    with pytest.raises(HouseExpoError, match=r"broken|plan\.json"):
        gymnasium.make("PseudoSLAM/Exploration-v0", dataset=tmp_path)
