"""Explorers on maps that they were not made for: a real SLAM's, as it draws them, and another simulator's lidar's.

``transfer_slam.py`` and ``transfer_irsim.py`` state the protocols.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan, open_dataset
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import knowledge_of
from houseexpo.pseudoslam.benchmark.cases import written_ids
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from research.transfer import CONFIG, Exploration, Explorer, explore_on_own_map
from research.transfer_irsim import explore_in_irsim
from research.transfer_slam import explore_with_slam
from tests.builders.needs import need
from tests.builders.paper_policies import PAPER, SEEDS
from tests.builders.real_slam import need_slam
from tests.builders.shared import DATA, needs_shared

LEARNED = tuple(str(PAPER / f"exploration-{seed}" / "policy.pt") for seed in SEEDS)
POLICIES = {"frontier": ("frontier",), "information": ("information",), "chooser": ("chooser",), "PPO + LSTM": LEARNED}
PLANS, STEPS = 10, 200


def published() -> list[FloorPlan]:
    """The benchmark's first test plans."""
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    return [plans[name] for name in written_ids()[:PLANS]]


@needs_shared
def test_what_is_learned_from_is_drawn_as_environments_draw_it() -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    plan, explorer = published()[0], Explorer(LEARNED[0], 0)
    view = load_policy(LEARNED[0]).interface.view
    assert view
    env = ExplorationEnv([plan], config=replace(CONFIG, observation=view))
    seen, _ = env.reset(seed=0)
    for _ in range(50):
        found = explorer.view_of(knowledge_of(env.simulator, env.state))
        np.testing.assert_array_equal(found, seen)
        seen, *_ = env.step(int(explorer(knowledge_of(env.simulator, env.state)) or 0))
    assert {0, 127, 255} == set(np.unique(seen))
    env.close()


@needs_shared
def test_explorers_on_a_slams_maps_and_in_another_simulator(tmp_path: Path) -> None:
    need_slam()
    need(modules=["irsim"], how="make setup")
    need(modules=["torch", "sb3_contrib"], how="make learn")
    table = Table(title=f"Explorers for {STEPS} steps: means over the benchmark's first {PLANS} test plans")
    for heading in ("policy", "map", "coverage", "area", "metres", "collisions", "off at the end, m"):
        table.add_column(heading, justify="left" if heading in {"policy", "map"} else "right")
    plans = published()
    for label, trainings in POLICIES.items():
        runs: dict[str, list[Exploration]] = {"PseudoSLAM": [], "icp-slam": [], "IR-SIM": []}
        for number, (policy, plan) in enumerate(product(trainings, plans)):
            folder = tmp_path / f"{label}-{number}"
            folder.mkdir()
            runs["PseudoSLAM"].append(explore_on_own_map(plan, policy, STEPS))
            runs["icp-slam"].append(explore_with_slam(plan, policy, folder, STEPS))
            runs["IR-SIM"].append(explore_in_irsim(plan, policy, folder, STEPS))
        for name, done in runs.items():
            table.add_row(label, name, *summary(done))
            assert all(one.coverage[-1] > one.coverage[0] for one in done)
        Console(width=120).print(table)  # each policy takes minutes


def summary(runs: list[Exploration]) -> tuple[str, ...]:
    """Return the means as cells."""
    area = [np.mean([*one.coverage, *[one.coverage[-1]] * (STEPS + 1 - len(one.coverage))]) for one in runs]
    return (
        f"{100 * np.mean([one.coverage[-1] for one in runs]):.1f}%",
        f"{100 * np.mean(area):.1f}%",
        f"{np.mean([one.metres for one in runs]):.1f}",
        f"{np.mean([one.collisions for one in runs]):.1f}",
        f"{np.mean([one.off_m for one in runs]):.2f}",
    )
