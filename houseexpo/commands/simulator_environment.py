"""Make the simulator environment of the commands ``play`` and ``record`` from their arguments."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from houseexpo.errors import ConfigError

if TYPE_CHECKING:
    from houseexpo.pseudoslam.agents.protocol import Interface
    from houseexpo.pseudoslam.config import SimulatorConfig
    from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
    from houseexpo.pseudoslam.worlds.maps import Plans

TaskName = Literal["exploration", "avoidance", "navigation"]
MotionName = Literal["discrete", "differential", "ackermann"]
TaskOption = Annotated[TaskName, typer.Option(help="Task of the robot; avoidance has a room of its own.")]
MotionOption = Annotated[
    MotionName | None,
    typer.Option(help="How the robot moves: exactly, or with a drive.", show_default="the file's, else discrete"),
]


def make_environment(
    dataset: Path | None,
    plan: str | None,
    task: TaskName,
    config: Path | None,
    max_steps: int,
    *,
    interface: Interface | None = None,
    ranges: bool = False,
    resolution: float | None = None,
    motion: MotionName | None = None,
) -> tuple[PseudoSlamEnv, dict[str, Any]]:
    """Return an environment and the options for its resets; ``max_steps`` applies if no configuration is given.

    Parameters
    ----------
    interface
        The driver's observations and actions; None for single steps, or the commands of a drive, and the map.
    ranges
        Whether the observation is a dictionary with the laser's ranges, which also contains the map.
    resolution
        The side of a cell of maps that do not say it, metres.
    motion
        How the robot moves; None for what the configuration says.
    """
    from houseexpo.pseudoslam.agents.protocol import Interface
    from houseexpo.pseudoslam.config import SimulatorConfig
    from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv, ObstacleAvoidanceEnv
    from houseexpo.pseudoslam.tasks import Exploration, Navigation, ObstacleAvoidance
    from houseexpo.pseudoslam.worlds.maps import common_resolution, open_houses

    make, default = {
        "exploration": (ExplorationEnv, Exploration.default),
        "avoidance": (ObstacleAvoidanceEnv, ObstacleAvoidance.default),
        "navigation": (NavigationEnv, Navigation.default),
    }[task]
    houses = _plans(dataset, plan, task, resolution)
    given: SimulatorConfig = SimulatorConfig.from_yaml(config) if config else replace(default, max_steps=max_steps)
    if config is None and (own := common_resolution(open_houses(houses))) is not None:
        given = replace(given, pixels_per_metre=own)
    wanted = interface or Interface()
    if wanted.view is not None:
        given = replace(given, observation=wanted.view)
    observation = "dict" if ranges and wanted.observation == "map" else wanted.observation
    actions = interface.actions if interface else None
    masks = {"action_mask": True} if wanted.action_mask else {}
    env = make(houses, given, actions=actions, observation=observation, motion=motion, **masks)
    return env, {"plan_id": plan} if plan else {}


def _plans(dataset: Path | None, plan: str | None, task: TaskName, resolution: float | None) -> Plans:
    """Return the named plans or maps; if there are none, the paper's room for avoidance, or else the fetched plans."""
    from houseexpo.commands.arguments import is_plan_file, open_data_set
    from houseexpo.floorplan import load_plan
    from houseexpo.pseudoslam.tasks import ROOM
    from houseexpo.pseudoslam.worlds.maps import has_maps, open_maps

    if dataset is not None and has_maps(dataset):
        return open_maps(dataset, resolution)
    if dataset is not None and is_plan_file(dataset):
        return load_plan(dataset)
    if dataset is None and plan is None and task == "avoidance":
        return ROOM
    try:
        return open_data_set(dataset)
    except ConfigError as error:
        raise ConfigError(
            f"{task}: which houses? Name a data set or a plan's file: `make dataset` builds plans/demo, `houseexpo "
            "fetch` brings the published one, which is taken where none is named"
        ) from error
