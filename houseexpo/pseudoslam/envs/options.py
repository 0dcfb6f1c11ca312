"""Arguments that all environments have in common."""

from __future__ import annotations

from collections.abc import Iterable
from inspect import signature
from typing import Literal, TypedDict

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.envs.plan_choice import Order

Layout = Literal["CHW", "HWC"]


class EnvOptions(TypedDict, total=False):
    """Arguments of single and vector environments, and of ``gymnasium.make`` and ``make_vec``."""

    layout: Layout
    """Position of the channels of maps: "CHW", first as in torch, or "HWC", last as in pictures (for several channels,
    as a view of the former)."""
    plan_ids: Iterable[str] | None
    """Ids of the plans for episodes; None for all plans of the data set."""
    plan_order: Order
    """"random", or "in_turn": each plan once, in the order of the list, then again from the first, as after a seed."""
    max_episode_steps: int | None
    """Number of steps after which an episode is truncated, instead of ``config.max_steps``. ``gymnasium.make`` uses
    this argument for its own wrapper, which can only shorten episodes; for longer ones, set ``max_steps``."""


def check_options(kind: type, given: Iterable[str]) -> None:
    """Raise ConfigError if an environment of this class does not have one of the given arguments."""
    known = EnvOptions.__annotations__
    for name in given:
        if name not in known:
            own = (each for base in kind.__mro__ if "__init__" in vars(base) for each in signature(base).parameters)
            takes = sorted({*known, *own} - {"self", "task", "args", "kwargs", "more"})
            raise ConfigError(f"{kind.__name__}: there is no argument {name!r}; it takes {', '.join(takes)}")
