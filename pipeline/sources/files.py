"""Read the files of a source safely: names and ids, archives, XML, JSON, and a record of what was read.

Python reports every file that is opened (its audit event ``open``), so that no reader keeps a list, and a file that a
library opens by itself is noticed too. Where a C++ library reads a file, or a reader only asks whether a file exists,
the reader calls ``record_file``.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any, Final, TypeVar
from xml.etree import ElementTree as ET
from xml.parsers import expat

import msgspec
import numpy as np
import numpy.typing as npt

from houseexpo.file_kinds import format_suffix
from houseexpo.files import real_path, without_mark
from pipeline.rejection import Reason, Rejection
from pipeline.sources.tolerances import DEEPEST, LARGEST_BYTES, LONGEST_LENGTH_M
from pipeline.values import Input

BUILT = ".build"
"""What a build keeps in its data set, and only there."""
LONGEST_ID = 180
"""Ids name files, together with a level and a suffix; file systems take 255 bytes."""


def slug(text: str) -> str:
    """Lower-case ASCII letters, digits and single underscores: what an id may hold."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss")).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_") or "house"


def input_from_file(path: str, reader: str, options: Mapping[str, str]) -> Input:
    """Return the one input of a file; option ``file`` is its name in the source, else its folder's name goes before."""
    file = Path(path)
    name = options.get("file", f"{file.absolute().parent.name}/{file.name}")
    return Input(id_from_file_name(name), reader, str(file), options=tuple(sorted({**options, "file": name}.items())))


def level_id(base: str, level: int, n_levels: int) -> str:
    """Return ``base`` itself where the house has one level, else with the level's number."""
    return base if n_levels == 1 else f"{base}_L{level}"


def walk_source_files(folder: Path) -> Iterator[Path]:
    """Yield all files under a folder but hidden ones, and those of data sets that were built in it: both are no houses.

    A folder that is a data set itself has none.
    """
    if (folder / BUILT / "journal.jsonl").is_file():
        return
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not (_is_hidden(name) or Path(place, name, BUILT).is_dir())]
        yield from (file for name in names if not _is_hidden(name) and (file := Path(place, name)).is_file())


def _is_hidden(name: str) -> bool:
    return name.startswith(".") or name == "__MACOSX"  # copies of a file's properties, beside it, end as the file does


def links_left_out(folder: Path) -> list[str]:
    """Return the names of what ``walk_source_files`` leaves out: links to folders and to nothing, pipes, devices."""
    found = []
    for place, folders, names in os.walk(folder):
        left = [file for name in folders if (file := Path(place, name)).is_symlink()]
        left += [file for name in names if not (file := Path(place, name)).is_file()]
        found += [displayable_name(file.relative_to(folder).as_posix()) for file in left if not _is_hidden(file.name)]
        folders[:] = [name for name in folders if not (_is_hidden(name) or Path(place, name, BUILT).is_dir())]
    return sorted(found)


def describe_links(links: Sequence[str]) -> str:
    """Say which links, pipes and devices are not read, and what to do."""
    names = ", ".join(links[:_NAMED_ONE_BY_ONE]) + (", ..." if len(links) > _NAMED_ONE_BY_ONE else "")
    told = f"links to folders or to nothing, pipes and devices are not read: {names}"
    return f"{told}; name what a link leads to as a SOURCE of its own"


def list_files_of_format(path: str, suffixes: Iterable[str]) -> Iterator[tuple[Path, str]]:
    """Yield (file, relative name) for each file of a format with one of the suffixes, sorted by relative name.

    The name is relative to the SOURCE given; a single file carries its folder's name. Bytes of it that are no UTF-8
    stand as U+FFFD. A single file is listed even where it is missing, so that the batch records it as one rejection.

    Raises
    ------
    Rejection
        Where there is nothing at ``path``.
    """
    known = frozenset(suffixes)
    source = Path(path)
    if source.is_dir():
        files = (file for file in walk_source_files(source) if format_suffix(file) in known)
        named = ((file, displayable_name(file.relative_to(source).as_posix())) for file in files)
        yield from sorted(named, key=lambda pair: (pair[1], pair[0]))
    elif format_suffix(source) in known:
        yield source, displayable_name(f"{source.absolute().parent.name}/{source.name}").lstrip("/")
    elif not source.exists():
        raise Rejection("source", Reason.MISSING_FILE, f"{source.name} does not exist", "check the path")


