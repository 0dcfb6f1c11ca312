"""What gymnasium's vector environments say of the environments in them, where those are one."""

from __future__ import annotations

from typing import Any

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.tasks import Task

SETTABLE = ("task", "plan_ids")
"""What environments can be told after they are made: what counts, from the next step on, and which plans to take."""

FOR_ALL = ("reset", "step", "close", "call", "get_attr", "set_attr")
"""Methods that have no form for one of the environments."""


class SharedAttributes:
    """``call``, ``get_attr`` and ``set_attr``."""

    num_envs: int
    task: Task

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return a method's results for each environment; it takes the environment's number first, as ``state`` does.

        "render" gives each one's picture; of what is no method, as ``get_attr``. ConfigError where a method is for all.
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
        """Return an attribute for each environment: they share it."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute that all environments share.

        ``task``, of the same kind, counts from the next step on, ``plan_ids`` from the next episodes on; names that the
        environment does not know yet are the caller's own.

        Parameters
        ----------
        values
            One for all, or a list or tuple of N that are equal; ``plan_ids`` is one list for all.

        Raises
        ------
        ConfigError
            What the environments are made with cannot be set, and they cannot differ.
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
    """Names that the caller has set."""

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
    """Whether two values are, arrays also: ``==`` gives arrays for those."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return bool(one is other or one == other)
