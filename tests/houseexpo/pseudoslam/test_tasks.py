"""The three tasks, by hand: rewards, ends, and what info says of them."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import GoalConfig, ObservationConfig, RobotConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.envs.single import NavigationEnv
from houseexpo.pseudoslam.kernels.collision import disc_is_free
from houseexpo.pseudoslam.tasks import Navigation
from houseexpo.pseudoslam.worlds.world import traversable_cells
from tests.builders.simulations import HUTS, at, hall

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (10, 1), (10, 0)], 1, {})
SMALL = SimulatorConfig(pixels_per_metre=20.0, observation=ObservationConfig(3.0))
FORWARD, LEFT, RIGHT = range(3)


def start(x_m: float, y_m: float, heading_deg: float) -> StartConfig:
    return StartConfig(random=False, x_m=x_m, y_m=y_m, heading_deg=heading_deg)


def avoiding(x_m: float, y_m: float, heading_deg: float, **given: Any) -> Any:
    config = replace(SMALL, start=start(x_m, y_m, heading_deg))
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0", dataset=HALL, config=config, **given).unwrapped
    env.reset(seed=0)
    return env


def navigating(plan: FloorPlan, at: StartConfig, goal: tuple[float, float], **given: Any) -> Any:
    config = replace(SMALL, start=at, goal=GoalConfig(False, *goal), known_map=True)
    return gymnasium.make("PseudoSLAM/Navigation-v0", dataset=plan, config=config, **given).unwrapped


def test_exploration_pays_for_what_becomes_known() -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HUTS, config=SMALL, success_coverage=None).unwrapped
    _, info = env.reset(seed=1)
    first, total = info["explored_m2"], 0.0
    moves = np.random.default_rng(0)
    for _ in range(60):
        before = int((env.state.known != 0).sum())
        _, reward, terminated, _, info = env.step(moves.choice(3, p=[0.6, 0.2, 0.2]))
        assert reward == pytest.approx((int((env.state.known != 0).sum()) - before) / 20**2)
        assert not terminated
        total += reward
    assert info["explored_m2"] == pytest.approx((env.state.known != 0).sum() / 20**2)
    assert total == pytest.approx(info["explored_m2"] - first)


@pytest.mark.parametrize(("x", "safe_m", "share"), [(4.0, 0.5, 1.0), (0.5, 0.5, 0.6), (0.5, 1.0, 0.3), (0.2, 0.5, 0.0)])
def test_way_pays_more_where_there_is_more_room(x: float, safe_m: float, share: float) -> None:
    """The rim is x - 0.2 m from the wall on the left; a step forward along it does not change that."""
    env = avoiding(x, 2.0, 90.0, safe_m=safe_m, reward="way")
    _, reward, _, _, info = env.step(FORWARD)
    assert info["clearance_m"] == pytest.approx(min(x - 0.2, safe_m))
    assert reward == pytest.approx(0.9 * share + 0.1)


def test_a_collision_leaves_the_robot_where_it_touches_and_counts() -> None:
    env = avoiding(0.4, 2.0, 180.0)
    radius_px = 0.2 * 20
    for hits in (1, 2, 3):
        _, reward, terminated, _, info = env.step(FORWARD)
        assert (reward, terminated, info["collided"], info["collisions"]) == (-1.0, False, True, hits)
        assert info["pose"] == pytest.approx([0.2, 2.0, math.pi], abs=1e-6)
        assert info["clearance_m"] == pytest.approx(0.0, abs=1e-6)
        assert disc_is_free(env.state.occupied, *env.state.pose_px[:2], radius_px)
    _, reward, _, _, info = env.step(LEFT)
    assert not info["collided"]
    assert info["collisions"] == 3
    assert reward > 0.0  # what the turn let it see
    assert env.step(RIGHT)[4]["collisions"] == 3


def test_a_collision_ends_the_episode_if_asked_to() -> None:
    env = avoiding(0.7, 2.0, 180.0, terminate_on_collision=True)
    assert env.step(FORWARD)[2:4] == (False, False)
    _, reward, terminated, truncated, info = env.step(FORWARD)
    assert (reward, terminated, truncated, info["is_success"]) == (-1.0, True, False, False)


def test_the_papers_room_has_one_to_five_objects_and_200_steps() -> None:
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0").unwrapped
    assert env.config.obstacles.random.number == (1, 5)
    env.reset(seed=0)
    assert env.simulator.world.frame.shape[1] / 33 == pytest.approx(5.5, abs=0.1)
    counts = Counter[int]()
    for _ in range(300):
        env.reset()
        counts[len(env.state.obstacles)] += 1
    assert set(counts) == {1, 2, 3, 4, 5}
    assert all(35 <= count <= 85 for count in counts.values())  # 60 with a deviation of 7
    for step in range(1, 201):
        *_, terminated, truncated, info = env.step(LEFT)
        assert (terminated, truncated) == (False, step == 200)
        assert info["is_success"] == (step == 200)  # turning touches nothing


def test_nothing_is_ever_overlapped_and_rewards_stay_in_their_bounds() -> None:
    env = gymnasium.make("PseudoSLAM/ObstacleAvoidance-v0").unwrapped
    moves = np.random.default_rng(0)
    collided = 0
    for seed in range(5):
        env.reset(seed=seed)
        for _ in range(40):
            _, reward, _, _, info = env.step(moves.choice(3, p=[0.8, 0.1, 0.1]))
            collided += info["collided"]
            assert reward == -1.0 if info["collided"] else 0.0 <= reward <= 0.9 * 5.5 * 3.2 + 0.1
            assert disc_is_free(env.state.occupied, *env.state.pose_px[:2], 0.2 * 33)
    assert collided > 20


def test_navigation_pays_for_the_way_that_is_saved() -> None:
    env = gymnasium.make("PseudoSLAM/Navigation-v0", dataset=HUTS, config=SMALL).unwrapped
    moves = np.random.default_rng(0)
    for seed in range(4):
        _, info = env.reset(seed=seed)
        first, total, terminated = info["to_goal_m"], 0.0, False
        for _ in range(50):
            _, reward, terminated, _, info = env.step(moves.choice(3, p=[0.6, 0.2, 0.2]))
            total += reward
            if terminated:
                break
        assert total == pytest.approx(first - info["to_goal_m"] + 2.5 * terminated, abs=1e-6)


def test_a_straight_way_to_the_goal_has_an_spl_of_1() -> None:
    env = navigating(CORRIDOR, start(1, 0.5, 0), (6, 0.5), success_reward=7.0)
    _, info = env.reset(seed=0)
    assert info["to_goal_m"] == pytest.approx(5.0, abs=0.1)
    assert info["spl"] == 0.0
    for step in range(1, 17):
        _, reward, terminated, _, info = env.step(FORWARD)
        assert terminated == info["is_success"] == (1 + 0.3 * step >= 6 - 0.3 - 1e-9)
        assert (reward > 6.5) == terminated
    assert terminated
    assert info["way_m"] == pytest.approx(4.8)
    assert info["spl"] == 1.0


def test_a_detour_has_less() -> None:
    env = navigating(CORRIDOR, start(1, 0.5, 180), (6, 0.5))
    env.reset(seed=0)
    for action in [FORWARD] * 2 + [LEFT] * 18 + [FORWARD] * 18:
        assert env.state.counts[0] < 38
        *_, terminated, _, info = env.step(action)
    assert terminated
    assert info["way_m"] == pytest.approx(0.6 + 5.4)
    assert info["spl"] == pytest.approx(5.0 / 6.0, abs=0.01)


def test_the_way_leads_round_a_wall() -> None:
    verts = [(0, 0), (0, 4), (2.9, 4), (2.9, 1), (3.1, 1), (3.1, 4), (6, 4), (6, 0)]
    env = navigating(FloorPlan("bay", verts, 1, {}), start(1, 3.5, 0), (5, 3.5))
    _, info = env.reset(seed=0)
    to_corner, arc = math.sqrt(1.9**2 + 2.5**2 - 0.2**2), 0.2 * math.radians(56.4)  # 0.2 m off the end of the wall
    assert info["to_goal_m"] == pytest.approx(2 * (to_corner + arc) + 0.2, rel=0.06)  # ways go by blocks of 0.1 m


@pytest.mark.parametrize(("ppm", "radius_m"), [(25.0, 0.03), (50.0, 0.03), (50.0, 0.05)])
def test_the_way_of_a_small_robot_leads_round_a_thin_wall(ppm: float, radius_m: float) -> None:
    """The wall, 6 cm, and twice the robot's radius are less than two blocks of 0.1 m: through it are 1.1 m."""
    verts = [(0, 0), (0, 4), (2.97, 4), (2.97, 1), (3.03, 1), (3.03, 4), (6, 4), (6, 0)]
    config = replace(SMALL, pixels_per_metre=ppm, robot=RobotConfig(radius_m), goal=GoalConfig(False, 3.5, 3.5))
    env = gymnasium.make("PseudoSLAM/Navigation-v0", dataset=FloorPlan("bay", verts, 1, {}), config=config)
    _, info = env.reset(seed=0, options={"pose": (2.5, 3.5, 0.0)})
    assert info["to_goal_m"] == pytest.approx(2 * math.hypot(0.5, 2.5), rel=0.1)


