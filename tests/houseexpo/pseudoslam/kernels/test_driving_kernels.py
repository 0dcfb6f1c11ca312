"""The paths of drives beside slow ones in small steps of time, and where they end at an obstacle."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.collision import PERSON, disc_is_free
from houseexpo.pseudoslam.kernels.driving import (
    CHORD,
    TURN,
    WAY,
    command_path,
    path_length_to_disc,
    ramp_and_integral,
    shorten_path,
)
from houseexpo.pseudoslam.kernels.episode import POSE, READINGS
from houseexpo.pseudoslam.kernels.tolerances import SAGITTA_PX
from houseexpo.pseudoslam.kernels.types import ACKERMANN, DIFFERENTIAL, Drive, RobotBody

ROBOT = RobotBody(5.0, 7.5, math.radians(10.0))
NOBODY = np.zeros(0, PERSON)
Pose = tuple[float, float, float]


class Command(NamedTuple):
    """A velocity before a step, the one that is commanded, and the limits."""

    before: tuple[float, float]
    wanted: tuple[float, float]
    drive: Drive
    seconds: float


def some(kind: int, rng: np.random.Generator) -> Command:
    turning = 1.5 if kind == DIFFERENTIAL else 0.42
    (v, to_v), (w, to_w) = rng.uniform(-25, 25, 2), rng.uniform(-turning, turning, 2)
    drive = Drive(kind, rng.uniform(10, 100), rng.uniform(0.5, 5), 8.25 if kind == ACKERMANN else 0.0)
    return Command((v, w), (to_v, to_w), drive, rng.uniform(0.1, 1.0))


def path(command: Command) -> np.ndarray:
    readings = np.zeros(1, READINGS)[0]
    readings.speed, readings.turning = command.before
    return command_path(readings, *command.wanted, command.drive, ROBOT, command.seconds, 1.0)


def slow(command: Command, n: int = 2_000) -> tuple[np.ndarray, np.ndarray]:
    """Poses (n + 1, 3) from (0, 0, 0), and the velocities (n + 1, 2): nothing but small steps of time."""
    (v, w), (to_v, to_w), drive, seconds = command
    dt, pose, poses, speeds = seconds / n, (0.0, 0.0, 0.0), [(0.0, 0.0, 0.0)], [(v, w)]
    for _ in range(n):
        old_v, old_w = v, w
        v += float(np.clip(to_v - v, -drive.acceleration * dt, drive.acceleration * dt))
        w += float(np.clip(to_w - w, -drive.turning_rate * dt, drive.turning_rate * dt))
        mean_v, mean_w = (old_v + v) / 2, (old_w + w) / 2
        rate = mean_v * math.tan(mean_w) / drive.wheelbase_px if drive.kind == ACKERMANN else mean_w
        x, y, heading = pose
        middle = heading + rate * dt / 2
        pose = x + mean_v * dt * math.cos(middle), y - mean_v * dt * math.sin(middle), heading + rate * dt
        poses.append(pose)
        speeds.append((v, w))
    return np.array(poses), np.array(speeds)


def poses_of(found: np.ndarray, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> np.ndarray:
    """The poses (n + 1, 3) at the ends of a path's slices."""
    poses = [(x, y, heading)]
    for chord, aside, turn, _ in found.tolist():
        x, y = x + chord * math.cos(heading + aside), y - chord * math.sin(heading + aside)
        heading += turn
        poses.append((x, y, heading))
    return np.array(poses)


@pytest.mark.parametrize("kind", [DIFFERENTIAL, ACKERMANN])
def test_a_path_is_that_of_small_steps_of_time(kind: int) -> None:
    rng = np.random.default_rng(kind)
    for _ in range(25):
        command = some(kind, rng)
        found, (poses, speeds) = path(command), slow(command)
        end = poses_of(found)[-1]
        assert np.hypot(*(end - poses[-1])[:2]) < 0.05  # pixels: 2 mm
        assert end[2] == pytest.approx(poses[-1, 2], abs=2e-3)
        v, _ = ramp_and_integral(command.before[0], command.wanted[0], command.drive.acceleration, command.seconds)
        w, _ = ramp_and_integral(command.before[1], command.wanted[1], command.drive.turning_rate, command.seconds)
        assert (v, w) == pytest.approx(tuple(speeds[-1]), abs=1e-9)
        assert found[:, WAY].sum() == pytest.approx(np.trapezoid(speeds[:, 0], dx=command.seconds / 2000), abs=1e-2)


@pytest.mark.parametrize("kind", [DIFFERENTIAL, ACKERMANN])
def test_slices_are_short_and_flat(kind: int) -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        command = some(kind, rng)
        found = path(command)
        assert np.abs(found[:, WAY]).max() <= ROBOT.between_px * (1 + 1e-6)
        assert np.abs(found[:, TURN]).max() <= ROBOT.between_rad * (1 + 1e-6)
        assert (np.abs(found[:, CHORD] * found[:, TURN]) / 8).max() <= SAGITTA_PX * 1.01


