"""A disc among square cells: exact ways, and never into anything."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.collision import clearance, disc_is_free, free_distance


def room(rows: int = 20, cols: int = 30) -> np.ndarray:
    occupied = np.ones((rows, cols), np.uint8)
    occupied[1:-1, 1:-1] = 0
    return occupied


def distance(occupied: np.ndarray, x: float, y: float) -> float:
    """From a point to the nearest square."""
    rows, cols = np.nonzero(occupied)
    across = np.maximum(np.maximum(cols - x, x - cols - 1), 0)
    down = np.maximum(np.maximum(rows - y, y - rows - 1), 0)
    return float(np.hypot(across, down).min())


@pytest.mark.parametrize("step", [7.5, 0.3, 0.01, 12.0])
def test_a_free_step_is_exact(step: float) -> None:
    """The published simulator rounds it to whole pixels, below half a pixel to none."""
    assert free_distance(room(), 5.25, 10.0, 1.0, 0.0, step, 3.0) == step


def test_a_wall_stops_it_where_it_touches() -> None:
    """The published simulator stops up to 7 pixels short."""
    occupied = room()
    assert free_distance(occupied, 5.0, 10.0, 1.0, 0.0, 40.0, 3.0) == pytest.approx(21.0, abs=2e-6)
    half = math.sqrt(0.5)
    assert free_distance(occupied, 5.0, 10.0, half, half, 40.0, 3.0) == pytest.approx(6.0 / half, abs=4e-6)


def test_a_corner_stops_it_and_lets_it_pass() -> None:
    occupied = room()
    occupied[5, 15] = 1
    way = free_distance(occupied, 5.0, 8.0, 1.0, 0.0, 20.0, 2.5)  # the corner lies 2 above the way, at x = 15
    assert way == pytest.approx(10.0 - math.sqrt(2.5**2 - 2.0**2), abs=2e-6)
    assert free_distance(occupied, 5.0, 8.6, 1.0, 0.0, 20.0, 2.5) == 20.0


def test_what_it_touches_it_can_leave_and_slide_along() -> None:
    occupied = room()
    x = 5.0 + free_distance(occupied, 5.0, 10.0, 1.0, 0.0, 40.0, 3.0)
    assert free_distance(occupied, x, 10.0, 1.0, 0.0, 5.0, 3.0) == 0.0
    assert free_distance(occupied, x, 10.0, 0.0, 1.0, 4.0, 3.0) == 4.0
    assert free_distance(occupied, x, 10.0, -1.0, 0.0, 4.0, 3.0) == 4.0


def test_the_disc_meets_nothing_and_stops_only_where_it_must() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        occupied = room()
        occupied[1:-1, 1:-1] |= (rng.random((18, 28)) < 0.04).astype(np.uint8)
        x, y, radius = rng.uniform((3, 3, 0.3), (27, 17, 2.6))
        assert disc_is_free(occupied, x, y, radius) == (distance(occupied, x, y) >= radius)
        for _ in range(20):
            if distance(occupied, x, y) < radius:
                break
            angle, step = rng.uniform(-math.pi, math.pi), rng.uniform(0, 9)
            right, down = math.cos(angle), math.sin(angle)
            way = free_distance(occupied, x, y, right, down, step, radius)
            along = [distance(occupied, x + k * right, y + k * down) for k in np.linspace(0, way, 12)]
            assert min(along) >= radius - 2e-9
            if way < step:
                assert distance(occupied, x + (way + 0.01) * right, y + (way + 0.01) * down) < radius
            x, y = x + way * right, y + way * down
            assert disc_is_free(occupied, x, y, radius)


def test_off_the_grid_is_not_free() -> None:
    free = np.zeros((10, 10), np.uint8)
    assert disc_is_free(free, 5.0, 5.0, 5.0)
    assert not disc_is_free(free, 4.9, 5.0, 5.0)
    assert not disc_is_free(free, -8.0, 5.0, 1.0)


def test_clearance_is_from_the_rim_to_the_nearest_square() -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        occupied = room()
        occupied[1:-1, 1:-1] |= (rng.random((18, 28)) < 0.01).astype(np.uint8)
        x, y, radius, limit = rng.uniform((1, 1, 0.3, 3), (29, 19, 2.6, 14))
        expected = max(min(distance(occupied, x, y), limit) - radius, 0.0)
        assert clearance(occupied, x, y, radius, limit) == pytest.approx(expected, abs=1e-12)
    assert clearance(room(), 15.0, 10.0, 2.0, 5.0) == 3.0
    assert clearance(room(), 3.5, 10.0, 2.0, 5.0) == 0.5
    assert clearance(room(), 2.0, 10.0, 2.0, 5.0) == 0.0
