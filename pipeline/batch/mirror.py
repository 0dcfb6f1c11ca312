"""Mirror an object store in a local folder for readers that need files; fetch a file's contents when it is opened.

1. The folder has every object's name, size and time; what a file holds is fetched when it is opened.
2. Listing needs the beginnings of files: those of a folder are fetched together, the whole of a file only where its
   beginning says that readers look further (JSON, archives).
3. The folder lies among the system's temporary files under a name made of the URL, so that the workers of a machine
   share it and a later build finds again what has not changed; it may be removed when no build runs.
4. A name that would lead out of the folder is left out.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any

from houseexpo.errors import ConfigError
from houseexpo.file_kinds import HEAD_BYTES
from houseexpo.files import PARTIAL
from pipeline.batch.result_store import open_file_system, translate_store_errors

_NAMES_ONLY, _BEGINNINGS, _WHOLE = 0o600, 0o620, 0o400
"""A file's mode says how much of it is here."""

_HEADS_AT_ONCE = 256
_LOOK_FURTHER = (b"{", b"PK\x03\x04", b"\x1f\x8b")

_mounted: dict[str, tuple[Mirror, bool]] = {}


@dataclass(frozen=True)
class Mirror:
    """The folder ``root`` for the objects under ``url``."""

    url: str
    root: Path

    def lay(self) -> None:
        """Give every object a file (R1); raise ConfigError if there is nothing."""
        system, path = open_file_system(self.url)
        found: Mapping[str, Any] = {}
        with suppress(FileNotFoundError), translate_store_errors(self.url):  # no such bucket
            found = system.find(path, detail=True)
        names = {name[len(path) + 1 :]: info for name, info in found.items() if name.startswith(f"{path}/")}
        known = {name: info for name, info in names.items() if _is_inside(name)}  # R4
        if not known:
            raise ConfigError(f"source {self.url!r} does not exist, or holds nothing; check the URL")
        _own_folder(self.root.parent)
        if not self.root.is_dir():  # whole or not at all: another process may wait for it
            scratch = Path(tempfile.mkdtemp(dir=self.root.parent, prefix=PARTIAL))
            _create_placeholders(scratch, known)
            with suppress(OSError):
                scratch.rename(self.root)
            shutil.rmtree(scratch, ignore_errors=True)
        for file in [file for file in self.root.rglob("*") if file.is_file()]:
            if file.relative_to(self.root).as_posix() not in known:
                file.unlink(missing_ok=True)
        _create_placeholders(self.root, known)

    def mount(self, *, whole: bool = True) -> None:
        """Fetch files when this process opens them: the ``whole`` file, or only the part that listing needs."""
        key = f"{self.root}{os.sep}"
        if key not in _mounted:
            if not self.root.is_dir():  # on this machine for the first time
                self.lay()
            if not _mounted:
                sys.addaudithook(_fetch_before_open)
        _mounted[key] = (self, whole)

    def fetch(self, file: Path) -> None:
        """Fetch the whole of a file."""
        system, path = open_file_system(self.url)
        with self._replacing(file, _WHOLE) as partial, translate_store_errors(self.url):
            system.get_file(f"{path}/{file.relative_to(self.root).as_posix()}", str(partial))

    def fetch_heads(self, folder: Path) -> None:
        """Fetch the beginnings of all files of a folder whose beginning is not fetched yet (R2)."""
        bare = sorted(file for file in folder.iterdir() if file.is_file() and _mode(file) == _NAMES_ONLY)
        for at in range(0, len(bare), _HEADS_AT_ONCE):
            self._fetch_heads(bare[at : at + _HEADS_AT_ONCE])

    def _fetch_heads(self, files: Sequence[Path]) -> None:
        system, path = open_file_system(self.url)
        places = [f"{path}/{file.relative_to(self.root).as_posix()}" for file in files]
        sizes = [file.stat().st_size for file in files]
        with translate_store_errors(self.url):
            heads = system.cat_ranges(places, [0] * len(files), [min(size, HEAD_BYTES) for size in sizes])
        for file, head in zip(files, heads, strict=True):
            if isinstance(head, bytes):
                with self._replacing(file, _WHOLE if len(head) == file.stat().st_size else _BEGINNINGS) as partial:
                    partial.write_bytes(head)
                    os.truncate(partial, file.stat().st_size)

    @contextmanager
    def _replacing(self, file: Path, mode: int) -> Iterator[Path]:
        """Yield a file to write to, outside of the folder; it then takes the other's place, with its size and time."""
        before = file.stat()
        descriptor, name = tempfile.mkstemp(dir=self.root.parent, prefix=PARTIAL)
        os.close(descriptor)
        partial = Path(name)
        try:
            yield partial
            partial.chmod(mode)
            os.utime(partial, ns=(before.st_atime_ns, before.st_mtime_ns))
            partial.replace(file)
        finally:
            partial.unlink(missing_ok=True)


