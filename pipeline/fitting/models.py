"""Fit logistic models of parts on labelled houses, and measure on houses left out of the fit whether they are better.

M1  A model is fitted by greatest likelihood; a ridge keeps its weights near those of the model that it starts from,
    and near 0 where it starts from none.
M2  A person's models start from those of ``weights.toml`` and weigh the same features, so few labels change them
    little. All parts of a house may be right or wrong for one reason: a house counts with the root of their number.
M3  The houses are divided at random into ``FOLDS`` (into single ones if there are no more). Each house is rated by
    models that were fitted without its fold, and by those of ``weights.toml``; the squared errors of the
    probabilities are compared.
M4  A new model is better if its error on the houses left out is smaller by more than one standard error of the sum of
    the houses' differences. Only better models are kept. The spaces come first: what rests on their model is rated by
    the one that is kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from houseexpo.errors import ConfigError
from houseexpo.words import count_noun
from pipeline.fitting.rows import HouseRows, Part, parts_of
from pipeline.stages.logistic import FITTED, LogisticModel, Models, load_models

Floats = npt.NDArray[np.float64]

RIDGE: Final = 1.5
"""How strongly weights are kept small: the likelier of 1.5 and 5 for entrances of files left out of the fit."""
FOLDS: Final = 8
FEWEST_HOUSES: Final = 10
"""With fewer labelled houses, the standard error of their differences is no better than a guess."""
_LEAST_WEIGHT: Final = 0.05
"""A weight nearer to 0 is left out."""


def fit(
    parts: Sequence[Part],
    names: Sequence[str],
    weight: Floats,
    start: LogisticModel | None = None,
) -> LogisticModel:
    """Fit one model of the features with these names (M1).

    Parameters
    ----------
    parts, weight
        The labelled parts (n), and how much each counts (n,).
    start
        The model near which the ridge keeps bias and weights; by default only the weights are kept, near 0.
    """
    table = np.array([[part.features.get(name, 0.0) for name in names] for part in parts]).reshape(
        len(parts), len(names)
    )
    true = np.array([part.true for part in parts])
    near = np.zeros(len(names) + 1)
    stiff = np.append(0.0, np.full(len(names), RIDGE))
    if start is not None:
        near = np.array([start.bias, *(start.weights.get(name, 0.0) for name in names)])
        stiff[0] = RIDGE

    def loss(x: Floats) -> tuple[float, Floats]:
        z = x[0] + table @ x[1:]
        value = (weight * np.logaddexp(0, np.where(true, -z, z))).sum() + (stiff * (x - near) ** 2).sum() / 2
        slope = weight * (1 / (1 + np.exp(-z)) - true)
        return float(value), np.append(slope.sum(), table.T @ slope) + stiff * (x - near)

    x = minimize(loss, near, jac=True, method="L-BFGS-B", options={"maxiter": 2000}).x
    kept = {name: round(float(w), 2) for name, w in zip(names, x[1:], strict=True) if abs(w) >= _LEAST_WEIGHT}
    return LogisticModel(round(float(x[0]), 2), kept)


def root_weights(parts: Sequence[Part]) -> Floats:
    """Return the weight of each part (n,), so that a house counts with the root of the number of its parts (M2)."""
    count = Counter(part.house for part in parts)
    return np.array([count[part.house] ** -0.5 for part in parts])


@dataclass(frozen=True)
class Comparison:
    """How good the models of one sort of part are on houses left out of the fit.

    ``shipped`` and ``own`` are the mean squared errors of the probabilities of the models of ``weights.toml`` and of
    the new ones, NaN where there are too few houses. ``gain`` is how much smaller the second is, and ``chance`` its
    standard error.
    """

    part: str
    houses: int
    right: int
    wrong: int
    shipped: float = float("nan")
    own: float = float("nan")
    chance: float = float("nan")

    @property
    def gain(self) -> float:
        """How much smaller the error of the new models is."""
        return self.shipped - self.own

    @property
    def is_untried(self) -> bool:
        """Whether too few houses have labels of it for a fit."""
        return self.houses < FEWEST_HOUSES

    @property
    def is_better(self) -> bool:
        """M4."""
        return self.gain > self.chance


@dataclass(frozen=True)
class OwnModels:
    """The models that are better than those of ``weights.toml`` by the labels, and how all of them compare."""

    models: Models
    comparisons: tuple[Comparison, ...]


def fit_own_models(rows: Sequence[HouseRows], seed: int = 0) -> OwnModels:
    """Fit models on a person's labels, and keep those that are better on houses left out (M2 to M4).

    Raises
    ------
    ConfigError
        Fewer than ``FEWEST_HOUSES`` houses have labels of any one sort of part.
    """
    shipped = load_models()
    every = sorted(rows, key=_house)
    order = np.random.default_rng(seed).permutation(len(every))
    fold_of = {_house(every[k]): place % FOLDS for place, k in enumerate(order.tolist())}
    folds = range(FOLDS)
    spaces: Mapping[int, LogisticModel] = dict.fromkeys(folds, shipped["space"])
    models: dict[str, LogisticModel] = {}
    comparisons = []
    for name in FITTED:
        last = parts_of(every, name, models.get("space", shipped["space"]))
        comparison = _count(name, last)
        if not comparison.is_untried:
            own_of, scored = {}, list[tuple[Part, float]]()
            for fold in folds:
                parts = parts_of(every, name, spaces[fold])
                own_of[fold] = _fit_own([part for part in parts if fold_of[part.house] != fold], name)
                out = [part for part in parts if fold_of[part.house] == fold]
                scored += [(part, own_of[fold].confidence(part.features)) for part in out]
            comparison = _compare(comparison, scored, [shipped[name].confidence(part.features) for part, _ in scored])
            if comparison.is_better:
                models[name] = _fit_own(last, name)
                spaces = own_of if name == "space" else spaces
        comparisons.append(comparison)
    if all(comparison.is_untried for comparison in comparisons):
        most = max(comparison.houses for comparison in comparisons)
        raise ConfigError(
            f"labels: expected labelled doors, entrances, rooms or spaces of {FEWEST_HOUSES} houses or more, found "
            f"{count_noun(most, 'house')}; review more of them, and press Keep where a house is right"
        )
    return OwnModels(models, tuple(comparisons))


def _fit_own(parts: Sequence[Part], name: str) -> LogisticModel:
    start = load_models()[name]
    return fit(parts, sorted(start.weights), root_weights(parts), start=start)


def _count(name: str, parts: Sequence[Part]) -> Comparison:
    right = sum(part.true for part in parts)
    return Comparison(name, len({part.house for part in parts}), right, len(parts) - right)


def _compare(counted: Comparison, scored: Sequence[tuple[Part, float]], shipped: Sequence[float]) -> Comparison:
    true = np.array([part.true for part, _ in scored])
    own_error = (np.array([score for _, score in scored]) - true) ** 2
    error = (np.array(shipped) - true) ** 2
    houses, which = np.unique([part.house for part, _ in scored], return_inverse=True)
    gains = np.bincount(which, error - own_error, minlength=len(houses))
    chance = float(np.sqrt(len(houses)) * gains.std(ddof=1)) / len(scored)
    return Comparison(
        counted.part,
        counted.houses,
        counted.right,
        counted.wrong,
        float(error.mean()),
        float(own_error.mean()),
        chance,
    )


def _house(row: HouseRows) -> str:
    return row.plans[0].house
