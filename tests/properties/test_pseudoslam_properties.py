"""What must hold of the simulator in any house, for any action."""

from __future__ import annotations

import math
from dataclasses import dataclass

import gymnasium
import numpy as np
import pytest
from hypothesis import assume, event, given
from hypothesis import strategies as st

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, RobotConfig, ScanRule, SimulatorConfig
from houseexpo.pseudoslam.kernels.collision import disc_is_free
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.world import make_world_from_raster, new_scan_buffers, traversable_cells
from tests.builders.scans import first_hit
from tests.builders.tries import tries

PPM = 10.0
seeds = st.integers(0, 2**32 - 1)
params = st.sampled_from(["sector", "rays"])
moves = st.lists(st.tuples(st.floats(-4.0, 4.0), st.floats(-1.5, 1.5)), min_size=1, max_size=12)


def clutter(seed: int, rows: int = 31, cols: int = 41) -> np.ndarray:
    """A room with a few walls, some with doors, and specks."""
    rng = np.random.default_rng(seed)
    occupied = (rng.random((rows, cols)) < rng.choice([0.0, 0.02, 0.08])).astype(np.uint8)
    for _ in range(rng.integers(0, 4)):
        row, col = rng.integers(3, (rows - 3, cols - 3))
        if rng.random() < 0.5:
            occupied[row, : rng.integers(1, cols)] = 1
        else:
            occupied[rng.integers(1, rows) :, col] = 1
    occupied[[0, -1]] = occupied[:, [0, -1]] = 1
    return occupied


def simulated(
    seed: int, rule: ScanRule, *, radius_m: float = 0.2, noise: NoiseConfig | None = None
) -> tuple[Simulator, State]:
    occupied = clutter(seed)
    assume(traversable_cells(occupied, radius_m * PPM).any())
    laser = LaserConfig(range_m=2.0, fov_deg=200.0, resolution_deg=2.0, rule=rule)
    config = SimulatorConfig(PPM, RobotConfig(radius_m=radius_m), laser, noise or NoiseConfig())
    frame = GridFrame.around((0.0, 0.0, (occupied.shape[1] - 2) / PPM, (occupied.shape[0] - 2) / PPM), PPM, y_up=True)
    simulator = Simulator(make_world_from_raster(occupied, frame, radius_m, 2.0, "clutter"), config)
    return simulator, simulator.start(np.random.default_rng(seed))


@given(seeds)
@tries(60)
def test_no_free_cell_lies_behind_an_obstacle(seed: int) -> None:
    """The line to its centre may graze a corner, by no more than 1e-6 of a cell."""
    _, state = simulated(seed, "sector")
    x, y, _ = state.pose_px.tolist()
    rows, cols = np.nonzero(state.occupied)
    hair = 1e-6
    boxes = np.stack([cols + hair - x, rows + hair - y, cols + 1 - hair - x, rows + 1 - hair - y], axis=1)
    for row, col in np.argwhere(state.known == 127).tolist():
        right, down = col + 0.5 - x, row + 0.5 - y
        distance = math.hypot(right, down)
        if distance > 0:
            assert first_hit(boxes, right / distance, down / distance)[1] >= distance


@given(seeds)
@tries(60)
def test_on_a_ray_nothing_is_known_behind_its_obstacle(seed: int) -> None:
    """Of a single ray each cell before the first obstacle is free, that one is an obstacle, and it is the last."""
    simulator, state = simulated(seed, "rays")
    x, y, heading = state.pose_px.tolist()
    one = simulator.params.sensor._replace(fan_cos=np.array([1.0]), fan_sin=np.array([0.0]))
    state.known[:] = 0
    Simulator(simulator.world, simulator.config, simulator.params._replace(sensor=one)).move(state, 0.0, 0.0)
    seen = np.argwhere(state.known != 0)
    along = (seen[:, 1] + 0.5 - x) * math.cos(heading) - (seen[:, 0] + 0.5 - y) * math.sin(heading)
    values = state.known[tuple(seen[along.argsort()].T)]
    assert (values[:-1] == 127).all()
    assert (values[-1] == 255) or along.max() > 19.0
    assert ((state.known == 127) <= (state.occupied == 0)).all()


@given(seeds, moves, st.floats(0.05, 0.35), params)
@tries(80)
def test_the_robot_never_meets_an_obstacle(seed: int, told: list[tuple[float, float]], radius_m: float, rule) -> None:
    simulator, state = simulated(seed, rule, radius_m=radius_m)
    for turn, way in told:
        before = state.pose_px.copy()
        simulator.move(state, turn, way)
        assert disc_is_free(state.occupied, *state.pose_px[:2], radius_m * PPM)
        gone = math.hypot(*(state.pose_px - before)[:2])
        assert gone <= abs(way) * PPM + 1e-9
        assert state.blocked == (gone < abs(way) * PPM - 1e-7) or abs(way) < 1e-6
        for share in np.linspace(0, 1, 7):  # nor on its way
            x, y = before[:2] + share * (state.pose_px - before)[:2]
            assert disc_is_free(state.occupied, x, y, radius_m * PPM - 1e-7)
    event("met something" if state.counts[1] else "went freely")


