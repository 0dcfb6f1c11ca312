"""Build the networks of policies, and the learner: PPO of Stable-Baselines3, or that of sb3-contrib with a memory.

Frontiers are a set: each is rated by the same small network (Deep Sets: Zaheer et al., 2017), which also gets the mean
and the maximum over all of them.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from sb3_contrib.common.recurrent.policies import (
    RecurrentActorCriticPolicy,
    RecurrentMultiInputActorCriticPolicy,
)
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy, MultiInputActorCriticPolicy
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecMonitor, VecNormalize
from torch import nn

from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.sb3 import SB3VecEnv

States: TypeAlias = tuple[torch.Tensor, torch.Tensor]


def run_lstm(
    features: torch.Tensor, states: States, episode_starts: torch.Tensor, lstm: torch.nn.LSTM
) -> tuple[torch.Tensor, States]:
    """Return the outputs of a memory for sequences, and its states after them.

    Parameters
    ----------
    features
        (sequences * steps, ``lstm.input_size``).
    states
        The two states before the first step, each (layers, sequences, ``lstm.hidden_size``).
    episode_starts
        (sequences * steps,): 1 for steps at which an episode begins.
    """
    count = states[0].shape[1]
    starts = episode_starts.reshape(count, -1)
    if starts[:, 1:].any():
        step_by_step: tuple[torch.Tensor, States] = RecurrentActorCriticPolicy._process_sequence(  # noqa: SLF001 - this replaces it
            features, states, episode_starts, lstm
        )
        return step_by_step
    kept = (1.0 - starts[:, 0]).view(1, count, 1)
    steps = features.reshape(count, -1, lstm.input_size).swapaxes(0, 1)
    said, behind = lstm(steps, (kept * states[0], kept * states[1]))
    return said.transpose(0, 1).flatten(0, 1), behind


class MemoryPolicy(RecurrentActorCriticPolicy):  # type: ignore[misc]  # it comes without types where it is not installed
    """A policy with a memory for observations that are one picture."""

    _process_sequence = staticmethod(run_lstm)


class MultiInputMemoryPolicy(RecurrentMultiInputActorCriticPolicy):  # type: ignore[misc]  # as above
    """A policy with a memory for observations of pictures and vectors."""

    _process_sequence = staticmethod(run_lstm)


WIDTH = 128
"""Number of features of a map; with a view of 100 pixels, a policy with a memory takes 4 MB."""


class MapFeatures(BaseFeaturesExtractor):  # type: ignore[misc]  # it comes without types where it is not installed
    """Converts observations (N, ...) to features (N, ``WIDTH`` for each picture plus the lengths of all vectors).

    Pictures (channels, rows, cols), with values from 0 to 1, each have their own convolutions; vectors are unchanged.
    """

    def __init__(self, space: spaces.Space[Any]) -> None:
        parts: dict[str, Any] = dict(space.spaces) if isinstance(space, spaces.Dict) else {"map": space}
        pictures = {name: part for name, part in parts.items() if is_image_space(part)}
        rest = [name for name in parts if name not in pictures]
        width = WIDTH * len(pictures) + sum(spaces.flatdim(parts[name]) for name in rest)
        super().__init__(space, width)
        self.eyes = nn.ModuleDict({name: _eye(part.shape) for name, part in pictures.items()})
        self.rest = rest
        self.is_bfloat16 = False

    def forward(self, observations: torch.Tensor | dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the features of observations."""
        parts = observations if isinstance(observations, dict) else {"map": observations}
        with torch.autocast(next(iter(parts.values())).device.type, torch.bfloat16, enabled=self.is_bfloat16):
            seen = [eye(parts[name]).float() for name, eye in self.eyes.items()]
        return torch.cat(seen + [parts[name].flatten(1) for name in self.rest], dim=1)


def _eye(shape: tuple[int, ...]) -> nn.Sequential:
    """Return convolutions for pictures of this shape, with smaller strides for small pictures."""
    channels, side = shape[0], min(shape[1:])
    if side >= 36:
        layers = [nn.Conv2d(channels, 32, 8, 4), nn.ReLU(), nn.Conv2d(32, 64, 4, 2), nn.ReLU(), nn.Conv2d(64, 64, 3)]
    else:
        layers = [nn.Conv2d(channels, 32, 3, 2, 1), nn.ReLU(), nn.Conv2d(32, 64, 3, 2, 1)]
    body = nn.Sequential(*layers, nn.ReLU(), nn.Flatten())
    with torch.no_grad():
        wide = body(torch.zeros(1, *shape)).shape[1]
    return nn.Sequential(body, nn.Linear(wide, WIDTH), nn.ReLU())


