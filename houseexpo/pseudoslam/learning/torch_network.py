"""Write a policy and its network to ``policy.pt``, and compute the network by PyTorch."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import torch
from gymnasium import spaces
from stable_baselines3.common.preprocessing import preprocess_obs
from torch import nn

from houseexpo.files import encode_json, write_atomically
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.model import Policy, new_policy
from houseexpo.pseudoslam.learning.signature import MEMORY, PICTURE, Array, make_inputs

FORMAT: Final = 1


def write_policy(file: Path, policy: Policy, about: dict[str, Any]) -> None:
    """Write a policy, and its description to a ``.json`` file beside it."""
    weights = {name: value.detach().cpu() for name, value in policy.state_dict().items()}
    packed = io.BytesIO()
    torch.save({"format": FORMAT, "about": encode_json(about).decode(), "weights": weights}, packed)
    write_atomically(file, packed.getvalue(), durable=True)
    write_atomically(file.with_suffix(".json"), encode_json(about), durable=True)


def unpack(data: bytes) -> tuple[str, dict[str, torch.Tensor]]:
    """Return the description (JSON) and the weights of a file's content; raise an exception if they are not there."""
    found = torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
    if found["format"] != FORMAT:
        raise ValueError(f"expected format {FORMAT}, found {found['format']!r}")
    return found["about"], found["weights"]


def make_network(
    weights: dict[str, torch.Tensor], seen: spaces.Space[Any], actions: spaces.Space[Any], config: TrainConfig
) -> TorchNetwork:
    """Return the network with these weights; PyTorch then uses one thread, since a decision is too little work."""
    policy = new_policy(seen, actions, config)
    policy.load_state_dict(weights)
    policy.set_training_mode(False)
    torch.set_num_threads(1)
    return TorchNetwork(policy, list(make_inputs(seen, config)))


class TorchNetwork:
    """A network that PyTorch computes: inputs by their names to outputs in their order (``signature``)."""

    def __init__(self, policy: Policy, names: list[str]) -> None:
        self.policy, self.names = policy, names
        self.module = _ActingModule(policy, names)

    def __call__(self, inputs: dict[str, Array]) -> list[Array]:
        """Return the outputs."""
        with torch.inference_mode(), _without_onednn():
            found = self.module(*(torch.as_tensor(inputs[name]) for name in self.names))
        return [each.detach().numpy() for each in found]  # log_std is a weight


class _ActingModule(nn.Module):  # type: ignore[misc]  # it comes without types where it is not installed
    """The part of a policy that acts, without what only learning needs; tensors in and out, as ONNX has it."""

    def __init__(self, policy: Policy, names: list[str]) -> None:
        super().__init__()
        self.policy, self.names = policy, names

    def forward(self, *inputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return the parameters of the distribution of actions, and the memory for the next step."""
        policy, given = self.policy, dict(zip(self.names, inputs, strict=True))
        memory = tuple(given.pop(name) for name in MEMORY if name in given)
        seen = given if isinstance(policy.observation_space, spaces.Dict) else given[PICTURE]
        seen = preprocess_obs(seen, policy.observation_space, normalize_images=policy.normalize_images)
        features = policy.pi_features_extractor(seen)
        if memory:
            features, memory = policy.lstm_actor(features.unsqueeze(0), memory)
            features = features.squeeze(0)
        found = policy.action_net(policy.mlp_extractor.forward_actor(features))
        if isinstance(policy.action_space, spaces.Discrete):
            return (found, *memory)
        return (found, policy.log_std.expand_as(found), *memory)


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
