"""Export the classes that configure simulations, with the paper's defaults; mappings and YAML files make them too."""

from houseexpo.pseudoslam.config.robot import (
    FURTHEST_M,
    MAX_BEAMS,
    MAX_SIDE_PX,
    Ackermann,
    Differential,
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    Odometry,
    RobotConfig,
    ScanRule,
    StartConfig,
)
from houseexpo.pseudoslam.config.simulator import SimulatorConfig

__all__ = [
    "FURTHEST_M",
    "MAX_BEAMS",
    "MAX_SIDE_PX",
    "Ackermann",
    "Differential",
    "GoalConfig",
    "LaserConfig",
    "NoiseConfig",
    "ObservationConfig",
    "Odometry",
    "RobotConfig",
    "ScanRule",
    "SimulatorConfig",
    "StartConfig",
]
