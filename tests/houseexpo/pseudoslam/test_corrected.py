"""Where the published simulator departs from its paper: thirteen behaviours, each with a test that it would fail."""

from __future__ import annotations

import math
import mmap
import resource
from dataclasses import asdict, replace
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.pseudoslam.config import (
    GoalConfig,
    LaserConfig,
    NoiseConfig,
    ObservationConfig,
    RobotConfig,
    SimulatorConfig,
)
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.shapes import Circle, Obstacle
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.worlds.world import make_world
from tests.builders.scans import slow_rays
from tests.builders.simulations import PLAIN, at, corner, hall, hall_with_cell, started, wander


def make(task: str, **other: Any) -> gymnasium.Env:
    return gymnasium.make(f"PseudoSLAM/{task}-v0", **other)


def test_1_each_obstacle_moves_along_its_own_ray_by_metres() -> None:
    """There: one Gaussian a ray in pixels, rounded, added to x and y of the whole ray; 0.1 never does anything."""
    config = replace(PLAIN, laser=LaserConfig(3.0, 60.0, 0.5))
    exact = started(at(3.0, 2.0, 0.0, config), corner())[1].known
    noisy = started(at(3.0, 2.0, 0.0, replace(config, noise=NoiseConfig(laser_m=0.1))), corner())[1].known
    assert set(np.nonzero(exact == 255)[1].tolist()) == {126}
    cols = np.nonzero(noisy == 255)[1]
    assert cols.std() == pytest.approx(2.5, rel=0.25)  # 0.1 m, each beam for itself
    assert np.array_equal(noisy[:, :110], exact[:, :110])  # what lies on the way stays where it is


def test_2_registration_errs_as_much_as_told_once_a_step_and_may_leave_the_map() -> None:
    """There: ten times less than told, anew for each scan of a step, and an IndexError at the edge of the map."""
    noise = NoiseConfig(registration_m=0.2)
    config = replace(PLAIN, noise=noise, laser=LaserConfig(3.0, 30.0), robot=RobotConfig(turn_deg=40.0))
    simulator, rng, shifts = Simulator.of(corner(), at(3.0, 2.0, -20.0, config)), np.random.default_rng(5), []
    for _ in range(150):
        state = simulator.start(rng)
        state.known[:] = 0
        simulator.step(state, "left")  # four scans
        wall = np.nonzero(state.known == 255)[1]
        assert np.ptp(wall) <= 1
        shifts.append((wall.mean() - 126) / 25)
    assert np.std(shifts) == pytest.approx(0.2, rel=0.2)
    simulator, state, rng = started(at(0.3, 0.3, -135.0, replace(PLAIN, noise=NoiseConfig(registration_m=2.0))))
    wander(simulator, state, rng, 60)


@pytest.mark.parametrize("turn", [5.0, 10.0, 15.0, 25.0, 97.0])
def test_3_turns_are_exact(turn: float) -> None:
    """There: rounded up to whole 10 degrees."""
    simulator, state, _ = started(at(4, 2, 30, replace(PLAIN, robot=RobotConfig(turn_deg=turn))))
    simulator.step(state, "left")
    assert simulator.pose(state)[2] == pytest.approx(math.radians(30 + turn))
    simulator.step(state, "right")
    simulator.step(state, "right")
    assert simulator.pose(state) == pytest.approx((4, 2, math.radians(30 - turn)))


@pytest.mark.parametrize("step", [0.01, 0.3, 0.37, 1.0])
def test_4_steps_are_exact(step: float) -> None:
    """There: whole pixels, and nowhere with less than half of one."""
    simulator, state, _ = started(at(1, 2, 40, replace(PLAIN, robot=RobotConfig(step_m=step))))
    simulator.step(state, "forward")
    angle = math.radians(40)
    assert simulator.pose(state) == pytest.approx((1 + step * math.cos(angle), 2 + step * math.sin(angle), angle))


def test_4_a_wall_stops_it_where_it_touches_and_the_next_step_forgets() -> None:
    """There: up to 7 px before it, and the flag stays until the next episode."""
    simulator, state, _ = started(at(7.45, 2, 0))
    simulator.step(state, "forward")
    assert not state.blocked
    simulator.step(state, "forward")
    assert state.blocked
    assert simulator.pose(state)[0] == pytest.approx(7.8, abs=1e-6)
    simulator.step(state, "left")
    assert not state.blocked


@pytest.mark.parametrize(("x", "y", "heading"), [(0.9, 0.9, 90.0), (1.237, 2.5, -33.0)])
def test_5_it_starts_where_it_is_told_each_time(x: float, y: float, heading: float) -> None:
    """There: whole numbers, so that 90 degrees become 1 rad and 0.9 m become 0; the first episode moves the start."""
    simulator, state, rng = started(at(x, y, heading))
    assert simulator.pose(state) == pytest.approx((x, y, math.radians(heading)), abs=1e-12)
    wander(simulator, state, rng, 5)
    assert simulator.pose(simulator.start(rng)) == pytest.approx((x, y, math.radians(heading)), abs=1e-12)


