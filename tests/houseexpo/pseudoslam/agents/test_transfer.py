"""Explorers act on maps that others draw: a real SLAM, and another simulator's lidar. Small runs of the benchmark."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.floorplan import FloorPlan
from research.transfer import explore_on_own_map
from research.transfer_irsim import explore_in_irsim
from research.transfer_slam import explore_with_slam
from tests.builders.real_slam import need_icp_slam

ANGLE = FloorPlan("angle", [(0, 0), (0, 8), (3, 8), (3, 2), (9, 2), (9, 0)], 1, {})
STEPS = 40

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("policy", ["frontier", "chooser"])
def test_an_explorer_goes_by_the_map_of_a_real_slam(policy: str, tmp_path: Path) -> None:
    need_icp_slam()
    found = explore_with_slam(ANGLE, policy, tmp_path, STEPS)
    own = explore_on_own_map(ANGLE, policy, STEPS)
    assert found.coverage[0] == own.coverage[0]
    assert found.coverage[-1] > found.coverage[0] + 0.2
    assert found.metres > 0
    assert 0 < found.off_m < 0.2


def test_an_explorer_goes_by_the_lidar_of_another_simulator(tmp_path: Path) -> None:
    found = explore_in_irsim(ANGLE, "frontier", tmp_path, STEPS)
    assert found.coverage[-1] > found.coverage[0] + 0.2
    assert found.metres > 0
    assert found.collisions == 0
