"""Check that a command may write where its user asks: not into its input, nor over files houseexpo did not write.

R1  A command never writes into its input: neither over a file of a data set nor beside one in its folder. The folder
    ``.build`` of a data set is not part of it.
R2  An existing file is overwritten only if houseexpo wrote it and nobody has changed it since, or if the user gave
    ``--replace``. For each folder, the user's cache lists the files that houseexpo wrote: name, size and time.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import msgspec

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import cache_folder, make_folder, real_path, write_atomically

_OF_A_BUILD: Final = ".build"

_Look = tuple[int, int]


def check_not_in_inputs(out: Path, sources: Iterable[str | Path | None]) -> None:
    """Raise ConfigError if ``out`` lies in one of the inputs (R1)."""
    for source in sources:
        if source is not None and "://" not in str(source) and lies_in(out, Path(source)):
            raise ConfigError(
                f"--out: {out} lies in {source}, which is read and never written into; expected a place outside of it"
            )


def first_difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> tuple[str, Any, Any] | None:
    """Return the first dotted key at which nested values differ, and both values; None if they are equal.

    A value that is missing is None.
    """
    for key in {**wanted, **found}:
        there, here = found.get(key), wanted.get(key)
        if isinstance(there, Mapping) and isinstance(here, Mapping):
            if (inner := first_difference(there, here)) is not None:
                return f"{key}.{inner[0]}", *inner[1:]
        elif there != here:
            return key, there, here
    return None


def check_run_folder(folder: Path, own: Iterable[str]) -> None:
    """Raise ConfigError if a folder holds files but none named in ``own``, the files that a former run leaves."""
    if folder.is_dir() and not any((folder / name).exists() for name in own):
        found = sorted(each.name for each in folder.iterdir())
        if found:
            raise ConfigError(f"{folder}: expected an empty folder or a former run, found {found[0]}; name another")


class CommandOutput:
    """The output of one command: a file, or files in a folder.

    Use it as a context manager: entering checks the place, leaving records what was written.

    Parameters
    ----------
    out
        The file or folder that the user named.
    sources
        The command's input: data sets, plans, results. Addresses of services are ignored.
    replace
        Whether to overwrite files that houseexpo did not write.
    folder
        Whether ``out`` is a folder. Its files must be written with ``write``; a single file may be written in any way
        while the context is active.
    """

    def __init__(
        self, out: Path, sources: Iterable[str | Path | None] = (), *, replace: bool = False, folder: bool = False
    ) -> None:
        self.out, self._replace, self._is_folder = out, replace, folder
        self._sources = list(sources)
        self._notes: dict[Path, _Notes] = {}

    def __enter__(self) -> CommandOutput:
        """Check the place; raise ConfigError if it lies in a source or is a file that must not be overwritten."""
        check_not_in_inputs(self.out, self._sources)
        if not self._is_folder:
            make_folder(self.out.parent)
            self.check(self.out)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Record what was written, also after an error."""
        if not self._is_folder and self.out.is_file() and kind is None:
            self._of(self.out).add(self.out)
        for notes in self._notes.values():
            notes.save()

    def write(self, file: Path, data: bytes) -> None:
        """Write a file atomically unless it already has these bytes; raise ConfigError if it is not ours (R2)."""
        make_folder(file.parent)
        if file.is_file() and not file.is_symlink() and file.stat().st_size == len(data) and file.read_bytes() == data:
            return
        self.check(file)
        write_atomically(file, data)
        self._of(file).add(file)

    def check(self, file: Path) -> None:
        """Raise ConfigError if the file exists and must not be overwritten (R2)."""
        if self._replace or not os.path.lexists(file) or self._of(file).know(file):
            return
        if file.exists() and not file.is_file():
            return  # a folder or a device: writing reports that
        raise ConfigError(
            f"{file}: a file is there already that houseexpo did not write, or that was changed since; --replace "
            "writes over it, or choose another --out"
        )

    def _of(self, file: Path) -> _Notes:
        folder = real_path(file.parent)
        if folder not in self._notes:
            self._notes[folder] = _Notes(folder)
        return self._notes[folder]


class _Notes:
    """The list of files in one folder that houseexpo wrote, with their size and time (R2)."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[str, _Look] = {}
        self._changed = False
        self._kept: Path | None = None
        with suppress(HouseExpoError, OSError, msgspec.DecodeError):
            self._kept = cache_folder("written") / f"{hashlib.sha256(os.fsencode(folder)).hexdigest()}.json"
            self._files = msgspec.json.decode(self._kept.read_bytes(), type=dict[str, _Look])

    def know(self, file: Path) -> bool:
        """Return whether a file is unchanged since houseexpo wrote it."""
        known = self._files.get(os.fsencode(file.name).hex())
        return known is not None and not file.is_symlink() and known == _look(file)

    def add(self, file: Path) -> None:
        self._files[os.fsencode(file.name).hex()] = _look(file)
        self._changed = True

    def save(self) -> None:
        """Save the list; if the cache is not writable, nothing is saved and the next run asks for --replace."""
        if self._changed and self._kept is not None:
            with suppress(HouseExpoError, OSError):
                write_atomically(self._kept, msgspec.json.encode(self._files))


def _look(file: Path) -> _Look:
    found = file.stat()
    return found.st_size, found.st_mtime_ns


def lies_in(out: Path, source: Path) -> bool:
    """Return whether ``out`` is a source or lies in its folder, with links and letter case resolved.

    A path in a folder ``.build``, or in a source that does not exist, does not count.
    """
    if not source.exists():
        return False
    for place in (whole := real_path(out), *whole.parents):
        if place.name == _OF_A_BUILD:
            return False
        with suppress(OSError):
            if place.samefile(source):
                return True
    return False
