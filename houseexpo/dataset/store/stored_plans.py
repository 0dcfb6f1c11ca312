"""Read the plans of a data set in one pass from a folder, an archive or JSON lines.

Nothing is written here. A plan that cannot be read gives a record with a fault and does not affect other plans: a file
or member that is too large or damaged, or the rest of a file that is cut off. If a fault may concern any plan (a wrong
checksum of a whole archive), DatasetError is raised, which names the file.
"""

from __future__ import annotations

import gzip
import io
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, Final, NamedTuple

from houseexpo.dataset.store.folders import ARCHIVE, is_plan, is_release, no_plans_advice, plan_file_names, plan_folder
from houseexpo.errors import DatasetError, PlanError
from houseexpo.files import read_file, real_path
from houseexpo.floorplan import FloorPlan, decode

MAX_PLAN_BYTES: Final = 64 * 2**20
"""The largest plan that is read, bytes; the largest published plan has 0.3 MB."""

MAX_BYTES: Final = 64 * 2**30
MAX_PLANS: Final = 5_000_000

KINDS: Final = ("a folder", ".tar.gz", ".tgz", ".zip", ".jsonl", ".jsonl.gz")
_BROKEN: Final = (
    *(EOFError, OSError, zlib.error, tarfile.TarError, zipfile.BadZipFile, UnicodeError),
    *(NotImplementedError, RuntimeError),  # zipfile's errors for an unknown method and for an encrypted member
)
_CHUNK_BYTES: Final = 1 << 20


class StoredPlan(NamedTuple):
    """The bytes of one plan; ``place`` is its file or member, or "line N".

    If they cannot be read, ``fault`` says why.
    """

    place: str
    data: bytes
    fault: str = ""

    def decode(self) -> FloorPlan:
        """Return the plan; raise PlanError if it cannot be read."""
        if self.fault:
            raise PlanError(self.fault)
        return decode(self.data)


class BrokenPlan(NamedTuple):
    """A plan that cannot be read: its file, member or line, and its fault."""

    place: str
    problem: str

    def __str__(self) -> str:
        return f"{self.place}: {self.problem}"


def broken_plan(place: str, error: PlanError) -> BrokenPlan:
    """Return a plan that cannot be read; the error says why."""
    return BrokenPlan(place, f"{error.key}: {error.problem}" if error.key else error.problem)


def plans_path(path: Path) -> Path:
    """Return the path with the plans of a data set: the archive of a release, or else the path itself."""
    return path / ARCHIVE if is_release(path) else path


def read_stored_plans(path: Path) -> Iterator[StoredPlan]:
    """Yield every plan of a data set: files of a folder sorted by name, others in the order of the file.

    Raises
    ------
    DatasetError
        The path is not a data set, or it is damaged and the place is unknown.
    """
    path = plans_path(path)
    read = _reader(path)
    size, count, place = 0, 0, ""
    with damage_as_dataset_error(path):
        try:
            for count, record in enumerate(read(path), start=1):
                size, place = size + len(record.data), record.place
                if size > MAX_BYTES or count > MAX_PLANS:
                    most = f"{MAX_PLANS} plans and {MAX_BYTES >> 30} GiB"
                    raise DatasetError(f"{path}: expected at most {most}, found more")
                yield record
        except (EOFError, tarfile.ReadError) as error:
            if not count:
                raise
            yield StoredPlan(
                f"after {place}", b"", f"expected a whole file, found one that is cut off ({error}); get it again"
            )
    if not count:
        raise DatasetError(f"{path}: expected floor plans (JSON), found none; {no_plans_advice(path)}")


def read_id_lists(path: Path) -> dict[str, bytes]:
    """Return the lists of ids by name: those inside an archive, or those in or beside anything else.

    ``splits/train.txt`` and the published ``map_id_train.txt`` are both the list "train"; the former has priority.
    """
    with damage_as_dataset_error(path):
        if path.suffix == ".zip":
            with zipfile.ZipFile(path) as archive:
                lists = (_zip_member(archive, info) for info in archive.infolist() if _list(info))
                inside = {record.place: record.data for record in lists if not record.fault}
        elif _is_tar(path):
            with _tar(path) as tar:
                inside = dict(_lists_in_tar(tar))
        else:
            inside = {}
        if not inside:
            inside = {str(file): read_file(file) for file in _files_of_lists(path)}
    found: dict[str, bytes] = {}
    for name in sorted(inside, key=lambda name: PurePosixPath(name).name.startswith("map_id_")):
        found.setdefault(id_list_name(name), inside[name])
    return found


def linked_list_names(path: Path) -> frozenset[str]:
    """Return the names of the lists that are links to files outside of a data set's folder."""
    home = real_path(path if path.is_dir() else path.parent)
    files = (file for file in _files_of_lists(path) if not real_path(file).is_relative_to(home))
    return frozenset(id_list_name(str(file)) for file in files)


def id_list_name(name: str) -> str:
    """Return the name of the list of ids in a file with this name, "" if it is no list."""
    path = PurePosixPath(name)
    if path.suffix != ".txt":
        return ""
    if path.stem.startswith("map_id_"):
        return path.stem.removeprefix("map_id_")
    return path.stem if path.parent.name == "splits" else ""


@contextmanager
def damage_as_dataset_error(path: Path) -> Iterator[None]:
    """Convert the errors of readers of a damaged file to DatasetError."""
    try:
        yield
    except _BROKEN as error:
        what = str(error) or type(error).__name__
        raise DatasetError(
            f"{path}: expected a whole file, found one that is cut off, broken or cannot be read ({what}); get it again"
        ) from None


