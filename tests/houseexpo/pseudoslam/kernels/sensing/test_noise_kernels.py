"""What beams measure, where a scan comes to lie, and what odometry reports."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.config import NoiseConfig
from houseexpo.pseudoslam.kernels.hashing import normal, uniform
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.odometry import noisy_odometry
from houseexpo.pseudoslam.kernels.sensing.noise import (
    FURTHEST,
    HIT,
    LOST,
    draw_beam_errors,
    draw_noisy_scan,
    merge_patch,
    registration_error,
)
from houseexpo.pseudoslam.kernels.types import Errors, Sensor
from houseexpo.pseudoslam.step_kernels import make_noise_params
from tests.builders.scans import UNASKED

NONE = make_noise_params(NoiseConfig(), 25.0)
BEAMS = 180
Cell = tuple[int, int]


def measured(
    hit: list[Cell],
    x: float,
    y: float,
    shift: float,
    free: list[Cell] | None = None,
    fates: dict[int, int] | None = None,
) -> set[tuple[int, int, int]]:
    """The cells of the patch, in the rows and columns of a grid 50 wide, that a scan all round leaves."""
    patch = np.zeros((43, 43), np.uint8)
    cells = np.array([row * 50 + col for row, col in free or []], np.int32).reshape(-1, 1).repeat(2, axis=1)
    flat = np.array([row * 50 + col for row, col in hit], np.int32)
    fate = np.array([(fates or {}).get(beam, HIT) for beam in range(BEAMS)], np.int32)
    sensor = Sensor(False, math.pi, 20.0, np.ones(BEAMS), np.zeros(BEAMS))
    draw_noisy_scan(patch, 50, x, y, 0.0, sensor, cells, len(cells), flat, len(flat), np.full(BEAMS, shift), fate)
    top, left = int(y) - 21, int(x) - 21
    return {(row + top, col + left, int(patch[row, col])) for row, col in np.argwhere(patch).tolist()}


def test_an_obstacle_moves_along_its_ray_and_not_across() -> None:
    """The published noise shifts a whole ray down and right, by whole pixels."""
    assert measured([(20, 30)], 20.5, 20.5, 0.0) == {(20, 30, OBSTACLE)}
    farther = measured([(20, 30)], 20.5, 20.5, 3.0)
    assert farther == {(20, 30, FREE), (20, 31, FREE), (20, 32, FREE), (20, 33, OBSTACLE)}
    diagonal = measured([(10, 30)], 20.5, 20.5, 2 * math.sqrt(2))
    assert (8, 32, OBSTACLE) in diagonal
    assert all(row - 10 == 30 - col for row, col, _ in diagonal)


def test_behind_an_obstacle_that_came_nearer_nothing_was_seen() -> None:
    free = [(20, col) for col in range(20, 30)]
    found = measured([(20, 30)], 20.5, 20.5, -3.0, free)
    assert found == {*((20, col, FREE) for col in range(20, 27)), (20, 27, OBSTACLE)}


def test_a_beam_without_a_return_decides_nothing_and_a_furthest_one_sees_through() -> None:
    free, ahead = [(20, col) for col in range(22, 30)], BEAMS // 2  # the middle beam looks along the heading
    assert measured([(20, 30)], 20.5, 20.5, 0.0, free, {ahead: LOST}) == set()
    through = measured([(20, 30)], 20.5, 20.5, 0.0, free, {ahead: FURTHEST})
    assert through == {(20, col, FREE) for col in range(22, 41)}
    assert measured([(20, 30)], 20.5, 20.5, 0.0, free, {ahead + 9: LOST, ahead - 9: FURTHEST}) == {
        *((20, col, FREE) for col in range(22, 30)),
        (20, 30, OBSTACLE),
    }


def test_a_patch_is_turned_about_the_robot_then_shifted_and_empties() -> None:
    patch = np.zeros((21, 21), np.uint8)
    patch[10, 10:16] = FREE
    patch[10, 16] = OBSTACLE
    known, observable = np.zeros((40, 40), np.uint8), np.ones((40, 40), np.uint8)
    new, covered, _ = merge_patch(known, observable, patch, 20.5, 20.5, 0.0, -2.0, math.pi / 2, UNASKED)
    assert (new, covered) == (7, 7)
    assert known[12, 20] == OBSTACLE  # six ahead, turned left to look up, shifted two up
    assert (known[13:19, 20] == FREE).all()
    assert not patch.any()


@pytest.mark.parametrize("turn", [0.02, -0.1])
def test_turning_leaves_no_holes(turn: float) -> None:
    patch = np.full((61, 61), FREE, np.uint8)
    known, observable = np.zeros((101, 101), np.uint8), np.zeros((101, 101), np.uint8)
    new, covered, _ = merge_patch(known, observable, patch, 50.3, 50.6, 0.4, 0.2, turn, UNASKED)
    assert (known[26:76, 26:76] == FREE).all()
    assert new == pytest.approx(61 * 61, rel=0.01)
    assert covered == 0


def test_what_a_shift_takes_off_the_map_is_lost() -> None:
    """The published simulator fails where a cell leaves the map."""
    known, observable = np.zeros((30, 30), np.uint8), np.zeros((30, 30), np.uint8)
    new, _, lost = merge_patch(known, observable, np.full((21, 21), FREE, np.uint8), 5.5, 25.5, -3.0, 4.0, 0.0, UNASKED)
    assert new == int((known == FREE).sum()) == 13 * 11
    assert lost == 21 * 21 - new


def test_more_than_a_byte_can_count_counts() -> None:
    known, ones = np.zeros((30, 30), np.uint8), np.ones((30, 30), np.uint8)
    assert merge_patch(known, ones, np.full((31, 31), FREE, np.uint8), 15.0, 15.0, 0.0, 0.0, 0.0, UNASKED) == (
        900,
        900,
        61,
    )
    assert (known != UNKNOWN).all()


def test_beams_are_drawn_from_key_and_scan_alone() -> None:
    errors = NONE._replace(any=True, beams=True, laser_px=2.0, drop_out=0.25, max_range=0.1)
    for key, scan in ((3, 0), (2**50, 7)):
        shift_px, fate = np.empty(20), np.empty(20, np.int32)
        draw_beam_errors(errors, 20, key, scan, shift_px, fate)
        for beam in range(20):
            number = scan * 20 + beam
            share = uniform(key, 4 * number + 2)
            assert shift_px[beam] == 2.0 * normal(key, 2 * number)
            assert fate[beam] == (LOST if share < 0.25 else FURTHEST if share < 0.35 else HIT)


def test_what_errs_not_at_all_is_exact_bit_by_bit() -> None:
    shift_px, fate = np.full(9, 5.0), np.full(9, 5, np.int32)
    draw_beam_errors(NONE, 9, 11, 4, shift_px, fate)
    assert not shift_px.any()
    assert (fate == HIT).all()
    assert noisy_odometry(NONE, 11, 4, 0.3, -7.1) == (0.3, -7.1)
    assert registration_error(NONE, 11, 4) == (0.0, 0.0, 0.0)


def test_beams_err_as_often_and_as_much_as_told() -> None:
    errors = NONE._replace(any=True, beams=True, laser_px=2.0, drop_out=0.2, max_range=0.05)
    shift_px, fate = np.empty(3000), np.empty(3000, np.int32)
    draw_beam_errors(errors, 3000, 5, 1, shift_px, fate)
    assert (fate == LOST).mean() == pytest.approx(0.2, abs=0.025)
    assert (fate == FURTHEST).mean() == pytest.approx(0.05, abs=0.015)
    assert (shift_px.mean(), shift_px.std()) == pytest.approx((0.0, 2.0), abs=0.12)
    assert abs(np.corrcoef(shift_px, fate == LOST)[0, 1]) < 0.06


def test_each_part_of_odometry_and_registration_errs_as_much_as_told() -> None:
    def spread(errors: Errors, turn: float, way: float) -> tuple[float, float]:
        found = np.array([noisy_odometry(errors, 8, step, turn, way) for step in range(1500)])
        assert found.mean(axis=0) == pytest.approx((turn, way), abs=0.1)
        return tuple(found.std(axis=0).tolist())

    assert spread(NONE._replace(way_share=0.1), 0.5, 7.0) == pytest.approx((0.0, 0.7), rel=0.08, abs=1e-9)
    assert spread(NONE._replace(turn_share=0.2), -0.5, 7.0) == pytest.approx((0.1, 0.0), rel=0.08, abs=1e-9)
    assert spread(NONE._replace(turn_rad_px=0.01), 0.0, -7.0) == pytest.approx((0.07, 0.0), rel=0.08, abs=1e-9)
    errors = NONE._replace(shift_px=3.0, turn_rad=0.02)
    found = np.array([registration_error(errors, 8, step) for step in range(1500)])
    assert found.std(axis=0) == pytest.approx((3.0, 3.0, 0.02), rel=0.08)
    assert np.abs(np.corrcoef(found.T) - np.eye(3)).max() < 0.08
