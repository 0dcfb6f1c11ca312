"""The configuration of a simulation (the paper's Table I), with the paper's defaults (Table II)."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import number, whole
from houseexpo.pseudoslam.config.dynamics import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.config.robot import (
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
        Duration of an action in seconds, for moving obstacles.
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
        number(self.pixels_per_metre, "pixels_per_metre", above=0.0, at_most=200.0)
        number(self.step_s, "step_s", above=0.0, at_most=60.0)
        whole(self.max_steps, "max_steps", at_least=1)
        if not isinstance(self.trajectories, Iterable):
            raise ConfigError(f"trajectories: expected a list, found {self.trajectories!r}")
        object.__setattr__(self, "trajectories", tuple(self.trajectories))
        for i, trajectory in enumerate(self.trajectories):
            if not isinstance(trajectory, Trajectory):
                raise ConfigError(f"trajectories[{i}]: expected a Trajectory, found {trajectory!r}")
        if self.side_px < 2:
            raise ConfigError(
                f"observation.size_m: {self.observation.size_m:g} m "
                f"are no two cells at {self.pixels_per_metre:g} px/m; ask for more"
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
        ``config.yaml_files.read`` returns these notes.

        Raises
        ------
        ConfigError
            The file cannot be read or is not YAML, a key is unknown, or a value is invalid; the error names file and
            key.
        """
        from houseexpo.pseudoslam.config.yaml_files import read

        config, notes = read(cls, path)
        for note in notes:
            logging.getLogger("houseexpo.pseudoslam").info("%s: %s", path, note)
        return config

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, object]) -> SimulatorConfig:
        """Return the configuration from nested mappings; raise ConfigError for unknown keys and invalid values."""
        from houseexpo.configuration import config_from

        return config_from(cls, mapping)

    def to_mapping(self) -> dict[str, Any]:
        """Return the configuration as nested mappings of plain values, for ``from_mapping``."""
        from houseexpo.configuration import mapping_from

        return dict(mapping_from(self))

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
