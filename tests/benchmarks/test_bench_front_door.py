"""What a newcomer waits for: the list of commands, and the gallery's first picture; and what is installed.

The two commands of the README, the processor's time for the tests and the size of the installation are printed by
``.ci/front-door``. The second table says what each dependency weighs on the disk: the table of docs/installation.md.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import tomllib
from importlib.metadata import Distribution, distributions
from pathlib import Path
from statistics import median

from packaging.requirements import Requirement
from rich.console import Console
from rich.table import Table

from tests.builders.browsing import browser

TIMES = 7
PLANS = 60


def test_the_first_things_that_a_newcomer_waits_for(tmp_path: Path) -> None:
    table = Table("what", "median", "worst", title="The front door, s")
    helped = [_timed("--help") for _ in range(TIMES)]
    table.add_row("houseexpo --help", f"{median(helped):.2f}", f"{max(helped):.2f}")
    _run("build", f"procedural:{PLANS}", "--out", str(tmp_path / "homes"))
    painted, shown = _visits(tmp_path / "homes")
    table.add_row(f"gallery of {PLANS} plans: first paint", f"{median(painted):.2f}", f"{max(painted):.2f}")
    table.add_row(f"gallery of {PLANS} plans: first plan's picture", f"{median(shown):.2f}", f"{max(shown):.2f}")
    Console(width=100).print(table)
    assert max(helped) < 10


def _run(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "houseexpo", *words], check=True, capture_output=True)


def _timed(*words: str) -> float:
    start = time.perf_counter()
    _run(*words)
    return time.perf_counter() - start


def _visits(data_set: Path) -> tuple[list[float], list[float]]:
    """Seconds from asking for the gallery to the browser's first paint, and to the first plan's picture."""
    command = [sys.executable, "-m", "houseexpo", "serve", str(data_set), "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    try:
        address = next(found[0] for line in server.stdout or () if (found := re.search(r"http://[\w.:]+", line)))
        painted, shown = [], []
        with browser() as chromium:
            for _ in range(TIMES):
                page = chromium.new_page(viewport={"width": 1280, "height": 860})
                start = time.perf_counter()
                page.goto(f"{address}/{data_set.name}/", wait_until="commit")
                page.wait_for_function("() => [...document.images].some((each) => each.complete && each.naturalWidth)")
                shown.append(time.perf_counter() - start)
                paint = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
                painted.append(page.evaluate(paint) / 1e3)
                page.close()
        return painted, shown
    finally:
        server.terminate()
        server.wait()


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
