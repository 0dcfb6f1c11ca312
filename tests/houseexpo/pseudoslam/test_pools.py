"""Episodes in pools: the same arrays, seen with one axis more."""

from __future__ import annotations

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam import Simulator, SimulatorConfig
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.state import RASTERS, flatten_episode, pool_of_one, unflatten_episode, view_episode


@pytest.fixture
def episode() -> Episode:
    plan = FloorPlan("box", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {})
    return Simulator.of(plan, SimulatorConfig(10.0)).start(np.random.default_rng(0)).episode


def test_all_arrays_in_their_order(episode: Episode) -> None:
    found = flatten_episode(episode)
    assert all(isinstance(leaf, np.ndarray) for leaf in found)
    assert len(found) == 10 + 3 + 4 + 4 + 3 + 3 + 4 + 1 + 3
    assert found[0] is episode.occupied
    assert found[10] is episode.bodies.clocks
    assert found[23] is episode.paths.corners
    assert found[-4] is episode.changed
    assert found[-1] is episode.blocks.whole


def test_the_same_tuples_of_other_arrays(episode: Episode) -> None:
    numbered = unflatten_episode(episode, (np.array(k) for k, _ in enumerate(flatten_episode(episode))))
    assert [int(leaf) for leaf in flatten_episode(numbered)] == list(range(35))
    assert list(map(type, numbered)) == list(map(type, episode))
    assert int(numbered.flow.sizes) == 10 + 3 + 4


def test_there_and_back_are_views(episode: Episode) -> None:
    pool = pool_of_one(episode)
    back = view_episode(pool, 0, episode.occupied.shape)
    assert list(map(type, pool)) == list(map(type, back)) == list(map(type, episode))
    for k, (leaf, pooled, again) in enumerate(zip(*map(flatten_episode, (episode, pool, back)), strict=True)):
        assert pooled.shape == ((1, leaf.size) if k < RASTERS else (1, *leaf.shape))
        assert again.shape == leaf.shape
        assert leaf.size == 0 or (np.shares_memory(leaf, pooled) and np.shares_memory(leaf, again))
        np.testing.assert_array_equal(again, leaf)
