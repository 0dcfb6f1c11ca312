"""What each dependency weighs on the disk: the table of docs/installation.md."""

from __future__ import annotations

import tomllib
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]


def test_what_each_dependency_weighs() -> None:
    """The base installation's libraries, heaviest first: their own files, and with what only they need."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    base = {_name(line) for line in project["dependencies"]}
    found = {each.name.lower().replace("_", "-"): each for each in distributions()}
    weight = {name: _megabytes(each) for name, each in found.items()}
    together = _closure(base, found)
    table = Table("library", "its files", "with its own dependencies", title="Base installation, MB")
    for name in sorted(base, key=weight.__getitem__, reverse=True):
        alone = together - _closure(base - {name}, found)
        table.add_row(name, f"{weight[name]:.1f}", f"{sum(weight[each] for each in alone | {name}):.1f}")
    table.add_row("all", f"{sum(weight[name] for name in together):.0f}", str(len(together)) + " libraries")
    Console(width=120).print(table)
    assert base <= together


def _name(requirement: str) -> str:
    return Requirement(requirement).name.lower().replace("_", "-")


def _megabytes(library: Distribution) -> float:
    files = (Path(str(library.locate_file(file))) for file in library.files or ())
    return sum(file.stat().st_blocks * 512 for file in files if file.is_file()) / 1e6


def _closure(names: set[str], found: dict[str, Distribution]) -> set[str]:
    """All libraries that some need, themselves included."""
    seen: set[str] = set()
    left = sorted(names)
    while left:
        name = left.pop()
        if name not in seen and name in found:
            seen.add(name)
            needed = [Requirement(line) for line in found[name].requires or ()]
            left += [_name(each.name) for each in needed if each.marker is None or each.marker.evaluate({"extra": ""})]
    return seen
