"""Where the published simulator departs from its paper, and what tests of single parts do not show."""

from __future__ import annotations

import math
import mmap
import resource
from dataclasses import replace

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import (
    LaserConfig,
    RobotConfig,
)
from houseexpo.pseudoslam.simulator import Simulator
from tests.builders.simulations import PLAIN, at, hall, hall_with_cell, started, wander


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


def test_7_it_never_starts_in_a_pocket_and_all_that_counts_can_be_seen() -> None:
    """There: it starts in pockets that it cannot leave, and asks for cells that nobody can see."""
    all_round = replace(PLAIN, laser=LaserConfig(fov_deg=360.0))
    simulator, rng = Simulator.of(hall_with_cell(), all_round), np.random.default_rng(2)
    assert all(simulator.pose(simulator.start(rng))[0] < 5 for _ in range(100))
    with pytest.raises(ConfigError, match=r"cannot go from \(5.5, 0.5\) m to the largest part"):
        started(at(5.5, 0.5, 0), hall_with_cell())
    behind = simulator.world.observable[:, 129:]
    assert 0 < behind.sum() < (simulator.world.occupied[:, 129:] == 0).sum()
    state = simulator.start(rng)
    for row, col in np.argwhere(simulator.world.traversable).tolist():
        state.poses_px[:] = np.tile((col + 0.5, row + 0.5, 0.0), 2)
        simulator.move(state, 0.0, 0.0)
    assert simulator.coverage(state) == 1.0


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
