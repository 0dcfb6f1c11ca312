"""Check whether a build may write to a data set folder, and read and keep the record of what the last build wrote.

Rules:

1. A folder that holds other things, and no data set, is never built into.
2. A data set without its ``.build`` is left alone: nothing says where its plans come from. So is a file in ``json/``
   or ``stages/`` that no build wrote. Only REPLACE removes them.
3. Links are never followed into, and never removed: not even REPLACE does. Nothing in ``.build`` may be one: a data set
   may come from anybody, and a build appends to files there and removes some.
4. A damaged record in ``.build`` makes no folder unusable: what it said is found again, or done again. Where parameters
   and sources stand in no record, the manifest's count.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.files import PARTIAL, read_json, write_atomically
from houseexpo.outputs import first_difference
from pipeline.batch import disk
from pipeline.config_file import BuildConfig

MANIFEST = "manifest.json"
PARTS = ("json", "stages")
"""Folders of a data set that hold a file for each plan: the plans, and the pictures of their stages."""

T = TypeVar("T")


class ExistingPlansPolicy(StrEnum):
    """What a build does with the plans of other sources, and with other files, that its folder holds."""

    REFUSE = "refuse"
    ADD = "add"
    REPLACE = "replace"


class WrittenFile(msgspec.Struct, frozen=True, array_like=True):
    """A file of the data set as it was written."""

    sha256: str
    size: int
    mtime_ns: int


class FinishedBuild(msgspec.Struct, frozen=True):
    """``finished.json``: what the data set was made from, as a hash, and its files by name."""

    state: str
    files: dict[str, WrittenFile]


class _Started(msgspec.Struct):
    """``build.json``: the parameters of the build."""

    parameters_sha256: str
    parameters: dict[str, Any] = {}


def differing_parameter(before: Mapping[str, Any], config: BuildConfig) -> str:
    """Return in brackets the first parameter in which an earlier build differs; "" if its parameters are not known."""
    there, here = (msgspec.json.decode(msgspec.json.encode(each)) for each in (before, config.parameters()))
    found = first_difference(there, here) if there else None
    return "" if found is None else f" ({found[0]}: {found[1]!r}, this one's is {found[2]!r})"


class DataSetManifest(msgspec.Struct):
    """Of ``manifest.json``, the files that it names, each with its SHA-256, what they were made from, and rights."""

    files: dict[str, str]
    sources: list[str] = []
    parameters_sha256: str = ""
    licence: str = ""
    credit: str = ""


@dataclass(frozen=True)
class DataSetFolder:
    """A data set folder; ``build`` is where all lies that the data set does not depend on."""

    root: Path

    @property
    def build(self) -> Path:
        """The folder ``.build``."""
        return self.root / ".build"

    @property
    def json(self) -> Path:
        """The folder of plans."""
        return self.root / "json"

    @property
    def stages(self) -> Path:
        """The folder of the pictures of their stages; only builds that keep them have one."""
        return self.root / "stages"

    def names(self) -> set[str]:
        """Return the files of plans and pictures that are there, by their names in the data set."""
        return {file.relative_to(self.root).as_posix() for file in self._plans()}

    def check(self, config: BuildConfig, others: ExistingPlansPolicy) -> None:
        """Raise ConfigError if the folder holds what a build must not touch; nothing is changed."""
        if not self.root.exists():
            if self.root.is_symlink():
                raise ConfigError(f"{self.root}: a link to nothing; choose another --out")
            return
        if not self.root.is_dir():
            raise ConfigError(f"{self.root}: expected a folder, found a file; choose another --out")
        if not any(self.root.iterdir()):
            return
        self.check_links()
        if not self.build.is_dir():
            if not (self.root / MANIFEST).is_file():  # R1
                raise self._other("expected an empty folder or an earlier build, found other files")
            if others is not ExistingPlansPolicy.REPLACE:  # R2
                raise self._other(
                    "holds a data set without the .build folder that says where its plans come from; "
                    "--replace removes them"
                )
        if others is not ExistingPlansPolicy.REPLACE:
            self._check_parameters(config)
            self._check_foreign()

    def start(self, config: BuildConfig) -> None:
        """Create the folder's structure, and remove the remains of interrupted writes."""
        for folder in (self.json, self.build):
            folder.mkdir(parents=True, exist_ok=True)
        for folder in (self.json, self.stages, self.build, self.root):
            disk.remove_interrupted_writes(folder)
        started = _Started(config.digest(), config.parameters())
        write_atomically(self.build / "build.json", msgspec.json.encode(started), durable=True)

    def last_finished(self) -> FinishedBuild | None:
        """Return the record of the data set as it was last finished."""
        return _read(self.build / "finished.json", FinishedBuild)

    def manifest(self) -> DataSetManifest | None:
        """Return what the data set says of itself, or None if it is not finished."""
        return _read(self.root / MANIFEST, DataSetManifest)

    def announce(self, names: Iterable[str]) -> None:
        """Record the names of the plans and pictures that will be written, so that a later run knows them."""
        ours = {*(self._ours() or ()), *map(_short, names)}
        (self.root / MANIFEST).unlink(missing_ok=True)
        write_atomically(self.build / "announced.json", msgspec.json.encode(sorted(ours)), durable=True)

    def finish(self, finished: FinishedBuild) -> None:
        """Record the state of the finished data set."""
        write_atomically(self.build / "finished.json", msgspec.json.encode(finished), durable=True)
        (self.build / "announced.json").unlink(missing_ok=True)

    def describe(self, name: str, sha256: str) -> WrittenFile:
        """Describe a file of that hash."""
        found = (self.root / name).stat()
        return WrittenFile(sha256, found.st_size, found.st_mtime_ns)

    def stands(self, name: str, written: WrittenFile) -> bool:
        """Tell whether a file has the size and the time that it was written with; nothing is read."""
        try:
            found = (self.root / name).lstat()
        except OSError:
            return False
        return (found.st_size, found.st_mtime_ns) == (written.size, written.mtime_ns)

    def check_links(self) -> None:
        """Raise ConfigError if a link leads out of what a build writes to (R3)."""
        folders = (self.build, self.json, self.stages)
        for path in (*folders, *self._plans(), *self._links_of_builds()):
            if path.is_symlink() or (path.exists() and path.is_dir() != (path in folders)):
                what = "a link" if path.is_symlink() else "a folder" if path.is_dir() else "a file"
                raise self._other(f"{path.relative_to(self.root)} is {what}; move it away")  # R3

    def _check_parameters(self, config: BuildConfig) -> None:
        started = _read(self.build / "build.json", _Started)
        found = started or self.manifest()
        if found is not None and found.parameters_sha256 not in {config.digest(), ""}:
            which = differing_parameter(started.parameters if started else {}, config)
            raise self._other(f"holds a build with other parameters{which}; --replace builds it anew")

    def _check_foreign(self) -> None:
        ours = self._ours()
        foreign = sorted(name for name in self.names() if ours is not None and _short(name) not in ours)
        if foreign:  # R2
            folders = " and ".join(sorted({f"{name.partition('/')[0]}/" for name in foreign}))
            named = ", ".join(disk.printable(Path(name).name) for name in foreign[:3])
            named += " ..." if len(foreign) > 3 else ""
            raise self._other(
                f"{folders} holds {len(foreign)} files that no build wrote ({named}); move them away, "
                "or --replace removes them"
            )

    def _links_of_builds(self) -> Iterator[Path]:
        waiting = [self.build] if self.build.is_dir() and not self.build.is_symlink() else []
        while waiting:
            with os.scandir(waiting.pop()) as found:
                for each in found:
                    if each.is_symlink():
                        yield Path(each.path)
                    elif each.is_dir():
                        waiting.append(Path(each.path))

    def _plans(self) -> Iterator[Path]:
        for folder in (self.json, self.stages):
            if folder.is_dir() and not folder.is_symlink():
                yield from (file for file in folder.iterdir() if not file.name.startswith(PARTIAL))

    def _ours(self) -> set[str] | None:
        """Return the plans and pictures that builds wrote, or None if that cannot be told any more (R4)."""
        finished, manifest = self.last_finished(), self.manifest()
        records = [
            [*map(_short, finished.files)] if finished else None,
            _read(self.build / "announced.json", list[str]),
            [*map(_short, manifest.files)] if manifest else None,
        ]
        known = [set(names) for names in records if names is not None]
        torn = not known and any((self.build / name).exists() for name in ("finished.json", "announced.json"))
        return None if torn else set().union(*known)

    def _other(self, found: str) -> ConfigError:
        return ConfigError(f"{self.root}: {found}; or choose another --out")


def _short(name: str) -> str:
    """Return the name under which a file is announced: a plan's without its folder."""
    return name.removeprefix("json/")


def _read(file: Path, kind: type[T]) -> T | None:
    """Return a record, or None if it is not there or damaged."""
    try:
        return read_json(file, kind)
    except (OSError, msgspec.DecodeError):
        return None
