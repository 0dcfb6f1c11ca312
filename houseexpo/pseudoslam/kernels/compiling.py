"""Find compiled kernels; inform the user and pause the garbage collector while they are compiled.

The compiler makes millions of small objects that exist until it is done. The collector would traverse all of them
repeatedly, which would take a fifth of the time of compiling.
"""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from numba.core.event import Event, Listener, register

_LOGGER = logging.getLogger("houseexpo.pseudoslam")
_LINE = (
    "compiling the simulator for its first use: this takes half a minute, or some minutes on a busy machine; "
    "later runs load it from disk"
)


class CompilingProgress(NamedTuple):
    """The progress of compiling in this process: whether it is active, functions done."""

    is_busy: bool
    functions: int


def compiled_function(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """Return the compiled function of a kernel for such arguments, which numba needs 20 us to find at each call."""
    if not hasattr(kernel, "compile"):  # numba is disabled
        plain: Callable[..., Any] = kernel
        return plain
    compiled: Callable[..., Any] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
    return compiled


class _Nested(Listener):
    """A listener that is notified when compiling of a package's functions begins and ends.

    Kernels are compiled one at a time, under the compiler's lock, each during the compilation of the one that calls it.
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
        """Return whether a function is being compiled."""
        return self._within > 0


_watched: list[_Nested] = []


def compiling_progress() -> CompilingProgress:
    """Return the progress of compiling the functions of watched packages (``watch_compiling``)."""
    return CompilingProgress(any(each.is_busy for each in _watched), sum(each.done for each in _watched))


@cache
def report_compiling_once() -> None:
    """Report, once per process, that kernels are compiled."""
    _LOGGER.warning(_LINE)


class _Watch:
    """Reports that kernels are compiled, and meanwhile disables the collector if it was enabled."""

    def __init__(self) -> None:
        self._was_on = False

    def begin(self) -> None:
        """Compiling begins."""
        self._was_on = gc.isenabled()
        gc.disable()
        report_compiling_once()

    def end(self) -> None:
        """Compiling has ended."""
        if self._was_on:
            gc.enable()


def watch_compiling(package: str) -> None:
    """Report it and pause the collector while functions of a package are compiled."""
    watch = _Watch()
    _watched.append(call_around_compiling(package, watch.begin, watch.end))


def call_around_compiling(package: str, begin: Callable[[], None], end: Callable[[], None]) -> _Nested:
    """Call ``begin`` before functions of a package are compiled in this process, and ``end`` afterwards."""
    listener = _Nested(f"{package}.", begin, end)
    register("numba:compile", listener)  # type: ignore[no-untyped-call]
    return listener
