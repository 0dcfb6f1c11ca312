from __future__ import annotations

import numpy as np
import pytest

from stats.tally import Tally


def filled(values: list[float], **how: float) -> Tally:
    tally = Tally(**how)
    for value in values:
        tally.add(value)
    return tally


def test_report_of_whole_numbers() -> None:
    assert filled([3, 1, 1, 7]).report() == {
        "count": 4,
        "sum": 12.0,
        "mean": 3.0,
        "std": 2.4495,
        "p05": 1.0,
        "median": 2.0,
        "p95": 5.0,
        "min": 1.0,
        "max": 7.0,
        "histogram": {"1": 2, "3": 1, "7": 1},
    }


def test_bins_hold_what_starts_in_them() -> None:
    report = filled([0.0, 19.99, 20.0, 45.5], step=0.01, bin_width=20.0).report()
    assert report["histogram"] == {"0": 2, "20": 1, "40": 1}
    assert report["median"] == pytest.approx(19.995)


def test_moments_are_those_of_numpy() -> None:
    values = np.random.default_rng(1).normal(50.0, 7.0, 400).round(2)
    assert filled(values.tolist(), step=0.01).moments() == pytest.approx((values.mean(), values.std()), abs=1e-9)


def test_tallies_add_up_in_any_order() -> None:
    values = np.random.default_rng(5).gamma(3.0, 40.0, 500).tolist()
    whole = filled(values, step=0.01, bin_width=20.0).report()
    one, other = (filled(part, step=0.01, bin_width=20.0) for part in (values[300:], values[:300]))
    one.merge(other)
    assert one.report() == whole
    assert whole["mean"] == pytest.approx(np.mean(values), abs=0.01)
    assert whole["median"] == pytest.approx(np.median(values), abs=0.01)
