"""Means and their intervals."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from houseexpo.pseudoslam.benchmark.statistics import (
    DRAWS,
    Estimate,
    estimate_column_means,
    estimate_mean,
    estimate_mean_over_seeds,
    holm_correction,
    paired_p_value,
)


def test_equal_values_have_no_interval() -> None:
    assert estimate_mean([0.25] * 7) == Estimate(0.25, 0.25, 0.25, 7)


def test_what_no_plan_has_is_none() -> None:
    assert estimate_mean([None, None]) == Estimate(None, None, None, 0)


def test_values_that_are_lacking_are_left_out() -> None:
    found = estimate_mean([1.0, None, 3.0, None])
    assert (found.mean, found.number) == (2.0, 2)
    assert found.low == 1.0
    assert found.high == 3.0


def test_the_interval_is_as_wide_as_the_normal_one() -> None:
    """Of 400 draws from a normal distribution: 1.96 standard errors to each side, within a tenth."""
    values = np.random.default_rng(3).normal(5.0, 2.0, 400)
    found = estimate_mean(values.tolist())
    assert found.mean == pytest.approx(values.mean(), abs=1e-6)
    half = 1.96 * values.std() / 20
    assert found.mean - found.low == pytest.approx(half, rel=0.1)
    assert found.high - found.mean == pytest.approx(half, rel=0.1)


def test_draws_agree_with_drawing_one_by_one() -> None:
    values = np.array([0.0, 1.0, 4.0])
    counts = np.random.default_rng(0).multinomial(3, [1 / 3] * 3, DRAWS)
    slow = [np.repeat(values, row).mean() for row in counts]
    _, low, high = estimate_column_means(values[:, None])
    assert (low[0], high[0]) == tuple(np.round(np.percentile(slow, (2.5, 97.5)), 6))


def test_seeds_that_differ_widen_the_interval() -> None:
    """One training is as a mean over plans; of three that differ by 1 the interval has that in it, too."""
    values = np.random.default_rng(3).normal(5.0, 1.0, 200)
    one = values.tolist()
    assert estimate_mean_over_seeds([one]) == estimate_mean(one)
    alike = estimate_mean_over_seeds([one] * 3)
    assert alike == estimate_mean(one)
    apart = estimate_mean_over_seeds([(values + off).tolist() for off in (-1.0, 0.0, 1.0)])
    assert apart.mean == pytest.approx(alike.mean)
    assert apart.high - apart.low > 2 * (alike.high - alike.low)
    assert estimate_mean_over_seeds([[None], [None]]) == Estimate(None, None, None, 0)
    assert estimate_mean_over_seeds([[None, 1.0], [None, 3.0]]).mean == 2.0


@pytest.mark.parametrize("shift", [0.0, 0.3, 1.0])
def test_the_paired_test_is_that_of_all_changes_of_signs(shift: float) -> None:
    given = np.random.default_rng(5).normal(shift, 1.0, 10)
    sums = np.abs([np.dot(signs, given) for signs in product((-1.0, 1.0), repeat=10)])
    exact = np.mean(sums >= abs(given.sum()) - 1e-9)
    assert paired_p_value([*given.tolist(), None]) == pytest.approx(exact, abs=0.015)


def test_no_difference_is_no_evidence() -> None:
    assert paired_p_value([0.0] * 5) == 1.0
    assert paired_p_value([None]) is None
    assert paired_p_value([1.0] * 40) == 0.0001


def test_p_values_of_no_effect_are_uniform() -> None:
    rng = np.random.default_rng(0)
    found = [paired_p_value(rng.normal(0, 1, 12).tolist()) or 0.0 for _ in range(300)]
    assert np.mean(np.array(found) < 0.1) == pytest.approx(0.1, abs=0.05)


def test_holm_s_method_step_by_step() -> None:
    """0.01 x 4; 0.02 x 3; 0.03 x 2, which may not fall below the one before; 0.6 x 1."""
    assert holm_correction([0.03, 0.01, 0.6, 0.02]) == pytest.approx([0.06, 0.04, 0.6, 0.06])
    assert holm_correction([0.5, 0.5, 0.4]) == [1.0, 1.0, 1.0]
    assert holm_correction([]) == []
