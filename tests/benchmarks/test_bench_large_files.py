"""Where the time of a house goes, and what large files cost, in processor time.

Large files: a house of many faces, a city, an office, 10,000 ProcTHOR houses in one file, a flat of 5 x 10^7
points, and a campus of as many.
"""

from __future__ import annotations

import gzip
import itertools
import json
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.sources.procedural import write_house
from pipeline.values import Level
from tests.builders.formats.clouds import flat, sampled
from tests.builders.meshes import city, house_of_many_faces, office
from tests.builders.shared import DATA, needs_shared

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
                for snapshot in run_stages(level, PipelineConfig(), np.random.default_rng(0)):
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


PROCTHOR_HOUSES, POINTS, BLOCK = 10_000, 50_000_000, 1_000_000
HOUSE_MS, GIGABYTES = 40.0, 2.0
READ = """
import sys, time
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
def peak():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM")) / 1024
start, count, said = time.process_time(), 0, ""
try:
    for item in find(sys.argv[1]):
        for level in reader(item.reader).read(item):
            count += 1
            if count in (100, 1000):
                said += f"{peak():.0f} MB after {count}, "
except Rejection as rejection:
    said += f"{rejection.reason.value}: {rejection.detail}, "
print(f"{count}|{time.process_time() - start:.1f}|{peak():.0f}|{said}")
"""
"""Reads all levels of a source in a process of its own; prints levels, seconds of processor, MB at most, words.

The peak is this program's alone: Linux's ``getrusage`` counts that of the program that started it, too.
"""


def cost(path: Path) -> tuple[int, float, float, str]:
    """How many levels a source has, and what it takes to read them: seconds, GB, words."""
    done = subprocess.run([sys.executable, "-c", READ, str(path)], check=True, capture_output=True, text=True)
    count, seconds, megabytes, said = done.stdout.strip().split("|")
    return int(count), float(seconds), float(megabytes) / 1024, said


@needs_shared
def test_a_file_of_ten_thousand_procthor_houses(tmp_path: Path) -> None:
    houses = [json.loads((DATA / "procthor" / f"house_{k}" / "house.json").read_bytes()) for k in (0, 1)]
    path = tmp_path / "many.jsonl.gz"
    with gzip.open(path, "wt", compresslevel=1) as stream:
        for number, house in zip(range(PROCTHOR_HOUSES), itertools.cycle(houses), strict=False):
            stream.write(json.dumps(_shifted(house, 0.1 * (number % 500))) + "\n")
    count, seconds, gigabytes, said = cost(path)
    each = 1000 * seconds / PROCTHOR_HOUSES
    Console().print(f"{count:,} ProcTHOR houses: {each:.1f} ms a house, {said}{1024 * gigabytes:.0f} MB at most")
    assert count == PROCTHOR_HOUSES
    assert each <= HOUSE_MS


def test_a_flat_of_fifty_million_points(tmp_path: Path) -> None:
    one = sampled(flat(), np.random.default_rng(0), density=3000.0, noise_m=0.005)
    path = _written(tmp_path / "flat.ply", one, np.array([8.0, 4.0, 0.0]), 4)
    count, seconds, gigabytes, _ = cost(path)
    Console().print(f"{POINTS:,} points of a flat: {count} level, {seconds:.0f} s, {gigabytes:.2f} GB at most")
    assert count == 1
    assert gigabytes <= GIGABYTES


def test_a_campus_of_fifty_million_points(tmp_path: Path) -> None:
    one = np.random.default_rng(0).random((BLOCK, 3)) * (12.0, 12.0, 12.0)
    path = _written(tmp_path / "campus.ply", one, np.array([14.0, 14.0, 0.0]), 20)
    count, seconds, gigabytes, said = cost(path)
    Console().print(f"{POINTS:,} points of a campus: {said}{seconds:.0f} s, {gigabytes:.2f} GB at most")
    assert count == 0
    assert gigabytes <= GIGABYTES


def _shifted(value: Any, metres: float) -> Any:
    """A house with all that has x, y and z moved along x; holes, measured along their walls, stay."""
    if isinstance(value, list):
        return [_shifted(each, metres) for each in value]
    if not isinstance(value, dict):
        return value
    moved = {key: each if key == "holePolygon" else _shifted(each, metres) for key, each in value.items()}
    if {"x", "y", "z"} <= set(moved) and isinstance(moved["x"], int | float):
        moved["x"] += metres
    return moved


def _written(path: Path, points: np.ndarray, step: np.ndarray, across: int) -> Path:
    """Write POINTS points: the same ones again and again, side by side on a square of places, each time a bit off."""
    rng = np.random.default_rng(1)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\n"
    with path.open("wb") as stream:
        stream.write((head + "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n").encode())
        for number in itertools.count():
            place = number % across**2
            left = POINTS - number * len(points)
            if left <= 0:
                return path
            moved = points[:left] + step * (place % across, place // across, 0.0) + rng.normal(0.0, 0.005, 3)
            stream.write(moved.astype("<f4").tobytes())
    return path
