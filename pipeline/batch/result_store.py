"""Store a build's results, bytes by name, in a folder or an object store, and publish the finished data set there.

A store is a folder, which several machines may share, or a place in an object store (``s3://bucket/plans``, ``gs://``,
whatever fsspec knows). What is put under a name is never changed: names hold a hash of what they stand for, or two
writers mean the same by them. Credentials are the business of the object store's own settings: environment,
configuration files, the machine's role.

In an object store:

R1  An object is written by one PUT: it is there as a whole, or not at all. Nothing is locked, nothing is appended to.
R2  A data set is put together on one machine; what it holds is then published: plans are copied within the store, what
    stands there already is left alone, the manifest comes last.
R3  Objects in ``json/`` and ``stages/`` that no build wrote are refused, as in a folder.
"""

from __future__ import annotations

import contextlib
import errno
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import msgspec

from houseexpo.errors import ConfigError, MissingDependencyError, install_command
from houseexpo.files import PARTIAL, write_atomically
from pipeline.batch import disk
from pipeline.batch.data_set_folder import MANIFEST, PARTS, DataSetFolder, DataSetManifest, ExistingPlansPolicy
from pipeline.batch.disk import lock_folder
from pipeline.config_file import BuildConfig

_WITHOUT_CREDENTIALS: Final = frozenset(
    {"NoCredentialsError", "PartialCredentialsError", "DefaultCredentialsError", "TokenRetrievalError"}
)
"""Errors of libraries that need not be installed, by their names."""


def is_url(text: str) -> bool:
    """Tell a URL from a path."""
    return "://" in text


@cache
def open_file_system(url: str) -> tuple[Any, str]:
    """Return the file system of a URL and the path in it, without a slash at its end.

    Raises
    ------
    ConfigError
        Where no file system is known by that name.
    MissingDependencyError
        Where its library is not installed.
    """
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise MissingDependencyError(f"{url}: object stores need more: {install_command('cloud')}") from None
    try:
        system, path = url_to_fs(url, use_listings_cache=False)
    except ImportError as error:
        raise MissingDependencyError(f"{url}: {error}: {install_command('cloud')}") from None
    except ValueError as error:
        raise ConfigError(f"{url}: expected s3://..., gs://... or another URL that fsspec knows ({error})") from None
    return system, str(path).rstrip("/")


@contextmanager
def translate_store_errors(url: str) -> Iterator[None]:
    """Turn errors of the store's library into transient faults.

    Who asks without credentials, or without the right to, is no transient fault: ConfigError says what to set.
    """
    try:
        yield
    except FileNotFoundError:
        raise
    except PermissionError as error:
        raise ConfigError(f"{url}: the store refuses it ({error}); check the credentials and their rights") from error
    except Exception as error:  # each library has errors of its own
        if type(error).__name__ in _WITHOUT_CREDENTIALS:
            advice = "set them as the store's own tools take them, such as AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"
            raise ConfigError(f"{url}: no credentials for this store were found; {advice}") from error
        raise OSError(errno.EIO, f"{url}: {type(error).__name__}: {error}") from error


BUILD = ".build"


