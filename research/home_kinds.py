"""Kinds of houses, for the table that homes are drawn from: what labels, and what doors, go together.

A latent class model: each house is of one kind, and what it has is drawn from the shares of that kind. The shares are
found by expectation and maximisation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from pipeline.sources.homes.wishes import STRATA

SEED, ROUNDS = 17, 100
HOUSE_KINDS, DOOR_KINDS = 40, 32
MAX_OF_ONE = 8
"""A house has so many rooms of one label at most, in the table."""
NARROWEST_M = 0.5
PRIOR = 2.0
"""So many houses of the usual sort stand beside those of each kind, so that no kind is a single house."""
LEAST_SHARE = 5e-5
OF_ALL = 20.0
"""As many houses speak for covariances like those of all."""
Floats: TypeAlias = npt.NDArray[np.float64]
Places: TypeAlias = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class DoorKinds:
    """What the table keeps of doors, and how likely each house's are of each kind, (houses, kinds)."""

    table: dict[str, object]
    likely: Floats


def house_kinds(
    labels: Sequence[Mapping[str, int]], scores: Floats, strata: Places, doors: Floats
) -> dict[str, object]:
    """Return the kinds' shares in each stratum; of each label and kind how often a house has it 0, 1, 2 ... times.

    Also of each kind the means and covariances of the normal ``scores`` (houses, numbers), and how much more often than
    elsewhere its houses have doors of each kind (``doors``: houses, kinds of doors).
    """
    words = sorted({word for house in labels for word in house})
    times = np.array([[min(house.get(word, 0), MAX_OF_ONE) for word in words] for house in labels])
    had = (times[:, :, None] == np.arange(MAX_OF_ONE + 1)).reshape(len(labels), -1).astype(np.float64)
    found = kinds(had, strata, HOUSE_KINDS, scores)
    rows = found.has.reshape(HOUSE_KINDS, len(words), -1)
    rows = (rows / rows.sum(axis=2, keepdims=True)).round(4)
    some = doors.any(axis=1)
    together = found.likely[some].T @ doors[some] + PRIOR * doors[some].mean(axis=0)
    together /= together.sum(axis=1, keepdims=True)
    return {
        "of_stratum": found.shares.round(4).tolist(),
        "labels": {word: rows[:, k].tolist() for k, word in enumerate(words)},
        "means": found.means.round(3).tolist(),
        "covariances": found.covariances.round(3).tolist(),
        "doors": (together / doors[some].mean(axis=0)).round(3).tolist(),
    }


def door_kinds(houses: Sequence[Sequence[float]], strata: Places) -> DoorKinds:
    """Return the widths of doors, of each stratum the kinds' shares, and of each kind [place of a width, its share]."""
    centimetres = [[round(width * 100) for width in house if width >= NARROWEST_M] for house in houses]
    known = sorted({width for house in centimetres for width in house})
    place = {width: k for k, width in enumerate(known)}
    had = np.zeros((len(houses), len(known)))
    for row, house in zip(had, centimetres, strict=True):
        np.add.at(row, [place[width] for width in house], 1.0)
    some = had.any(axis=1)
    found = kinds(had[some], strata[some], DOOR_KINDS)
    likely = np.zeros((len(houses), DOOR_KINDS))
    likely[some] = found.likely
    return DoorKinds(
        {
            "widths_m": [width / 100 for width in known],
            "of_stratum": found.shares.round(4).tolist(),
            "doors": [
                [[k, round(float(share), 5)] for k, share in enumerate(row) if share >= LEAST_SHARE]
                for row in found.has / found.has.sum(axis=1, keepdims=True)
            ],
        },
        likely,
    )


@dataclass(frozen=True, eq=False)
class Kinds:
    """The shares of the kinds in each stratum (strata, kinds), how likely each house is of each (houses, kinds).

    What each kind has (kinds, things); the means and covariances of its scores.
    """

    shares: Floats
    likely: Floats
    has: Floats
    means: Floats
    covariances: Floats


def kinds(had: Floats, strata: Places, count: int, scores: Floats | None = None) -> Kinds:
    """Find kinds by what each house has how often, ``had`` (houses, things), and by its normal ``scores``."""
    rng = np.random.default_rng(SEED)
    scores = np.zeros((len(had), 0)) if scores is None else scores
    first = rng.choice(len(had), count, replace=False)
    usual, alike = had.mean(axis=0) + 1e-9, np.atleast_2d(np.cov(scores.T)) if scores.size else np.zeros((0, 0))
    has, means = had[first] + usual, scores[first]
    covariances = np.repeat(alike[None], count, axis=0)
    shares = np.full((len(STRATA), count), 1.0 / count)
    for _ in range(ROUNDS):
        logs = had @ np.log(has / has.sum(axis=1, keepdims=True)).T + np.log(shares)[strata]
        for k in range(count if scores.size else 0):
            off = scores - means[k]
            logs[:, k] -= 0.5 * ((off @ np.linalg.inv(covariances[k])) * off).sum(axis=1)
            logs[:, k] -= 0.5 * np.linalg.slogdet(covariances[k])[1]
        likely = np.exp(logs - logs.max(axis=1, keepdims=True))
        likely /= likely.sum(axis=1, keepdims=True)
        everywhere, houses = likely.mean(axis=0), likely.sum(axis=0)
        for k in range(len(STRATA)):
            shares[k] = likely[strata == k].sum(axis=0) + PRIOR * everywhere + 1e-9
        shares /= shares.sum(axis=1, keepdims=True)
        has = likely.T @ had + PRIOR * usual
        means = likely.T @ scores / (houses + PRIOR)[:, None]
        for k in range(count if scores.size else 0):
            off = scores - means[k]
            covariances[k] = ((likely[:, k, None] * off).T @ off + OF_ALL * alike) / (houses[k] + OF_ALL)
    return Kinds(shares, likely, has, means, covariances)
