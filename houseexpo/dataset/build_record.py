"""Write and read the record in a data set folder of how it was built, so that it can be built again.

R1  The record is stored in the data set, in ``.build``. It holds sources, a manifest and the options that affect the
    plans. It never says where the work was done (address, executor, number of processes).
R2  A data set, and with it the record, may come from anybody. Paths outside the data set are therefore used only if
    this user built the data set in the same place with the same commands, as a copy of the record in the user's cache
    shows. Other users are shown the commands and may run them.
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
from houseexpo.files import cache_folder, encode_json, read_json, write_atomically

FILE = ".build/command.json"
"""The path of the record in a data set."""

OPTIONS: Final = frozenset({
    *("config", "overrides", "model_path", "weights"),
    *("add", "furniture", "keep_copies", "keep_stages", "limit", "memory", "min_quality", "resolution", "scale"),
    *("seconds", "seed", "storey_height", "units", "up"),
})  # fmt: skip
"""The options of ``houseexpo build`` that a record may hold (R1)."""

_SWITCHES: Final = {"True": "", "False": "no-"}


class BuildCommand(msgspec.Struct, frozen=True):
    """One ``houseexpo build``: its sources, and its options as texts by their names in Python. Paths are absolute."""

    sources: tuple[str, ...] = ()
    options: dict[str, str] = {}

    def words(self, out: Path) -> list[str]:
        """Return the arguments of ``houseexpo`` that run this build into a folder."""
        words = ["build"]
        for name, value in sorted(self.options.items()):
            if name in OPTIONS:
                switch = name.replace("_", "-")
                words += [f"--{_SWITCHES[value]}{switch}"] if value in _SWITCHES else [f"--{switch}={value}"]
        return [*words, "--out", str(out), *(["--", *self.sources] if self.sources else [])]


class BuildRecord(msgspec.Struct, frozen=True):
    """The builds that made a data set and that can make it again.

    Parameters
    ----------
    build
        The last build.
    earlier
        The builds whose plans it kept (``--add``), in the order in which they ran.
    """

    build: BuildCommand
    earlier: tuple[BuildCommand, ...] = ()

    def with_earlier(self, before: BuildRecord | None) -> BuildRecord:
        """Return the record of a build that added its plans to those of the builds in ``before``."""
        if before is None:
            return self
        found = [each for each in map(_with_add, (*before.earlier, before.build)) if each != _with_add(self.build)]
        return msgspec.structs.replace(self, earlier=tuple(found))

    def commands(self, out: Path) -> list[list[str]]:
        """Return the arguments of ``houseexpo`` for each build, in order."""
        return [each.words(out) for each in (*self.earlier, self.build)]

    def shell_lines(self, out: Path) -> list[str]:
        """Return the commands as lines for a shell."""
        return [shlex.join(["houseexpo", *words]) for words in self.commands(out)]


def _with_add(build: BuildCommand) -> BuildCommand:
    return msgspec.structs.replace(build, options={**build.options, "add": "True"})


def write_build_record(root: Path, record: BuildRecord) -> None:
    """Save the record in a data set folder and note that this user built it; an equal file is not written again."""
    if read_build_record(root) != record:
        write_atomically(root / FILE, encode_build_record(record), durable=True)
    remember_own_build(root, record)


def remember_own_build(root: Path, record: BuildRecord) -> None:
    """Note in the cache that this user built a data set in this place (R2); do nothing if it is not writable."""
    with suppress(HouseExpoError, OSError):
        file = _copy_in_cache(root)
        if not file.exists() or file.read_bytes() != encode_build_record(record):
            write_atomically(file, encode_build_record(record))


def is_own_build(root: Path, record: BuildRecord) -> bool:
    """Return whether this user built the data set in this place as the record says (R2)."""
    try:
        return _copy_in_cache(root).read_bytes() == encode_build_record(record)
    except (HouseExpoError, OSError):
        return False


def encode_build_record(record: BuildRecord) -> bytes:
    """Return the bytes of the record in a data set."""
    return encode_json(msgspec.to_builtins(record))


def read_build_record(root: Path) -> BuildRecord | None:
    """Return the record of how a data set folder was built, None if it has none or an invalid one."""
    try:
        found = read_json(root / FILE, BuildRecord)
    except (OSError, msgspec.DecodeError):
        return None
    return None if any("\0" in text for text in _texts(found)) else found


def _texts(record: BuildRecord) -> Iterator[str]:
    for build in (*record.earlier, record.build):
        yield from (*build.sources, *build.options, *build.options.values())


def _copy_in_cache(root: Path) -> Path:
    """Return the path of the copy of a folder's record in the user's cache."""
    return cache_folder("builds") / f"{hashlib.sha256(os.fsencode(root.resolve())).hexdigest()}.json"
