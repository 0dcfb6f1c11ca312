"""Write a simulated run as a CARMEN log for SLAM programs: lines ``ROBOTLASER1`` of odometry and ranges.

The laser is at the centre of the robot; all poses in the log are from odometry. To write a run::

    poses = [simulator.pose(state)]  # and again after each step
    scanner = Scanner()
    write_log("run.log", scanner, readings(simulator.world, scanner, poses, rng, drift=Drift(), laser_m=0.01))

``simulate_readings`` uses the house without obstacles and people. If there are any, make a ``Reading`` after each step
from ``simulator.believed_pose(state)`` and ``scanner.look(state.occupied, world.frame, simulator.pose(state))``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.io.poses import Pose, relative_pose
from houseexpo.pseudoslam.kernels.collision import wrap_angle
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.worlds.world import World

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Scanner:
    """A laser whose beams are spaced evenly over its field of view, including both edges."""

    fov_deg: float = 180.0
    beams: int = 361
    range_m: float = 10.0

    def __post_init__(self) -> None:
        if not (0 < self.fov_deg <= 360 and self.beams >= 2 and 0 < self.range_m < math.inf):
            raise ConfigError(
                "scanner: expected a field of view above 0 and up to 360 degrees, at least "
                f"two beams and a range above 0; found {self}"
            )

    @property
    def angles_rad(self) -> Floats:
        """The directions of the beams (beams,) relative to the heading, from the right edge to the left."""
        half = math.radians(self.fov_deg) / 2
        return np.linspace(-half, half, self.beams)

    def look(self, occupied: npt.NDArray[np.uint8], frame: GridFrame, pose: Pose) -> Floats:
        """Return the distances to the first obstacle (beams,), metres; the range if there is none.

        Parameters
        ----------
        occupied
            (rows, cols), not 0 for obstacles; ``frame`` is its position, with row 0 at the highest y.
        pose
            x, y in the plan's metres, heading in radians.
        """
        ppm = frame.pixels_per_metre
        x, y = frame.pixels_from_points(pose[:2]).tolist()
        out = np.empty(self.beams)
        angles = self.angles_rad
        cast_beams(occupied, x, y, pose[2], np.cos(angles), np.sin(angles), self.range_m * ppm, out)
        return out / ppm


@dataclass(frozen=True)
class OdometryDrift:
    """The errors of odometry: standard deviations that accumulate with the distance travelled and the angle turned."""

    metres_per_sqrt_metre: float = 0.01
    degrees_per_sqrt_metre: float = 0.5
    degrees_per_sqrt_turn: float = 1.0

    def walk(self, poses: Iterable[Pose], rng: np.random.Generator) -> Iterator[Pose]:
        """Yield the poses by odometry; the first one is exact."""
        before: Pose | None = None
        x = y = heading = 0.0
        for pose in poses:
            if before is None:
                x, y, heading = pose
            else:
                ahead, aside, turn = relative_pose(before, pose)
                way, angle = math.hypot(ahead, aside), abs(turn)
                errors = rng.normal(size=3)
                ahead += errors[0] * self.metres_per_sqrt_metre * math.sqrt(way)
                aside += errors[1] * self.metres_per_sqrt_metre * math.sqrt(way)
                wrong = math.hypot(
                    self.degrees_per_sqrt_metre * math.sqrt(way),
                    self.degrees_per_sqrt_turn * math.sqrt(angle / (2 * math.pi)),
                )
                turn += errors[2] * math.radians(wrong)
                x += ahead * math.cos(heading) - aside * math.sin(heading)
                y += ahead * math.sin(heading) + aside * math.cos(heading)
                heading = wrap_angle(heading + turn)
            before = pose
            yield x, y, heading


@dataclass(frozen=True, eq=False)
class Reading:
    """The robot's data at one place: its pose by odometry, and ranges (beams,) in metres."""

    odometry: Pose
    ranges_m: Floats


def simulate_readings(
    world: World,
    scanner: Scanner,
    poses: Iterable[Pose],
    rng: np.random.Generator,
    *,
    drift: OdometryDrift | None = None,
    laser_m: float = 0.0,
) -> Iterator[Reading]:
    """Yield the readings of a robot at these poses.

    Parameters
    ----------
    poses
        x, y in the plan's metres, heading in radians.
    drift
        The errors of odometry; None for none.
    laser_m
        Standard deviation of a range, metres; beams that hit nothing keep the scanner's range.
    """
    poses = list(poses)
    for pose, odometry in zip(poses, drift.walk(poses, rng) if drift else poses, strict=True):
        ranges = scanner.look(world.occupied, world.frame, pose)
        noisy = np.clip(ranges + rng.normal(0.0, laser_m, len(ranges)), 0.0, scanner.range_m)
        yield Reading(odometry, np.where(ranges < scanner.range_m, noisy, scanner.range_m))


def write_log(path: str | os.PathLike[str], scanner: Scanner, run: Iterable[Reading], seconds: float = 0.2) -> int:
    """Write a log with one line per reading, ``seconds`` apart; return the number of readings."""
    count = 0
    with Path(path).open("w", encoding="ascii") as stream:
        stream.write("# CARMEN log\n")
        for count, reading in enumerate(run, start=1):
            stream.write(format_laser_line(scanner, reading, (count - 1) * seconds) + "\n")
    return count


def format_laser_line(scanner: Scanner, reading: Reading, seconds: float) -> str:
    """Return a reading as a line ``ROBOTLASER1``.

    The fields are, in order: kind of laser (3, simulated), first angle, field of view, angle between beams, range,
    accuracy, remission mode; ranges and remissions, each after its count; laser's pose, robot's pose; speeds, safety
    distances, turn axis; time, host, time of logging. Units are metres, radians and seconds.
    """
    fov = math.radians(scanner.fov_deg)
    pose = " ".join(f"{value:.6f}" for value in reading.odometry)
    words = (
        f"ROBOTLASER1 3 {-fov / 2:.9f} {fov:.9f} {fov / (scanner.beams - 1):.9f} {scanner.range_m:g} 0.01 0",
        f"{scanner.beams}",
        *(f"{value:.4f}" for value in reading.ranges_m),
        f"0 {pose} {pose} 0 0 0 0 0 {seconds:.3f} houseexpo {seconds:.3f}",
    )
    return " ".join(words)
