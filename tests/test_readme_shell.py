"""The README's shell lines run as they stand there, each in a folder that holds what it names."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import urllib.request
from http import HTTPStatus
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
SERVED = [line for line in RUN if line.startswith("houseexpo serve")]
NOT_DONE, INTERRUPTED = 3, 130

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
    run_build([folder / "houses"], folder / "data", plan=plan_level, licence="CC-BY-4.0", credit="Surveyed by C.")
    return folder


@pytest.fixture
def folder(prepared: Path, tmp_path: Path) -> Path:
    """A copy of the folder, for one line."""
    return shutil.copytree(prepared, tmp_path / "here")


def environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}


@pytest.mark.parametrize("line", [line for line in RUN if line not in SERVED])
def test_a_line_runs(line: str, folder: Path) -> None:
    builds = line.startswith("houseexpo build")
    if not builds and "assemble" not in line:
        place = folder / "plans" / "demo"
        place.parent.mkdir(exist_ok=True)
        (folder / "data").rename(place)
    run = line.replace("procedural:1000", "procedural:3").replace("/shared", str(folder))  # sooner done, and not at /
    if "assemble" in line:
        begin = next(each for each in RUN if "--shard" in each).replace("/shared", str(folder))
        subprocess.run(begin, shell=True, check=True, cwd=folder, env=environment(folder))  # noqa: S602 - our words
    done = subprocess.run(  # noqa: S602 - our own words
        run, shell=True, check=False, cwd=folder, env=environment(folder), capture_output=True, text=True
    )
    expected = NOT_DONE if "assemble" in line else 0  # one shard of 256 is done
    assert done.returncode == expected, done.stdout + done.stderr
    if builds and "--shard" not in line:
        assert list((folder / "plans" / "json").iterdir())


@pytest.mark.parametrize("line", SERVED)
def test_a_service_starts_answers_and_ends(line: str, folder: Path) -> None:
    pytest.importorskip("starlette")
    (folder / "plans").mkdir()
    (folder / "data").rename(folder / "plans" / "demo")
    with subprocess.Popen(
        f"{line} --port 0".split(), cwd=folder, env=environment(folder), stdout=subprocess.PIPE, text=True
    ) as service:
        try:
            assert service.stdout is not None
            (address,) = next(filter(None, (re.findall(r"http://\S+", said) for said in service.stdout)))
            with urllib.request.urlopen(address, timeout=30) as page:  # noqa: S310 - this machine's own
                assert page.status == HTTPStatus.OK
        finally:
            service.send_signal(signal.SIGINT)
            ended = service.wait(30)
    is_ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN  # these tests run as a job in the background
    assert ended == (0 if is_ignored else INTERRUPTED)


def test_there_are_lines_of_each_kind() -> None:
    shown = {line.split()[1] for line in RUN}
    assert {"build", "inspect", "assemble", "info", "split", "export", "stats"} <= shown
