"""How long a house takes, from file to plan, and a batch of them, from files to a data set.

Single houses are measured in processor time, which other programs on the machine change less; a batch by the clock.
"""

from __future__ import annotations

import contextlib
import gc
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

from pipeline.algorithm import plan_level
from pipeline.batch.job import rng_of
from pipeline.batch.listing import list_inputs
from pipeline.config_file import BuildConfig, BuildOptions
from pipeline.executors.local import Limits, run
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.sources.procedural import write_house
from pipeline.values import Input, Level
from tests.builders.batch import run_build

HOUSES, SEED = 200, 2019
BATCH, WARM_UP = 2_000, 5
SUNCG = 45_622


def planned(item: Input, config: BuildConfig) -> tuple[float, float]:
    """Return the seconds of processor time that one house takes to load and to plan."""
    start = time.process_time()
    levels = [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    loaded = time.process_time()
    for level in levels:
        try:
            plan_level(level, config.stages, rng_of(level, SEED))
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


@contextlib.contextmanager
def watched() -> Iterator[dict[int, float]]:
    """Note the most megabytes that each process below this one holds meanwhile, by its number."""
    found: dict[int, float] = {}
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(0.1):
            for process in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.NoSuchProcess):
                    found[process.pid] = max(found.get(process.pid, 0.0), process.memory_info().rss / 2**20)

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
        with watched() as megabytes:
            data_set = run_build([houses], tmp_path / str(workers), workers=workers, seed=SEED, plan=plan_level)
        seconds = time.perf_counter() - start
        alone = alone or seconds
        median = float(np.median([entry.seconds for entry in data_set.entries]))
        figures = (f"{seconds:.1f}", f"{alone / seconds:.2f}", f"{1000 * median:.1f}")
        most = f"{max(megabytes.values()):.0f}"
        table.add_row(str(workers), *figures, f"{seconds / BATCH * SUNCG / 60:.1f}", most)
        assert data_set.ids
    Console().print(table)


def same(word: str) -> str:
    return word


def test_what_an_executor_adds_to_an_item() -> None:
    items, limits = ["x"] * 2000, Limits(60.0, 2**31)
    list(run(same, ["warm"], workers=2, limits=limits))
    start = time.perf_counter()
    assert len(list(run(same, items, workers=2, limits=limits))) == len(items)
    Console().print(
        f"an executor adds {1e6 * (time.perf_counter() - start) / len(items):.0f} us to an item, two workers"
    )
