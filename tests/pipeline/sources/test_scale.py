"""Units that heads of doors tell: bare ones, and those of models."""

import pytest

from pipeline.sources.storeys.scale import UNITS, model_scale


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in"])
def test_a_bare_unit_is_taken_before_a_model_of_nearly_the_same_size(unit: str) -> None:
    """Inches differ from millimetres at 1:25 by 1.6%."""
    for head_m in (2.0, 2.06, 2.1):
        assert model_scale(2.7 / UNITS[unit], [head_m / UNITS[unit]]) == UNITS[unit]


@pytest.mark.parametrize("metres", [15.0, 20.0, 50.0, 0.2, 0.5, 0.02])
def test_a_model_is_told_by_its_doors(metres: float) -> None:
    assert model_scale(2.7 / metres, [2.06 / metres]) == pytest.approx(metres)


@pytest.mark.parametrize("head_m", [2.0, 2.03, 2.06, 2.1])
def test_of_two_scales_that_nobody_can_tell_apart_the_metric_one_is_taken(head_m: float) -> None:
    """1:20 in inches is 1:50 in centimetres but for 1.6%, and brings such heads nearer to the usual one."""
    assert model_scale(2.7 / 0.5, [head_m / 0.5]) == pytest.approx(0.5)
    assert model_scale(2.7 / 0.381, [head_m / 0.381]) == pytest.approx(0.381)  # 1:15 in inches has no such twin
