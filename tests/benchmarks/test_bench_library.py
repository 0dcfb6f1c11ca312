"""Opening, reading, checking, rasterising and comparing the published plans: the figures that the library promises.

Plans that are nearly the same lie, pair by pair, on a sheet for a person to judge: ``HOUSEEXPO_BENCH_OUT`` says in
which folder.
"""

from __future__ import annotations

import gzip
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from rich.console import Console
from rich.table import Table

from houseexpo import Dataset, encode, open_dataset
from houseexpo.analysis.copies import choose_duplicates, find_copies, find_duplicates
from houseexpo.analysis.similarity import PairSearchResult
from houseexpo.dataset.validation import validate_dataset
from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.floorplan import FloorPlan, decode
from tests.builders.shared import DATA, needs_shared

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


def test_validate_all(plans: Dataset) -> None:
    seconds, report = timed(lambda: validate_dataset(PUBLISHED, 2))
    ROWS.append(("validate, two processes", f"{seconds:.1f} s", "30 s"))
    assert report.plans == len(plans)


THREADS = 2
TIMES = int(os.environ.get("HOUSEEXPO_BENCH_TIMES", "1"))
"""10: ten times as many plans, their vertices moved."""


@pytest.fixture(scope="module")
def lines() -> list[bytes]:
    found = gzip.decompress((DATA / "houseexpo" / "plans_33717.jsonl.gz").read_bytes()).splitlines()
    return sorted(found, key=lambda line: decode(line).id)


def moved(plan: FloorPlan, number: int) -> FloorPlan:
    """The same plan, each vertex moved by up to 0.2 m, as the number has it."""
    rng = np.random.default_rng([number, int(plan.id[:8], 16)])
    return replace(plan, verts=plan.verts + rng.uniform(-0.2, 0.2, plan.verts.shape))


@pytest.fixture(scope="module")
def load(lines: list[bytes], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[int], FloorPlan]]:
    """Gives the plan of a number; the moved ones were written before, since moving is not what is compared."""
    ends = [0]
    with (tmp_path_factory.mktemp("moved") / "plans.jsonl").open("w+b") as file:
        for number in range(TIMES):
            for line in lines:
                plan = encode(moved(decode(line), number)) if number else line
                ends.append(ends[-1] + file.write(plan))
        file.flush()
        yield lambda i: decode(os.pread(file.fileno(), ends[i + 1] - ends[i], ends[i]))


def compared(
    load: Callable[[int], FloorPlan], count: int, known: PairSearchResult | None = None
) -> tuple[PairSearchResult, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    found = find_copies(load, count, known=known, threads=THREADS)
    return found, time.perf_counter() - wall, time.process_time() - cpu


@needs_shared
def test_dedupe_of_the_published_plans(lines: list[bytes], load: Callable[[int], FloorPlan]) -> None:
    find_copies(load, 300)  # compiles
    count = TIMES * len(lines)
    found, wall, cpu = compared(load, count)
    table = Table(title=f"Dedupe of {count} plans, {THREADS} threads")
    for heading in ("", "seconds", "of a core", "pairs", "exact", "dropped", "peak GB"):
        table.add_column(heading, justify="right" if heading else "left")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    dropped = choose_duplicates([str(i) for i in range(count)], found.pairs)
    exact = sum(duplicate.difference == 0 for duplicate in dropped)
    table.add_row(
        "all", f"{wall:.1f}", f"{cpu:.1f}", str(len(found.pairs)), str(exact), str(len(dropped)), f"{peak:.2f}"
    )
    old = {i: row for i, row in found.fingerprints.items() if i % 40}
    known = PairSearchResult(old, tuple(pair for pair in found.pairs if pair.first in old and pair.second in old))
    again, wall, cpu = compared(load, count, known)
    table.add_row(f"{count - len(old)} added", f"{wall:.1f}", f"{cpu:.1f}", str(len(again.pairs)), "", "", "")
    Console().print(table)
    assert again.pairs == found.pairs
    if TIMES == 1:
        assert exact >= 614
        _sheet(lines, found)


@needs_shared
def test_find_duplicates_of_the_published_plans() -> None:
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    find_duplicates(plans[:300])  # compiles
    before, wall = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    found = find_duplicates(plans, threads=THREADS)
    wall, peak = time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    Console().print(
        f"houseexpo.find_duplicates, {len(plans)} plans, {THREADS} threads: {wall:.1f} s, {len(found)} duplicates, "
        f"peak {peak / 2**20:.2f} GB ({before / 2**20:.2f} GB before)"
    )
    assert sum(duplicate.difference == 0 for duplicate in found) >= 614


def _sheet(lines: list[bytes], found: PairSearchResult, most: int = 60) -> None:
    """Draw pairs that are near but not equal, the furthest first."""
    folder = os.environ.get("HOUSEEXPO_BENCH_OUT")
    if folder is None:
        return
    near = sorted((pair for pair in found.pairs if pair.difference > 0), key=lambda pair: -pair.difference)
    chosen = near[:: max(len(near) // most, 1)][:most]
    plans = [decode(lines[i]) for pair in chosen for i in pair[:2]]
    titles = [f"{pair.difference:.4f} {pair.symmetry}" for pair in chosen for _ in range(2)]
    sheet = contact_sheet([draw_plan(plan, size=160) for plan in plans], 12, titles)
    Image.fromarray(sheet).save(Path(folder) / "near_pairs.png")
