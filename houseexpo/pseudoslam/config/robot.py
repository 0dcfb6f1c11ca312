"""The robot's body, its laser, its errors, what it is shown, where it starts and goes (the paper's Tables I and II)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import above_zero, number, one_of, whole

ScanRule = Literal["sector", "rays"]
Origin = Literal["plan", "centre"]

MAX_SIDE_PX = 20_000
"""Cells across a view, a scan or a global map, at most: their memory grows with the square."""
MAX_BEAMS = 36_000
"""Beams of a scan, at most: 100 for each degree of a full circle."""
FURTHEST_M = 100.0
"""The longest step."""


@dataclass(frozen=True)
class RobotConfig:
    """A disc, and how far one action takes it."""

    radius_m: float = 0.2
    step_m: float = 0.3
    turn_deg: float = 10.0

    def __post_init__(self) -> None:
        number(self.radius_m, "robot.radius_m", above=0.0, at_least=0.01, at_most=10.0)
        number(self.step_m, "robot.step_m", above=0.0, at_most=FURTHEST_M)
        number(self.turn_deg, "robot.turn_deg", above=0.0, at_most=360.0)


@dataclass(frozen=True)
class LaserConfig:
    """What the sensor sees.

    ``rule`` "sector" decides every cell of the sector, as the paper has it; "rays" is the published simulator's scan,
    cell by cell: a fan of rays ``resolution_deg`` apart from the right edge, without the left one.
    """

    range_m: float = 5.0
    fov_deg: float = 180.0
    resolution_deg: float = 0.7
    rule: ScanRule = "sector"

    def __post_init__(self) -> None:
        above_zero(self, "laser", "range_m", "fov_deg", "resolution_deg")
        if self.fov_deg > 360:
            raise ConfigError(f"laser.fov_deg: expected at most 360, found {self.fov_deg!r}")
        if self.resolution_deg > self.fov_deg:
            raise ConfigError(
                f"laser.resolution_deg: expected at most the field of view, {self.fov_deg:g}, "
                f"found {self.resolution_deg!r}"
            )
        number(self.resolution_deg, "laser.resolution_deg", at_least=self.fov_deg / MAX_BEAMS)
        one_of(self.rule, "laser.rule", get_args(ScanRule))


@dataclass(frozen=True)
class NoiseConfig:
    """What a SLAM gets wrong (section III-D, and what it leaves out); all off by default.

    Standard deviations: ``laser_m`` moves each obstacle along its ray, once a beam and scan; ``registration_m`` (in x
    and in y) and ``registration_deg`` shift and turn what a step saw before it is merged into the map, once a step.

    Odometry drifts as the robot moves, and the map with it: ``odometry_way`` and ``odometry_turn`` are standard
    deviations of a step's way and turn as shares of them, ``odometry_deg_per_m`` of its heading for each metre.

    Chances, for each beam of each scan: ``drop_out`` that it returns nothing, so that nothing is decided there, and
    ``max_range`` that it returns the greatest range, as from glass.
    """

    laser_m: float = 0.0
    registration_m: float = 0.0
    registration_deg: float = 0.0
    odometry_way: float = 0.0
    odometry_turn: float = 0.0
    odometry_deg_per_m: float = 0.0
    drop_out: float = 0.0
    max_range: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            number(getattr(self, f.name), f"noise.{f.name}", at_least=0.0, at_most=1000.0)
        if self.drop_out + self.max_range > 1:
            raise ConfigError(
                f"noise: expected drop_out and max_range, chances, to be at most 1 together, "
                f"found {self.drop_out:g} and {self.max_range:g}"
            )

    @property
    def any(self) -> bool:
        """Whether there is noise."""
        return any(getattr(self, f.name) > 0 for f in fields(self))


@dataclass(frozen=True)
class ObservationConfig:
    """The square of the map round the robot that a policy sees: ``2 * int(size_m * pixels_per_metre / 2)`` cells.

    The global map of ``Dict`` observations is a square of ``global_size_m`` round the start, of ``global_cells`` cells
    a side.

    Parameters
    ----------
    pixels
        Pixels along a side of what is shown, of whatever resolution the map is; a pixel shows an obstacle where there
        is one, else free, else unknown. None: as many as there are cells.
    far_size_m
        The second, wider square of observations at several scales, of as many pixels as the first.
    """

    size_m: float = 4.0
    global_size_m: float = 32.0
    global_cells: int = 128
    pixels: int | None = None
    far_size_m: float = 16.0

    def __post_init__(self) -> None:
        above_zero(self, "observation", "size_m", "global_size_m", "far_size_m")
        if self.pixels is not None:
            whole(self.pixels, "observation.pixels", at_least=2, at_most=MAX_SIDE_PX)
        whole(self.global_cells, "observation.global_cells", at_least=2, at_most=MAX_SIDE_PX)


@dataclass(frozen=True)
class GoalConfig:
    """Where to go: a place, or any that is so far from the start along the way, or as far as the house allows.

    The robot is there when its centre is within ``radius_m``.
    """

    random: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    radius_m: float = 0.3
    least_way_m: float = 2.0

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m"):
            number(getattr(self, name), f"goal.{name}")
        above_zero(self, "goal", "radius_m", at_most=1000.0)
        number(self.least_way_m, "goal.least_way_m", at_least=0.0, at_most=1000.0)


@dataclass(frozen=True)
class StartConfig:
    """Where an episode starts: anywhere the robot fits and can reach the rest, or at a pose.

    The pose counts from the plan's own origin, or from the centre of its bounding box; x right, y up, counter-clockwise
    from x.
    """

    random: bool = True
    x_m: float = 0.0
    y_m: float = 0.0
    heading_deg: float = 0.0
    origin: Origin = "plan"

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m"):
            number(getattr(self, name), f"start.{name}")
        number(self.heading_deg, "start.heading_deg", at_least=-360.0, at_most=360.0)
        one_of(self.origin, "start.origin", get_args(Origin))
