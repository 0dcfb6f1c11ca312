"""Run the threads that listen to a network: one that ends by an error says so and begins again."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

_AGAIN_S: Final = 1.0
_ERROR_LETTERS: Final = 200  # characters of an error's text


def start_lasting_thread(
    work: Callable[[], None], name: str, *, closed: threading.Event, warn: Callable[[str], None]
) -> threading.Thread:
    """Start a daemon thread that does ``work`` until it returns, and begins it again a second after an error.

    Parameters
    ----------
    name
        What the thread does, for the sentence that ``warn`` gets.
    closed
        Set by whoever needs the thread no longer.
    """

    def last() -> None:
        while True:
            try:
                work()
            except Exception as error:  # noqa: BLE001 - whatever it was, the command goes on and needs its network
                warn(f"{name}: {describe_error(error)}; it begins again in {_AGAIN_S:g} s")
            else:
                return
            if closed.wait(_AGAIN_S):
                return

    thread = threading.Thread(target=last, name=name, daemon=True)
    thread.start()
    return thread


def describe_error(error: Exception) -> str:
    """Return the kind and the text of an error in one short line."""
    return f"{type(error).__name__}: {error}"[:_ERROR_LETTERS]
