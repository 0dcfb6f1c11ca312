"""Describe the files that an input was read from by size, time and SHA-256, and tell whether they are unchanged."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterable, Sequence
from glob import escape
from pathlib import Path

from houseexpo.files import sha256_of
from pipeline.batch.disk import path_from_text, path_to_text
from pipeline.batch.entry import FileRecord
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.values import Input

ABSENT = -1


def input_folder(item: Input) -> Path:
    """Return the folder that an input's files lie in: a SUNCG root, or where its file lies."""
    path = Path(item.path)
    return path if path.is_dir() else path.parent


def readable_folders(item: Input) -> list[Path]:
    """Return the folders in which a reader may open files: the input's own, its source's, those named for models.

    A house that is made where it is read has none.
    """
    if item.key and not Path(item.path).exists():
        return []
    options = dict(item.options)
    named = [options.get("root", ""), *options.get("model_path", "").split(os.pathsep)]
    return [input_folder(item), *map(Path, filter(None, named))]


def describe_opened_files(names: Iterable[str], item: Input, began_ns: int) -> list[FileRecord]:
    """Return what the files hold that were opened, and the input's own, which not every reader opens in Python."""
    path = Path(item.path)
    own = [] if item.key and not path.is_file() else [path.name]
    return _contents([path_to_text(name) for name in sorted({*names, *own})], item, began_ns)


def are_size_and_time_same(item: Input, files: Sequence[FileRecord]) -> bool:
    """Tell whether files have the size and the time that they had; nothing is read."""
    folder = input_folder(item)
    return all(_look(folder / path_from_text(file.name)) == (file.size, file.mtime_ns) for file in files)


def describe_if_unchanged(item: Input, files: Sequence[FileRecord], began_ns: int) -> list[FileRecord] | None:
    """Return the files as they look now where they still hold what they held, else None; all are read."""
    now = _contents([file.name for file in files], item, began_ns)
    return now if [file.sha256 for file in now] == [file.sha256 for file in files] else None


def describe_all_files(item: Input) -> list[FileRecord]:
    """Return the files of an input of which no reader could say what it read: its own, or all in its own folders."""
    folder = input_folder(item)
    names = [str(file.relative_to(folder)) for file in folder.glob(f"*/{escape(item.key)}/*")] if item.key else []
    return describe_opened_files(names, item, time.time_ns())


def _look(file: Path) -> tuple[int, int]:
    try:
        found = file.stat()
    except OSError:
        return ABSENT, 0
    return found.st_size, found.st_mtime_ns


def _contents(names: Sequence[str], item: Input, began_ns: int) -> list[FileRecord]:
    """Return files as they look now; of a file that holds many houses, what it holds of this one."""
    folder, own = input_folder(item), Path(item.path)
    part = getattr(reader(item.reader), "read_house_bytes", None) if item.key else None
    found = []
    for name in names:
        file = folder / path_from_text(name)
        size, mtime_ns = _look(file)
        try:
            digest = sha256_of(file) if part is None or file != own else hashlib.sha256(part(item)).hexdigest()
        except (OSError, Rejection):
            found.append(FileRecord(name, ABSENT, 0, ""))
        else:
            found.append(FileRecord(name, size, mtime_ns if mtime_ns < began_ns else 0, digest))
    return found
