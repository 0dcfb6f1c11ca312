"""Making a team's environment, with or without PettingZoo installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal

from houseexpo.errors import ConfigError, MissingDependencyError, installing
from houseexpo.pseudoslam.teams.radio import Radio
from houseexpo.pseudoslam.worlds.maps import Plans

if TYPE_CHECKING:
    from houseexpo.pseudoslam.teams.env import TeamEnv


def parallel_env(
    task: Literal["exploration"] = "exploration",
    *,
    robots: int = 2,
    dataset: Plans,
    radio: Radio | str = "none",
    **options: Any,
) -> TeamEnv:
    """Return an environment with several robots in one house, a PettingZoo ``ParallelEnv``.

    Agents are ``robot_0``, ``robot_1`` and so on. They move one after the other in a step, are obstacles to each other,
    and each has its own map. With one robot, observations, rewards and ends are those of the single environment. A
    robot's reward is for what it saw itself. ``info`` has the entries of the single environment, "hears" (n,), and
    "team" with the measures of ``teams.team.Team.report``.

    Parameters
    ----------
    task
        "exploration".
    robots
        Number of robots, 1 to 16.
    dataset
        The path of a data set, a data set, a plan or a list of plans.
    radio
        How the robots communicate, or the name of ``Radio.model`` with its default values.
    options
        ``config``, ``motion``, ``actions`` ("discrete" or "continuous"), ``observation`` ("map", "dict" or "scales"),
        ``success_coverage``, ``reward`` and ``envs.spec.EnvOptions``, as in the single environment.

        ``until`` says when an episode terminates. "team": the maps of all robots together know ``success_coverage``.
        "robot": one robot's own map does. "report": one robot's own map does, and that robot is within ``report_m``
        (1 m) of where the first robot started.

    Raises
    ------
    ConfigError
        An argument is invalid. ``reset`` raises it where robots overlap at their starts, or the house has no room.
    MissingDependencyError
        PettingZoo is not installed.
    """
    if task != "exploration":
        raise ConfigError(f"task: expected 'exploration', found {task!r}")
    if find_spec("pettingzoo") is None:
        raise MissingDependencyError(f"A team needs pettingzoo, which is not installed: {installing('teams')}")
    from houseexpo.pseudoslam.teams.env import TeamEnv

    chosen = Radio(radio) if isinstance(radio, str) else radio  # type: ignore[arg-type]  # Radio checks it
    return TeamEnv(dataset, robots=robots, radio=chosen, **options)
