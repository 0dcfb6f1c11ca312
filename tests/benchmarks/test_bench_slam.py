"""PseudoSLAM beside icp-slam and GMapping, on the same paths: time per scan, and the region that the walls enclose.

``tests/builders/real_slam.py`` states the protocol. icp-slam's pictures go to ``docs/images/slam.png``.

Then explorers on maps that they were not made for: the real SLAM's, as it draws them, and another simulator's lidar's.
``research/transfer_slam.py`` and ``research/transfer_irsim.py`` state the protocols.
"""

from __future__ import annotations

import gzip
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan, open_dataset
from houseexpo.floorplan import decode
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import make_knowledge
from houseexpo.pseudoslam.benchmark.cases import read_test_ids
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from research.transfer import CONFIG, Exploration, Explorer, explore_on_own_map
from research.transfer_irsim import explore_in_irsim
from research.transfer_slam import explore_with_slam
from tests.builders.needs import need
from tests.builders.real_slam import (
    Comparison,
    Run,
    compare,
    explore,
    need_gmapping,
    need_icp_slam,
    overlay,
    run_gmapping,
    run_icp_slam,
)
from tests.builders.shared import DATA, needs_shared
from tests.builders.trained_policies import SEEDS, folder_of

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "slam.png"
PLANS = (  # the first five published ones of more than 40 m2
    "0004d52d1aeeb8ae6de39d6bd993e992",
    "0004dd3cb11e50530676f77b55262d38",
    "000514ade3bcc292a613a4c2755a5050",
    "00052c0562bde7790f8354e6123ae7ff",
    "0005b92a9ed6349df155a462947bfdfe",
)


def published() -> list[FloorPlan]:
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line, _ in zip(stream, range(20), strict=False)]
    return [plan for plan in plans if plan.id in PLANS]


SLAMS = {"icp-slam": (need_icp_slam, run_icp_slam), "GMapping": (need_gmapping, run_gmapping)}


@needs_shared
@pytest.mark.parametrize("name", SLAMS)
def test_the_maps_agree_with_those_of_a_real_slam(name: str, tmp_path: Path) -> None:
    need_it, run_it = SLAMS[name]
    need_it()
    table = Table(title=f"PseudoSLAM and {name} on the same path: cells of 5 cm, 10 m, half round")
    for heading in ("plan", "m2", "scans", "IoU as is", "IoU", "ours, ms/scan", "SLAM, ms/scan", "ratio"):
        table.add_column(heading, justify="left" if heading == "plan" else "right")
    seen: list[tuple[FloorPlan, Run, Comparison]] = []
    for plan in published():
        run = explore(plan)
        folder = tmp_path / plan.id
        folder.mkdir()
        found = run_it(run, folder)
        seen.append((plan, run, compare(run, found)))
        table.add_row(
            plan.id[:8], f"{plan.area:.0f}", f"{len(run.poses)}", f"{seen[-1][2].iou_as_is:.3f}",
            f"{seen[-1][2].iou:.3f}", f"{run.ms_per_scan:.3f}", f"{found.ms_per_scan:.1f}",
            f"{found.ms_per_scan / run.ms_per_scan:.0f}",
        )  # fmt: skip
    ious = [comparison.iou for _, _, comparison in seen]
    as_is = float(np.median([comparison.iou_as_is for _, _, comparison in seen]))
    median = float(np.median(ious))
    table.caption = f"{name}: median IoU {median:.3f}, lowest {min(ious):.3f}; as is {as_is:.3f} (the paper: 0.982)"
    Console(width=120).print(table)
    if name == "icp-slam":
        draw(seen)
    assert len(seen) == len(PLANS)
    assert median >= 0.96


def draw(seen: list[tuple[FloorPlan, Run, Comparison]]) -> None:
    """A column a house: our map, the SLAM's, the two regions on each other."""
    figure = Figure(figsize=(2.3 * len(seen), 6.2), layout="constrained")
    axes = figure.subplots(3, len(seen))
    for column, (plan, run, comparison) in enumerate(seen):
        ours = np.where(run.known == 0, 127, np.where(run.known == 255, 0, 255))
        for axis, picture in zip(
            axes[:, column], (ours, comparison.theirs, overlay(run.known, comparison)), strict=True
        ):
            axis.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
            axis.set(xticks=[], yticks=[])
            axis.spines[:].set_visible(False)
        axes[0, column].set_title(f"{plan.id[:8]}, {plan.area:.0f} m²", fontsize=9)
        axes[2, column].set_xlabel(f"IoU {comparison.iou:.3f}", fontsize=9)
    for axis, name in zip(axes[:, 0], ("PseudoSLAM", "icp-slam", "overlay"), strict=True):
        axis.set_ylabel(name, fontsize=10)
    figure.savefig(PICTURE, dpi=110)


LEARNED = tuple(str(folder_of("exploration-view-10m", seed) / "policy.pt") for seed in SEEDS)
POLICIES = {"frontier": ("frontier",), "information": ("information",), "chooser": ("chooser",), "PPO + LSTM": LEARNED}
TEST_PLANS, STEPS = 10, 200


def first_tested() -> list[FloorPlan]:
    """The benchmark's first test plans."""
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    return [plans[name] for name in read_test_ids()[:TEST_PLANS]]


@needs_shared
def test_what_is_learned_from_is_drawn_as_environments_draw_it() -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    plan, explorer = first_tested()[0], Explorer(LEARNED[0], 0)
    view = load_policy(LEARNED[0]).interface.view
    assert view
    env = ExplorationEnv([plan], config=replace(CONFIG, observation=view))
    seen, _ = env.reset(seed=0)
    for _ in range(50):
        found = explorer.view_of(make_knowledge(env.simulator, env.state))
        np.testing.assert_array_equal(found, seen)
        seen, *_ = env.step(int(explorer(make_knowledge(env.simulator, env.state)) or 0))
    assert {0, 127, 255} == set(np.unique(seen))
    env.close()


@needs_shared
def test_explorers_on_a_slams_maps_and_in_another_simulator(tmp_path: Path) -> None:
    need_icp_slam()
    need(modules=["irsim"], how="make setup")
    need(modules=["torch", "sb3_contrib"], how="make learn")
    table = Table(title=f"Explorers for {STEPS} steps: means over the benchmark's first {TEST_PLANS} test plans")
    for heading in ("policy", "map", "coverage", "area", "metres", "collisions", "off at the end, m"):
        table.add_column(heading, justify="left" if heading in {"policy", "map"} else "right")
    plans = first_tested()
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
