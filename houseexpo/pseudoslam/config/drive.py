"""Configure drives, differential or car-like (Ackermann): limits of speed and acceleration for velocity commands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from houseexpo.pseudoslam.config.checks import check_number

Motion = Literal["discrete", "differential", "ackermann"]
"""How a robot moves: by exact turns and distances, or with one of the drives."""


@dataclass(frozen=True)
class Differential:
    """A differential drive, which takes a velocity (forward, turn) as its command.

    Both parts of the velocity change at no more than the accelerations until they are as commanded. The defaults are
    those of a TurtleBot3 Waffle: the speeds of ROBOTIS' data sheet (0.26 m/s, 1.82 rad/s), and the accelerations with
    which Nav2 drives it (``nav2_params.yaml``: 2.5 m/s2, 3.2 rad/s2). A TurtleBot3 Burger has 0.22 m/s and 162.7 deg/s.

    Parameters
    ----------
    max_speed_m_s, max_turn_deg_s
        Largest speed, forward and backward, and largest speed of turning, to both sides.
    acceleration_m_s2, turn_acceleration_deg_s2
        Largest changes of both, also when braking.
    """

    max_speed_m_s: float = 0.26
    max_turn_deg_s: float = 104.3
    acceleration_m_s2: float = 2.5
    turn_acceleration_deg_s2: float = 183.3

    def __post_init__(self) -> None:
        _check_speed(self, "robot.drive.differential")
        check_number(self.max_turn_deg_s, "robot.drive.differential.max_turn_deg_s", above=0.0, at_most=3600.0)
        name = "robot.drive.differential.turn_acceleration_deg_s2"
        check_number(self.turn_acceleration_deg_s2, name, above=0.0, at_most=1e6)

    @property
    def most_turning(self) -> float:
        """Largest speed of turning, radians per second."""
        return math.radians(self.max_turn_deg_s)

    @property
    def turning_rate(self) -> float:
        """Largest change of the speed of turning, radians per second squared."""
        return math.radians(self.turn_acceleration_deg_s2)


@dataclass(frozen=True)
class Ackermann:
    """A car: a kinematic bicycle model, which takes (speed, steering angle) as its command.

    The robot's pose is that of the middle of its rear axle; with the steering angle d, the curvature of its path is
    tan(d) / wheelbase (Rajamani, Vehicle Dynamics and Control, 2012, section 2.2, without side slip). Speed and
    steering angle change at no more than their limits until they are as commanded. Wheelbase, steering angle and
    steering rate are those of an F1TENTH car (O'Kelly et al., 2020; f1tenth_gym: 0.1588 + 0.1715 m, 0.4189 rad,
    3.2 rad/s). Its 20 m/s and 9.51 m/s2 are too fast for houses: speed and acceleration are decisions.

    Parameters
    ----------
    wheelbase_m
        Distance of the axles.
    max_steering_deg, steering_deg_s
        Largest steering angle, to both sides, and its largest change.
    max_speed_m_s, acceleration_m_s2
        Largest speed, forward and backward, and its largest change, also when braking.
    """

    wheelbase_m: float = 0.33
    max_steering_deg: float = 24.0
    steering_deg_s: float = 183.3
    max_speed_m_s: float = 1.0
    acceleration_m_s2: float = 2.0

    def __post_init__(self) -> None:
        _check_speed(self, "robot.drive.ackermann")
        check_number(self.wheelbase_m, "robot.drive.ackermann.wheelbase_m", at_least=0.01, at_most=100.0)
        check_number(self.max_steering_deg, "robot.drive.ackermann.max_steering_deg", above=0.0, at_most=80.0)
        check_number(self.steering_deg_s, "robot.drive.ackermann.steering_deg_s", above=0.0, at_most=1e6)

    @property
    def least_radius_m(self) -> float:
        """The least turning radius, of the middle of the rear axle."""
        return self.wheelbase_m / math.tan(self.most_turning)

    @property
    def most_turning(self) -> float:
        """Largest steering angle, radians."""
        return math.radians(self.max_steering_deg)

    @property
    def turning_rate(self) -> float:
        """Largest change of the steering angle, radians per second."""
        return math.radians(self.steering_deg_s)


DRIVES: Final[Mapping[str, type[Differential | Ackermann]]] = MappingProxyType(
    {"differential": Differential, "ackermann": Ackermann}
)
"""The drives by the names of their motions."""


def _check_speed(drive: Differential | Ackermann, key: str) -> None:
    check_number(drive.max_speed_m_s, f"{key}.max_speed_m_s", above=0.0, at_most=100.0)
    check_number(drive.acceleration_m_s2, f"{key}.acceleration_m_s2", above=0.0, at_most=1e6)
