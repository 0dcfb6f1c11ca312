from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.plan_json import decode
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, RobotConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from tests.builders.scans import slow_crop, slow_rays

PLAIN = SimulatorConfig()


def hall(width: float = 8.0, height: float = 4.0) -> FloorPlan:
    return FloorPlan("hall", [(0, 0), (0, height), (width, height), (width, 0)], 1, {})


def corner() -> FloorPlan:
    """A room whose wall at x = 5 has 4 m of nothing behind it."""
    return FloorPlan("corner", [(0, 0), (0, 4), (5, 4), (5, 0.5), (9, 0.5), (9, 0)], 1, {})


def at(x: float, y: float, heading: float, config: SimulatorConfig = PLAIN) -> SimulatorConfig:
    return replace(config, start=StartConfig(random=False, x_m=x, y_m=y, heading_deg=heading))


def started(config: SimulatorConfig, plan: FloorPlan | None = None) -> tuple[Simulator, State, np.random.Generator]:
    rng = np.random.default_rng(0)
    simulator = Simulator.of(plan or hall(), config)
    return simulator, simulator.start(rng), rng


def wander(simulator: Simulator, state: State, rng: np.random.Generator, steps: int) -> None:
    """Forward most of the time, turn when blocked."""
    for _ in range(steps):
        simulator.step(state, "left" if state.blocked or rng.random() < 0.2 else "forward")


@pytest.mark.parametrize(("x", "y", "heading"), [(0.9, 0.9, 90.0), (1.237, 2.5, -33.0)])
def test_it_starts_where_it_is_told(x: float, y: float, heading: float) -> None:
    """The published simulator makes whole numbers of a pose: 90 degrees become 1 rad, 0.9 m become 0."""
    simulator, state, rng = started(at(x, y, heading))
    assert simulator.pose(state) == pytest.approx((x, y, math.radians(heading)), abs=1e-12)
    wander(simulator, state, rng, 5)
    assert simulator.pose(simulator.start(rng)) == pytest.approx((x, y, math.radians(heading)), abs=1e-12)


def test_the_centre_can_be_the_origin() -> None:
    start = StartConfig(random=False, x_m=1.0, y_m=-0.5, heading_deg=0.0, origin="centre")
    simulator, state, _ = started(replace(PLAIN, start=start))
    assert simulator.pose(state) == pytest.approx((5.0, 1.5, 0.0))


@pytest.mark.parametrize("turn", [5.0, 10.0, 15.0, 25.0, 97.0])
def test_turns_are_exact(turn: float) -> None:
    """The published simulator rounds a turn up to whole 10 degrees."""
    simulator, state, _ = started(at(4, 2, 30, replace(PLAIN, robot=RobotConfig(turn_deg=turn))))
    simulator.step(state, "left")
    assert simulator.pose(state)[2] == pytest.approx(math.radians(30 + turn))
    simulator.step(state, "right")
    simulator.step(state, "right")
    assert simulator.pose(state) == pytest.approx((4, 2, math.radians(30 - turn)))


@pytest.mark.parametrize("step", [0.01, 0.3, 0.37, 1.0])
def test_steps_are_exact(step: float) -> None:
    """The published simulator goes whole pixels, and nowhere with less than half of one."""
    simulator, state, _ = started(at(1, 2, 40, replace(PLAIN, robot=RobotConfig(step_m=step))))
    simulator.step(state, "forward")
    angle = math.radians(40)
    assert simulator.pose(state) == pytest.approx((1 + step * math.cos(angle), 2 + step * math.sin(angle), angle))


def test_a_wall_stops_it_and_the_next_step_forgets() -> None:
    """The published simulator stops short, and its flag stays until the next episode."""
    simulator, state, _ = started(at(7.45, 2, 0))
    simulator.step(state, "forward")
    assert not state.blocked
    simulator.step(state, "forward")
    assert state.blocked
    assert simulator.pose(state)[0] == pytest.approx(7.8, abs=1e-6)
    simulator.step(state, "left")
    assert not state.blocked


