"""What a result depends on: the files that were read, the parameters, the program, its libraries; and nothing else."""

from __future__ import annotations

import ast
import errno
import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh

import houseexpo
import pipeline
from houseexpo.floorplan import FloorPlan
from pipeline.batch import recipe
from pipeline.config import PipelineConfig
from pipeline.sources.files import record_opened_files
from pipeline.values import Level
from tests.builders.batch import boxed, contents, lines, one_room, run_build
from tests.builders.suncg_houses import write_house


def done(out: Path) -> int:
    """Return how many inputs were done in all runs."""
    return len((out / ".build" / "journal.jsonl").read_bytes().splitlines())


def touch(file: Path) -> None:
    """Change a file's time alone."""
    os.utime(file, ns=(0, file.stat().st_mtime_ns - 10**9))


def test_a_touched_file_is_read_and_found_the_same(tmp_path: Path) -> None:
    house, out = one_room(tmp_path / "house.ply"), tmp_path / "out"
    run_build([house], out)
    touch(house)
    assert run_build([house], out).unchanged
    assert run_build([house], out).unchanged
    assert done(out) == 2  # the new time was put down, so that nothing is read a third time


@pytest.mark.slow
def test_a_change_that_does_not_show_is_found_by_reading_all(tmp_path: Path) -> None:
    house, out = one_room(tmp_path / "house.ply"), tmp_path / "out"
    run_build([house], out)
    touch(house)
    run_build([house], out)
    was = house.stat()
    one_room(house, 9.0, 4.0)
    os.utime(house, ns=(0, was.st_mtime_ns))
    assert house.stat().st_size == was.st_size
    assert run_build([house], out).unchanged
    assert not run_build([house], out, rehash=True).unchanged


def test_a_gltf_file_depends_on_its_buffer(tmp_path: Path) -> None:
    mesh = trimesh.load(one_room(tmp_path / "made" / "house.ply"), force="mesh")
    folder, out = tmp_path / "gltf", tmp_path / "out"
    folder.mkdir()
    for name, data in trimesh.Scene(mesh).export(file_type="gltf").items():
        (folder / name.replace("model", "house")).write_bytes(data)
    buffer = min(folder.glob("*.bin"))
    run_build([folder], out)
    data = np.frombuffer(buffer.read_bytes(), np.uint8).copy()
    buffer.write_bytes(data.tobytes()[:-1] + b"\1")
    touch(buffer)
    assert not run_build([folder], out).unchanged


@pytest.mark.slow
def test_a_suncg_house_depends_on_its_files_and_on_no_other_house(tmp_path: Path) -> None:
    root, out = tmp_path / "suncg", tmp_path / "out"
    for index in range(2):
        write_house(root, index, 11)
    run_build([root], out)
    scene = sorted((root / "house").iterdir())[0].name
    wall = min((root / "room" / scene).glob("*w.obj"))
    wall.write_bytes(wall.read_bytes() + b"# changed\n")
    before = done(out)
    run_build([root], out)
    assert done(out) == before + 1


@pytest.mark.slow
def test_a_missing_file_that_comes_back_is_noticed(tmp_path: Path) -> None:
    root, out = tmp_path / "suncg", tmp_path / "out"
    write_house(root, 0, 11)
    wall = min(root.glob("room/*/*w.obj"))
    data = wall.read_bytes()
    wall.unlink()
    run_build([root], out)
    assert next(line["reason"] for line in lines(out / "rejected.jsonl")) == "missing_file"
    wall.write_bytes(data)
    run_build([root], out)
    run_build([root], tmp_path / "fresh")
    assert contents(out) == contents(tmp_path / "fresh")


def test_other_libraries_or_another_program_make_it_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    house, out = one_room(tmp_path / "house.ply"), tmp_path / "out"
    run_build([house], out)
    was = recipe.library_versions()
    monkeypatch.setattr(recipe, "library_versions", lambda: {**was, "shapely": "9.9"})
    run_build([house], out)
    assert done(out) == 2
    monkeypatch.setattr(recipe, "code_digest", lambda: "another")
    run_build([house], out)
    assert done(out) == 3


