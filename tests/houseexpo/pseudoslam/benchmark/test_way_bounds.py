"""Lower bounds of ways to a share of a house: where they are known, and beside an explorer's ways."""

from __future__ import annotations

import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.worlds.world import make_world
from research.way_bounds import bounds_m

CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (13, 1), (13, 0)], 1, {})
ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (1, 8), (1, 1), (9, 1), (9, 0)], 1, {})


def test_in_a_corridor_the_way_ends_where_the_laser_reaches_the_share() -> None:
    world = make_world(CORRIDOR, 25.0, 0.2, 5.0)
    x, y = world.frame.pixels_from_points([1.5, 0.5]).tolist()
    found = bounds_m(world, x, y, 0.2, 5.0)
    for share, way in found.items():
        assert way == pytest.approx(13.0 * share / 100 - 5.0 - 1.5, abs=0.35)  # cells of 0.28 m are judged


def test_the_way_round_a_corner_counts_and_not_the_straight_line() -> None:
    world = make_world(ANGLE, 25.0, 0.2, 4.0)
    x, y = world.frame.pixels_from_points([0.5, 7.0]).tolist()
    found = bounds_m(world, x, y, 0.2, 4.0)
    assert 9.0 < found[99] < 11.0  # 6.5 m down, then along until 4 m from the end: about 11 m less the octile's share
    assert found[90] < found[95] < found[99]
