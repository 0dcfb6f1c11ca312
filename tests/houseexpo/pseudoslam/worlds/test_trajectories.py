"""Shapes on trajectories: they come and go, wait for what is in the way, and are refused where they cannot go."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import GoalConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, ObstaclesConfig, RandomObstacles, Rectangle
from houseexpo.pseudoslam.kernels.body_tracks import track_pose_at
from houseexpo.pseudoslam.kernels.collision import MOVING, Disc
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.worlds import moving_obstacles, place_obstacles, reset
from houseexpo.pseudoslam.worlds.moving_obstacles import find_track_cells, make_tracks
from houseexpo.pseudoslam.worlds.world import new_scan_buffers
from tests.builders.simulations import NOBODY, frame_of, hall, room, scene

ACROSS = Trajectory(Circle(0.3), (0, 4), ((1, 3, 0), (5, 3, 0)))


def seen(occupied: np.ndarray, x: float, y: float, heading: float) -> tuple[np.ndarray, np.ndarray]:
    free, hit, slopes = new_scan_buffers(60.0)
    n_free, n_hit = sector_scan(occupied, x, y, heading, math.pi / 2, 60.0, free, hit, slopes)
    masks = np.zeros((2, occupied.size), bool)
    masks[0][free[:n_free]], masks[1][hit[:n_hit]] = True, True
    return masks[0].reshape(occupied.shape), masks[1].reshape(occupied.shape)


def test_one_goes_across_and_its_old_cells_are_free_again() -> None:
    world = scene(room(60, 60), trajectories=[ACROSS])
    before = world.occupied & MOVING != 0
    world.step(seconds=2.0)
    world.check(NOBODY)
    assert not (world.occupied[before] & MOVING).any()
    assert track_pose_at(world.tracks, 0, world.bodies.clocks[0])[:2] == pytest.approx((30.0, 30.0))
    world.step(seconds=9.0)
    assert track_pose_at(world.tracks, 0, world.bodies.clocks[0])[:2] == (50.0, 30.0)  # there it rests


def test_it_hides_what_is_behind_it_and_is_hidden() -> None:
    behind = Trajectory(Circle(0.2), (0, 1), ((3, 5, 0), (3, 5, 0)))
    front = Trajectory(Rectangle(1.0, 0.2), (0, 2), ((3, 4, 0), (1, 4, 0)))
    world = scene(room(60, 60), trajectories=[behind, front])
    cells = find_track_cells(make_tracks([behind], room(60, 60), world.frame, "box"), (60, 60))
    assert not seen(world.occupied, 30.0, 50.0, math.pi / 2)[1][cells].any()
    old = world.occupied & MOVING != 0
    world.step(seconds=2.0)
    free, hit = seen(world.occupied, 30.0, 50.0, math.pi / 2)
    assert hit[cells].any()  # the one in front has gone
    assert free[old & ~cells & (world.occupied == 0)].any()


def test_a_loop_starts_anew() -> None:
    world = scene(
        room(60, 60), trajectories=[Trajectory(Circle(0.2), (0, 2, 4), ((1, 1, 0), (3, 1, 0), (1, 1, 0)), True)]
    )
    places = []
    for _ in range(16):
        world.step(seconds=0.5)
        places.append(track_pose_at(world.tracks, 0, world.bodies.clocks[0])[0])
    assert places == pytest.approx([15, 20, 25, 30, 25, 20, 15, 10] * 2)


def test_the_clock_stands_still_until_the_robot_has_gone() -> None:
    world = scene(room(60, 60), trajectories=[ACROSS])
    robot = Disc(30.3, 30.4, 2.0)
    for _ in range(10):
        world.step(robot)
        world.check(robot)
    x = track_pose_at(world.tracks, 0, world.bodies.clocks[0])[0]
    assert 23.0 < x <= 25.3
    waited = world.bodies.clocks[0]
    world.step(Disc(30.0, 20.0, 2.0))
    assert world.bodies.clocks[0] == pytest.approx(waited + 0.5)


def test_what_is_thin_and_quick_does_not_jump_over_the_robot() -> None:
    track = Trajectory(Rectangle(0.02, 2.0), (0, 0.3), ((1, 3, 0), (5, 3, 0)))
    world = scene(room(60, 60), trajectories=[track])
    for _ in range(4):
        world.step(Disc(30.0, 30.0, 2.0))
    assert track_pose_at(world.tracks, 0, world.bodies.clocks[0])[0] < 28.0


def test_people_are_not_run_over() -> None:
    sweeper = Trajectory(Rectangle(0.4, 2.0), (0, 4, 8), ((1, 1.5, 0), (5, 1.5, 0), (1, 1.5, 0)), loop=True)
    world = scene(room(30, 60), PeopleConfig(number=3), [sweeper], key=5)
    clocks = []
    for _ in range(60):
        world.step(seconds=0.3)
        world.check(NOBODY)
        clocks.append(float(world.bodies.clocks[0]))
    assert max(clocks) > 4.0  # people got out of its way
    assert len(set(clocks)) > 20


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"times_s": (0, 2, 1)}, r"times_s\[2\]: expected a time after 2 s, found 1 s"),
        ({"times_s": (0, 1, 1)}, r"times_s\[2\]: expected a time after 1 s, found 1 s"),
        ({"times_s": (-1, 1, 2)}, r"times_s\[0\]: expected at least 0"),
        ({"times_s": (0, 1)}, "as many times_s as poses, found 2 and 3"),
        ({"times_s": (0,), "poses": ((1, 1, 0),)}, "at least 2 times"),
        ({"poses": ((1, 1, 0),)}, "at least 2 poses"),
        ({"poses": ((1, 1), (2, 2), (3, 3))}, "at least 2 poses"),
        ({"poses": ((1, 1, 0), (2, float("nan"), 0), (3, 3, 0))}, r"poses\[1\]: expected a finite number"),
        ({"poses": ((1, 1, 0), (200, 1, 0), (3, 3, 0))}, r"poses\[1\]: from 0 s to 1 s it moves at 199 m/s"),
        ({"shape": "box"}, "expected a Rectangle"),
        ({"loop": 1}, "expected True or False"),
    ],
)
def test_bad_trajectories_are_refused(values: dict[str, object], problem: str) -> None:
    good = {"shape": Circle(0.2), "times_s": (0, 1, 2), "poses": ((1, 1, 0), (2, 1, 0), (3, 1, 0))}
    with pytest.raises(ConfigError, match=problem):
        Trajectory(**(good | values))  # type: ignore[arg-type]


def test_through_a_wall_names_which_when_and_where() -> None:
    occupied = room(60, 60)
    occupied[:, 40] = 1
    with pytest.raises(ConfigError, match=r"trajectories\[1\]: at 2\.80 s, at \(3\.80, 3\.00\) m.* \(4\.05, ") as info:
        make_tracks(
            [Trajectory(Circle(0.2), (0, 4), ((1, 1, 0), (3, 1, 0))), ACROSS], occupied, frame_of(occupied, 10), "two"
        )
    assert "plan 'two'" in str(info.value)


def test_what_is_swept_is_all_that_it_covers_on_its_way() -> None:
    world = scene(room(60, 60), trajectories=[Trajectory(Rectangle(1.0, 0.3), (0, 4), ((1, 1, 0), (4, 4, 180)))])
    swept = find_track_cells(world.tracks, (60, 60))
    covered = world.occupied & MOVING != 0
    for _ in range(40):
        world.step(seconds=0.1)
        covered |= world.occupied & MOVING != 0
    assert (swept >= covered).all()
    assert swept.sum() < 1.2 * covered.sum()


def test_starts_hand_kernels_one_kind_of_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second kind would be compiled again, which takes seconds; static cells are the same in both."""
    given: dict[str, set[bool]] = {}
    for module, name in (
        (moving_obstacles, "place_people"),
        (moving_obstacles, "find_track_collision"),
        (place_obstacles, "nth_cell"),
        (reset, "nth_cell"),
    ):
        monkeypatch.setattr(module, name, partial(_note, getattr(module, name), given.setdefault(name, set())))
    goal, people, obstacles = GoalConfig(), PeopleConfig(number=1), ObstaclesConfig(random=RandomObstacles((1, 1)))
    for with_people, with_obstacles, with_track in itertools.product((False, True), repeat=3):
        config = SimulatorConfig(
            10.0,
            people=people if with_people else PeopleConfig(),
            obstacles=obstacles if with_obstacles else ObstaclesConfig(),
            trajectories=(ACROSS,) if with_track else (),
            goal=goal,
        )
        Simulator.of(hall(), config).start(np.random.default_rng(0))
    scene(room(60, 60), PeopleConfig(number=1), [ACROSS])
    assert given == {
        "place_people": {True},
        "find_track_collision": {False},
        "nth_cell": {False},
    }


def _note(kernel: Callable[..., Any], kinds: set[bool], grid: np.ndarray, *rest: Any) -> Any:
    kinds.add(grid.flags.writeable)
    return kernel(grid, *rest)
