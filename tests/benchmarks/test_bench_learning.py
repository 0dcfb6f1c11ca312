"""The paper's two experiments under its own settings, and what goes beyond: trained policies beside others.

1. ``test_what_was_learned``: policies of ``experiments`` (``make experiments``), three seeds each, beside policies that
   learned nothing, in the same episodes of 200 steps. Obstacle avoidance: 200 episodes in the paper's room, with its
   reward. Exploration: all published plans of the official test list, or so many as ``HOUSEEXPO_BENCH_PLANS`` says, in
   the paper's setting and with a view of 10 m. Learning curves, and the paper's figure of explored areas over houses
   sorted by their area, are drawn into the folder that ``HOUSEEXPO_BENCH_OUT`` names.
2. ``test_the_papers_scenes``: the paper's test of obstacle avoidance, five scenes of 6 to 9 objects, beside its table.
3. ``test_what_masks_bring``: what masks of motions bring to the policies without a memory, which learned without masks,
   and to random motions: a motion that the mask forbids gets the chance 0, and the others share it. Plans of the test
   list, so many as ``HOUSEEXPO_BENCH_PLANS`` says, 50 if it is not set; 800 steps each.
4. ``test_a_decision_by_pytorch_and_by_onnx_runtime``: the time of a decision in either way.
"""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo.drawing.plots import INK, MUTED, ONE, OTHER, standalone_svg, svg_axes
from houseexpo.pseudoslam.agents.policies import load_interface, make_policy
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate_mean, estimate_mean_over_seeds
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.envs.single import ExplorationEnv, ObstacleAvoidanceEnv, PseudoSlamEnv
from houseexpo.pseudoslam.tasks import ROOM
from houseexpo.pseudoslam.worlds.maps import Plans
from tests.builders.needs import need
from tests.builders.shared import needs_shared
from tests.builders.trained_policies import SEEDS, folder_of, held_out, scores_of, task_of

EPISODES = 200
ENVS = {"avoidance": ObstacleAvoidanceEnv, "exploration": ExplorationEnv}
SHOWN = (200, 800)
WINDOW = 20  # houses over which the paper's figure smooths
Rows = list[dict[str, float]]


@dataclass(frozen=True)
class Comparison:
    """What is compared: trained experiments by their labels, other policies, and measures, the first one first."""

    learned: dict[str, str]
    others: tuple[str, ...]
    measures: tuple[str, ...]


COMPARISONS = {
    "avoidance": Comparison(
        {"learned": "avoidance"}, ("wall", "spin", "forward", "random"), ("return", "collisions", "explored_m2")
    ),
    "exploration": Comparison(
        {"learned": "exploration"},
        ("random", "forward", "wall", "frontier"),
        ("explored_m2", "coverage", "collisions"),
    ),
    "exploration-view-10m": Comparison(
        {"learned": "exploration-view-10m", "learned without a memory": "exploration-view-10m-cnn"},
        ("random", "forward", "wall", "frontier"),
        ("coverage", "explored_m2", "collisions"),
    ),
}
COLOURS = (ONE, OTHER)
LABELS = {
    "return": "return in 200 steps", "explored_m2": "explored in 200 steps, m²", "coverage": "seen in 200 steps, %",
}  # fmt: skip


def unlearned(experiment: str, name: str, plans: Plans, ids: Sequence[str] | None, episodes: int) -> Rows:
    """What a policy by its name does in the episodes of an experiment."""
    from houseexpo.pseudoslam.learning.environments import make_simulator_config
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    task = task_of(experiment)
    told = read_policy(folder_of(experiment, 0) / "policy.pt", task).config.environment
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


def curve(experiment: str, measure: str) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Steps, (tests,), after which all seeds were tested, and each one's measure then, (seeds, tests)."""
    seeds = []
    for seed in SEEDS:
        with (folder_of(experiment, seed) / "evaluation.csv").open() as stream:
            seeds.append({int(row["steps_done"]): float(row[measure]) for row in csv.DictReader(stream)})
    steps = sorted(set.intersection(*map(set, seeds)))
    return np.array(steps), np.array([[found[at] for at in steps] for found in seeds])


def draw(name: str, lines: dict[str, float], folder: Path) -> None:
    """Draw learning curves, each with a band from the worst seed to the best, and a line for each other policy."""
    measure = COMPARISONS[name].measures[0]
    scale = 100 if measure == "coverage" else 1
    with svg_axes((6.4, 3.4)) as (axes, out):
        for (label, experiment), colour in zip(COMPARISONS[name].learned.items(), COLOURS, strict=False):
            steps, seeds = curve(experiment, measure)
            low, middle, high = scale * seeds.min(axis=0), scale * seeds.mean(axis=0), scale * seeds.max(axis=0)
            axes.fill_between(steps, low, high, color=colour, alpha=0.2, linewidth=0)
            axes.plot(steps, middle, color=colour, linewidth=1.8, marker="o", markersize=3, label=label)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)  # above: lines go all over
        for k, (other, value) in enumerate(lines.items()):  # side by side: two lines may lie close together
            axes.axhline(scale * value, color=MUTED, linewidth=1, linestyle="--")
            at = steps[-1] * (k + 0.5) / len(lines), scale * value
            axes.annotate(other, at, xytext=(0, -12 if k % 2 else 3), textcoords="offset points", ha="center")
        axes.set_xlim(0, steps[-1])
        axes.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:.0f}k")
        axes.set_xlabel("steps learned from")
        axes.set_ylabel(LABELS[measure])
    (folder / f"learning_{name.replace('-', '_')}.svg").write_text(standalone_svg(out))


