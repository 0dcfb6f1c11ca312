"""Files of the folder in which a command runs are never run, by the command or by any process that it starts."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from houseexpo.processes import SAFE_PATH, child_environment, map_in_processes
from pipeline.executors import local
from tests.builders.batch import one_room
from tests.builders.needs import need

ROOT = Path(__file__).resolve().parents[3]
LIBRARIES = (
    *("shapely", "numpy", "scipy", "cv2", "numba", "pyarrow", "msgspec", "gymnasium", "rich", "typer", "lazy_loader"),
    *("threading", "multiprocessing", "signal", "socket", "selectors", "tempfile", "json", "pathlib", "enum", "uuid"),
)


@pytest.fixture
def trapped(tmp_path: Path) -> Path:
    """A folder with a house and a trap for each library; a trap that is run leaves its name in ``sprung``."""
    folder = tmp_path / "download"
    folder.mkdir()
    one_room(folder / "house.ply")
    for name in LIBRARIES:
        note = f"open({str(tmp_path / 'sprung')!r}, 'a').write({name + ' '!r})\n"
        (folder / f"{name}.py").write_text(f"{note}raise SystemExit(1)\n")
    return folder


def run(folder: Path, *words: str, module: str = "houseexpo") -> None:
    """Run a command in the folder with traps; it must end well, and no trap must have been run."""
    done = subprocess.run(
        [sys.executable, "-m", module, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    sprung = folder.parent / "sprung"
    assert not sprung.exists(), f"{words}: ran {sprung.read_text()}"
    assert done.returncode == 0, done.stdout + done.stderr


def test_python_m_leaves_the_folder_before_it_imports_anything(trapped: Path) -> None:
    run(trapped, "--version")


def _path(_: int) -> list[str]:
    return [sys.flags.safe_path, *sys.path]


def test_processes_start_without_the_working_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SAFE_PATH, raising=False)
    with child_environment():
        said = subprocess.run(
            [sys.executable, "-c", "import sys; print(repr(sys.path[0]))"], capture_output=True, check=True
        )
    assert said.stdout.strip() != b"''"
    assert SAFE_PATH not in os.environ


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spawn", "fork server"])
def test_each_kind_of_worker_starts_without_the_working_directory(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SAFE_PATH, raising=False)
    if kind == "spawn":
        [path] = map_in_processes(_path, [0], 1)
    else:
        [(_, path)] = local.run(_path, [0], workers=1, limits=local.Limits(60.0, 2**32))
    assert path[0] is True
    assert "" not in path


@pytest.mark.slow
def test_no_command_runs_a_file_of_the_folder(trapped: Path) -> None:
    out = trapped.parent / "plans"
    (trapped / "licence.toml").write_text('[build]\nlicence = "CC-BY-4.0"\ncredit = "me"\n')
    (trapped / "mine.py").write_text("def make(robot, seed):\n    return lambda observation, knowledge: 0\n")
    run(trapped, "build", "house.ply", "procedural:4", "--config", "licence.toml", "--out", str(out), "--workers", "2")
    run(trapped, "house.ply", "--out", str(out.with_name("again")), module="pipeline")
    run(trapped, "stats", str(out), "--workers", "2", "--out", str(out.with_name("stats.html")))
    run(trapped, "validate", str(out), "--workers", "2")
    run(trapped, "split", str(out))
    run(trapped, "export", str(out), "--to", "ros", "--out", str(out.with_name("maps")))
    run(trapped, "prepare", str(out))
    policy = ("--policy", "mine.py:make", "--track", "quality", "--dataset", str(out), "--plans", "1", "--workers", "2")
    run(trapped, "benchmark", "run", *policy, "--out", str(out.with_name("result.json")))
    run(trapped, "release", str(out), "--out", str(out.with_name("release")))
    shutil.rmtree(out)


@pytest.mark.slow
def test_the_workers_of_a_cluster_run_no_file_of_the_folder(trapped: Path) -> None:
    need(modules=["ray"], how="make cluster")  # imported here, it would keep its settings for the tests that follow
    run(trapped, "build", "house.ply", "--out", str(trapped.parent / "plans"), "--executor", "ray")
