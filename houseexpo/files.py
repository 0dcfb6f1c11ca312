"""Read files within limits, and write files and folders atomically: complete or absent, even after a power failure."""

from __future__ import annotations

import codecs
import errno
import hashlib
import io
import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from houseexpo.errors import ConfigError

T = TypeVar("T")

PARTIAL = ".partial-"
"""Prefix of the name of a file or folder that is being written; one that remains was interrupted."""


CACHE_VARIABLE = "HOUSEEXPO_CACHE"
"""The environment variable that sets the place of the user's cache."""


def is_device(path: Path) -> bool:
    """Return whether a path is neither a file nor a folder but a device or a pipe, whose reading might never end."""
    return path.exists() and not (path.is_file() or path.is_dir())


def real_path(path: str | os.PathLike[str]) -> Path:
    """Return a path in full, without links; a link that leads in a circle stays, and ``Path.resolve`` would raise."""
    return Path(os.path.realpath(path))


def named_path(path: str | os.PathLike[str], what: str) -> Path:
    """Return a path; raise ConfigError if it is an empty text, which ``Path`` takes for the current folder."""
    named = os.fsdecode(path)
    if not named:
        raise ConfigError(f"{what}: expected a path, found an empty text; the current folder is '.'")
    return Path(named)


MAX_RECORD_BYTES: Final = 256 << 20
"""Largest size of a file that describes a data set: its manifest, a list of ids, what was rejected."""


_CHUNK_BYTES: Final = 1 << 20


def read_file(path: Path, most_bytes: int = MAX_RECORD_BYTES) -> bytes:
    """Return the content of a file that may come from anybody.

    Raises
    ------
    OSError
        The file is missing, is a folder, a device or a pipe, or is larger than ``most_bytes``.
    """
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "expected a file, found a folder, a device or a pipe", str(path))
    parts, left = [], most_bytes + 1
    with path.open("rb") as stream:
        # one read would take memory for the largest file
        while left and (part := stream.read(min(left, _CHUNK_BYTES))):
            parts.append(part)
            left -= len(part)
    if not left:
        raise OSError(errno.EFBIG, f"expected at most {most_bytes >> 20} MiB, found more", str(path))
    return b"".join(parts)


def read_text(path: Path) -> str:
    """Return the text of a file that may come from anybody, in UTF-8 with or without a byte order mark.

    Raises
    ------
    OSError
        The file cannot be read (``read_file``).
    UnicodeDecodeError
        The content is not UTF-8.
    """
    return without_mark(read_file(path)).decode()


def without_mark(data: bytes) -> bytes:
    """Return the text of a file without the byte order mark that Windows writes before UTF-8."""
    return data.removeprefix(codecs.BOM_UTF8)


def read_json(path: Path, kind: type[T]) -> T:
    """Return the JSON in a file that may come from anybody.

    Raises
    ------
    OSError
        The file cannot be read (``read_file``).
    msgspec.DecodeError
        The content is not JSON, is nested too deep, or is not of this kind.
    """
    return decode_json(read_file(path), kind)


def decode_json(data: bytes, kind: type[T]) -> T:
    """Decode JSON from anybody; raise msgspec.DecodeError if it is invalid, nested too deep, or not of this kind."""
    try:
        return msgspec.json.decode(without_mark(data), type=kind)
    except UnicodeDecodeError as error:
        raise msgspec.DecodeError(f"invalid UTF-8: {error}") from None
    except RecursionError:
        raise msgspec.DecodeError("values nested too deep") from None


def encode_json(values: Any) -> bytes:
    """Return indented JSON that is easy to read and to compare; keys keep their order."""
    return msgspec.json.format(msgspec.json.encode(values), indent=2) + b"\n"


