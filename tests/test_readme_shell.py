"""The README's shell lines run as they stand there, each in a folder that holds what it names."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.algorithm import plan_level
from tests.builders.batch import one_room, run_build

ROOT = Path(__file__).resolve().parents[1]
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE)
LINES = [line.partition("#")[0].strip() for language, block in BLOCKS if not language for line in block.splitlines()]
ELSEWHERE = ("slurm", "--executor ray", "s3://", "fetch")
"""What needs a cluster, an object store or a server has tests of its own that start these."""
RUN = [line for line in LINES if line.startswith("houseexpo") and not any(word in line for word in ELSEWHERE)]
NOT_DONE = 3

pytestmark = pytest.mark.slow


def upright(house: Path, path: Path) -> None:
    """Write the same house as a glTF file, whose y points up."""
    mesh = trimesh.load_mesh(house)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    mesh.export(path)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a house, several, a manifest, a data set, and the command ``houseexpo``."""
    folder = tmp_path_factory.mktemp("readme")
    upright(one_room(folder / "house.ply"), folder / "house.glb")
    for number, name in enumerate(("a.ply", "b.ply", "c.stl")):
        one_room(folder / "houses" / name, 5.0 + number)
    (folder / "houses.toml").write_text('[build]\nsources = ["houses"]\n')
    command = folder / "bin" / "houseexpo"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m houseexpo "$@"\n')
    command.chmod(0o755)
    run_build([folder / "houses"], folder / "data", plan=plan_level)
    return folder


@pytest.mark.parametrize("line", RUN)
def test_a_line_runs(line: str, prepared: Path, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    shutil.copytree(prepared, folder)
    builds = line.startswith("houseexpo build")
    if not builds and "assemble" not in line:
        (folder / "data").rename(folder / "plans")
    paths = {"PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    run = line.replace("procedural:1000", "procedural:3").replace("/shared", str(folder))  # sooner done, and not at /
    if "assemble" in line:
        begin = next(each for each in RUN if "--shard" in each).replace("/shared", str(folder))
        subprocess.run(begin, shell=True, check=True, cwd=folder, env={**os.environ, **paths})  # noqa: S602 - our words
    done = subprocess.run(  # noqa: S602 - our own words
        run, shell=True, check=False, cwd=folder, env={**os.environ, **paths}, capture_output=True, text=True
    )
    expected = NOT_DONE if "assemble" in line else 0  # one shard of 256 is done
    assert done.returncode == expected, done.stdout + done.stderr
    if builds and "--shard" not in line:
        assert list((folder / "plans" / "json").iterdir())


def test_there_are_lines_of_each_kind() -> None:
    shown = {line.split()[1] for line in RUN}
    assert {"build", "inspect", "assemble", "info", "split", "export", "stats"} <= shown
