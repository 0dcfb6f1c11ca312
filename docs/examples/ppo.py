"""PPO in one file, in the form of CleanRL, on a PseudoSLAM vector environment.

    python docs/examples/ppo.py PseudoSLAM/Exploration-v0 --dataset plans/demo --total-steps 200000

Needs the extra `learn`. Read it, copy it, change it: nothing here is hidden in a library.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from torch import nn
from torch.distributions import Categorical

import houseexpo.pseudoslam  # noqa: F401  # registers the environments


@dataclass(frozen=True)
class Args:
    """What is learned, and how."""

    env_id: str = "PseudoSLAM/Exploration-v0"
    env: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    device: str = "cpu"
    total_steps: int = 200_000
    num_envs: int = 16
    num_steps: int = 128
    epochs: int = 4
    minibatches: int = 4
    learning_rate: float = 2.5e-4
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.1
    entropy: float = 0.01
    value: float = 0.5
    max_grad_norm: float = 0.5


@dataclass
class History:
    """Returns of the episodes that ended, the loss of each update, and how far the weights moved."""

    returns: list[float] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)
    change: float = 0.0


class Agent(nn.Module):
    """A small convolutional network with two heads: what to do, and what it is worth."""

    def __init__(self, envs: gymnasium.vector.VectorEnv) -> None:
        super().__init__()
        shape = envs.single_observation_space.shape
        body = [nn.Conv2d(shape[0], 32, 8, 4), nn.ReLU(), nn.Conv2d(32, 64, 4, 2), nn.ReLU(), nn.Flatten()]
        wide = nn.Sequential(*body)(torch.zeros(1, *shape)).shape[1]
        self.body = nn.Sequential(*body, nn.Linear(wide, 256), nn.ReLU())
        self.actor, self.critic = nn.Linear(256, int(envs.single_action_space.n)), nn.Linear(256, 1)
        for layer, gain in [(layer, 2**0.5) for layer in self.body] + [(self.actor, 0.01), (self.critic, 1.0)]:
            if isinstance(layer, nn.Conv2d | nn.Linear):
                nn.init.orthogonal_(layer.weight, gain)
                nn.init.zeros_(layer.bias)

    def forward(self, observations: torch.Tensor) -> tuple[Categorical, torch.Tensor]:
        """Return the distribution of actions, and values (N,)."""
        hidden = self.body(observations.float() / 255.0)
        return Categorical(logits=self.actor(hidden)), self.critic(hidden)[:, 0]


@dataclass
class Learner:
    """The agent, what improves it, and the chance that its samples are shuffled by."""

    agent: Agent
    optimizer: torch.optim.Optimizer
    shuffle: np.random.Generator


class Rollout:
    """What happened in ``num_steps`` steps of all environments: arrays (num_steps, num_envs, ...)."""

    def __init__(self, args: Args, shape: tuple[int, ...]) -> None:
        self.gamma, size = args.gamma, (args.num_steps, args.num_envs)
        self.observations = torch.zeros((*size, *shape), dtype=torch.uint8, device=args.device)
        self.actions = torch.zeros(size, dtype=torch.long, device=args.device)
        self.log_probs, self.rewards, self.values, self.ends = torch.zeros((4, *size), device=args.device)

    def advantages(self, args: Args, after: torch.Tensor) -> torch.Tensor:
        """Return generalised advantages; ``after`` are the values behind the last step."""
        found, advantage = torch.zeros_like(self.rewards), torch.zeros_like(after)
        for t in reversed(range(args.num_steps)):
            goes_on = 1.0 - self.ends[t]
            delta = self.rewards[t] + args.gamma * after * goes_on - self.values[t]
            advantage = delta + args.gamma * args.gae_lambda * goes_on * advantage
            found[t], after = advantage, self.values[t]
        return found


def train(args: Args) -> History:
    """Learn; return what came of it."""
    torch.manual_seed(args.seed)
    # an episode's end and the next one's start come in one step: no step is without meaning
    made = gymnasium.make_vec(args.env_id, num_envs=args.num_envs, autoreset_mode="SameStep", **args.env)
    envs = RecordEpisodeStatistics(made)
    agent = Agent(envs).to(args.device)
    first = nn.utils.parameters_to_vector(agent.parameters()).detach().clone()
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    learner = Learner(agent, optimizer, np.random.default_rng(args.seed))
    rollout, history = Rollout(args, envs.single_observation_space.shape), History()
    observation, _ = envs.reset(seed=args.seed)
    for _ in range(args.total_steps // (args.num_steps * args.num_envs)):
        observation = collect(envs, agent, rollout, observation, history)
        with torch.no_grad():
            after = agent(torch.as_tensor(observation, device=args.device))[1]
        history.losses.append(update(args, learner, rollout, rollout.advantages(args, after)))
    envs.close()
    history.change = float((nn.utils.parameters_to_vector(agent.parameters()).detach() - first).norm())
    return history


def collect(envs: Any, agent: Agent, rollout: Rollout, observation: Any, history: History) -> Any:
    """Fill a rollout and return the observation after it.

    An episode that reached its time limit could have gone on: the value of its last observation stands for the rest.
    """
    for t in range(len(rollout.rewards)):
        rollout.observations[t] = torch.as_tensor(observation)
        with torch.no_grad():
            policy, rollout.values[t] = agent(rollout.observations[t])
        rollout.actions[t] = policy.sample()
        rollout.log_probs[t] = policy.log_prob(rollout.actions[t])
        observation, rewards, terminated, truncated, infos = envs.step(rollout.actions[t].cpu().numpy())
        rollout.rewards[t] = torch.as_tensor(rewards)
        limited = truncated & ~terminated
        if limited.any():
            last = torch.as_tensor(np.stack(infos["final_obs"][limited].tolist()), device=rollout.rewards.device)
            with torch.no_grad():
                rollout.rewards[t, torch.as_tensor(limited)] += rollout.gamma * agent(last)[1]
        rollout.ends[t] = torch.as_tensor(terminated | truncated)
        if "episode" in infos:
            history.returns += infos["episode"]["r"][infos["_episode"]].tolist()
    return observation


def update(args: Args, learner: Learner, rollout: Rollout, advantages: torch.Tensor) -> float:
    """Improve the agent on a rollout; return the last loss."""
    count = args.num_steps * args.num_envs
    returns = (advantages + rollout.values).reshape(count)
    observations = rollout.observations.reshape(count, *rollout.observations.shape[2:])
    actions, old, gains = (part.reshape(count) for part in (rollout.actions, rollout.log_probs, advantages))
    loss = torch.zeros(())
    agent = learner.agent
    for _ in range(args.epochs):
        for part in np.array_split(learner.shuffle.permutation(count), args.minibatches):
            policy, values = agent(observations[part])
            ratio = (policy.log_prob(actions[part]) - old[part]).exp()
            gain = (gains[part] - gains[part].mean()) / (gains[part].std() + 1e-8)
            gained = torch.min(gain * ratio, gain * ratio.clamp(1 - args.clip, 1 + args.clip)).mean()
            missed = 0.5 * (values - returns[part]).square().mean()
            loss = args.value * missed - gained - args.entropy * policy.entropy().mean()
            learner.optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
            learner.optimizer.step()
    return float(loss.detach())


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("env_id", nargs="?", default=Args.env_id)
    parser.add_argument("--dataset", help="data set, or its folder")
    parser.add_argument("--total-steps", type=int, default=Args.total_steps)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    given = parser.parse_args()
    houses = {"dataset": given.dataset} if given.dataset else {}
    done = train(Args(given.env_id, houses, given.seed, given.device, given.total_steps))
    if not done.returns:
        parser.exit(message="no episode ended: give it more --total-steps\n")
    quarter = max(len(done.returns) // 4, 1)
    print(f"{len(done.returns)} episodes, mean return {np.mean(done.returns[:quarter]):.2f} at first", end=", ")  # noqa: T201
    print(f"{np.mean(done.returns[-quarter:]):.2f} at last")  # noqa: T201
