"""The data set folder on disk (FORMAT.md section 3): what is done is kept, and nothing is ever half there.

``.build/journal.jsonl`` has one line for each input that is done; plans lie beside it under the SHA-256 of their bytes.
A line is appended after its plans are on disk, so that a build that was interrupted goes on where it stopped; the data
set itself is put together at the end, and ``manifest.json`` is the last file of it.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import msgspec

from houseexpo.errors import ConfigError
from pipeline.job import Finished, Made, Refused

MANIFEST = "manifest.json"


@dataclass(frozen=True)
class Kept:
    """A plan in the store: its reader's id, the SHA-256 of what it was made from and of its bytes."""

    id: str
    content: str
    plan: str


Outcome: TypeAlias = Kept | Refused


class Entry(msgspec.Struct, frozen=True):
    """One input that is done; ``key`` stands for the input and all that its outcomes depend on but its content."""

    key: str
    content: str
    seconds: float
    plans: list[Kept] = []
    refused: list[Refused] = []

    @property
    def outcomes(self) -> Iterator[Outcome]:
        """The outcomes of the input, plans first."""
        yield from self.plans
        yield from self.refused


class _Started(msgspec.Struct):
    """What ``.build/build.json`` says, and a manifest among other things: the parameters of the build."""

    parameters_sha256: str


@dataclass
class Store:
    """An open data set folder; ``Store.open`` makes or checks one."""

    root: Path
    _entries: dict[str, Entry] = field(default_factory=dict)

    @classmethod
    def open(cls, root: Path, parameters: str) -> Store:
        """Open a folder for a build with the parameters of that hash; takes the manifest away until it is finished.

        Raises
        ------
        ConfigError
            Where the folder holds something else, or a build with other parameters.
        """
        if root.exists() and not root.is_dir():
            raise ConfigError(f"{root}: expected a folder, found a file; choose another --out")
        started = root / ".build" / "build.json"
        if root.exists() and any(root.iterdir()):
            _check(root, started, parameters)
        store = cls(root)
        for folder in (store.plans, root / "json"):
            folder.mkdir(parents=True, exist_ok=True)
        (root / MANIFEST).unlink(missing_ok=True)
        write(started, msgspec.json.encode(_Started(parameters)))
        store._entries = {entry.key: entry for entry in store._read()}
        return store

    @property
    def plans(self) -> Path:
        """Where plans wait."""
        return self.root / ".build" / "plans"

    @property
    def journal(self) -> Path:
        """What is done."""
        return self.root / ".build" / "journal.jsonl"

    def known(self, key: str) -> Entry | None:
        """Return what is known of an input, if all of its plans are still there."""
        entry = self._entries.get(key)
        return entry if entry and all((self.plans / kept.plan).exists() for kept in entry.plans) else None

    def done(self, key: str, finished: Finished) -> None:
        """Keep what came of an input: its plans first, its line last."""
        plans, refused = [], []
        for outcome in finished.outcomes:
            if isinstance(outcome, Made):
                plans.append(Kept(outcome.id, outcome.content, hashlib.sha256(outcome.plan).hexdigest()))
                write(self.plans / plans[-1].plan, outcome.plan)
            else:
                refused.append(outcome)
        self._entries[key] = entry = Entry(key, finished.content, round(finished.seconds, 4), plans, refused)
        with self.journal.open("ab") as stream:
            stream.write(msgspec.json.encode(entry) + b"\n")

    def plan(self, kept: Kept) -> bytes:
        """Return the bytes of a plan."""
        return (self.plans / kept.plan).read_bytes()

    def publish(self, name: str, kept: Kept) -> None:
        """Put a plan into the data set under its final id; both names share the bytes where the disk can do that."""
        target, source = self.root / "json" / f"{name}.json", self.plans / kept.plan
        if target.exists() and target.read_bytes() == source.read_bytes():
            return
        partial = target.with_name(f".{name}.partial")
        partial.unlink(missing_ok=True)
        try:
            os.link(source, partial)
        except OSError:
            shutil.copyfile(source, partial)
        partial.replace(target)

    def _read(self) -> Iterator[Entry]:
        """Yield the journal's entries; a line that was cut short by a crash is passed over and cut off."""
        if not self.journal.exists():
            return
        whole = []
        for line in self.journal.read_bytes().splitlines(keepends=True):
            try:
                yield msgspec.json.decode(line, type=Entry)
            except msgspec.DecodeError:
                continue
            whole.append(line if line.endswith(b"\n") else line + b"\n")
        write(self.journal, b"".join(whole))


def write(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    descriptor, partial = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
        Path(partial).chmod(0o644)
        Path(partial).replace(path)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


def _check(root: Path, started: Path, parameters: str) -> None:
    said = started if started.exists() else root / MANIFEST
    try:
        found = msgspec.json.decode(said.read_bytes(), type=_Started).parameters_sha256
    except (OSError, msgspec.DecodeError):
        raise ConfigError(
            f"{root}: expected an empty folder or an earlier build, found other files; choose another --out"
        ) from None
    if found != parameters:
        raise ConfigError(
            f"{root}: holds a build with other parameters (hash {found[:8]}, this one's is {parameters[:8]}); "
            "delete it or choose another --out"
        )