def id_from_file_name(name: str) -> str:
    """Slug of a relative file name without its suffix; a long one is cut, and eight digits of its hash put on."""
    whole = slug(Path(name).with_suffix("").as_posix())
    if len(whole) <= LONGEST_ID:
        return whole
    return f"{whole[: LONGEST_ID - 9]}_{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def displayable_name(name: str) -> str:
    """Return a file name as text that can be written: bytes that are no UTF-8 stand as U+FFFD."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def file_inside(folder: Path, name: str) -> Path | None:
    """Return the file that a source names, or None if it is not in the folder or below it, links followed."""
    try:
        file = real_path(folder / name)
        return file if name and file.is_relative_to(real_path(folder)) and file.is_file() else None
    except (OSError, ValueError):  # no name that a file can have
        return None


def check_file(path: Path) -> None:
    """Raise Rejection if there is no file, or nothing in it."""
    if not path.is_file():
        raise Rejection("source", Reason.MISSING_FILE, f"{path.name} is no file", "check the path")
    if path.stat().st_size == 0:
        raise Rejection("source", Reason.EMPTY, f"{path.name} has 0 bytes", "export or copy it again")


_CODE = (".py", ".pyc", ".so", ".nbi", ".nbc")
"""A folder of houses may hold the program too: its own files are no part of a house."""

_listening: list[tuple[tuple[str, ...], set[str]]] = []
_hooked: list[bool] = []


@contextmanager
def record_opened_files(*folders: Path) -> Iterator[set[str]]:
    """Collect what is opened within the folders, found or not: named from the first of them, or in full."""
    if not _hooked:
        sys.addaudithook(_hear)
        _hooked.append(True)
    names: set[str] = set()
    _listening.append((tuple(os.path.abspath(folder) + os.sep for folder in folders), names))  # noqa: PTH100 - links stay
    try:
        yield names
    finally:
        _listening.pop()


def record_file(path: str | os.PathLike[str]) -> None:
    """Say that what is being read depends on this file, or on its absence."""
    for folders, names in _listening:
        full = os.path.abspath(path)  # noqa: PTH100
        if full.startswith(folders) and not full.endswith(_CODE):
            names.add(full.removeprefix(folders[0]))


def _hear(event: str, arguments: tuple[object, ...]) -> None:
    if event == "open" and _listening and isinstance(path := arguments[0], str | bytes | os.PathLike):
        record_file(os.fsdecode(path))


# What a source holds and a plan does without: a fault costs the part that it is in, with a note, never the house.


KEY: Final = "left_out"
"""Under which name the note stands in a plan's provenance."""

