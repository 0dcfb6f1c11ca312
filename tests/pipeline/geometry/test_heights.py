import numpy as np
import pytest

from pipeline.geometry.cutting import distinct_heights, near, section_heights


def test_a_height_that_is_clear_stays() -> None:
    assert near(0.2, np.array([0.0, 0.1, 2.5])) == 0.2
    assert near(0.2, np.array([])) == 0.2


@pytest.mark.parametrize("level", [0.2, 0.2 + 1e-4, 0.1985])
def test_a_cut_through_coplanar_faces_moves_into_the_widest_gap_near_it(level: float) -> None:
    z = np.array([0.0, 0.12, level, 2.5])
    height = near(0.2, z)
    assert np.abs(z - height).min() > 0.02
    assert 0.1 <= height <= 0.3
    # between 0.1 and 0.3 the widest gap is the one above
    assert height == pytest.approx((level + 0.3) / 2, abs=1e-3)


def test_heights_are_distinct_to_the_millimetre() -> None:
    z = np.array([2.1, 2.1 + 1e-5, 2.5, 0.1, 1.8])
    np.testing.assert_allclose(distinct_heights(z, 1.8, 2.5), [1.8, 2.1, 2.5])


def test_one_cut_between_neighbouring_heights() -> None:
    z = np.array([0.0, 2.0, 2.1, 2.15, 2.5])
    assert section_heights(z, 1.8, 2.5, smallest_gap=0.08, most=12) == pytest.approx([1.9, 2.05, 2.325])
    assert section_heights(z, 2.5, 1.8, smallest_gap=0.08, most=12) == []


def test_a_scan_has_a_vertex_everywhere_and_is_cut_evenly() -> None:
    z = np.linspace(0, 2.5, 5000)
    heights = section_heights(z, 1.8, 2.5, smallest_gap=0.08, most=6)
    assert len(heights) == 6
    assert np.diff(heights) == pytest.approx(0.1, abs=0.005)
