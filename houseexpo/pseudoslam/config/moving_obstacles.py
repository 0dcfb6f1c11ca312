"""Configure moving obstacles: people who walk from room to room, and shapes that move along given trajectories."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from houseexpo.configuration import (
    check_above_zero,
    check_number,
    check_one_of,
    check_whole_number,
    describe_found,
)
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.obstacles import Shape
from houseexpo.pseudoslam.kernels.people import PEOPLE_MOST

Pose: TypeAlias = tuple[float, float, float]
WalkModel = Literal["social-force", "orca"]


FASTEST_M_S = 20.0


FASTEST_DEG_S = 3600.0
"""The highest speed; a higher one is probably a mistake, and would need very many substeps."""


@dataclass(frozen=True)
class PeopleConfig:
    """People who walk from room to room; none by default.

    Parameters
    ----------
    number
        Number of people in each house; fewer if the house is too small for them.
    least
        Smallest number of people; a house that is too small for them raises ConfigError.
    radius_m
        Radius of a person, who is a disc, metres.
    speed_m_s, speed_sd
        Mean and standard deviation of the desired speed of each person, drawn at the start from a normal distribution
        that is truncated at two standard deviations.
    relaxation_s
        Time in which people reach their desired speed, seconds.
    away_m
        Smallest distance from the robot's centre at the start, metres, if there is such a place.
    model
        What keeps them away from each other: the social force of Helbing and Molnar (1995), or "orca", optimal
        reciprocal collision avoidance (van den Berg et al., 2011), which ``relaxation_s`` does not affect.
    """

    number: int = 0
    radius_m: float = 0.2
    speed_m_s: float = 1.2
    speed_sd: float = 0.2
    relaxation_s: float = 0.5
    away_m: float = 1.0
    least: int = 0
    model: WalkModel = "social-force"

    def __post_init__(self) -> None:
        if isinstance(self.number, bool) or not isinstance(self.number, int) or not 0 <= self.number <= PEOPLE_MOST:
            raise ConfigError(
                f"people.number: expected a whole number from 0 to {PEOPLE_MOST}, {describe_found(self.number)}"
            )
        check_one_of(self.model, "people.model", get_args(WalkModel))
        check_whole_number(self.least, "people.least", at_least=0, at_most=self.number)
        check_above_zero(self, "people", "radius_m", at_most=10.0)
        check_above_zero(self, "people", "speed_m_s")
        check_number(self.relaxation_s, "people.relaxation_s", at_least=0.1)
        for name in ("speed_sd", "away_m"):
            check_number(getattr(self, name), f"people.{name}", at_least=0.0)
        if self.speed_m_s + 2 * self.speed_sd > FASTEST_M_S:
            raise ConfigError(
                f"people.speed_m_s: expected at most {FASTEST_M_S:g} with two standard deviations, "
                f"found {self.speed_m_s:g} and {self.speed_sd:g}"
            )


@dataclass(frozen=True)
class Trajectory:
    """A shape that moves straight from pose to pose and rotates by the smaller angle; it rests before the first time.

    Parameters
    ----------
    times_s
        Times of the poses, ascending, in seconds since the start of the episode, 0 or more.
    poses
        (x_m, y_m, heading_deg) for each time, in the plan's frame, counter-clockwise from x.
    loop
        Whether it starts again at time 0 after the last pose; if the first pose differs, it jumps there. Otherwise it
        rests at the last pose.

    The shape's clock stops while the robot or a person blocks it.

    Examples
    --------
    >>> from houseexpo.pseudoslam.config.obstacles import Circle
    >>> Trajectory(Circle(0.2), times_s=(0, 4, 8), poses=((1, 1, 0), (3, 1, 0), (1, 1, 0)), loop=True).times_s
    (0, 4, 8)
    """

    shape: Shape
    times_s: tuple[float, ...]
    poses: tuple[Pose, ...]
    loop: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.shape, get_args(Shape)):
            raise ConfigError(
                f"trajectory.shape: expected a Rectangle, Ellipse, Circle or Polygon, found {self.shape!r}"
            )
        if not isinstance(self.loop, bool):
            raise ConfigError(f"trajectory.loop: expected True or False, found {self.loop!r}")
        object.__setattr__(self, "times_s", _times(self.times_s))
        object.__setattr__(self, "poses", _poses(self.poses))
        if len(self.times_s) != len(self.poses):
            raise ConfigError(
                f"trajectory: expected as many times_s as poses, found {len(self.times_s)} and {len(self.poses)}"
            )
        pairs = zip(itertools.pairwise(self.times_s), itertools.pairwise(self.poses), strict=True)
        for i, ((start, end), (one, other)) in enumerate(pairs):
            speed = math.dist(one[:2], other[:2]) / (end - start)
            if speed > FASTEST_M_S:
                raise ConfigError(
                    f"trajectory.poses[{i + 1}]: from {start:g} s to {end:g} s it moves at {speed:.4g} m/s, "
                    f"at most {FASTEST_M_S:g} can be simulated; give it more time"
                )
            turning = abs(math.remainder(other[2] - one[2], 360.0)) / (end - start)
            if turning > FASTEST_DEG_S:
                raise ConfigError(
                    f"trajectory.poses[{i + 1}]: from {start:g} s to {end:g} s it turns at {turning:.4g} degrees/s, "
                    f"at most {FASTEST_DEG_S:g} can be simulated; give it more time"
                )


def _times(value: object) -> tuple[float, ...]:
    key = "trajectory.times_s"
    times = tuple(value) if isinstance(value, Iterable) else ()
    if len(times) < 2:
        raise ConfigError(f"{key}: expected at least 2 times in seconds, found {value!r}")
    for i, time in enumerate(times):
        check_number(time, f"{key}[{i}]", at_least=0.0)
        if i > 0 and time <= times[i - 1]:
            raise ConfigError(f"{key}[{i}]: expected a time after {times[i - 1]:g} s, found {time:g} s")
    return tuple(map(float, times))


def _poses(value: object) -> tuple[Pose, ...]:
    key = "trajectory.poses"
    try:
        poses = [(x, y, heading) for x, y, heading in value] if isinstance(value, Iterable) else []
    except (TypeError, ValueError):
        poses = []
    if len(poses) < 2:
        raise ConfigError(f"{key}: expected at least 2 poses (x_m, y_m, heading_deg), found {value!r}")
    for i, pose in enumerate(poses):
        for part in pose:
            check_number(part, f"{key}[{i}]")
    return tuple((float(x), float(y), float(heading)) for x, y, heading in poses)
