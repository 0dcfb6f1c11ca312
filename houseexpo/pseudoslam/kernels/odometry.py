"""Compute the errors of the motion that odometry reports for a step, and the share of it that is not lost by slip.

All numbers are pure functions of keys and the number of the step. The parameters of the model (``config.Odometry``) are
in ``Errors.alphas``, with lengths in pixels.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from houseexpo.pseudoslam.kernels.episode import BIAS, MODEL, ODOMETRY, SLIP, noise_key
from houseexpo.pseudoslam.kernels.hashing import normal, uniform
from houseexpo.pseudoslam.kernels.types import Errors, Rows


class OdometryErrors(NamedTuple):
    """The errors of odometry in a step, radians and pixels: turns before, during and after the motion, and the way."""

    before: float
    turn: float
    way: float
    after: float


@njit(cache=True, nogil=True)
def grip_share(errors: Errors, key: int, step: int) -> float:
    """Return the share of a step that is not lost by slipping; ``key`` is the episode's."""
    return 1.0 - 2.0 * errors.slip * uniform(noise_key(key, SLIP), step) if errors.slip > 0.0 else 1.0


@njit(cache=True, nogil=True)
def draw_odometry_errors(
    errors: Errors, counts: Rows, readings: Rows, turn: float, way: float, arc: bool, seconds: float
) -> OdometryErrors:
    """Return the errors of what odometry reports for a step of the wheels, and update the bias.

    Parameters
    ----------
    turn, way
        The turn and the way of the wheels, negative for backward, radians and pixels.
    arc
        Whether the robot turns as it goes, and not before.
    """
    step = counts.steps
    seen_turn, seen_way = noisy_odometry(errors, noise_key(counts.key, ODOMETRY), step, turn, way)
    first, more_way, last = _model_errors(errors, noise_key(counts.key, MODEL), step, turn, way, arc)
    more_turn = 0.0
    if errors.bias > 0.0 and step > 0:  # the first scan is not a step
        readings.bias += errors.bias * math.sqrt(seconds) * normal(noise_key(counts.key, BIAS), step)
        more_turn = readings.bias * seconds
    return OdometryErrors(first, seen_turn - turn + more_turn, seen_way - way + more_way, last)


@njit(cache=True, nogil=True)
def noisy_odometry(errors: Errors, key: int, step: int, turn: float, way: float) -> tuple[float, float]:
    """Return the turn and the distance that odometry reports for a step's true ones, radians and pixels."""
    turned = errors.turn_share * abs(turn) * normal(key, 3 * step)
    turned += errors.turn_rad_px * abs(way) * normal(key, 3 * step + 1)
    return turn + turned, way * (1.0 + errors.way_share * normal(key, 3 * step + 2))


@njit(cache=True, nogil=True)
def _model_errors(
    errors: Errors, key: int, step: int, turn: float, way: float, arc: bool
) -> tuple[float, float, float]:
    """Return the errors of the model: the turn before the motion, the way, and the turn after it."""
    if not errors.modelled:
        return 0.0, 0.0, 0.0
    alphas, way2 = errors.alphas, way * way
    first, last = (turn / 2.0, turn / 2.0) if arc else (turn, 0.0)
    more_first = math.sqrt(alphas[0] * first * first + alphas[1] * way2) * normal(key, 4 * step)
    more_way = math.sqrt(alphas[2] * way2 + alphas[3] * (first * first + last * last)) * normal(key, 4 * step + 1)
    more_last = math.sqrt(alphas[0] * last * last + alphas[1] * way2) * normal(key, 4 * step + 2)
    return more_first, more_way, more_last
