"""Where the command starts: Ctrl-C ends it with 130, also out of a string that a library executes at import."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import houseexpo

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


@pytest.mark.slow
@pytest.mark.parametrize("package", ["houseexpo", "pipeline", "stats"])
def test_a_module_in_a_downloaded_folder_is_not_run(tmp_path: Path, package: str) -> None:
    for name in ("typer", "rich", "numpy", "gymnasium", "shapely"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the trap was run')")
    done = subprocess.run(
        [sys.executable, "-m", package, "--help"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(houseexpo.__file__).parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "trap" not in done.stdout + done.stderr
