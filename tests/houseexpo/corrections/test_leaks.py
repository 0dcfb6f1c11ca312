"""Where the space at one side of a wall runs out to the other side."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from shapely import Polygon

from houseexpo.corrections.leaks import find_gap

GARAGE = [shapely.box(0, 0, 6, 0.2), shapely.box(0, 0, 0.2, 5), shapely.box(5.8, 0, 6, 5)]
"""Three walls, open at y = 5."""


def test_one_more_wall_at_the_gap_closes_the_space() -> None:
    wall = [(0.1, 5.0), (4.5, 5.0)]
    gap = find_gap(wall, [], GARAGE)
    assert gap is not None
    assert np.sort(np.array(gap)[:, 0]) == pytest.approx([4.55, 5.8], abs=0.1)
    assert math.dist(*gap) == pytest.approx(1.25, abs=0.1)
    drawn = shapely.LineString(wall).buffer(0.05, cap_style="square")
    assert find_gap(gap, [], [*GARAGE, drawn]) is None


def test_of_several_gaps_the_widest_comes_first_and_then_the_next() -> None:
    holes = [shapely.box(0, 0, 6, 0.2), shapely.box(0, 0, 0.2, 2), shapely.box(0, 2.8, 0.2, 5), GARAGE[2]]
    gaps, wall = [], [(0.1, 5.0), (4.5, 5.0)]
    standing = [*holes, shapely.LineString(wall).buffer(0.05, cap_style="square")]
    while (gap := find_gap(wall, [], standing)) is not None:
        gaps.append(round(math.dist(*gap), 1))
        standing.append(shapely.LineString(gap).buffer(0.05, cap_style="square"))
        assert len(gaps) < 4
    assert gaps == pytest.approx([1.2, 0.8], abs=0.11)


def test_a_wall_in_a_room_that_parts_nothing_shows_the_rest_of_its_line() -> None:
    room = shapely.box(0, 0, 8, 4)
    wall = [(4.0, 0.0), (4.0, 2.8)]
    left: Polygon = shapely.difference(room, shapely.LineString(wall).buffer(0.05, cap_style="square"))
    gap = find_gap(wall, [left], [])
    assert gap is not None
    assert np.sort(np.array(gap)[:, 1]) == pytest.approx([2.85, 4.0], abs=0.1)
    whole = shapely.difference(room, shapely.box(3.95, 0, 4.05, 4))
    assert find_gap([(4.0, 0.0), (4.0, 4.0)], shapely.get_parts(whole).tolist(), []) is None


def test_a_wall_in_the_open_shows_the_way_to_the_next_wall() -> None:
    gap = find_gap([(3.0, 3.0), (3.5, 3.0)], [], GARAGE)
    assert gap is not None
    assert gap[0] in {(3.0, 3.0), (3.5, 3.0)}


def test_a_space_that_should_be_a_room_shows_where_it_is_open() -> None:
    front = shapely.box(0, 4.8, 5.0, 5)
    gap = find_gap([(3.0, 2.5)], [], [*GARAGE, front])
    assert gap is not None
    assert math.dist(*gap) == pytest.approx(0.8, abs=0.1)
    assert find_gap([(3.0, 2.5)], [], [*GARAGE, shapely.box(0, 4.8, 6, 5)]) is None
    assert find_gap([(3.0, 2.5)], [], []) is None


def test_a_gap_that_no_wall_could_shut_does_not_hide_the_next_one() -> None:
    front = [shapely.box(0, 4.8, 4.5, 5), shapely.box(4.6, 4.8, 6, 5)]
    assert find_gap([(3.0, 2.5)], [], [*GARAGE, *front]) is None
    holes = [shapely.box(0, 0, 0.2, 2), shapely.box(0, 2.8, 0.2, 5)]
    wall = [(0.3, 4.9), (5.7, 4.9)]  # it ends 0.1 m from both walls
    gap = find_gap(wall, [], [GARAGE[0], GARAGE[2], *holes, shapely.LineString(wall).buffer(0.05)])
    assert gap is not None
    assert math.dist(*gap) == pytest.approx(0.8, abs=0.1)


def test_the_edge_that_a_slanted_wall_leaves_in_its_room_is_no_gap() -> None:
    wall = [(1.0, 0.0), (2.924, 1.165)]
    left = shapely.difference(shapely.box(0, 0, 8, 4), shapely.LineString(wall).buffer(0.05, cap_style="square"))
    room = Polygon(shapely.get_coordinates(left.exterior).round(2))  # as a plan stores it
    gap = find_gap(wall, [room], [])
    assert gap is not None
    assert math.dist(*gap) > 0.5


def test_what_is_drawn_in_a_room_bounds_it() -> None:
    room = shapely.difference(shapely.box(0, 0, 8, 4), shapely.box(3.95, 0, 4.05, 2))
    wall = [(4.0, 0.0), (4.0, 2.0)]
    assert find_gap(wall, [room], []) is not None
    assert find_gap(wall, [room], [], [shapely.box(3.95, 2.05, 4.05, 4)]) is None
