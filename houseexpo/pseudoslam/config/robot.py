"""Configure the robot, its drive and laser, noise, view, start and goal; defaults are the paper's Tables I and II."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Final, Literal, get_args

from houseexpo.configuration import check_above_zero, check_number, check_one_of, check_whole_number
from houseexpo.errors import ConfigError
from houseexpo.plan.room_labels import LABELS, canonical
from houseexpo.words import suggest_name

ScanRule = Literal["sector", "rays"]
Origin = Literal["plan", "centre"]
GoalKind = Literal["place", "room", "object"]

MAX_SIDE_PX = 20_000
"""Largest number of cells across a view, a scan or a global map; memory grows with its square."""
MAX_BEAMS = 36_000
"""Largest number of beams of a scan: 100 for each degree of a full circle."""
FURTHEST_M = 100.0
"""The longest step, metres."""


@dataclass(frozen=True)
class RobotConfig:
    """The robot: a disc with a radius in metres, and how it moves.

    Without a ``drive``, an action turns it and moves it on exactly, by ``turn_deg`` and ``step_m`` or shares of them.
    With one, an action is a command that the drive follows for ``SimulatorConfig.step_s``; the other two have no
    effect.
    """

    radius_m: float = 0.2
    step_m: float = 0.3
    turn_deg: float = 10.0
    drive: Differential | Ackermann | None = None

    def __post_init__(self) -> None:
        check_number(self.radius_m, "robot.radius_m", above=0.0, at_least=0.01, at_most=10.0)
        check_number(self.step_m, "robot.step_m", above=0.0, at_most=FURTHEST_M)
        check_number(self.turn_deg, "robot.turn_deg", above=0.0, at_most=360.0)
        if not (self.drive is None or isinstance(self.drive, (Differential, Ackermann))):
            raise ConfigError(f"robot.drive: expected a Differential, an Ackermann or None, found {self.drive!r}")

    @property
    def motion(self) -> Motion:
        """The name of how the robot moves."""
        names: dict[type, Motion] = {Differential: "differential", Ackermann: "ackermann"}
        return names.get(type(self.drive), "discrete")


@dataclass(frozen=True)
class LaserConfig:
    """The laser: its range, field of view and angular resolution.

    With ``rule`` "sector", a scan decides every cell of the sector, as described in the paper. "rays" is the scan of
    the published simulator, identical to the cell: rays that are ``resolution_deg`` apart, from the right edge on and
    without the left edge.
    """

    range_m: float = 5.0
    fov_deg: float = 180.0
    resolution_deg: float = 0.7
    rule: ScanRule = "sector"

    def __post_init__(self) -> None:
        check_above_zero(self, "laser", "range_m", "fov_deg", "resolution_deg")
        if self.fov_deg > 360:
            raise ConfigError(f"laser.fov_deg: expected at most 360, found {self.fov_deg!r}")
        if self.resolution_deg > self.fov_deg:
            raise ConfigError(
                f"laser.resolution_deg: expected at most the field of view, {self.fov_deg:g}, "
                f"found {self.resolution_deg!r}"
            )
        check_number(self.resolution_deg, "laser.resolution_deg", at_least=self.fov_deg / MAX_BEAMS)
        check_one_of(self.rule, "laser.rule", get_args(ScanRule))


@dataclass(frozen=True)
class NoiseConfig:
    """Errors of SLAM (section III-D, and others that it does not cover); all are off by default.

    Laser and registration: ``laser_m`` is the standard deviation of each range, drawn once per beam and scan.
    ``registration_m`` (in x and in y) and ``registration_deg`` are standard deviations of a shift and a rotation, drawn
    once per step and applied to its scan before that is merged into the map.

    Odometry drifts as the robot moves, and the map drifts with it: ``odometry_way`` and ``odometry_turn`` are standard
    deviations of the distance and the turn of a step, as shares of these; ``odometry_deg_per_m`` is that of the heading
    per metre. ``odometry_model`` has the model of the field (below), instead of these three or in
    addition. ``odometry_bias_deg_s`` is the rate random walk of a gyroscope (IEEE Std 952): the heading by odometry
    drifts at a rate that is 0 at the start and has the standard deviation ``odometry_bias_deg_s sqrt(t)``, deg/s, after
    t seconds. All these change only what is reported. With ``slip``, the robot itself loses a share of the way and the
    turn of each step, which odometry reports as done; the share is uniform between 0 and twice ``slip``, its mean.

    Probabilities for each beam of each scan: ``drop_out`` that it returns nothing, so that it decides no cells, and
    ``max_range`` that it returns the largest range, as with glass.
    """

    laser_m: float = 0.0
    registration_m: float = 0.0
    registration_deg: float = 0.0
    odometry_way: float = 0.0
    odometry_turn: float = 0.0
    odometry_deg_per_m: float = 0.0
    drop_out: float = 0.0
    max_range: float = 0.0
    odometry_model: Odometry | None = None
    odometry_bias_deg_s: float = 0.0
    slip: float = 0.0

    def __post_init__(self) -> None:
        for name in self._numbers():
            check_number(getattr(self, name), f"noise.{name}", at_least=0.0, at_most=1000.0)
        check_number(self.slip, "noise.slip", at_most=0.5)
        if not (self.odometry_model is None or isinstance(self.odometry_model, Odometry)):
            raise ConfigError(f"noise.odometry_model: expected an Odometry or None, found {self.odometry_model!r}")
        if self.drop_out + self.max_range > 1:
            raise ConfigError(
                f"noise: expected drop_out and max_range, which are probabilities, to add up to at most 1, "
                f"found {self.drop_out:g} and {self.max_range:g}"
            )

    @property
    def any(self) -> bool:
        """Whether any noise is on."""
        return self.odometry or any(getattr(self, name) > 0 for name in self._numbers())

    @property
    def odometry(self) -> bool:
        """Whether odometry errs."""
        shares = self.odometry_way, self.odometry_turn, self.odometry_deg_per_m
        return self.odometry_model is not None or max(*shares, self.odometry_bias_deg_s, self.slip) > 0

    def without_odometry(self) -> NoiseConfig:
        """Return the noise of the laser and of registration alone."""
        plain = NoiseConfig()
        names = [f.name for f in fields(self) if f.name.startswith("odometry") or f.name == "slip"]
        return replace(self, **{name: getattr(plain, name) for name in names})

    def _numbers(self) -> list[str]:
        return [f.name for f in fields(self) if f.name != "odometry_model"]


@dataclass(frozen=True)
class ObservationConfig:
    """The view of the map that a policy sees: a square around the robot.

    Its side is ``size_m`` metres, which is ``2 * int(size_m * pixels_per_metre / 2)`` cells. The global map of ``dict``
    observations is a square of ``global_size_m`` metres around the start, with ``global_cells`` cells per side.

    Parameters
    ----------
    pixels
        Pixels per side of the view, for any resolution of the map. A pixel shows an obstacle if one of its cells is an
        obstacle, else free if one is free, else unknown. None for one pixel per cell.
    far_size_m
        Side of the second, wider view of observations at several scales, with as many pixels as the first one.
    """

    size_m: float = 4.0
    global_size_m: float = 32.0
    global_cells: int = 128
    pixels: int | None = None
    far_size_m: float = 16.0

    def __post_init__(self) -> None:
        check_above_zero(self, "observation", "size_m", "global_size_m", "far_size_m")
        if self.pixels is not None:
            check_whole_number(self.pixels, "observation.pixels", at_least=2, at_most=MAX_SIDE_PX)
        check_whole_number(self.global_cells, "observation.global_cells", at_least=2, at_most=MAX_SIDE_PX)


@dataclass(frozen=True)
class GoalConfig:
    """The goal: a place, a room of a kind ("go to the kitchen"), or a piece of furniture of a kind.

    A random goal is at least ``least_way_m`` metres of walking distance from the start, or as far as the house allows.

    Parameters
    ----------
    random, x_m, y_m
        For a place: whether it is random, or (x, y) in the plan's metres.
    radius_m
        For a place: the distance of the robot's centre within which it is reached, metres.
    kind
        "place", "room" or "object". A room is reached when the robot's centre is in any room of the kind; furniture,
        when it is within 1 m of a piece of the kind and nothing stands in between (``worlds.goal_regions``).
    names
        The kinds of room or furniture, of which one that the house has is drawn for each episode, all equally likely.
        Rooms have the labels of the data set; () means all of them. Furniture has the words of its source.
    """

    random: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    radius_m: float = 0.3
    least_way_m: float = 2.0
    kind: GoalKind = "place"
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_one_of(self.kind, "goal.kind", get_args(GoalKind))
        object.__setattr__(self, "names", self._checked_names())
        for name in ("x_m", "y_m"):
            check_number(getattr(self, name), f"goal.{name}")
        check_above_zero(self, "goal", "radius_m", at_most=1000.0)
        check_number(self.least_way_m, "goal.least_way_m", at_least=0.0, at_most=1000.0)

    def _checked_names(self) -> tuple[str, ...]:
        """Return the names, for rooms in the spelling of ``LABELS``."""
        names: object = self.names
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise ConfigError(f"goal.names: expected a list of names, found {names!r}")
        spelt = tuple(canonical(name) or name for name in names) if self.kind == "room" else tuple(names)
        if len({name.casefold() for name in spelt}) < len(spelt):
            raise ConfigError(f"goal.names: expected each name once, found {list(names)}")
        if self.kind == "place" and names:
            raise ConfigError(f'goal.names: expected none for a place, found {list(names)}; set goal.kind to "room"')
        if self.kind == "object" and not names:
            raise ConfigError("goal.names: expected the kinds of furniture, such as bed, found none")
        if self.kind != "room":
            return spelt
        for name in names:
            if canonical(name) is None:
                raise ConfigError(
                    f"goal.names: expected labels of rooms ({', '.join(LABELS)}), found {name!r}"
                    + suggest_name(name, LABELS)
                )
        return spelt or LABELS


@dataclass(frozen=True)
class StartConfig:
    """The start of an episode: a random place where the robot fits and can reach the rest, or a pose.

    The pose is relative to ``origin``: the plan's own origin, or the centre of its bounding box. x is right, y is up,
    and the heading is counter-clockwise from x.
    """

    random: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    heading_deg: float = 0.0
    origin: Origin = "plan"

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m"):
            check_number(getattr(self, name), f"start.{name}")
        check_number(self.heading_deg, "start.heading_deg", at_least=-360.0, at_most=360.0)
        check_one_of(self.origin, "start.origin", get_args(Origin))


@dataclass(frozen=True)
class Odometry:
    """The odometry motion model (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 5.4).

    AMCL uses it, with 0.2 for each alpha. What is not set is 0, so that only what is set errs.

    A step is a rotation r1, a translation t and a rotation r2. They are reported with errors of the variances
    ``alpha1 r1^2 + alpha2 t^2``, ``alpha3 t^2 + alpha4 (r1^2 + r2^2)`` and ``alpha1 r2^2 + alpha2 t^2``. A robot that
    turns and then goes has no r2. On an arc, both rotations are half of the turn, and t is the length of the arc.
    Units are metres and radians.
    """

    alpha1: float = 0.0
    alpha2: float = 0.0
    alpha3: float = 0.0
    alpha4: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            check_number(getattr(self, f.name), f"noise.odometry_model.{f.name}", at_least=0.0, at_most=1000.0)


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