def test_random_starts_are_everywhere_and_fit() -> None:
    simulator = Simulator.of(hall(), PLAIN)
    rng = np.random.default_rng(1)
    poses = np.array([simulator.pose(simulator.start(rng)) for _ in range(300)])
    assert poses[:, :2].min(axis=0) == pytest.approx((0.2, 0.2), abs=0.15)
    assert poses[:, :2].max(axis=0) == pytest.approx((7.8, 3.8), abs=0.15)
    assert ((poses[:, :2] >= 0.2) & (poses[:, :2] <= (7.8, 3.8))).all()
    assert np.ptp(poses[:, 2]) > 6
    assert len(np.unique(poses[:, 0] % 0.04)) > 250  # not on whole cells


def test_one_seed_gives_the_same_bytes(published_lines: list[bytes]) -> None:
    simulator = Simulator.of(decode(published_lines[0]), replace(PLAIN, noise=NoiseConfig(0.02, 0.01, 0.3)))
    ends = []
    for seed in (7, 7, 8):
        np.random.seed(seed)  # noqa: NPY002  # what is global has no say
        rng = np.random.default_rng(seed)
        state = simulator.start(rng)
        wander(simulator, state, rng, 60)
        ends.append(b"".join(a.tobytes() for a in (state.pose_px, state.known, state.view, state.counts)))
    assert ends[0] == ends[1] != ends[2]


def test_rays_draw_the_published_map_on_the_way(published_lines: list[bytes]) -> None:
    config = SimulatorConfig(
        pixels_per_metre=16.0, laser=LaserConfig(2.0, 180.0, 1.0, "rays"), robot=RobotConfig(step_m=0.9, turn_deg=25.0)
    )
    simulator, state, _ = started(config, decode(published_lines[1]))
    solid, known = simulator.world.solid, np.zeros_like(state.known)

    def look(x: float, y: float, heading: float) -> None:
        free, hit = slow_rays(solid, x, y, heading, math.pi, math.radians(1.0), 32.0)
        for value, cells in ((127, free), (255, hit)):
            known[tuple(np.array(sorted(cells), dtype=int).reshape(-1, 2).T)] = value

    look(*state.pose_px)
    for action in ("forward", "left", "forward", "left", "left", "forward", "right", "forward"):
        x, y, heading = state.pose_px.tolist()
        simulator.step(state, action)
        if action == "forward":
            end_x, end_y, _ = state.pose_px.tolist()
            looks = math.ceil(math.hypot(end_x - x, end_y - y) / 4.8 - 1e-9) or 1
            for k in range(1, looks + 1):
                look(x + (end_x - x) * k / looks, y + (end_y - y) * k / looks, heading)
        else:
            for k in (1, 2, 3):
                look(x, y, heading + (1 if action == "left" else -1) * math.radians(25) * k / 3)
        assert np.array_equal(state.known, known)
        assert np.array_equal(state.view, slow_crop(known, *state.pose_px, config.side_px))


@pytest.mark.parametrize("rule", ["sector", "rays"])
def test_areas_add_up_and_coverage_never_falls_nor_passes_1(published_lines: list[bytes], rule) -> None:
    """The published reward counts a picture with the robot on it, and is negative at times."""
    config = replace(PLAIN, pixels_per_metre=16.0, laser=LaserConfig(rule=rule))
    simulator, state, rng = started(config, decode(published_lines[2]))
    before, coverage, known = simulator.explored_m2(state), simulator.coverage(state), state.known.copy()
    for _ in range(300):
        wander(simulator, state, rng, 1)
        assert simulator.explored_m2(state) >= before
        assert coverage <= simulator.coverage(state) <= 1
        before, coverage = simulator.explored_m2(state), simulator.coverage(state)
        assert (known[known > 0] == state.known[known > 0]).all()
        known = state.known.copy()
    assert before == (state.known > 0).sum() / 16**2
    assert ((state.known == 255) <= (simulator.world.solid == 1)).all()
    assert ((state.known == 127) <= (simulator.world.solid == 0)).all()
    assert state.counts[0] == 300


