"""Write a report as a page, or its numbers as JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError
from houseexpo.files import as_json, write_whole
from stats.page import page
from stats.report import Report


def check_names(files: Iterable[Path]) -> None:
    """Raise ConfigError if a report cannot be written under a file name."""
    for path in files:
        if path.suffix not in _WRITERS:
            raise ConfigError(f"--out: expected a file that ends in {' or '.join(_WRITERS)}, found {path.name!r}")


def write_report(report: Report, data_set: Dataset, path: Path) -> None:
    """Write the page or the numbers, depending on the file's extension."""
    _WRITERS[path.suffix](report, data_set, path)


def write_page(report: Report, data_set: Dataset, path: Path) -> None:
    """Write the HTML page; plans on which a list and the measurement disagree are read from ``data_set`` and drawn."""
    ids = [] if report.verdict is None else [name for group in report.verdict.drawn() for name in group]
    write_whole(path, page(report, {name: data_set[name] for name in ids}).encode())


def write_json(report: Report, data_set: Dataset, path: Path) -> None:  # noqa: ARG001 - called as write_page is
    """Write the numbers, including histograms."""
    write_whole(path, as_json(report.values()))


_WRITERS: Final[dict[str, Callable[[Report, Dataset, Path], None]]] = {".html": write_page, ".json": write_json}