def _reader(path: Path) -> Callable[[Path], Iterator[StoredPlan]]:
    if path.is_dir():
        return _read_folder
    if not path.exists():
        raise DatasetError(f"{path}: expected a data set, found nothing there; check the path")
    if _is_tar(path):
        return _read_tar
    if path.suffix == ".zip":
        return _read_zip
    if path.name.endswith((".jsonl", ".jsonl.gz")):
        return _read_lines
    what = "if it is a plan, houseexpo.load_plan(path) opens it, and `houseexpo info` and `houseexpo show` take it"
    if path.suffix != ".json":
        what = "if it is a model of a house, a drawn plan or a robot's map, `houseexpo build` makes a data set of it"
    raise DatasetError(f"{path}: expected {', '.join(KINDS)}; found {path.suffix or 'no suffix'}; {what}")


def _read_folder(path: Path) -> Iterator[StoredPlan]:
    folder = plan_folder(path)
    for name in plan_file_names(folder):
        file = folder / name
        try:
            size = file.stat().st_size
            yield _too_large(name, size) if size > MAX_PLAN_BYTES else StoredPlan(name, file.read_bytes())
        except OSError as error:
            yield StoredPlan(name, b"", f"cannot be read ({error.strerror})")


def _read_lines(path: Path) -> Iterator[StoredPlan]:
    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as stream:
        for number in range(1, MAX_PLANS + 2):
            line = stream.readline(MAX_PLAN_BYTES + 1)
            if not line:
                return
            place, size = f"line {number}", len(line)
            if size > MAX_PLAN_BYTES:
                while line and not line.endswith(b"\n") and size <= MAX_BYTES:
                    line = stream.readline(_CHUNK_BYTES)
                    size += len(line)
                if size > MAX_BYTES:
                    raise DatasetError(f"{path}: {place}: expected at most {MAX_BYTES >> 30} GiB, found more")
                yield _too_large(place, size)
            elif line.strip():
                yield StoredPlan(place, line.rstrip(b"\r\n"))


def _read_zip(path: Path) -> Iterator[StoredPlan]:
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            if not info.is_dir() and is_plan(info.filename):
                yield _zip_member(archive, info)


def _read_tar(path: Path) -> Iterator[StoredPlan]:
    with _tar(path) as tar:
        for member in tar:
            if member.isfile() and is_plan(member.name):
                yield _tar_member(tar, member)


@contextmanager
def _tar(path: Path) -> Iterator[tarfile.TarFile]:
    """Open a compressed tar for one pass, and read it to the end, where the checksum is."""
    with gzip.open(path) as stream, tarfile.open(fileobj=_Bounded(stream, path), mode="r|") as tar:
        yield tar
        while stream.read(_CHUNK_BYTES):
            pass


class _Bounded(io.RawIOBase):
    """A stream that fails beyond ``MAX_BYTES``, since a small archive may unpack to any size."""

    def __init__(self, stream: IO[bytes] | gzip.GzipFile, path: Path) -> None:
        self._stream, self._path, self._seen = stream, path, 0

    def read(self, size: int = -1) -> bytes:
        data = self._stream.read(size)
        self._seen += len(data)
        if self._seen > MAX_BYTES:
            raise DatasetError(f"{self._path}: expected at most {MAX_BYTES >> 30} GiB, found more")
        return data


def _tar_member(tar: tarfile.TarFile, member: tarfile.TarInfo) -> StoredPlan:
    if member.size > MAX_PLAN_BYTES:
        return _too_large(member.name, member.size)
    stream = tar.extractfile(member)
    data = stream.read() if stream else b""
    if len(data) != member.size:
        raise EOFError(f"{member.name} ends early")
    return StoredPlan(member.name, data)


def _lists_in_tar(tar: tarfile.TarFile) -> Iterator[tuple[str, bytes]]:
    """Yield the name and the bytes of each list; lists that a cut-off archive lacks are left out."""
    try:
        for member in tar:
            if member.isfile() and id_list_name(member.name):
                record = _tar_member(tar, member)
                if not record.fault:
                    yield record.place, record.data
    except (EOFError, tarfile.ReadError):
        return


def _zip_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredPlan:
    if info.file_size > MAX_PLAN_BYTES:
        return _too_large(info.filename, info.file_size)
    try:
        with archive.open(info) as stream:  # the size in the header may be wrong
            data = stream.read(MAX_PLAN_BYTES + 1)
    except _BROKEN as error:
        return StoredPlan(info.filename, b"", f"cannot be unpacked ({error or type(error).__name__})")
    return StoredPlan(info.filename, data) if len(data) <= MAX_PLAN_BYTES else _too_large(info.filename, len(data))


def _list(info: zipfile.ZipInfo) -> bool:
    return not info.is_dir() and bool(id_list_name(info.filename))


def _files_of_lists(path: Path) -> list[Path]:
    homes = [path, path.parent] if path.is_dir() and path.name == "json" else [path if path.is_dir() else path.parent]
    found = [file for home in homes for pattern in ("splits/*.txt", "map_id_*.txt") for file in home.glob(pattern)]
    return sorted(found)


def _is_tar(path: Path) -> bool:
    return path.name.endswith((".tar.gz", ".tgz"))


def _too_large(place: str, size: int) -> StoredPlan:
    found = f"found {size / 2**20:.0f} MiB or more"
    return StoredPlan(place, b"", f"expected a plan of at most {MAX_PLAN_BYTES >> 20} MiB, {found}")
