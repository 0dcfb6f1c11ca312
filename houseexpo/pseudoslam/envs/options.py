"""What all environments take beside what their own parameters say."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, TypedDict

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
