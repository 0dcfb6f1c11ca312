"""What moves is on the map as a SLAM's map would have it: seen, hidden, and forgotten once its place is seen again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import (
    LaserConfig,
    RobotConfig,
    ScanRule,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Pose, Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, Rectangle, Shape
from houseexpo.pseudoslam.kernels.collision import MOVING, disc_is_free
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

ROOM = FloorPlan("room", [(0, 0), (0, 6), (6, 6), (6, 0)], 1, {})
PPM = 20.0
RULES: tuple[ScanRule, ...] = ("sector", "rays")
Mask = npt.NDArray[np.bool_]


def scene(*trajectories: Trajectory, rule: ScanRule = "sector", **given: Any) -> tuple[Simulator, State]:
    """The robot at the lower wall, in the middle, looking up; what lies before it is all in range."""
    config = SimulatorConfig(
        pixels_per_metre=PPM,
        laser=LaserConfig(range_m=8.0, fov_deg=180.0, resolution_deg=0.25, rule=rule),
        start=StartConfig(random=False, x_m=3.0, y_m=0.5, heading_deg=90.0),
        trajectories=trajectories,
        step_s=1.0,
        **given,
    )
    simulator = Simulator.of(ROOM, config)
    return simulator, simulator.start(np.random.default_rng(0))


def moving(shape: Shape, *poses: Pose, loop: bool = False) -> Trajectory:
    """A pose a second."""
    return Trajectory(shape, tuple(range(len(poses))), poses, loop)


def covered(simulator: Simulator, shape: Shape, pose: Pose) -> Mask:
    """The cells whose centres lie in a circle or a rectangle that is not turned."""
    frame = simulator.world.frame
    rows, cols = np.indices(frame.shape)
    x, y = frame.points_from_cells(np.stack([rows, cols], axis=-1)).transpose(2, 0, 1)
    if isinstance(shape, Circle):
        return np.hypot(x - pose[0], y - pose[1]) <= shape.radius_m
    assert isinstance(shape, Rectangle)
    return (abs(x - pose[0]) <= shape.width_m / 2) & (abs(y - pose[1]) <= shape.height_m / 2)


def values(state: State, where: Mask) -> set[int]:
    return set(np.unique(state.known[where]).tolist())


def between(simulator: Simulator, x: tuple[float, float], y: tuple[float, float]) -> Mask:
    """The cells of a box, in metres."""
    box = Rectangle(x[1] - x[0], y[1] - y[0])
    return covered(simulator, box, ((x[0] + x[1]) / 2, (y[0] + y[1]) / 2, 0))


@pytest.mark.parametrize("rule", RULES)
def test_one_is_seen_one_is_behind_another_and_one_walked_away(rule: ScanRule) -> None:
    """The issue's scene: three things, each in a third of the room."""
    seen = moving(Rectangle(0.4, 0.4), (1.0, 3.0, 0), (1.0, 3.0, 0))
    front, behind = moving(Rectangle(1.4, 0.2), *[(3.0, 2.0, 0)] * 3), moving(Circle(0.2), *[(3.0, 4.0, 0)] * 3)
    leaving = moving(Circle(0.3), (5.0, 2.0, 0), (5.0, 2.0, 0), (5.0, 4.5, 0))
    simulator, state = scene(seen, front, behind, leaving, rule=rule)

    near_edge = between(simulator, (0.8, 1.2), (2.8, 2.85))
    assert values(state, near_edge) == {OBSTACLE}  # seen
    assert values(state, covered(simulator, behind.shape, behind.poses[0])) == {UNKNOWN}  # hidden
    assert values(state, between(simulator, (2.5, 3.5), (2.15, 4.5))) == {UNKNOWN}  # so is the room round it
    assert values(state, between(simulator, (2.8, 3.2), (6.0, 6.05))) == {UNKNOWN}  # and the wall
    first = covered(simulator, leaving.shape, leaving.poses[0])
    assert OBSTACLE in values(state, first)

    simulator.step(state, "left")
    assert OBSTACLE in values(state, first)  # it still stands there
    simulator.step(state, "right")
    assert values(state, first) == {FREE}  # it walked away
    assert OBSTACLE in values(state, covered(simulator, leaving.shape, leaving.poses[2]))
    assert values(state, covered(simulator, behind.shape, behind.poses[0])) == {UNKNOWN}


