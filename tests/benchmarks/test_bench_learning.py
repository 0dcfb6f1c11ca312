"""The paper's two experiments: what was learned, beside policies that learned nothing, in the same episodes.

Policies of ``experiments/paper``, with the paper's memory and without one, learned with three seeds each (``make
experiments``), 200 steps an episode. Obstacle avoidance: 200 episodes in the paper's room, with the reward that
spinning on the spot does not win. Exploration: all published plans of the official test list, or so many as
``HOUSEEXPO_BENCH_PLANS`` says. Learning curves are drawn into the folder that ``HOUSEEXPO_BENCH_OUT`` names.

Last, what masks of motions bring to the policies without a memory, which learned without masks, and to random motions:
a motion that the mask forbids gets the chance 0, and the others share it. Plans of the test list, so many as
``HOUSEEXPO_BENCH_PLANS`` says, 50 if it is not set; 800 steps each, as on the track ``exploration-budget-v1``.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo.drawing.plots import MUTED, ONE, OTHER, standalone_svg, svg_axes
from houseexpo.pseudoslam.agents.policies import load_interface, make_policy
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate_mean, estimate_mean_over_seeds
from houseexpo.pseudoslam.envs.single import ExplorationEnv, ObstacleAvoidanceEnv
from houseexpo.pseudoslam.tasks import ROOM
from houseexpo.pseudoslam.worlds.maps import Plans
from tests.builders.needs import need
from tests.builders.paper_policies import PAPER, SEEDS, held_out, scores_of, task_of
from tests.builders.shared import needs_shared

EPISODES = 200
LEARNED = {"learned": ("", ONE), "learned without a memory": ("-cnn", OTHER)}  # what their experiments end in; colours
BASELINES = {"avoidance": ("random", "forward", "wall"), "exploration": ("random", "forward", "wall", "frontier")}
MEASURES = {"avoidance": ("return", "collisions"), "exploration": ("coverage", "explored_m2", "collisions")}
ENVS = {"avoidance": ObstacleAvoidanceEnv, "exploration": ExplorationEnv}
SHOWN = (200, 800)
Rows = list[dict[str, float]]


def unlearned(task: str, name: str, plans: Plans, ids: Sequence[str] | None, episodes: int) -> Rows:
    """What a policy by its name does in them."""
    from houseexpo.pseudoslam.learning.environments import make_simulator_config
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    told = read_policy(PAPER / f"{task}-0" / "policy.pt", task).config.environment
    wanted = load_interface(name, task)
    env = ENVS[task](
        plans,
        make_simulator_config(task, told),
        actions=wanted.actions,
        observation=wanted.observation,
        **dict(told.task),
    )
    acts, rows = make_policy(name, env, 0), []
    for i in range(episodes):
        observation, info = env.reset(seed=i, options={"plan_id": ids[i]} if ids is not None else None)
        total, ended = 0.0, False
        while not ended:
            observation, reward, terminated, truncated, info = env.step(acts(observation))
            total, ended = total + float(reward), terminated or truncated
        rows.append({"return": total, **{key: float(info[key]) for key in ("coverage", "explored_m2", "collisions")}})
    return rows


def told(found: Estimate, measure: str) -> str:
    """A mean and its 95% interval, as a table shows it."""
    scale = 100 if measure == "coverage" else 1
    mean, low, high = (scale * float(value or 0) for value in (found.mean, found.low, found.high))
    return f"{mean:.1f} [{low:.1f}, {high:.1f}]"


def curve(experiment: str) -> tuple[np.ndarray, np.ndarray]:
    """Steps, (tests,), after which all seeds were tested, and each one's return or coverage then, (seeds, tests)."""
    seeds, measure = [], MEASURES[task_of(experiment)][0]
    for seed in SEEDS:
        with (PAPER / f"{experiment}-{seed}" / "evaluation.csv").open() as stream:
            seeds.append({int(row["steps_done"]): float(row[measure]) for row in csv.DictReader(stream)})
    steps = sorted(set.intersection(*map(set, seeds)))
    return np.array(steps), np.array([[found[at] for at in steps] for found in seeds])


def draw(task: str, lines: dict[str, float], folder: Path) -> None:
    """Draw learning curves, each with a band from the worst seed to the best, and a line for each other policy."""
    scale = 100 if task == "exploration" else 1
    with svg_axes((6.4, 3.4)) as (axes, out):
        for label, (ending, colour) in LEARNED.items():
            steps, seeds = curve(task + ending)
            low, middle, high = scale * seeds.min(axis=0), scale * seeds.mean(axis=0), scale * seeds.max(axis=0)
            axes.fill_between(steps, low, high, color=colour, alpha=0.2, linewidth=0)
            axes.plot(steps, middle, color=colour, linewidth=1.8, marker="o", markersize=3, label=label)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)  # above: lines go all over
        for k, (name, value) in enumerate(lines.items()):  # side by side: two lines may lie close together
            axes.axhline(scale * value, color=MUTED, linewidth=1, linestyle="--")
            at = steps[-1] * (k + 0.5) / len(lines), scale * value
            axes.annotate(name, at, xytext=(0, -12 if k % 2 else 3), textcoords="offset points", ha="center")
        axes.set_xlim(0, steps[-1])
        axes.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:.0f}k")
        axes.set_xlabel("steps learned from")
        axes.set_ylabel("return in 200 steps" if task == "avoidance" else "seen in 200 steps, %")
    (folder / f"learning_{task}.svg").write_text(standalone_svg(out))