@given(seeds, moves, params, st.sampled_from([NoiseConfig(), NoiseConfig(0.1, 0.1, 3.0, 0.1, 0.1, 1.0, 0.1, 0.05)]))
@tries(80)
def test_what_is_counted_is_what_the_map_shows(
    seed: int, told: list[tuple[float, float]], rule, noise: NoiseConfig
) -> None:
    """Coverage never falls and never passes 1; areas add up."""
    simulator, state = simulated(seed, rule, noise=noise)
    coverage, area, known = simulator.coverage(state), simulator.explored_m2(state), state.known.copy()
    for turn, way in told:
        simulator.move(state, turn, way)
        assert coverage <= simulator.coverage(state) <= 1.0
        assert area <= simulator.explored_m2(state) == pytest.approx((state.known > 0).sum() / PPM**2)
        assert ((known > 0) <= (state.known > 0)).all()
        counted = (state.known[simulator.world.observable == 1] > 0).mean()
        assert simulator.coverage(state) == pytest.approx(float(counted))
        coverage, area, known = simulator.coverage(state), simulator.explored_m2(state), state.known.copy()
        if not noise.any:
            assert ((state.known == 255) <= (state.occupied != 0)).all()
            assert ((state.known == 127) <= (state.occupied == 0)).all()


HALL = FloorPlan("ell", [(0, 0), (0, 6), (2, 6), (2, 2), (5, 2), (5, 0)], 1, {})


@given(seeds, st.lists(st.integers(0, 2), min_size=1, max_size=60), params)
@tries(25)
def test_rewards_add_up_to_what_became_known(seed: int, actions: list[int], rule) -> None:
    env = gymnasium.make(
        "PseudoSLAM/Exploration-v0",
        dataset=HALL,
        config=SimulatorConfig(PPM, laser=LaserConfig(2.0, rule=rule)),
        success_coverage=None,
    )
    _, info = env.reset(seed=seed)
    start = info["explored_m2"]
    rewards = []
    for action in actions:
        _, reward, *_, info = env.step(action)
        rewards.append(reward)
    assert min(rewards) >= 0.0
    assert sum(rewards) == pytest.approx(info["explored_m2"] - start, abs=1e-9)


@dataclass
class View:
    """A world, a pose in it, and what is seen from there: 0 nothing, 1 free, 2 an obstacle."""

    occupied: np.ndarray
    x: float
    y: float
    heading: float
    seen: np.ndarray

    def turned(self) -> View:
        """A quarter turn to the left."""
        side = self.occupied.shape[1]
        return View(np.rot90(self.occupied), self.y, side - self.x, self.heading + math.pi / 2, np.rot90(self.seen))

    def mirrored(self) -> View:
        """Left for right."""
        side = self.occupied.shape[1]
        return View(self.occupied[:, ::-1], side - self.x, self.y, math.pi - self.heading, self.seen[:, ::-1])


def looked(occupied: np.ndarray, x: float, y: float, heading: float, half_fov: float, range_px: float) -> np.ndarray:
    runs, hit, slopes = new_scan_buffers(range_px)
    n_runs, n_hit = sector_scan(np.ascontiguousarray(occupied), x, y, heading, half_fov, range_px, runs, hit, slopes)
    seen = np.zeros(occupied.size, np.uint8)
    for first, last in runs[:n_runs].tolist():
        seen[first : last + 1] = 1
    seen[hit[:n_hit]] = 2
    return seen.reshape(occupied.shape)


@given(
    seeds,
    st.integers(64, 39 * 64),
    st.integers(64, 29 * 64),
    st.integers(-18, 18),
    st.sampled_from([30.0, 90.0, 135.0, 180.0]),
    st.integers(0, 3),
    st.booleans(),
)
@tries(150)
def test_a_turned_or_mirrored_world_is_seen_turned_or_mirrored(
    seed: int, x_64: int, y_64: int, tens: int, half_deg: float, turns: int, mirror: bool
) -> None:
    """Places are 64ths of a cell, which turning does not round."""
    occupied = clutter(seed)
    x, y, heading, half = x_64 / 64, y_64 / 64, math.radians(10 * tens), math.radians(half_deg)
    assume(not occupied[int(y), int(x)] and x_64 % 64 and y_64 % 64)  # on a border it is in another cell when turned
    view = View(occupied, x, y, heading, looked(occupied, x, y, heading, half, 17.0))
    if mirror:
        view = view.mirrored()
    for _ in range(turns):
        view = view.turned()
    assert np.array_equal(looked(view.occupied, view.x, view.y, view.heading, half, 17.0), view.seen)
