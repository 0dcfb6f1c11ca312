"""The policies that come with the project, in houses where it is known what they do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.loading import NAMES, load_policy
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge, make_robot
from houseexpo.pseudoslam.agents.simple import WallFollower
from houseexpo.pseudoslam.config import GoalConfig, LaserConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv, PseudoSlamEnv
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.planner_types import FRONTIER
from houseexpo.pseudoslam.planning import MapPlanner
from tests.builders.simulations import flat
from tests.builders.tries import slow_but

HALL = FloorPlan("hall", [(0, 0), (0, 8), (10, 8), (10, 0)], 1, {})
ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (3, 8), (3, 2), (9, 2), (9, 0)], 1, {})
POCKET = FloorPlan(
    "pocket", [(0, 0), (0, 6), (10, 6), (10, 0), (6, 0), (6, 4.5), (5.8, 4.5), (5.8, 0)], 1, {}
)  # a wall from below to 4.5 m
EXPLORERS = ("frontier", "information", "prospector", "tour", "oracle")


def config(x_m: float, y_m: float, heading_deg: float = 0.0, **others: Any) -> SimulatorConfig:
    start = StartConfig(random=False, x_m=x_m, y_m=y_m, heading_deg=heading_deg)
    return SimulatorConfig(pixels_per_metre=16.0, start=start, max_steps=400, **others)


def episode(name: str, env: PseudoSlamEnv, seed: int = 0) -> Iterator[dict[str, Any]]:
    """Yield the action, the pose and ``info`` of each step."""
    policy = load_policy(name)
    observation, info = env.reset(seed=seed)
    acts = policy.factory(make_robot(env, policy.interface), seed)
    while (action := acts(observation, make_knowledge(env.simulator, env.state))) is not None:
        observation, _, terminated, truncated, info = env.step(action)
        yield {"action": action, **info}
        if terminated or truncated:
            return


def test_forward_turns_where_it_was_blocked_and_nowhere_else() -> None:
    steps = list(episode("forward", ExplorationEnv(HALL, config(2.0, 4.0), success_coverage=None)))
    blocked = False
    for before, now in pairwise(steps):
        blocked = before["collided"] or (blocked and before["action"] != 0)
        assert now["action"] == 0 or blocked
    assert sum(step["collided"] for step in steps) > 5


def test_who_spins_stays_where_it_is() -> None:
    steps = list(episode("spin", ExplorationEnv(HALL, config(2.0, 4.0), success_coverage=None)))
    assert {step["action"] for step in steps} == {1}
    assert {tuple(step["pose"][:2]) for step in steps} == {(2.0, 4.0)}


def test_a_random_frontier_is_any_of_them_and_the_seed_says_which() -> None:
    chooser = load_policy("random-frontier").factory(Robot(config(1.0, 1.0)), 7)
    again = load_policy("random-frontier").factory(Robot(config(1.0, 1.0)), 7)
    frontiers = np.zeros(4, FRONTIER)
    drawn = [chooser.choose(None, frontiers, None) for _ in range(400)]
    assert drawn == [again.choose(None, frontiers, None) for _ in range(400)]
    assert all(70 <= drawn.count(k) <= 130 for k in range(4))


def test_the_wall_follower_goes_round_a_hall_with_the_wall_on_its_right() -> None:
    steps = list(episode("wall", ExplorationEnv(HALL, config(5.0, 4.0), success_coverage=None)))
    poses = np.array([step["pose"] for step in steps[60:]])
    x, y = poses[:, 0], poses[:, 1]
    to_wall = np.minimum(np.minimum(x, 10 - x), np.minimum(y, 8 - y))
    assert to_wall.max() < 1.3  # it cuts corners
    turned = np.unwrap(np.arctan2(y - 4, x - 5))
    assert turned[-1] - turned[0] > 2 * math.pi  # counter-clockwise: the wall is on the right
    assert steps[-1]["collisions"] <= 2


@pytest.mark.parametrize("pixels_per_metre", [16.0, 25.0, 33.0])
def test_the_wall_follower_knows_no_wall_at_first(pixels_per_metre: float) -> None:
    """Nothing is within its reach, to the last bit of what is near."""
    robot = Robot(SimulatorConfig(pixels_per_metre=pixels_per_metre))
    free = np.full((100, 100), FREE, np.uint8)
    info: Any = {"map": free, "pose_px": np.array([50.3, 50.7, 1.0]), "collided": False, "steps": 0, "path_m": 0.0}
    assert WallFollower(robot, 0)(None, info) == 0


def test_the_wall_follower_crosses_what_is_open() -> None:
    steps = list(episode("wall", ExplorationEnv(HALL, config(5.0, 4.0), success_coverage=None)))
    assert {step["action"] for step in steps[:10]} == {0}


@pytest.mark.parametrize("name", EXPLORERS)
@pytest.mark.parametrize("seed", slow_but([0, 1], 0))
def test_explorers_see_all_round_a_corner(name: str, seed: int) -> None:
    env = ExplorationEnv(ANGLE, SimulatorConfig(pixels_per_metre=16.0, max_steps=400), success_coverage=1.0)
    steps = list(episode(name, env, seed))
    assert steps[-1]["coverage"] == 1.0
    assert len(steps) < {"information": 200, "prospector": 300}.get(name, 150)
    assert steps[-1]["collisions"] <= 1


def test_a_large_area_far_off_is_worth_its_way_to_a_prospector_and_twenty_niches_are_not() -> None:
    config = SimulatorConfig(pixels_per_metre=10.0, laser=LaserConfig(20.0, 360.0))
    known = np.full((100, 600), OBSTACLE, np.uint8)
    known[40:60, 20:420] = FREE  # a corridor of 40 m with niches of 1 x 1 m, one beside the robot, and a hall
    known[1:99, 420:599] = UNKNOWN
    for col in range(60, 400, 17):
        known[30:40, col : col + 10] = UNKNOWN
    chosen = {}
    for name in ("information", "prospector"):
        policy = load_policy(name).factory(Robot(config), 0)
        planner = MapPlanner(config)
        frontiers = planner.frontiers(known, 65.0, 50.0)
        chosen[name] = frontiers["goal"][policy.choose(known, frontiers, None)] % 600
    assert chosen["information"] < 80
    assert chosen["prospector"] > 400


def test_explorers_are_done_when_nothing_is_left() -> None:
    env = ExplorationEnv(ANGLE, config(1.0, 1.0), success_coverage=None)
    steps = list(episode("frontier", env))
    assert steps[-1]["coverage"] == 1.0
    assert len(steps) < 150


def test_equal_seeds_are_equal_episodes() -> None:
    for name in NAMES:
        tasks, actions = load_policy(name).interface.tasks, load_policy(name).interface.actions
        if tasks[:1] == ("search",):
            env: Any = NavigationEnv(flat(), config(6.0, 1.0, goal=GoalConfig(kind="room")))
        elif "navigation" in tasks:
            env = NavigationEnv(POCKET, config(1.0, 1.0, goal=GoalConfig(), known_map=True), actions=actions)
        else:
            env = ExplorationEnv(POCKET, config(1.0, 1.0), actions=actions)
        one, other = (
            [(*np.atleast_1d(step["action"]), *step["pose"]) for step in episode(name, env, 3)] for _ in range(2)
        )
        assert one == other, name


def navigation(known_map: bool) -> NavigationEnv:
    """From the left of a wall to the right of it."""
    goal = GoalConfig(random=False, x_m=8.0, y_m=1.0)
    return NavigationEnv(POCKET, config(2.0, 1.0, known_map=known_map, goal=goal))


@pytest.mark.parametrize("known_map", [True, False])
def test_a_star_goes_round_the_wall(known_map: bool) -> None:
    last = list(episode("a-star", navigation(known_map)))[-1]
    assert last["is_success"]
    assert last["spl"] > (0.9 if known_map else 0.5)
    assert last["collisions"] <= 1


def test_greedy_runs_against_the_wall() -> None:
    steps = list(episode("greedy", navigation(False)))
    assert max(step["pose"][0] for step in steps[:40]) < 5.8
    assert sum(step["collided"] for step in steps) > 2


def test_greedy_gets_there_where_nothing_is_in_the_way() -> None:
    env = NavigationEnv(HALL, config(2.0, 1.0, heading_deg=90.0, goal=GoalConfig(random=False, x_m=8.0, y_m=5.0)))
    last = list(episode("greedy", env))[-1]
    assert last["is_success"]
    assert last["spl"] > 0.9


def test_the_oracle_wants_the_truth() -> None:
    env = ExplorationEnv(ANGLE, config(1.0, 1.0))
    env.reset(seed=0)
    oracle = load_policy("oracle")
    assert oracle.interface.sees_truth
    assert not any(load_policy(name).interface.sees_truth for name in NAMES if name not in {"oracle", "shortest"})
    with pytest.raises(ConfigError, match="policy 'oracle': expected to be given the world"):
        oracle.factory(make_robot(env, load_policy("frontier").interface), 0)


def test_random_takes_each_of_the_three_motions_equally_often() -> None:
    env = ExplorationEnv([HALL], config=config(2.0, 2.0))
    policy = load_policy("random")
    acts = policy.factory(make_robot(env, policy.interface), 0)
    counts = np.bincount([acts(None, None) for _ in range(3000)], minlength=3)  # type: ignore[arg-type]
    assert np.abs(counts - 1000).max() < 4 * math.sqrt(3000 * (1 / 3) * (2 / 3))  # four standard deviations
