"""Define the arguments that several commands have, and open what they name: a data set, plans, a simulator.

The data set is by default the largest fetched one. Plans are named by path, address, id or file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from houseexpo.errors import ConfigError
from houseexpo.files import read_text

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.floorplan import FloorPlan
    from houseexpo.pseudoslam.agents.protocol import Interface
    from houseexpo.pseudoslam.config import SimulatorConfig
    from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
    from houseexpo.pseudoslam.worlds.maps import Plans


REPLACE_HELP = "Overwrite files that houseexpo did not write."

HousesArgument = Annotated[
    Path | None,
    typer.Argument(
        help="Data set, one plan's JSON file, or a map or folder of maps (map.yaml, pgm, png, npy).",
        show_default="fetched",
    ),
]
DataSetArgument = Annotated[
    Path, typer.Argument(help="Data set: a folder, an archive or JSON lines.", show_default=False)
]
FetchedDataSet = Annotated[
    Path | None, typer.Argument(help="Data set: a folder, an archive or JSON lines.", show_default="fetched")
]
MapResolution = Annotated[
    float | None, typer.Option(help="Side of a cell of a map without a yaml, metres.", show_default="the yaml's")
]
Processes = Annotated[int | None, typer.Option(min=1, help="Number of processes.", show_default="one per core")]
ReplaceOption = Annotated[bool, typer.Option("--replace", help=REPLACE_HELP)]


def make_completion(*words: str) -> Callable[[str], list[str]]:
    """Return a function for shell completion: the words that start with what was typed."""

    def complete(incomplete: str) -> list[str]:  # typer identifies the parameter by its name
        return [word for word in words if word.startswith(incomplete)]

    return complete


POLICIES = (
    *("random", "spin", "forward", "wall", "frontier", "random-frontier", "frontier-mapex"),
    *("information", "prospector", "tour", "chooser", "chooser-1", "chooser-2", "finisher", "look-around"),
    *("straight", "swift", "oracle"),
    *("seek", "seek-likely", "seek-likely-1", "seek-likely-2", "shortest", "wait", "keep-away"),
    *("give-way", "give-way-1", "give-way-2", "greedy", "a-star"),
)
"""The policies of the project. Their table would import the simulator; a test compares the two."""
PolicyName = Annotated[
    str,
    typer.Option(
        help="A name, a file (FILE.py, FILE.py:name, RUN/policy.pt), or module:name.",
        show_default=False,
        autocompletion=make_completion(*POLICIES),
    ),
]
IDS_HELP = "Ids, by commas, or @FILE with one a line; may be repeated."


def open_data_set(path: Path | None) -> Dataset:
    """Open the given data set, or else the largest subset of the published one that ``houseexpo fetch`` downloaded."""
    from houseexpo.dataset import open_dataset
    from houseexpo.dataset.fetch import subset_folder

    if path is not None:
        return open_dataset(path)
    for subset in ("all", "1000", "100", "10"):
        if (folder := subset_folder(subset)).is_dir():
            return open_dataset(folder)
    raise ConfigError("no data set: name one, or run houseexpo fetch, which brings the published plans")


def is_plan_file(name: str | Path) -> bool:
    """Return whether this is the file of one plan."""
    return Path(name).suffix == ".json" and Path(name).is_file()


def is_data_set(name: str | Path) -> bool:
    """Return whether this is an existing folder, archive or file of JSON lines, or the address of a service."""
    from houseexpo.dataset.store import address_in

    return bool(address_in(name)) or (Path(name).exists() and not is_plan_file(name))


def parse_ids(words: Sequence[str] | None) -> list[str]:
    """Return the ids in ``words``, each once, in order: separated by commas, or ``@FILE`` with one id per line.

    Raise ConfigError if a file cannot be read, or if there are words and no id is in them.
    """
    found: list[str] = []
    for word in words or ():
        found += _lines(Path(word[1:])) if word.startswith("@") else word.split(",")
    ids = list(dict.fromkeys(name.strip().removesuffix(".json") for name in found if name.strip()))
    if words and not ids:
        said = ", ".join(word.removeprefix("@") if word.startswith("@") else repr(word) for word in words)
        raise ConfigError(f"{said}: expected one id or more, found none; to take all plans, leave out --ids")
    return ids


def load_plans(names: Sequence[str], data: Path | None) -> list[FloorPlan]:
    """Return plans from files if they exist, or else by their ids in the data set (``parse_ids``)."""
    from houseexpo.floorplan import load_plan

    found, opened = [], None
    for name in names:
        if is_plan_file(name):
            found.append(load_plan(name))
            continue
        opened = _data_set_for_lookup(name, data) if opened is None else opened
        found += [opened[plan_id] for plan_id in parse_ids([name])]
    return found


def plans_from_arguments(what: Sequence[str], data: Path | None, ids: Sequence[str] | None) -> Sequence[FloorPlan]:
    """Return the plans that a command line names: those of a data set, all or by ``--ids``, or of files and ids."""
    from houseexpo.dataset import open_dataset

    if len(what) == 1 and is_data_set(what[0]):
        opened = open_dataset(what[0])
        return [opened[name] for name in parse_ids(ids)] if ids else opened
    return load_plans([*what, *(ids or ())], data)


def _data_set_for_lookup(name: str, data: Path | None) -> Dataset:
    """Return the data set in which to look up a word as an id."""
    try:
        return open_data_set(data)
    except ConfigError:
        if data is not None:
            raise
    if is_data_set(name):
        raise ConfigError(f"{name}: expected the file or the id of a plan beside others; a data set stands alone")
    raise ConfigError(
        f"{name}: no such file or folder, and no data set in which it could be an id; check the path, or name the data "
        "set with --dataset, or run houseexpo fetch"
    )


def _lines(file: Path) -> list[str]:
    try:
        lines = read_text(file).splitlines()
    except OSError as error:
        raise ConfigError(
            f"{file}: expected a text file with one id a line; it cannot be read ({error.strerror}); check the path"
        ) from None
    except UnicodeDecodeError:
        raise ConfigError(f"{file}: expected a text file with one id a line, found bytes that are no text") from None
    # the output of `stats --list-bad` has a tab after the id, which may contain spaces
    found = (line.partition("\t")[0] if "\t" in line else line.split(maxsplit=1)[0] for line in lines if line.strip())
    return [name for name in found if not name.startswith("#")]


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
