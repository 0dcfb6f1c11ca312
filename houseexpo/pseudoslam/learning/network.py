"""The feature network of a policy: convolutions over the maps, next to the other observations."""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

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

    def forward(self, observations: torch.Tensor | dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the features of observations."""
        parts = observations if isinstance(observations, dict) else {"map": observations}
        seen = [eye(parts[name]) for name, eye in self.eyes.items()]
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
