"""How a data set folder was built, so that it can be built again.

R1  The record lies in the data set, in ``.build``. It holds sources, a manifest and options that say what the plans are
    like; never where work is done: an address, an executor, a number of processes.
R2  A data set may come from anybody, and so may its record. What it names outside of the data set is followed only
    where this user built the data set, in the same place and in the same words: a copy of the record in the user's
    cache says so. All others are told the command, and may run it themselves.
"""

from __future__ import annotations

import hashlib
import os
import shlex
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from houseexpo.errors import HouseExpoError
from houseexpo.files import as_json, cache_folder, write_whole

FILE = ".build/command.json"
"""Where the record lies in a data set."""

OPTIONS: Final = frozenset({
    *("config", "overrides", "model_path"),
    *("add", "furniture", "keep_stages", "limit", "min_quality", "scale", "seed", "storey_height", "units", "up"),
})  # fmt: skip
"""The options of ``houseexpo build`` that a record may hold (R1)."""

_SWITCHES: Final = {"True": "", "False": "no-"}


class Build(msgspec.Struct, frozen=True):
    """One ``houseexpo build``: its sources, and its options by their names in Python, as texts. Paths are absolute."""

    sources: tuple[str, ...] = ()
    options: dict[str, str] = {}

    def words(self, out: Path) -> list[str]:
        """Return the arguments of ``houseexpo`` that build this into a folder."""
        words = ["build"]
        for name, value in sorted(self.options.items()):
            if name in OPTIONS:
                switch = name.replace("_", "-")
                words += [f"--{_SWITCHES[value]}{switch}"] if value in _SWITCHES else [f"--{switch}={value}"]
        return [*words, "--out", str(out), *(["--", *self.sources] if self.sources else [])]


class BuildRecord(msgspec.Struct, frozen=True):
    """The builds that make a data set again.

    Parameters
    ----------
    build
        The last one.
    earlier
        Those whose plans it kept (``--add``), in order; they are run before it.
    """

    build: Build
    earlier: tuple[Build, ...] = ()

    def beside(self, before: BuildRecord | None) -> BuildRecord:
        """Return the record of a build that kept the plans of those before it."""
        if before is None:
            return self
        found = [each for each in map(_added, (*before.earlier, before.build)) if each != _added(self.build)]
        return msgspec.structs.replace(self, earlier=tuple(found))

    def commands(self, out: Path) -> list[list[str]]:
        """Return the arguments of ``houseexpo`` for each build, in order."""
        return [each.words(out) for each in (*self.earlier, self.build)]

    def typed(self, out: Path) -> list[str]:
        """Return the commands as they are typed in a shell."""
        return [shlex.join(["houseexpo", *words]) for words in self.commands(out)]


def _added(build: Build) -> Build:
    return msgspec.structs.replace(build, options={**build.options, "add": "True"})


def record_build(root: Path, record: BuildRecord) -> None:
    """Keep the record in a data set folder, and that this user built it; a file that says so already is left alone."""
    if recorded_build(root) != record:
        write_whole(root / FILE, encoded(record), durable=True)
    note_built_here(root, record)


def note_built_here(root: Path, record: BuildRecord) -> None:
    """Remember that this user built a data set in this place (R2); a cache that cannot be written remembers nothing."""
    with suppress(HouseExpoError, OSError):
        file = _noted(root)
        if not file.exists() or file.read_bytes() != encoded(record):
            write_whole(file, encoded(record))


def built_here(root: Path, record: BuildRecord) -> bool:
    """Tell whether this user built the data set in this place, by this record (R2)."""
    try:
        return _noted(root).read_bytes() == encoded(record)
    except (HouseExpoError, OSError):
        return False


def encoded(record: BuildRecord) -> bytes:
    """Return the record as it lies in a data set."""
    return as_json(msgspec.to_builtins(record))


def recorded_build(root: Path) -> BuildRecord | None:
    """Return how a data set folder was built; None where nothing says so, or it is no record."""
    try:
        found = msgspec.json.decode((root / FILE).read_bytes(), type=BuildRecord)
    except (OSError, msgspec.DecodeError):
        return None
    return None if any("\0" in text for text in _texts(found)) else found


def _texts(record: BuildRecord) -> Iterator[str]:
    for build in (*record.earlier, record.build):
        yield from (*build.sources, *build.options, *build.options.values())


def _noted(root: Path) -> Path:
    """Return the file in the user's cache that says how a folder was built."""
    return cache_folder("builds") / f"{hashlib.sha256(os.fsencode(root.resolve())).hexdigest()}.json"