SET_WIDTH = 64
"""Width of the layers for frontiers."""
_FORBIDDEN = -1e8
"""Logit of an action that the mask does not allow."""


class SetFeatures(BaseFeaturesExtractor):  # type: ignore[misc]  # as above
    """Converts "frontiers" (N, K, 5) and "action_mask" (N, K) to logits (N, K), then (N, 2 * ``SET_WIDTH``) of all.

    Metres enter as their logarithm beside a direction, so that a house's size matters little. Logits of actions that
    the mask forbids are ``_FORBIDDEN``.
    """

    def __init__(self, space: spaces.Dict) -> None:
        self.number = spaces.flatdim(space["action_mask"])
        super().__init__(space, self.number + 2 * SET_WIDTH)
        self.each = nn.Sequential(nn.Linear(6, SET_WIDTH), nn.ReLU(), nn.Linear(SET_WIDTH, SET_WIDTH), nn.ReLU())
        self.rate = nn.Sequential(nn.Linear(3 * SET_WIDTH, SET_WIDTH), nn.ReLU(), nn.Linear(SET_WIDTH, 1))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the logits, and the features of the whole set."""
        ahead, left, way, length, valid = observations["frontiers"].unbind(dim=2)
        far = torch.hypot(ahead, left)
        near = far.clamp(min=1e-6)
        seen = torch.stack(
            [ahead / near, left / near, torch.log1p(far), torch.log1p(way), torch.log1p(length), valid], dim=2
        )
        there = valid.unsqueeze(2)
        one = self.each(seen) * there
        mean = one.sum(dim=1) / there.sum(dim=1).clamp(min=1.0)
        whole = torch.cat([mean, one.amax(dim=1)], dim=1)  # it is at least 0, as after a ReLU
        logits = self.rate(torch.cat([one, whole.unsqueeze(1).expand(-1, self.number, -1)], dim=2)).squeeze(2)
        return torch.cat([logits.masked_fill(observations["action_mask"] == 0, _FORBIDDEN), whole], dim=1)


class SetPolicy(MultiInputActorCriticPolicy):  # type: ignore[misc]  # as above
    """A policy for frontiers, which never chooses an action that its observation's mask forbids."""

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        number = self.features_extractor.number
        nn.init.orthogonal_(self.features_extractor.rate[-1].weight, gain=0.01)  # untrained, it rates all alike
        self.action_net = _Part(slice(None, number))
        self.value_net = nn.Sequential(
            _Part(slice(number, None)), nn.Linear(2 * SET_WIDTH, SET_WIDTH), nn.ReLU(), nn.Linear(SET_WIDTH, 1)
        )
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)


class _Part(nn.Module):  # type: ignore[misc]  # as above
    """Takes some of the features."""

    def __init__(self, part: slice) -> None:
        super().__init__()
        self.part = part

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        return features[:, self.part]


class MaskedFeatures(BaseFeaturesExtractor):  # type: ignore[misc]  # as above
    """Converts observations to the features of ``MapFeatures``, followed by their "action_mask"."""

    def __init__(self, space: spaces.Dict) -> None:
        rest = MapFeatures(spaces.Dict({name: part for name, part in space.items() if name != "action_mask"}))
        self.number = spaces.flatdim(space["action_mask"])
        super().__init__(space, rest.features_dim + self.number)
        self.seen = rest

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the features of observations, and their masks."""
        return torch.cat([self.seen(observations), observations["action_mask"].flatten(1)], dim=1)


class MaskedPolicy(MultiInputActorCriticPolicy):  # type: ignore[misc]  # as above
    """A policy that never chooses an action that its observation's mask forbids."""

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        number = self.features_extractor.number
        logits = nn.Linear(self.features_extractor.features_dim, number)
        nn.init.orthogonal_(logits.weight, gain=0.01)  # as Stable-Baselines3 does
        nn.init.zeros_(logits.bias)
        self.action_net = _Masked(logits, number)
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)


