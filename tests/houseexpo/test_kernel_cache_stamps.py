"""What was compiled from other sources is compiled anew; nothing is deleted for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from houseexpo.kernel_cache import hash_package

INNER = "from numba import njit\n@njit(cache=True)\ndef inner():\n    return {}\n"
OUTER = "from numba import njit\nfrom inner import inner\n@njit(cache=True)\ndef outer():\n    return inner()\n"
RUN = """
import sys
from pathlib import Path
from houseexpo.kernel_cache import make_cache_robust
if sys.argv[1] == "stamp":
    make_cache_robust(Path.cwd())
from outer import outer
print(outer(), sum(outer.stats.cache_hits.values()))
"""


def run(folder: Path, how: str) -> tuple[int, int]:
    """Return what the outer function returns in a new process, and how often it was found on disk."""
    paths = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    kept = {"NUMBA_CACHE_DIR": str(folder / "kept"), "PYTHONDONTWRITEBYTECODE": "1"}  # changed within a second
    environment = {**os.environ, "PYTHONPATH": paths, **kept}
    command = [sys.executable, "-c", RUN, how]
    answer = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    value, hits = map(int, answer.stdout.split())
    return value, hits


@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
@pytest.mark.slow
def test_a_function_that_another_file_calls_is_compiled_anew_once_it_has_changed(tmp_path: Path) -> None:
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER.format(1))
    assert run(tmp_path, "plain") == (1, 0)
    (tmp_path / "inner.py").write_text(INNER.format(2))
    assert run(tmp_path, "plain") == (1, 1)  # numba alone goes on with the old code
    assert run(tmp_path, "stamp") == (2, 0)
    kept = set((tmp_path / "kept").rglob("*.nbi"))
    assert run(tmp_path, "stamp") == (2, 1)
    (tmp_path / "inner.py").write_text(INNER.format(3))
    assert run(tmp_path, "stamp") == (3, 0)
    assert set((tmp_path / "kept").rglob("*.nbi")) == kept


def test_a_file_in_a_folder_below_counts_and_one_of_another_kind_does_not(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two", "three")]
    for folder in folders:
        (folder / "below").mkdir(parents=True)
        (folder / "below" / "inner.py").write_text("1")
    (folders[1] / "below" / "inner.py").write_text("2")
    (folders[2] / "note.txt").write_text("2")
    one, two, three = map(hash_package, folders)
    assert one == three != two
