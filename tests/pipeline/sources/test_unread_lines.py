"""Which part of an unread sheet matters, which layers look like walls, and which units fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pipeline.sources.vector_plans.unread_lines import likely_units, main_part, rank_layers

Lines = list[tuple[str, Any]]


def ring(x1: float, y1: float, x2: float, y2: float) -> list[list[float]]:
    return [[x1, y1], [x2, y1], [x2, y2], [x1, y2], [x1, y1]]


def sheet() -> Lines:
    """A house of 10 m x 8 m, walls of 0.2 m, in mm at 1:50: 200 x 160; stairs, furniture, a frame and an elevation."""
    walls = [ring(0, 0, 200, 160), ring(4, 4, 98, 156), ring(102, 4, 196, 156)]
    stairs = [[[150, y], [190, y]] for y in range(20, 80, 5)]
    chairs = [ring(20 + 15 * k, 40, 30 + 15 * k, 50) for k in range(5)]
    elevation = [ring(2000 + 10 * k, 0, 2005 + 10 * k, 80) for k in range(12)]
    drawn = {"A-1": walls, "A-2": stairs, "A-3": chairs, "A-0": [ring(-20, -20, 220, 180)], "E": elevation}
    return [(name, np.array(points, float)) for name, lines in drawn.items() for points in lines]


def test_the_main_part_of_a_sheet_has_the_most_lines() -> None:
    assert main_part(sheet()) == (-20, -20, 220, 180)
    far = [*sheet(), *(("E", np.array([[2000.0, y], [2100.0, y]])) for y in range(40))]
    assert main_part(far) == (2000, 0, 2115, 80)
    assert main_part([("A", np.array([[3.0, 4.0], [3.0, 4.0]]))]) == (3, 4, 3, 4)


def test_walls_are_lines_in_pairs_and_what_lies_in_another_part_is_not_ranked() -> None:
    lines = sheet()
    ranked = rank_layers(lines, main_part(lines))
    assert ranked[0] == ("A-1", pytest.approx(4.0))
    assert {name for name, _ in ranked} == {"A-0", "A-1", "A-2", "A-3"}
    assert dict(ranked)["A-0"] == 0.0


def test_with_a_known_unit_walls_are_as_thick_as_walls() -> None:
    lines = [("A-1", np.array([[x, 0.0], [x, 90.0]])) for x in (0.0, 2.0)]  # 10 cm, far from all else
    lines += [("A-2", np.array([[x, 100.0], [x, 400.0]])) for x in (0.0, 20.0)]  # 1 m
    lines += [("A-4", np.array([[x, 0.0], [x, 300.0]])) for x in range(100, 150, 5)]  # a hatch
    within = (0.0, 0.0, 600.0, 400.0)
    assert rank_layers(lines, within)[0][0] == "A-2"
    assert rank_layers(lines, within, 0.05) == [("A-1", pytest.approx(2.0)), ("A-4", 0.0), ("A-2", 0.0)]


@pytest.mark.parametrize(
    ("size", "thick", "first"),
    [(12.0, 0.2, 1.0), (12_000.0, 200.0, 0.001), (1200.0, 20.0, 0.01), (492.0, 3.0, 0.05), (200.0, 1.5, 0.1)],
)
def test_a_unit_fits_where_house_and_walls_have_their_sizes(size: float, thick: float, first: float) -> None:
    assert likely_units(size, thick)[0] == first


def test_with_a_scale_a_unit_is_a_length() -> None:
    assert likely_units(492.0, 3.0, 50.0) == [0.001]
    assert likely_units(5e6, 3.0) == []
