"""What masks of motions bring: the paper's policies without a memory, and random motions, with the mask and without.

The policies of ``experiments/paper/exploration-cnn-*`` learned without masks. Here a motion that the mask forbids gets
the chance 0, and the others share it. Plans of the published test list, so many as ``HOUSEEXPO_BENCH_PLANS`` says, 50
if it is not set; 800 steps each, as on the track ``exploration-budget-v1``.
"""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from tests.builders.needs import need
from tests.builders.paper_policies import PAPER, SEEDS, held_out
from tests.builders.shared import needs_shared

SHOWN = (200, 800)


def explored(seed: int | None, *, masked: bool, count: int) -> dict[str, float]:
    """Mean coverage after 200 and 800 steps, and collisions, of a policy, or of random motions for None."""
    import torch

    from houseexpo.pseudoslam.learning.environments import environments
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    trained = read_policy(PAPER / f"exploration-cnn-{seed or 0}" / "policy.pt", "exploration")
    told = trained.config.environment
    place = replace(
        told, simulator={**told.simulator, "max_steps": max(SHOWN) + 1}, task={**told.task, "success_coverage": None}
    )
    plans, listed = held_out()
    there = sorted(listed)
    ids = [there[i] for i in np.random.default_rng(0).permutation(len(there))[:count]]
    envs = environments("exploration", place, plans, number=count)
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
