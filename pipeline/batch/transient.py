"""Transient faults, such as a full disk: what kept a house from being done says nothing about the house."""

from __future__ import annotations

import errno
from collections.abc import Iterator

_ERRORS = frozenset(
    {
        errno.EAGAIN,
        errno.EBUSY,
        errno.EDQUOT,
        errno.EIO,
        errno.EMFILE,
        errno.ENFILE,
        errno.ENOMEM,
        errno.ENOSPC,
        errno.EROFS,
        errno.ESTALE,
        errno.ETIMEDOUT,
    }
)
_NO_SCRATCH = "No usable temporary directory"  # how Python says that none of them can be written


def transient_fault(error: BaseException) -> OSError | None:
    """Return the transient fault that an error comes from, or None if it comes from none."""
    for cause in _causes(error):
        if isinstance(cause, OSError) and (cause.errno in _ERRORS or _NO_SCRATCH in str(cause)):
            return cause
    return None


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
