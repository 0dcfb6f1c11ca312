"""What happens while kernels are compiled: the user is told, and the garbage collector rests.

The compiler makes millions of small objects that live until it is done; the collector would look through all of them
again and again, a fifth of the time that compiling takes.
"""

from __future__ import annotations

import gc
import logging

from numba.core.event import Event, Listener, register

_LOGGER = logging.getLogger("houseexpo.pseudoslam")
_LINE = "compiling kernels of the simulator that were not used before, up to 40 s; they are kept on disk"


class _Watch(Listener):
    """Says once in a process that kernels are compiled, and switches the collector off meanwhile, where it was on.

    Kernels are compiled one at a time, under the compiler's lock, each within the one that calls it.
    """

    def __init__(self, package: str) -> None:
        self._package = package
        self._within = 0
        self._was_on = False
        self._has_said = False

    def on_start(self, event: Event) -> None:
        """Compiling begins."""
        if self._is_ours(event):
            self._within += 1
            if self._within == 1:
                self._was_on = gc.isenabled()
                gc.disable()
            if not self._has_said:
                self._has_said = True
                _LOGGER.warning(_LINE)

    def on_end(self, event: Event) -> None:
        """Compiling has ended, or failed."""
        if self._is_ours(event):
            self._within -= 1
            if self._within == 0 and self._was_on:
                gc.enable()

    def _is_ours(self, event: Event) -> bool:
        function = event.data["dispatcher"].py_func
        return str(function.__module__).startswith(self._package)


def watch_compiling(package: str) -> None:
    """Say so, and let the collector rest, while functions of a package are compiled."""
    register("numba:compile", _Watch(f"{package}."))  # type: ignore[no-untyped-call]
