"""How much could be seen from a place, and the next step towards a goal, beside slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from houseexpo.pseudoslam.kernels.collision import free_distance
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontiers import unknown_area_in_sight
from houseexpo.pseudoslam.kernels.planning.paths import NO_TURN, choose_turns, distance_at, find_distances
from houseexpo.pseudoslam.kernels.types import new_path_scratch

ANGLES = np.arange(360) * (2 * math.pi / 360)
TURN, STEP, RADIUS = math.radians(10), 6.0, 4.0


def gain(known: np.ndarray, x: float, y: float, range_px: float) -> float:
    return float(unknown_area_in_sight(known, x, y, range_px, np.cos(ANGLES), np.sin(ANGLES)))


def test_from_the_middle_of_nowhere_a_disc_is_seen() -> None:
    assert gain(np.zeros((101, 101), np.uint8), 50.5, 50.5, 40.0) == pytest.approx(math.pi * 40**2, rel=0.01)


def slow_gain(known: np.ndarray, x: float, y: float, range_px: float) -> float:
    total = 0.0
    for angle in ANGLES:
        for away in np.arange(0.5, int(range_px), 1.0):
            row, col = math.floor(y - away * math.sin(angle)), math.floor(x + away * math.cos(angle))
            if not (0 <= row < len(known) and 0 <= col < known.shape[1]) or known[row, col] == OBSTACLE:
                break
            total += away * 2 * math.pi / 360 * (known[row, col] == UNKNOWN)
    return total


def test_it_is_its_slow_twin() -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        known = rng.choice(np.array([UNKNOWN, FREE, OBSTACLE], np.uint8), (40, 50), p=[0.5, 0.48, 0.02])
        x, y = rng.uniform(5, 35, 2).tolist()
        assert gain(known, x, y, 25.0) == pytest.approx(slow_gain(known, x, y, 25.0))


def house() -> np.ndarray:
    """60 x 90 cells, two rooms with a gap of 12 cells at the top."""
    known = np.full((60, 90), FREE, np.uint8)
    known[[0, -1]] = known[:, [0, -1]] = OBSTACLE
    known[14:, 44:46] = OBSTACLE
    return known


def walk(known: np.ndarray, pose: list[float], goal: tuple[float, float], most: int = 300) -> list[tuple[float, float]]:
    ways = new_path_scratch(known.size)
    find_distances(known, *goal, RADIUS, -1, ways)
    x, y, heading = pose
    trail, actions = [(x, y)], 0
    while (turns := choose_turns(known, x, y, heading, TURN, STEP, RADIUS, 0.95, 1, ways)) != NO_TURN:
        actions += abs(turns) + 1
        assert actions < most
        heading += turns * TURN
        walls = (known == OBSTACLE).astype(np.uint8)
        way = free_distance(walls, x, y, math.cos(heading), -math.sin(heading), STEP, RADIUS)
        x, y = x + way * math.cos(heading), y - way * math.sin(heading)
        trail.append((x, y))
    return trail


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_it_leads_round_the_wall_to_the_goal(heading: float) -> None:
    trail = walk(house(), [20.0, 40.0, heading], (70.0, 40.0))
    assert math.dist(trail[-1], (70.0, 40.0)) <= STEP
    assert min(y for _, y in trail) < 14
    assert (len(trail) - 2) * STEP < 1.1 * (math.dist((20, 40), (44, 10)) + math.dist((46, 10), (70, 40)))


def test_it_does_not_step_into_what_is_unknown() -> None:
    known = house()
    known[30:, 20:40] = UNKNOWN
    assert all(not (y > 30 and 20 < x < 40) for x, y in walk(known, [10.5, 50.5, 0.0], (30.5, 8.5)))


def test_a_small_robot_beside_the_end_of_a_thin_wall_goes_round_it() -> None:
    known = np.full((20, 20), FREE, np.uint8)
    known[[0, -1]] = known[:, [0, -1]] = OBSTACLE
    known[10:, 10] = OBSTACLE
    radius, step = 1.0, 3.0  # pixels: 0.1 m and 0.3 m in cells of 0.1 m
    ways = new_path_scratch(known.size)
    find_distances(known, 14.5, 16.5, radius, -1, ways)
    for x in np.arange(7.0, 10.0, 0.25):
        for y in np.arange(8.25, 11.0, 0.25):
            if free_distance((known != FREE).astype(np.uint8), x, y, -1.0, 0.0, step, radius) == step:
                assert choose_turns(known, x, y, 0.0, TURN, step, radius, 0.95, 1, ways) != NO_TURN, (x, y)


def test_no_step_shortens_no_way() -> None:
    known = house()
    known[:14, 44:46] = OBSTACLE
    ways = new_path_scratch(known.size)
    find_distances(known, 70.0, 40.0, RADIUS, -1, ways)
    assert choose_turns(known, 20.0, 40.0, 0.0, TURN, STEP, RADIUS, 0.95, 1, ways) == NO_TURN
    assert distance_at(ways, len(known), 20.0, 40.0, 6) == math.inf
    assert choose_turns(known, 70.0, 40.0, 0.0, TURN, STEP, RADIUS, 0.95, 1, ways) == NO_TURN  # it is there


def slow_best(known: np.ndarray, x: float, y: float, heading: float, enough: float, parts: int, ways: object) -> int:
    walls, options = (known != FREE).astype(np.uint8), []
    near = distance_at(ways, len(known), x, y, 3)
    here = near if near < math.inf else distance_at(ways, len(known), x, y, math.ceil(RADIUS) + 2)
    for k in range(-18 * parts, 18 * parts + 1):
        right, down = math.cos(heading + k * TURN / parts), -math.sin(heading + k * TURN / parts)
        way = free_distance(walls, x, y, right, down, STEP, RADIUS)
        gain = here - distance_at(ways, len(known), x + way * right, y + way * down, 3)
        if gain > 35.0:
            options.append((way == STEP, gain, k))
    options = [option for option in options if option[0]] or options
    most = max((gain for _, gain, _ in options), default=0.0)
    options = [(max(abs(k) - 1, 0) // parts, -gain, k) for _, gain, k in options if gain >= enough * most]
    by_turns = min(options, key=lambda one: (abs(one[2]), one[2]) if parts == 1 else one, default=(0, 0.0, NO_TURN))
    return by_turns[2]


@pytest.mark.parametrize("parts", [1, 4])
def test_the_next_step_is_that_of_its_twin(parts: int) -> None:
    known, rng = house(), np.random.default_rng(4)
    ways = new_path_scratch(known.size)
    find_distances(known, 70.0, 40.0, RADIUS, -1, ways)
    found = 0
    for _ in range(200):
        x, y, heading = *rng.uniform((5, 5), (84, 54)), rng.uniform(-3, 3)
        if free_distance((known != FREE).astype(np.uint8), x, y, 1.0, 0.0, 1.0, RADIUS) == 0.0:
            continue
        enough = rng.uniform(0.5, 1.0)
        expected = slow_best(known, x, y, heading, enough, parts, ways)
        assert choose_turns(known, x, y, heading, TURN, STEP, RADIUS, enough, parts, ways) == expected
        found += expected != NO_TURN
    assert found > 50