def test_6_random_starts_are_everywhere_and_between_cells() -> None:
    """There: only in 10 to 80% of the box, on whole pixels."""
    simulator, rng = Simulator.of(hall(), PLAIN), np.random.default_rng(1)
    poses = np.array([simulator.pose(simulator.start(rng)) for _ in range(300)])
    assert poses[:, :2].min(axis=0) == pytest.approx((0.2, 0.2), abs=0.15)
    assert poses[:, :2].max(axis=0) == pytest.approx((7.8, 3.8), abs=0.15)
    assert ((poses[:, :2] >= 0.2) & (poses[:, :2] <= (7.8, 3.8))).all()
    assert np.ptp(poses[:, 2]) > 6
    assert len(np.unique(poses[:, 0] % 0.04)) > 250


def test_6_a_search_without_end_is_an_error_and_sizes_are_what_they_say() -> None:
    """There: it looks for ever, writes other sizes into its configuration, and halves what it calls a radius."""
    crowd = replace(PLAIN, obstacles=ObstaclesConfig(random=RandomObstacles(number=(500, 500), size_m=(0.5, 3.0))))
    before = asdict(crowd)
    with pytest.raises(ConfigError, match=r"obstacles\.random\.number: at most \d+ of 500 obstacles found a place"):
        started(crowd)
    assert asdict(crowd) == before
    _, state, _ = started(at(1, 1, 0, replace(PLAIN, obstacles=ObstaclesConfig(placed=(Obstacle(Circle(0.6), 5, 2),)))))
    assert state.occupied[1:-1, 1:-1].sum() / 25**2 == pytest.approx(math.pi * 0.6**2, rel=0.03)


def test_7_it_never_starts_in_a_pocket_and_all_that_counts_can_be_seen() -> None:
    """There: it starts in pockets that it cannot leave, and asks for cells that nobody can see."""
    all_round = replace(PLAIN, laser=LaserConfig(fov_deg=360.0))
    simulator, rng = Simulator.of(hall_with_cell(), all_round), np.random.default_rng(2)
    assert all(simulator.pose(simulator.start(rng))[0] < 5 for _ in range(100))
    with pytest.raises(ConfigError, match=r"cannot leave the place at \(5.5, 0.5\) m for the biggest part"):
        started(at(5.5, 0.5, 0), hall_with_cell())
    behind = simulator.world.observable[:, 129:]
    assert 0 < behind.sum() < (simulator.world.occupied[:, 129:] == 0).sum()
    state = simulator.start(rng)
    for row, col in np.argwhere(simulator.world.traversable).tolist():
        state.poses_px[:] = np.tile((col + 0.5, row + 0.5, 0.0), 2)
        simulator.move(state, 0.0, 0.0)
    assert simulator.coverage(state) == 1.0


@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_8_no_reward_is_negative(published_lines: list[bytes], rule) -> None:
    """There: it counts a picture with the robot painted on it, and 3 to 8% of the rewards are."""
    config = SimulatorConfig(16.0, laser=LaserConfig(rule=rule), max_steps=300)
    env = make("Exploration", dataset=decode(published_lines[2]), config=config, success_coverage=None)
    _, info = env.reset(seed=0)
    start, rewards, rng = info["explored_m2"], [], np.random.default_rng(0)
    for _ in range(300):
        _, reward, *_, info = env.step(1 if info["collided"] or rng.random() < 0.2 else 0)
        rewards.append(reward)
    assert min(rewards) == 0.0
    assert sum(rewards) == pytest.approx(info["explored_m2"] - start)


def test_9_navigation_ends_at_a_goal_that_it_is_paid_for() -> None:
    """There: every step of the navigation mode says done, and there is no goal."""
    goal = GoalConfig(random=False, x_m=6.0, y_m=2.0)
    config = replace(at(1.0, 2.0, 0.0), goal=goal, known_map=True)
    env = make("Navigation", dataset=hall(), config=config)
    env.reset(seed=0)
    rewards, ends = [], []
    for _ in range(16):
        _, reward, terminated, *_, info = env.step(0)
        rewards.append(reward)
        ends.append(terminated)
    assert ends == [False] * 15 + [True]  # 4.8 of 5 m, within 0.3
    assert rewards[:15] == pytest.approx([0.3] * 15, abs=0.02)
    assert rewards[15] == pytest.approx(0.3 + 2.5, abs=0.02)
    assert info["spl"] == pytest.approx(1.0)