@pytest.mark.parametrize("heading", [0.0, 90.0, 30.0, -135.0])
def test_the_goal_is_seen_ahead_and_to_the_left(heading: float) -> None:
    env = navigating(HALL, start(2, 1, heading), (5, 1.5))
    observation, info = env.reset(seed=0)
    angle = math.radians(heading)
    right, up = 3.0, 0.5
    ahead, left = right * math.cos(angle) + up * math.sin(angle), up * math.cos(angle) - right * math.sin(angle)
    assert observation["goal"] == pytest.approx([ahead, left], abs=1e-5)
    assert info["goal"] == pytest.approx([5.0, 1.5])
    if heading == 0.0:
        assert env.step(FORWARD)[0]["goal"] == pytest.approx([2.7, 0.5], abs=1e-5)
    if heading == 90.0:
        assert observation["goal"] == pytest.approx([0.5, -3.0], abs=1e-5)


def test_random_goals_can_be_reached() -> None:
    some = ObstaclesConfig(random=RandomObstacles((1, 3), (0.3, 0.8)))
    env = gymnasium.make("PseudoSLAM/Navigation-v0", dataset=HUTS, config=replace(SMALL, obstacles=some)).unwrapped
    for seed in range(40):
        _, info = env.reset(seed=seed)
        frame = env.simulator.world.frame
        x, y = frame.pixels_from_points(info["goal"]).tolist()
        assert traversable_cells(env.state.occupied, 0.2 * 20)[math.floor(y), math.floor(x)]
        pose_x, pose_y, _ = info["pose"]
        straight = math.hypot(info["goal"][0] - pose_x, info["goal"][1] - pose_y)
        assert straight - 0.15 <= info["to_goal_m"] < 20.0  # blocks of 0.1 m
        assert info["to_goal_m"] > 1.7


