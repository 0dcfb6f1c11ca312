"""Make the learner from a configuration: PPO of Stable-Baselines3, or that of sb3-contrib with a memory."""

from __future__ import annotations

from typing import Any, TypeAlias

import torch
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy, MultiInputActorCriticPolicy
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from houseexpo.pseudoslam.envs.sb3 import SB3VecEnv
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.memory import MemoryPolicy, MultiInputMemoryPolicy
from houseexpo.pseudoslam.learning.network import MapFeatures

Learner: TypeAlias = PPO | RecurrentPPO
Policy: TypeAlias = ActorCriticPolicy | MemoryPolicy | MultiInputMemoryPolicy


def wrapped(envs: PseudoSlamVectorEnv, config: TrainConfig) -> VecNormalize:
    """Return environments for the learner; returns are recorded before rewards are normalised."""
    ppo = config.ppo
    return VecNormalize(VecMonitor(SB3VecEnv(envs)), norm_obs=False, norm_reward=ppo.normalise_rewards, gamma=ppo.gamma)


def new_learner(envs: VecNormalize, config: TrainConfig) -> Learner:
    """Return an untrained learner, on CUDA if available."""
    ppo = config.ppo
    make = RecurrentPPO if config.policy == "cnn-lstm" else PPO
    learner: Learner = make(
        policy_class(envs.observation_space, config),
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
    return learner


def new_policy(seen: spaces.Space[Any], actions: spaces.Space[Any], config: TrainConfig) -> Policy:
    """Return a policy for these spaces on the CPU, before its weights are loaded."""
    policy: Policy = policy_class(seen, config)(seen, actions, lambda _: config.ppo.learning_rate, **_shape(config))
    return policy


def policy_class(
    seen: spaces.Space[Any], config: TrainConfig
) -> Any:  # a class of policies, from libraries without types
    """Return the class of policies for such observations."""
    several = isinstance(seen, spaces.Dict)
    if config.policy == "cnn-lstm":
        return MultiInputMemoryPolicy if several else MemoryPolicy
    return MultiInputActorCriticPolicy if several else ActorCriticPolicy


def _shape(config: TrainConfig) -> dict[str, Any]:
    """Return the architecture: one feature network, and no layers between it (or the memory) and the heads."""
    shape: dict[str, Any] = {
        "features_extractor_class": MapFeatures,
        "net_arch": {"pi": [], "vf": []},
        "activation_fn": torch.nn.ReLU,
        "optimizer_kwargs": {"eps": 1e-5},
    }
    return {**shape, "lstm_hidden_size": config.memory} if config.policy == "cnn-lstm" else shape