def test_9_avoidance_pays_for_room_and_motion_and_fines_collisions() -> None:
    """There: the paper's reward exists nowhere in the code."""
    config = at(1.0, 2.0, 0.0, SimulatorConfig(33.0, observation=ObservationConfig(3.0)))
    env = make("ObstacleAvoidance", dataset=hall(4.0, 4.0), config=config)
    env.reset(seed=0)
    rewards = [env.step(0)[1] for _ in range(10)]
    assert rewards[:6] == pytest.approx([1.0] * 6)  # 1.0 m to 3.3 m: half a metre of room and more
    assert rewards[8] == pytest.approx(0.9 * 0.1 / 0.5 + 0.1, abs=1e-6)
    assert rewards[9] == -1.0
    assert env.step(1)[1] == pytest.approx(0.0, abs=1e-3)  # touching: no room, and no way gone


def test_10_every_cell_of_an_open_sector_is_decided_and_diagonal_walls_hold() -> None:
    """There: 15% of the sector lies between rays, and one looks through where two cells share a corner."""
    open_floor = hall(14.0, 14.0)
    states = [
        started(at(7.0, 7.0, 90.0, replace(PLAIN, laser=LaserConfig(rule=rule))), open_floor)[1]
        for rule in ("sector", "rays")
    ]
    rows, cols = np.mgrid[:352, :352]
    x, y, _ = states[0].pose_px
    sector = (np.hypot(cols + 0.5 - x, rows + 0.5 - y) <= 125) & (rows + 0.5 <= y)
    assert (states[0].known[sector] == 127).all()
    assert (states[1].known[sector] == 127).mean() < 0.9
    world = make_world(open_floor, 25.0, 0.2, 5.0)
    occupied = world.occupied.copy()
    occupied[np.arange(352), np.arange(352)] = 1
    simulator = Simulator(replace(world, occupied=occupied), at(9.0, 9.0, -135.0))
    state = simulator.start(np.random.default_rng(0))
    assert (state.known[cols < rows] == 0).all()
    assert (state.known[cols > rows] == 127).sum() > 5000
    leaks, _ = slow_rays(occupied, *state.pose_px, math.pi, math.radians(0.7), 125.0)
    assert any(col < row for row, col in leaks)


def test_10_inside_an_obstacle_nothing_is_seen() -> None:
    """There: it sees through everything."""
    simulator, state, _ = started(at(4.0, 2.0, 0.0))
    state.known[:] = 0
    state.occupied[45:55, 95:105] = 1
    simulator.move(state, 0.0, 0.0)
    assert not state.known.any()


def test_11_seeds_decide_and_plans_never_run_out() -> None:
    """There: the global state is seeded with 0, ``seed`` does nothing, and plans taken in order run out."""
    plans = [replace(hall(3.0 + k), id=f"hall-{k}") for k in range(3)]
    env = make("Exploration", dataset=plans)

    def first(seed: int) -> bytes:
        np.random.seed(0)  # noqa: NPY002  # what is global has no say
        observation, info = env.reset(seed=seed)
        return observation.tobytes() + info["pose"].tobytes()

    assert first(1) == first(1) != first(2)
    assert {env.reset()[1]["plan_id"] for _ in range(40)} == {"hall-0", "hall-1", "hall-2"}


def test_12_thin_walls_survive_at_a_coarse_grid() -> None:
    """There: a picture is shrunk, and a wall of 0.1 m has gaps or is gone at 16 px/m."""
    for x in np.arange(2.0, 2.1, 0.01).round(2).tolist():
        verts = [(0, 0), (0, 3), (x, 3), (x, 0.9), (x + 0.1, 0.9), (x + 0.1, 3), (4, 3), (4, 0)]
        world = make_world(FloorPlan("wall", verts, 1, {}), 16.0, 0.2, 5.0)
        assert world.occupied[1:34, 30:38].any(axis=1).all()
        assert world.occupied[1:34, 30:38].sum(axis=1).max() <= 2


@pytest.mark.skipif(not hasattr(mmap, "MADV_NOHUGEPAGE"), reason="counts pages, as Linux has them")
@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_13_a_step_touches_what_is_near_and_not_the_map(rule) -> None:
    """There: each step copies, dilates and counts the whole map.

    On fresh memory the system counts each page that is touched; a row of this map is a page and a half.
    """
    simulator, state, _ = started(at(4.0, 2.0, 0.0, replace(PLAIN, laser=LaserConfig(rule=rule))))
    simulator.move(state, 0.1, 0.1)
    side = 6000
    touched = []
    for _ in range(2):
        occupied, observable, known = (fresh_grid(side) for _ in range(3))
        episode = state.copy().episode._replace(occupied=occupied, observable=observable, known=known)
        episode.pose.view(np.float64)[:] = np.tile((side / 2, side / 2, 0.5), 2)
        far = replace(state, episode=episode)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        simulator.move(far, 0.1, 0.1)
        touched.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
        assert (known[2860:3140, 2860:3140] != 0).sum() == (known != 0).sum() > 20_000
    assert 200 < min(touched) < 3 * 2 * 270  # of 26,000


def fresh_grid(side: int) -> np.ndarray:
    """Zeros that no one has touched."""
    memory = mmap.mmap(-1, side * side)
    memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(memory, np.uint8).reshape(side, side)
