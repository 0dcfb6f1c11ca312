"""What was compiled from other sources is forgotten, and nothing else is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from houseexpo.pseudoslam.kernels.stale import forget_stale

INNER = "from numba import njit\n@njit(cache=True)\ndef inner():\n    return {}\n"
OUTER = "from numba import njit\nfrom inner import inner\n@njit(cache=True)\ndef outer():\n    return inner()\n"
RUN = """
import sys
from pathlib import Path
from houseexpo.pseudoslam.kernels.stale import forget_stale
from outer import outer
if sys.argv[1] == "forget":
    forget_stale(outer, Path("."))
print(outer(), sum(outer.stats.cache_hits.values()))
"""


def run(folder: Path, how: str) -> tuple[int, int]:
    """Return what the outer function returns in a new process, and how often it was found on disk."""
    paths = os.pathsep.join([str(folder), str(Path(__file__).parents[3])])
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(folder / "kept")}
    command = [sys.executable, "-c", RUN, how]
    answer = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    value, hits = map(int, answer.stdout.split())
    return value, hits


@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
def test_a_function_that_another_file_calls_is_compiled_anew_once_it_has_changed(tmp_path: Path) -> None:
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER.format(1))
    assert run(tmp_path, "forget") == (1, 0)
    assert run(tmp_path, "forget") == (1, 1)
    (tmp_path / "inner.py").write_text(INNER.format(2))
    assert run(tmp_path, "keep") == (1, 1)  # numba alone goes on with the old code
    assert run(tmp_path, "forget") == (2, 0)
    assert run(tmp_path, "forget") == (2, 1)


def test_where_nothing_can_be_written_it_goes_on(tmp_path: Path) -> None:
    """The folder of what is kept is a file here."""
    (tmp_path / "kept").touch()
    for place in (str(tmp_path / "kept"), None):
        forget_stale(SimpleNamespace(stats=SimpleNamespace(cache_path=place)), tmp_path)
    forget_stale(len, tmp_path)
    assert (tmp_path / "kept").is_file()
