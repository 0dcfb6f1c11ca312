"""Where the time of a house goes, and what a mesh of two million faces costs."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import trimesh
from rich.console import Console
from rich.table import Table

from pipeline.algorithm import stages
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.sources.procedural import write_house
from pipeline.values import Level

HOUSES, SEED = 200, 2019
FACES = 2_000_000
SECONDS, GIGABYTES = 60, 4


def test_where_the_time_of_a_house_goes(tmp_path: Path) -> None:
    for index in range(HOUSES):
        write_house(tmp_path, index, SEED)
    spent: dict[str, list[float]] = defaultdict(list)
    for item in suncg.find(str(tmp_path)):
        start = time.perf_counter()
        levels = [level for level in suncg.read(item) if isinstance(level, Level)]
        spent["load"].append(time.perf_counter() - start)
        for level in levels:
            start = time.perf_counter()
            try:
                for snapshot in stages(level, PipelineConfig(), np.random.default_rng(0)):
                    spent[snapshot.stage].append(time.perf_counter() - start)
                    start = time.perf_counter()
            except Rejection:
                continue
    table = Table(title=f"Where the time goes, {HOUSES} procedural houses (ms, median)")
    table.add_column("step")
    table.add_column("ms", justify="right")
    for name, seconds in spent.items():
        table.add_row(name, f"{1000 * float(np.median(seconds)):.1f}")
    Console().print(table)
    assert len(spent["load"]) == HOUSES


def walls_of_many_faces(path: Path) -> int:
    """A house of six rooms whose walls are cut into small faces, as a scan's are; returns how many."""
    boxes = [trimesh.creation.box(bounds=[[x, 0, 0], [x + 0.2, 8.2, 2.7]]) for x in (0.0, 4.0, 8.0, 12.0)]
    for y in (0.0, 4.0, 8.0):
        for x in (0.2, 4.2, 8.2):
            door = y == 4.0
            right = x + 2.0 if door else x + 3.8
            boxes.append(trimesh.creation.box(bounds=[[x, y, 0], [right, y + 0.2, 2.7]]))
            if door:
                boxes.append(trimesh.creation.box(bounds=[[x + 2.0, y, 2.1], [x + 2.9, y + 0.2, 2.7]]))
                boxes.append(trimesh.creation.box(bounds=[[x + 2.9, y, 0], [x + 3.8, y + 0.2, 2.7]]))
    mesh = trimesh.util.concatenate(boxes)
    while len(mesh.faces) < FACES:
        mesh = mesh.subdivide()
    mesh.export(path)
    return len(mesh.faces)


def test_a_mesh_of_two_million_faces(tmp_path: Path) -> None:
    faces = walls_of_many_faces(tmp_path / "house.ply")
    start = time.perf_counter()
    command = [sys.executable, "-m", "pipeline", str(tmp_path / "house.ply"), "--out", str(tmp_path / "plans")]
    done = subprocess.run([*command, "--workers", "1"], check=False, capture_output=True, text=True)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    Console().print(f"{faces:,} faces: {seconds:.1f} s, {peak:.2f} GB at most, exit code {done.returncode}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list((tmp_path / "plans" / "json").iterdir())) == 1
    assert seconds <= SECONDS
    assert peak <= GIGABYTES
