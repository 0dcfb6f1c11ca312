"""Encode paths as text, lock a build's folder, and tell transient faults (such as a full disk) from other errors."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from houseexpo.errors import ConfigError
from houseexpo.files import PARTIAL


def remove_interrupted_writes(folder: Path) -> None:
    """Remove the remains of interrupted writes."""
    for file in folder.glob(f"{PARTIAL}*"):
        file.unlink(missing_ok=True)


def path_to_text(path: str) -> str:
    """Return a path as text that JSON can hold, for any bytes; ``path_from_text`` is the inverse."""
    return os.fsencode(path).decode("latin-1")


def path_from_text(text: str) -> str:
    """Return the path of ``path_to_text``."""
    return os.fsdecode(text.encode("latin-1"))


def printable(text: str) -> str:
    """Return text for people: bytes of a file name that are not UTF-8 become U+FFFD."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace") if not _is_clean(text) else text


def _is_clean(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


# One build at a time in a folder, or several shards of one: a lock that the system takes away when its owner ends.


_NO_LOCKS = frozenset({errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP})
"""What file systems say that have no locks, as some that a cluster shares; whoever builds there sees to it himself."""


@contextmanager
def lock_folder(file: Path, *, shared: bool = False) -> Iterator[None]:
    """Hold the lock of a data set folder, alone or (``shared``) beside others; ConfigError where it cannot be had."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.read(descriptor, 20).decode(errors="replace").strip() or "unknown"
            raise ConfigError(
                f"{file.parent.parent}: another build is at work in it (process {owner}); "
                "wait until it has ended, or choose another --out"
            ) from None
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise
        os.truncate(descriptor, 0)
        os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        yield
    finally:
        os.close(descriptor)
