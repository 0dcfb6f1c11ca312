"""``houseexpo stats`` on the published plans: for the first time, again, and with rooms and doors that are found."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

from tests.builders.shared import DATA, needs_shared

PUBLISHED = DATA / "houseexpo" / "plans_33717.jsonl.gz"
PLANS, SAMPLE, SEED = 33_717, 2000, 2019
SECONDS, GIGABYTES, GEOMETRY_SECONDS = 60.0, 1.0, 600.0
_LOOK_S = 0.1

pytestmark = needs_shared


@dataclass(frozen=True)
class Cost:
    """Seconds of wall clock, seconds of processor of all processes, and the most memory they had at one time, GB."""

    wall: float
    processor: float
    memory: float

    def cells(self) -> tuple[str, str, str]:
        return f"{self.wall:.1f}", f"{self.processor:.1f}", f"{self.memory:.2f}"


def measured(cache: Path, *words: str | Path) -> Cost:
    """Run the command with this cache folder; pages that processes share count for each of them."""
    start, before = time.perf_counter(), os.times()
    process = psutil.Popen(
        [sys.executable, "-m", "stats", *map(str, words)],
        env={**os.environ, "HOUSEEXPO_CACHE": str(cache)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    most = 0
    while process.poll() is None:
        most = max(most, resident(process))
        time.sleep(_LOOK_S)
    after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    assert process.returncode == 0
    return Cost(time.perf_counter() - start, spent, most / 2**30)


def resident(process: psutil.Popen) -> int:
    """Return the bytes that a process and all below it have in memory."""
    total = 0
    try:
        for one in (process, *process.children(recursive=True)):
            total += one.memory_info().rss
    except psutil.NoSuchProcess:
        return total
    return total


def table_of(title: str) -> Table:
    table = Table(title=title, min_width=90)
    for heading in ("", "wall, s", "processor, s", "memory, GB", "at most"):
        table.add_column(heading, justify="right" if heading else "left")
    return table


def test_statistics_of_all_published_plans(tmp_path: Path) -> None:
    table = table_of(f"houseexpo stats, {PLANS:,} published plans, two cores")
    first = measured(tmp_path / "cache", PUBLISHED, "--out", tmp_path / "report.html")
    table.add_row("first time, opening included", *first.cells(), f"{SECONDS:.0f} s, {GIGABYTES:.0f} GB")
    again = measured(tmp_path / "cache", PUBLISHED, "--out", tmp_path / "report.html")
    table.add_row("again", *again.cells(), "")
    Console(width=120).print(table)
    assert first.processor / 2 <= SECONDS
    assert first.memory <= GIGABYTES
    assert again.processor < first.processor


def test_with_rooms_and_doors_that_are_found(tmp_path: Path) -> None:
    with gzip.open(PUBLISHED) as stream:
        lines = stream.readlines()
    chosen = np.random.default_rng(SEED).choice(len(lines), SAMPLE, replace=False)
    sample = tmp_path / "sample.jsonl"
    sample.write_bytes(b"".join(lines[k] for k in sorted(chosen)))
    table = table_of(f"houseexpo stats --geometry, {SAMPLE:,} of {PLANS:,} published plans, two cores")
    first = measured(tmp_path / "cache", sample, "--geometry")
    table.add_row("first time", *first.cells(), "")
    again = measured(tmp_path / "cache", sample, "--geometry")
    table.add_row("again", *again.cells(), "")
    more = PLANS / SAMPLE - 1.0  # start, end and imports cost the same however many plans there are
    wall, processor = (
        whole + more * (whole - once) for whole, once in ((first.wall, again.wall), (first.processor, again.processor))
    )
    table.add_row(f"all {PLANS:,}, reckoned", f"{wall:.0f}", f"{processor:.0f}", "", f"{GEOMETRY_SECONDS:.0f} s")
    Console(width=120).print(table)
    assert processor / 2 <= GEOMETRY_SECONDS
