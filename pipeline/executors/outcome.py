"""The contract of an executor: the limits of an item, and the failures that it reports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
Kind = Literal["timeout", "memory", "killed", "died", "raised", "untried"]


@dataclass(frozen=True)
class Limits:
    """The limits of one item: seconds of wall clock, and bytes of memory allocated by its worker."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Failure:
    """Why an item has no result.

    ``killed``: the system ended its workers one after the other, as its memory guard does. ``died``: its workers
    crashed one after the other. ``raised``: the function raised, which it should not. ``untried``: nobody has begun it.
    """

    kind: Kind
    detail: str


class Executor(Protocol):
    """Maps a function over items: yields each item with its result or its failure, in the order they end.

    The function, the items and the results are pickled. Modules named in ``preload`` are imported before.
    """

    def __call__(
        self, function: Callable[[Item], Result], items: Iterable[Item], *, limits: Limits, preload: Sequence[str]
    ) -> Iterator[tuple[Item, Result | Failure]]:
        """Begin; items are taken from their iterator as there is room for them."""
        ...
