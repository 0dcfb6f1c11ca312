"""What all environments take beside what their own parameters say."""

from __future__ import annotations

from collections.abc import Iterable
from inspect import signature
from typing import Literal, TypedDict

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.envs.plan_choice import Order

Layout = Literal["CHW", "HWC"]


class EnvOptions(TypedDict, total=False):
    """Arguments of single and vector environments alike, and of ``gymnasium.make`` and ``make_vec``."""

    layout: Layout
    """Where maps have their channels: "CHW", first, as torch has it, or "HWC", last, as pictures do (views, not copies,
    of what is first where there are several)."""
    plan_ids: Iterable[str] | None
    """Plans that episodes take; None: all of the data set."""
    plan_order: Order
    """"random", or "in_turn": each of them once, as they are listed, then from the first again. A seed starts over."""
    max_episode_steps: int | None
    """Steps after which an episode is truncated, instead of ``config.max_steps``. ``gymnasium.make`` keeps this
    argument for a wrapper of its own, which can only shorten episodes: for longer ones set ``max_steps``."""


def check_options(kind: type, given: Iterable[str]) -> None:
    """Raise ConfigError where an environment of this class is given an argument that it does not take."""
    known = EnvOptions.__annotations__
    for name in given:
        if name not in known:
            own = (each for base in kind.__mro__ if "__init__" in vars(base) for each in signature(base).parameters)
            takes = sorted({*known, *own} - {"self", "task", "args", "kwargs", "more"})
            raise ConfigError(f"{kind.__name__}: there is no argument {name!r}; it takes {', '.join(takes)}")
