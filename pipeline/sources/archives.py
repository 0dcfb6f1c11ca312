"""One member of a zip, and nothing else of it: nothing is unpacked to disk, and no more read than was asked for."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from pipeline.rejection import Reason, Rejection
from pipeline.sources.naming import check_file

_FAULTS = (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, NotImplementedError)
"""What damaged, encrypted and unknown archives raise."""


def members(path: Path) -> tuple[str, ...]:
    """Return the names in an archive; raise Rejection if it is none, or where one leads out of it."""
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            names = tuple(archive.namelist())
    except _FAULTS as error:
        raise _broken(path, error) from None
    outside = next(
        (name for name in names if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts), None
    )
    if outside is not None:
        detail = f"{path.name} holds {outside[:80]!r}, which leads out of it"
        raise Rejection("source", Reason.UNREADABLE, detail, "pack it again; check where the file is from")
    return names


def read_member(path: Path, names: Iterable[str], most_bytes: int) -> bytes | None:
    """Return the first of the named members that is there, or None if none is.

    Raises
    ------
    Rejection
        UNREADABLE for a broken archive, TOO_LARGE for a member that unpacks to more than ``most_bytes``.
    """
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            here = set(archive.namelist())
            name = next((each for each in names if each in here), None)
            if name is None:
                return None
            with archive.open(name) as stream:
                data = stream.read(most_bytes + 1)
    except _FAULTS as error:
        raise _broken(path, error) from None
    if len(data) > most_bytes:
        detail = f"{path.name}: {name} unpacks to more than {most_bytes >> 20} MB"
        raise Rejection("source", Reason.TOO_LARGE, detail, "expected a home; check where the file is from")
    return data


def _broken(path: Path, error: Exception) -> Rejection:
    detail = f"{path.name} cannot be unpacked: {type(error).__name__}: {str(error)[:120]}"
    return Rejection("source", Reason.UNREADABLE, detail, "copy or save it again")
