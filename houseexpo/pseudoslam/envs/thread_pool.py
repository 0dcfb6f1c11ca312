"""Threads that step a batch together with the caller's."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.runtime.thread_pool import (
    EPOCH,
    FAILED,
    INSIDE,
    LEADER,
    NUMBER,
    REJOINING,
    VIEWS,
    new_sync,
    outstanding,
    post,
    untaken,
)
from houseexpo.pseudoslam.kernels.types import Scratch

_LAG = 16
"""Views put off for each of the other threads: what it draws while the caller's makes rewards and infos of a step."""


@dataclass(eq=False)
class _Shared:
    """What the threads know; not the crew itself, so that it can go while they sleep."""

    scratch: list[Scratch]
    words: npt.NDArray[np.int64]
    wakes: list[threading.Event]
    work: tuple[Callable[..., None], tuple[Any, ...], int] | None = None
    """The kernel, its first arguments, and the epoch in which they hold, in one: they may be asked for at any time."""
    errors: list[BaseException] = field(default_factory=list)
    ended: bool = False

    def run(self, thread: int) -> None:
        """Take part in steps, the leader in one of its ways; return when there is none, or none comes for a while."""
        if self.work is None:
            return
        kernel, arguments, epoch = self.work
        try:
            kernel(*arguments, self.scratch[max(thread, LEADER)], self.words, epoch, thread)
        except BaseException as error:
            if thread > LEADER or isinstance(error, Exception):
                self.errors.append(error)
                self.words[FAILED] = 1  # nobody waits for what is not done
            raise  # what interrupts the caller's thread does so before or after a step: its kernel hears nothing


class ThreadPool:
    """The caller's thread and others, which share the environments of each step (``kernels.sync``).

    The others look out for the next step for half a millisecond, then sleep: who steps without a pause does not pay for
    waking them, and who does not pays little. In a process forked from this one there is only the caller's, and it does
    all.
    """

    def __init__(self, number: int, scratch: list[Scratch]) -> None:
        wakes = [threading.Event() for _ in scratch[1:]]
        lag = min(_LAG * len(wakes), number)
        self._shared = _Shared(scratch, new_sync(number, len(scratch), lag), wakes)
        self._is_finished = True
        self._post: Callable[..., Any]
        self._untaken: Callable[..., Any]
        self._outstanding: Callable[..., Any]
        self.close = weakref.finalize(self, _end, self._shared)
        for thread, wake in enumerate(wakes, start=1):
            name = f"pseudoslam-{thread}"
            threading.Thread(target=_follow, args=(self._shared, thread, wake), name=name, daemon=True).start()

    def take_on(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Set the kernel and its first arguments: the arrays that the steps to come are about."""
        shared = self._shared
        epoch = int(shared.words[EPOCH]) + 1
        said = (compiled(one, (shared.words,)) for one in (post, untaken, outstanding))
        self._post, self._untaken, self._outstanding = said
        ready = compiled(kernel, (*arguments, shared.scratch[0], shared.words, epoch, 0))
        shared.work, shared.words[EPOCH] = (ready, arguments, epoch), epoch

    def step(self, views: int = -1, meanwhile: Callable[[], bool] | None = None) -> None:
        """Do one step of all environments, but for some views that others go on to draw: see ``finish``.

        Parameters
        ----------
        views
            Which array takes their views; -1: the pool's own.
        meanwhile
            Work for the caller's thread while others step: it is called until it returns False, or they have taken half
            of the environments. A crew of one does not call it.
        """
        self._is_finished, shared = False, self._shared
        shared.words[VIEWS] = views
        if meanwhile is None or not shared.wakes:
            self._wake()
            self._lead(LEADER)
            return
        try:
            self._post(shared.words)
            self._wake()
            while 2 * self._untaken(shared.words) > shared.words[NUMBER] and meanwhile():
                self._wake()  # who fell asleep just before
        finally:
            self._lead(REJOINING)

    def finish(self) -> None:
        """Return when all views of the last step are drawn; with others, help to draw them.

        It comes before the next step, and before arrays are changed.
        """
        while not self._is_finished and (way := self._outstanding(self._shared.words)):
            self._lead(way)
        self._is_finished = True

    def _wake(self) -> None:
        """Wake those who neither work nor look out for work."""
        for thread, wake in enumerate(self._shared.wakes, start=1):
            if not self._shared.words[INSIDE + thread]:
                wake.set()

    def _lead(self, way: int) -> None:
        """Take part in a step as its leader, in one of its ways."""
        shared = self._shared
        if not shared.errors and shared.work is not None and shared.work[2] == shared.words[EPOCH]:
            shared.run(way)
            if not shared.errors:
                return
        cause = shared.errors[0] if shared.errors else None
        raise RuntimeError("a step of this batch has failed; make another") from cause


def compiled(kernel: Any, arguments: tuple[Any, ...]) -> Callable[..., Any]:
    """Return what a kernel is compiled to for arguments of such types: numba takes 10 us to find it at each call."""
    if not hasattr(kernel, "compile"):  # numba is off
        plain: Callable[..., Any] = kernel
        return plain
    found: Callable[..., Any] = kernel.compile(tuple(map(kernel.typeof_pyval, arguments)))
    return found


def _follow(shared: _Shared, thread: int, wake: threading.Event) -> None:
    while True:
        wake.wait()
        wake.clear()
        if shared.ended:
            return
        try:
            shared.run(thread)
        except BaseException:  # noqa: BLE001  # the caller's thread hears of it
            return


def _end(shared: _Shared) -> None:
    shared.ended = True
    for wake in shared.wakes:
        wake.set()
