"""PseudoSLAM: a simulated robot in a floor plan, and the map that SLAM would build from its observations.

Importing this registers the environments with gymnasium::

    import gymnasium
    import houseexpo.pseudoslam

    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset="plans/demo")

``SimulatorConfig.max_steps`` limits the length of an episode; there is no separate wrapper for that.
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
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.config.obstacles import (
    Circle,
    Ellipse,
    Obstacle,
    ObstaclesConfig,
    Polygon,
    RandomObstacles,
    Rectangle,
)
from houseexpo.pseudoslam.simulator import OccupancyGrid, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.teams import parallel_env, parallel_vector_env
from houseexpo.pseudoslam.teams.tasks import Radio
from houseexpo.pseudoslam.worlds.cache import world_for
from houseexpo.pseudoslam.worlds.maps import MapHouse, map_house, open_maps
from houseexpo.pseudoslam.worlds.world import World

__all__ = [
    "Circle",
    "Ellipse",
    "GoalConfig",
    "LaserConfig",
    "MapHouse",
    "NoiseConfig",
    "ObservationConfig",
    "Obstacle",
    "ObstaclesConfig",
    "OccupancyGrid",
    "PeopleConfig",
    "Polygon",
    "Radio",
    "RandomObstacles",
    "Rectangle",
    "RobotConfig",
    "Simulator",
    "SimulatorConfig",
    "StartConfig",
    "State",
    "Trajectory",
    "World",
    "map_house",
    "open_maps",
    "parallel_env",
    "parallel_vector_env",
    "world_for",
]

for _task in ("Exploration", "ObstacleAvoidance", "Navigation"):
    register(
        f"PseudoSLAM/{_task}-v0",
        entry_point=f"houseexpo.pseudoslam.envs.single:{_task}Env",
        vector_entry_point=f"houseexpo.pseudoslam.envs.vector:{_task}VectorEnv",
    )