@needs_shared
@pytest.mark.timeout(4 * 3600)  # all 10,070 plans, seven policies
@pytest.mark.parametrize("task", list(BASELINES))
def test_what_was_learned(task: str) -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    plans, ids, episodes = ROOM, None, EPISODES
    if task == "exploration":
        plans, listed = held_out()
        there = sorted(listed)
        count = int(os.environ.get("HOUSEEXPO_BENCH_PLANS", len(there)))
        ids = [there[i] for i in np.random.default_rng(0).permutation(len(there))[:count]]
        episodes = len(ids)
    table = Table(title=f"{task}: {episodes} episodes of 200 steps")
    for heading in ("policy", *MEASURES[task]):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    lows, lines = {}, {}
    for label, (ending, _) in LEARNED.items():
        runs = [scores_of(task + ending, seed, plans, ids, episodes, 64) for seed in SEEDS]
        mine = {key: estimate_mean_over_seeds([[row[key] for row in rows] for rows in runs]) for key in MEASURES[task]}
        table.add_row(f"{label} (3 seeds)", *(told(mine[key], key) for key in MEASURES[task]))
        lows[label] = float(mine[MEASURES[task][0]].low or 0)
    for name in BASELINES[task]:
        rows = unlearned(task, name, plans, ids, episodes)
        found = {key: estimate_mean([row[key] for row in rows]) for key in MEASURES[task]}
        table.add_row(name, *(told(found[key], key) for key in MEASURES[task]))
        lines[name] = float(found[MEASURES[task][0]].mean or 0)
    Console(width=110).print(table)
    if folder := os.environ.get("HOUSEEXPO_BENCH_OUT"):
        draw(task, lines, Path(folder))
    beaten = {name: value for name, value in lines.items() if name != "frontier"}
    assert lows["learned"] > max(beaten.values())


def explored(seed: int | None, *, masked: bool, count: int) -> dict[str, float]:
    """Mean coverage after 200 and 800 steps, and collisions, of a policy, or of random motions for None."""
    import torch

    from houseexpo.pseudoslam.learning.environments import make_environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    trained = read_policy(PAPER / f"exploration-cnn-{seed or 0}" / "policy.pt", "exploration")
    told = trained.config.environment
    place = replace(
        told, simulator={**told.simulator, "max_steps": max(SHOWN) + 1}, task={**told.task, "success_coverage": None}
    )
    plans, listed = held_out()
    there = sorted(listed)
    ids = [there[i] for i in np.random.default_rng(0).permutation(len(there))[:count]]
    envs = make_environments("exploration", place, plans, number=count)
    seen, _ = envs.reset(seed=0, options={"plan_id": ids})
    rng, found = np.random.default_rng(0), {}
    chances = np.full((count, 3), 1.0 / 3.0)
    for step in range(1, max(SHOWN) + 1):
        if seed is not None:
            with torch.inference_mode():
                likely = trained.policy.get_distribution(trained.policy.obs_to_tensor(seen)[0])
            chances = likely.distribution.probs.double().numpy()
        allowed = chances * envs.action_masks() if masked else chances
        up_to = np.cumsum(allowed, axis=1)
        seen, *_, info = envs.step((rng.random((count, 1)) * up_to[:, -1:] >= up_to).sum(axis=1).clip(max=2))
        if step in SHOWN:
            found[f"coverage {step}"] = 100.0 * float(info["coverage"].mean())
    envs.close()
    return {**found, "collisions": float(info["collisions"].mean())}


@needs_shared
@pytest.mark.timeout(2 * 3600)
def test_what_masks_bring() -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    count = int(os.environ.get("HOUSEEXPO_BENCH_PLANS", "50"))
    table = Table("motions", "masked", *(f"seen in {steps} steps, %" for steps in SHOWN), "collisions in 800 steps")
    collisions = {}
    for name, seeds in (("random", (None,)), ("PPO, 3 seeds", SEEDS)):
        for masked in (False, True):
            runs = [explored(seed, masked=masked, count=count) for seed in seeds]
            mean = {key: np.mean([run[key] for run in runs]) for key in runs[0]}
            table.add_row(name, "yes" if masked else "no", *(f"{value:.1f}" for value in mean.values()))
            collisions[name, masked] = mean["collisions"]
    Console(width=110).print(table)
    assert collisions["random", True] == collisions["PPO, 3 seeds", True] == 0.0