_LACKS: Final = {"missing": "missing", KEY: "left out as damaged"}
_NAMED_ONE_BY_ONE: Final = 5
_LETTERS: Final = 300
PART_FAULTS: Final = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What a part of a file that is not as its format says leads its reader to."""
Part = TypeVar("Part")


class LeftOutParts:
    """Collects the parts of one house that could not be read, each with the reason."""

    def __init__(self) -> None:
        self._why: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._why)

    @contextmanager
    def part(self) -> Iterator[None]:
        """Read a part: where that ends in a Rejection, the part is left out, and the text of it is kept.

        What is too large ends the reading all the same: the next part would be too.
        """
        try:
            yield
        except Rejection as fault:
            if fault.reason is Reason.TOO_LARGE:
                raise
            self._why[fault.detail] = None

    def add(self, why: str) -> None:
        """Leave a part out; ``why`` names it and says what is wrong with it."""
        self._why[why] = None

    def each(self, parts: Any, what: str, make: Callable[[Any], Part | None]) -> Iterator[Part]:
        """Yield what is made of each part of a list; parts that cannot be made, and None, are left out."""
        if not isinstance(parts, list):
            if parts is not None:
                self.add(f"{what}: expected a list, found {type(parts).__name__}")
            return
        for number, part in enumerate(parts):
            try:
                made = make(part)
            except PART_FAULTS as error:
                self.add(f"{what}[{number}]: {type(error).__name__}: {str(error)[:60]}")
            else:
                if made is not None:
                    yield made

    @property
    def note(self) -> str:
        """The first parts with their reasons and the number of all, or "" if nothing was left out."""
        named = "; ".join(list(self._why)[:_NAMED_ONE_BY_ONE])
        more = len(self._why) - _NAMED_ONE_BY_ONE
        return f"{named}; and {more} more" if more > 0 else named

    @property
    def provenance(self) -> dict[str, str]:
        """What stands in a plan's provenance of it: nothing where nothing is left out."""
        return {KEY: self.note} if self._why else {}


def add_losses(rejection: Rejection, provenance: Mapping[str, Any]) -> Rejection:
    """Return a rejection that also says what of the source was missing or damaged: that may be why."""
    lacks = [f"{words}: {str(provenance[key])[:_LETTERS]}" for key, words in _LACKS.items() if provenance.get(key)]
    if not lacks:
        return rejection
    detail = f"{rejection.detail}; {'; '.join(lacks)}"
    return Rejection(rejection.stage, rejection.reason, detail, rejection.advice, rejection.picture)


# One member of a zip, and nothing else of it: nothing is unpacked to disk, and no more read than was asked for.


_FAULTS = (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError, NotImplementedError)
"""What damaged, encrypted and unknown archives raise."""


def archive_members(path: Path) -> tuple[str, ...]:
    """Return the names in an archive; raise Rejection if the file is not an archive or a name leads out of it."""
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            names = tuple(archive.namelist())
    except _FAULTS as error:
        raise _unreadable(path, error) from None
    outside = next(
        (name for name in names if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts), None
    )
    if outside is not None:
        detail = f"{path.name} holds {outside[:80]!r}, which leads out of it"
        raise Rejection("source", Reason.UNREADABLE, detail, "pack it again; check where the file is from")
    return names


def read_member(path: Path, names: Iterable[str], most_bytes: int) -> bytes | None:
    """Return the first of the named members that is there, or None if none is.

    Raises
    ------
    Rejection
        UNREADABLE for a broken archive, TOO_LARGE for a member that unpacks to more than ``most_bytes``.
    """
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            here = set(archive.namelist())
            name = next((each for each in names if each in here), None)
            if name is None:
                return None
            with archive.open(name) as stream:
                data = stream.read(most_bytes + 1)
    except _FAULTS as error:
        raise _unreadable(path, error) from None
    if len(data) > most_bytes:
        detail = f"{path.name}: {name} unpacks to more than {most_bytes >> 20} MB"
        raise Rejection("source", Reason.TOO_LARGE, detail, "expected a home; check where the file is from")
    return data


def _unreadable(path: Path, error: Exception) -> Rejection:
    detail = f"{path.name} cannot be unpacked: {type(error).__name__}: {str(error)[:120]}"
    return Rejection("source", Reason.UNREADABLE, detail, "copy or save it again")


# XML without its dangers: no entity is expanded, no other file opened, no tree too deep for those who walk it.


Element = ET.Element


