"""What a step of a team adds to a robot's step, beside slow twins."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.collision import MOVING, PERSON, THINNER_PX, mark_disc
from houseexpo.pseudoslam.kernels.episode import COUNTS, POSE
from houseexpo.pseudoslam.kernels.mapping import CHUNK
from houseexpo.pseudoslam.kernels.team_step import (
    APART_PX,
    EVERYONE,
    NOTHING,
    ROBOT,
    SOMEONE,
    TOGETHER,
    TeamKnowledge,
    TeamObstacles,
    count_met_and_seen,
    count_step,
    prepare_motions,
)
from houseexpo.pseudoslam.step_kernels import make_step_params

ROWS, COLS, RADIUS, PERSON_RADIUS, SIGHT = 30, 40, 3.0, 4.0, 12.0
CELLS, PADDED, ROBOTS = ROWS * COLS, 7, 3


class Scene(NamedTuple):
    """Three robots of some teams, and what is round them; ``rows`` are the pool's rows of robot 1 of each team."""

    others: TeamObstacles
    occupied: np.ndarray
    counts: np.ndarray
    poses: np.ndarray
    sizes: np.ndarray
    rows: np.ndarray


def distance_to_touch(
    offsets: Iterable[Iterable[float]], reach: float, course: tuple[float, float], way: float, touch: float
) -> float:
    """Return how far, up to ``way``, a disc can go until it touches one of others, at ``offsets`` from its centre."""
    free = way
    for x, y in offsets:
        along = x * course[0] + y * course[1]
        inside = along * along - (x * x + y * y - reach * reach)
        if along > 0.0 and inside > 0.0:
            free = min(free, max(along - math.sqrt(inside) - touch, 0.0))
    return free


def _scene(seed: int, teams: int) -> Scene:
    rng = np.random.default_rng(seed)
    robots = teams * ROBOTS
    walls = (rng.random((teams, CELLS + PADDED)) < 0.1).astype(np.uint8)  # padded, as for a larger house
    places = np.zeros((robots, ROBOTS, 2))
    places[::ROBOTS] = rng.uniform((5, 5), (35, 25), (teams, ROBOTS, 2))
    people = np.zeros((robots, 2), PERSON)
    people["x"], people["y"], people["speed"] = 20.0, rng.uniform(5, 25, (robots, 2)), [1.0, 0.0]  # one has a place
    drawn = np.full((robots, ROBOTS + 2, 2), np.nan)
    nothing = np.zeros(teams, np.uint8)
    others = TeamObstacles(
        walls, people, places, drawn, nothing, np.zeros(teams, np.int64), RADIUS, PERSON_RADIUS, SIGHT
    )
    poses, rows = np.zeros((robots, 1), POSE), np.arange(teams) * ROBOTS + 1
    poses["x"][rows, 0], poses["y"][rows, 0] = places[::ROBOTS, 1].T
    poses["heading"] = rng.uniform(-3, 3, (robots, 1))
    occupied = np.full((robots, CELLS + PADDED), 9, np.uint8)
    return Scene(others, occupied, np.zeros((robots, 1), COUNTS), poses, np.tile([ROWS, COLS], (robots, 1)), rows)


def test_prepare_draws_what_is_round_a_robot_and_shortens_its_motion() -> None:
    teams, errors = 90, make_step_params(SimulatorConfig()).errors
    others, occupied, counts, poses, sizes, chosen = _scene(0, teams)
    rng = np.random.default_rng(1)
    for i, row in enumerate(chosen.tolist()):  # half of them begin, the others have old discs to erase
        counts["steps"][row, 0], counts["known"][row, 0] = (-1, 50) if i % 2 else (4, 60)
        if i % 2 == 0:
            occupied[row, :CELLS] = others.walls[i, :CELLS]
            for k in (0, ROBOTS):
                others.drawn[row, k] = rng.uniform((5, 5), (35, 25))
                radius = (RADIUS if k < ROBOTS else PERSON_RADIUS) - THINNER_PX
                mark_disc(occupied[row, :CELLS].reshape(ROWS, COLS), *others.drawn[row, k], radius)
    motions = np.column_stack([rng.uniform(-1, 1, len(poses)), rng.uniform(-9, 9, len(poses))])
    wanted = motions.copy()
    prepare_motions(occupied, counts, poses, sizes, motions, others, errors, 1, 0, teams)
    rows, cols = np.mgrid[:ROWS, :COLS] + 0.5
    for i, row in enumerate(chosen.tolist()):
        places, person = others.places[row - 1], others.people[row - 1, 0]
        cells = others.walls[i, :CELLS].reshape(ROWS, COLS).copy()
        discs = [(person["x"], person["y"], PERSON_RADIUS - THINNER_PX)]
        discs += [(*places[k], RADIUS - THINNER_PX) for k in (0, 2)]
        for x, y, radius in discs:
            cells[np.hypot(cols - x, rows - y) <= radius] |= MOVING
        assert np.array_equal(occupied[row, :CELLS].reshape(ROWS, COLS), cells)
        assert (occupied[row, CELLS:] == 9).all()
        assert others.had[i] == (0 if i % 2 else 60)
        turn, forward = wanted[row].tolist()
        angle, sign = float(poses["heading"][row, 0]) + turn, -1.0 if forward < 0 else 1.0
        course = sign * math.cos(angle), -sign * math.sin(angle)
        offsets = (places[[0, 2]] - places[1]).tolist()
        free = distance_to_touch(offsets, 2 * RADIUS, course, abs(forward), APART_PX)
        to_person = [[person["x"] - places[1, 0], person["y"] - places[1, 1]]]
        before_person = distance_to_touch(to_person, RADIUS + PERSON_RADIUS, course, abs(forward), APART_PX)
        assert motions[row].tolist() == [turn, math.copysign(min(free, before_person), forward)]
        assert others.meets[i] == (SOMEONE if before_person < free else ROBOT if free < abs(forward) else NOTHING)
    assert {NOTHING, ROBOT, SOMEONE} == set(others.meets.tolist())


