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

from houseexpo.cpu_cores import count_cores
from houseexpo.kernel_cache import still_needs_compiling
from houseexpo.pseudoslam import step_kernels as ahead
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.step import step_pool_by_sector
from houseexpo.pseudoslam.step_kernels import arguments_for_compiling, kernel_arguments
from tests.builders.simulations import GIVEN

pytestmark = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
POPEN = subprocess.Popen  # the tests replace it
KERNEL: Any = step_pool_by_sector


def sleeper(seconds: float) -> subprocess.Popen[bytes]:
    return POPEN([sys.executable, "-c", f"import time; time.sleep({seconds})"])


class Kernel(SimpleNamespace):
    """What ``compile_in_background`` asks a kernel about."""

    __hash__ = object.__hash__


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands of the processes that were to be started; none is. No kernel is on disk."""
    commands: list[list[str]] = []

    def start(command: list[str], **_: Any) -> subprocess.Popen[bytes]:
        commands.append(command)
        return sleeper(0.0)

    monkeypatch.setattr(ahead.subprocess, "Popen", start)
    monkeypatch.setattr(ahead, "_running", {})
    monkeypatch.setattr(ahead, "count_cores", lambda: 2)
    monkeypatch.setattr(ahead, "still_needs_compiling", lambda _: True)
    return commands


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"observation": "dict"},
        pytest.param(
            {"actions": "waypoint"}, marks=pytest.mark.slow
        ),  # planners' kernels take half a minute to compile
        pytest.param({"actions": "frontier", "observation": "scales"}, marks=pytest.mark.slow),
        {"config": SimulatorConfig(people=PeopleConfig(number=1))},
    ],
    ids=["steps", "in full", "waypoints", "frontiers", "people"],
)
def test_it_is_compiled_for_what_environments_call_it_with(given: dict[str, Any]) -> None:
    env = ExplorationEnv(**{**GIVEN, **given})
    env.reset(seed=0)
    called = kernel_arguments(env.state, np.zeros((1, 2)), env._params, env._scratch)
    assert list(map(KERNEL.typeof_pyval, called)) == list(map(KERNEL.typeof_pyval, arguments_for_compiling()))


def test_a_kernel_that_is_not_on_disk_is_compiled_once(started: list[list[str]]) -> None:
    one = Kernel(signatures=[], __name__="step_pool_by_sector")
    ahead.compile_in_background(one)
    ahead.compile_in_background(one)
    (command,) = started
    assert command[:2] == [sys.executable, "-P"]
    assert "compile_to_disk" in command[3]
    assert command[4] == "step_pool_by_sector"
    ahead.wait_for_kernel(one)
    assert not ahead._running


def test_nothing_is_started_where_that_saves_no_time(started: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    one = Kernel(signatures=[], __name__="step_pool_by_sector")
    ahead.compile_in_background(Kernel(signatures=["one"], __name__="step_pool_by_sector"))
    for what, instead in (("count_cores", lambda: 1), ("still_needs_compiling", lambda _: False)):
        with monkeypatch.context() as context:
            context.setattr(ahead, what, instead)
            ahead.compile_in_background(one)
    monkeypatch.setattr(ahead.multiprocessing, "parent_process", lambda: "a pool's")
    ahead.compile_in_background(one)
    assert started == []


def test_without_another_process_it_goes_on(monkeypatch: pytest.MonkeyPatch, started: list[list[str]]) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(ahead.subprocess, "Popen", refuse)
    one = Kernel(signatures=[], __name__="step_pool_by_sector")
    ahead.compile_in_background(one)
    ahead.wait_for_kernel(one)
    assert started == []


def test_who_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    one, process = Kernel(), sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {one: process})
    monkeypatch.setattr(ahead, "_MOST_S", 0.05)
    ahead.wait_for_kernel(one)
    assert process.returncode not in {None, 0}


def test_nobody_outlives_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    process = sleeper(60.0)
    monkeypatch.setattr(ahead, "_running", {Kernel(): process})
    ahead._end_all()
    assert process.returncode not in {None, 0}


def test_a_kernel_is_missing_where_the_index_is_damaged_or_of_other_sources(tmp_path: Path) -> None:
    file = KERNEL._cache._cache_file
    index, stamp = file._index_path, file._source_stamp
    try:
        file._index_path = str(tmp_path / "index")
        assert still_needs_compiling(KERNEL)
        file._save_index({"a signature": "a file"})
        assert not still_needs_compiling(KERNEL)
        file._source_stamp = "of other sources"
        assert still_needs_compiling(KERNEL)
        (tmp_path / "index").write_bytes(b"damaged")
        assert still_needs_compiling(KERNEL)
    finally:
        file._index_path, file._source_stamp = index, stamp


@pytest.mark.slow
def test_a_fresh_process_finds_its_step_on_disk(tmp_path: Path) -> None:
    code = (
        "import gymnasium, houseexpo.pseudoslam\n"
        "from houseexpo.pseudoslam.kernels.step import step_pool_by_sector\n"
        "env = gymnasium.make('PseudoSLAM/ObstacleAvoidance-v0'); env.reset(seed=0); env.step(0)\n"
        "stats = step_pool_by_sector.stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.split() == (["1", "0"] if count_cores() > 1 else ["0", "1"])
