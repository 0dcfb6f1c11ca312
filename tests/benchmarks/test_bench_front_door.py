"""What a newcomer waits for: the list of commands, and the gallery's first picture. The two commands of the README, the
processor's time for the tests and the size of the installation are printed by ``.ci/front-door``.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

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
