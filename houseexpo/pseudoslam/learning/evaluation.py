"""Run a policy for one episode in each plan that is not used in training, and return its mean scores."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import torch

from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.learning.model import Policy

MEASURES: Final = ("coverage", "explored_m2", "collisions", "is_success", "way_m", "spl")
"""Measures in the info at the end of an episode; each task has some of them."""

Score = dict[str, float]


def evaluate(
    policy: Policy, envs: PseudoSlamVectorEnv, plan_ids: tuple[str, ...] | None, episodes: int, *, deterministic: bool
) -> Score:
    """Return the means of ``score_episodes`` over a number of episodes."""
    rows = score_episodes(policy, envs, plan_ids, episodes, deterministic=deterministic)
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def score_episodes(
    policy: Policy, envs: PseudoSlamVectorEnv, plan_ids: tuple[str, ...] | None, episodes: int, *, deterministic: bool
) -> list[Score]:
    """Return the scores of a number of episodes: ``return``, ``steps``, and the task's ``MEASURES``.

    1. Episode i starts with seed i, in plan i if there are ids, so that policies are compared in the same episodes.
    2. Actions use a separate random state, so that evaluation does not affect training.
    """
    plans: list[str | None] = [None] * episodes if plan_ids is None else list(plan_ids[:episodes])
    rows: list[Score] = []
    was_training = policy.training
    policy.set_training_mode(False)
    with torch.random.fork_rng(devices=range(torch.cuda.device_count())):  # R2
        torch.manual_seed(0)
        for first in range(0, len(plans), envs.num_envs):
            wanted = plans[first : first + envs.num_envs]
            spare = [wanted[0]] * (envs.num_envs - len(wanted))
            seeds = [first + i for i in range(envs.num_envs)]  # R1
            found = list(_episodes(policy, envs, seeds, [*wanted, *spare], deterministic=deterministic))
            rows += found[: len(wanted)]
    policy.set_training_mode(was_training)
    return rows


def _episodes(
    policy: Policy, envs: PseudoSlamVectorEnv, seeds: list[int], plans: list[str | None], *, deterministic: bool
) -> Iterator[Score]:
    """Yield the score of an episode in each of the environments."""
    observation, _ = envs.reset(seed=seeds, options={"plan_id": plans})
    number = envs.num_envs
    returns, lengths = np.zeros(number), np.zeros(number)
    ends: dict[int, dict[str, Any]] = {}
    state, starts = None, np.ones(number, bool)
    while len(ends) < number:
        actions, state = policy.predict(observation, state, starts, deterministic=deterministic)
        observation, rewards, terminated, truncated, infos = envs.step(actions)
        starts = terminated | truncated
        steps = infos.get("primitive_steps", np.ones(number)).astype(float)
        if starts.any() and "primitive_steps" in infos:  # those of the last action, not of the new episode
            steps[starts] = infos["final_info"]["primitive_steps"][starts]
        running = np.array([i not in ends for i in range(number)])
        returns += rewards * running
        lengths += steps * running
        for i in np.flatnonzero(starts & running).tolist():
            ends[i] = {name: infos["final_info"][name][i] for name in MEASURES if name in infos["final_info"]}
    for i in range(number):
        yield {
            "return": float(returns[i]),
            "steps": float(lengths[i]),
            **{name: float(value) for name, value in ends[i].items()},
        }