def test_without_people_a_robot_has_those_in_its_cells_that_it_can_see() -> None:
    teams, errors = 40, make_step_params(SimulatorConfig()).errors
    others, occupied, counts, poses, sizes, chosen = _scene(4, teams)
    others.people["speed"] = 0.0
    rng, motions, far = np.random.default_rng(5), np.zeros((len(poses), 2)), 0
    rows, cols = np.mgrid[:ROWS, :COLS] + 0.5
    for step in range(-1, 6):
        counts["steps"] = step
        motions[:, 1] = 2.0
        still, moved = others.places[chosen - 1, 0], rng.uniform((5, 5), (35, 25), (teams, 2))
        near = np.hypot(*(moved - still).T) < 2 * RADIUS  # robots do not overlap
        moved[near] = still[near] + np.where(still[near, :1] < 20, 1, -1) * (7.0, 0.0)
        others.places[chosen - 1, 2] = moved
        prepare_motions(occupied, counts, poses, sizes, motions, others, errors, 1, 0, teams)
        for i, row in enumerate(chosen.tolist()):
            cells = others.walls[i, :CELLS].reshape(ROWS, COLS).copy()
            for k in (0, 2):
                x, y = others.places[row - 1, k]
                disc = np.hypot(cols - x, rows - y) <= RADIUS - THINNER_PX
                if math.dist((x, y), others.places[row - 1, 1]) <= SIGHT + 2.0:
                    cells[disc] |= MOVING
                else:
                    far += 1
            assert np.array_equal(occupied[row, :CELLS].reshape(ROWS, COLS), cells)
    assert 0 < far < teams * 14


def test_counting_a_step() -> None:
    teams = 60
    rng = np.random.default_rng(6)
    together, observable = np.zeros(teams, TOGETHER), np.full(teams, 100.0)
    together["steps_90"] = together["steps_99"] = np.nan
    for step in range(1, 5):
        together["covered"] = rng.integers(85, 101, teams)
        active, joined, before = rng.integers(0, 2, teams), rng.integers(0, 2, teams), together.copy()
        some = count_step(together, active.astype(np.uint8), joined.astype(np.uint8), observable)
        assert np.array_equal(together["steps"], before["steps"] + active)
        assert np.array_equal(together["joined"], before["joined"] + active * joined)
        for level in (90, 99):
            old, new = before[f"steps_{level}"], together[f"steps_{level}"]
            reached = (active > 0) & (together["covered"] >= level) & np.isnan(old)
            assert np.array_equal(new, np.where(reached, before["steps"] + 1.0, old), equal_nan=True)
            assert some or not reached.any()
        assert some == (step < 5)
    assert not count_step(together, np.zeros(teams, np.uint8), np.zeros(teams, np.uint8), observable)


def test_gather_counts_meetings_and_adds_what_a_robot_saw() -> None:
    teams = 12
    others, _, counts, poses, sizes, chosen = _scene(2, teams)
    rng = np.random.default_rng(3)
    known = rng.choice(np.array([0, 127, 255], np.uint8), (len(poses), CELLS))
    observable = rng.integers(0, 2, known.shape).astype(np.uint8)
    before = rng.choice(np.array([0, 127], np.uint8), (teams, CELLS), p=(0.8, 0.2))
    chunks = -(-CELLS // CHUNK)
    fresh = rng.integers(0, 2, (len(poses), chunks)).astype(np.uint8)
    pending, waiting = np.zeros((teams, ROBOTS, chunks), np.uint16), np.zeros((teams, ROBOTS, 1), np.uint16)
    shared = TeamKnowledge(before.copy(), pending, waiting, np.zeros(teams, TOGETHER))
    counts["known"][chosen, 0], counts["blocked"][chosen, 0] = np.arange(teams) + 5, np.arange(teams) % 3 == 0
    others.meets[:], others.had[:] = np.arange(teams) % 3, 2
    blocked, met, marks = counts["blocked"][chosen, 0].copy(), others.meets.copy(), fresh.copy()
    poses["x"] += 1.0
    count_met_and_seen(observable, known, counts, poses, sizes, fresh, others, shared, 1, 0, teams)
    for i, row in enumerate(chosen.tolist()):
        near = np.repeat(marks[row] != 0, CHUNK)[:CELLS]
        new = near & (before[i] == 0) & (known[row] != 0)
        assert np.array_equal(shared.known[i], np.where(new, known[row], before[i]))
        found = shared.together[i]
        seen = (new & (observable[row] > 0)).sum()
        assert (found["explored"], found["covered"], found["found"]) == (new.sum(), seen, i + 3)
        assert found["meetings"] == (met[i] == ROBOT)
        assert counts["collisions"][row, 0] == (met[i] != NOTHING and not blocked[i])
        assert counts["blocked"][row, 0] == (met[i] != NOTHING or blocked[i])
        untold = np.zeros((ROBOTS, chunks), np.uint16)
        untold[1] = np.where(marks[row], EVERYONE & ~0b10, 0)
        assert np.array_equal(pending[i], untold)
        assert waiting[i].tolist() == [[0], [EVERYONE & ~0b10], [0]]
    others_rows = np.setdiff1d(np.arange(len(poses)), chosen)
    assert not fresh[chosen].any()
    assert np.array_equal(fresh[others_rows], marks[others_rows])
    assert np.array_equal(others.places[::ROBOTS, 1], np.column_stack([poses["x"][chosen, 0], poses["y"][chosen, 0]]))
    assert not others.meets.any()
