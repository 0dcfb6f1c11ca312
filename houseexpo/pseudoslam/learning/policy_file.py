"""Write a trained policy to ``policy.pt`` and its description to ``policy.json`` beside it; read it and let it act."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3.common.distributions import Distribution

from houseexpo.configuration import config_from_mapping
from houseexpo.errors import ConfigError, TrainingError
from houseexpo.files import encode_json, read_file, write_atomically
from houseexpo.pseudoslam.learning.checkpoints import DAMAGED, describe_damage
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.environments import make_environments
from houseexpo.pseudoslam.learning.model import Policy, States, new_policy
from houseexpo.pseudoslam.tasks import ROOM

FORMAT: Final = 1
_LARGEST: Final = 4 << 30
"""Largest size of a file that is read, bytes."""


@dataclass(frozen=True)
class TrainedPolicy:
    """A trained policy.

    Parameters
    ----------
    about
        The contents of ``policy.json``: task, configuration, seed, steps, plans, versions, scores.
    """

    about: dict[str, Any]
    config: TrainConfig
    policy: Policy

    @property
    def task(self) -> str:
        """The task of the training."""
        return str(self.about["task"])


class EpisodeActor:
    """A policy with its memory for one episode; each episode needs a new one.

    Parameters
    ----------
    seed
        The seed of random actions.
    """

    def __init__(self, trained: TrainedPolicy, seed: int = 0, *, deterministic: bool | None = None) -> None:
        self._policy = trained.policy
        self._deterministic = trained.config.evaluation.deterministic if deterministic is None else deterministic
        self._remembers = trained.config.policy == "cnn-lstm"
        self._memory: States | None = None
        self._chance = torch.Generator().manual_seed(seed).get_state()

    def __call__(self, observation: npt.NDArray[Any] | dict[str, Any], _info: object = None) -> Any:
        """Return an action of the environment for an observation."""
        with torch.inference_mode(), torch.random.fork_rng(devices=[]), _without_onednn():  # keep torch's state
            torch.set_rng_state(self._chance)
            actions = self._distribution(observation).get_actions(deterministic=self._deterministic).numpy()
            self._chance = torch.get_rng_state()
        space = self._policy.action_space
        if isinstance(space, spaces.Box):  # random actions may lie outside
            actions = np.clip(actions, space.low, space.high)
        return actions.reshape(-1, *space.shape)[0]

    def _distribution(self, observation: npt.NDArray[Any] | dict[str, Any]) -> Distribution:
        """Return the distribution of actions, and update the memory.

        The policy's ``predict`` does the same but sets the mode of all layers first, which takes half of the time.
        """
        seen, _ = self._policy.obs_to_tensor(observation)
        if not self._remembers:
            return self._policy.get_distribution(seen)
        began = torch.full((1,), float(self._memory is None))
        if self._memory is None:
            nothing = torch.zeros(self._policy.lstm_hidden_state_shape)
            self._memory = (nothing, nothing)
        likely, self._memory = self._policy.get_distribution(seen, self._memory, began)
        return likely


def write_policy(file: Path, policy: Policy, about: dict[str, Any]) -> None:
    """Write a policy, and its description to a ``.json`` file beside it."""
    weights = {name: value.detach().cpu() for name, value in policy.state_dict().items()}
    packed = io.BytesIO()
    torch.save({"format": FORMAT, "about": encode_json(about).decode(), "weights": weights}, packed)
    write_atomically(file, packed.getvalue(), durable=True)
    write_atomically(file.with_suffix(".json"), encode_json(about), durable=True)


def read_policy(file: Path, task: str | None = None) -> TrainedPolicy:
    """Return a policy; raise TrainingError if the file is not a policy, is damaged, or is for another task.

    No code in the file is executed.
    """
    try:
        found = torch.load(io.BytesIO(read_file(file, _LARGEST)), map_location="cpu", weights_only=True)
        if found["format"] != FORMAT:
            raise TrainingError(f"{file}: expected a policy of format {FORMAT}, found {found['format']!r}")
        about = msgspec.json.decode(found["about"], type=dict[str, Any])
        config, its_task = config_from_mapping(TrainConfig, about["config"]), about["task"]
        if task is not None and its_task != task:
            raise TrainingError(f"{file}: expected a policy for {task}, found one for {its_task}")
        envs = make_environments(its_task, config.environment, ROOM, number=1, threads=1)  # for its spaces
        policy = new_policy(envs.single_observation_space, envs.single_action_space, config)
        envs.close()
        policy.load_state_dict(found["weights"])
    except OSError as error:
        raise TrainingError(f"{file}: expected a policy, cannot be read: {error.strerror}") from None
    except (*DAMAGED, ConfigError) as error:
        raise TrainingError(
            f"{file}: expected a policy of houseexpo train, found none ({describe_damage(error)})"
        ) from None
    policy.set_training_mode(False)
    return TrainedPolicy(about, config, policy)


@contextmanager
def _without_onednn() -> Iterator[None]:
    """Disable oneDNN, whose preparation takes 0.3 ms for a small picture, and restore it afterwards.

    ``torch.backends.mkldnn.flags`` does the same but gives a warning about a feature of Intel's GPUs.
    """
    was = torch.backends.mkldnn.enabled
    torch.backends.mkldnn.enabled = False
    try:
        yield
    finally:
        torch.backends.mkldnn.enabled = was
