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
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
    StartConfig,
)
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.world import World, make_world

__all__ = [
    "LaserConfig",
    "NoiseConfig",
    "ObservationConfig",
    "RobotConfig",
    "Simulator",
    "SimulatorConfig",
    "StartConfig",
    "State",
    "World",
    "make_world",
]

for _task in ("Exploration", "ObstacleAvoidance", "Navigation"):
    register(
        f"PseudoSLAM/{_task}-v0",
        entry_point=f"houseexpo.pseudoslam.env:{_task}Env",
        vector_entry_point=f"houseexpo.pseudoslam.vector_env:{_task}VectorEnv",
    )
