"""Where the time of a house goes, and what large files cost, in processor time.

Large files: a house of many faces, a city, an office, 10,000 ProcTHOR houses in one file, a USD scene of 1 GB, and a
flat of 5 x 10^7 points.
"""

from __future__ import annotations

import gzip
import itertools
import json
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.values import Level
from tests.builders.formats.clouds import flat, sampled
from tests.builders.meshes import city, house_of_many_faces, office
from tests.builders.shared import DATA, needs_shared
from tests.builders.suncg_houses import write_house

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


PROCTHOR_HOUSES, POINTS = 10_000, 50_000_000
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


def cost(path: Path, within: Sequence[str] = ()) -> tuple[int, float, float, str]:
    """How many levels a source has, and what it takes to read them: seconds, GB, words.

    ``within`` are words of a command that limits the program.
    """
    command = [*within, sys.executable, "-c", READ, str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
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


USD_BYTES, USD_GIGABYTES = 10**9, 8.0
THING_SIDE = 448
"""Points along each side of a piece of furniture: 400,000 faces, 8 MB."""


def test_a_usd_scene_of_a_gigabyte(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    path, things = dense_usd(tmp_path / "scene.usdc", USD_BYTES)
    limit = ["prlimit", f"--as={int(USD_GIGABYTES * 2**30)}"]
    count, seconds, gigabytes, said = cost(path, limit)
    size = path.stat().st_size / 1e9
    faces = (things + -(-things // 4)) * 2 * (THING_SIDE - 1) ** 2
    Console().print(
        f"USD, {size:.2f} GB, {things} pieces of furniture, {faces:,} faces: {count} level, {seconds:.0f} s, "
        f"{gigabytes:.2f} GB at most {said}"
    )
    assert count == 1
    assert gigabytes <= USD_GIGABYTES


def dense_usd(path: Path, n_bytes: int) -> tuple[Path, int]:
    """Write a house of USD with furniture of many faces, no two alike, and every fourth once more as an instance.

    Returns
    -------
    The path, and how many pieces of furniture have points of their own.
    """
    from pxr import Gf, Sdf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/House").GetPrim())
    for k, (x1, y1, x2, y2) in enumerate(
        [(0, 0, 40, 0.2), (0, 39.8, 40, 40), (0, 0.2, 0.2, 39.8), (39.8, 0.2, 40, 39.8), (20, 0.2, 20.2, 38.0)]
    ):
        _usd_box(stage, f"/House/wall_{k}", (x1, y1, 0.0), (x2, y2, 2.5))
    _usd_box(stage, "/House/floor_0", (0.0, 0.0, -0.05), (40.0, 40.0, 0.0))
    n = THING_SIDE
    u, v = (each.ravel() for each in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.column_stack([a, a + n, a + 1]), np.column_stack([a + 1, a + n, a + n + 1])])
    rng, things = np.random.default_rng(0), 0
    while things == 0 or things * (n * n * 32 + len(faces)) < n_bytes:
        mesh = UsdGeom.Mesh.Define(stage, f"/House/Things/sofa_{things}/body")
        points = np.column_stack([u, v, 0.4 + 0.3 * np.sin(7 * u + things)]) + rng.normal(0.0, 0.002, (n * n, 3))
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(rng.normal(size=(n * n, 3)).astype(np.float32)))
        coordinates = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
        coordinates.Set(Vt.Vec2fArray.FromNumpy(rng.random((n * n, 2)).astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel().astype(np.int32)))
        one = UsdGeom.Xform(stage.DefinePrim(f"/House/Things/sofa_{things}", "Xform"))
        place = Gf.Vec3d(1.0 + 1.5 * (things % 12), 1.0 + 2.5 * (things // 12), 0.0)
        one.AddTranslateOp().Set(place)
        if things % 4 == 0:
            again = UsdGeom.Xform.Define(stage, f"/House/Again/chair_{things}")
            again.GetPrim().GetReferences().AddInternalReference(mesh.GetPath().GetParentPath())
            again.GetPrim().SetInstanceable(True)
            again.GetOrderedXformOps()[0].Set(place + Gf.Vec3d(19.5, 0.0, 0.0))
        things += 1
    stage.GetRootLayer().Save()
    return path, things


def _usd_box(stage: Any, name: str, low: tuple[float, ...], high: tuple[float, ...]) -> None:
    from pxr import Gf, UsdGeom

    cube = UsdGeom.Cube.Define(stage, name)
    cube.CreateSizeAttr(1.0)
    middle, size = (np.array(low) + high) / 2, np.array(high) - low
    cube.AddTranslateOp().Set(Gf.Vec3d(*middle.tolist()))
    cube.AddScaleOp().Set(Gf.Vec3f(*size.tolist()))


def test_a_flat_of_fifty_million_points(tmp_path: Path) -> None:
    one = sampled(flat(), np.random.default_rng(0), density=3000.0, noise_m=0.005)
    path = _written(tmp_path / "flat.ply", one, np.array([8.0, 4.0, 0.0]), 4)
    count, seconds, gigabytes, _ = cost(path)
    Console().print(f"{POINTS:,} points of a flat: {count} level, {seconds:.0f} s, {gigabytes:.2f} GB at most")
    assert count == 1
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
