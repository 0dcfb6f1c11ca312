"""What the quick run tries: half as many examples of a property as the whole run, and some values of a parameter."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # a full machine is no fault of what is tried
settings.load_profile("untimed")

_share = 1.0


def try_half() -> None:
    """Let properties that are read from now on be tried on a half of their examples."""
    global _share  # noqa: PLW0603 - read while the files are collected, before any fixture
    _share = 0.5


def tries(number: int, **more: Any) -> settings:
    """Return the settings of a property that the whole run tries on so many examples."""
    return settings(max_examples=max(round(number * _share), 1), **more)


def slow_but(values: Iterable[Any], *quick: Any) -> list[Any]:
    """Return the values of a parameter, of which the quick run tries these alone."""
    return [value if value in quick else pytest.param(value, marks=pytest.mark.slow) for value in values]
