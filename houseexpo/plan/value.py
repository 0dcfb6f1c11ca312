"""Base class of frozen dataclasses with arrays: equality by value, and checks when they are unpickled."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


class Value:
    """Base of a frozen dataclass made with ``eq=False``."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _same(self._values(), other._values())

    def __hash__(self) -> int:
        return hash((type(self), getattr(self, "id", None)))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._values()

    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]  # subclasses are dataclasses

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


def _same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, comparing arrays, also inside tuples, by value."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)
