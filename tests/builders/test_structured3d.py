"""The measures of Structured3D on shapes whose result one can write down."""

import numpy as np

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