class Store(Protocol):
    """Bytes under names such as ``.build/plans/ab/abcd``; it can be pickled, and is used by several processes."""

    @property
    def name(self) -> str:
        """The store's path or URL."""
        ...

    def check(self, config: BuildConfig) -> None:
        """Raise ConfigError if it holds what a build with these parameters must not touch."""
        ...

    def put(self, name: str, data: bytes) -> None:
        """Write data under a name; earlier data is replaced as a whole."""
        ...

    def add(self, name: str, data: bytes) -> None:
        """Write data whose name contains its hash, unless it is there already.

        A crash of the system may lose it or damage it: who reads it compares the hash.
        """
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

    def hold_with_shards(self) -> AbstractContextManager[None]:
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

    def check(self, config: BuildConfig) -> None:
        """Raise ConfigError if it holds what a build with these parameters must not touch."""
        DataSetFolder(self.root).check(config, ExistingPlansPolicy.REFUSE)

    def put(self, name: str, data: bytes) -> None:
        """Write a file; it is on the disk when this returns."""
        self._write(name, data, durable=True)

    def add(self, name: str, data: bytes) -> None:
        """Write a file unless one of its size is there; to wait for the disk takes longer than to plan a drawing."""
        if self.size(name) != len(data):
            self._write(name, data, durable=False)

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
            disk.remove_interrupted_writes(folder)

    def _write(self, name: str, data: bytes, *, durable: bool) -> None:
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, data, durable=durable)

    @contextlib.contextmanager
    def hold_with_shards(self) -> Iterator[None]:
        """Hold the folder's lock together with other shards."""
        DataSetFolder(self.root).check_links()
        (self.root / BUILD).mkdir(parents=True, exist_ok=True)
        with lock_folder(self.root / BUILD / "lock", shared=True):
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

    open_file_system(place)
    return ObjectStore(place.rstrip("/"))


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
    """Return whether the store keeps a file under the hash of its bytes: a plan, or the picture of its stages."""
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

    def check(self, config: BuildConfig) -> None:  # noqa: ARG002 - what was begun tells of them
        """Raise ConfigError if there are objects that no build wrote."""
        system, path = open_file_system(self.url)
        with translate_store_errors(self.url):
            try:
                names = {str(name).rstrip("/").rpartition("/")[2] for name in system.ls(path, detail=False)}
            except FileNotFoundError:
                return
        if names - {""} and ".build" not in names:
            raise ConfigError(f"{self.url}: expected an empty place or an earlier build, found other objects")

    def put(self, name: str, data: bytes) -> None:
        """Write an object (R1)."""
        system, path = open_file_system(self.url)
        try:
            with translate_store_errors(self.url):
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
        system, path = open_file_system(self.url)
        with translate_store_errors(self.url):
            return bytes(system.cat_file(f"{path}/{name}"))

    def size(self, name: str) -> int | None:
        """Return the size that a plan had when the first one was asked for."""
        if self._sizes is None:
            self._sizes = self._sizes_under(_PLANS)
        return self._sizes.get(name)

    def names(self, under: str) -> list[str]:
        """Return the objects whose names begin so."""
        return sorted(self._sizes_under(under))

    def remove(self, name: str) -> None:
        """Remove an object, if it is there."""
        self._remove([name])

    def sweep(self, under: str) -> None:
        """Do nothing: interrupted writes leave nothing (R1)."""

    def hold_with_shards(self) -> AbstractContextManager[None]:
        """Lock nothing: two writers write the same bytes (R1)."""
        return nullcontext()

    @contextlib.contextmanager
    def workplace(self, names: Sequence[str]) -> Iterator[Path]:
        """Yield a folder with the objects of these names and what goes with them; publish what it holds (R2)."""
        self._check_foreign()
        with tempfile.TemporaryDirectory(prefix="houseexpo-") as scratch:
            root = Path(scratch) / self.url.rstrip("/").rpartition("/")[2]
            found = set(self._sizes_under(_PLANS))
            plans = sorted(found.intersection(names))
            beside = [name for kind in _BESIDE for name in self._sizes_under(kind)]
            self._fetch([*plans, *beside], root)
            yield root
            self._publish(root, set(plans), beside)

    def _sizes_under(self, under: str) -> dict[str, int]:
        """Return names and sizes of the objects under a name, or of that one."""
        system, path = open_file_system(self.url)
        with translate_store_errors(self.url):
            found: Mapping[str, Any] = system.find(f"{path}/{under}", detail=True)
        return {str(name)[len(path) + 1 :]: int(info["size"]) for name, info in found.items()}

    def _fetch(self, names: Sequence[str], root: Path) -> None:
        system, path = open_file_system(self.url)
        root.mkdir(parents=True, exist_ok=True)
        with translate_store_errors(self.url):
            if names:
                system.get([f"{path}/{name}" for name in names], [str(root / name) for name in names])

    def _publish(self, root: Path, plans: set[str], beside: Sequence[str]) -> None:
        """Make the store hold what the folder holds; ``plans`` and ``beside`` are in it already."""
        system, path = open_file_system(self.url)
        manifest = (root / MANIFEST).read_bytes()
        files = msgspec.json.decode(manifest, type=DataSetManifest).files
        before, there = self._manifest(), self._kept_names()
        new = [name for name in files if before.get(name) != files[name] or (_is_kept(name) and name not in there)]
        kept = {name: f"{_PLANS}/{files[name][:2]}/{files[name]}" for name in new if _is_kept(name)}
        copies = [name for name in kept if kept[name] in plans]
        own = [name for kind in _BESIDE for name in _files(root, kind)]
        changed = bool(new) or manifest != self._bytes(MANIFEST)
        if changed:
            ours = {*files, *before, *(self._read(_ANNOUNCED, list[str]) or [])}
            self.put(_ANNOUNCED, msgspec.json.encode(sorted(filter(_is_kept, ours))))
            self._remove([MANIFEST])
        with translate_store_errors(self.url):
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
        if foreign := sorted(self._kept_names() - ours):  # R3
            folder = foreign[0].partition("/")[0]
            raise ConfigError(
                f"{self.url}: {folder}/ holds {len(foreign)} objects that no build wrote ({foreign[0]} ...); "
                "move them away, or choose another place"
            )

    def _kept_names(self) -> set[str]:
        """Return the plans of the data set, and the pictures of their stages, that are there."""
        return {name for part in PARTS for name in self._sizes_under(f"{part}/")}

    def _manifest(self) -> dict[str, str]:
        found = self._read(MANIFEST, DataSetManifest)
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
        system, path = open_file_system(self.url)
        with translate_store_errors(self.url), contextlib.suppress(FileNotFoundError):
            if names:
                system.rm([f"{path}/{name}" for name in names])
