"""The measures of Structured3D on shapes whose result one can write down."""

import numpy as np
import pytest

from tests.builders.matching import Counts, compare


def ring(*corners):
    return np.array(corners, float)


LEFT = ring((0, 0), (4, 0), (4, 5), (0, 5))
RIGHT = ring((5, 0), (10, 0), (10, 5), (5, 5))


def test_the_truth_itself_is_all_right():
    for found in ([LEFT, RIGHT], [RIGHT[::-1], np.roll(LEFT, 1, axis=0)]):
        assert compare(found, [LEFT, RIGHT]) == {
            "room": Counts(2, 2, 2),
            "corner": Counts(8, 8, 8),
            "angle": Counts(8, 8, 8),
        }


def test_a_room_that_is_missing_and_one_too_many():
    assert compare([LEFT], [LEFT, RIGHT])["room"] == Counts(1, 1, 2)
    other = ring((4.2, 0), (4.8, 0), (4.8, 5), (4.2, 5))
    found = compare([LEFT, RIGHT, other], [LEFT, RIGHT])
    assert found["room"] == Counts(2, 3, 2)
    assert found["corner"] == Counts(8, 12, 8)


def test_half_of_a_room_is_not_it_and_rooms_that_overlap_count_for_nothing():
    assert compare([LEFT * (0.45, 1.0)], [LEFT, RIGHT])["room"].right == 0
    over = compare([LEFT, LEFT + 0.1], [LEFT, RIGHT])
    assert (over["room"].right, over["corner"].right) == (0, 0)


@pytest.mark.parametrize(("off_px", "right"), [(9.5, 8), (10.6, 6)])
def test_a_corner_may_lie_ten_pixels_off(off_px, right):
    metres = off_px / 256 * 12  # ten metres and a margin of a tenth on each side
    moved = LEFT.copy()
    moved[:2, 0] += (metres, 0)
    moved[3, 0] += metres
    assert compare([moved, RIGHT], [LEFT, RIGHT])["corner"] == Counts(right, 8, 8)


def test_a_corner_that_is_cut_off_has_the_wrong_angle():
    cut = ring((0.3, 0), (4, 0), (4, 5), (0, 5), (0, 0.3))
    found = compare([cut, RIGHT], [LEFT, RIGHT])
    assert found["corner"] == Counts(8, 9, 8)
    assert found["angle"] == Counts(7, 9, 8)
    assert found["angle"].precision == pytest.approx(7 / 9)
    assert found["angle"].recall == pytest.approx(7 / 8)


def test_nothing_found_is_nothing_right():
    assert compare([], [LEFT])["room"] == Counts(0, 0, 1)
    assert Counts(1, 2, 3) + Counts(1, 1, 1) == Counts(2, 3, 4)
