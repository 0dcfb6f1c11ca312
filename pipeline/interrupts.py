"""Ctrl-C ends a command cleanly and in time, also where a library swallows it while it is imported."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from houseexpo.errors import INTERRUPTED

_TIMEOUT_S = 4.0


@contextmanager
def interruptible(last_words: str) -> Iterator[Callable[[], None]]:
    """Have Ctrl-C raise KeyboardInterrupt; yields a function that raises it again where it was swallowed.

    1. What does not end within some seconds is ended, with ``last_words``; the workers end with their parent.
    2. So is everything at once where Ctrl-C comes a second time.
    """
    asked = threading.Event()

    def end() -> None:
        sys.stderr.write(f"{last_words}\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)

    deadline = threading.Timer(_TIMEOUT_S, end)
    deadline.daemon = True

    def interrupt(*_: object) -> None:
        if asked.is_set():
            end()  # R2
        asked.set()
        deadline.start()  # R1
        raise KeyboardInterrupt

    def check() -> None:
        if asked.is_set():
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield check
    finally:
        deadline.cancel()
        signal.signal(signal.SIGINT, before)
