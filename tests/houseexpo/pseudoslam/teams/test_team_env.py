"""A team's environment: PettingZoo's own tests, the single environment's bits, and what robots are to each other."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import parallel_env
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, Odometry, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.robot import Motion
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.kernels.collision import MOVING, THINNER_PX, mark_disc
from houseexpo.pseudoslam.teams.tasks import Radio

pytest.importorskip("pettingzoo")

HALL = FloorPlan(
    "hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {}, holes=([(5.0, 1.0), (6.0, 1.0), (6.0, 2.0), (5.0, 2.0)],)
)
TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)
NOISY = SimulatorConfig(noise=NoiseConfig(odometry_way=0.05, odometry_deg_per_m=2.0, laser_m=0.02))


def test_pettingzoo_accepts_it() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel_env(robots=3, dataset=HALL, radio="sight"), num_cycles=150)
    parallel_seed_test(lambda: parallel_env(robots=3, dataset=HALL, radio="signal", observation="dict"), 60)


@pytest.mark.slow
def test_pettingzoo_accepts_drives() -> None:
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    for motion in ("differential", "ackermann"):
        parallel_api_test(parallel_env(robots=3, dataset=HALL, motion=motion), num_cycles=80)
    parallel_seed_test(lambda: parallel_env(robots=3, dataset=HALL, motion="ackermann"), 40)


@pytest.mark.parametrize(
    ("config", "options"),
    [
        (SimulatorConfig(), {}),
        (SimulatorConfig(laser=LaserConfig(rule="rays")), {"observation": "dict", "actions": "continuous"}),
        (NOISY, {"reward": "coverage"}),
        (SimulatorConfig(people=PeopleConfig(2), obstacles=ObstaclesConfig(random=RandomObstacles((1, 2)))), {}),
        (SimulatorConfig(), {"observation": "scales"}),
        pytest.param(SimulatorConfig(), {"motion": "differential", "observation": "dict"}, marks=pytest.mark.slow),
        pytest.param(
            replace(NOISY, noise=replace(NOISY.noise, odometry_model=Odometry(0.1, 0.1, 0.1, 0.1), slip=0.1)),
            {"motion": "ackermann"},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_one_robot_has_the_bits_of_the_single_environment(config: SimulatorConfig, options: dict[str, Any]) -> None:
    team = parallel_env(robots=1, dataset=[HALL, TWO_ROOMS], config=config, radio="always", **options)
    single = ExplorationEnv([HALL, TWO_ROOMS], config, **options)
    rng = np.random.default_rng(5)
    for seed in (3, None):
        observed, info = team.reset(seed=seed)
        wanted, single_info = single.reset(seed=seed)
        _same(observed["robot_0"], wanted)
        for _ in range(80):
            action = rng.choice([0, 0, 1, 2]) if single.actions == "discrete" else rng.uniform(-1, 1, 2)
            observed, reward, ends, cut, info = team.step({"robot_0": action})
            wanted, single_reward, single_ends, single_cut, single_info = single.step(action)
            _same(observed["robot_0"], wanted)
            assert (reward["robot_0"], ends["robot_0"], cut["robot_0"]) == (single_reward, single_ends, single_cut)
            for key, value in single_info.items():
                np.testing.assert_array_equal(info["robot_0"][key], value)
            if single_ends or single_cut:
                break


def _same(one: Any, other: Any) -> None:
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            np.testing.assert_array_equal(one[key], other[key])
    else:
        np.testing.assert_array_equal(one, other)


DRIVES = [pytest.param(name, marks=pytest.mark.slow) for name in ("differential", "ackermann")]


@pytest.mark.parametrize("motion", ["discrete", *DRIVES])
def test_robots_never_overlap_and_count_their_collisions(motion: Motion) -> None:
    slips = SimulatorConfig(noise=NoiseConfig(slip=0.3))
    env = parallel_env(robots=6, dataset=FloorPlan("cell", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {}), until="robot",
                       success_coverage=None, motion=motion, config=slips)  # fmt: skip
    env.reset(seed=0)
    rng, radius_px = np.random.default_rng(0), env.team.radius_px
    for _ in range(150):
        drawn = {agent: rng.choice([0, 0, 0, 1, 2]) for agent in env.agents}
        if motion != "discrete":
            drawn = {agent: np.clip(rng.normal((0.7, 0.0), 0.7), -1, 1) for agent in env.agents}
        _, _, _, _, infos = env.step(drawn)
        places = np.array([state.pose_px[:2] for state in env.team.states])
        gaps = np.hypot(*(places[:, None] - places[None]).T)
        np.fill_diagonal(gaps, math.inf)
        assert gaps.min() >= 2 * radius_px - 1e-9
    report = infos["robot_0"]["team"]
    assert 0 < report["meetings"] <= report["collisions"] == sum(infos[a]["collisions"] for a in infos)


def test_two_robots_face_to_face_stop_where_they_touch() -> None:
    env = parallel_env(robots=2, dataset=HALL, success_coverage=None)
    env.reset(seed=0, options={"pose": [(1.0, 3.0, 0.0), (3.0, 3.0, math.pi)]})
    radius_m = env.config.robot.radius_m
    for _ in range(20):
        _, _, _, _, infos = env.step(dict.fromkeys(env.agents, 0))
    gap = infos["robot_1"]["pose"][0] - infos["robot_0"]["pose"][0]
    assert gap == pytest.approx(2 * radius_m, abs=1e-6)
    assert infos["robot_0"]["collided"]
    assert infos["robot_1"]["collided"]
    before = infos["robot_0"]["pose"][0]
    for action in [*[1] * 18, 0, 0, 0]:  # it can turn round and go away
        _, _, _, _, infos = env.step({"robot_0": action, "robot_1": 1})
    assert infos["robot_0"]["pose"][0] < before - 0.1 or infos["robot_0"]["pose"][1] != pytest.approx(3.0)


@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_a_robot_sees_another_and_its_trace_goes_away(rule: Any) -> None:
    env = parallel_env(
        robots=2, dataset=HALL, config=SimulatorConfig(laser=LaserConfig(rule=rule)), success_coverage=None
    )
    env.reset(seed=0, options={"pose": [(1.0, 3.0, 0.0), (3.0, 3.0, math.pi / 2)]})
    watcher, other = env.team.states
    x, y = (int(at) for at in other.pose_px[:2])
    env.step({"robot_0": 1, "robot_1": 1})
    near = np.s_[y - 6 : y + 7, x - 6 : x + 7]
    assert (watcher.occupied[near] & MOVING).any()
    assert (watcher.known[near] == 255).any()
    for _ in range(60):
        env.step({"robot_0": 1 if watcher.pose_px[2] < 0 else 2, "robot_1": 0})
        if other.pose_px[1] > y + 15 or other.pose_px[1] < y - 15:
            break
    for action in [1, 2] * 20:
        env.step({"robot_0": action, "robot_1": 0})
    assert not (watcher.known[near] == 255).any()


def test_starts_that_overlap_and_houses_without_room() -> None:
    env = parallel_env(robots=2, dataset=HALL)
    with pytest.raises(ConfigError, match=r"robot 2 at .* overlaps robot 1"):
        env.reset(seed=0, options={"pose": [(1.0, 1.0, 0.0), (1.1, 1.0, 0.0)]})
    with pytest.raises(ConfigError, match="at most one for each of 2 robots, found 3"):
        env.reset(seed=0, options={"pose": [(1, 1, 0), (2, 1, 0), (3, 1, 0)]})
    small = FloorPlan("cupboard", [(0, 0), (0, 1), (1, 1), (1, 0)], 1, {})
    with pytest.raises(ConfigError, match="no room for robot"):
        parallel_env(robots=16, dataset=small).reset(seed=0)
    with pytest.raises(ConfigError, match="robots: expected a whole number of at most 16"):
        parallel_env(robots=17, dataset=HALL)
    with pytest.raises(ConfigError, match=r"radio\.model"):
        parallel_env(dataset=HALL, radio="telepathy")
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="expected one for each of robot_0, robot_1"):
        env.step({"robot_0": 0})


def test_maps_merge_when_robots_hear_each_other() -> None:
    pose = {"pose": [(1.0, 1.0, 0.0), (7.0, 1.0, math.pi)]}
    for model, joined in (("none", False), ("always", True), ("range", False), ("sight", False)):
        env = parallel_env(robots=2, dataset=TWO_ROOMS, radio=model)
        env.reset(seed=0, options=pose)
        one, other = env.team.states
        for _ in range(3):
            env.step({"robot_0": 1, "robot_1": 1})
        assert np.array_equal(one.known != 0, other.known != 0) == joined
        assert int(one.counts.known) == np.count_nonzero(one.known)
        assert int(one.counts.covered) == np.count_nonzero(one.known[one.episode.observable != 0])
        together = (one.known != 0) | (other.known != 0)
        assert env.team.explored == together.sum()
        assert env.team.report()["connected"] == float(joined)


def test_a_copy_goes_on_from_the_same_step_and_leaves_the_first_alone() -> None:
    radio, rng = Radio("always"), np.random.default_rng(0)
    env = parallel_env(robots=2, dataset=HALL, radio=radio, success_coverage=None)
    env.reset(seed=1)
    for k in range(25):
        if k == 10:
            other = copy.deepcopy(env)
        actions = {agent: int(rng.integers(3)) for agent in env.agents}
        one = env.step(actions)
        if k >= 10:
            two = other.step(actions)
            assert (one[1], one[4]["robot_0"]["team"]) == (two[1], two[4]["robot_0"]["team"])
            for state, too in zip(env.team.states, other.team.states, strict=True):
                np.testing.assert_array_equal(state.known, too.known)


def test_a_copy_in_a_small_house_goes_on_in_a_larger_one() -> None:
    rooms = [FloorPlan(f"room{side}", [(0, 0), (0, side), (side, side), (side, 0)], 1, {}) for side in (3, 5, 8)]
    env = parallel_env(robots=2, dataset=rooms, radio="always")
    for plan in ("room8", "room3"):
        env.reset(seed=0, options={"plan_id": plan})
    other = copy.deepcopy(env)
    for each in (env, other):
        each.reset(seed=1, options={"plan_id": "room5"})
    one, two = (each.step(dict.fromkeys(each.agents, 0)) for each in (env, other))
    assert (one[1], one[4]["robot_0"]["team"]) == (two[1], two[4]["robot_0"]["team"])


def test_a_team_that_reports_ends_at_the_base() -> None:
    room = FloorPlan("room", [(0, 0), (0, 4), (4, 4), (4, 0)], 1, {})
    env = parallel_env(robots=2, dataset=room, until="report", radio="none")
    env.reset(seed=0, options={"pose": [(1.0, 1.0, 0.0), (3.0, 3.0, 0.0)]})
    ended = []
    for _ in range(36):
        _, _, ends, _, infos = env.step({"robot_0": 0 if ended else 2, "robot_1": 1})
        if any(ends.values()):
            break
    assert all(ends.values())
    assert infos["robot_0"]["coverage"] >= 0.95
    assert infos["robot_0"]["is_success"]


def test_people_walk_among_robots() -> None:
    env = parallel_env(robots=3, dataset=HALL, config=SimulatorConfig(people=PeopleConfig(2)), success_coverage=None)
    env.reset(seed=0)
    where = [env.team.states[0].episode.bodies.people["x"].copy()]
    for _ in range(20):
        env.step(dict.fromkeys(env.agents, 1))
        where.append(env.team.states[0].episode.bodies.people["x"].copy())
    assert np.abs(np.diff(where, axis=0)).sum() > 1.0


@pytest.mark.parametrize("motion", ["diff", DRIVES[0]])
def test_no_person_overlaps_any_robot(motion: str) -> None:
    config = SimulatorConfig(people=PeopleConfig(6))
    options = {} if motion == "diff" else {"motion": motion}
    env = parallel_env(robots=4, dataset=HALL, config=config, success_coverage=None, **options)
    ppm, rng = env.config.pixels_per_metre, np.random.default_rng(0)
    touch, nearest, meetings = (env.config.robot.radius_m + env.config.people.radius_m) * ppm, math.inf, 0
    for seed in range(3):
        _, infos = env.reset(seed=seed)
        for _ in range(150):
            if motion == "diff":
                actions = {agent: 0 if rng.random() < 0.7 else int(rng.integers(1, 3)) for agent in env.agents}
            else:
                actions = {agent: np.array([rng.uniform(0, 1), rng.uniform(-1, 1)], np.float32) for agent in env.agents}
            *_, infos = env.step(actions)
            people = env.team.states[0].episode.bodies.people
            off = np.hypot(*(env.team.places_px()[:, None] - np.column_stack([people["x"], people["y"]])).T)
            nearest, meetings = min(nearest, float(off.min())), infos["robot_0"]["team"]["meetings"]
    assert nearest >= touch - 1e-6
    assert nearest < touch + 1.0  # they do meet
    assert meetings > 0


def test_a_robot_that_a_person_blocks_collides_but_does_not_meet_a_robot() -> None:
    config = SimulatorConfig(people=PeopleConfig(1, speed_m_s=1e-9))
    env = parallel_env(robots=2, dataset=HALL, config=config, success_coverage=None)
    env.reset(seed=0)
    person = env.team.states[0].episode.bodies.people[0]
    pose, ppm = env.team.states[1].pose_px, env.config.pixels_per_metre
    touch = (config.robot.radius_m + config.people.radius_m) * ppm
    pose[:3] = person.x - touch - 1.0, person.y, 0.0  # one pixel from the person
    for state in env.team.states:
        state.episode.bodies.robots[1] = pose[:2]
    *_, infos = env.step({"robot_0": 1, "robot_1": 0})
    assert infos["robot_1"]["collided"]
    assert infos["robot_1"]["team"]["meetings"] == 0
    assert pose[0] == pytest.approx(person.x - touch, abs=1e-3)


def test_a_team_draws_its_robots_where_people_stand_beside_them() -> None:
    env = parallel_env(robots=2, dataset=HALL, config=SimulatorConfig(people=PeopleConfig(6)), success_coverage=None)
    ppm, rng = env.config.pixels_per_metre, np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(40):
        env.step({agent: int(rng.choice([0, 0, 1])) for agent in env.agents})
        x, y = before = env.team.places_px()[1]
        env.step({"robot_0": 1, "robot_1": 1})
        drawn = np.zeros_like(env.team.walls)
        mark_disc(drawn, x, y, env.config.robot.radius_m * ppm - THINNER_PX)
        assert env.team.states[0].occupied[drawn != 0].all()
        np.testing.assert_array_equal(env.team.places_px()[1], before)
