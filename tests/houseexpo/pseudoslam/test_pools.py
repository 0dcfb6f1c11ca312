"""Episodes in pools: the same arrays, seen with one axis more."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam import Simulator, SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.state import RASTERS, flatten_episode, pool_of_one, view_episode


@pytest.fixture
def episode() -> Episode:
    plan = FloorPlan("box", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {})
    return Simulator.of(plan, SimulatorConfig(10.0)).start(np.random.default_rng(0)).episode


def test_there_and_back_are_views(episode: Episode) -> None:
    pool = pool_of_one(episode)
    back = view_episode(pool, 0, episode.occupied.shape)
    assert list(map(type, pool)) == list(map(type, back)) == list(map(type, episode))
    for k, (leaf, pooled, again) in enumerate(zip(*map(flatten_episode, (episode, pool, back)), strict=True)):
        assert pooled.shape == ((1, leaf.size) if k < RASTERS else (1, *leaf.shape))
        assert again.shape == leaf.shape
        assert leaf.size == 0 or (np.shares_memory(leaf, pooled) and np.shares_memory(leaf, again))
        np.testing.assert_array_equal(again, leaf)
