"""What ten thousand houses cost beside their planning: the journal, packing, memory, and a run that finds all done.

Houses are small files with outlines of their own, and the planner only draws them, so that nothing else is measured.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo.floorplan import FloorPlan
from pipeline.config import PipelineConfig
from pipeline.values import Level

FEW, MANY = 1_000, 10_000
BLOCK = "".join(f"v {x} {y} {z}\n" for z in (0, 3) for x, y in ((0, 0), (8, 0), (8, 6), (0, 6)))
SIDES = "f 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
RUN = """
import sys, time
from pathlib import Path
import msgspec
from tests.benchmarks.test_bench_many import memory_mb, skyline
from tests.builders.batch import run_build
ended, start = {}, time.perf_counter()
def progress(what, done, total):
    ended[what] = time.perf_counter() - start, memory_mb()
found = run_build([Path(sys.argv[1])], Path(sys.argv[2]), workers=2, plan=skyline, progress=progress)
figures = {"seconds": time.perf_counter() - start, "unchanged": found.unchanged, "plans": len(found.ids)}
figures |= {"planned": ended["planning"], "end": memory_mb()}
print(msgspec.json.encode(figures).decode())
"""
"""Builds in a process of its own, and prints seconds and megabytes."""


def skyline(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Return a plan with an outline that hardly any other has: ten columns of some height."""
    heights = np.round(rng.uniform(3.0, 9.0, 10), 2)
    top = [(x + k, height) for k, height in enumerate(heights.tolist()) for x in (0.0, 1.0)]
    ring = np.round([(0.0, 0.0), *top, (10.0, 0.0)], 2)
    return (FloorPlan(level.id, ring, 1, {}, frame=level.frame, provenance=level.provenance),)


def memory_mb() -> float:
    """Return the megabytes that this process holds at most so far."""
    text = Path("/proc/self/status").read_text()
    return int(text.partition("VmHWM:")[2].split()[0]) / 1024


def build(houses: Path, out: Path) -> dict[str, object]:
    command = [sys.executable, "-c", RUN, str(houses), str(out)]
    done = subprocess.run(command, check=True, capture_output=True)
    found: dict[str, object] = msgspec.json.decode(done.stdout.splitlines()[-1])
    return found


def test_what_many_houses_cost(tmp_path: Path) -> None:
    table = Table(title="Houses whose planning costs nothing, two workers")
    for heading in ("houses", "planned, s", "all, s", "MB when planned", "MB at the end", "second run, s", "MB"):
        table.add_column(heading, justify="right")
    for count in (FEW, MANY):
        houses, out = tmp_path / f"houses_{count}", tmp_path / f"out_{count}"
        houses.mkdir()
        for number in range(count):
            (houses / f"house_{number:05d}.obj").write_text(f"# {number}\n{BLOCK}{SIDES}")
        first, second = build(houses, out), build(houses, out)
        assert second["unchanged"]
        planned_s, planned_mb = first["planned"]  # type: ignore[misc]
        figures = (planned_s, first["seconds"], planned_mb, first["end"], second["seconds"], second["end"])
        table.add_row(str(count), *(f"{value:.1f}" for value in figures))
    Console(width=120).print(table)
