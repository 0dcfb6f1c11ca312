"""How long each way of training takes on this machine, until it beats nearest frontier, and where the time goes.

Times are processor seconds of all threads, which other programs on the machine change little, and wall seconds beside
them. "Simulator" is all that happens in a reset or step of the environments, with the planner that drives to frontiers
and the making of houses; for the chooser, its compiled explorations. "Network" is a policy's forward passes and PPO's
updates; "search" is CMA-ES.

``HOUSEEXPO_BENCH_STEPS`` trains the policies of single motions for longer than the two updates that a speed needs, and
tests them at the end.
"""

from __future__ import annotations

import os
import time
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import pytest
from rich.console import Console
from rich.table import Table

from houseexpo import open_dataset
from houseexpo.configuration import read_config
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.learning.chooser_training import ChooserConfig, CmaEsSearch, HouseExplorer, train_chooser
from houseexpo.pseudoslam.learning.config import Precision, TrainConfig
from tests.builders.needs import need
from tests.builders.shared import DATA, needs_shared

HERE = Path(__file__).parents[2] / "experiments"
PARTS = ("simulator", "network", "search")


@dataclass
class Clock:
    """The time since it was made, and the processor seconds of each part."""

    wall: float = field(default_factory=time.perf_counter)
    processor: float = field(default_factory=time.process_time)
    parts: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    steps: int = 0

    def read(self) -> tuple[float, float]:
        """Wall and processor seconds."""
        return time.perf_counter() - self.wall, time.process_time() - self.processor

    def watch(self, patch: pytest.MonkeyPatch, owner: Any, name: str, part: str) -> None:
        """Add the time of calls of a function to a part; calls of ``PARTS`` are not within each other."""
        real = getattr(owner, name)

        def timed(*given: Any, **named: Any) -> Any:
            start = time.process_time()
            try:
                return real(*given, **named)
            finally:
                self.parts[part] += time.process_time() - start

        patch.setattr(owner, name, timed)

    def count(self, patch: pytest.MonkeyPatch) -> None:
        """Count the robot's steps in updates, of which an action may take many."""
        from houseexpo.pseudoslam.learning.training import CollectionCallback

        real = CollectionCallback._on_step

        def counted(callback: Any) -> Any:
            self.steps += sum(int(info.get("primitive_steps", 1)) for info in callback.locals["infos"])
            return real(callback)

        patch.setattr(CollectionCallback, "_on_step", counted)

    def row(self) -> list[str]:
        """Minutes, processor seconds, and the share of each part."""
        wall, processor = self.read()
        rest = processor - sum(self.parts[part] for part in PARTS)
        shares = [self.parts[part] / processor for part in PARTS] + [rest / processor]
        return [f"{wall / 60:.1f}", f"{processor:.0f}", *(f"{share:.0%}" for share in shares)]


def watched(patch: pytest.MonkeyPatch) -> Clock:
    """A clock for PPO."""
    from stable_baselines3 import PPO
    from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy

    clock = Clock()
    for owner, name, part in (
        (PseudoSlamVectorEnv, "step", "simulator"), (PseudoSlamVectorEnv, "reset", "simulator"),
        (ActorCriticPolicy, "forward", "network"), (ActorCriticPolicy, "predict_values", "network"),
        (BasePolicy, "predict", "network"), (PPO, "train", "network"),
    ):  # fmt: skip
        clock.watch(patch, owner, name, part)
    return clock


def trained(
    config: TrainConfig, folder: Path, patch: pytest.MonkeyPatch
) -> tuple[Clock, list[tuple[float, float, float, float]]]:
    """Train on the published plans; return the clock, and of each test wall and processor seconds, steps, coverage."""
    from houseexpo.pseudoslam.learning import training
    from houseexpo.pseudoslam.learning.environments import choose_plans

    plans = choose_plans(
        open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz"), config.environment, config.evaluation.plans
    )
    clock, tests, real = watched(patch), [], training.evaluate

    def noted(*given: Any, **named: Any) -> Any:
        score = real(*given, **named)
        tests.append((*clock.read(), score["steps"], score["coverage"]))
        return score

    patch.setattr(training, "evaluate", noted)
    clock.watch(patch, training._Training, "_update", "updates")  # collecting steps and learning from them
    clock.count(patch)
    training.train(training.TrainingRun("exploration", config, plans, folder), threads=1)
    return clock, tests


