"""PseudoSLAM: a simulated robot in a floor plan, and the map that a SLAM would have made of what it saw.

Importing this registers the environments with gymnasium::

    import gymnasium
    import houseexpo.pseudoslam

    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset="datasets/demo")

An episode's length is ``SimulatorConfig.max_steps``; no wrapper cuts it off.
"""

from __future__ import annotations

from gymnasium.envs.registration import register

from houseexpo.pseudoslam.config import (
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.dynamics_config import PeopleConfig, Trajectory
from houseexpo.pseudoslam.obstacle_config import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.shapes import Circle, Ellipse, Obstacle, Polygon, Rectangle
from houseexpo.pseudoslam.simulator import OccupancyGrid, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.world import World
from houseexpo.pseudoslam.worlds import world_for

__all__ = [
    "Circle",
    "Ellipse",
    "GoalConfig",
    "LaserConfig",
    "NoiseConfig",
    "ObservationConfig",
    "Obstacle",
    "ObstaclesConfig",
    "OccupancyGrid",
    "PeopleConfig",
    "Polygon",
    "RandomObstacles",
    "Rectangle",
    "RobotConfig",
    "Simulator",
    "SimulatorConfig",
    "StartConfig",
    "State",
    "Trajectory",
    "World",
    "world_for",
]

for _task in ("Exploration", "ObstacleAvoidance", "Navigation"):
    register(
        f"PseudoSLAM/{_task}-v0",
        entry_point=f"houseexpo.pseudoslam.env:{_task}Env",
        vector_entry_point=f"houseexpo.pseudoslam.vector_env:{_task}VectorEnv",
    )
