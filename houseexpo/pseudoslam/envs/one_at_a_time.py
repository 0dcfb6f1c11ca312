"""Methods that several threads can call, one at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import Any, TypeVar

Method = TypeVar("Method", bound=Callable[..., Any])


class Locked:
    """An object with a lock; pickles and copies have their own lock."""

    def __init__(self) -> None:
        self._lock = RLock()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _lock=RLock())


def one_at_a_time(method: Method) -> Method:
    """Make calls of a method of a ``Locked`` wait for calls in other threads."""

    @wraps(method)
    def called(self: Locked, *args: Any, **kwargs: Any) -> Any:
        with self._lock:
            return method(self, *args, **kwargs)

    return called  # type: ignore[return-value]  # it takes and returns what the method does
