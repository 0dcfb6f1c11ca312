"""What the map says of frontiers, on maps that one can draw."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES, LOOKED_AT, compute_features
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.planner_types import FRONTIER
from houseexpo.pseudoslam.planning import feature_rules, frontier_rules
from houseexpo.pseudoslam.step_kernels import enlarge_scratch, make_scratch
from tests.builders.robot_maps import FREE

CONFIG = SimulatorConfig(10.0, robot=RobotConfig(radius_m=0.12), laser=LaserConfig(range_m=2.0))


def described(known: np.ndarray, x: float, y: float, heading: float, steps: int = 0) -> list[dict[str, float]]:
    scratch = enlarge_scratch(make_scratch(CONFIG), known.size)
    table, features = np.zeros(64, FRONTIER), np.full((LOOKED_AT, len(FEATURES)), np.nan)
    n = find_frontiers(known, x, y, frontier_rules(CONFIG), np.zeros(0, np.int32), scratch, table)
    looked = compute_features(known, x, y, heading, steps, table, n, feature_rules(CONFIG), scratch.ways, features)
    assert looked == min(n, LOOKED_AT)
    assert np.isfinite(features[:looked]).all()
    return [dict(zip(FEATURES, row, strict=True)) for row in features[:looked].tolist()]


def corridor() -> np.ndarray:
    """A corridor of 60 x 12 cells, known in its middle third: unknown at both ends."""
    known = np.full((14, 62), 255, np.uint8)
    known[1:-1, 1:-1] = 0
    known[1:-1, 21:41] = FREE
    return known


def test_two_ends_of_a_corridor() -> None:
    """The robot heads right, and stands nearer to the left end."""
    left, right = described(corridor(), 25.5, 7.5, 0.0, steps=400)
    assert left["rank"] == 0.0
    assert left["way"] < right["way"]
    assert left["way beyond the nearest"] == 0.0
    assert right["way beyond the nearest"] == pytest.approx(right["way"] - left["way"])
    assert left["log way"] == pytest.approx(math.log1p(10 * left["way"]))
    assert left["turn"] == pytest.approx(1.0, abs=0.15)
    assert right["turn"] == pytest.approx(0.0, abs=0.15)
    assert left["large"] == right["large"] == 1.0
    assert left["log length"] == pytest.approx(math.log1p(1.2))
    assert left["log sight from the goal"] == pytest.approx(right["log sight from the goal"], abs=0.05)
    assert 0.0 < left["unknown within 5 m"] < left["unknown within 1 m"] < 1.0
    assert left["nearer to the others"] == pytest.approx((15 - 20) / 100, abs=0.02)
    assert left["tour beyond the shortest"] == 0.0
    assert right["tour beyond the shortest"] == pytest.approx(right["way"] - left["way"], abs=0.02)
    for one in (left, right):
        assert one["large ones"] == 2 / LOOKED_AT
        assert one["unknown share"] == pytest.approx(40 * 12 / (14 * 62), abs=0.02)
        assert one["steps"] == 0.5


def test_off_the_grid_nothing_is_unknown() -> None:
    """The same frontier, with 40 more columns of the unknown behind it and with 3."""
    known = np.full((14, 70), 255, np.uint8)
    known[1:-1, 1:-1] = 0
    known[1:-1, 1:21] = FREE
    (wide,) = described(known, 10.5, 7.5, 0.0)
    (narrow,) = described(np.ascontiguousarray(known[:, :25]), 10.5, 7.5, 0.0)
    assert narrow["unknown within 5 m"] < wide["unknown within 5 m"]
    assert narrow["log sight from the middle"] < wide["log sight from the middle"]
    assert narrow["to the rim"] == pytest.approx(3 / 50)  # cells, of 5 m
    assert wide["to the rim"] == pytest.approx(6 / 50)  # rows, here


def test_no_more_are_described_than_are_looked_at() -> None:
    known = np.full((40, 122), FREE, np.uint8)
    known[[0, -1]] = known[:, [0, -1]] = 255
    known[20, 5:115:5] = 0
    assert len(described(known, 3.5, 3.5, 0.0)) == LOOKED_AT
