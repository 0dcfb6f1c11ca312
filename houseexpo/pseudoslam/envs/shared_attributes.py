"""Attributes of the environments in a vector environment, which share them."""

from __future__ import annotations

from typing import Any

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.tasks import Task

SETTABLE = ("task", "plan_ids")
"""Attributes that can be set later: the task, from the next step on, and the plans, from the next episodes on."""

FOR_ALL = ("reset", "step", "close", "call", "get_attr", "set_attr")
"""Methods that exist only for all environments together."""


class SharedAttributes:
    """The methods ``call``, ``get_attr`` and ``set_attr`` of a vector environment."""

    num_envs: int
    task: Task

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return the result of a method for each environment; its first argument is the number, as in ``state``.

        "render" gives a picture of each. For an attribute, this is ``get_attr``. Raise ConfigError for a method that is
        only for all environments together.
        """
        found = getattr(self, name)
        if not callable(found):
            return (found,) * self.num_envs
        if name == "render":
            return tuple(found() or (None,) * self.num_envs)
        if name in FOR_ALL:
            raise ConfigError(f"{name}: the environments are one; call {name}() itself, which is for all of them")
        return tuple(found(i, *args, **kwargs) for i in range(self.num_envs))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute for each environment; all share the same one."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute that all environments share.

        A ``task`` must be of the same kind and applies from the next step on; ``plan_ids`` apply from the next episodes
        on. Other names are new attributes of the caller.

        Parameters
        ----------
        values
            One value for all, or a list or tuple of N equal ones; ``plan_ids`` is one list for all.

        Raises
        ------
        ConfigError
            The attribute is fixed when the environments are made, or the values differ.
        """
        value = values if name == "plan_ids" else self._one_for_all(name, values)
        if hasattr(self, name) and name not in (*SETTABLE, *self._own):
            raise ConfigError(
                f"{name}: the environments are one, and made with what they are; make new ones (what can be set: "
                f"{', '.join(SETTABLE)}, and names of your own)"
            )
        if name == "task":
            self._check_task(value)
        elif name not in SETTABLE:
            self._own |= {name}
        setattr(self, name, value)

    _own: frozenset[str] = frozenset()
    """The names of attributes that the caller has set."""

    def _one_for_all(self, name: str, values: Any) -> Any:
        if not isinstance(values, (list, tuple)):
            return values
        first = values[0] if values else None
        if len(values) != self.num_envs or not all(_are_equal(value, first) for value in values):
            raise ConfigError(
                f"{name}: expected one value, or {self.num_envs} that are equal, for the environments share it; "
                f"found {values!r}"
            )
        return first

    def _check_task(self, task: Any) -> None:
        if type(task) is not type(self.task):
            raise ConfigError(f"task: expected another {type(self.task).__name__}, found {task!r}")
        if task.rewards_add_up != self.task.rewards_add_up:
            raise ConfigError(
                f"task: expected one whose rewards add up over steps as those of the present one do, or do not, found "
                f"{task!r}; make new environments"
            )
        if task.clearance_m != self.task.clearance_m:
            raise ConfigError(
                f"task: expected one that measures {self.task.clearance_m:g} m round the robot as the present one "
                f"does, found {task.clearance_m:g} m; make new environments"
            )


def _are_equal(one: Any, other: Any) -> bool:
    """Return whether two values, which may be arrays, are equal."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return bool(one is other or one == other)
