"""Answers that are kept in memory, so that what many ask for is made once; the oldest go first."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable


class ByteCache:
    """A least-recently-used cache of bytes, up to so many of them in all; threads may share it."""

    def __init__(self, most_bytes: int) -> None:
        self._most, self._size = most_bytes, 0
        self._found: OrderedDict[Hashable, bytes] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: Hashable) -> bytes | None:
        """Return what is kept, None where there is nothing."""
        with self._lock:
            data = self._found.get(key)
            if data is not None:
                self._found.move_to_end(key)
            return data

    def made(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """Return what is kept, made now where it is not."""
        data = self.get(key)
        if data is None:
            data = make()
            with self._lock:
                self._size += len(data) - len(self._found.pop(key, b""))
                self._found[key] = data
                while self._size > self._most and len(self._found) > 1:
                    self._size -= len(self._found.popitem(last=False)[1])
        return data
