"""Opening, reading, checking and rasterising the published plans: the figures that the library promises."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo import Dataset, encode, open_dataset
from houseexpo.dataset.validation import validate
from houseexpo.floorplan import decode

PUBLISHED = Path(__file__).resolve().parents[3] / "shared" / "data" / "houseexpo" / "plans_33717.jsonl.gz"
ROWS: list[tuple[str, str, str]] = []


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dataset]:
    """The published plans, opened for the first time; prints what was measured at the end."""
    if not PUBLISHED.exists():
        pytest.skip("the published plans are not on this machine")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(tmp_path_factory.mktemp("fresh")))
        start = time.process_time()
        seconds, found = timed(lambda: open_dataset(PUBLISHED))
        ROWS.append(("open, first time, from .jsonl.gz", said(seconds, start), "15 s"))
        yield found
    table = Table(title="33,717 published plans, two cores")
    for heading in ("", "measured", "at most"):
        table.add_column(heading, justify="right" if heading else "left")
    for row in ROWS:
        table.add_row(*row)
    Console().print(table)


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = function()
    return time.perf_counter() - start, result


def said(seconds: float, start: float) -> str:
    """Return wall clock and, for machines that do other things too, the processor's time since ``start``."""
    return f"{seconds:.1f} s ({time.process_time() - start:.1f} s of processor)"


def fresh(code: str) -> float:
    """Return the seconds that code takes in a new interpreter, its start left out; the best of seven."""
    script = f"import time; start = time.perf_counter()\n{code}\nprint(time.perf_counter() - start)"
    runs = [subprocess.run([sys.executable, "-c", script], check=True, capture_output=True) for _ in range(7)]
    return min(float(run.stdout) for run in runs)


def test_import() -> None:
    extra = fresh("import numpy, houseexpo") - fresh("import numpy")
    ROWS.append(("import houseexpo, beyond numpy", f"{extra:.3f} s", "0.08 s"))
    assert extra < 0.08


def test_open_again(plans: Dataset) -> None:
    seconds = fresh(f"import houseexpo; assert len(houseexpo.open_dataset({str(PUBLISHED)!r})) == {len(plans)}")
    ROWS.append(("open, index cached, imports included", f"{seconds:.2f} s", "0.3 s"))
    assert len(plans) == 33_717


def test_a_plan_by_id(plans: Dataset) -> None:
    times = [timed(lambda name=name: plans[name])[0] for name in plans.sample(1000, 0).ids]
    ROWS.append(("a plan by id, median", f"{1000 * statistics.median(times):.2f} ms", "2 ms"))


def test_decode_and_check_all(plans: Dataset) -> None:
    start = time.process_time()
    seconds, count = timed(lambda: sum(1 for _ in plans))
    ROWS.append(("decode and check all", said(seconds, start), "10 s"))
    assert count == 33_717


def test_round_trip_of_all(plans: Dataset) -> None:
    seconds, equal = timed(lambda: sum(decode(encode(plan)) == plan for plan in plans))
    ROWS.append(("plan -> JSON -> plan, all, exact", f"{equal} in {seconds:.1f} s", "33717"))
    assert equal == 33_717


def test_grid(plans: Dataset) -> None:
    some = list(plans.sample(1000, 1))
    times = [timed(lambda plan=plan: plan.grid(25))[0] for plan in some]
    errors = [abs((plan.grid(25) == 0).sum() / 625 - plan.area) / plan.area for plan in some]
    ROWS.append(("grid at 25 px/m, median", f"{1000 * statistics.median(times):.2f} ms", "2 ms"))
    ROWS.append(("its free area, median error", f"{100 * float(np.median(errors)):.3f} %", "0.5 %"))
    assert np.median(errors) < 0.005


def test_select(plans: Dataset) -> None:
    seconds, _ = timed(lambda: plans.select(rooms=(4, 9), area=(50, 200), labels={"Kitchen"}))
    ROWS.append(("select by rooms, area and label", f"{seconds:.2f} s", ""))


def test_validate_all(plans: Dataset) -> None:
    seconds, report = timed(lambda: validate(PUBLISHED, 2))
    ROWS.append(("validate, two processes", f"{seconds:.1f} s", "30 s"))
    assert report.plans == len(plans)