def test_the_program_is_what_a_worker_runs_and_not_the_simulator_or_the_commands() -> None:
    modules = set(recipe._modules([*recipe._ROOTS, "pipeline.sources.suncg"]))
    assert {"pipeline.algorithm", "pipeline.stages.doors", "houseexpo.plan", "pipeline.sources.meshes.obj"} <= modules
    assert not [name for name in modules if "pseudoslam" in name or name.endswith((".cli", "report", "pictures"))]


def imported(file: Path) -> set[str]:
    """Return the modules that a module imports, by Python's own parser; not those for types only."""
    found: set[str] = set()
    waiting: list[ast.AST] = list(ast.parse(file.read_bytes()).body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif not (isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            waiting += [inner for inner in ast.iter_child_nodes(node) if not isinstance(inner, ast.expr)]
    return found


def test_every_import_of_every_module_is_found() -> None:
    files = [file for package in (houseexpo, pipeline) for file in Path(package.__path__[0]).rglob("*.py")]
    for file in files:
        found, wanted = set(recipe._imports(file)), imported(file)
        assert wanted <= found, file
        assert not [name for name in found - wanted if name.startswith("pipeline")], file


def test_only_files_of_the_house_are_recorded(tmp_path: Path) -> None:
    (tmp_path / "house").mkdir()
    (tmp_path / "house" / "a.bin").touch()
    (tmp_path / "house" / "code.py").touch()
    (tmp_path / "outside").touch()
    with record_opened_files(tmp_path / "house") as names:
        (tmp_path / "house" / "a.bin").read_bytes()
        (tmp_path / "house" / "code.py").read_bytes()
        (tmp_path / "outside").read_bytes()
        with pytest.raises(FileNotFoundError):
            (tmp_path / "house" / "missing.bin").read_bytes()
    (tmp_path / "house" / "later").touch()
    assert names == {"a.bin", "missing.bin"}


def without_room(mark: Path, level: Level, config: PipelineConfig, rng: np.random.Generator) -> FloorPlan:
    """Plan as ``boxed``; while the file ``mark`` stands, there is no room on the disk."""
    if mark.exists() and level.id == "b":
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    return boxed(level, config, rng)


@pytest.mark.slow
def test_a_fault_of_the_moment_is_no_result(tmp_path: Path) -> None:
    for name in "ab":
        one_room(tmp_path / "street" / f"{name}.ply", 4.0 + ord(name) % 7, 4.0)
    mark, out = tmp_path / "full", tmp_path / "out"
    plan = partial(without_room, mark)
    mark.touch()
    for _ in range(2):
        found = run_build([tmp_path / "street"], out, plan=plan)
        assert (found.not_done, found.ids) == (1, ("a",))
        assert found.stats["outcomes"]["rejected"] == 0
        assert [line["reason"] for line in lines(out / "rejected.jsonl")] == ["not_yet"]
    mark.unlink()
    assert run_build([tmp_path / "street"], out, plan=plan).not_done == 0
    run_build([tmp_path / "street"], tmp_path / "fresh", plan=plan)
    assert contents(out) == contents(tmp_path / "fresh")


def test_names_that_are_no_utf8_and_long_ids_cost_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "street"
    one_room(folder / "a.ply")
    one_room(folder / "x.ply", 7.0, 4.0).rename(os.fsdecode(os.fsencode(folder) + b"/caf\xe9.ply"))
    one_room(folder / "y.ply", 8.0, 4.0).rename(folder / f"{'long_' * 40}.ply")
    found = run_build([folder], tmp_path / "out")
    assert len(found.ids) == 3
    assert found.ids[:2] == ("a", "caf")
    assert max(map(len, found.ids)) <= 200
    assert run_build([folder], tmp_path / "out").unchanged


def test_ten_million_houses_are_listed_one_by_one(tmp_path: Path) -> None:
    found = run_build([Path("procedural:10000000")], tmp_path / "out", limit=2)
    assert found.stats["outcomes"]["inputs"] == 2
