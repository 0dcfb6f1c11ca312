"""People by ORCA: half-planes and linear programs against slow ones, and two whose ways cross."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.kernels.body_tracks import BodyTracks, no_tracks
from houseexpo.pseudoslam.kernels.collision import PERSON
from houseexpo.pseudoslam.kernels.orca import add_disc, choose_velocity, solve_half_planes
from houseexpo.pseudoslam.worlds.moving_obstacles import make_walk_params
from tests.builders.simulations import NOBODY, room
from tests.builders.tries import tries

PPM = 10.0
WALK = make_walk_params(PeopleConfig(model="orca"), PPM)


def meets(rel: np.ndarray, off: np.ndarray, touch: float, horizon_s: float) -> np.ndarray:
    """Whether discs that are ``off`` apart would touch within the horizon, for each relative velocity (n, 2)."""
    at = np.clip(rel @ off / np.maximum((rel**2).sum(axis=1), 1e-12), 0.0, horizon_s)
    return np.hypot(*(off - rel * at[:, None]).T) < touch


@tries(60)
@given(st.integers(0, 10**6))
def test_the_way_out_is_the_shortest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    touch, horizon_s = rng.uniform(0.3, 0.6), rng.uniform(0.5, 3.0)
    off = rng.uniform(touch + 0.05, 3.0) * np.array([math.cos(a := rng.uniform(0, 2 * math.pi)), math.sin(a)])
    mine, others = rng.normal(0, 1.0, 2), rng.normal(0, 1.0, 2)
    planes = np.zeros((1, 3))
    assert add_disc(planes, 0, *off, *mine, *others, touch, 0.5, horizon_s, 0.1, 1e9) == 1
    normal, changed = planes[0, :2], 2.0 * (planes[0, 2] - planes[0, :2] @ mine)
    assert np.hypot(*normal) == pytest.approx(1.0)
    collides = bool(meets((mine - others)[None], off, touch, horizon_s)[0])
    assert collides == (changed > 0)
    angles = np.linspace(0, 2 * math.pi, 720, endpoint=False)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    less, more = ((mine - others) + abs(changed) * share * around for share in (0.99, 1.01))
    assert (meets(less, off, touch, horizon_s) == collides).all()
    assert (meets(more, off, touch, horizon_s) != collides).any()


def candidates(planes: np.ndarray, most: float, wish: np.ndarray) -> np.ndarray:
    """The velocities among which the closest allowed one is: the wish, feet on lines, corners, ends of lines."""
    found = [wish * min(1.0, most / max(math.hypot(*wish), 1e-12))]
    for n_x, n_y, b in planes:
        foot, along = np.array([n_x, n_y]) * b, np.array([-n_y, n_x])
        found.append(foot + along * (along @ wish))
        if abs(b) <= most:
            found += [foot + along * sign * math.sqrt(most**2 - b**2) for sign in (-1, 1)]
    for one, other in itertools.combinations(planes, 2):
        if abs(np.linalg.det([one[:2], other[:2]])) > 1e-9:
            found.append(np.linalg.solve([one[:2], other[:2]], [one[2], other[2]]))
    return np.array(found)


@tries(150)
@given(st.integers(0, 10**6), st.integers(0, 9), st.sampled_from([0.3, 0.9]))
def test_programs_have_the_best_answer(seed: int, number: int, tight: float) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0, 2 * math.pi, number)
    planes = np.stack([np.cos(angles), np.sin(angles), rng.uniform(-1.0, tight, number)], axis=1)
    most, wish = 1.0, rng.normal(0, 1.0, 2)
    found = np.array(solve_half_planes(planes, most, *wish))
    assert np.hypot(*found) <= most + 1e-9

    def violation(tried: np.ndarray) -> np.ndarray:
        return (planes[:, 2] - tried @ planes[:, :2].T).max(axis=1, initial=0.0)

    tried = candidates(planes, most, wish)
    allowed = tried[(np.hypot(*tried.T) <= most + 1e-9) & (violation(tried) <= 1e-9)]
    if len(allowed):
        assert violation(found[None])[0] <= 1e-7
        assert np.hypot(*(found - wish)) == pytest.approx(np.hypot(*(allowed - wish).T).min(), abs=1e-7)
    else:
        radii, turns = np.meshgrid(np.linspace(0, most, 80), np.linspace(0, 2 * math.pi, 240))
        grid = np.stack([(radii * np.cos(turns)).ravel(), (radii * np.sin(turns)).ravel()], axis=1)
        assert violation(found[None])[0] <= violation(grid).min() + 1e-7


@tries(60)
@given(st.floats(0.0, 2 * math.pi), st.floats(-0.5, 0.5), st.floats(0.6, 1.4))
def test_two_on_crossing_ways_pass_without_touching(angle: float, beside: float, faster: float) -> None:
    """Both walk by their chosen velocities alone, at once, to places beyond each other."""
    assume(abs(math.remainder(angle, 2 * math.pi)) > 0.3)  # not side by side at the start
    ahead = np.array([[1.0, 0.0], [math.cos(angle), math.sin(angle)]])
    people = np.zeros(2, PERSON)
    places = np.array([[150.0, 150.0 + beside * PPM], [150.0, 150.0]]) - 50.0 * ahead
    goals, speeds = places + 100.0 * ahead, np.array([1.2, 1.2 * faster]) * PPM
    people["speed"] = speeds
    bodies, tracks, occupied = BodyTracks(np.zeros(0), people, np.zeros((0, 2))), no_tracks(), room(300, 300)
    for _ in range(250):
        people["x"], people["y"] = places.T
        wishes = (goals - places) / np.maximum(np.hypot(*(goals - places).T), 1e-9)[:, None]
        velocities = np.array(
            [
                choose_velocity(
                    occupied, bodies, tracks, WALK.feelers, WALK.horizon_s, WALK.radius_px, NOBODY, p, *wishes[p], 0.1
                )
                for p in range(2)
            ]
        )
        people["vx"], people["vy"] = velocities.T
        places = places + 0.1 * velocities
        assert np.hypot(*(places[0] - places[1])) >= 2 * WALK.radius_px - 1e-6
    assert np.hypot(*(goals - places).T).max() < PPM  # nobody stands for ever
