"""Make a team's task by its name: exploration, rendezvous, patrol, coverage or pursuit."""

from __future__ import annotations

from typing import Any, Final

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.teams.tasks.coverage import Coverage
from houseexpo.pseudoslam.teams.tasks.exploration import TeamExploration
from houseexpo.pseudoslam.teams.tasks.patrol import Patrol
from houseexpo.pseudoslam.teams.tasks.pursuit import Pursuit
from houseexpo.pseudoslam.teams.tasks.rendezvous import Rendezvous
from houseexpo.pseudoslam.teams.tasks.task import TeamTask
from houseexpo.words import suggest_name

TASKS: Final[dict[str, type[TeamTask]]] = {
    kind.name: kind for kind in (TeamExploration, Rendezvous, Patrol, Coverage, Pursuit)
}
"""The tasks by the names that ``parallel_env`` takes."""


def make_task(task: str | TeamTask, options: dict[str, Any]) -> tuple[TeamTask, dict[str, Any]]:
    """Return a task by its name, made with those of the options that are its own, and the other options.

    Raise ConfigError if there is no such task, or an option is invalid.
    """
    if isinstance(task, TeamTask):
        return task, options
    if not isinstance(task, str) or task not in TASKS:
        near = suggest_name(task, list(TASKS)) if isinstance(task, str) else ""
        raise ConfigError(f"task: expected one of {', '.join(TASKS)}, or a TeamTask; found {task!r}" + near)
    own = TASKS[task].options()
    return (
        TASKS[task](**{name: value for name, value in options.items() if name in own}),
        {name: value for name, value in options.items() if name not in own},
    )