def test_a_known_map_is_known_from_the_start() -> None:
    simulator, state, _ = started(replace(PLAIN, known_map=True))
    assert np.array_equal(state.known == 255, simulator.world.solid == 1)
    assert simulator.coverage(state) == 1


def test_the_map_as_ros_has_it() -> None:
    simulator, state, _ = started(at(1, 1, 0, replace(PLAIN, laser=LaserConfig(range_m=1.5))))
    grid = simulator.map(state)
    assert grid.data.dtype == np.int8
    assert set(np.unique(grid.data).tolist()) == {-1, 0, 100}
    row, col = (int((value - low) / grid.resolution) for value, low in zip((1, 1.5), grid.origin[::-1], strict=True))
    assert grid.data[row, col] == 0
    assert grid.data[-2, -2] == -1  # far up and right
    assert grid.resolution == 0.04


def test_noise_moves_walls_along_their_rays_by_its_deviation() -> None:
    config = replace(PLAIN, pixels_per_metre=100.0, laser=LaserConfig(3.0, 20.0, 0.5), noise=NoiseConfig(laser_m=0.05))
    simulator = Simulator.of(corner(), at(3.0, 2.0, 0.0, config))
    rng = np.random.default_rng(4)
    found = []
    for _ in range(60):
        rows, cols = np.nonzero(simulator.start(rng).known == 255)
        x, y = cols + 0.5 - 301, 201 - (rows + 0.5)
        found.append(np.hypot(x, y) - 200.5 * np.hypot(x, y) / x)  # beyond the wall, along the ray
    beyond = np.concatenate(found)
    assert beyond.mean() == pytest.approx(0, abs=0.5)
    assert beyond.std() == pytest.approx(5.0, rel=0.1)


def test_a_wrong_registration_shifts_and_turns_all_of_a_scan() -> None:
    """The published simulator multiplies its deviation by a hidden 0.1."""
    noise = NoiseConfig(registration_m=0.1)
    simulator = Simulator.of(corner(), at(3.0, 2.0, 0.0, replace(PLAIN, noise=noise, laser=LaserConfig(3.0, 60.0))))
    rng = np.random.default_rng(5)
    found = []
    for _ in range(400):
        cols = np.nonzero(simulator.start(rng).known == 255)[1]
        assert np.ptp(cols) <= 1  # the wall stays straight
        found.append((cols.mean() - 126) / 25)
    assert np.std(found) == pytest.approx(0.1, rel=0.12)
    assert np.mean(found) == pytest.approx(0.0, abs=0.03)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"a robot of radius 0.2 m does not fit at \(0.1, 2\) m in plan 'hall'"):
        started(at(0.1, 2, 0))
    with pytest.raises(ConfigError, match="does not fit"):
        started(at(-50, 2, 0))
    simulator, state, _ = started(PLAIN)
    with pytest.raises(ConfigError, match="action: expected one of forward, left, right; found 'up'"):
        simulator.step(state, "up")
    with pytest.raises(ConfigError, match="action: expected finite numbers"):
        simulator.move(state, math.nan, 0.1)


def test_a_pocket_is_no_place_to_start() -> None:
    with pytest.raises(ConfigError, match=r"cannot leave the place at \(5.5, 0.5\) m for the biggest part"):
        started(at(5.5, 0.5, 0), hall_with_cell())


def hall_with_cell() -> FloorPlan:
    """A hall whose right part, 2 m wide, is behind a gap of 0.3 m."""
    verts = [(0, 0), (0, 4), (5, 4), (5, 2.3), (5.1, 2.3), (5.1, 4), (7, 4), (7, 0), (5.1, 0), (5.1, 2), (5, 2), (5, 0)]
    return FloorPlan("cell", verts, 1, {})


def test_a_copy_shares_nothing() -> None:
    simulator, state, rng = started(PLAIN)
    kept = state.copy()
    wander(simulator, state, rng, 10)
    assert kept.counts[0] == 0
    assert not np.array_equal(kept.known, state.known)
