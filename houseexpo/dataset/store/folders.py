"""Find which files of a data set folder are plans, where others lie, and what to suggest if it has no plans."""

from __future__ import annotations

import hashlib
import os
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Final

from houseexpo.corrections.vocabulary import LOG, NAME
from houseexpo.errors import DatasetError
from houseexpo.files import real_path

_LINES: Final = (".jsonl", ".jsonl.gz")
_PACKED: Final = (*_LINES, ".tar.gz", ".tgz", ".zip")
_OF_A_BUILD: Final = ("duplicates.jsonl", "rejected.jsonl")
_FOLDERS_LOOKED_AT: Final = 100

ARCHIVE: Final = "json.tar.gz"
"""The archive of all plans in the folder of a release (``houseexpo.release``)."""


def rejected_picture_path(path: Path, name: str) -> Path:
    """Return the path of the picture of a rejected input; its name is a hash, since inputs may have any name."""
    return path / ".build" / "pictures" / "refused" / f"{hashlib.sha256(name.encode()).hexdigest()[:32]}.png"


def overrides_path(dataset: Path) -> Path:
    """Return the path of the file with manual corrections of a data set; it may not exist yet.

    In a folder of plans, the file is ``overrides.toml``, so that it moves with the folder. Nothing is added to an
    archive, a file of JSON lines or the folder of a release; their file lies beside them and is named
    ``<name>.overrides.toml``. The contents of a data set cannot change this.
    """
    path = real_path(dataset)
    return path / NAME if path.is_dir() and not is_release(path) else path.with_name(f"{path.name}.{NAME}")


def is_release(path: Path) -> bool:
    """Return whether ``houseexpo release`` wrote a folder, with its plans in an archive."""
    return (path / ARCHIVE).is_file() and (path / "croissant.json").is_file() and not (path / "json").is_dir()


def plan_folder(path: Path) -> Path:
    """Return the folder with the plans: ``json/`` if it exists, else the folder itself."""
    return path / "json" if (path / "json").is_dir() else path


def is_plan(name: str) -> bool:
    """Return whether a file or member is a plan: JSON, not hidden, and not a file that describes a data set."""
    path = PurePosixPath(name)
    hidden = any(part.startswith((".", "__MACOSX")) and part not in (".", "..") for part in path.parts)
    beside = path.name in ("manifest.json", "stats.json", "splits.json") and path.parent.name != "json"
    return path.suffix == ".json" and not hidden and not beside


def plan_file_names(folder: Path) -> list[str]:
    """Return the sorted names of the plans in a folder; raise DatasetError if there are JSON lines beside them.

    It would not be clear which of the two was meant, and one of them would be ignored silently.
    """
    with os.scandir(folder) as entries:
        files = sorted(entry.name for entry in entries if _is_file_or_lost(entry))
    plans = [name for name in files if is_plan(f"{folder.name}/{name}")]
    lines = [name for name in files if name.endswith(_LINES) and not _is_record(name)]
    if plans and lines:
        found = f"{plans[0]} and {lines[0]}"
        raise DatasetError(
            f"{folder}: expected one data set, found {found}; open {folder / lines[0]} itself, or take it away"
        )
    return plans


def folder_stamp(folder: Path) -> str:
    """Return a stamp that changes exactly if a plan in the folder changes; no plan is read.

    Raise DatasetError like ``plan_file_names``.
    """
    names = set(plan_file_names(folder))
    with os.scandir(folder) as entries:
        found = sorted((entry.name, *file_stamp(_stat(entry))) for entry in entries if entry.name in names)
    return hashlib.sha256(repr(found).encode()).hexdigest()


def _is_file_or_lost(entry: os.DirEntry[str]) -> bool:
    """Return whether an entry of a folder is a file, or a link that leads to nothing."""
    try:
        return entry.is_file() or (entry.is_symlink() and not Path(entry.path).exists())
    except OSError:  # links in a circle
        return True


def _stat(entry: os.DirEntry[str]) -> os.stat_result:
    try:
        return entry.stat()
    except OSError:
        return entry.stat(follow_symlinks=False)


def file_stamp(found: os.stat_result) -> tuple[int, int, int]:
    """Return what shows a change of a file: its size, its time, and its change time, which programs cannot set."""
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns


def no_plans_advice(path: Path) -> str:
    """Return advice for a folder without plans: what to open in it instead, if there is something."""
    if not path.is_dir():
        return "check the path"
    folder = plan_folder(path)
    packed = (file for file in folder.iterdir() if file.name.endswith(_PACKED) and not _is_record(file.name))
    homes = (file.parent for pattern in ("*/*.json", "*/*/*.json") for file in folder.glob(pattern))
    within = (home.parent if home.name == "json" else home for home in islice(homes, _FOLDERS_LOOKED_AT))
    found = sorted({*packed, *within})
    return f"open {found[0]}" if found else "check the path"


def _is_record(name: str) -> bool:
    """Return whether a file describes plans instead of containing them: a build's lists, or the log of a review."""
    return name in _OF_A_BUILD or name == LOG or name.endswith(f".{LOG}")
