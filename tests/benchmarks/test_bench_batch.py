"""How long a house takes, from file to plan, and a batch of them, from files to a data set.

Single houses are measured in processor time, which other programs on the machine change less; a batch by the clock.
``-k drawings`` times the command itself on 1,000 drawn plans.
The last benchmark measures what ten thousand houses cost beside their planning: the journal, packing, memory, and a
run that finds all done. Its houses are small files with outlines of their own, and the planner only draws them.
"""

from __future__ import annotations

import contextlib
import gc
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

from houseexpo.dataset import open_dataset
from houseexpo.exports import export
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.batch.job import level_rng
from pipeline.batch.listing import list_inputs
from pipeline.cli_build import from_python
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig, BuildOptions
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.values import Input, Level
from tests.builders.batch import run_build
from tests.builders.suncg_houses import write_house

HOUSES, SEED = 200, 2019
BATCH, WARM_UP = 2_000, 5
DRAWINGS, DRAWN = 1_000, ("geojson", "svg")
SUNCG = 45_622


def planned(item: Input, config: BuildConfig) -> tuple[float, float]:
    """Return the seconds of processor time that one house takes to load and to plan."""
    start = time.process_time()
    levels = [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    loaded = time.process_time()
    for level in levels:
        try:
            plan_level(level, config.stages, level_rng(level, SEED))
        except Rejection:
            continue
    return loaded - start, time.process_time() - loaded


def test_one_house_from_file_to_plan(tmp_path: Path) -> None:
    for index in range(HOUSES):
        write_house(tmp_path, index, SEED)
    config = BuildConfig(BuildOptions(sources=(str(tmp_path),), seed=SEED))
    items = list(list_inputs(config))
    for item in items[:WARM_UP]:
        planned(item, config)
    gc.freeze()  # as a worker does
    times = 1000 * np.array([planned(item, config) for item in items])
    table = Table(title=f"One house, {HOUSES} procedural houses, one core (ms)")
    for heading in ("", "median", "95%", "worst"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, column in (("load", times[:, 0]), ("plan", times[:, 1]), ("together", times.sum(axis=1))):
        table.add_row(name, *(f"{value:.1f}" for value in np.percentile(column, [50, 95, 100])))
    Console().print(table)
    assert len(times) == HOUSES


class Used(NamedTuple):
    """The most megabytes that a process held, and the seconds of processor that it took."""

    megabytes: float = 0.0
    seconds: float = 0.0


@contextlib.contextmanager
def watched() -> Iterator[dict[int, Used]]:
    """Note what each process below this one uses meanwhile, by its number; its last tenth of a second may be missed."""
    found: dict[int, Used] = {}
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(0.1):
            for process in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.NoSuchProcess):
                    times, before = process.cpu_times(), found.get(process.pid, Used())
                    most = max(before.megabytes, process.memory_info().rss / 2**20)
                    found[process.pid] = Used(most, times.user + times.system)

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield found
    finally:
        ended.set()
        thread.join()


def test_a_batch_of_made_houses(tmp_path: Path) -> None:
    houses = tmp_path / "houses"
    for index in range(BATCH):
        write_house(houses, index, SEED)
    table = Table(title=f"houseexpo build, {BATCH} houses in SUNCG's layout: files to plans, deduped and packed")
    figures_of = ("workers", "seconds", "times one worker", "ms a house, median", f"minutes for {SUNCG}", "MB a worker")
    for heading in figures_of:
        table.add_column(heading, justify="right")
    alone = 0.0
    for workers in (1, 2):
        start = time.perf_counter()
        with watched() as used:
            data_set = run_build([houses], tmp_path / str(workers), workers=workers, seed=SEED, plan=plan_level)
        seconds = time.perf_counter() - start
        alone = alone or seconds
        median = float(np.median([entry.seconds for entry in data_set.entries]))
        figures = (f"{seconds:.1f}", f"{alone / seconds:.2f}", f"{1000 * median:.1f}")
        most = f"{max(each.megabytes for each in used.values()):.0f}"
        table.add_row(str(workers), *figures, f"{seconds / BATCH * SUNCG / 60:.1f}", most)
        assert data_set.ids
    Console().print(table)


def test_the_command_builds_a_thousand_drawings(tmp_path: Path) -> None:
    """Time the command as people run it, from its start to its end, of files that the exports write."""
    plans = tmp_path / "plans"
    from_python(
        [f"procedural:{DRAWINGS}?style=published"],
        str(plans),
        config=None,
        overrides=None,
        workers=2,
        others="refuse",
        seed=SEED,
    )
    data = open_dataset(plans)
    table = Table(title=f"houseexpo build FOLDER --out OUT --workers 2, {len(data.ids)} drawings")
    for heading in ("format", "seconds", "processor, s", "of it in the workers", "processor, ms a plan", "plans"):
        table.add_column(heading, justify="left" if heading == "format" else "right")
    for form in DRAWN:
        folder, out = tmp_path / form, tmp_path / f"{form}_out"
        for name in data.ids:
            export(data[name], form, folder)
        command = [sys.executable, "-m", "houseexpo", "build", str(folder), "--out", str(out), "--workers", "2"]
        start = time.perf_counter()
        with watched() as used:
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            assert process.wait() == 0
        seconds = time.perf_counter() - start
        whole = sum(each.seconds for each in used.values())
        workers = whole - used[process.pid].seconds
        made = len(open_dataset(out).ids)
        figures = (f"{seconds:.1f}", f"{whole:.1f}", f"{workers:.1f}", f"{1000 * whole / len(data.ids):.1f}", str(made))
        table.add_row(form, *figures)
        assert made > 0.99 * len(data.ids)
    Console(width=120).print(table)


FEW, MANY = 1_000, 10_000
BLOCK = "".join(f"v {x} {y} {z}\n" for z in (0, 3) for x, y in ((0, 0), (8, 0), (8, 6), (0, 6)))
SIDES = "f 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
RUN = """
import sys, time
from pathlib import Path
import msgspec
from tests.benchmarks.test_bench_batch import memory_mb, skyline
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
