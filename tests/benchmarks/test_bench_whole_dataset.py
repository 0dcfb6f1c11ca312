"""The simulator on the whole published data set, where every reset meets a new house.

64 environments, episodes of 200 steps, houses at random from all 33,717; the policy goes forward (0.8) and turns left
when it is blocked. A run is 200 steps of all environments, so it has 64 resets in it. Prepared: `houseexpo prepare` has
made all worlds before. Unprepared: none is found, and each is made when it is asked for. Medians of rounds in which all
runs take turns.
"""

from __future__ import annotations

import gzip
import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import Dataset, open_dataset
from houseexpo.floorplan import decode
from houseexpo.processes import count_cores
from houseexpo.pseudoslam import LaserConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.worlds.cache import load_static_world, prepare_worlds
from houseexpo.pseudoslam.worlds.store import WorldStore
from tests.builders.shared import DATA, needs_shared

PLANS = DATA / "houseexpo" / "plans_33717.jsonl.gz"
ENVS, STEPS, ROUNDS = 64, 200, 7
EXPLORATION = SimulatorConfig(25.0, laser=LaserConfig(5.0, 180.0, 0.7), observation=ObservationConfig(6.99))
COARSE = SimulatorConfig(16.0, laser=LaserConfig(2.0, 180.0, 1.0), observation=ObservationConfig(4.0))
CONFIGS = {"exploration, 25 px/m": EXPLORATION, "autonomous exploration, 16 px/m": COARSE}
ASKED = {
    ("exploration, 25 px/m", True): "20,000 / 36,000",
    ("exploration, 25 px/m", False): "12,000 / 20,000",
    ("autonomous exploration, 16 px/m", True): "60,000 / 100,000",
}

pytestmark = needs_shared


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dataset]:
    """All published plans, and a cache in which nothing is prepared."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(tmp_path_factory.mktemp("worlds")))
        yield open_dataset(PLANS)


class Run:
    """200 steps of all environments, again and again."""

    def __init__(self, plans: Dataset, config: SimulatorConfig, threads: int, prepared: bool) -> None:
        given = {"dataset": plans, "config": replace(config, max_steps=STEPS), "success_coverage": None}
        self._env = gymnasium.make_vec("PseudoSLAM/Exploration-v0", ENVS, threads=threads, **given)
        self._prepared, self._rng = prepared, np.random.default_rng(0)
        self._blocked = np.zeros(ENVS, bool)
        self.rates: list[float] = []
        with self._found_or_not():
            self._env.reset(seed=0)

    def take(self) -> None:
        """Go on, and note how many steps a second it made."""
        with self._found_or_not():
            start = time.perf_counter()
            for turns in self._rng.random((STEPS, ENVS)) > 0.8:
                *_, info = self._env.step((turns | self._blocked).astype(np.int64))
                self._blocked = info["collided"]
            self.rates.append(ENVS * STEPS / (time.perf_counter() - start))

    def _found_or_not(self) -> AbstractContextManager[None]:
        return nullcontext() if self._prepared else nothing_found()


@contextmanager
def nothing_found() -> Iterator[None]:
    """No world is found on disk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(WorldStore, "get", lambda *_: None)
        yield


def test_preparing_and_steps_a_second(plans: Dataset) -> None:
    table = Table(title=f"{len(plans):,} plans, {ENVS} environments, every reset a new house")
    for heading in ("configuration", "worlds", "1 thread", "2 threads", "asked"):
        table.add_column(heading, justify="left" if heading in {"configuration", "worlds"} else "right")
    workers = count_cores()
    for name, config in CONFIGS.items():
        start = time.perf_counter()
        done = prepare_worlds(plans, config, workers)
        took = time.perf_counter() - start
        Console().print(
            f"{name}: {done.made:,} worlds prepared in {took:.0f} s by {workers} processes, {done.size / 1e6:.0f} MB "
            f"(asked at 25 px/m: 180 s, 2,000 MB); load {os.getloadavg()[0]:.1f}"
        )
        threads = (1, min(2, workers))
        runs = {(prepared, k): Run(plans, config, k, prepared) for prepared in (True, False) for k in threads}
        for _ in range(ROUNDS + 1):
            for run in runs.values():
                run.take()
        for prepared in (True, False):
            found = [f"{np.median(runs[prepared, k].rates[1:]):,.0f}" for k in threads]
            table.add_row(
                name, "prepared" if prepared else "made when asked for", *found, ASKED.get((name, prepared), "")
            )
        assert not done.refused
    Console(width=120).print(table)


def test_a_world_that_is_not_kept() -> None:
    """Reading the plan, its rasters and what can be seen, one after the other, one thread."""

    def make_ms(line: bytes) -> float:
        start = time.thread_time()
        load_static_world(decode(line), EXPLORATION)
        return 1000 * (time.thread_time() - start)

    with gzip.open(PLANS) as stream:
        lines = list(stream)
    make_ms(lines[0])  # compiles
    times = np.array([make_ms(line) for line in lines])
    again = max(min(make_ms(lines[i]) for _ in range(3)) for i in np.argsort(times)[-20:].tolist())
    Console().print(
        f"a world made at 25 px/m, {len(times):,} plans: mean {times.mean():.2f} ms (asked: 6), "
        f"median {np.median(times):.2f}, worst {times.max():.1f} (asked: 60), the longest 20 again {again:.1f}"
    )
    assert len(times) > 30_000
