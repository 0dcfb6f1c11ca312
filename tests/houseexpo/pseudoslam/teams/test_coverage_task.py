"""Coverage: PettingZoo's own tests, swept areas whose size is known, and a slow twin of the kernels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.plan import Room
from houseexpo.pseudoslam import parallel_env
from houseexpo.pseudoslam.config import RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.walls import length_in_walls, mark_sweepable_cells, mark_swept_cells

pytest.importorskip("pettingzoo")

ROOM = FloorPlan("room", [(0, 0), (0, 3), (6, 3), (6, 0)], 1, {})
TWO_ROOMS = FloorPlan(
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 2, {},
    rooms=(
        Room(0, "Kitchen", np.array([(0, 0), (0, 4), (4.2, 4), (4.2, 3), (4, 3), (4, 0)])),
        Room(1, "Bedroom", np.array([(4.2, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4.2, 3)])),
    ),
)  # fmt: skip


@pytest.mark.slow
def test_pettingzoo_accepts_it() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel_env("coverage", robots=3, dataset=TWO_ROOMS), num_cycles=100)
    parallel_seed_test(
        lambda: parallel_env("coverage", robots=2, dataset=TWO_ROOMS, rooms=("Kitchen",), observation="dict"), 40
    )


def test_a_straight_way_covers_a_strip_and_the_way_back_overlaps_it() -> None:
    config = SimulatorConfig(known_map=True, robot=RobotConfig(step_m=0.5, turn_deg=180.0))
    env = parallel_env("coverage", robots=1, dataset=ROOM, tool_m=0.4, config=config)
    _, infos = env.reset(seed=0, options={"pose": (1.0, 1.5, 0.0)})
    covered = infos["robot_0"]["team"]["covered"]
    disc, total = math.pi * 0.4**2, int(env.episode._cells.sum()) / 25**2
    assert total == pytest.approx(18.0, rel=0.01)  # robots stand 0.2 m from walls, and the tool reaches 0.4 m
    assert covered * total == pytest.approx(disc, rel=0.03)
    assert infos["robot_0"]["team"]["overlap"] == 0.0
    _, rewards, _, _, infos = env.step({"robot_0": 0})
    assert rewards["robot_0"] == pytest.approx(0.5 * 0.8, rel=0.07)  # a strip, 0.8 m wide; a cell is 0.04 m
    assert infos["robot_0"]["team"]["covered"] * total == pytest.approx(covered * total + rewards["robot_0"])
    assert infos["robot_0"]["team"]["overlap"] == 0.0
    _, rewards, _, _, infos = env.step({"robot_0": 1})  # it turns round: the tool is over less than before
    assert rewards["robot_0"] == 0.0
    assert infos["robot_0"]["team"]["overlap"] == 0.0
    swept = (disc + 0.4) - disc  # what the tool was not over when it had turned
    _, rewards, _, _, infos = env.step({"robot_0": 0})
    assert rewards["robot_0"] == 0.0
    assert infos["robot_0"]["team"]["overlap"] == pytest.approx(swept / (disc + 0.4 + swept), abs=0.03)


def test_two_robots_over_the_same_cells_overlap_and_the_first_has_the_reward() -> None:
    env = parallel_env("coverage", robots=2, dataset=ROOM, tool_m=0.5, reward="coverage")
    _, infos = env.reset(seed=0, options={"pose": [(2.0, 1.5, 0.0), (2.5, 1.5, 0.0)]})
    team = infos["robot_0"]["team"]
    d, r = 0.5, 0.5
    lens = 2 * r * r * math.acos(d / (2 * r)) - d / 2 * math.sqrt(4 * r * r - d * d)
    assert team["overlap"] == pytest.approx(lens / (2 * math.pi * r * r), abs=0.02)
    _, rewards, *_ = env.step({"robot_0": 0, "robot_1": 0})
    assert rewards["robot_0"] * 18.0 == pytest.approx(0.0, abs=0.05)  # nearly all was under one of both before
    assert rewards["robot_1"] * 18.0 == pytest.approx(0.3, abs=0.05)


def test_only_the_chosen_rooms_count_and_the_end_is_when_enough_is_covered() -> None:
    env = parallel_env("coverage", robots=1, dataset=TWO_ROOMS, rooms=["Bedroom"], success_coverage=0.02)
    observed, infos = env.reset(seed=0, options={"pose": (1.0, 1.0, 0.0)})
    assert infos["robot_0"]["team"]["covered"] == 0.0
    assert not observed["robot_0"]["todo"][0].any()  # the bedroom is not near
    assert observed["robot_0"]["todo"][1].any()
    cells = env.episode.todo
    cols = np.flatnonzero(cells.any(axis=0))
    x_m = env.team.world.frame.points_from_pixels([[cols[0], 10], [cols[-1] + 1, 10]])[:, 0]
    assert x_m == pytest.approx([4.2, 8.0], abs=0.1)
    _, infos = env.reset(seed=0, options={"pose": (6.0, 2.0, 0.0)})
    assert infos["robot_0"]["is_success"] == (infos["robot_0"]["team"]["covered"] >= 0.02)
    while env.agents:
        _, _, ends, _, infos = env.step({"robot_0": 0})
    assert ends["robot_0"]
    assert infos["robot_0"]["team"]["steps_to_cover"] == infos["robot_0"]["team"]["makespan"]


def test_bad_rooms_say_what_there_is() -> None:
    env = parallel_env("coverage", robots=1, dataset=TWO_ROOMS, rooms=["Garage"])
    with pytest.raises(ConfigError, match="has no Garage; its rooms are Bedroom, Kitchen"):
        env.reset(seed=0)
    with pytest.raises(ConfigError, match="rooms: expected labels of rooms, found 'Kitchn'"):
        parallel_env("coverage", dataset=TWO_ROOMS, rooms=["Kitchn"])
    with pytest.raises(ConfigError, match="rooms: expected a list of labels"):
        parallel_env("coverage", dataset=TWO_ROOMS, rooms="Kitchen")


def test_the_kernels_agree_with_a_slow_twin() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        walls = (rng.random((18, 22)) < 0.08).astype(np.uint8)
        walls[[0, -1]] = walls[:, [0, -1]] = 1
        wanted = ((rng.random(walls.shape) < 0.8) & (walls == 0)).astype(np.uint8)
        x, y, to_x, to_y = rng.uniform(3, 15, 4)
        radius = rng.uniform(0.5, 4.0)
        under, slow = np.zeros_like(walls), np.zeros_like(walls)
        mark_swept_cells(walls, x, y, to_x, to_y, radius, wanted, under)
        way = np.array([to_x - x, to_y - y])
        for row, col in np.argwhere(wanted):
            centre = np.array([col + 0.5, row + 0.5])
            along = min(max(float((centre - (x, y)) @ way / (way @ way)), 0.0), 1.0)
            near = np.array([x, y]) + along * way
            if math.dist(near, centre) <= radius and length_in_walls(walls, *near, *centre) == 0.0:
                slow[row, col] = 1
        assert np.array_equal(under, slow)
        standing = ((rng.random(walls.shape) < 0.2) & (walls == 0)).astype(np.uint8)
        found, slow = np.zeros_like(walls), np.zeros_like(walls)
        mark_sweepable_cells(walls, standing, radius, wanted, found)
        for row, col in np.argwhere(standing):
            once = np.zeros_like(walls)
            mark_swept_cells(walls, col + 0.5, row + 0.5, col + 0.5, row + 0.5, radius, wanted, once)
            slow |= once
        assert np.array_equal(found, slow)
