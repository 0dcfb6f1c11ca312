"""What the first reset and step compile: each kernel for arrays and numbers, none once more for a constant."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled"),
]
COMPILED = """
import json
from numba.core.event import Listener, register
found = []
class Note(Listener):
    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        found.append((function.__module__, function.__name__, str(event.data["args"])))
    def on_end(self, event):
        pass
register("numba:compile", Note())
import gymnasium
import houseexpo.pseudoslam
seen = []
for given in ({}, {"observation": "scales"}):
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0", **given)
    env.reset(seed=0)
    env.step(0)
    seen.append(len(found))
print(json.dumps((found[: seen[0]], found)))
"""


def test_no_kernel_is_compiled_for_a_constant_or_before_it_is_needed(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", COMPILED], env=environment, capture_output=True, check=True)
    first, ours = (
        [(name, args) for module, name, args in found if f"{module}".startswith("houseexpo.")]
        for found in json.loads(done.stdout)
    )
    names = [name for name, _ in ours]
    assert "step_pool_by_sector" in {name for name, _ in first}
    assert "draw_pictures" not in {name for name, _ in first}
    assert names.count("draw_pictures") == 1
    assert len(set(ours)) == len(ours)
    assert (names.count("count_before_rows"), names.count("nth_cell")) == (1, 1)  # rasters of a house and of an episode
    assert not [(name, args) for name, args in ours if "Literal" in args]