def decode_yaml(data: bytes | str, deepest: int) -> Any:
    """Return the content of a YAML document without aliases, no part of which lies in more than ``deepest`` others.

    Aliases make a small file grow, and each level of brackets makes the parser slower: both end the reading before
    anything is built.

    Raises
    ------
    ValueError
        The document is invalid; the message is the end of a sentence that begins with the file's name.
    """
    import yaml

    usual = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

    class Loader(usual):  # type: ignore[misc, valid-type]
        """Counts how deep it is: PyYAML calls these two methods before and after each part, and needs neither here."""

        depth = 0

        def descend_resolver(self, *_: object) -> None:
            self.depth += 1
            if self.depth > deepest + 1:
                raise _YamlFaultError(f"is nested more than {deepest} deep")

        def ascend_resolver(self) -> None:
            self.depth -= 1

    try:
        has_stars = "*" in data if isinstance(data, str) else b"*" in data
        if has_stars:  # an alias begins with one, and PyYAML follows it
            _check_aliases(yaml.parse(data, Loader=usual), deepest)
        return yaml.load(data, Loader=Loader)  # noqa: S506 - a safe one
    except _YamlFaultError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"is no YAML: {' '.join(str(error).split())[:200]}") from None


class _YamlFaultError(ValueError):
    """A document has an alias or is nested too deep."""


def _check_aliases(events: Iterable[Any], deepest: int) -> None:
    import yaml

    depth = 0
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            raise _YamlFaultError("repeats a part by an alias (*name), which is not followed: write it out there")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > deepest:
            raise _YamlFaultError(f"is nested more than {deepest} deep")


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive of the files, sorted by name and without times, so that equal files give equal bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)  # a ZipInfo alone would not compress
    return stream.getvalue()


def write_atomically(file: Path, data: bytes, *, durable: bool = False) -> None:
    """Write a file under a temporary name and rename it when it is complete.

    With ``durable``, the data is synchronised to the disk before the file is renamed.

    Raises
    ------
    ConfigError
        A device, a pipe or a folder already has this name.
    """
    if file.exists() and not file.is_file():
        what = "a folder" if file.is_dir() else "a device or a pipe"
        raise ConfigError(f"{file}: expected a regular file or a new one, found {what}; name another")
    try:
        descriptor, partial = tempfile.mkstemp(dir=file.parent, prefix=PARTIAL)
    except OSError as error:
        error.filename = str(file)  # not the temporary name
        raise
    try:
        with name_in_os_errors(file), os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fchmod(stream.fileno(), 0o644)
            if durable:
                os.fsync(stream.fileno())
        Path(partial).replace(file)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


@contextmanager
def name_in_os_errors(file: Path) -> Iterator[None]:
    """Add the file's name to an ``OSError`` without a file name, such as that of a full disk."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(file)
        raise


@contextmanager
def hold_file_lock(lock: Path, file: Path) -> Iterator[None]:
    """Hold a lock among processes while a file is changed; the system releases it when its owner ends.

    Links are not followed. Raise ConfigError, which names the file, if the lock or the file cannot be written.
    """
    import fcntl  # not on Windows

    try:
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be written ({error.strerror}); nothing was changed") from None


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Yield a new folder beside the target; at the end it is renamed to the target, or removed after an error.

    If another process has created the target in the meantime, that folder is kept.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = Path(tempfile.mkdtemp(dir=target.parent, prefix=PARTIAL))
    try:
        folder = partial / "new"
        folder.mkdir()
        yield folder
        try:
            folder.rename(target)
        except OSError:
            if not target.is_dir():
                raise
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def sha256_of(file: Path) -> str:
    """Return the SHA-256 of a file as a hexadecimal string."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def make_folder(folder: Path) -> Path:
    """Create a folder and its parents if they are missing, and return it; raise ConfigError if that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        taken = next(part for part in (folder, *folder.parents) if os.path.lexists(part))
        what = "the file" if taken.exists() else "a link that leads nowhere,"
        raise ConfigError(f"{folder}: expected a folder or nothing, found {what} {taken}; name another") from None
    return folder


def cache_folder(*parts: str) -> Path:
    """Return a folder in the user's cache, created if absent; HOUSEEXPO_CACHE, unless empty, sets the cache's place."""
    root = os.environ.get(CACHE_VARIABLE)
    if not root:
        from platformdirs import user_cache_path

        root = str(user_cache_path("houseexpo", appauthor=False))
    folder = Path(root).expanduser().joinpath(*parts)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = f"cannot be made ({error.strerror}); name another folder in {CACHE_VARIABLE}"
        raise ConfigError(f"{folder}: {why}") from None
    return folder


def sync_folder(folder: Path) -> None:
    """Synchronise the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
