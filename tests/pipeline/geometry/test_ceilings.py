"""Where a ceiling changes its height."""

import pytest
import shapely
import trimesh

from pipeline.geometry.ceilings import ceiling_steps
from tests.builders.meshes import box, joined, sheet

LOW, HIGH = 2.2, 2.6


def plate(x1: float, x2: float, height: float) -> trimesh.Trimesh:
    return box((x1, 0.0, x2, 3.0), height, height + 0.001)


@pytest.mark.parametrize(("low", "found"), [(2.2, True), (1.6, False)])
def test_a_step_is_found_above_head_height(low: float, found: bool) -> None:
    steps = ceiling_steps(joined([plate(0, 2, low), plate(2, 5, HIGH), sheet((2, 0), (2, 3), low, HIGH)]), 1.8)
    assert steps.intersects(shapely.Point(2, 1.5)) == found
    assert steps.area == pytest.approx(3.0 * 0.1 if found else 0.0, abs=0.01)


@pytest.mark.parametrize("deep", [0.2, 0.5])
def test_a_beam_has_no_steps(deep: float) -> None:
    beam = box((2.0, 0.0, 2.0 + deep, 3.0), LOW, HIGH)
    steps = ceiling_steps(joined([plate(0, 5, HIGH), beam]), 1.8)
    assert not steps.intersects(shapely.LineString([(1.9, 1.5), (2.1 + deep, 1.5)]))


def test_a_lintel_of_one_sheet_is_none() -> None:
    assert ceiling_steps(joined([plate(0, 5, HIGH), sheet((2, 0), (2, 3), LOW, HIGH)]), 1.8).is_empty
