"""What a simulation can be told (the paper's Table I), with the paper's defaults (Table II)."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Literal, get_args

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.checks import above_zero, number

ScanRule = Literal["sector", "rays"]
Origin = Literal["plan", "centre"]


@dataclass(frozen=True)
class RobotConfig:
    """A disc, and how far one action takes it."""

    radius_m: float = 0.2
    step_m: float = 0.3
    turn_deg: float = 10.0

    def __post_init__(self) -> None:
        above_zero(self, "robot", "radius_m", "step_m", "turn_deg")


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
        if self.rule not in get_args(ScanRule):
            raise ConfigError(f"laser.rule: expected one of {', '.join(get_args(ScanRule))}; found {self.rule!r}")


@dataclass(frozen=True)
class NoiseConfig:
    """Standard deviations (section III-D); all off by default.

    ``laser_m`` moves each obstacle along its ray, once a beam and scan; ``registration_m`` (in x and in y) and
    ``registration_deg`` shift and turn what a step saw before it is merged into the map, once a step.
    """

    laser_m: float = 0.0
    registration_m: float = 0.0
    registration_deg: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            number(getattr(self, f.name), f"noise.{f.name}", at_least=0.0)

    @property
    def any(self) -> bool:
        """Whether there is noise."""
        return max(self.laser_m, self.registration_m, self.registration_deg) > 0


@dataclass(frozen=True)
class ObservationConfig:
    """The square of the map round the robot that a policy sees: ``2 * int(size_m * pixels_per_metre / 2)`` cells."""

    size_m: float = 4.0

    def __post_init__(self) -> None:
        above_zero(self, "observation", "size_m")


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
        for name in ("x_m", "y_m", "heading_deg"):
            number(getattr(self, name), f"start.{name}")
        if self.origin not in get_args(Origin):
            raise ConfigError(f"start.origin: expected one of {', '.join(get_args(Origin))}; found {self.origin!r}")


@dataclass(frozen=True)
class SimulatorConfig:
    """Everything that a simulation depends on, but the plan and the seed.

    ``known_map`` starts with the whole map known (the paper's navigation mode); ``max_steps`` cuts an episode off.
    """

    pixels_per_metre: float = 25.0
    robot: RobotConfig = field(default_factory=RobotConfig)
    laser: LaserConfig = field(default_factory=LaserConfig)
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    start: StartConfig = field(default_factory=StartConfig)
    known_map: bool = False
    max_steps: int = 200

    def __post_init__(self) -> None:
        number(self.pixels_per_metre, "pixels_per_metre", above=0.0)
        if isinstance(self.max_steps, bool) or not isinstance(self.max_steps, int) or self.max_steps < 1:
            raise ConfigError(f"max_steps: expected a whole number of at least 1, found {self.max_steps!r}")
        if self.side_px < 2:
            raise ConfigError(
                f"observation.size_m: {self.observation.size_m:g} m "
                f"are no two cells at {self.pixels_per_metre:g} px/m; ask for more"
            )

    @property
    def side_px(self) -> int:
        """Cells along a side of the observation."""
        return 2 * int(self.observation.size_m * self.pixels_per_metre / 2)
