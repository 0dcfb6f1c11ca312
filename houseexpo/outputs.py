"""Files that a command writes where a person asked for them.

R1  A command never writes into what it reads from: not over a file of a data set, and not beside one in its folder. The
    folder ``.build`` of a data set is no part of it.
R2  A file that is there already is written over only if houseexpo wrote it and nobody changed it since, or if the
    person said ``--replace``. What houseexpo wrote is noted in the user's cache, by folder: name, size and time.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final

import msgspec

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import cache_folder, make_folder, write_whole

_OF_A_BUILD: Final = ".build"

_Look = tuple[int, int]


def check_apart(out: Path, sources: Iterable[str | Path | None]) -> None:
    """Raise ConfigError where a place lies in something that is read (R1)."""
    for source in sources:
        if source is not None and "://" not in str(source) and _lies_in(out, Path(source)):
            raise ConfigError(
                f"--out: {out} lies in {source}, which is read and never written into; expected a place outside of it"
            )


def check_run_folder(folder: Path, own: Iterable[str]) -> None:
    """Raise ConfigError where a folder holds files, and none of a former run by these names; a run adds files to it."""
    if folder.is_dir() and not any((folder / name).exists() for name in own):
        found = sorted(each.name for each in folder.iterdir())
        if found:
            raise ConfigError(f"{folder}: expected an empty folder or a former run, found {found[0]}; name another")


class Output:
    """What one command writes: a file, or files in a folder.

    Use it as a context: the place is checked when it is entered, and what was written is noted when it is left.

    Parameters
    ----------
    out
        The file or the folder that the person named.
    sources
        What the command reads: data sets, plans, results. Addresses of services are passed over.
    replace
        Whether files that houseexpo did not write may be written over.
    folder
        Whether ``out`` is a folder; its files are written by ``write``. A single file may be written by any means
        between entering and leaving.
    """

    def __init__(
        self, out: Path, sources: Iterable[str | Path | None] = (), *, replace: bool = False, folder: bool = False
    ) -> None:
        self.out, self._replace, self._is_folder = out, replace, folder
        self._sources = list(sources)
        self._notes: dict[Path, _Notes] = {}

    def __enter__(self) -> Output:
        """Check the place; ConfigError where it lies in a source, or is a file that is not to be written over."""
        check_apart(self.out, self._sources)
        if not self._is_folder:
            make_folder(self.out.parent)
            self.check(self.out)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Note what was written; after an error, what was written until then."""
        if not self._is_folder and self.out.is_file() and kind is None:
            self._of(self.out).add(self.out)
        for notes in self._notes.values():
            notes.save()

    def write(self, file: Path, data: bytes) -> None:
        """Write a file whole; ConfigError where another's is there (R2). Equal bytes are left as they are."""
        make_folder(file.parent)
        if file.is_file() and not file.is_symlink() and file.stat().st_size == len(data) and file.read_bytes() == data:
            return
        self.check(file)
        write_whole(file, data)
        self._of(file).add(file)

    def check(self, file: Path) -> None:
        """Raise ConfigError where a file is there that is not to be written over (R2)."""
        if self._replace or not os.path.lexists(file) or self._of(file).know(file):
            return
        if file.exists() and not file.is_file():
            return  # a folder or a device: whoever writes says so
        raise ConfigError(
            f"{file}: a file is there already that houseexpo did not write, or that was changed since; --replace "
            "writes over it, or choose another --out"
        )

    def _of(self, file: Path) -> _Notes:
        folder = file.parent.resolve()
        if folder not in self._notes:
            self._notes[folder] = _Notes(folder)
        return self._notes[folder]


class _Notes:
    """The names of the files in one folder that houseexpo wrote, and how they looked then (R2)."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[str, _Look] = {}
        self._changed = False
        self._kept: Path | None = None
        with suppress(HouseExpoError, OSError, msgspec.DecodeError):
            self._kept = cache_folder("written") / f"{hashlib.sha256(os.fsencode(folder)).hexdigest()}.json"
            self._files = msgspec.json.decode(self._kept.read_bytes(), type=dict[str, _Look])

    def know(self, file: Path) -> bool:
        """Whether a file is as houseexpo wrote it."""
        known = self._files.get(os.fsencode(file.name).hex())
        return known is not None and not file.is_symlink() and known == _look(file)

    def add(self, file: Path) -> None:
        self._files[os.fsencode(file.name).hex()] = _look(file)
        self._changed = True

    def save(self) -> None:
        """Keep the notes; a cache that cannot be written keeps none, and --replace is asked for the next time."""
        if self._changed and self._kept is not None:
            with suppress(HouseExpoError, OSError):
                write_whole(self._kept, msgspec.json.encode(self._files))


def _look(file: Path) -> _Look:
    found = file.stat()
    return found.st_size, found.st_mtime_ns


def _lies_in(out: Path, source: Path) -> bool:
    """Whether a place is a source, or in the folder of one, whatever links or letters' case lead there."""
    if not source.exists():
        return False
    for place in (whole := out.resolve(), *whole.parents):
        if place.name == _OF_A_BUILD:
            return False
        with suppress(OSError):
            if place.samefile(source):
                return True
    return False