def mirror_source(url: str) -> tuple[Mirror, Path]:
    """Return the mirror of a source, laid out for listing, and where the source lies in it.

    That of a single file holds what lies beside it, too.
    """
    system, path = open_file_system(url)
    with translate_store_errors(url):
        single = bool(path) and system.exists(path) and system.info(path)["type"] == "file"
    whole = url.rstrip("/")
    place = whole.rpartition("/")[0] if single else whole
    name = PurePosixPath(place).name
    owner = f"houseexpo-{os.getuid()}" if hasattr(os, "getuid") else "houseexpo"
    home = Path(tempfile.gettempdir()) / owner / hashlib.sha256(place.encode()).hexdigest()[:16]
    mirror = Mirror(place, home / name)
    mirror.lay()
    mirror.mount(whole=False)
    return mirror, mirror.root / whole.rpartition("/")[2] if single else mirror.root


def _fetch_before_open(event: str, arguments: tuple[object, ...]) -> None:
    """Fetch the file that is about to be opened, if it belongs to a mirror."""
    if event != "open" or not isinstance(arguments[0], str | bytes | os.PathLike):
        return
    full = os.path.abspath(os.fsdecode(arguments[0]))  # noqa: PTH100 - links stay
    for start, (mirror, whole) in _mounted.items():
        if full.startswith(start):
            _bring(mirror, Path(full), whole=whole)


def _bring(mirror: Mirror, file: Path, *, whole: bool) -> None:
    if not whole and _mode(file) == _NAMES_ONLY:
        mirror.fetch_heads(file.parent)
        with file.open("rb") as stream:
            beginning = stream.read(64).lstrip(b"\xef\xbb\xbf \t\r\n")
        if _mode(file) == _BEGINNINGS and beginning.startswith(_LOOK_FURTHER):
            mirror.fetch(file)
    elif whole and _mode(file) in {_NAMES_ONLY, _BEGINNINGS}:
        mirror.fetch(file)


def _create_placeholders(folder: Path, known: Mapping[str, Any]) -> None:
    """Give each object a sparse file of its size and time, unless such a file is there already."""
    for name, info in known.items():
        file, size, time_ns = folder / name, int(info["size"]), _time_ns(info)
        with suppress(OSError):
            found = file.stat()
            if (found.st_size, found.st_mtime_ns) == (size, time_ns):
                continue
            file.unlink()
        file.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):  # another build of this machine was quicker, and may have fetched it
            descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _NAMES_ONLY)
            os.ftruncate(descriptor, size)
            os.fchmod(descriptor, _WHOLE if size == 0 else _NAMES_ONLY)
            os.close(descriptor)
            os.utime(file, ns=(time_ns, time_ns))


def _mode(file: Path) -> int:
    try:
        return file.stat().st_mode & 0o777
    except OSError:
        return _WHOLE  # not there: whoever opens it is told so


def _own_folder(folder: Path) -> None:
    """Make the folder that mirrors lie in; raise ConfigError if somebody else's stands above it."""
    home = folder.parent
    home.mkdir(mode=0o700, exist_ok=True)
    if home.is_symlink() or (hasattr(os, "getuid") and home.lstat().st_uid != os.getuid()):
        raise ConfigError(f"{home}: belongs to somebody else; set TMPDIR to another folder")
    folder.mkdir(exist_ok=True)


def _is_inside(name: str) -> bool:
    return not any(part in {"", ".", ".."} or "\0" in part for part in name.split("/"))


def _time_ns(info: Mapping[str, Any]) -> int:
    """Return when an object was written; stores have several words for it."""
    found = next((info[key] for key in ("LastModified", "updated", "last_modified", "mtime") if key in info), 0)
    if isinstance(found, str):
        found = datetime.fromisoformat(found)
    if isinstance(found, datetime):
        found = found.timestamp()
    return int(float(found) * 1e6) * 1000
