"""Learning to choose frontiers: a network over a set, and returns that are discounted by the time that actions take."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.learning.config import EnvironmentConfig, PPOConfig, TrainConfig
from tests.builders.training import run, tiny

torch = pytest.importorskip("torch")
pytest.importorskip("sb3_contrib")
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("learn")]
FRONTIERS = EnvironmentConfig(actions="frontier", simulator={"max_steps": 60}, task={"reward": "coverage"})
RNG = np.random.default_rng(0)


def random_episodes(steps: int, envs: int) -> tuple[Any, ...]:
    rewards, values = RNG.normal(size=(steps, envs)), RNG.normal(size=(steps + 1, envs))
    starts = RNG.random((steps + 1, envs)) < 0.2
    return tuple(part.astype(np.float32) for part in (rewards, values, starts))


def test_equal_discounts_give_the_advantages_of_stable_baselines() -> None:
    from gymnasium import spaces
    from stable_baselines3.common.buffers import RolloutBuffer

    from houseexpo.pseudoslam.learning.training import estimate_advantages

    rewards, values, starts = random_episodes(30, 4)
    buffer = RolloutBuffer(30, spaces.Box(0, 1, (1,)), spaces.Discrete(2), gae_lambda=0.9, gamma=0.97, n_envs=4)
    buffer.rewards, buffer.values, buffer.episode_starts = rewards, values[:-1], starts[:-1]
    buffer.compute_returns_and_advantage(torch.from_numpy(values[-1]), starts[-1])
    found = estimate_advantages(rewards, values, starts, np.full((30, 4), 0.97, np.float32), 0.9)
    np.testing.assert_allclose(found, buffer.advantages, rtol=1e-5, atol=1e-6)


def test_a_travel_of_k_steps_is_worth_as_much_as_k_actions_of_one_step() -> None:
    from houseexpo.pseudoslam.learning.training import estimate_advantages

    rewards, values, starts = random_episodes(12, 2)
    starts[:] = 0.0
    starts[7, 1] = 1.0
    steps = RNG.integers(1, 6, (12, 2))
    found = estimate_advantages(
        rewards, values, starts, (0.9**steps).astype(np.float32), 1.0
    )  # lambda 1: whole returns
    for env in range(2):
        for t in range(12):
            wanted, worth = 0.0, 1.0
            for later in range(t, 12):
                wanted += worth * rewards[later, env]
                for _ in range(steps[later, env]):
                    worth *= 0.9
                if starts[later + 1, env]:
                    worth = 0.0
                    break
            wanted += worth * values[-1, env]
            assert found[t, env] + values[t, env] == pytest.approx(wanted, rel=1e-4, abs=1e-5)


def test_the_order_of_frontiers_does_not_matter_and_forbidden_ones_are_never_chosen() -> None:
    from gymnasium import spaces

    from houseexpo.pseudoslam.learning.model import new_policy

    seen = spaces.Dict(
        {
            "map": spaces.Box(0, 255, (1, 8, 8), np.uint8),
            "frontiers": spaces.Box(-1e5, 1e5, (6, 5), np.float32),
            "action_mask": spaces.MultiBinary(6),
        }
    )
    torch.manual_seed(0)
    policy = new_policy(seen, spaces.Discrete(6), TrainConfig(policy="set", environment=FRONTIERS))
    with torch.no_grad():
        for weights in policy.parameters():
            weights.add_(0.3 * torch.randn_like(weights))  # an untrained policy rates all of them alike
    frontiers = torch.from_numpy(np.abs(RNG.normal(3.0, 2.0, (1, 6, 5)))).float()
    mask = torch.tensor([[1.0, 1.0, 0.0, 1.0, 0.0, 1.0]])
    frontiers[..., 4] = mask
    frontiers[mask == 0] = 0.0
    order = torch.tensor([5, 2, 0, 4, 1, 3])
    picture = torch.zeros(1, 1, 8, 8, dtype=torch.uint8)
    answers = []
    for index in (torch.arange(6), order):
        given = {"map": picture, "frontiers": frontiers[:, index], "action_mask": mask[:, index]}
        answers.append((policy.get_distribution(given).distribution.probs[0], policy.predict_values(given)[0]))
    (chances, value), (others, other_value) = answers
    torch.testing.assert_close(chances[order], others)
    torch.testing.assert_close(value, other_value)
    assert chances[mask[0] == 0].max() == 0.0
    assert chances[mask[0] == 1].min() > 0.0
    assert chances.std() > 0.01


def test_without_a_discount_all_clocks_learn_the_same(tmp_path: Path) -> None:
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    found = []
    for clock in ("actions", "steps", "metres"):
        ppo = replace(tiny().ppo, gamma=1.0, discount=clock)
        config = replace(tiny(steps=256), policy="set", ppo=ppo, environment=FRONTIERS)
        run(tmp_path / clock, config, "exploration")
        found.append(read_policy(tmp_path / clock / "policy.pt").network.policy.state_dict())
    for name, weights in found[0].items():
        for other in found[1:]:
            np.testing.assert_array_equal(weights.numpy(), other[name].numpy(), err_msg=name)


def test_the_discount_of_steps_is_not_that_of_actions(tmp_path: Path) -> None:
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    found = []
    for clock in ("actions", "steps"):
        config = replace(
            tiny(steps=256), policy="set", ppo=PPOConfig(rollout_steps=32, discount=clock), environment=FRONTIERS
        )
        run(tmp_path / clock, config, "exploration")
        found.append(read_policy(tmp_path / clock / "policy.pt").network.policy.state_dict())
    assert any((weights != found[1][name]).any() for name, weights in found[0].items())


def test_the_nearest_frontier_is_the_allowed_one_with_the_shortest_path() -> None:
    from houseexpo.pseudoslam.learning.training import NearestFrontierBaseline

    ways = np.array([[3.0, 1.0, 2.0], [0.5, 4.0, 4.5], [1.0, 2.0, 3.0]])
    frontiers = np.zeros((3, 3, 5), np.float32)
    frontiers[:, :, 2], frontiers[:, :, 0] = ways, ways[:, ::-1]  # as the crow flies, others are nearer
    masks = np.array([[1, 1, 1], [0, 1, 1], [0, 0, 1]], np.int8)
    chosen, memory = NearestFrontierBaseline().predict({"frontiers": frontiers, "action_mask": masks}, None, None)
    assert chosen.tolist() == [1, 1, 2]
    assert memory is None


def test_a_run_on_frontiers_says_first_what_nearest_frontier_does(tmp_path: Path) -> None:
    said: list[str] = []
    run(tmp_path / "run", replace(tiny(steps=64), policy="set", environment=FRONTIERS), "exploration", say=said.append)
    assert "; on the CPU, by 1 thread" in said[0] or "; on the GPU, " in said[0]
    assert said[1].startswith("nearest frontier in these episodes: return ")
