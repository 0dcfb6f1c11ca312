"""Lists of ids that an earlier ``houseexpo split`` left in a data set folder: kept while they speak of its plans."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


def list_files(root: Path) -> list[Path]:
    """Return what ``houseexpo split`` writes beside the plans, as far as it is there."""
    return [*(root / "splits").glob("*.txt"), *(root / "splits").glob("splits.json")]


def valid_parts(root: Path, ids: Iterable[str]) -> dict[str, str]:
    """Return the list that each plan stands in, by id.

    Lists that do not name exactly these ids, each once, are of other plans: they are removed, and the answer is empty.
    """
    named = [(name, file.stem) for file in list_files(root) if file.suffix == ".txt" for name in _lines(file)]
    if sorted(name for name, _ in named) == sorted(ids):
        return dict(named)
    for file in list_files(root):
        file.unlink()
    home = root / "splits"
    if home.is_dir() and not any(home.iterdir()):
        home.rmdir()
    return {}


def _lines(file: Path) -> list[str]:
    return file.read_text(encoding="utf-8", errors="replace").splitlines()
