"""Weights of a chooser of frontiers: a JSON file with what made them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.files import as_json, write_whole
from houseexpo.pseudoslam.kernels.planning.outlook import OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.scoring import Scorer

FORMAT: Final = "houseexpo chooser 1"


class Weights(msgspec.Struct, frozen=True):
    """What a file holds.

    Parameters
    ----------
    about
        The command, the seed, the commit, and what it came to.
    outlooks
        What the numbers are that are weighed, in order.
    scorer
        The arrays of ``Scorer``, by name.
    """

    format: str
    about: dict[str, Any]
    outlooks: list[str]
    scorer: dict[str, Any]


def write_weights(file: Path, scorer: Scorer, about: dict[str, Any]) -> None:
    """Write weights, to six digits: ``rounded`` ones are read back as they were."""
    arrays = {name: array.tolist() for name, array in zip(Scorer._fields, scorer, strict=True)}
    write_whole(file, as_json(Weights(FORMAT, about, list(OUTLOOKS), arrays)), durable=True)


def rounded(scorer: Scorer) -> Scorer:
    """Return weights of six digits."""
    return Scorer(*(np.array([float(f"{value:.6g}") for value in part.ravel()]).reshape(part.shape) for part in scorer))


def read_weights(file: Path) -> tuple[Scorer, dict[str, Any]]:
    """Return weights, and what made them; ConfigError where a file holds none, or of other numbers."""
    try:
        found = msgspec.json.decode(file.read_bytes(), type=Weights)
        if found.format != FORMAT:
            raise ConfigError(f"{file}: expected {FORMAT!r}, found {found.format!r}")
        scorer = Scorer(*(np.array(found.scorer[name], np.float64) for name in Scorer._fields))
    except OSError as error:
        raise ConfigError(f"{file}: expected weights, cannot be read: {error.strerror}") from None
    except (msgspec.DecodeError, KeyError, TypeError, ValueError) as error:
        raise ConfigError(f"{file}: expected weights of `houseexpo train chooser`, found none ({error})") from None
    if found.outlooks != list(OUTLOOKS):
        raise ConfigError(f"{file}: expected weights of the numbers {', '.join(OUTLOOKS)}; train it again")
    _check(scorer, file)
    return scorer, found.about


def _check(scorer: Scorer, file: Path) -> None:
    numbers, inner, last = len(OUTLOOKS), scorer.first_bias.size, scorer.second_bias.size
    shapes = ((numbers,), (inner, numbers), (inner,), (last, inner), (last,), (last,))  # as the fields come
    for name, shape, array in zip(Scorer._fields, shapes, scorer, strict=True):
        if array.shape != shape:
            raise ConfigError(f"{file}: {name}: expected an array of shape {shape}, found {array.shape}")
        if not math.isfinite(float(array.sum())):
            raise ConfigError(f"{file}: {name}: expected finite numbers")
