"""Read and write the weights of a chooser of frontiers, a JSON file that also describes their training."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.files import encode_json, read_json, write_atomically
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES
from houseexpo.pseudoslam.kernels.types import Floats

FORMAT: Final = "houseexpo chooser 2"


class Weights(msgspec.Struct, frozen=True):
    """The contents of a file of weights.

    Parameters
    ----------
    about
        The command, the seed, the commit, and the results of the training.
    weights
        The weights by the names of features, ``FEATURES``; missing ones are 0.
    """

    format: str
    about: dict[str, Any]
    weights: dict[str, float]


def make_weights(**weights: float) -> Floats:
    """Return weights with some features given and the others 0; ``_`` in a name stands for a space."""
    return _in_order({name.replace("_", " "): weight for name, weight in weights.items()})


def round_weights(weights: Floats) -> Floats:
    """Return weights rounded to six digits, which are equal after writing and reading."""
    return np.array([float(f"{value:.6g}") for value in weights])


def write_weights(file: Path, weights: Floats, about: dict[str, Any]) -> None:
    """Write weights, to six digits."""
    named = {name: value for name, value in zip(FEATURES, round_weights(weights).tolist(), strict=True) if value}
    write_atomically(file, encode_json(Weights(FORMAT, about, named)), durable=True)


def read_weights(file: Path) -> tuple[Floats, dict[str, Any]]:
    """Return weights and their description; raise ConfigError if a file has none, or has those of other features."""
    try:
        head = read_json(file, object)
        if isinstance(head, dict) and head.get("format") != FORMAT:
            raise ConfigError(f"{file}: expected {FORMAT!r}, found {head.get('format')!r}; train it again")
        found = msgspec.convert(head, Weights)
    except OSError as error:
        raise ConfigError(f"{file}: expected weights, cannot be read: {error.strerror}") from None
    except msgspec.MsgspecError as error:
        raise ConfigError(f"{file}: expected weights of `houseexpo train chooser`, found none ({error})") from None
    unknown = sorted(set(found.weights) - set(FEATURES))
    if unknown:
        raise ConfigError(f"{file}: expected weights of {', '.join(FEATURES)}; found one of {unknown[0]!r}")
    for name, value in found.weights.items():
        if not math.isfinite(value):
            raise ConfigError(f"{file}: {name}: expected a finite number, found {value}")
    return _in_order(found.weights), found.about


def _in_order(weights: dict[str, float]) -> Floats:
    ordered = np.zeros(len(FEATURES))
    for name, value in weights.items():
        ordered[FEATURES.index(name)] = value
    return ordered
