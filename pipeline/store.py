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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
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


class Others(StrEnum):
    """What a build does with the plans of other sources that its folder holds."""

    REFUSE = "refuse"
    ADD = "add"
    REPLACE = "replace"


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
    """What ``.build/build.json`` says: the parameters of the build, and the keys of its inputs by source."""

    parameters_sha256: str
    sources: dict[str, list[str]] = {}


@dataclass
class Store:
    """An open data set folder; ``Store.open`` makes or checks one."""

    root: Path
    sources: Mapping[str, Sequence[str]]
    _entries: dict[str, Entry] = field(default_factory=dict)

    @classmethod
    def open(
        cls, root: Path, parameters: str, sources: Mapping[str, Sequence[str]], others: Others = Others.REFUSE
    ) -> Store:
        """Open a folder for a build with the parameters of that hash; takes the manifest away until it is finished.

        Parameters
        ----------
        sources
            The keys of the inputs of each source.
        others
            What becomes of plans of other sources that the folder holds: with ADD they stay, with REPLACE they go.

        Raises
        ------
        ConfigError
            Where the folder holds something else, a build with other parameters, or plans of other sources.
        """
        if root.exists() and not root.is_dir():
            raise ConfigError(f"{root}: expected a folder, found a file; choose another --out")
        started = root / ".build" / "build.json"
        if root.exists() and any(root.iterdir()):
            sources = {**_kept(root, started, parameters, sources, others), **sources}
        store = cls(root, sources)
        for folder in (store.plans, root / "json"):
            folder.mkdir(parents=True, exist_ok=True)
        (root / MANIFEST).unlink(missing_ok=True)
        write(started, msgspec.json.encode(_Started(parameters, {name: list(keys) for name, keys in sources.items()})))
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

    def current(self) -> Iterator[Entry]:
        """Yield what came of the inputs of all sources, each once, in an order that no run changes."""
        keys = sorted({key for keys in self.sources.values() for key in keys})
        entries = [entry for entry in map(self.known, keys) if entry is not None]
        yield from sorted(entries, key=lambda entry: sorted((o.id, getattr(o, "content", "")) for o in entry.outcomes))

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


def _kept(
    root: Path, started: Path, parameters: str, sources: Mapping[str, Sequence[str]], others: Others
) -> Mapping[str, Sequence[str]]:
    """Return the sources whose plans in the folder stay although this build does not read them."""
    found = _started(root, started)
    if others is Others.REPLACE:
        return {}
    if found is None or (not found.sources and any((root / "json").glob("*.json"))):
        raise ConfigError(
            f"{root}: holds a data set without the .build folder that says where its plans come from; "
            "--replace removes them, or choose another --out"
        )
    if found.parameters_sha256 != parameters:
        raise ConfigError(
            f"{root}: holds a build with other parameters (hash {found.parameters_sha256[:8]}, this one's is "
            f"{parameters[:8]}); --replace builds it anew, or choose another --out"
        )
    asked = {key for keys in sources.values() for key in keys}
    beside = {name: keys for name, keys in found.sources.items() if name not in sources and not asked.issuperset(keys)}
    if beside and others is Others.REFUSE:
        raise ConfigError(
            f"{root}: holds plans of other sources ({', '.join(beside)}); --add keeps them beside the new ones, "
            "--replace removes them, or choose another --out"
        )
    return beside


def _started(root: Path, started: Path) -> _Started | None:
    """Return what an earlier build wrote when it started, None where only its data set is left."""
    try:
        return msgspec.json.decode(started.read_bytes(), type=_Started)
    except (OSError, msgspec.DecodeError):
        if (root / MANIFEST).is_file():
            return None
    raise ConfigError(
        f"{root}: expected an empty folder or an earlier build, found other files; choose another --out"
    ) from None
