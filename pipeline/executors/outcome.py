"""What an executor promises: the limits of an item, and why one has no result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["timeout", "memory", "killed", "died", "raised"]


@dataclass(frozen=True)
class Limits:
    """What one item may take: seconds of wall clock, bytes of memory that its worker allocates."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Failure:
    """Why an item has no result.

    ``killed``: the system ended its workers one after the other, as its memory guard does. ``died``: its workers
    crashed one after the other. ``raised``: the function raised, which it should not.
    """

    kind: Kind
    detail: str
