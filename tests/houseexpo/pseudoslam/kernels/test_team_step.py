"""What a step of a team adds to a robot's step, beside slow twins."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.collision import MOVING, PERSON
from houseexpo.pseudoslam.kernels.episode import COUNTS, POSE
from houseexpo.pseudoslam.kernels.team_step import APART_PX, THINNER_PX, TOGETHER, Others, gather, prepare
from houseexpo.pseudoslam.step_kernels import step_params_of
from houseexpo.pseudoslam.teams.discs import way_past

ROWS, COLS, RADIUS = 30, 40, 3.0


def _scene(seed: int, teams: int) -> tuple[Others, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what is round three robots of some teams, and the cells, counts, poses and sizes of robot 1 of each."""
    rng = np.random.default_rng(seed)
    walls = (rng.random((teams, ROWS * COLS + 7)) < 0.1).astype(np.uint8)  # padded, as for a larger house
    places = rng.uniform((5, 5), (35, 25), (teams, 3, 2))
    people = np.zeros((teams, 2), PERSON)
    people["x"], people["y"], people["speed"] = 20.0, rng.uniform(5, 25, (teams, 2)), [1.0, 0.0]  # one has a place
    others = Others(walls, people, places, np.zeros(teams, np.uint8), RADIUS, 4.0)
    poses = np.zeros((teams, 1), POSE)
    poses["x"][:, 0], poses["y"][:, 0] = places[:, 1].T
    poses["seen_x"], poses["seen_y"] = poses["x"], poses["y"]
    poses["heading"] = rng.uniform(-3, 3, (teams, 1))
    return others, np.full_like(walls, 9), np.zeros((teams, 1), COUNTS), poses, np.tile([ROWS, COLS], (teams, 1))


def test_prepare_draws_what_is_round_a_robot_and_shortens_its_motion() -> None:
    teams, errors = 60, step_params_of(SimulatorConfig()).errors
    others, occupied, counts, poses, sizes = _scene(0, teams)
    rng = np.random.default_rng(1)
    motions = np.column_stack([rng.uniform(-1, 1, teams), rng.uniform(-9, 9, teams)])
    wanted = motions.copy()
    prepare(occupied, counts, poses, sizes, motions, others, errors, 1, 0, teams)
    rows, cols = np.mgrid[:ROWS, :COLS] + 0.5
    for i in range(teams):
        cells = others.walls[i, : ROWS * COLS].reshape(ROWS, COLS).copy()
        person = others.people[i, 0]
        discs = [(person["x"], person["y"], 4.0 - THINNER_PX)]
        discs += [(*others.places[i, k], RADIUS - THINNER_PX) for k in (0, 2)]
        for x, y, radius in discs:
            cells[np.hypot(cols - x, rows - y) <= radius] |= MOVING
        assert np.array_equal(occupied[i, : ROWS * COLS].reshape(ROWS, COLS), cells)
        assert (occupied[i, ROWS * COLS :] == 9).all()
        turn, forward = wanted[i].tolist()
        angle, sign = float(poses["heading"][i, 0]) + turn, -1.0 if forward < 0 else 1.0
        course = sign * math.cos(angle), -sign * math.sin(angle)
        offsets = (others.places[i, [0, 2]] - others.places[i, 1]).tolist()
        free = way_past(offsets, 2 * RADIUS, course, abs(forward), APART_PX)
        assert motions[i].tolist() == [turn, math.copysign(free, forward)]
        assert others.meets[i] == (free < abs(forward))
    assert 5 < others.meets.sum() < teams


def test_gather_counts_meetings_and_adds_what_a_robot_saw() -> None:
    teams = 12
    others, _, counts, poses, sizes = _scene(2, teams)
    rng = np.random.default_rng(3)
    known = rng.choice(np.array([0, 127, 255], np.uint8), (teams, ROWS * COLS))
    observable = rng.integers(0, 2, known.shape).astype(np.uint8)
    before = rng.choice(np.array([0, 127], np.uint8), known.shape, p=(0.8, 0.2))
    team_known, together = before.copy(), np.zeros(teams, TOGETHER)
    together["steps"] = np.arange(teams) % 2
    counts["known"][:, 0], counts["blocked"][:, 0] = np.arange(teams) + 5, np.arange(teams) % 3 == 0
    others.meets[:] = np.arange(teams) % 4 == 0
    blocked, met = counts["blocked"][:, 0].copy(), others.meets.copy()
    poses["x"] += 1.0
    gather(
        observable, known, counts, poses, sizes, others, team_known, together, np.full(teams, 2), 6.0, 1, 0, teams
    )  # fmt: skip
    for i in range(teams):
        near = np.zeros((ROWS, COLS), bool)
        x, y = float(poses["seen_x"][i, 0]), float(poses["seen_y"][i, 0])
        part = np.s_[max(int(y - 6), 0) : int(y + 6) + 1, max(int(x - 6), 0) : int(x + 6) + 1]
        near[part if together["steps"][i] else np.s_[:]] = True
        new = near.ravel() & (before[i] == 0) & (known[i] != 0)
        assert np.array_equal(team_known[i], np.where(new, known[i], before[i]))
        row = together[i]
        assert (row["explored"], row["covered"], row["found"]) == (new.sum(), (new & (observable[i] > 0)).sum(), i + 3)
        assert row["meetings"] == met[i]
        assert counts["collisions"][i, 0] == (met[i] and not blocked[i])
        assert counts["blocked"][i, 0] == (met[i] or blocked[i])
    assert np.array_equal(others.places[:, 1], np.column_stack([poses["x"][:, 0], poses["y"][:, 0]]))
    assert not others.meets.any()
