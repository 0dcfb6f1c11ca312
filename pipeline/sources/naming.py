"""Ids and file lists that every file source shares (docs/format.md, "Ids")."""

from __future__ import annotations

import hashlib
import os
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from pipeline.rejection import Reason, Rejection
from pipeline.values import Input

BUILT = ".build"
"""What a build keeps in its data set, and only there."""
LONGEST_ID = 180
"""Ids name files, together with a level and a suffix; file systems take 255 bytes."""


def slug(text: str) -> str:
    """Lower-case ASCII letters, digits and single underscores: what an id may hold."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss")).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_") or "house"


def single_input(path: str, reader: str, options: Mapping[str, str]) -> Input:
    """Return the one input of a file; option ``file`` is its name in the source, else its folder's name goes before."""
    file = Path(path)
    name = options.get("file", f"{file.absolute().parent.name}/{file.name}")
    return Input(base_id(name), reader, str(file), options=tuple(sorted({**options, "file": name}.items())))


def level_id(base: str, level: int, n_levels: int) -> str:
    """Return ``base`` itself where the house has one level, else with the level's number."""
    return base if n_levels == 1 else f"{base}_L{level}"


def files_in(folder: Path) -> Iterator[Path]:
    """Yield all files under a folder but those of data sets that were built in it: plans and records are no houses.

    A folder that is a data set itself has none.
    """
    if (folder / BUILT / "journal.jsonl").is_file():
        return
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not Path(place, name, BUILT).is_dir()]
        yield from (file for name in names if (file := Path(place, name)).is_file())


def list_files(path: str, suffixes: Iterable[str]) -> Iterator[tuple[Path, str]]:
    """Yield (file, relative name) for each file with one of the suffixes, sorted by relative name.

    The name is relative to the SOURCE given; a single file carries its folder's name. Bytes of it that are no UTF-8
    stand as U+FFFD. A single file is listed even where it is missing, so that the batch records it as one rejection.

    Raises
    ------
    Rejection
        Where ``path`` has no such suffix and is no folder.
    """
    known = frozenset(suffixes)
    source = Path(path)
    if source.is_dir():
        files = (file for file in files_in(source) if file.suffix.lower() in known)
        named = ((file, as_text(file.relative_to(source).as_posix())) for file in files)
        yield from sorted(named, key=lambda pair: (pair[1], pair[0]))
    elif source.suffix.lower() in known:
        yield source, as_text(f"{source.absolute().parent.name}/{source.name}").lstrip("/")
    elif not source.exists():
        raise Rejection("source", Reason.MISSING_FILE, f"{source.name} does not exist", "check the path")


def base_id(name: str) -> str:
    """Slug of a relative file name without its suffix; a long one is cut, and eight digits of its hash put on."""
    whole = slug(Path(name).with_suffix("").as_posix())
    if len(whole) <= LONGEST_ID:
        return whole
    return f"{whole[: LONGEST_ID - 9]}_{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def as_text(name: str) -> str:
    """Return a file name as text that can be written: bytes that are no UTF-8 stand as U+FFFD."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def check_file(path: Path) -> None:
    """Raise Rejection if there is no file, or nothing in it."""
    if not path.is_file():
        raise Rejection("source", Reason.MISSING_FILE, f"{path.name} is no file", "check the path")
    if path.stat().st_size == 0:
        raise Rejection("source", Reason.EMPTY, f"{path.name} has 0 bytes", "export or copy it again")
