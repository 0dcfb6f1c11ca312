"""The arithmetic by which the model of quality is fitted and judged, on numbers that can be checked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.builders.quality_model import (
    NAMES,
    Judged,
    area_under_curve,
    fit,
    precision_at,
    split,
    threshold,
)


def made(n: int, seed: int) -> list[Judged]:
    """Plans that are right unless many doors are cuts; the other grounds say nothing."""
    rng = np.random.default_rng(seed)
    plans = []
    for k in range(n):
        grounds = {name: float(rng.random()) for name in NAMES}
        met = bool(rng.random() < 1 / (1 + math.exp(-(4 - 9 * grounds["cut_share"]))))
        plans.append(Judged(f"house {k // 2}", "made", met, 0.5, grounds))
    return plans


def test_the_area_under_the_curve_is_the_share_of_pairs_in_order() -> None:
    scores, met = np.array([0.9, 0.8, 0.7, 0.7]), np.array([True, False, True, False])
    assert area_under_curve(scores, met) == (1 + 1 + 0 + 0.5) / 4
    assert math.isnan(area_under_curve(scores, np.ones(4, bool)))


def test_precision_counts_the_plans_at_or_above_the_score() -> None:
    scores, met = np.array([0.9, 0.8, 0.8, 0.7]), np.array([True, True, False, False])
    assert precision_at(scores, met) == pytest.approx(2 / 3)
    assert math.isnan(precision_at(scores, met, 0.95))


def test_the_threshold_is_the_lowest_from_which_on_all_is_well() -> None:
    scores, met = np.array([0.9, 0.8, 0.7, 0.6, 0.5]), np.array([True, True, False, True, True])
    assert threshold(scores, met, 0.95) == 0.8
    assert threshold(scores, met, 0.6) == 0.5
    assert threshold(scores, ~met, 0.95) == 0.9


def test_a_fit_finds_the_ground_that_matters_and_no_weight_is_above_nothing() -> None:
    model = fit(made(800, 1))
    assert min(model.weights, key=lambda name: model.weights[name]) == "cut_share"
    assert max(model.weights.values()) <= 0
    assert fit(made(800, 1)) == model


def test_a_fit_holds_on_plans_that_it_has_not_seen() -> None:
    model, others = fit(made(800, 1)), made(800, 2)
    met = np.array([plan.met for plan in others])
    assert precision_at(model.scores(others), met) >= 0.92
    assert area_under_curve(model.scores(others), met) >= 0.85
    assert (model.scores(others) >= 0.8).mean() > 0.15


def test_plans_of_one_house_stay_on_one_side() -> None:
    plans = made(400, 3)
    fitted, held_out = split(plans)
    assert not {plan.house for plan in fitted} & {plan.house for plan in held_out}
    assert len(fitted) + len(held_out) == len(plans)
    assert 0.3 < len(held_out) / len(plans) < 0.5
