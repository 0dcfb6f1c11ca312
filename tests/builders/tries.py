"""How many examples a property is tried on: in the quick run a half of what the whole run tries."""

from __future__ import annotations

from typing import Any

from hypothesis import settings

_share = 1.0


def try_half() -> None:
    """Let properties that are read from now on be tried on a half of their examples."""
    global _share  # noqa: PLW0603 - read while the files are collected, before any fixture
    _share = 0.5


def tries(number: int, **more: Any) -> settings:
    """Return the settings of a property that the whole run tries on so many examples, without a time limit for one."""
    return settings(max_examples=max(round(number * _share), 1), deadline=None, **more)
