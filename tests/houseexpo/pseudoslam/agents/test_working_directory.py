"""The working directory is on nobody's import path, but for a module that a person named and that lies there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

TRAP = "raise SystemExit('the trap was run')\n"
LOAD = "from houseexpo.pseudoslam.agents.loading import load_policy; print(load_policy({name!r}).source)"


def loaded(name: str, folder: Path) -> subprocess.CompletedProcess[str]:
    script = "import sys; sys.path = [p for p in sys.path if p]\n" + LOAD.format(name=name)
    return subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", ["forward", "mine:Mine", "./mine.py:Mine"])
def test_nothing_in_a_downloaded_folder_is_run(tmp_path: Path, name: str) -> None:
    for module in ("gymnasium", "numba", "scipy", "networkx", "houseexpo"):
        (tmp_path / f"{module}.py").write_text(TRAP)
    (tmp_path / "mine.py").write_text("import gymnasium\n\n\ndef Mine(robot, seed):\n    return None\n")
    done = loaded(name, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "trap" not in done.stdout + done.stderr


def test_a_module_of_the_working_directory_that_was_named_is_found(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "__init__.py").write_text("")
    (tmp_path / "mine" / "policies.py").write_text("def first(robot, seed):\n    return None\n")
    done = loaded("mine.policies:first", tmp_path)
    assert (done.returncode, done.stdout.strip()) == (0, "mine.policies:first"), done.stderr