HEADINGS = ("minutes", "processor, s", *PARTS, "rest")


@needs_shared
@pytest.mark.timeout(3600)
def test_a_curve_in_ten_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PPO on frontiers by ``experiments/ten-minutes.toml``, compiling included if nothing is on disk."""
    need(modules=["torch", "sb3_contrib"], how="make learn")
    clock, tests = trained(read_config(TrainConfig, HERE / "ten-minutes.toml"), tmp_path / "run", monkeypatch)
    ways = Table(
        "tested after, minutes", "processor, s", "steps to 95%, 600 at most", "seen, %", title="PPO on frontiers"
    )
    for wall, processor, steps, coverage in tests:
        ways.add_row(f"{wall / 60:.1f}", f"{processor:.0f}", f"{steps:.0f}", f"{100 * coverage:.1f}")
    Console(width=110).print(ways, "the first row: nearest frontier in the same episodes")
    total = Table("steps a processor second", *HEADINGS, title="in all")
    total.add_row(f"{clock.steps / clock.parts['updates']:,.0f}", *clock.row())
    Console(width=110).print(total)
    assert tests[-1][2] < 0.9 * tests[0][2]
    assert clock.read()[1] < 600.0


@needs_shared
@pytest.mark.timeout(3600)
def test_a_chooser_in_ten_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A shorter training than that of ``experiments/chooser.toml``: an eighth of its explorations, or less."""
    need(modules=["cma"], how="make learn")
    config = replace(read_config(ChooserConfig, HERE / "chooser.toml"), generations=8, plans=30, tested=100)
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    clock = Clock()
    clock.watch(monkeypatch, HouseExplorer, "way", "simulator")
    clock.watch(monkeypatch, CmaEsSearch, "ask", "search")
    clock.watch(monkeypatch, CmaEsSearch, "tell", "search")
    about = train_chooser(
        plans, plans.split("train").ids, config, tmp_path / "run", resume=False, threads=1, say=lambda _: None
    )
    total = Table(*HEADINGS, title="a chooser")
    total.add_row(*clock.row())
    Console(width=110).print(total)
    for name, means in about["tests"].items():
        Console(width=110).print(f"{name}: {means['metres']:.1f} m and {means['steps']:.0f} steps to 90%")
    assert about["tests"]["learned"]["metres"] < about["tests"]["nearest"]["metres"]


MOTIONS: Final[dict[str, tuple[str, Precision]]] = {
    "64 pixels": ("exploration-view-10m-masks.toml", "float32"),
    "64 pixels, bfloat16": ("exploration-view-10m-masks.toml", "bfloat16"),
    "42 pixels": ("exploration-view-10m-42.toml", "float32"),
    "42 pixels, bfloat16": ("exploration-view-10m-42.toml", "bfloat16"),
}


@needs_shared
@pytest.mark.timeout(4 * 3600)
@pytest.mark.parametrize("name", list(MOTIONS))
def test_single_motions(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps a second from end to end of a policy of single motions on a view of 10 m."""
    need(modules=["torch", "sb3_contrib"], how="make learn")
    file, precision = MOTIONS[name]
    given = read_config(TrainConfig, HERE / file)
    given = replace(given, ppo=replace(given.ppo, precision=precision))
    asked = int(os.environ.get("HOUSEEXPO_BENCH_STEPS", 2 * given.steps_per_update))
    short = asked <= 2 * given.steps_per_update
    config = replace(given, steps=asked, evaluation=replace(given.evaluation, plans=32 if short else 200))
    clock, tests = trained(config, tmp_path / "run", monkeypatch)
    table = Table("view", "steps", "steps a processor second", *HEADINGS, "seen in 200 steps, %")
    speed, seen = clock.steps / clock.parts["updates"], 100 * tests[-1][3]
    table.add_row(name, f"{clock.steps:,}", f"{speed:,.0f}", *clock.row(), f"{seen:.1f}")
    Console(width=130).print(table)
