"""Means and their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.pseudoslam.benchmark.statistics import DRAWS, Estimate, estimate, estimate_seeds, means


def test_equal_values_have_no_interval() -> None:
    assert estimate([0.25] * 7) == Estimate(0.25, 0.25, 0.25, 7)


def test_what_no_plan_has_is_none() -> None:
    assert estimate([None, None]) == Estimate(None, None, None, 0)


def test_values_that_are_lacking_are_left_out() -> None:
    found = estimate([1.0, None, 3.0, None])
    assert (found.mean, found.number) == (2.0, 2)
    assert found.low == 1.0
    assert found.high == 3.0


def test_the_interval_is_as_wide_as_the_normal_one() -> None:
    """Of 400 draws from a normal distribution: 1.96 standard errors to each side, within a tenth."""
    values = np.random.default_rng(3).normal(5.0, 2.0, 400)
    found = estimate(values.tolist())
    assert found.mean == pytest.approx(values.mean(), abs=1e-6)
    half = 1.96 * values.std() / 20
    assert found.mean - found.low == pytest.approx(half, rel=0.1)
    assert found.high - found.mean == pytest.approx(half, rel=0.1)


def test_draws_agree_with_drawing_one_by_one() -> None:
    values = np.array([0.0, 1.0, 4.0])
    counts = np.random.default_rng(0).multinomial(3, [1 / 3] * 3, DRAWS)
    slow = [np.repeat(values, row).mean() for row in counts]
    _, low, high = means(values[:, None])
    assert (low[0], high[0]) == tuple(np.round(np.percentile(slow, (2.5, 97.5)), 6))


def test_seeds_that_differ_widen_the_interval() -> None:
    """One training is as a mean over plans; of three that differ by 1 the interval has that in it, too."""
    values = np.random.default_rng(3).normal(5.0, 1.0, 200)
    one = values.tolist()
    assert estimate_seeds([one]) == estimate(one)
    alike = estimate_seeds([one] * 3)
    assert alike == estimate(one)
    apart = estimate_seeds([(values + off).tolist() for off in (-1.0, 0.0, 1.0)])
    assert apart.mean == pytest.approx(alike.mean)
    assert apart.high - apart.low > 2 * (alike.high - alike.low)
    assert estimate_seeds([[None], [None]]) == Estimate(None, None, None, 0)
    assert estimate_seeds([[None, 1.0], [None, 3.0]]).mean == 2.0
