"""One build at a time in a folder: a lock that the system takes away when its owner ends, however it ends."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from houseexpo.errors import ConfigError


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Hold the lock of a data set folder; ConfigError where another build holds it."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.read(descriptor, 20).decode(errors="replace").strip() or "unknown"
            raise ConfigError(
                f"{file.parent.parent}: another build is at work in it (process {owner}); "
                "wait until it has ended, or choose another --out"
            ) from None
        os.truncate(descriptor, 0)
        os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        yield
    finally:
        os.close(descriptor)
