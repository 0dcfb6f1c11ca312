"""The shortest way between two places, against lengths that can be written down."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from houseexpo.analysis.graph import distance_matrix, shortest_path

L = shapely.Polygon([(0, 0), (6, 0), (6, 6), (3, 6), (3, 3), (0, 3)])


def test_a_straight_way_is_a_line() -> None:
    found = shortest_path(L, (1, 1), (5, 2))
    assert found is not None
    assert found.points.tolist() == [[1, 1], [5, 2]]
    assert found.length == pytest.approx(math.hypot(4, 1))


def test_a_way_turns_at_the_corner() -> None:
    found = shortest_path(L, (0, 2.5), (3.5, 6))
    assert found is not None
    assert found.points.tolist() == [[0, 2.5], [3, 3], [3.5, 6]]
    assert found.length == pytest.approx(2 * math.hypot(3, 0.5))


def test_a_hole_is_passed_on_the_shorter_side() -> None:
    space = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 2, 6, 9))
    found = shortest_path(space, (3, 5), (7, 5))
    assert found is not None
    assert found.length == pytest.approx(2 + 2 * math.hypot(1, 3))
    assert found.points[:, 1].min() == 2


def test_there_is_none_between_pieces() -> None:
    space = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 3, 1)])
    assert shortest_path(space, (0.5, 0.5), (2.5, 0.5)) is None


def test_a_place_is_no_way_from_itself() -> None:
    found = shortest_path(L, (1, 1), (1, 1))
    assert found is not None
    assert found.length == 0


def test_it_is_as_long_as_the_walking_distance() -> None:
    rng = np.random.default_rng(3)
    blocks = shapely.union_all([shapely.box(x, y, x + 0.8, y + 0.5) for x, y in rng.uniform(0.5, 9, (25, 2))])
    space = shapely.box(0, 0, 10, 10).difference(blocks)
    space = max(shapely.get_parts(space), key=shapely.area)
    inside = [p for p in rng.uniform(0, 10, (60, 2)) if space.contains(shapely.Point(p))][:12]
    expected = distance_matrix(space, inside)
    for i, one in enumerate(inside):
        for j, other in enumerate(inside):
            found = shortest_path(space, one, other)
            assert found is not None
            assert found.length == pytest.approx(expected[i, j], abs=1e-9)
            lengths = np.hypot(*np.diff(found.points, axis=0).T)
            assert found.length == pytest.approx(lengths.sum(), abs=1e-9)


def test_a_space_of_thousands_of_corners_is_answered() -> None:
    angles = np.linspace(0, 2 * math.pi, 6000, endpoint=False)
    radii = 10 + 0.3 * (np.arange(6000) % 2)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    space = shapely.Polygon(ring, [shapely.Point(0, 0).buffer(5).exterior.coords])
    found = shortest_path(space, (-8, 0), (8, 0))
    assert found is not None
    exact = 2 * math.sqrt(64 - 25) + 5 * (math.pi - 2 * math.acos(5 / 8))
    assert found.length == pytest.approx(exact, rel=0.02)
