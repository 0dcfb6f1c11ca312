"""MapEx's nearest frontier: its frontiers, its choice by the straight line, and its target that is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.explorers import NearestFrontier
from houseexpo.pseudoslam.agents.mapex import MapExNearest, find_frontier_centres
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot, make_knowledge, make_robot
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN

Map = npt.NDArray[np.uint8]
CONFIG = SimulatorConfig(10.0, RobotConfig(0.1), LaserConfig(20.0, 360.0, 0.5))
WIDE = SimulatorConfig(10.0, RobotConfig(0.3), LaserConfig(20.0, 360.0, 0.5))  # goes straight along a hall
FORWARD, LEFT = 0, 1


def slow_centres(known: Map) -> list[tuple[int, int]]:
    """The definition, cell by cell."""
    rows, cols = known.shape

    def around(r: int, c: int) -> list[tuple[int, int]]:
        near = [(r + i, c + j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
        return [(i, j) for i, j in near if 0 <= i < rows and 0 <= j < cols]

    edge = {
        (r, c)
        for r in range(rows)
        for c in range(cols)
        if known[r, c] == FREE and any(known[cell] == UNKNOWN for cell in around(r, c))
    }
    found, left = [], set(edge)
    for start in sorted(edge):
        if start not in left:
            continue
        region, todo = [], [start]
        left.remove(start)
        while todo:
            cell = todo.pop()
            region.append(cell)
            for other in around(*cell):
                if other in left:
                    left.remove(other)
                    todo.append(other)
        if len(region) > 10:
            region.sort()
            row, col = (sum(cell[k] for cell in region) / len(region) for k in (0, 1))
            found.append(min(region, key=lambda cell: (cell[0] - row) ** 2 + (cell[1] - col) ** 2))
    return found


def test_frontiers_are_those_of_the_definition() -> None:
    rng, seen = np.random.default_rng(4), 0
    for _ in range(30):
        coarse = rng.choice(np.array([UNKNOWN, FREE, FREE, OBSTACLE], np.uint8), (6, 8))
        known = np.kron(coarse, np.ones((5, 5), np.uint8)).astype(np.uint8)
        found = [tuple(cell) for cell in find_frontier_centres(known).tolist()]
        assert found == slow_centres(known)
        seen += len(found)
    assert seen > 60
    assert find_frontier_centres(np.full((9, 9), FREE, np.uint8)).shape == (0, 2)


@pytest.mark.parametrize(("length", "number"), [(10, 0), (11, 1)])
def test_a_region_has_more_than_ten_cells(length: int, number: int) -> None:
    known = np.full((20, 40), OBSTACLE, np.uint8)
    known[5, 5 : 5 + length], known[4, 5 : 5 + length] = FREE, UNKNOWN
    assert len(find_frontier_centres(known)) == number


def told(known: Map, row: float, col: float) -> Knowledge:
    """The robot at a cell, heading right."""
    pose = np.array([col + 0.5, row + 0.5, 0.0])
    return {"map": known.copy(), "pose_px": pose, "collided": False, "steps": 1, "path_m": 0.0}


def floor() -> Map:
    """A hall of 6 m by 3 m, whose right side is unknown."""
    known = np.full((60, 120), OBSTACLE, np.uint8)
    known[20:50, 20:80] = FREE
    known[20:50, 80:90] = UNKNOWN
    return known


def test_nearest_is_by_the_straight_line() -> None:
    """Above the robot, behind a wall, is a frontier 2 m away, whose way leads to the left."""
    known = floor()
    known[20:50, 10:20] = FREE
    known[5:20, 10:13] = FREE
    known[10:14, 10:66] = FREE
    known[5:10, 45:66] = UNKNOWN
    told_here = told(known, 35, 50)
    assert MapExNearest(Robot(CONFIG), 0)(None, told_here) == LEFT
    assert NearestFrontier(Robot(WIDE), 0)(None, told_here) == FORWARD


def test_a_target_is_kept_until_the_robot_is_there() -> None:
    """The frontier at the right is seen from far; another appears, nearer and at the left."""
    known = floor()
    mapex, ours = MapExNearest(Robot(CONFIG), 0), NearestFrontier(Robot(WIDE), 0)
    assert [policy(None, told(known, 34, 40)) for policy in (mapex, ours)] == [FORWARD, FORWARD]
    known[20:50, 80:90] = FREE
    known[20:50, 15:20] = UNKNOWN
    assert mapex(None, told(known, 34, 43)) == FORWARD
    assert ours(None, told(known, 34, 43)) != FORWARD
    assert mapex(None, told(known, 34, 72)) != FORWARD  # within 1 m of its target: it turns to the other


def test_it_is_done_when_no_frontier_is_left() -> None:
    known = floor()
    known[20:50, 80:90] = OBSTACLE
    assert MapExNearest(Robot(CONFIG), 0)(None, told(known, 35, 40)) is None


@pytest.mark.parametrize("fov_deg", [360.0, 180.0])
def test_it_explores_a_house(fov_deg: float) -> None:
    plan = FloorPlan("angle", [(0, 0), (0, 12), (4, 12), (4, 3), (14, 3), (14, 0)], 1, {})
    config = SimulatorConfig(10.0, RobotConfig(0.1), LaserConfig(5.0, fov_deg, 0.5), max_steps=600)
    env = ExplorationEnv(plan, config, success_coverage=None)
    observation, info = env.reset(seed=3)
    policy: Any = MapExNearest(make_robot(env, MapExNearest.interface), 0)
    while (action := policy(observation, make_knowledge(env.simulator, env.state))) is not None:
        observation, _, _, truncated, info = env.step(action)
        assert not truncated
    assert info["coverage"] > 0.95
