"""How long the published plans take to be compared, and which of them are nearly the same.

The near ones lie, pair by pair, on a sheet for a person to judge: ``HOUSEEXPO_BENCH_OUT`` says in which folder.
"""

from __future__ import annotations

import gzip
import os
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console
from rich.table import Table

from houseexpo.analysis.similarity import Comparison, drop_duplicates, find_duplicates, find_pairs
from houseexpo.dataset import open_dataset
from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.json_codec import encode
from tests.builders.shared import DATA, needs_shared

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
    """Gives the plan of a number; the moved ones were written before, since moving is not what is timed."""
    ends = [0]
    with (tmp_path_factory.mktemp("moved") / "plans.jsonl").open("w+b") as file:
        for number in range(TIMES):
            for line in lines:
                plan = encode(moved(decode(line), number)) if number else line
                ends.append(ends[-1] + file.write(plan))
        file.flush()
        yield lambda i: decode(os.pread(file.fileno(), ends[i + 1] - ends[i], ends[i]))


def timed(
    load: Callable[[int], FloorPlan], count: int, known: Comparison | None = None
) -> tuple[Comparison, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    found = find_pairs(load, count, known=known, threads=THREADS)
    return found, time.perf_counter() - wall, time.process_time() - cpu


@needs_shared
def test_dedupe_of_the_published_plans(lines: list[bytes], load: Callable[[int], FloorPlan]) -> None:
    find_pairs(load, 300)  # compiles
    count = TIMES * len(lines)
    found, wall, cpu = timed(load, count)
    table = Table(title=f"Dedupe of {count} plans, {THREADS} threads")
    for heading in ("", "seconds", "of a core", "pairs", "exact", "dropped", "peak GB"):
        table.add_column(heading, justify="right" if heading else "left")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    dropped = drop_duplicates([str(i) for i in range(count)], found.pairs)
    exact = sum(duplicate.difference == 0 for duplicate in dropped)
    table.add_row(
        "all", f"{wall:.1f}", f"{cpu:.1f}", str(len(found.pairs)), str(exact), str(len(dropped)), f"{peak:.2f}"
    )
    old = {i: row for i, row in found.fingerprints.items() if i % 40}
    known = Comparison(old, tuple(pair for pair in found.pairs if pair.first in old and pair.second in old))
    again, wall, cpu = timed(load, count, known)
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


def _sheet(lines: list[bytes], found: Comparison, most: int = 60) -> None:
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
