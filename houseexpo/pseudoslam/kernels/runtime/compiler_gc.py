"""The garbage collector rests while a kernel is compiled.

The compiler makes millions of small objects that live until it is done; the collector would look through all of them
again and again, a fifth of the time that compiling takes.
"""

from __future__ import annotations

import gc

from numba.core.event import Event, Listener, register


class _Rest(Listener):
    """Switches the collector off at the start of the outermost kernel and on at its end, where it was on before.

    Kernels are compiled one at a time, under the compiler's lock, each within the one that calls it.
    """

    def __init__(self, package: str) -> None:
        self._package = package
        self._within = 0
        self._was_on = False

    def on_start(self, event: Event) -> None:
        """Compiling begins."""
        if self._is_ours(event):
            self._within += 1
            if self._within == 1:
                self._was_on = gc.isenabled()
                gc.disable()

    def on_end(self, event: Event) -> None:
        """Compiling has ended, or failed."""
        if self._is_ours(event):
            self._within -= 1
            if self._within == 0 and self._was_on:
                gc.enable()

    def _is_ours(self, event: Event) -> bool:
        function = event.data["dispatcher"].py_func
        return str(function.__module__).startswith(self._package)


def pause_gc_while_compiling(package: str) -> None:
    """Let the collector rest while functions of a package are compiled."""
    register("numba:compile", _Rest(f"{package}."))  # type: ignore[no-untyped-call]
