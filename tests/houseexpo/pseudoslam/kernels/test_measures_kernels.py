"""The measures of episodes, against their slow twin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.spec import new_episode_constants
from houseexpo.pseudoslam.kernels.episode import COUNTS, POSE, READINGS, Episode
from houseexpo.pseudoslam.metrics import Metrics

CONFIG = SimulatorConfig(16.0, max_steps=50)
N = 5


def pool_of(rng: np.random.Generator) -> Episode:
    """As much of a pool as metrics look at, with other numbers in each place."""
    found: Any = {}
    for name, dtype in (("counts", COUNTS), ("readings", READINGS), ("pose", POSE)):
        found[name] = np.zeros((N, 1), dtype)
        for field in dtype.names:
            found[name][field] = rng.integers(0, 100, (N, 1)) if dtype is COUNTS else rng.normal(0.0, 50.0, (N, 1))
    found["counts"]["blocked"] = rng.integers(0, 2, (N, 1))
    rest = dict.fromkeys(Episode._fields)
    return Episode(**{**rest, **found})


@pytest.mark.parametrize("seed", range(4))
def test_each_is_what_its_twin_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pool, constants = pool_of(rng), new_episode_constants(N)
    constants.rows[:] = rng.normal(0.0, 10.0, constants.rows.shape)
    constants.rows[:, [2, 5]], constants.rows[:, 6] = 0.0, rng.integers(1, 2000, N)
    found = Metrics.of(constants, pool, CONFIG)
    for part, dtype in ((pool.counts, COUNTS), (pool.readings, READINGS), (pool.pose, POSE)):
        for name in dtype.names or ():
            assert found.rows[name].tolist() == part[name][:, 0].tolist()
    for i in range(N):
        counts, pose = pool.counts[i, 0], pool.pose[i, 0]
        assert found.explored_m2[i] == counts["known"] * (1 / 16.0) ** 2
        assert found.coverage[i] == counts["covered"] / constants.observable[i]
        assert found.collided[i] == (counts["blocked"] == 1)
        assert found.truncated()[i] == (counts["steps"] >= 50)
        corner_x, corner_y = constants.corner_m[i, :2]
        assert found.pose[i].tolist() == [pose["x"] / 16.0 + corner_x, -pose["y"] / 16.0 + corner_y, pose["heading"]]
        corner_x, corner_y = constants.corner_m[i, 3:5]
        assert found.believed_pose[i].tolist() == [
            pose["seen_x"] / 16.0 + corner_x, -pose["seen_y"] / 16.0 + corner_y, pose["seen_heading"]
        ]  # fmt: skip
    assert found.collided.any()
    assert found.truncated().any()
    assert not found.truncated().all()


def test_later_steps_change_nothing_in_them() -> None:
    pool, constants = pool_of(np.random.default_rng(0)), new_episode_constants(N)
    found = Metrics.of(constants, pool, CONFIG)
    rows, poses = found.rows.tobytes(), found.poses.tobytes()
    for part in (pool.counts, pool.readings, pool.pose):
        part[:] = 0
    Metrics.of(constants, pool, CONFIG)
    assert (found.rows.tobytes(), found.poses.tobytes()) == (rows, poses)
