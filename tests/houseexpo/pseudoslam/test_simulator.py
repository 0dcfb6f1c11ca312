from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.floorplan import decode
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, StartConfig
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.simulations import PLAIN, at, started, wander


def test_the_centre_can_be_the_origin() -> None:
    start = StartConfig(random=False, x_m=1.0, y_m=-0.5, heading_deg=0.0, origin="centre")
    simulator, state, _ = started(replace(PLAIN, start=start))
    assert simulator.pose(state) == pytest.approx((5.0, 1.5, 0.0))


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
    assert ((state.known == 255) <= (simulator.world.occupied == 1)).all()
    assert ((state.known == 127) <= (simulator.world.occupied == 0)).all()
    assert state.counts[0] == 300


def test_a_known_map_is_known_from_the_start() -> None:
    simulator, state, _ = started(replace(PLAIN, known_map=True))
    assert np.array_equal(state.known == 255, simulator.world.occupied == 1)
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


def test_a_copy_shares_nothing() -> None:
    simulator, state, rng = started(PLAIN)
    kept = state.copy()
    wander(simulator, state, rng, 10)
    assert kept.counts[0] == 0
    assert not np.array_equal(kept.known, state.known)
