"""Load and write logistic models: each gives a probability from named features.

A model is a bias and one weight for each feature::

    probability = 1 / (1 + exp(-(bias + sum of weight * feature)))

Each feature is between 0 and 1, and 0 where nothing is special. ``python -m research.weights_fit`` writes
``weights.toml``, the models that the program comes with. ``houseexpo fit`` writes a file with those of them that a
person's own labels make better (``pipeline.fitting``); such a file has no features but those of ``weights.toml``, so
one that was fitted for other features is refused.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import mapping_entries, name_in_config_errors, read_toml
from houseexpo.errors import ConfigError

WEIGHTS: Final = Path(__file__).with_name("weights.toml")
FITTED: Final = ("space", "door", "entrance", "room")
"""The models that rate parts of a plan, by the names of these parts; only they are fitted on a person's labels."""
_KEYS: Final = ("bias", "weights")


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


Models: TypeAlias = Mapping[str, LogisticModel]
"""Models by their names."""


@cache
def load_models() -> Models:
    """Return the models of ``weights.toml`` by name."""
    tables = tomllib.loads(WEIGHTS.read_text(encoding="utf-8"))
    return {name: LogisticModel(table["bias"], table["weights"]) for name, table in tables.items()}


def models_with(own: Models) -> Models:
    """Return the models of ``weights.toml`` with a person's own in place of those of the same names."""
    return {**load_models(), **own}


def read_model_weights(file: Path) -> Models:
    """Return the models in a file that ``houseexpo fit`` wrote.

    Raises
    ------
    ConfigError
        The file cannot be read, or holds no model, an unknown one, a feature that this version does not weigh, or a
        weight that is no finite number.
    """
    tables = read_toml(file)
    with name_in_config_errors(file):
        if not tables:
            raise ConfigError(f"expected one of the tables {', '.join(FITTED)}; found none; houseexpo fit writes them")
        return {name: _checked_model(name, table) for name, table in mapping_entries(tables, "", FITTED)}


def _checked_model(name: str, table: object) -> LogisticModel:
    found = dict(mapping_entries(table, name, _KEYS))
    if missing := [key for key in _KEYS if key not in found]:
        raise ConfigError(f"{name}.{missing[0]}: expected a value, found none; fit the weights again: houseexpo fit")
    known = load_models()[name].weights
    weights = found["weights"]
    if isinstance(weights, Mapping) and (others := sorted(set(weights) - set(known))):
        raise ConfigError(
            f"{name}.weights.{others[0]}: this version weighs no such feature, so the weights are of another one; fit "
            "them again: houseexpo fit"
        )
    entries = mapping_entries(weights, f"{name}.weights", known)
    return LogisticModel(
        _checked_number(f"{name}.bias", found["bias"]),
        {feature: _checked_number(f"{name}.weights.{feature}", weight) for feature, weight in entries},
    )


def _checked_number(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ConfigError(f"{key} = {value!r}: expected a finite number")
    return float(value)


def source_of(models: Models, heading: str) -> str:
    """Return the text of a file of models; each line of ``heading`` becomes a comment at its begin."""
    lines = [*(f"# {line}".rstrip() for line in heading.splitlines()), ""]
    for name, model in models.items():
        lines += [f"[{name}]", f"bias = {model.bias}", f"[{name}.weights]"]
        lines += [f"{feature} = {weight}" for feature, weight in sorted(model.weights.items())] + [""]
    return "\n".join(lines[:-1]) + "\n"
