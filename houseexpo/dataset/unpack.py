"""Unpack an untrusted archive safely: only into the given folder, and completely or not at all."""

from __future__ import annotations

import gzip
import shutil
import tarfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Final

from houseexpo.dataset.store.records import broken
from houseexpo.errors import DatasetError
from houseexpo.files import whole_folder

MAX_FILES: Final = 100_000
MAX_BYTES: Final = 4 * 2**30
MAX_FILE_BYTES: Final = 64 * 2**20


def unpack(
    archive: Path,
    target: Path,
    *,
    wanted: Callable[[str], bool] = lambda name: True,  # noqa: ARG005 - a parameter's name
    beside: Iterable[Path] = (),
    max_files: int = MAX_FILES,
    max_bytes: int = MAX_BYTES,
) -> int:
    """Unpack the files of a ``.tar.gz`` into the folder ``target``, which must not exist, and return how many.

    Files ``beside`` the archive are copied into the folder too.

    1. Absolute names, ``..``, drive letters, links, devices and repeated names are refused, even if not ``wanted``.
    2. More than ``max_files`` members, ``max_bytes`` in all or 64 MiB in one are refused before they are written.
    3. The target appears only when everything is written and the archive's checksum is correct.
    4. Files get mode 0644; owners and modes in the archive are ignored.

    Raises
    ------
    DatasetError
        The archive is refused or damaged. The error names the archive and the member, and no files remain.
    """
    if target.exists():
        raise DatasetError(f"{target}: the folder already exists; delete it or choose another")
    count = 0
    with whole_folder(target) as folder:
        with broken(archive):
            for name, data in _members(archive, max_files, max_bytes):
                if wanted(name):
                    file = folder / name
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_bytes(data)
                    count += 1
        for file in beside:
            shutil.copyfile(file, folder / file.name)
    return count


def member_names(archive: Path) -> list[str]:
    """Return the names of the files in a ``.tar.gz``; raise DatasetError for what ``unpack`` refuses."""
    with broken(archive):
        return [name for name, _ in _members(archive, MAX_FILES, MAX_BYTES)]


def _members(archive: Path, max_files: int, max_bytes: int) -> Iterator[tuple[str, bytes]]:
    seen: set[str] = set()
    size = 0
    with gzip.open(archive) as stream, tarfile.open(fileobj=stream, mode="r|") as tar:
        for count, member in enumerate(tar, start=1):
            size += member.size
            if count > max_files or size > max_bytes or member.size > MAX_FILE_BYTES:  # R2
                raise DatasetError(
                    f"{archive}: {member.name}: expected at most {max_files} files, {max_bytes} bytes in all and "
                    f"{MAX_FILE_BYTES} in one; found file {count}, {size} bytes so far, {member.size} in this one"
                )
            name = _safe(archive, member)
            if not name:
                continue
            if name in seen:
                raise DatasetError(f"{archive}: expected names that differ, found {name!r} twice")
            seen.add(name)
            content = tar.extractfile(member)
            data = content.read() if content else b""
            if len(data) != member.size:
                raise EOFError(f"{name} ends early")
            yield name, data
        while stream.read(2**20):  # R3: the checksum is at the end
            pass


def _safe(archive: Path, member: tarfile.TarInfo) -> str:
    """Return a file's relative name, "" for a folder; raise DatasetError for anything else (R1)."""
    name = PurePosixPath(member.name)
    windows = PureWindowsPath(member.name)
    if name.is_absolute() or windows.drive or windows.root or ".." in windows.parts or "\0" in member.name:
        raise DatasetError(f"{archive}: expected names inside the folder, found {member.name!r}; not unpacked")
    if member.isdir():
        return ""
    if not member.isreg():
        raise DatasetError(f"{archive}: expected files, found a link or device, {member.name!r}; not unpacked")
    return str(name)
