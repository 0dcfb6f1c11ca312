"""The numbers of the stages are found with the lines that read them, and can be moved one by one."""

from __future__ import annotations

import ast
from collections import Counter

import pytest

from pipeline.geometry import wall_gaps
from pipeline.stages import doors, evidence
from research.threshold_effects import (
    Number,
    Result,
    Trial,
    are_alike,
    constants_of,
    lines_of,
    moved,
    numbers,
    page_of,
    rows_of_page,
    times,
)

MODULE = """
NEAR_M = 0.3
FAR_M, SQUARE = 2.0, abs(-1)
NAME = "near"
TWICE_M = 2 * NEAR_M

def is_near(distance, least=FAR_M):
    if distance < SQUARE:
        return True
    return distance < least
"""


def test_constants_are_numbers_and_not_what_is_made_of_names():
    assert list(constants_of(ast.parse(MODULE))) == ["NEAR_M", "FAR_M", "SQUARE"]


def test_labels_and_layouts_of_bits_are_no_thresholds():
    assert list(constants_of(ast.parse("OUTSIDE = -1\nKEY = (1 << 20, 1)\nLOW_M = -0.5"))) == ["LOW_M"]


def test_a_house_is_another_where_a_room_or_a_door_comes_or_a_room_grows_by_more_than_a_twentieth():
    house = ("", [([4.0, 9.0], 1, 1, 0)])
    assert are_alike(house, ("", [([4.1, 9.0], 1, 1, 0)]))
    assert not are_alike(house, ("", [([4.5, 9.0], 1, 1, 0)]))
    assert not are_alike(house, ("", [([4.0, 9.0], 2, 1, 0)]))
    assert not are_alike(house, ("", []))
    assert not are_alike(house, ("NO_LAYOUT", house[1]))


def test_the_page_says_of_how_many_levels_how_many_changed():
    number = Number("pipeline.tolerances", "LAP_M")
    results = [("a", 0.8, Result.PLAN), ("a", 1.2, Result.HOUSE), ("b", 0.8, Result.NOTHING), ("a", 0.0, Result.PLAN)]
    page = page_of([Trial(number.title, *each) for each in results], [number])
    assert page.endswith("\n## A fifth more or less changes a house\n- `tolerances`: `LAP_M` 1/1/2 1/0/1.\n")


def test_a_number_that_was_not_tried_again_keeps_its_row():
    tried, other = (Number("pipeline.tolerances", name) for name in ("LAP_M", "MM_M"))
    first = page_of([Trial(n.title, "a", 0.8, Result.PLAN) for n in (tried, other)], [tried, other])
    again = page_of([Trial(tried.title, "b", 0.8, Result.NOTHING)], [tried, other], rows_of_page(first))
    assert "## Nothing changes\n- `tolerances`: `LAP_M` 0/0/1 0/0/0.\n" in again
    assert "## No house changes, but bytes of plans\n- `tolerances`: `MM_M` 1/0/1 0/0/0.\n" in again
    assert rows_of_page(again)["tolerances.MM_M"] == ((1, 0, 1), (0, 0, 0))


def test_a_default_is_read_by_all_of_its_function_and_a_body_by_everybody():
    lines = lines_of(ast.parse(MODULE), "m")
    assert lines["SQUARE"] == {("m", 8)}
    assert lines["FAR_M"] == {("m", line) for line in (7, 8, 9, 10)}
    assert lines["NEAR_M"] is None


def test_every_number_is_read_somewhere():
    found = numbers()
    named = {"tolerances.LAP_M", "geometry.wall_gaps.WIDER", "stages.separation.CLOSET_M2"}
    assert named <= {number.title for number in found}
    assert not [number.title for number in found if number.lines is not None and not number.lines]


def test_a_name_stands_for_one_number_in_geometry_and_stages():
    names = Counter(number.name for number in numbers())
    assert not [name for name, count in names.items() if count > 1]


def test_a_number_moves_wherever_it_was_imported_and_comes_back():
    old = wall_gaps.LAP_M
    with moved(Number("pipeline.tolerances", "LAP_M"), 10.0):
        assert wall_gaps.LAP_M == doors.LAP_M == evidence.LAP_M == 10 * old
    assert wall_gaps.LAP_M == doors.LAP_M == evidence.LAP_M == old


def test_a_default_moves_too():
    assert wall_gaps.wall_ends.__defaults__ == (wall_gaps.THICK_WALL_M,)
    with moved(Number("pipeline.tolerances", "THICK_WALL_M"), 0.0):
        assert wall_gaps.wall_ends.__defaults__ == (0.0,)
    assert wall_gaps.wall_ends.__defaults__ == (wall_gaps.THICK_WALL_M,)


@pytest.mark.parametrize(
    ("value", "factor", "expected"), [(3, 1.2, 4), (3, 0.8, 2), (5, 1000.0, 5000), ((1.0, 2), 0.0, (0.0, 0))]
)
def test_whole_numbers_move_by_one_at_least(value, factor, expected):
    assert times(value, factor) == expected
