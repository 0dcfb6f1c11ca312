"""What the quick run tries: half as many examples of a property as the whole run, and some values of a parameter.

Hypothesis draws some of the numbers and words of an example from the constants of all modules of ours that are loaded,
with ``derandomize`` too, and no setting prevents it. So a change of one module changes the examples of other modules'
properties, and a fault that few examples show may come up after any change. We keep these draws, because thresholds are
where faults are. ``python -m pytest -m hypothesis --tries 40`` looks for such faults: forty times as many examples,
drawn anew.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # a full machine is no fault of what is tried
settings.load_profile("untimed")

_share = 1.0


def set_share(share: float) -> None:
    """Let properties that are read from now on be tried on this share of their examples; above 1, drawn anew."""
    global _share  # noqa: PLW0603 - read while the files are collected, before any fixture
    _share = share


def tries(number: int, **more: Any) -> settings:
    """Return the settings of a property that the whole run tries on so many examples."""
    if _share > 1:
        more["derandomize"] = False
    return settings(max_examples=max(round(number * _share), 1), **more)


def slow_but(values: Iterable[Any], *quick: Any) -> list[Any]:
    """Return the values of a parameter, of which the quick run tries these alone."""
    return [value if value in quick else pytest.param(value, marks=pytest.mark.slow) for value in values]
