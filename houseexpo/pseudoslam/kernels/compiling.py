"""What happens while kernels are compiled: the user is told, and the garbage collector rests.

The compiler makes millions of small objects that live until it is done; the collector would look through all of them
again and again, a fifth of the time that compiling takes.
"""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import NamedTuple

from numba.core.event import Event, Listener, register

_LOGGER = logging.getLogger("houseexpo.pseudoslam")
_LINE = "compiling kernels of the simulator that were not used before, up to 40 s; they are kept on disk"


class Compiling(NamedTuple):
    """What is compiled in this process, or waited for: whether something is now, and how many functions are done."""

    is_busy: bool
    functions: int


class _Nested(Listener):
    """Hears when compiling of a package's functions begins and ends.

    Kernels are compiled one at a time, under the compiler's lock, each within the one that calls it.
    """

    def __init__(self, package: str, begin: Callable[[], None], end: Callable[[], None]) -> None:
        self._package, self._begin, self._end = package, begin, end
        self._within = 0
        self.done = 0

    def on_start(self, event: Event) -> None:
        """Compiling begins."""
        if self._is_ours(event):
            self._within += 1
            if self._within == 1:
                self._begin()

    def on_end(self, event: Event) -> None:
        """Compiling has ended, or failed."""
        if self._is_ours(event):
            self._within -= 1
            self.done += 1
            if self._within == 0:
                self._end()

    def _is_ours(self, event: Event) -> bool:
        function = event.data["dispatcher"].py_func
        return str(function.__module__).startswith(self._package)

    @property
    def is_busy(self) -> bool:
        """Whether a function is being compiled."""
        return self._within > 0


_watched: list[_Nested] = []
_waiting: list[object] = []


def compiling_now() -> Compiling:
    """Return how far compiling is, of the functions of packages that are watched (``watch_compiling``)."""
    busy = bool(_waiting) or any(each.is_busy for each in _watched)
    return Compiling(busy, sum(each.done for each in _watched))


@contextmanager
def compiled_elsewhere() -> Iterator[None]:
    """Count as compiling what waits for another process that compiles."""
    _waiting.append(None)
    try:
        yield
    finally:
        _waiting.pop()


@cache
def say_once() -> None:
    """Say, once in a process, that kernels are compiled."""
    _LOGGER.warning(_LINE)


class _Watch:
    """Says that kernels are compiled, and switches the collector off meanwhile, where it was on."""

    def __init__(self) -> None:
        self._was_on = False

    def begin(self) -> None:
        """Compiling begins."""
        self._was_on = gc.isenabled()
        gc.disable()
        say_once()

    def end(self) -> None:
        """Compiling has ended."""
        if self._was_on:
            gc.enable()


def watch_compiling(package: str) -> None:
    """Say so, and let the collector rest, while functions of a package are compiled."""
    watch = _Watch()
    _watched.append(on_compiling(package, watch.begin, watch.end))


def on_compiling(package: str, begin: Callable[[], None], end: Callable[[], None]) -> _Nested:
    """Call one function before functions of a package are compiled in this process, and the other one after that."""
    listener = _Nested(f"{package}.", begin, end)
    register("numba:compile", listener)  # type: ignore[no-untyped-call]
    return listener