class _Masked(nn.Module):  # type: ignore[misc]  # as above
    """Converts features, of which the last are a mask, to logits that the mask allows."""

    def __init__(self, logits: nn.Module, number: int) -> None:
        super().__init__()
        self.logits, self.number = logits, number

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        forbidden = features[:, -self.number :] == 0
        found: torch.Tensor = self.logits(features).masked_fill(forbidden, _FORBIDDEN)
        return found


Learner: TypeAlias = PPO | RecurrentPPO
Policy: TypeAlias = ActorCriticPolicy | MemoryPolicy | MultiInputMemoryPolicy


class ActionLog(VecEnvWrapper):  # type: ignore[misc]  # as above
    """Environments that remember the actions since they were reset (``checkpoints``).

    ``begun_at`` is the learner's number of steps at that time.
    """

    def __init__(self, envs: VecEnv) -> None:
        super().__init__(envs)
        self.begun_at, self.actions = 0, list[Any]()

    def reset(self) -> Any:
        """Start episodes in all environments, and forget the actions."""
        self.actions = []
        return self.venv.reset()

    def step_async(self, actions: Any) -> None:
        """Take one action in each environment."""
        self.actions.append(np.array(actions))
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """Return what the actions led to."""
        return self.venv.step_wait()


def wrap_for_learner(envs: PseudoSlamVectorEnv, config: TrainConfig) -> VecNormalize:
    """Return environments for the learner; returns are recorded before rewards are normalised. Actions are logged."""
    ppo = config.ppo
    return VecNormalize(
        VecMonitor(ActionLog(SB3VecEnv(envs))), norm_obs=False, norm_reward=ppo.normalise_rewards, gamma=ppo.gamma
    )


def new_learner(envs: VecNormalize, config: TrainConfig) -> Learner:
    """Return an untrained learner, on CUDA if available."""
    ppo = config.ppo
    make = RecurrentPPO if config.policy == "cnn-lstm" else PPO
    learner: Learner = make(
        choose_policy_class(envs.observation_space, config),
        envs,
        learning_rate=ppo.learning_rate,
        n_steps=ppo.rollout_steps,
        batch_size=min(ppo.minibatch, config.steps_per_update),
        n_epochs=ppo.epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip,
        ent_coef=ppo.entropy,
        vf_coef=ppo.value,
        max_grad_norm=ppo.max_grad_norm,
        policy_kwargs=_shape(config),
        seed=config.seed,
        device="cuda" if torch.cuda.is_available() else "cpu",
    )
    if ppo.precision == "bfloat16":
        learner.policy.to(memory_format=torch.channels_last)  # in which convolutions are faster
        for part in learner.policy.modules():
            if isinstance(part, MapFeatures):
                part.is_bfloat16 = True
    return learner


def new_policy(seen: spaces.Space[Any], actions: spaces.Space[Any], config: TrainConfig) -> Policy:
    """Return a policy for these spaces on the CPU, before its weights are loaded."""
    policy: Policy = choose_policy_class(seen, config)(
        seen, actions, lambda _: config.ppo.learning_rate, **_shape(config)
    )
    return policy


def choose_policy_class(
    seen: spaces.Space[Any], config: TrainConfig
) -> Any:  # a class of policies, from libraries without types
    """Return the class of policies for such observations."""
    if config.policy == "set":
        return SetPolicy
    if config.environment.action_mask:
        return MaskedPolicy
    several = isinstance(seen, spaces.Dict)
    if config.policy == "cnn-lstm":
        return MultiInputMemoryPolicy if several else MemoryPolicy
    return MultiInputActorCriticPolicy if several else ActorCriticPolicy


def _shape(config: TrainConfig) -> dict[str, Any]:
    """Return the architecture: one feature network, and no layers between it (or the memory) and the heads."""
    features = SetFeatures if config.policy == "set" else MapFeatures
    shape: dict[str, Any] = {
        "features_extractor_class": MaskedFeatures if config.environment.action_mask else features,
        "net_arch": {"pi": [], "vf": []},
        "activation_fn": torch.nn.ReLU,
        "optimizer_kwargs": {"eps": 1e-5},
    }
    return {**shape, "lstm_hidden_size": config.memory} if config.policy == "cnn-lstm" else shape
