"""Where a build keeps its results: by name, each written completely or not at all.

A store is a folder, which several machines may share, or a place in an object store (``object_store``). What is put
under a name is never changed: names hold a hash of what they stand for, or two writers mean the same by them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from houseexpo.files import PARTIAL, write_whole
from pipeline.batch import disk
from pipeline.batch.folder import Folder, Others
from pipeline.batch.lock import locked
from pipeline.batch.remote import is_url, opened

BUILD = ".build"


class Store(Protocol):
    """Bytes under names such as ``.build/plans/ab/abcd``; it can be pickled, and is used by several processes."""

    @property
    def name(self) -> str:
        """The store's path or URL."""
        ...

    def check(self, parameters: str) -> None:
        """Raise ConfigError if it holds what a build with these parameters must not touch."""
        ...

    def put(self, name: str, data: bytes) -> None:
        """Write data under a name; earlier data is replaced as a whole."""
        ...

    def add(self, name: str, data: bytes) -> None:
        """Write data whose name contains its hash; nothing is done if it is there already."""
        ...

    def get(self, name: str) -> bytes:
        """Return the data under a name; raise OSError if there is none."""
        ...

    def size(self, name: str) -> int | None:
        """Return the size of the data under a name, or None if there is none."""
        ...

    def names(self, under: str) -> list[str]:
        """Return the names that begin with ``under`` and a slash, sorted."""
        ...

    def remove(self, name: str) -> None:
        """Remove the data under a name, if there is any."""
        ...

    def sweep(self, under: str) -> None:
        """Remove the remains of interrupted writes in the folders of ``under``."""
        ...

    def shared(self) -> AbstractContextManager[None]:
        """Keep builds out that need the store to themselves; raise ConfigError if one is running."""
        ...

    def workplace(self, names: Sequence[str]) -> AbstractContextManager[Path]:
        """Yield a folder of this machine to put the data set together in, with the things of these names in it.

        When it is left without an error, the store holds what the folder holds.
        """
        ...


@dataclass(frozen=True)
class FolderStore:
    """A folder as a store; names are paths in it."""

    root: Path

    @property
    def name(self) -> str:
        """The folder's path."""
        return str(self.root)

    def check(self, parameters: str) -> None:
        """Raise ConfigError if it holds what a build with these parameters must not touch."""
        Folder(self.root).check(parameters, Others.REFUSE)

    def put(self, name: str, data: bytes) -> None:
        """Write a file; it is on the disk when this returns."""
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, data, durable=True)

    def add(self, name: str, data: bytes) -> None:
        """Write a file unless one of its size is there."""
        if self.size(name) != len(data):
            self.put(name, data)

    def get(self, name: str) -> bytes:
        """Return a file's bytes; raise OSError if it cannot be read."""
        return (self.root / name).read_bytes()

    def size(self, name: str) -> int | None:
        """Return a file's size; nothing is read."""
        try:
            return (self.root / name).stat().st_size
        except OSError:
            return None

    def names(self, under: str) -> list[str]:
        """Return the files in a folder and its folders."""
        found = (self.root / under).rglob("*")
        own = (file for file in found if not file.name.startswith(PARTIAL) and file.is_file())
        return sorted(file.relative_to(self.root).as_posix() for file in own)

    def remove(self, name: str) -> None:
        """Remove a file."""
        (self.root / name).unlink(missing_ok=True)

    def sweep(self, under: str) -> None:
        """Remove the remains of interrupted writes in the folders of ``under``."""
        for folder in (self.root / under).glob("*/"):
            disk.sweep(folder)

    @contextlib.contextmanager
    def shared(self) -> Iterator[None]:
        """Hold the folder's lock together with other shards."""
        Folder(self.root).check_links()
        (self.root / BUILD).mkdir(parents=True, exist_ok=True)
        with locked(self.root / BUILD / "lock", shared=True):
            yield

    @contextlib.contextmanager
    def workplace(self, names: Sequence[str]) -> Iterator[Path]:  # noqa: ARG002 - they are there
        """Yield the folder itself."""
        yield self.root


def open_store(place: str) -> Store:
    """Return the store at a path, or at a URL such as ``s3://bucket/plans``.

    Raises
    ------
    ConfigError, MissingDependencyError
        Where the URL is none that can be opened.
    """
    if not is_url(place):
        return FolderStore(Path(place).absolute())
    from pipeline.batch.object_store import ObjectStore

    opened(place)
    return ObjectStore(place.rstrip("/"))