def parse_xml(data: bytes, name: str, left_out: LeftOutParts | None = None) -> Element:
    """Return the root of a document.

    What follows the document (a second one, the rest of an older file) is noted in ``left_out`` where that is given.

    Raises
    ------
    Rejection
        EMPTY, TOO_LARGE, or UNREADABLE (no XML, an entity of its own, nested too deep).
    """
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", "copy it again")
    if len(data) > LARGEST_BYTES:
        raise Rejection("source", Reason.TOO_LARGE, f"{name} has {len(data) >> 20} MB of XML", "leave parts of it out")
    builder = ET.TreeBuilder()
    depth, is_whole = 0, False

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:  # how deep trees of XML, YAML and scenes may be nested
            raise _broken_xml(name, f"is nested more than {DEEPEST} deep")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth, is_whole
        depth -= 1
        builder.end(tag)
        is_whole = depth == 0

    def entity(*_: object) -> None:
        raise _broken_xml(name, "declares an entity")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = entity
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, UnicodeError, LookupError, ValueError) as error:
        if left_out is not None and is_whole and isinstance(error, expat.ExpatError):
            left_out.add(f"what follows the first document in {name}, from line {error.lineno}")
            return builder.close()
        raise _broken_xml(name, f"is no XML: {error}") from None


def _broken_xml(name: str, what: str) -> Rejection:
    return Rejection("source", Reason.UNREADABLE, f"{name} {what}", "copy it again, or write it without")


# What the JSON formats share: a document is decoded into typed values, and its lengths are checked.


Document = TypeVar("Document")


def decode_document(decoder: msgspec.json.Decoder[Document], data: bytes, name: str, advice: str) -> Document:
    """Decode a document; raises Rejection (EMPTY, UNREADABLE) that says which key is wrong."""
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", advice)
    try:
        return decoder.decode(without_mark(data))
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: {error}", advice) from None


def read_bytes(path: Path, advice: str, most_bytes: int = LARGEST_BYTES) -> bytes:
    """Read a file; raise Rejection (TOO_LARGE) with ``advice`` where it has more bytes."""
    size = path.stat().st_size
    if size > most_bytes:
        detail = f"{path.name} has {size >> 20} MB, expected {most_bytes >> 20} MB at most"
        raise Rejection("source", Reason.TOO_LARGE, detail, advice)
    return path.read_bytes()


def read_json_object(path: Path, advice: str) -> dict[str, Any]:
    """Read a file with one JSON object, whose values are checked where they are used.

    Raises
    ------
    Rejection
        TOO_LARGE above LARGEST_BYTES, UNREADABLE if it is no JSON or no object; ``advice`` says what to do.
    """
    data = read_bytes(path, advice)
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{path.name} is no JSON: {str(error)[:120]}", advice) from None
    if not isinstance(found, dict):
        raise Rejection(
            "source", Reason.UNREADABLE, f"{path.name}: expected an object, found {type(found).__name__}", advice
        )
    return found


def check_lengths(numbers: npt.ArrayLike, what: str, advice: str) -> None:
    """Raise Rejection (NOT_FINITE, BAD_UNITS) if one of the lengths, metres, is impossible in a house."""
    values = np.abs(np.asarray(numbers, np.float64))
    if not np.isfinite(values).all():
        raise Rejection("source", Reason.NOT_FINITE, f"{what} has a number that is not finite", advice)
    largest = float(values.max(initial=0.0))
    if largest > LONGEST_LENGTH_M:
        detail = f"{what} has a length of {largest:.4g} m, expected {LONGEST_LENGTH_M:.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "the format is in metres: correct it, or leave it out")


def quiet_usd() -> None:
    """Keep USD from warning of old versions of files, which it reads; call it before ``pxr`` is imported."""
    os.environ.setdefault("PXR_USDC_EMIT_DEPRECATION_WARNINGS", "0")


def usd_fault(error: BaseException) -> str:
    """Return in a few words why OpenUSD did not open a file; "" if its message says nothing to a reader."""
    text = str(error)
    old = re.search(r"with (?:obsolete|future) version (\d[\d.]*\d)", text)
    if old:
        return f": version {old[1]} of the format, which this OpenUSD does not read"
    line = re.search(r":(\d+):\d+: parse error", text)
    if line:
        return f": a mistake in line {line[1]}"
    return ": it is no USD file" if "is not a valid" in text else ""
