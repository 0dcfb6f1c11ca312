"""Keep recently used values in memory, up to a total size, shared by threads, to save computing them again."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from typing import Generic, TypeVar

T = TypeVar("T")


class LruCache(Generic[T]):
    """A least-recently-used cache for threads.

    The sizes of its values, by ``size_of``, add up to at most ``most``; the last value always stays. ``size`` is their
    sum now.
    """

    def __init__(self, most: int, size_of: Callable[[T], int] = lambda _: 1) -> None:
        self._most, self._size_of, self.size = most, size_of, 0
        self._found: OrderedDict[Hashable, T] = OrderedDict()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._found)

    def __iter__(self) -> Iterator[Hashable]:
        """Iterate over the keys, starting with the least recently used one."""
        return iter(self._found)

    def get(self, key: Hashable) -> T | None:
        """Return a value and mark it as used; None if it is not in the cache."""
        with self._lock:
            found = self._found.get(key)
            if found is not None:
                self._found.move_to_end(key)
            return found

    def get_or_make(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return a value; compute it if it is not in the cache."""
        found = self.get(key)
        if found is None:
            found = make()
            with self._lock:
                before = self._found.pop(key, None)  # another thread may have computed it too
                self.size += self._size_of(found) - (0 if before is None else self._size_of(before))
                self._found[key] = found
                while self.size > self._most and len(self._found) > 1:
                    self.size -= self._size_of(self._found.popitem(last=False)[1])
        return found
