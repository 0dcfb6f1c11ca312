"""Robots that move by velocities: against arithmetic, against shapely, and against each other."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.ros.fleet import Fleet, Velocity
from houseexpo.pseudoslam.worlds.maps import map_house

HALL = FloorPlan(
    "hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {}, holes=([(5.0, 1.0), (6.0, 1.0), (6.0, 2.0), (5.0, 2.0)],)
)
CONFIG = SimulatorConfig(laser=LaserConfig(12.0, 360.0, 1.0))
ALL_ROUND = np.radians(np.arange(360) - 180.0)


def test_an_arc_is_driven_as_a_unicycle_drives_it() -> None:
    fleet = Fleet(HALL, CONFIG, starts=[(2.0, 1.0, 0.0)])
    for _ in range(100):  # 2 s at 0.5 m/s and 0.5 rad/s: a circle of a radius of 1 m
        fleet.advance([Velocity(0.5, 0.0, 0.5)])
    assert fleet.pose(0) == pytest.approx((2.0 + math.sin(1.0), 1.0 + 1.0 - math.cos(1.0), 1.0), abs=1e-3)
    assert fleet.odometry(0) == pytest.approx((math.sin(1.0), 1.0 - math.cos(1.0), 1.0), abs=1e-3)


def test_sideways_and_backward() -> None:
    fleet = Fleet(HALL, CONFIG, starts=[(2.0, 1.0, math.pi / 2)])
    for _ in range(50):
        fleet.advance([Velocity(-0.3, 0.4, 0.0)])
    assert fleet.pose(0) == pytest.approx((2.0 - 0.4, 1.0 - 0.3, math.pi / 2), abs=1e-9)
    assert fleet.velocity(0).ahead_m_s == pytest.approx(-0.3)
    assert fleet.velocity(0).left_m_s == pytest.approx(0.4)


def test_a_wall_stops_a_robot_within_a_cell() -> None:
    fleet = Fleet(HALL, CONFIG, starts=[(2.0, 3.0, math.pi / 2)])
    for _ in range(150):
        fleet.advance([Velocity(0.5)])
    assert fleet.pose(0)[1] == pytest.approx(4.0 - fleet.radius_m, abs=0.041)
    assert fleet.velocity(0).ahead_m_s == 0.0


def test_a_scan_meets_the_walls_where_they_are() -> None:
    fleet = Fleet(HALL, CONFIG, starts=[(2.3, 1.7, 0.4)])
    ranges = fleet.scan(0, ALL_ROUND, 0.05, 12.0)
    walls = shapely.union_all([shapely.LinearRing(ring) for ring in (HALL.verts, *HALL.holes)])
    for angle, found in zip(ALL_ROUND, ranges, strict=True):
        x, y, heading = fleet.pose(0)
        beam = shapely.LineString([(x, y), (x + 12 * math.cos(heading + angle), y + 12 * math.sin(heading + angle))])
        assert found == pytest.approx(shapely.distance(shapely.Point(x, y), beam.intersection(walls)), abs=1e-5)


def test_in_a_map_a_robot_drives_and_scans_as_in_the_plan_of_the_same_walls() -> None:
    """The hall with walls of two cells, as a map of cells of 0.1 m."""
    cells = np.ones((44, 84), bool)
    cells[2:42, 2:82] = False
    cells[22:32, 52:62] = True  # the hole, 1 to 2 m above the lower wall
    config = replace(CONFIG, pixels_per_metre=10.0)
    in_map = Fleet(map_house(cells, 0.1, origin_m=(-0.2, -0.2), name="hall"), config, starts=[(2.3, 1.7, 0.4)])
    in_plan = Fleet(HALL, config, starts=[(2.3, 1.7, 0.4)])
    found = in_map.scan(0, ALL_ROUND, 0.05, 12.0)
    assert found == pytest.approx(in_plan.scan(0, ALL_ROUND, 0.05, 12.0), abs=1e-5)
    for fleet in (in_map, in_plan):
        for _ in range(50):
            fleet.advance([Velocity(0.3, 0.0, 0.2)])
    assert in_map.pose(0) == pytest.approx(in_plan.pose(0), abs=1e-6)


def test_the_edges_of_cells_in_one_line_are_one_segment() -> None:
    cells = np.ones((6, 8), bool)
    cells[1:5, 1:7] = False
    assert len(Fleet(map_house(cells, 0.5), replace(CONFIG, pixels_per_metre=2.0))._walls) == 4


def test_beams_beyond_the_range_are_infinite() -> None:
    fleet = Fleet(HALL, CONFIG, starts=[(2.0, 2.0, 0.0)])
    ranges = fleet.scan(0, np.array([0.0, math.pi / 2]), 0.05, 2.5)
    assert ranges.tolist() == [math.inf, 2.0]


def test_two_robots_keep_off_each_other_and_part_again() -> None:
    fleet = Fleet(HALL, CONFIG, robots=2, starts=[(1.0, 3.0, 0.0), (3.0, 3.0, math.pi)])
    for _ in range(200):
        fleet.advance([Velocity(0.5), Velocity(0.5)])
    (x, *_), (other, *_) = fleet.pose(0), fleet.pose(1)
    assert 2 * fleet.radius_m <= other - x < 2 * fleet.radius_m + 1e-3
    assert fleet.scan(0, np.zeros(1), 0.05, 12.0)[0] == pytest.approx(other - x - fleet.radius_m, abs=1e-6)
    for _ in range(50):
        fleet.advance([Velocity(-0.5), Velocity(-0.5)])
    assert fleet.pose(1)[0] - fleet.pose(0)[0] == pytest.approx(other - x + 1.0, abs=1e-6)


def test_people_keep_off_all_robots() -> None:
    fleet = Fleet(HALL, replace(CONFIG, people=PeopleConfig(number=6)), robots=4, seed=1, tick_s=0.1)
    touch_m, nearest_m = fleet.radius_m + fleet.config.people.radius_m, math.inf
    for _ in range(300):
        fleet.advance([Velocity(0.4, 0.0, 0.3)] * 4)
        robots = np.array([fleet.pose(k)[:2] for k in range(4)])
        nearest_m = min(nearest_m, float(np.hypot(*(robots[:, None] - fleet.people_m()).T).min()))
    assert touch_m - 1e-6 <= nearest_m < touch_m + 0.05
    with pytest.raises(ConfigError, match="pose: a person is at"):
        fleet.place(3, (*fleet.people_m()[0].tolist(), 0.0))


def test_equal_seeds_give_equal_runs() -> None:
    noise = NoiseConfig(laser_m=0.02, odometry_way=0.05, odometry_turn=0.05, drop_out=0.1)
    config = replace(CONFIG, noise=noise, people=PeopleConfig(number=2))

    def run() -> list[object]:
        fleet = Fleet(HALL, config, robots=3, seed=5)
        for _ in range(40):
            fleet.advance([Velocity(0.4, 0.0, 0.3)] * 3)
        scans = [fleet.scan(k, ALL_ROUND, 0.05, 12.0).tobytes() for k in range(3)]
        return [
            *(fleet.pose(k) for k in range(3)),
            *(fleet.odometry(k) for k in range(3)),
            *scans,
            fleet.people_m().tolist(),
        ]

    assert run() == run()


def test_odometry_drifts_and_the_truth_does_not() -> None:
    still = Fleet(HALL, CONFIG, starts=[(2.0, 2.0, 0.0)])
    fleet = Fleet(HALL, replace(CONFIG, noise=NoiseConfig(odometry_way=0.2)), starts=[(2.0, 2.0, 0.0)])
    for _ in range(50):
        still.advance([Velocity(0.5)])
        fleet.advance([Velocity(0.5)])
    assert fleet.pose(0) == still.pose(0)
    assert 0.001 < abs(fleet.odometry(0)[0] - 0.5) < 0.1


def test_reset_begins_again() -> None:
    fleet = Fleet(HALL, CONFIG, robots=2, seed=3)
    before = [fleet.pose(k) for k in range(2)]
    fleet.advance([Velocity(0.5), Velocity(0.5)])
    fleet.reset()
    assert [fleet.pose(k) for k in range(2)] == before
    assert fleet.odometry(0) == (0.0, 0.0, 0.0)


def test_what_cannot_be_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match=r"robots: expected a number from 1 to 16, found 0"):
        Fleet(HALL, CONFIG, robots=0)
    with pytest.raises(
        ConfigError, match=r"robot 2 at \(1.1, 1\) m overlaps robot 1 at \(1, 1\) m; leave at least 0.4 m"
    ):
        Fleet(HALL, CONFIG, robots=2, starts=[(1.0, 1.0, 0.0), (1.1, 1.0, 0.0)])
    closet = FloorPlan("closet", [(0, 0), (0, 1), (1, 1), (1, 0)], 1, {})
    with pytest.raises(ConfigError, match=r"no room for robot \d+ of 16 with a radius of 0.2 m in plan 'closet'"):
        Fleet(closet, CONFIG, robots=16)
    fleet = Fleet(HALL, CONFIG, robots=2, starts=[(1.0, 1.0, 0.0), (3.0, 1.0, 0.0)])
    with pytest.raises(ConfigError, match=r"pose: another robot is at"):
        fleet.place(0, (3.1, 1.0, 0.0))
    with pytest.raises(ConfigError, match=r"does not fit at \(5.5, 1.5\) m"):
        fleet.place(0, (5.5, 1.5, 0.0))
    with pytest.raises(ConfigError, match="velocity: expected at most"):
        fleet.advance([Velocity(1e6), Velocity()])
