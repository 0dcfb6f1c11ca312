"""A place in an object store as a store.

1. An object is written by one PUT: it is there as a whole, or not at all. Nothing is locked, nothing is appended to.
2. A data set is put together on one machine; what it holds is then published: plans are copied within the store, what
   stands there already is left alone, the manifest comes last.
3. Objects in ``json/`` and ``stages/`` that no build wrote are refused, as in a folder.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from houseexpo.errors import ConfigError
from pipeline.batch.folder import MANIFEST, PARTS, Manifest
from pipeline.batch.remote import faults, opened

T = TypeVar("T")

_PLANS, _ANNOUNCED = ".build/plans", ".build/announced.json"
_RECORDS = (".build/build.json", ".build/journal.jsonl")
_BESIDE = (*_RECORDS, ".build/copies.npz", ".build/report.html", ".build/pictures", "splits")
"""What a data set is put together with, or goes with it, besides plans; folders and files.

The records let a copy of it in a folder be built again as if it had been built there.
"""


def _files(root: Path, kind: str) -> list[str]:
    """Return the file of that name, or the files of that folder."""
    found = [root / kind] if (root / kind).is_file() else sorted((root / kind).rglob("*"))
    return [file.relative_to(root).as_posix() for file in found if file.is_file()]


def _is_kept(name: str) -> bool:
    """Whether the store keeps a file under the hash of its bytes: a plan, or the picture of its stages."""
    return name.partition("/")[0] in PARTS


@dataclass
class ObjectStore:
    """Objects under ``url``; sizes of plans are listed once."""

    url: str
    _sizes: dict[str, int] | None = field(default=None, compare=False)

    def __reduce__(self) -> tuple[type[ObjectStore], tuple[str]]:
        return ObjectStore, (self.url,)

    @property
    def name(self) -> str:
        """The URL."""
        return self.url

    def check(self, parameters: str) -> None:  # noqa: ARG002 - what was begun tells of them
        """Raise ConfigError if there are objects that no build wrote."""
        system, path = opened(self.url)
        with faults(self.url):
            try:
                names = {str(name).rstrip("/").rpartition("/")[2] for name in system.ls(path, detail=False)}
            except FileNotFoundError:
                return
        if names - {""} and ".build" not in names:
            raise ConfigError(f"{self.url}: expected an empty place or an earlier build, found other objects")

    def put(self, name: str, data: bytes) -> None:
        """Write an object (R1)."""
        system, path = opened(self.url)
        try:
            with faults(self.url):
                system.pipe_file(f"{path}/{name}", data)
        except FileNotFoundError as error:  # of an object that is written only its bucket can be missing
            raise ConfigError(
                f"{self.url}: expected a bucket that is there, found none ({error}); make it, or check the URL"
            ) from None

    def add(self, name: str, data: bytes) -> None:
        """Write an object even if it exists: asking first would cost as much."""
        self.put(name, data)

    def get(self, name: str) -> bytes:
        """Return an object; raise OSError if there is none."""
        system, path = opened(self.url)
        with faults(self.url):
            return bytes(system.cat_file(f"{path}/{name}"))

    def size(self, name: str) -> int | None:
        """Return the size that a plan had when the first one was asked for."""
        if self._sizes is None:
            self._sizes = self._found(_PLANS)
        return self._sizes.get(name)

    def names(self, under: str) -> list[str]:
        """Return the objects whose names begin so."""
        return sorted(self._found(under))

    def remove(self, name: str) -> None:
        """Remove an object, if it is there."""
        self._remove([name])

    def sweep(self, under: str) -> None:
        """Do nothing: interrupted writes leave nothing (R1)."""

    def shared(self) -> AbstractContextManager[None]:
        """Lock nothing: two writers write the same bytes (R1)."""
        return nullcontext()

    @contextlib.contextmanager
    def workplace(self, names: Sequence[str]) -> Iterator[Path]:
        """Yield a folder with the objects of these names and what goes with them; publish what it holds (R2)."""
        self._check_foreign()
        with tempfile.TemporaryDirectory(prefix="houseexpo-") as scratch:
            root = Path(scratch) / self.url.rstrip("/").rpartition("/")[2]
            found = set(self._found(_PLANS))
            plans = sorted(found.intersection(names))
            beside = [name for kind in _BESIDE for name in self._found(kind)]
            self._fetch([*plans, *beside], root)
            yield root
            self._publish(root, set(plans), beside)

    def _found(self, under: str) -> dict[str, int]:
        """Return names and sizes of the objects under a name, or of that one."""
        system, path = opened(self.url)
        with faults(self.url):
            found: Mapping[str, Any] = system.find(f"{path}/{under}", detail=True)
        return {str(name)[len(path) + 1 :]: int(info["size"]) for name, info in found.items()}

    def _fetch(self, names: Sequence[str], root: Path) -> None:
        system, path = opened(self.url)
        root.mkdir(parents=True, exist_ok=True)
        with faults(self.url):
            if names:
                system.get([f"{path}/{name}" for name in names], [str(root / name) for name in names])

    def _publish(self, root: Path, plans: set[str], beside: Sequence[str]) -> None:
        """Make the store hold what the folder holds; ``plans`` and ``beside`` are in it already."""
        system, path = opened(self.url)
        manifest = (root / MANIFEST).read_bytes()
        files = msgspec.json.decode(manifest, type=Manifest).files
        before, there = self._manifest(), self._kept()
        new = [name for name in files if before.get(name) != files[name] or (_is_kept(name) and name not in there)]
        kept = {name: f"{_PLANS}/{files[name][:2]}/{files[name]}" for name in new if _is_kept(name)}
        copies = [name for name in kept if kept[name] in plans]
        own = [name for kind in _BESIDE for name in _files(root, kind)]
        changed = bool(new) or manifest != self._bytes(MANIFEST)
        if changed:
            ours = {*files, *before, *(self._read(_ANNOUNCED, list[str]) or [])}
            self.put(_ANNOUNCED, msgspec.json.encode(sorted(filter(_is_kept, ours))))
            self._remove([MANIFEST])
        with faults(self.url):
            if copies:
                system.copy([f"{path}/{kept[name]}" for name in copies], [f"{path}/{name}" for name in copies])
        for name in sorted({*new, *(own if changed else ())}.difference(copies)):
            self.put(name, (root / name).read_bytes())
        self._remove([name for name in there if name not in files])
        self._remove([name for name in beside if name not in own])
        if changed:
            self.put(MANIFEST, manifest)

    def _check_foreign(self) -> None:
        ours = {*(self._read(_ANNOUNCED, list[str]) or []), *self._manifest()}
        if foreign := sorted(self._kept() - ours):  # R3
            folder = foreign[0].partition("/")[0]
            raise ConfigError(
                f"{self.url}: {folder}/ holds {len(foreign)} objects that no build wrote ({foreign[0]} ...); "
                "move them away, or choose another place"
            )

    def _kept(self) -> set[str]:
        """Return the plans of the data set, and the pictures of their stages, that are there."""
        return {name for part in PARTS for name in self._found(f"{part}/")}

    def _manifest(self) -> dict[str, str]:
        found = self._read(MANIFEST, Manifest)
        return {} if found is None else found.files

    def _read(self, name: str, kind: type[T]) -> T | None:
        try:
            return msgspec.json.decode(self._bytes(name), type=kind)
        except msgspec.DecodeError:
            return None

    def _bytes(self, name: str) -> bytes:
        try:
            return self.get(name)
        except FileNotFoundError:
            return b""

    def _remove(self, names: Sequence[str]) -> None:
        system, path = opened(self.url)
        with faults(self.url), contextlib.suppress(FileNotFoundError):
            if names:
                system.rm([f"{path}/{name}" for name in names])