def test_at_a_constant_velocity_a_path_is_one_arc() -> None:
    for v, w in ((12.0, 0.7), (-9.0, 1.1), (20.0, 0.0), (0.0, -1.2)):
        found = poses_of(path(Command((v, w), (v, w), Drive(DIFFERENTIAL, 50.0, 3.0, 0.0), 0.8)))
        angle = 0.8 * w
        x, y = (v / w * math.sin(angle), -v / w * (1 - math.cos(angle))) if w else (0.8 * v, 0.0)
        assert found[-1] == pytest.approx((x, y, angle), abs=1e-12)
        if v and w:  # all ends of slices are on the circle
            assert np.hypot(found[:, 0], found[:, 1] + v / w) == pytest.approx(abs(v / w), abs=1e-9)


def test_ramps_are_those_of_their_limit() -> None:
    assert ramp_and_integral(0.0, 10.0, 4.0, 1.0) == (4.0, 2.0)
    assert ramp_and_integral(0.0, 2.0, 4.0, 1.0) == (2.0, 1.5)  # half a second to get there, half a second at 2
    assert ramp_and_integral(3.0, -3.0, 6.0, 1.0) == (-3.0, 0.0)
    assert ramp_and_integral(5.0, 5.0, 1.0, 2.0) == (5.0, 10.0)


def test_a_path_ends_where_small_steps_along_it_meet_something() -> None:
    rng = np.random.default_rng(3)
    blocked = 0
    for case in range(60):
        kind = (DIFFERENTIAL, ACKERMANN)[case % 2]
        command = some(kind, rng)._replace(seconds=1.0)
        occupied = (rng.random((80, 80)) < 0.004).astype(np.uint8)
        occupied[[0, -1], :] = occupied[:, [0, -1]] = 1
        heading, whole = rng.uniform(-3, 3), path(command)
        if not disc_is_free(occupied, 40.0, 40.0, 5.0):
            continue
        pose = np.zeros(1, POSE)[0]
        pose.x, pose.y, pose.heading = 40.0, 40.0, heading
        found = whole.copy()
        is_blocked = shorten_path(found, kind == ACKERMANN, pose, occupied, NOBODY, 0.0, 5.0, math.inf)
        end = poses_of(found, 40.0, 40.0, heading)[-1]
        assert disc_is_free(occupied, end[0], end[1], 5.0)
        turned = slow(command)[0]
        cos, sin = math.cos(heading), math.sin(heading)
        xs, ys = 40 + cos * turned[:, 0] + sin * turned[:, 1], 40 - sin * turned[:, 0] + cos * turned[:, 1]
        free = [disc_is_free(occupied, x, y, 5.0 - 2 * SAGITTA_PX) for x, y in zip(xs, ys, strict=True)]
        if is_blocked:
            blocked += 1
            touches = [disc_is_free(occupied, x, y, 5.0 + 2 * SAGITTA_PX) for x, y in zip(xs, ys, strict=True)]
            assert not all(touches)
            first = touches.index(False)
            last = free.index(False) if False in free else len(free) - 1
            off = np.hypot(xs[first : last + 1] - end[0], ys[first : last + 1] - end[1])
            assert off.min() < 0.2
        else:
            assert all(free)
            assert (found == whole).all()
    assert blocked >= 12


def test_a_differential_drive_turns_on_where_it_stands_and_a_car_does_not() -> None:
    occupied = np.zeros((40, 60), np.uint8)
    occupied[:, 30] = 1
    pose = np.zeros(1, POSE)[0]
    pose.x, pose.y, pose.heading = 20.0, 20.0, 0.0
    for kind, car in ((DIFFERENTIAL, False), (ACKERMANN, True)):
        command = Command((20.0, 0.3), (20.0, 0.3), Drive(kind, 50.0, 3.0, 8.0), 1.0)
        whole = path(command)
        found = whole.copy()
        assert shorten_path(found, car, pose, occupied, NOBODY, 0.0, 5.0, math.inf)
        x, _, heading = poses_of(found, 20.0, 20.0)[-1]
        assert x == pytest.approx(25.0, abs=1e-3)
        assert heading == pytest.approx(0.3 if not car else found[:, WAY].sum() * math.tan(0.3) / 8.0)
        assert found[:, WAY].sum() < whole[:, WAY].sum()


def test_a_path_ends_at_the_distance_of_what_is_not_in_the_cells() -> None:
    command = Command((10.0, 0.5), (10.0, 0.5), Drive(DIFFERENTIAL, 50.0, 3.0, 0.0), 1.0)
    pose, occupied = np.zeros(1, POSE)[0], np.zeros((60, 60), np.uint8)
    pose.x, pose.y = 20.0, 30.0
    whole = path(command)
    other = poses_of(whole, 20.0, 30.0)[-1, :2] + (9.0, -4.0)  # 9.85 from the end of the path
    assert path_length_to_disc(whole, pose, other[None] + 5.0, 5.0, 0.0) == math.inf
    most = path_length_to_disc(whole, pose, other[None], 10.0, 1e-6)
    assert 5.0 < most < 10.0
    found = whole.copy()
    assert shorten_path(found, False, pose, occupied, NOBODY, 0.0, 5.0, most)
    end = poses_of(found, 20.0, 30.0)[-1, :2]
    assert 10.0 <= np.hypot(*(end - other)) < 10.0 + 1e-4