@pytest.mark.parametrize("goal", [(-1.0, 2.0), (0.05, 2.0), (1e9, 2.0), (8.0, 4.0)])
def test_a_goal_in_a_wall_is_refused(goal: tuple[float, float]) -> None:
    env = navigating(HALL, start(2, 1, 0), goal)
    with pytest.raises(ConfigError, match=r"goal: the robot cannot stand at \(.*\) m in plan 'hall'"):
        env.reset(seed=0)


def test_continuous_actions_are_executed_exactly_the_turn_first() -> None:
    config = replace(SMALL, start=start(4, 2, 30))
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HALL, config=config, actions="continuous").unwrapped
    env.reset(seed=0)
    x, y, heading = 4.0, 2.0, math.radians(30)
    for linear, angular in ((0.5, -0.25), (-1.0, 0.0), (0.125, 1.0), (0.0, 0.0625), (0.03125, -1.0)):
        heading += angular * math.radians(10)
        x, y = x + linear * 0.3 * math.cos(heading), y + linear * 0.3 * math.sin(heading)
        *_, info = env.step(np.array([linear, angular], np.float32))
        assert info["pose"] == pytest.approx([x, y, heading], abs=1e-9)


@pytest.mark.parametrize(
    ("task", "given", "text"),
    [
        ("Exploration", {"success_coverage": 0}, "success_coverage: expected more than 0, found 0"),
        ("Exploration", {"success_coverage": 1.2}, "success_coverage: expected at most 1, found 1.2"),
        ("ObstacleAvoidance", {"safe_m": 0}, "safe_m: expected more than 0, found 0"),
        ("Navigation", {"success_reward": math.nan}, "success_reward: expected a finite number, found nan"),
    ],
)
def test_wrong_tasks_are_refused(task: str, given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        gymnasium.make(f"PseudoSLAM/{task}-v0", dataset=HALL, **given)


def test_an_episode_that_starts_at_its_goal_ends_with_its_first_step() -> None:
    config = at(2.0, 2.0, 0.0, replace(Navigation.default, goal=GoalConfig(random=False, x_m=2.1, y_m=2.0)))
    env = NavigationEnv(hall(), config)
    _, info = env.reset(seed=0)
    assert info["is_success"]
    for action in (0, 1):  # whether it leaves or stays
        env.reset(seed=0)
        _, reward, terminated, truncated, info = env.step(action)
        assert (terminated, truncated, info["is_success"], info["spl"]) == (True, False, True, 1.0)
        assert reward > 2.0
