"""Write a report: a page, or the numbers as JSON."""

from __future__ import annotations

from pathlib import Path

import msgspec

from houseexpo.dataset import Dataset
from houseexpo.files import write_whole
from stats.page import page
from stats.report import Report


def write_page(report: Report, data_set: Dataset, path: Path) -> None:
    """Write the HTML page; plans on which a list and the measure disagree are read from ``data_set`` and drawn."""
    ids = [] if report.verdict is None else [name for group in report.verdict.drawn() for name in group]
    write_whole(path, page(report, {name: data_set[name] for name in ids}).encode())


def write_json(report: Report, data_set: Dataset, path: Path) -> None:  # noqa: ARG001 - called as write_page is
    """Write the numbers, histograms included."""
    write_whole(path, msgspec.json.format(msgspec.json.encode(report.values()), indent=2) + b"\n")
