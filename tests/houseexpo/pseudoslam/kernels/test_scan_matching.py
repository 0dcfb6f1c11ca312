"""Scan matching: the kernels beside slow twins, and scans of a room whose pose is known."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import numpy.typing as npt
import pytest

from houseexpo.pseudoslam.envs.slam_env import DOUBT, ScanMatcher
from houseexpo.pseudoslam.kernels.scan_matching import (
    COARSE,
    FINE_LEVELS,
    HIT,
    INSIDE_PX,
    LEAST,
    MISS,
    MOST,
    REACH,
    add_scan,
    draw_score_field,
    evidence_to_map,
    find_best_pose,
    score_pose,
)
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.kernels.types import Sensor

Floats = npt.NDArray[np.float64]
Evidence = npt.NDArray[np.int16]

ANGLES = np.arange(-math.pi / 2, math.pi / 2, math.radians(1.0))
COS, SIN = np.cos(ANGLES), np.sin(ANGLES)
RANGE_PX = 60.0
SENSOR = Sensor(False, math.pi / 2, RANGE_PX, COS, SIN)
ROOM = np.ones((60, 80), np.uint8)
ROOM[5:55, 5:75] = 0
ROOM[20:30, 40:48] = 1
"""A room of 50 x 70 cells with a block in it."""


def ranges_at(x: float, y: float, heading: float) -> Floats:
    found = np.empty(len(COS))
    cast_beams(ROOM, x, y, heading, COS, SIN, RANGE_PX, found)
    return found


def slow_scan(evidence: Evidence, pose: tuple[float, float, float], ranges: Floats, range_px: float) -> None:
    """Each beam by itself: its cells in order, without the one in which it ends."""
    x, y, heading = pose
    for cos, sin, reach in zip(COS, SIN, ranges, strict=True):
        if reach <= 0:
            continue
        right = cos * math.cos(heading) - sin * math.sin(heading)
        down = -(sin * math.cos(heading) + cos * math.sin(heading))
        end = None
        if reach < range_px:
            end = math.floor(y + (reach + INSIDE_PX) * down), math.floor(x + (reach + INSIDE_PX) * right)
        passed = dict.fromkeys(
            (math.floor(y + k * down), math.floor(x + k * right)) for k in range(math.floor(min(reach, range_px)) + 1)
        )
        for cell in passed:
            if cell != end and all(0 <= c < n for c, n in zip(cell, evidence.shape, strict=True)):
                evidence[cell] = max(evidence[cell] + MISS, LEAST)
        if end is not None and all(0 <= c < n for c, n in zip(end, evidence.shape, strict=True)):
            evidence[end] = min(evidence[end] + HIT, MOST)


def slow_field(evidence: Evidence, top: int, left: int, side: int) -> Floats:
    field = np.zeros((side, side))
    walls = np.argwhere(evidence > 0)
    for i, j in product(range(side), range(side)):
        away = walls - (i + top, j + left)
        near = away[(np.abs(away) <= REACH).all(axis=1)]
        if len(near):
            field[i, j] = math.exp(-0.5 * (near**2).sum(axis=1).min())
    return field


def slow_score(field: Floats, top: int, left: int, pose: Floats, ends: Floats) -> float:
    total = 0.0
    for ahead, aside in ends:
        x = pose[0] + ahead * math.cos(pose[2]) - aside * math.sin(pose[2]) - left - 0.5
        y = pose[1] - ahead * math.sin(pose[2]) - aside * math.cos(pose[2]) - top - 0.5
        for i, j in product((math.floor(y), math.floor(y) + 1), (math.floor(x), math.floor(x) + 1)):
            if 0 <= math.floor(y) < len(field) - 1 and 0 <= math.floor(x) < len(field) - 1:
                total += field[i, j] * (1 - abs(y - i)) * (1 - abs(x - j))
    return total / len(ends)


def ends_of(ranges: Floats) -> Floats:
    meets = ranges < RANGE_PX
    reach = ranges[meets] + INSIDE_PX
    return np.stack([reach * COS[meets], reach * SIN[meets]], axis=1)


@pytest.fixture(scope="module")
def drawn() -> Evidence:
    evidence = np.zeros(ROOM.shape, np.int16)
    for heading in np.arange(0.0, 2 * math.pi, 0.5):
        add_scan(evidence, 30.2, 40.7, heading, COS, SIN, ranges_at(30.2, 40.7, heading), RANGE_PX)
    return evidence


def test_a_scan_is_drawn_as_its_beams_one_by_one() -> None:
    rng = np.random.default_rng(3)
    fast, slow = np.zeros((2, *ROOM.shape), np.int16)
    for _ in range(12):
        pose = (rng.uniform(8, 38), rng.uniform(8, 52), rng.uniform(-4, 4))
        ranges = ranges_at(*pose) + rng.normal(0, 1, len(COS))
        ranges[rng.random(len(COS)) < 0.1] = 0.0
        add_scan(fast, *pose, COS, SIN, ranges, RANGE_PX)
        slow_scan(slow, pose, ranges, RANGE_PX)
    assert np.array_equal(fast, slow)
    assert fast.max() == MOST
    assert fast.min() == LEAST


def test_lost_beams_add_nothing_and_far_ones_end_nowhere() -> None:
    evidence = np.zeros((9, 9), np.int16)
    one = np.ones(1), np.zeros(1)
    add_scan(evidence, 1.5, 4.5, 0.0, *one, np.zeros(1), 5.0)
    assert not evidence.any()
    add_scan(evidence, 1.5, 4.5, 0.0, *one, np.array([5.0]), 5.0)
    assert evidence[4].tolist() == [0, -1, -1, -1, -1, -1, -1, 0, 0]
    add_scan(evidence, 1.5, 4.5, 0.0, *one, np.array([2.5]), 5.0)
    assert evidence[4].tolist() == [0, -2, -2, -2, 2, -1, -1, 0, 0]
    known = np.empty((9, 9), np.uint8)
    evidence_to_map(evidence, known)
    assert known[4].tolist() == [0, 127, 127, 127, 255, 127, 127, 0, 0]
    assert not known[3].any()


def test_the_field_and_the_score_are_those_of_slow_twins(drawn: Evidence) -> None:
    for top, left, side in ((-4, -3, 50), (20, 30, 45)):
        field = np.full((side, side), np.nan)
        draw_score_field(drawn, top, left, field)
        assert np.allclose(field, slow_field(drawn, top, left, side))
        ends = ends_of(ranges_at(33.0, 38.0, 0.4))
        for pose in ([33.0, 38.0, 0.4], [33.6, 37.1, 0.37], [60.0, 10.0, 2.0]):
            found = score_pose(field, top, left, *pose, ends)
            assert found == pytest.approx(slow_score(field, top, left, np.array(pose), ends))


def test_a_match_is_the_best_pose_that_is_tried(drawn: Evidence) -> None:
    field, found = np.zeros((120, 120)), np.empty(3)
    draw_score_field(drawn, -20, -20, field)
    truth, ends = np.array([33.0, 38.0, 0.4]), ends_of(ranges_at(33.0, 38.0, 0.4))
    predicted = truth + np.array([1.3, -0.8, math.radians(-1.6)])
    value = find_best_pose(field, -20, -20, predicted, ends, 1.0, math.radians(1.0), 0.001, found)
    best = np.zeros(3)
    for level in range(FINE_LEVELS + 1):
        reach, share = COARSE if level == 0 else 1, 0.5**level
        tried = [best + share * np.array(step) for step in product(range(-reach, reach + 1), repeat=3)]
        values = [
            slow_score(field, -20, -20, predicted + step[[1, 2, 0]] * (1.0, 1.0, math.radians(1.0)), ends)
            - 0.001 * (step**2).sum()
            for step in tried
        ]
        best = tried[int(np.argmax(values))]
    assert np.allclose(found, predicted + best[[1, 2, 0]] * (1.0, 1.0, math.radians(1.0)))
    assert value == pytest.approx(slow_score(field, -20, -20, found, ends))
    assert np.abs(found - truth)[:2].max() < 0.3
    assert abs(found[2] - truth[2]) < math.radians(0.5)


def test_a_matcher_corrects_odometry_that_drifts() -> None:
    """Along a curve through the room, each step errs by a quarter of a cell and a fifth of a degree to one side."""
    slam = ScanMatcher(ROOM.shape, SENSOR, 10.0)
    truth = np.array([15.0, 45.0, 0.6])
    pose = slam.update(truth, ranges_at(*truth))
    assert np.array_equal(pose, truth)
    alone = truth.copy()
    for _ in range(40):
        step = np.array([0.6 * math.cos(truth[2]), -0.6 * math.sin(truth[2]), 0.02])
        truth = truth + step
        wrong = step + np.array([0.0, 0.15, math.radians(0.2)])
        alone = alone + wrong
        pose = slam.update(pose + wrong, ranges_at(*truth))
        assert 0.25 <= slam.score <= 1.0
    assert np.hypot(*(alone - truth)[:2]) > 5.0
    assert np.hypot(*(pose - truth)[:2]) < 1.0
    known = np.empty(ROOM.shape, np.uint8)
    slam.draw(known)
    assert (ROOM[known == 127] == 0).mean() > 0.97


def test_without_walls_the_prediction_stands() -> None:
    slam = ScanMatcher(ROOM.shape, SENSOR, 10.0)
    slam.update(np.array([30.0, 40.0, 0.0]), np.full(len(COS), RANGE_PX))
    moved = slam.update(np.array([31.0, 40.5, 0.1]), np.full(len(COS), RANGE_PX))
    assert moved.tolist() == [31.0, 40.5, 0.1]
    assert slam.score == 0.0
    assert DOUBT > 0.0
