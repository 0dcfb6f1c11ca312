"""Fitting the model of ``pipeline.quality``, and how good it is on plans of which is known whether they are right."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from houseexpo.plan.parts import SURE
from pipeline.quality import GROUNDS

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

NAMES = tuple(ground.name for ground in GROUNDS)
PRECISION = 0.95
"""Of the plans with a score of at least ``SURE``, so many are to be right."""
RIDGE = 0.3
"""How strongly weights are kept small, in plans."""


@dataclass(frozen=True)
class Judged:
    """A plan of a house: the grounds that it gives, its score, and whether it meets the table."""

    house: str
    kind: str
    met: bool
    score: float
    grounds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Model:
    """What ``pipeline.quality`` holds: a bias, and a weight of at most 0 for each ground."""

    bias: float
    weights: Mapping[str, float]

    def scores(self, plans: Sequence[Judged]) -> Floats:
        """Score plans anew, (n,) from 0 to 1."""
        found: Floats = 1 / (1 + np.exp(-(self.bias + _table(plans) @ [self.weights[name] for name in NAMES])))
        return found


def fit(plans: Sequence[Judged], precision: float = PRECISION) -> Model:
    """Fit by greatest likelihood, weights kept from growing by a ridge and from being more than 0.

    The bias is lowered at the end until enough of the plans that score ``SURE`` or more are right.
    """
    table, met = _table(plans), _met(plans)

    def loss(x: Floats) -> float:
        exponent = x[0] + table @ x[1:]
        return float(
            np.logaddexp(0, np.where(met, -exponent, exponent)).mean() + RIDGE * (x[1:] ** 2).sum() / 2 / len(met)
        )

    bounds = [(None, None)] + [(None, 0.0)] * len(NAMES)
    found = minimize(loss, np.zeros(len(NAMES) + 1), method="L-BFGS-B", bounds=bounds)
    model = Model(float(found.x[0]), dict(zip(NAMES, np.minimum(found.x[1:], 0.0).tolist(), strict=True)))
    least = threshold(model.scores(plans), met, precision)
    lowered = min(0.0, _logit(SURE) - _logit(least))
    return Model(model.bias + lowered, model.weights)


def threshold(scores: Floats, met: Bools, precision: float) -> float:
    """Return the lowest score of which, and of what is above it, enough plans are right; else the highest score."""
    values = np.unique(scores)
    good = [value for value in values if met[scores >= value].mean() >= precision]
    return float(min(good, default=values[-1]))


def precision_at(scores: Floats, met: Bools, least: float = SURE) -> float:
    """Share of the plans with at least this score that are right; NaN where there are none."""
    chosen = scores >= least
    return float(met[chosen].mean()) if chosen.any() else float("nan")


def area_under_curve(scores: Floats, met: Bools) -> float:
    """How often a plan that is right scores above one that is not; ties count half; NaN without plans of both sorts."""
    right, wrong = scores[met], scores[~met]
    if not len(right) or not len(wrong):
        return float("nan")
    above = (right[:, None] > wrong).mean() + (right[:, None] == wrong).mean() / 2
    return float(above)


def split(plans: Sequence[Judged], held_out: float = 0.4) -> tuple[list[Judged], list[Judged]]:
    """Return plans to fit on and plans to look at, all plans of one house on one side, the same ones every time."""
    parts: tuple[list[Judged], list[Judged]] = [], []
    for plan in plans:
        parts[zlib.crc32(plan.house.encode()) % 1000 < 1000 * held_out].append(plan)
    return parts


def met_of(plans: Sequence[Judged]) -> tuple[Floats, Bools]:
    """Return the scores that the plans carry, (n,), and whether each meets the table, (n,)."""
    return np.array([plan.score for plan in plans]), _met(plans)


def _met(plans: Sequence[Judged]) -> Bools:
    return np.array([plan.met for plan in plans], dtype=bool)


def _table(plans: Sequence[Judged]) -> Floats:
    return np.array([[plan.grounds.get(name, 0.0) for name in NAMES] for plan in plans]).reshape(-1, len(NAMES))


def _logit(score: float) -> float:
    clear = min(max(score, 1e-6), 1 - 1e-6)
    return float(np.log(clear / (1 - clear)))
