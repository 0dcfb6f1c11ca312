"""Lower bounds of ways to a share of a house: where they are known, and beside an explorer's ways."""

from __future__ import annotations

import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.worlds.world import make_world
from research.way_bounds import bounds_m, outcome_of, trace_of

CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (13, 1), (13, 0)], 1, {})
ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (1, 8), (1, 1), (9, 1), (9, 0)], 1, {})


def test_in_a_corridor_the_way_ends_where_the_laser_reaches_the_share() -> None:
    world = make_world(CORRIDOR, 25.0, 0.2, 5.0)
    x, y = world.frame.pixels_from_points([1.5, 0.5]).tolist()
    ways_m, seen = bounds_m(world, x, y, 0.2, 5.0)
    for share in (0.9, 0.95, 0.99):
        way = ways_m[(seen >= share).argmax()]
        assert way == pytest.approx(13.0 * share - 5.0 - 1.5, abs=0.35)  # cells of 0.28 m are judged


def test_the_way_round_a_corner_counts_and_not_the_straight_line() -> None:
    world = make_world(ANGLE, 25.0, 0.2, 4.0)
    x, y = world.frame.pixels_from_points([0.5, 7.0]).tolist()
    ways_m, seen = bounds_m(world, x, y, 0.2, 4.0)
    found = [ways_m[(seen >= share).argmax()] for share in (0.9, 0.95, 0.99)]
    assert 9.0 < found[2] < 11.0  # 6.5 m down, then along until 4 m from the end: about 11 m less the octile's share
    assert found[0] < found[1] < found[2]


def test_the_bounds_are_a_trace_whose_measures_no_policy_can_beat() -> None:
    world, track = make_world(CORRIDOR, 25.0, 0.2, 5.0), find_track("budget")
    x, y = world.frame.pixels_from_points([1.5, 0.5]).tolist()
    found = outcome_of(track, Case("corridor", 1), trace_of(world, x, y, track.config, ())).values
    assert found["coverage_100_metres"] == found["coverage_100_steps"] == 1.0
    assert 0.9 < (found["area_100_steps"] or 0.0) < 1.0  # 6.5 of 13 m at once, 0.3 m more a step
    assert found["collisions"] is None
