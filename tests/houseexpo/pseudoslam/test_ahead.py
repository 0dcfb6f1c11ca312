"""A step is compiled in another process, where that saves time, and as environments call it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam import ahead
from houseexpo.pseudoslam.compiling import example
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.step import transitions
from houseexpo.pseudoslam.rules import KERNELS, arguments_of, kernel_for
from tests.builders.vectors import HUTS, native

compiled_only = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
POPEN = subprocess.Popen  # the tests replace it
SMALL = SimulatorConfig(16.0, observation=ObservationConfig(3.0, global_cells=32))


def sleeper(seconds: float) -> subprocess.Popen[bytes]:
    return POPEN([sys.executable, "-c", f"import time; time.sleep({seconds})"])


class Kernel(SimpleNamespace):
    """What ``compile_ahead`` asks a kernel about."""

    __hash__ = object.__hash__


def kernel(folder: Path, **given: Any) -> Any:
    return Kernel(**{
        "signatures": [], "stats": SimpleNamespace(cache_path=str(folder)), "__name__": "transitions",
        "py_func": transitions.py_func if hasattr(transitions, "py_func") else transitions, **given,
    })  # fmt: skip


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands of the processes that were to be started; none is."""
    commands: list[list[str]] = []

    def start(command: list[str], **_: Any) -> subprocess.Popen[bytes]:
        commands.append(command)
        return sleeper(0.0)

    monkeypatch.setattr(ahead.subprocess, "Popen", start)
    monkeypatch.setattr(ahead, "_running", {})
    monkeypatch.setattr(ahead, "cores", lambda: 2)
    return commands


@compiled_only
@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
@pytest.mark.parametrize("kind", ["map", "dict"])
def test_it_is_compiled_for_what_environments_call_it_with(task: str, kind: str) -> None:
    env: Any = native(task, 1, "NextStep", dataset=HUTS, config=SMALL, observation=kind).unwrapped
    env.reset(seed=0)
    state = env.state(0).copy()
    called = arguments_of(state, np.zeros((1, 2)), env._rules, env._scratch)
    kinds: Any = transitions
    assert list(map(kinds.typeof_pyval, called)) == list(map(kinds.typeof_pyval, example()))
    assert kernel_for(state.episode, env._rules) in KERNELS.values()


@compiled_only
def test_a_kernel_that_is_not_on_disk_is_compiled_once(tmp_path: Path, started: list[list[str]]) -> None:
    one = kernel(tmp_path)
    ahead.compile_ahead(one)
    ahead.compile_ahead(one)
    assert started == [[sys.executable, "-m", "houseexpo.pseudoslam.compiling", "transitions"]]
    ahead.wait_for(one)
    assert not ahead._running


@compiled_only
def test_nothing_is_started_where_that_saves_no_time(
    tmp_path: Path, started: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead.compile_ahead(kernel(tmp_path, signatures=["one"]))
    (tmp_path / "step.transitions-95.py311.nbi").touch()
    ahead.compile_ahead(kernel(tmp_path))
    monkeypatch.setattr(ahead, "cores", lambda: 1)
    ahead.compile_ahead(kernel(tmp_path / "elsewhere"))
    monkeypatch.setattr(ahead, "cores", lambda: 2)
    monkeypatch.setattr(ahead.multiprocessing, "parent_process", lambda: "a pool's")
    ahead.compile_ahead(kernel(tmp_path / "elsewhere"))
    assert started == []


@compiled_only
def test_without_another_process_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(ahead.subprocess, "Popen", refuse)
    one = kernel(tmp_path)
    ahead.compile_ahead(one)
    ahead.wait_for(one)


def test_who_hangs_is_ended(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    one, process = kernel(tmp_path), sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {one: process})
    monkeypatch.setattr(ahead, "_MOST_S", 0.05)
    ahead.wait_for(one)
    assert process.returncode not in {None, 0}


def test_nobody_outlives_the_program(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    process = sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {kernel(tmp_path): process})
    ahead._end_all()
    assert process.returncode not in {None, 0}


@pytest.mark.slow
@compiled_only
def test_a_fresh_process_finds_its_step_on_disk(tmp_path: Path) -> None:
    code = (
        "import gymnasium, houseexpo.pseudoslam\n"
        "env = gymnasium.make('PseudoSLAM/ObstacleAvoidance-v0'); env.reset(seed=0); env.step(0)\n"
        "from houseexpo.pseudoslam.kernels.step import transitions\n"
        "stats = transitions.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.split() == (["1", "0"] if ahead.cores() > 1 else ["0", "1"])
