"""Where the time of a house goes, and what large files cost; all in processor time."""

from __future__ import annotations

import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from pipeline.algorithm import stages
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.sources.procedural import write_house
from pipeline.values import Level
from tests.builders.large import city, house_of_many_faces, office

HOUSES, SEED = 200, 2019
WARM_UP = 5
FACES, CITY_FACES, CORRIDORS = 3_700_000, 50_000, 3
PLAN = """
import sys, time
import numpy as np
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
start, outcomes = time.process_time(), []
for item in find(sys.argv[1]):
    try:
        for level in reader(item.reader).read(item):
            plans = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            outcomes += [f"{len(plan.rooms)} rooms" for plan in plans]
    except Rejection as rejection:
        outcomes.append(rejection.reason)
peak = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM")) / 2**20
print(time.process_time() - start, peak, ", ".join(outcomes))
"""
"""Plans one file; prints the processor's seconds, the gigabytes at most, and what came of it.

The peak is this program's alone: Linux's ``getrusage`` counts that of the program that started it, too.
"""


def test_where_the_time_of_a_house_goes(tmp_path: Path) -> None:
    for index in range(HOUSES):
        write_house(tmp_path, index, SEED)
    spent: dict[str, list[float]] = defaultdict(list)
    items = list(suncg.find(str(tmp_path)))
    for item in [*items[:WARM_UP], *items]:
        start = time.process_time()
        levels = [level for level in suncg.read(item) if isinstance(level, Level)]
        spent["load"].append(time.process_time() - start)
        for level in levels:
            start = time.process_time()
            try:
                for snapshot in stages(level, PipelineConfig(), np.random.default_rng(0)):
                    spent[snapshot.stage].append(time.process_time() - start)
                    start = time.process_time()
            except Rejection:
                continue
    table = Table(title=f"Where the time goes, {HOUSES} procedural houses (ms, median)")
    table.add_column("step")
    table.add_column("ms", justify="right")
    for name, seconds in spent.items():  # of medians, what is loaded once is no part
        table.add_row(name, f"{1000 * float(np.median(seconds)):.1f}")
    Console().print(table)
    assert len(spent["load"]) == WARM_UP + HOUSES


def test_large_files(tmp_path: Path) -> None:
    table = Table(title="Large files, each in a process of its own")
    for heading in ("file", "faces", "core s", "GB", "came out as"):
        table.add_column(heading, justify="right" if heading in {"faces", "core s", "GB"} else "left")
    made = {
        "a storey of 150 rooms": office(tmp_path / "office.ply", CORRIDORS),
        "a city block of shells": city(tmp_path / "shells.ply", CITY_FACES),
        "a city block of empty houses": city(tmp_path / "empty.ply", CITY_FACES, hollow=True),
        "a house": house_of_many_faces(tmp_path / "house.ply", FACES),
    }
    for (what, faces), file in zip(made.items(), ("office", "shells", "empty", "house"), strict=True):
        command = [sys.executable, "-c", PLAN, str(tmp_path / f"{file}.ply")]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        seconds, gigabytes, outcome = done.stdout.strip().split(" ", 2)
        table.add_row(what, f"{faces:,}", f"{float(seconds):.1f}", f"{float(gigabytes):.2f}", outcome)
    Console().print(table)
