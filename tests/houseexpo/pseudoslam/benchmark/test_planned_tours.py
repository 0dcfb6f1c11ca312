"""Planned tours: as short as is known, never below the bounds, and the same for a seed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.worlds.world import make_world
from research.planned_tours import TourPlanner
from research.way_bounds import bounds_m

CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (13, 1), (13, 0)], 1, {})
CROSS = FloorPlan(
    "cross",
    [(4, 0), (4, 4), (0, 4), (0, 5), (4, 5), (4, 9), (5, 9), (5, 5), (9, 5), (9, 4), (5, 4), (5, 0)],
    1,
    {},
)


def _config(range_m: float) -> SimulatorConfig:
    config = find_track("quality").config
    return replace(config, laser=replace(config.laser, range_m=range_m))


def _planner(plan: FloorPlan, at: tuple[float, float], range_m: float) -> TourPlanner:
    config = _config(range_m)
    world = make_world(plan, config.pixels_per_metre, config.robot.radius_m, range_m)
    x, y = world.frame.pixels_from_points(list(at)).tolist()
    return TourPlanner(world, x, y, config)


@pytest.mark.parametrize("share", [0.9, 0.99])
def test_in_a_corridor_the_tour_ends_where_the_laser_reaches_the_share(share: float) -> None:
    found = _planner(CORRIDOR, (1.5, 0.5), 5.0).plan(share, 0)
    assert found is not None
    assert found[0] == pytest.approx(13.0 * share - 5.0 - 1.5, abs=0.3)


def test_three_arms_of_a_cross_are_entered_and_the_last_one_is_not_left() -> None:
    found = _planner(CROSS, (4.5, 0.5), 2.0).plan(0.99, 0)
    assert found is not None
    # 4 m to the middle, and 2.5 m into each arm, until 2 m from its end: twice there and back, once only there. The
    # last hundredth, and corners that are cut, save up to 1.5 m.
    assert 15.0 < found[0] < 16.5


def test_a_tour_is_never_shorter_than_the_bound_and_the_same_for_a_seed() -> None:
    planner = _planner(CROSS, (4.5, 0.5), 2.0)
    config = _config(2.0)
    world = make_world(CROSS, config.pixels_per_metre, config.robot.radius_m, 2.0)
    x, y = world.frame.pixels_from_points([4.5, 0.5]).tolist()
    ways_m, seen = bounds_m(world, x, y, config.robot.radius_m, 2.0)
    for share in (0.5, 0.9, 0.99):
        found, again = planner.plan(share, 7), planner.plan(share, 7)
        assert found is not None
        assert again is not None
        assert found[0] == again[0]
        assert (found[1] == again[1]).all()
        assert found[0] >= ways_m[(seen >= share).argmax()] - 1e-9


def test_a_share_that_is_seen_from_the_start_takes_no_way() -> None:
    found = _planner(CORRIDOR, (6.5, 0.5), 30.0).plan(0.99, 0)
    assert found is not None
    assert found[0] == 0.0
