"""Curves and metrics of episodes that can be written down."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo.pseudoslam.benchmark import measures
from houseexpo.pseudoslam.benchmark.measures import Trace


def trace_of(rows: list[tuple[int, float, float]], **info: float) -> Trace:
    trace = Trace()
    for steps, metres, coverage in rows:
        trace.add(steps, metres, {"coverage": coverage, "collisions": 0, **info}, reward=0.5)
    return trace


TURN_AND_GO = [(0, 0.0, 0.1), (1, 0.0, 0.2), (2, 0.3, 0.2), (3, 0.6, 0.5), (4, 0.6, 0.9)]


def test_coverage_at_a_budget_is_that_of_the_last_row_within_it() -> None:
    trace = trace_of(TURN_AND_GO)
    assert trace.coverage_at("steps", [0, 1, 2, 3, 3.5, 4, 100]).tolist() == [0.1, 0.2, 0.2, 0.5, 0.5, 0.9, 0.9]
    assert trace.coverage_at("metres", [0, 0.29, 0.3, 0.6, 5]).tolist() == [0.2, 0.2, 0.2, 0.9, 0.9]


def test_the_area_is_that_under_the_steps_of_the_curve() -> None:
    trace = trace_of(TURN_AND_GO)
    assert trace.mean_coverage("steps", 4) == pytest.approx((0.1 + 0.2 + 0.2 + 0.5) / 4)
    assert trace.mean_coverage("steps", 10) == pytest.approx((0.1 + 0.2 + 0.2 + 0.5 + 6 * 0.9) / 10)
    assert trace.mean_coverage("steps", 2) == pytest.approx((0.1 + 0.2) / 2)
    assert trace.mean_coverage("metres", 1.0) == pytest.approx(0.3 * 0.2 + 0.3 * 0.2 + 0.4 * 0.9)


def test_an_action_of_many_steps_counts_when_it_ends() -> None:
    trace = trace_of([(0, 0.0, 0.1), (50, 9.0, 0.8)])
    assert trace.coverage_at("steps", [49, 50]).tolist() == [0.1, 0.8]
    assert trace.mean_coverage("steps", 100) == pytest.approx(0.45)


def test_the_first_time_that_so_much_was_seen() -> None:
    trace = trace_of(TURN_AND_GO)
    assert trace.first(0.5) == (3, 0.6)
    assert trace.first(0.1) == (0, 0.0)
    assert trace.first(0.91) is None


def test_quality_has_no_way_to_what_was_never_reached() -> None:
    found = measures.StepsToCoverage((20, 90, 95))(trace_of(TURN_AND_GO))
    assert found == {
        "collisions": 0.0,
        "reached_20": 1.0, "steps_to_20": 1, "metres_to_20": 0.0,
        "reached_90": 1.0, "steps_to_90": 4, "metres_to_90": 0.6,
        "reached_95": 0.0, "steps_to_95": None, "metres_to_95": None,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("metrics", "found"),
    [
        (measures.budget_metrics((2, 4)), measures.CoverageAtBudgets((2, 4))(trace_of(TURN_AND_GO))),
        (measures.steps_to_coverage_metrics((50,)), measures.StepsToCoverage((50,))(trace_of(TURN_AND_GO))),
        (measures.AVOIDANCE, measures.measure_avoidance(trace_of(TURN_AND_GO))),
        (measures.NAVIGATION, measures.measure_navigation(trace_of(TURN_AND_GO, spl=0.5, is_success=True))),
        (measures.SOCIAL, measures.SocialNavigation(0.5)(trace_of(TURN_AND_GO, spl=0.5, is_success=True))),
    ],
)
def test_each_metric_has_its_value(metrics: tuple[measures.Metric, ...], found: measures.Values) -> None:
    assert {metric.key for metric in metrics} == found.keys()
    assert len(metrics) == len(found)


def test_a_return_is_the_sum_of_rewards() -> None:
    assert measures.measure_avoidance(trace_of(TURN_AND_GO))["return"] == 2.5


def test_the_way_that_counts_for_avoidance_ends_at_the_first_collision() -> None:
    """It ranks who touches something late above who touches it early, and who only spins below both."""
    found = {}
    for name, bumps, step_m in (("never", 99, 0.3), ("late", 5, 0.3), ("early", 2, 0.3), ("spins", 99, 0.0)):
        trace = Trace()
        for i in range(8):
            trace.add(i, step_m * i, {"coverage": 0.5, "collisions": max(i - bumps + 1, 0)})
        found[name] = measures.measure_avoidance(trace)
    assert {name: round(float(each["metres_untouched"] or 0), 6) for name, each in found.items()} == {
        "never": 2.1, "late": 1.2, "early": 0.3, "spins": 0.0,
    }  # fmt: skip
    assert [found[name]["untouched"] for name in found] == [1.0, 0.0, 0.0, 1.0]
    assert (found["early"]["collisions"], found["early"]["metres"]) == (6.0, pytest.approx(2.1))


def test_the_time_in_peoples_space_is_that_of_the_steps_that_end_there() -> None:
    trace = Trace()
    rows = [(0, 0.1, False), (1, 1.3, True), (2, 1.1, False), (3, 0.4, True), (5, 0.05, True), (6, 0.05, False)]
    for steps, gap_m, collided in rows:
        info = {"coverage": 0.5, "collisions": 0, "collided": collided, "spl": 0.0, "is_success": False}
        trace.add(steps, 0.0, info, person_m=gap_m)
    found = measures.SocialNavigation(0.5)(trace)
    assert (found["personal_s"], found["intimate_s"], found["person_collisions"]) == (2.5, 2.0, 1.0)
    assert found["seconds_to_goal"] is None
    trace.info = {**trace.info, "is_success": True}
    assert measures.SocialNavigation(0.5)(trace)["seconds_to_goal"] == 3.0


def test_areas_agree_with_a_sum_over_single_steps() -> None:
    rng = np.random.default_rng(0)
    coverage = np.sort(rng.random(60))
    trace = trace_of([(i, 0.3 * i, float(c)) for i, c in enumerate(coverage)])
    for budget in (1, 7, 59, 60, 80):
        slow = sum(coverage[min(i, 59)] for i in range(budget)) / budget
        assert trace.mean_coverage("steps", budget) == pytest.approx(slow)
