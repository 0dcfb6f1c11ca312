"""Find the ``max_episode_steps`` given to ``gymnasium.make``, which it does not pass on to the environment."""

from __future__ import annotations

import inspect
from typing import Any

import gymnasium


def steps_asked_of_make(kind: type[gymnasium.Env[Any, Any]]) -> int | None:
    """Return ``max_episode_steps`` of the call of ``gymnasium.make`` that is making an environment of this class.

    ``make`` keeps that argument, and the one of a registration, for its wrapper ``TimeLimit``, which can shorten
    episodes but not lengthen them: an environment with a limit of its own would end first, in silence. So it is read
    from the call itself. Return None without such a call, and if neither names a number; -1 means no wrapper.
    """
    frame = inspect.currentframe()
    while frame is not None and frame.f_code is not gymnasium.make.__code__:
        frame = frame.f_back
    if frame is None or frame.f_locals.get("env_creator") is not kind:  # the caller makes an environment of its own
        return None
    asked, spec = frame.f_locals.get("max_episode_steps"), frame.f_locals.get("env_spec")
    steps: int | None = asked if asked is not None else getattr(spec, "max_episode_steps", None)
    return None if steps == -1 else steps
