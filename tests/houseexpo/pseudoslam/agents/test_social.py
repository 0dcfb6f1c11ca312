"""Policies among people, by hand: who waits, who goes round, and what is measured of it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.agents.social import GivingWay, KeepingAway, Measures, Waiting
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner, gap_to_people
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.kernels.collision import placed_people
from tests.builders.simulations import hall

SOCIAL = find_track("social")
METRE = SOCIAL.config.pixels_per_metre
FORWARD, STAY = [1.0, 0.0], [0.0, 0.0]


def knowing(height_m: float, *people: tuple[float, ...], x_m: float = 1.0, path_m: float = 0.0) -> Knowledge:
    """A corridor of 6 m along x; the robot in its middle at x, heading for a goal at 5 m; people (x, y, vx, vy)."""
    known = np.full((round(height_m * METRE), round(6 * METRE)), 127, np.uint8)
    known[[0, -1]] = known[:, [0, -1]] = 255
    middle = height_m * METRE / 2
    moving = [(x * METRE, middle + y * METRE, 0.2 * METRE, vx * METRE, vy * METRE) for x, y, vx, vy in people]
    return {
        "map": known, "pose_px": np.array([x_m * METRE, middle, 0.0]), "collided": False, "steps": 0, "path_m": path_m,
        "goal_px": np.array([5 * METRE, middle]), "moving_px": np.array(moving).reshape(-1, 5),
    }  # fmt: skip


def made(factory: Any) -> Any:
    return factory(Robot(SOCIAL.config), 0)


@pytest.mark.parametrize("factory", [Waiting, KeepingAway, GivingWay])
def test_alone_a_robot_goes_straight_to_its_goal(factory: Any) -> None:
    policy = made(factory)
    assert [policy(None, knowing(1.0)).tolist() for _ in range(3)] == [FORWARD] * 3


def test_a_robot_waits_for_who_is_in_the_way_but_not_for_ever() -> None:
    policy, blocked = made(Waiting), knowing(6.0, (2.0, 0.0, 0.0, 0.0))
    assert [policy(None, blocked).tolist() for _ in range(10)] == [STAY] * 10
    assert abs(policy(None, blocked)[1]) == 1.0  # goes round
    assert policy(None, {**blocked, "path_m": 0.3}).tolist() == STAY  # a step further it waits again
    policy, blocked = made(Waiting), knowing(1.0, (2.0, 0.0, 0.0, 0.0))
    assert [policy(None, blocked).tolist() for _ in range(25)] == [STAY] * 25  # there is no way round
    coming = knowing(1.0, (3.0, 0.0, -1.2, 0.0))
    assert made(Waiting)(None, coming).tolist() == STAY
    assert made(Waiting)(None, knowing(1.0, (3.0, 0.0, 1.2, 0.0))).tolist() == FORWARD
    assert made(Waiting)(None, knowing(1.0, (0.6, 0.0, 0.0, 0.0))).tolist() == FORWARD  # away from one behind


def test_a_robot_keeps_away_where_there_is_room() -> None:
    person = (2.8, 0.1, 0.0, 0.0)
    assert abs(made(KeepingAway)(None, knowing(6.0, person))[1]) == 1.0  # turns, to go round
    assert made(KeepingAway)(None, knowing(1.0, person)).tolist() == STAY  # no room
    assert made(KeepingAway)(None, knowing(6.0, (3.0, 2.9, 0.0, 0.0))).tolist() == FORWARD  # not in the way


def giving(**measures: float) -> GivingWay:
    return GivingWay(Robot(SOCIAL.config), 0, Measures(**measures))


def test_a_robot_gives_way_by_its_measures() -> None:
    """A corridor of 1 m, in which nobody can be passed; a step ends at 1.3 m and half of one at 1.15 m."""
    ahead = knowing(1.0, (2.2, 0.0, 0.0, 0.0))  # the gap is 0.8 m, after a step 0.5 m
    assert giving(stop_m=0.45)(None, ahead).tolist() == FORWARD
    assert giving(stop_m=0.6)(None, ahead).tolist() == [0.5, 0.0]
    assert giving(stop_m=0.7)(None, ahead).tolist() == STAY
    assert giving(stop_m=0.9)(None, ahead).tolist() == STAY
    coming = knowing(1.0, (3.2, 0.0, -1.2, 0.0))
    assert giving(stop_m=0.6, ahead_s=0.1)(None, coming).tolist() == FORWARD
    assert giving(stop_m=0.6, ahead_s=1.0)(None, coming).tolist() == STAY
    assert giving(stop_m=0.9)(None, knowing(1.0, (0.6, 0.0, 0.0, 0.0))).tolist() == FORWARD  # away from one behind
    touching = knowing(1.0, (1.55, 0.0, 0.0, 0.0))
    assert giving(stop_m=0.01)(None, touching).tolist() == STAY  # it would be stopped at 0.1 m


def test_a_robot_that_has_waited_goes_closer_round_or_back() -> None:
    ahead = knowing(1.0, (2.2, 0.0, 0.0, 0.0))
    patient = giving(stop_m=0.9, calm_s=2.0, patience_s=99.0, retreat_s=99.0)
    actions = [patient(None, ahead).tolist() for _ in range(5)]
    assert actions == [STAY, STAY, [0.5, 0.0], [0.5, 0.0], [0.5, 0.0]]  # after 1 s it keeps 0.6 m
    in_hall = knowing(6.0, (1.75, 0.0, 0.0, 0.0))
    goes_round = giving(stop_m=0.45, patience_s=1.0, retreat_s=99.0, calm_s=99.0, extra_m=2.0)
    assert [abs(goes_round(None, in_hall)[1]) > 0.9 for _ in range(3)] == [False, False, True]
    too_long = giving(stop_m=0.45, patience_s=1.0, retreat_s=99.0, calm_s=99.0, extra_m=0.01)
    assert [abs(too_long(None, in_hall)[1]) > 0.9 for _ in range(3)] == [False] * 3
    makes_room = giving(stop_m=0.45, retreat_s=1.0, patience_s=99.0, calm_s=99.0)
    coming = knowing(1.0, (1.6, 0.0, -0.5, 0.0))
    assert [makes_room(None, coming).tolist() for _ in range(4)] == [STAY, STAY, STAY, [-1.0, 0.0]]


def test_a_robot_goes_while_it_turns_by_little() -> None:
    """The goal is 0.35 rad to the left: it takes two steps to turn there."""
    knowledge = knowing(6.0)
    knowledge["goal_px"] = knowledge["goal_px"] - (0.0, 1.46 * METRE)
    assert giving(swing_rad=0.05)(None, knowledge).tolist() == [0.0, 1.0]
    assert giving(swing_rad=0.4)(None, knowledge).tolist() == [pytest.approx(0.8), 1.0]


def test_the_measures_that_come_with_the_project_are_learned() -> None:
    for seed, name in enumerate(("give-way", "give-way-1", "give-way-2")):
        training = load_policy(name).training
        assert training is not None
        assert (training.family, training.seed) == ("give-way", seed)


@pytest.mark.parametrize("factory", [Waiting, GivingWay])
def test_in_an_unknown_house_they_are_refused(factory: Any) -> None:
    with pytest.raises(ConfigError, match=r"expected a task in a known house \(known_map\), found an unknown one"):
        factory(Robot(replace(SOCIAL.config, known_map=False)), 0)


def test_the_gap_is_that_of_the_circles() -> None:
    track = replace(SOCIAL, config=replace(SOCIAL.config, people=PeopleConfig(3)))
    runner = EpisodeRunner(track, load_policy("wait"), [hall(12.0, 8.0)])
    runner.env.reset(seed=1)
    frame, state = runner.env.simulator.world.frame, runner.env.state
    people = placed_people(state.episode.bodies.people)
    places = frame.points_from_pixels(np.stack([people["x"], people["y"]], axis=1))
    robot = frame.points_from_pixels(state.pose_px[:2])
    gaps = [math.dist(place, robot) - 0.4 for place in places.tolist()]
    assert len(gaps) == 3
    assert gap_to_people(runner.env) == pytest.approx(min(gaps), abs=1e-9)


@pytest.mark.slow
def test_who_is_polite_is_less_in_the_way() -> None:
    """In a hall of 12 x 8 m with eight people, those who heed them run into fewer."""
    found: dict[str, dict[str, float]] = {}
    for name in ("shortest", "wait", "keep-away", "give-way"):
        runner = EpisodeRunner(SOCIAL, load_policy(name), [hall(12.0, 8.0)])
        outcomes = [runner.run(Case("hall", seed)).values for seed in range(12)]
        found[name] = {
            key: float(np.mean([each[key] or 0.0 for each in outcomes])) for key in ("success", "person_collisions")
        }
    for name in ("wait", "keep-away", "give-way"):
        assert found[name]["success"] >= 0.8, found
        assert found[name]["person_collisions"] < found["shortest"]["person_collisions"], found
