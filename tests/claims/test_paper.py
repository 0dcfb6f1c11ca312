"""docs/paper.md: each statement of the paper has its place in the code, its tests and its verdict."""

from __future__ import annotations

import re

import pytest

from tests.claims.places import ROOT, is_code, is_test

PAGE = (ROOT / "docs" / "paper.md").read_text()
STATEMENTS = PAGE.partition("## What was looked at")[0]
ENTRIES = re.findall(r"^- \*\*(.*?)(?=^- \*\*|^#|^\||\Z)", STATEMENTS, re.DOTALL | re.MULTILINE)
ROWS = re.findall(r"^\| (?!the paper|---)(.*) \|$", STATEMENTS, re.MULTILINE)
TEST = r"`(tests/[\w/]+\.py::\w+)`"
CODE = r"`([a-z]\w*(?:\.\w+)+:\w+(?:\.\w+)*)`"


@pytest.mark.parametrize("entry", [*ENTRIES, *ROWS], ids=lambda entry: entry[:40])
def test_a_statement_has_its_place_its_tests_and_its_verdict(entry: str) -> None:
    places, tests = re.findall(CODE, entry), re.findall(TEST, entry)
    assert places
    assert tests
    assert [place for place in places if not is_code(place)] == []
    assert [test for test in tests if not is_test(test)] == []
    if entry in ENTRIES:
        assert re.search(r"\*\*(As the paper|As the published files|Departs)\W", entry)


def test_no_algorithm_line_is_left_out() -> None:
    named = [
        line
        for first, last in re.findall(r"^- \*\*Lines? (\d+)(?: (?:to|and) (\d+))?", PAGE, re.MULTILINE)
        for line in range(int(first), int(last or first) + 1)
    ]
    assert named == list(range(1, 26))


def test_places_that_are_not_there_are_found_out() -> None:
    assert not is_code("pipeline.algorithm:no_such_name")
    assert not is_code("pipeline.nowhere:run_stages")
    assert is_code("houseexpo.floorplan:FloorPlan.centred")
    assert not is_test("tests/claims/test_paper.py::test_no_such_test")
