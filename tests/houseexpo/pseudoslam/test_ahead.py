"""A step is compiled in another process, where that saves time, and as environments call it."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam import precompile as ahead
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.dynamics import PeopleConfig
from houseexpo.pseudoslam.envs.spec import make_env_spec
from houseexpo.pseudoslam.kernels.step import step_episode
from houseexpo.pseudoslam.kernels.step_pool import transitions
from houseexpo.pseudoslam.precompile_worker import example
from houseexpo.pseudoslam.step_params import POOL_KERNELS
from houseexpo.pseudoslam.tasks import Exploration, Navigation, ObstacleAvoidance
from tests.builders.vectors import HUTS, native

compiled_only = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
POPEN = subprocess.Popen  # the tests replace it
TASKS = {"Exploration": Exploration(), "ObstacleAvoidance": ObstacleAvoidance(), "Navigation": Navigation()}
SMALL = SimulatorConfig(16.0, observation=ObservationConfig(3.0, global_cells=32))


def sleeper(seconds: float) -> subprocess.Popen[bytes]:
    return POPEN([sys.executable, "-c", f"import time; time.sleep({seconds})"])


class Kernel(SimpleNamespace):
    """What ``precompile`` asks a kernel about."""

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


CONFIGS = {
    "whole numbers": SimulatorConfig(
        16, laser=LaserConfig(5, 180, 1), observation=ObservationConfig(3), noise=NoiseConfig(laser_m=1)
    ),
    "people": replace(SMALL, people=PeopleConfig(2, relaxation_s=1)),
    "rays": replace(SMALL, laser=LaserConfig(rule="rays")),
    "sector": SMALL,
}


@compiled_only
@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
@pytest.mark.parametrize("kind", ["map", "dict"])
@pytest.mark.parametrize("name", CONFIGS)
def test_it_is_compiled_for_what_environments_call_it_with(task: str, kind: Any, name: str) -> None:
    env_spec = make_env_spec(TASKS[task], HUTS, CONFIGS[name], "discrete", kind, pooled=False)
    rng, params, scratch = np.random.default_rng(0), env_spec.params(), env_spec.scratch()
    state = env_spec.initial_state(env_spec.draw(rng, None), params, scratch, rng)
    called = (state.episode, 0.0, 0.0, params, scratch)
    kinds: Any = step_episode
    assert list(map(kinds.typeof_pyval, called)) == list(map(kinds.typeof_pyval, example(pooled=False)))


@compiled_only
@pytest.mark.parametrize("name", CONFIGS)
def test_it_is_compiled_for_what_vector_environments_call_it_with(name: str) -> None:
    env = native("Exploration", 2, dataset=HUTS, config=CONFIGS[name], threads=1, success_coverage=None)
    env.reset(seed=0)
    signatures = [set(kernel.signatures) for kernel in POOL_KERNELS]
    kinds: Any = step_episode
    expected = tuple(map(kinds.typeof_pyval, example(pooled=True)))
    env.close()
    assert any(signatures)
    assert all(found <= {expected} for found in signatures)


@compiled_only
def test_a_kernel_that_is_not_on_disk_is_compiled_once(tmp_path: Path, started: list[list[str]]) -> None:
    one = kernel(tmp_path)
    ahead.precompile(one)
    ahead.precompile(one)
    assert started == [[sys.executable, "-m", "houseexpo.pseudoslam.precompile_worker", "transitions"]]
    ahead.wait_for(one)
    assert not ahead._running


@compiled_only
def test_nothing_is_started_where_that_saves_no_time(
    tmp_path: Path, started: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead.precompile(kernel(tmp_path, signatures=["one"]))
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    (tmp_path / f"step_pool.transitions-95.{python}.nbi").touch()
    ahead.precompile(kernel(tmp_path))
    monkeypatch.setattr(ahead, "cores", lambda: 1)
    ahead.precompile(kernel(tmp_path / "elsewhere"))
    monkeypatch.setattr(ahead, "cores", lambda: 2)
    with monkeypatch.context() as patched:
        patched.setattr(ahead.multiprocessing, "parent_process", lambda: "a pool's")
        ahead.precompile(kernel(tmp_path / "elsewhere"))
    with monkeypatch.context() as patched:
        patched.setattr(sys, "frozen", True, raising=False)  # it is no Python, but a program
        ahead.precompile(kernel(tmp_path / "elsewhere"))
    with monkeypatch.context() as patched:
        patched.setenv("HOUSEEXPO_COMPILES", "1")
        ahead.precompile(kernel(tmp_path / "elsewhere"))
    assert started == []
    ahead.precompile(kernel(tmp_path / "elsewhere"))
    assert len(started) == 1


@compiled_only
def test_without_another_process_it_goes_on(
    tmp_path: Path, started: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(command: list[str], **_: Any) -> None:
        started.append(command)
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(ahead.subprocess, "Popen", refuse)
    one = kernel(tmp_path)
    ahead.precompile(one)
    assert len(started) == 1
    assert not ahead._running
    ahead.wait_for(one)


def test_who_is_interrupted_while_waiting_leaves_nobody_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(_: float) -> None:
        raise KeyboardInterrupt

    one, process = kernel(tmp_path), sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {one: process})
    with monkeypatch.context() as patched:
        patched.setattr(process, "wait", interrupted)
        with pytest.raises(KeyboardInterrupt):
            ahead.wait_for(one)
    ahead._end_all()
    assert process.returncode not in {None, 0}


def test_who_hangs_is_ended(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    one, process = kernel(tmp_path), sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {one: process})
    monkeypatch.setattr(ahead, "_MAX_WAIT_S", 0.05)
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
        "from houseexpo.pseudoslam.kernels.step import step_episode\n"
        "stats = step_episode.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.split() == (["1", "0"] if ahead.cores() > 1 else ["0", "1"])
