"""Name the inputs and outputs of a policy's network, the same for PyTorch and for ONNX Runtime.

Inputs are the parts of an observation, as the environment returns them, and the memory if the policy has one. Outputs
are the parameters of the distribution of actions, and the memory for the next step. All have N rows, one for each
robot; those of the memory are (1, N, size).
"""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.pseudoslam.learning.config import TrainConfig

Array: TypeAlias = npt.NDArray[Any]
PICTURE: Final = "map"
"""The name of an observation that is one picture."""
MEMORY: Final = ("memory_h", "memory_c")
"""The states of the memory, zeros at the start of an episode; as outputs they are called ``next_memory_h``, ..."""


def make_inputs(seen: spaces.Space[Any], config: TrainConfig) -> dict[str, Array]:
    """Return zeros of the shapes and types of the inputs, with N = 1, in the order of the network.

    The network "set" looks at no picture.
    """
    parts = dict(seen.spaces) if isinstance(seen, spaces.Dict) else {PICTURE: seen}
    if config.policy == "set":
        del parts[PICTURE]
    zeros = {name: np.zeros((1, *(part.shape or ())), part.dtype) for name, part in parts.items()}
    return {**zeros, **{name: np.zeros(_memory_shape(config), np.float32) for name in _memory_names(config)}}


def output_shapes(actions: spaces.Space[Any], config: TrainConfig) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the outputs, all float32, with N = 1, in the order of the network.

    A choice has "logits" (N, choices), not normalised; continuous actions have "mean" and "log_std" (N, numbers) of
    independent normal distributions.
    """
    if isinstance(actions, spaces.Discrete):
        shapes = {"logits": (1, int(actions.n))}
    else:
        shapes = {name: (1, spaces.flatdim(actions)) for name in ("mean", "log_std")}
    return {**shapes, **{f"next_{name}": _memory_shape(config) for name in _memory_names(config)}}


def _memory_names(config: TrainConfig) -> tuple[str, ...]:
    return MEMORY if config.policy == "cnn-lstm" else ()


def _memory_shape(config: TrainConfig) -> tuple[int, ...]:
    return (1, 1, config.memory)