def smooth(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The mean over ``WINDOW`` neighbours, fewer at the ends."""
    window = np.ones(min(WINDOW, len(values)))
    found: npt.NDArray[Any] = np.convolve(values, window, "same") / np.convolve(np.ones(len(values)), window, "same")
    return found


def draw_areas(areas_m2: npt.NDArray[Any], learned: npt.NDArray[Any], random: npt.NDArray[Any], folder: Path) -> None:
    """Draw what was explored in each house, houses sorted by area, as the paper's figure does."""
    order = np.argsort(areas_m2, kind="stable")
    with svg_axes((6.4, 3.4)) as (axes, out):
        for label, values, colour in (("learned", learned, ONE), ("random", random, OTHER)):
            axes.plot(values[order], color=colour, alpha=0.25, linewidth=0.5)
            axes.plot(smooth(values[order]), color=colour, linewidth=1.6, label=label)
        axes.plot(areas_m2[order], color=INK, linewidth=1.2, label="area of the house")
        axes.legend(loc="upper left", frameon=False)
        axes.set_xlim(0, len(order) - 1)
        axes.set_ylim(0, 1.05 * np.percentile(areas_m2, 99))  # a few houses have thousands of m2
        axes.set_xlabel("houses of the test list, by area")
        axes.set_ylabel(LABELS["explored_m2"])
    (folder / "explored_areas.svg").write_text(standalone_svg(out))


def chosen_plans() -> tuple[Plans, list[str]]:
    """The published plans, and those of the test list that are played."""
    plans, listed = held_out()
    there = sorted(listed)
    count = int(os.environ.get("HOUSEEXPO_BENCH_PLANS", len(there)))
    return plans, [there[i] for i in np.random.default_rng(0).permutation(len(there))[:count]]


@needs_shared
@pytest.mark.timeout(4 * 3600)  # all 10,070 plans, seven policies
@pytest.mark.parametrize("name", list(COMPARISONS))
def test_what_was_learned(name: str) -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    compared = COMPARISONS[name]
    plans, ids = (ROOM, None) if task_of(name) == "avoidance" else chosen_plans()
    episodes = EPISODES if ids is None else len(ids)
    table = Table(title=f"{name}: {episodes} episodes of 200 steps")
    for heading in ("policy", *compared.measures):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    lows, lines, explored_m2 = {}, {}, {}
    first = compared.measures[0]
    for label, experiment in compared.learned.items():
        runs = [scores_of(experiment, seed, plans, ids, episodes, 64) for seed in SEEDS]
        mine = {key: estimate_mean_over_seeds([[row[key] for row in rows] for rows in runs]) for key in runs[0][0]}
        table.add_row(f"{label} (3 seeds)", *(told(mine[key], key) for key in compared.measures))
        lows[label] = float(mine[first].low or 0)
        explored_m2[label] = np.mean([[row["explored_m2"] for row in rows] for rows in runs], axis=0)
    for other in compared.others:
        rows = unlearned(name, other, plans, ids, episodes)
        found = {key: estimate_mean([row[key] for row in rows]) for key in compared.measures}
        table.add_row(other, *(told(found[key], key) for key in compared.measures))
        lines[other] = float(found[first].mean or 0)
        explored_m2[other] = np.array([row["explored_m2"] for row in rows])
    Console(width=110).print(table)
    if ids is not None:
        areas_m2 = np.array([plans[each].area for each in ids])
        better = explored_m2["learned"] > explored_m2["random"]
        Console(width=110).print(
            f"the learned policies explore more than random in {better.mean():.1%} of {len(ids)} houses"
        )
    if folder := os.environ.get("HOUSEEXPO_BENCH_OUT"):
        draw(name, lines, Path(folder))
        if name == "exploration":
            draw_areas(areas_m2, explored_m2["learned"], explored_m2["random"], Path(folder))
    beaten = {"avoidance": ("spin", "forward", "random"), "exploration": ("random",)}
    assert lows["learned"] > max(lines[other] for other in beaten.get(name, ("random", "forward", "wall")))


OBJECTS = (6, 6, 7, 9, 9)
TABLE_III = {
    "collisions": (2, 0, 2, 0, 2),
    "mean, m": (18.41, 17.98, 18.08, 15.62, 14.67),
    "variance, m2": (0.70, 4.31, 2.01, 21.78, 15.25),
}
"""What the paper measured with a real robot, in ten episodes a scene."""
LIMIT_S, FORWARD_S, TURN_S = 120.0, 0.3 / 0.2, 10.0 / 40.0
"""The time of an episode, and of a step of 0.3 m and a turn of 10 degrees at the speeds of the paper's robot."""


def drive(policy: str, scene: int) -> tuple[list[int], list[float]]:
    """Collisions and the way, metres, in each of ten episodes of a scene; starts are random."""
    from houseexpo.pseudoslam.learning.environments import make_simulator_config
    from houseexpo.pseudoslam.learning.policy_file import EpisodeActor, read_policy

    trained = read_policy(folder_of("avoidance", int(policy)) / "policy.pt") if policy.isdigit() else None
    told = read_policy(folder_of("avoidance", 0) / "policy.pt").config.environment
    config = replace(make_simulator_config("avoidance", told), max_steps=int(LIMIT_S / TURN_S))
    drawn = ObstacleAvoidanceEnv(
        config=replace(config, obstacles=ObstaclesConfig(random=RandomObstacles((OBJECTS[scene], OBJECTS[scene]))))
    )
    drawn.reset(seed=scene)
    placed = ObstaclesConfig(placed=drawn.state.obstacles)
    env: PseudoSlamEnv = ObstacleAvoidanceEnv(config=replace(config, obstacles=placed))
    acts: Any = None if trained else make_policy(policy, env, 0)
    collisions, ways = [], []
    for episode in range(10):
        observation, info = env.reset(seed=episode)
        if trained:
            acts = EpisodeActor(trained, episode)
        left_s = LIMIT_S
        while True:
            action = acts(observation)
            left_s -= FORWARD_S if action == 0 else TURN_S
            if left_s < 0:
                break
            observation, *_, info = env.step(action)
        collisions.append(int(info["collisions"]))
        ways.append(float(env.state.episode.readings[0].path_length) / config.pixels_per_metre)
    return collisions, ways


def test_the_papers_scenes() -> None:
    need(modules=["torch", "sb3_contrib"], how="make learn")
    table = Table(title="rooms of 5.5 x 3.2 m, ten episodes of two minutes a scene")
    for heading in ("policy", "", *(f"scene {k}: {objects} objects" for k, objects in enumerate(OBJECTS, start=1))):
        table.add_column(heading, justify="right" if heading.startswith("scene") else "left")
    for measure, values in TABLE_III.items():
        table.add_row("the paper, a real robot", measure, *(f"{value:g}" for value in values))
    total = {}
    for policy in (*map(str, SEEDS), "wall"):
        found = [drive(policy, scene) for scene in range(len(OBJECTS))]
        shown = f"learned, seed {policy}" if policy.isdigit() else policy
        table.add_row(shown, "collisions", *(str(sum(hits)) for hits, _ in found))
        table.add_row("", "episodes with one", *(str(np.count_nonzero(hits)) for hits, _ in found))
        table.add_row("", "mean, m", *(f"{np.mean(ways):.2f}" for _, ways in found))
        table.add_row("", "variance, m2", *(f"{np.var(ways):.2f}" for _, ways in found))
        total[policy] = sum(sum(hits) for hits, _ in found), float(np.mean([ways for _, ways in found]))
    Console(width=130).print(table)
    for policy, (hits, way) in total.items():
        Console(width=130).print(f"{policy}: {hits} collisions in 50 episodes, {way:.1f} m each")
    assert all(way > 5.0 for _, way in total.values())  # nobody spins


def explored(seed: int | None, *, masked: bool, count: int) -> dict[str, float]:
    """Mean coverage after 200 and 800 steps, and collisions, of a policy, or of random motions for None."""
    import torch

    from houseexpo.pseudoslam.learning.environments import make_environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    trained = read_policy(folder_of("exploration-view-10m-cnn", seed or 0) / "policy.pt", "exploration")
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
                policy = trained.network.policy
                likely = policy.get_distribution(policy.obs_to_tensor(seen)[0])
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


def test_a_decision_by_pytorch_and_by_onnx_runtime(tmp_path: Path) -> None:
    """Processor milliseconds of an action, without the simulator."""
    need(modules=["torch", "sb3_contrib", "onnx", "onnxruntime"], how="make learn")
    from houseexpo.pseudoslam.learning.onnx_export import export_policy
    from houseexpo.pseudoslam.learning.policy_file import EpisodeActor, read_policy

    table = Table(title="a decision, ms of one core")
    for heading in ("policy", "policy.pt", "policy.onnx"):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    for name in ("exploration-view-10m", "exploration-view-10m-cnn", "exploration-frontiers"):
        file, found = folder_of(name, 0) / "policy.pt", []
        for each in (file, export_policy(file, tmp_path / name)):
            policy = read_policy(each)
            acts, seen = EpisodeActor(policy), policy.observation_space.sample()
            acts(seen)
            start = time.process_time()
            for _ in range(1000):
                acts(seen)
            found.append(f"{time.process_time() - start:.2f}")
        table.add_row(name, *found)
    Console(width=120).print(table)
