"""Files of the folder in which a command runs are never run, by the command or by any process that it starts."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from houseexpo.commands import app
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


# Where the command starts: Ctrl-C ends it with 130, also out of a string that a library executes at import.


_INTERRUPTS_AN_IMPORT = """
import sys
class Interrupts:
    def find_spec(self, name, *_):
        if name == "houseexpo.commands.app":
            exec("raise KeyboardInterrupt")
sys.meta_path.insert(0, Interrupts())
"""


def test_ctrl_c_in_a_string_that_an_import_executes_ends_with_130(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(_INTERRUPTS_AN_IMPORT)
    done = subprocess.run(
        [sys.executable, "-m", "houseexpo", "--help"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, 3), (errno.EDQUOT, 3), (errno.EACCES, 2)])
def test_a_full_disk_is_a_transient_fault_in_every_command(
    number: int, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number), "map.pgm")

    monkeypatch.setattr("houseexpo.dataset.open_dataset", full)
    monkeypatch.setattr("houseexpo.dataset.dataset.open_dataset", full)
    monkeypatch.setattr(sys, "argv", ["houseexpo", "split", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == code
    assert "map.pgm" in capsys.readouterr().err