def test_what_left_while_nobody_looked_stays_on_the_map_until_its_place_is_seen_again() -> None:
    leaving = moving(Circle(0.3), *[(3.0, 2.5, 0)] * 3, (3.0, 5.0, 0))
    simulator, state = scene(leaving, robot=RobotConfig(turn_deg=120.0))
    first = covered(simulator, leaving.shape, leaving.poses[0])
    before = state.known[first].copy()
    assert OBSTACLE in before
    for _ in range(2):  # it still stands there; at the end the robot looks down and to the right
        simulator.step(state, "left")
    assert np.array_equal(state.known[first], before)
    simulator.step(state, "left")  # all round: its place is in view, and it has just gone
    assert values(state, first) == {FREE}


@pytest.mark.parametrize("rule", RULES)
def test_it_hides_the_wall_behind_it_which_is_seen_once_it_has_gone(rule: ScanRule) -> None:
    passing = moving(Rectangle(2.0, 0.2), (3.0, 3.0, 0), (1.2, 3.0, 0))
    simulator, state = scene(passing, rule=rule)
    behind = between(simulator, (2.5, 3.5), (6.0, 6.05))
    assert values(state, behind) == {UNKNOWN}
    simulator.step(state, "left")
    assert values(state, behind) == {OBSTACLE}
    assert values(state, between(simulator, (2.5, 3.5), (3.2, 5.95))) == {FREE}


def test_coverage_counts_the_house_without_what_moves() -> None:
    leaving = moving(Rectangle(2.0, 0.2), (3.0, 3.0, 0), (3.0, 3.0, 0), (3.0, 5.5, 0))
    simulator, state = scene(leaving)
    assert simulator.coverage(state) < 0.9
    for action in [*["left"] * 9, *["right"] * 18, "forward", "left"]:
        simulator.step(state, action)
        assert simulator.coverage(state) <= 1.0


def test_it_waits_where_the_robot_stands_and_the_robot_where_it_stands() -> None:
    across = moving(Circle(0.3), (1.0, 0.8, 0), (5.0, 0.8, 0), (1.0, 0.8, 0), loop=True)
    simulator, state = scene(across)
    for step in range(40):
        simulator.step(state, ("forward", "left", "forward", "right")[step % 4])
        assert disc_is_free(state.occupied, *state.pose_px[:2], 0.2 * PPM)


@pytest.mark.parametrize("seed", range(3))
def test_the_robot_never_overlaps_people(seed: int) -> None:
    config = SimulatorConfig(pixels_per_metre=PPM, people=PeopleConfig(6, speed_m_s=1.5, away_m=0.3))
    simulator = Simulator.of(ROOM, config)
    rng = np.random.default_rng(seed)
    state = simulator.start(rng)
    blocked = 0
    for _ in range(150):
        simulator.step(state, "forward" if rng.random() < 0.8 else "left")
        x, y = state.pose_px[:2].tolist()
        assert disc_is_free(state.occupied, x, y, 0.2 * PPM)
        for other_x, other_y in state.episode.bodies.people[["x", "y"]].tolist():
            assert math.hypot(x - other_x, y - other_y) >= 0.4 * PPM - 1e-6
        blocked += state.blocked
    assert blocked


def test_people_are_no_part_of_what_is_known_of_a_known_house() -> None:
    config = SimulatorConfig(pixels_per_metre=PPM, people=PeopleConfig(5), known_map=True)
    simulator = Simulator.of(ROOM, config)
    state = simulator.start(np.random.default_rng(2))
    unseen = (state.occupied & MOVING != 0) & (state.known == FREE)
    assert unseen.any()  # those behind the robot: the house is known as it is without them
