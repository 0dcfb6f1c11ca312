"""Kernels where their cache cannot be written or was damaged: they are compiled, and it is said once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNELS = """
from numba import njit

@njit(cache=True)
def one():
    return 1

@njit(cache=True)
def two():
    return 2
"""
RUN = """
from pathlib import Path
from houseexpo.kernel_cache import make_cache_robust
make_cache_robust(Path.cwd())
from kernels import one, two
print(one(), two(), sum(one.stats.cache_hits.values()))
"""

pytestmark = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")


def run(folder: Path, **more: str) -> tuple[list[str], str]:
    paths = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", **more}
    if "NUMBA_CACHE_DIR" not in more:
        environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", RUN], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split(), done.stderr


def test_where_nothing_can_be_written_kernels_are_compiled_with_one_warning(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "kernels.py").write_text(KERNELS)
    (package / "__pycache__").write_text("")  # no folder can be made here, nor below
    (tmp_path / "home").write_text("")
    no_home = {"HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": str(tmp_path / "home")}
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    said, warned = run(package, **no_home, TMPDIR=str(scratch))
    assert said == ["1", "2", "0"]
    assert warned.count("compiled kernels cannot be kept") == 1
    assert not list(scratch.glob("houseexpo-kernels-*"))  # it goes with its process


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_damaged_cache_counts_as_empty(tmp_path: Path, share: float) -> None:
    (tmp_path / "kernels.py").write_text(KERNELS)
    kept = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    assert run(tmp_path, **kept)[0] == ["1", "2", "0"]
    assert run(tmp_path, **kept)[0] == ["1", "2", "1"]
    for file in (tmp_path / "kept").rglob("*.nbi"):
        os.truncate(file, int(file.stat().st_size * share))
    assert run(tmp_path, **kept)[0] == ["1", "2", "0"]
    assert run(tmp_path, **kept)[0] == ["1", "2", "1"]
