"""Read the file of a trained policy, and let it act: ``policy.pt`` by PyTorch, ``policy.onnx`` by ONNX Runtime.

Random actions are drawn by NumPy, so that a seed gives the same actions whatever computes the network.
"""

from __future__ import annotations

import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from gymnasium import spaces

from houseexpo.configuration import config_from_mapping
from houseexpo.errors import ConfigError, PolicyError, TrainingError
from houseexpo.files import read_file
from houseexpo.pseudoslam.learning import need_extra
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.environments import make_environments
from houseexpo.pseudoslam.learning.signature import MEMORY, PICTURE, Array, make_inputs
from houseexpo.pseudoslam.tasks import ROOM

ONNX: Final = ".onnx"
"""The suffix of files for ONNX Runtime; all others are PyTorch's."""
DAMAGED: Final = (
    ArithmeticError, AttributeError, EOFError, LookupError, RuntimeError, TypeError, ValueError,
    msgspec.DecodeError, pickle.UnpicklingError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""They are of many kinds, since damage may be found by PyTorch, pickle or zipfile."""
_LARGEST: Final = {ONNX: 256 << 20, ".pt": 4 << 30}
"""Largest size of a file that is read, bytes. Networks of ``houseexpo train`` have a few MB."""


def describe_damage(error: Exception) -> str:
    """Return a one-line description of a file's damage, without PyTorch's advice to load pickles with their code."""
    return "its pickle is broken" if isinstance(error, pickle.UnpicklingError) else str(error).partition("\n")[0]


@dataclass(frozen=True)
class TrainedPolicy:
    """A trained policy.

    Parameters
    ----------
    about
        The contents of ``policy.json``: task, configuration, seed, steps, plans, versions, scores.
    network
        A function of inputs by their names that returns the outputs in their order (``signature``).
    """

    about: dict[str, Any]
    config: TrainConfig
    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any]
    network: Callable[[dict[str, Array]], list[Array]]

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
        self._network, self._space = trained.network, trained.action_space
        self._deterministic = trained.config.evaluation.deterministic if deterministic is None else deterministic
        self._inputs = make_inputs(trained.observation_space, trained.config)
        self._rng = np.random.default_rng(seed)

    def __call__(self, observation: Array | dict[str, Array], _info: object = None) -> Any:
        """Return an action of the environment for an observation; raise PolicyError if a number is not finite."""
        seen = observation if isinstance(observation, dict) else {PICTURE: observation}
        for name in self._inputs.keys() - MEMORY:
            self._inputs[name] = np.asarray(seen[name], self._inputs[name].dtype)[np.newaxis]
        found = self._network(self._inputs)
        if not np.isfinite(found[0]).all():
            raise PolicyError(f"expected finite numbers from the network, found {found[0].tolist()}")
        if MEMORY[0] in self._inputs:
            self._inputs.update(zip(MEMORY, found[-len(MEMORY) :], strict=True))
        return self._draw(*(each[0].astype(np.float64) for each in found))

    def _draw(self, first: Array, *rest: Array) -> Any:
        """Return the most likely action or, unless deterministic, a random one."""
        if isinstance(self._space, spaces.Discrete):
            chance = 0.0 if self._deterministic else self._rng.gumbel(size=first.shape)  # the largest is a draw
            return np.argmax(first + chance)
        box = self._space
        assert isinstance(box, spaces.Box)  # noqa: S101  # as all other actions are
        chance = 0.0 if self._deterministic else np.exp(rest[0]) * self._rng.standard_normal(first.shape)
        return np.clip((first + chance).reshape(box.shape), box.low, box.high).astype(box.dtype)


def read_policy(file: Path, task: str | None = None) -> TrainedPolicy:
    """Return a policy; raise TrainingError if the file is not a policy, is damaged, or is for another task.

    No code in the file is executed, and no other file is read.

    Raises
    ------
    MissingDependencyError
        What computes such a file is not installed.
    """
    if file.suffix == ONNX:
        need_extra("onnx", str(file))
        from houseexpo.pseudoslam.learning import onnx_network as computed_by
    else:
        need_extra("learn", str(file))
        from houseexpo.pseudoslam.learning import torch_network as computed_by  # type: ignore[no-redef]
    try:
        packed, content = computed_by.unpack(read_file(file, _LARGEST.get(file.suffix, _LARGEST[".pt"])))
        about = msgspec.json.decode(packed, type=dict[str, Any])
        config, its_task = config_from_mapping(TrainConfig, about["config"]), about["task"]
        if task is not None and its_task != task:
            raise TrainingError(f"{file}: expected a policy for {task}, found one for {its_task}")
        envs = make_environments(its_task, config.environment, ROOM, number=1, threads=1)  # for its spaces
        seen, actions = envs.single_observation_space, envs.single_action_space
        envs.close()
        network = computed_by.make_network(content, seen, actions, config)
    except OSError as error:
        raise TrainingError(f"{file}: expected a policy, cannot be read: {error.strerror}") from None
    except (*DAMAGED, ConfigError) as error:
        raise TrainingError(
            f"{file}: expected a policy of houseexpo train, found none ({describe_damage(error)})"
        ) from None
    return TrainedPolicy(about, config, seen, actions, network)
