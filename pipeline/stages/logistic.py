"""Load the logistic models of ``weights.toml``: each gives a probability from named features.

A model is a bias and one weight for each feature::

    probability = 1 / (1 + exp(-(bias + sum of weight * feature)))

Each feature is between 0 and 1, and 0 where nothing is special. ``python -m research.weights_fit`` writes the file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class LogisticModel:
    """A logistic model: ``bias``, and the weight of each feature by its name."""

    bias: float
    weights: Mapping[str, float]

    def log_odds(self, features: Mapping[str, Any]) -> Any:
        """Return the logarithm of the odds; features without a weight say nothing. A feature may be an array (n,)."""
        return self.bias + sum(weight * features.get(name, 0.0) for name, weight in self.weights.items())

    def doubt(self, features: Mapping[str, npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
        """Return how far probabilities (n,) lie below that of no features at all, as a share of it, in two digits."""
        usual = 1 / (1 + np.exp(-self.bias))
        found = 1 / (1 + np.exp(-self.log_odds(features)))
        return np.asarray(np.round(np.clip(1.0 - found / usual, 0.0, 1.0), 2))

    def confidence(self, features: Mapping[str, float]) -> float:
        """Return the probability, 0 to 1, in two digits."""
        return round(float(1 / (1 + np.exp(-self.log_odds(features)))), 2)


@cache
def load_models() -> Mapping[str, LogisticModel]:
    """Return the models of ``weights.toml`` by name."""
    text = resources.files("pipeline.stages").joinpath("weights.toml").read_text(encoding="utf-8")
    return {name: LogisticModel(table["bias"], table["weights"]) for name, table in tomllib.loads(text).items()}
