"""Configure a whole simulation (defaults: the paper's Tables I and II), name presets, and configure planners."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

from houseexpo.configuration import check_number, check_whole_number
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.config.robot import (
    FURTHEST_M,
    MAX_SIDE_PX,
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    StartConfig,
)


@dataclass(frozen=True)
class SimulatorConfig:
    """The configuration of a simulation: everything that it depends on except the plan and the seed.

    Parameters
    ----------
    goal
        The goal for navigation, or None.
    known_map
        Whether the robot knows the whole map, without moving obstacles, from the start (the paper's navigation mode).
    step_s
        Duration of an action in seconds, for moving obstacles and for robots with a drive.
    max_steps
        Number of steps after which an episode is truncated.
    """

    pixels_per_metre: float = 25.0
    robot: RobotConfig = field(default_factory=RobotConfig)
    laser: LaserConfig = field(default_factory=LaserConfig)
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    start: StartConfig = field(default_factory=StartConfig)
    goal: GoalConfig | None = None
    obstacles: ObstaclesConfig = field(default_factory=ObstaclesConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    trajectories: tuple[Trajectory, ...] = ()
    known_map: bool = False
    step_s: float = 0.5
    max_steps: int = 200

    def __post_init__(self) -> None:
        for f in fields(self):
            wanted, value = _PARTS.get(f.name), getattr(self, f.name)
            if wanted and not (isinstance(value, wanted) or (value is None and f.name == "goal")):
                raise ConfigError(f"{f.name}: expected a {wanted.__name__}, found {value!r}")
        check_number(self.pixels_per_metre, "pixels_per_metre", above=0.0, at_most=200.0)
        check_number(self.step_s, "step_s", above=0.0, at_most=60.0)
        check_whole_number(self.max_steps, "max_steps", at_least=1)
        if not isinstance(self.trajectories, Iterable):
            raise ConfigError(f"trajectories: expected a list, found {self.trajectories!r}")
        object.__setattr__(self, "trajectories", tuple(self.trajectories))
        for i, trajectory in enumerate(self.trajectories):
            if not isinstance(trajectory, Trajectory):
                raise ConfigError(f"trajectories[{i}]: expected a Trajectory, found {trajectory!r}")
        drive = self.robot.drive
        if drive and drive.max_speed_m_s * self.step_s > FURTHEST_M:
            raise ConfigError(
                f"step_s: a robot of {drive.max_speed_m_s:g} m/s goes more than {FURTHEST_M:g} m in {self.step_s:g} s; "
                "choose a shorter step_s or a lower max_speed_m_s"
            )
        if self.side_px < 2:
            raise ConfigError(
                f"observation.size_m: {self.observation.size_m:g} m "
                f"are fewer than two cells at {self.pixels_per_metre:g} px/m; choose a larger view"
            )
        if max(self.side_px, 2 * self.laser.range_m * self.pixels_per_metre) > MAX_SIDE_PX:
            raise ConfigError(
                f"pixels_per_metre: {self.pixels_per_metre:g} makes the view {self.side_px} cells wide and the laser "
                f"see {self.laser.range_m * self.pixels_per_metre:.0f} of them far, at most {MAX_SIDE_PX} across are "
                "possible; use a coarser grid, a smaller view or a shorter range"
            )

    @classmethod
    def from_yaml(cls, path: str | os.PathLike[str]) -> SimulatorConfig:
        """Return the configuration in a YAML file with these keys, nested, or in the published simulator's config.yaml.

        For the latter, the logger ``houseexpo.pseudoslam`` reports at level INFO how each key is converted;
        ``config.yaml_files.read_config`` returns these notes.

        Raises
        ------
        ConfigError
            The file cannot be read or is not YAML, a key is unknown, or a value is invalid; the error names file and
            key.
        """
        from houseexpo.pseudoslam.config.yaml_files import read_yaml_config

        config, notes = read_yaml_config(cls, path)
        for note in notes:
            logging.getLogger("houseexpo.pseudoslam").info("%s: %s", path, note)
        return config

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, object]) -> SimulatorConfig:
        """Return the configuration from nested mappings; raise ConfigError for unknown keys and invalid values."""
        from houseexpo.configuration import config_from_mapping

        return config_from_mapping(cls, mapping)

    def to_mapping(self) -> dict[str, Any]:
        """Return the configuration as nested mappings of plain values, for ``from_mapping``."""
        from houseexpo.configuration import config_to_mapping

        return dict(config_to_mapping(self))

    @property
    def goal_place(self) -> GoalConfig | None:
        """The goal if it is a place, whose position the robot is told; None otherwise."""
        return self.goal if self.goal is not None and self.goal.kind == "place" else None

    @property
    def goal_region(self) -> GoalConfig | None:
        """The goal if it is a kind of room or furniture, which the robot has to find; None otherwise."""
        return self.goal if self.goal is not None and self.goal.kind != "place" else None

    @property
    def full_step_m(self) -> float:
        """The greatest distance of an action, metres."""
        drive = self.robot.drive
        return drive.max_speed_m_s * self.step_s if drive else self.robot.step_m

    @property
    def side_px(self) -> int:
        """Number of cells per side of the observation."""
        return 2 * int(self.observation.size_m * self.pixels_per_metre / 2)


_PARTS: dict[str, type] = {
    "robot": RobotConfig,
    "laser": LaserConfig,
    "noise": NoiseConfig,
    "observation": ObservationConfig,
    "start": StartConfig,
    "goal": GoalConfig,
    "obstacles": ObstaclesConfig,
    "people": PeopleConfig,
}


@dataclass(frozen=True)
class Preset:
    """The laser's range and field of view, and the size of the views of the map in metres and pixels.

    With ``size_m`` None, the view is the task's. Observations with several scales show the far and the whole map;
    ``dict`` observations also show the whole map.
    """

    range_m: float
    fov_deg: float
    size_m: float | None
    pixels: int | None
    far_size_m: float
    global_size_m: float


PRESETS: Final = {
    "paper": Preset(5.0, 180.0, size_m=None, pixels=None, far_size_m=16.0, global_size_m=32.0),
    "view-10m": Preset(5.0, 180.0, size_m=10.0, pixels=64, far_size_m=20.0, global_size_m=32.0),
    "round-10m": Preset(10.0, 360.0, size_m=20.0, pixels=80, far_size_m=40.0, global_size_m=48.0),
    "round-20m": Preset(20.0, 360.0, size_m=40.0, pixels=80, far_size_m=60.0, global_size_m=80.0),
}
"""The presets by name: the paper's, with a view of 4 m or, for obstacle avoidance, of 3 m; its laser with a view of
everything that it can see; and lasers that see in all directions, as is usual today, with views of their full range."""


def with_preset(name: str, config: SimulatorConfig) -> SimulatorConfig:
    """Return a configuration with the laser and the view of a preset.

    Raises
    ------
    ConfigError
        There is no preset of that name.

    Examples
    --------
    >>> with_preset("round-10m", SimulatorConfig()).laser.fov_deg
    360.0
    """
    if name not in PRESETS:
        raise ConfigError(f"config: expected a SimulatorConfig or one of {', '.join(PRESETS)}; found {name!r}")
    preset = PRESETS[name]
    laser = replace(config.laser, range_m=preset.range_m, fov_deg=preset.fov_deg)
    view = replace(
        config.observation,
        size_m=preset.size_m or config.observation.size_m,
        pixels=preset.pixels,
        far_size_m=preset.far_size_m,
        global_size_m=preset.global_size_m,
    )
    return replace(config, laser=laser, observation=view)


MAX_FRONTIERS = 1024


@dataclass(frozen=True)
class PlanningConfig:
    """Configuration of planners' actions, in addition to the simulator's.

    Parameters
    ----------
    frontiers
        Largest number of frontiers to choose from.
    large_m, least_m
        Frontiers at least ``large_m`` long come first in the ranking; those shorter than ``least_m`` are left out.
    settled_m
        A frontier counts as seen when its middle is known and there is no unknown cell beside a free one within this
        distance (in x and in y) of the middle.
    max_steps
        Largest number of simulator steps in one action.
    """

    frontiers: int = 16
    large_m: float = 0.4
    least_m: float = 0.0
    settled_m: float = 0.5
    max_steps: int = 60

    def __post_init__(self) -> None:
        check_whole_number(self.frontiers, "planning.frontiers", at_least=1, at_most=MAX_FRONTIERS)
        check_whole_number(self.max_steps, "planning.max_steps", at_least=1)
        for name in ("large_m", "least_m", "settled_m"):
            check_number(getattr(self, name), f"planning.{name}", at_least=0.0, at_most=1000.0)
