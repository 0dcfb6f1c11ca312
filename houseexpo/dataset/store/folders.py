"""Which files of a folder are plans, and what lies there instead of them."""

from __future__ import annotations

import hashlib
import os
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Final

from houseexpo.errors import DatasetError
from houseexpo.plan.overrides import LOG, NAME

_LINES: Final = (".jsonl", ".jsonl.gz")
_PACKED: Final = (*_LINES, ".tar.gz", ".tgz", ".zip")
_OF_A_BUILD: Final = ("duplicates.jsonl", "rejected.jsonl")
_LOOKED_AT: Final = 100

ARCHIVE: Final = "json.tar.gz"
"""The archive of all plans in the folder of a release (``houseexpo.release``)."""


def refused_picture(path: Path, name: str) -> Path:
    """Return where a build keeps a picture of an input that it refused; a hash stands for a name, which may be any."""
    return path / ".build" / "pictures" / "refused" / f"{hashlib.sha256(name.encode()).hexdigest()[:32]}.png"


def overrides_file(dataset: Path) -> Path:
    """Return the file for what people decide about the plans of a data set; it need not be there yet.

    The file lies in a folder of plans, as ``overrides.toml``, so that it goes wherever the folder goes. An archive, a
    file of JSON lines and the folder of a release are finished: nothing is added to them. Their file lies beside them
    and is called ``<name>.overrides.toml``. Nothing in a data set says otherwise.
    """
    path = dataset.resolve()
    return path / NAME if path.is_dir() and not is_release(path) else path.with_name(f"{path.name}.{NAME}")


def is_release(path: Path) -> bool:
    """Whether a folder is one that ``houseexpo release`` wrote, with its plans in an archive."""
    return (path / ARCHIVE).is_file() and (path / "croissant.json").is_file() and not (path / "json").is_dir()


def plan_folder(path: Path) -> Path:
    """Return where a folder keeps its plans: ``json/`` where it has one, else itself."""
    return path / "json" if (path / "json").is_dir() else path


def is_plan(name: str) -> bool:
    """Whether a file or an archive's member is a plan: JSON, not hidden, and no file that describes a data set."""
    path = PurePosixPath(name)
    hidden = any(part.startswith((".", "__MACOSX")) and part not in (".", "..") for part in path.parts)
    beside = path.name in ("manifest.json", "stats.json", "splits.json") and path.parent.name != "json"
    return path.suffix == ".json" and not hidden and not beside


def plan_files(folder: Path) -> list[str]:
    """Return the names of the plans in a folder, sorted; DatasetError where JSON lines lie beside them.

    Nobody could tell which of the two was meant, and one would be left out unsaid.
    """
    with os.scandir(folder) as entries:
        files = sorted(entry.name for entry in entries if entry.is_file())
    plans = [name for name in files if is_plan(f"{folder.name}/{name}")]
    lines = [name for name in files if name.endswith(_LINES) and not _is_record(name)]
    if plans and lines:
        found = f"{plans[0]} and {lines[0]}"
        raise DatasetError(
            f"{folder}: expected one data set, found {found}; open {folder / lines[0]} itself, or take it away"
        )
    return plans


def plan_stamp(folder: Path) -> str:
    """Return what changes when a plan in a folder does, and with nothing else in it; no plan is read.

    DatasetError as ``plan_files`` says.
    """
    names = set(plan_files(folder))
    with os.scandir(folder) as entries:
        found = sorted((entry.name, *look(entry.stat())) for entry in entries if entry.name in names)
    return hashlib.sha256(repr(found).encode()).hexdigest()


def look(found: os.stat_result) -> tuple[int, int, int]:
    """Return what shows that a file was changed: size, time, and the time that no program can set back."""
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns


def instead_of_plans(path: Path) -> str:
    """Return what to do where a data set has no plans: open what lies in the folder, if there is something."""
    if not path.is_dir():
        return "check the path"
    folder = plan_folder(path)
    packed = (file for file in folder.iterdir() if file.name.endswith(_PACKED) and not _is_record(file.name))
    homes = (file.parent for pattern in ("*/*.json", "*/*/*.json") for file in folder.glob(pattern))
    within = (home.parent if home.name == "json" else home for home in islice(homes, _LOOKED_AT))
    found = sorted({*packed, *within})
    return f"open {found[0]}" if found else "check the path"


def _is_record(name: str) -> bool:
    """Whether a file tells of plans instead of holding some: a build's lists, or the log of a review."""
    return name in _OF_A_BUILD or name == LOG or name.endswith(f".{LOG}")
