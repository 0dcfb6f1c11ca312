"""Several robots in one house: ``parallel_env`` (needs PettingZoo) and the gymnasium ``parallel_vector_env``."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from houseexpo.errors import MissingDependencyError, install_command
from houseexpo.pseudoslam.teams.tasks import Radio
from houseexpo.pseudoslam.worlds.maps import Plans

if TYPE_CHECKING:
    from houseexpo.pseudoslam.teams.env import TeamEnv
    from houseexpo.pseudoslam.teams.vector import TeamVectorEnv


def parallel_env(
    task: str = "exploration",
    *,
    robots: int = 2,
    dataset: Plans,
    radio: Radio | str = "none",
    **options: Any,
) -> TeamEnv:
    """Return an environment with several robots in one house, a PettingZoo ``ParallelEnv``.

    Agents are ``robot_0``, ``robot_1`` and so on. They move one after the other in a step, are obstacles to each other,
    and each has its own map. An episode ends for all at the same time. ``info`` has the entries of the single
    environment, "hears" (n,), and "team" with the measures of ``teams.team.Team.report``. With
    one robot, observations, rewards and ends are those of the single environment.

    Parameters
    ----------
    task
        "exploration", whose rewards, end and options ``teams.tasks.TeamExploration`` describes.
    robots
        Number of robots, 1 to 16.
    dataset
        The path of a data set, a data set, a plan or a list of plans.
    radio
        How the robots communicate, or the name of ``Radio.model`` with its default values.
    options
        The options of the task; ``config``, ``motion``, ``actions`` ("discrete" or "continuous"), ``observation``
        ("map", "dict" or "scales") and ``envs.spec.EnvOptions``, as in the single environment.

    Raises
    ------
    ConfigError
        An argument is invalid. ``reset`` raises it where robots overlap at their starts, or the house has no room.
    MissingDependencyError
        PettingZoo is not installed.
    """
    from houseexpo.pseudoslam.teams.tasks import make_task

    chosen_task, rest = make_task(task, options)
    if find_spec("pettingzoo") is None:
        raise MissingDependencyError(f"A team needs pettingzoo, which is not installed: {install_command('teams')}")
    from houseexpo.pseudoslam.teams.env import TeamEnv

    chosen = Radio(radio) if isinstance(radio, str) else radio  # type: ignore[arg-type]  # Radio checks it
    return TeamEnv(chosen_task, dataset, robots=robots, radio=chosen, **rest)


def parallel_vector_env(
    task: str = "exploration",
    *,
    num_envs: int = 1,
    robots: int = 2,
    dataset: Plans,
    radio: Radio | str = "none",
    threads: int | None = None,
    **options: Any,
) -> TeamVectorEnv:
    """Return N teams of R robots, each team in its own house, as a gymnasium ``VectorEnv`` with an axis for robots.

    Robots follow teams in all arrays: actions are (N, R) or (N, R, 2), observations (N, R, ...), rewards (N, R).
    Episodes end for a whole team, so terminated and truncated are (N,). The bits are those of N ``parallel_env``.

    After the end of an episode, the team's next step ignores its actions, starts the next episode, and has rewards of 0
    (gymnasium's NEXT_STEP). ``info`` has the entries of the robots (N, R, ...), "hears" (N, R, R), "plan_id" (N,) and
    "team", a dictionary of measures (N,), NaN for what has not happened.

    Parameters
    ----------
    task, robots, dataset, radio, options
        Arguments of ``parallel_env``. PettingZoo is not needed.
    num_envs
        Number of teams, N.
    threads
        Number of threads; None for one per core. It does not change the results.

    Raises
    ------
    ConfigError
        An argument is invalid, or as in ``parallel_env``.
    """
    from houseexpo.pseudoslam.teams.tasks import make_task
    from houseexpo.pseudoslam.teams.vector import TeamVectorEnv

    chosen_task, rest = make_task(task, options)
    chosen = Radio(radio) if isinstance(radio, str) else radio  # type: ignore[arg-type]  # Radio checks it
    return TeamVectorEnv(chosen_task, dataset, num_envs=num_envs, robots=robots, radio=chosen, threads=threads, **rest)
