"""A policy that goes a known way has a known curve; one that fails is named with its plan and step."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import PolicyError
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner, curve_sample_points
from houseexpo.pseudoslam.benchmark.measures import Trace
from houseexpo.pseudoslam.config import StartConfig
from houseexpo.pseudoslam.worlds.world import World
from tests.builders.policies import ALONG, CORRIDOR, TINY, Continuous, always, at_step, forward, named

CASE = Case("corridor", 5)


def run(factory: Any) -> Any:
    return EpisodeRunner(TINY, named(factory), [CORRIDOR]).run(CASE)


def test_a_way_along_a_corridor_has_a_straight_curve() -> None:
    """From x = 1.5 on it sees from 0.5 to 2.5 m of 13 m, nearly, and 0.3 m more with each step."""
    found = run(forward)
    coverage = found.curves["steps"]
    at = curve_sample_points(40)
    growth = np.diff([coverage[int(i)] for i in np.searchsorted(at, [5, 10, 15, 20])])
    assert growth == pytest.approx(5 * 0.3 / 13, abs=0.004)
    assert coverage[0] == pytest.approx(2.0 / 13, abs=0.03)  # half discs at both ends
    assert found.values["coverage_20_steps"] - found.values["coverage_10_steps"] == pytest.approx(3 / 13, abs=0.004)
    assert found.values["area_20_steps"] == pytest.approx(coverage[0] + 9.5 * 0.3 / 13, abs=0.01)


def test_metres_are_those_gone() -> None:
    found = run(forward)
    assert found.values["metres"] == pytest.approx(13 - 1.5 - 0.2, abs=0.01)  # to the wall
    assert found.values["steps"] == 40
    assert found.values["collisions"] == 40 - math.floor(11.3 / 0.3)
    curve = dict(zip(curve_sample_points(8).tolist(), found.curves["metres"], strict=True))
    assert curve[6.0] - curve[3.0] == pytest.approx(3 / 13, abs=0.01)


def test_a_robot_that_turns_sees_nothing_new() -> None:
    found = run(always(1))
    assert found.values["metres"] == 0.0
    assert len(set(found.curves["steps"])) == 1
    assert found.values["steps"] == ALONG.max_steps


def test_a_policy_that_is_done_ends_the_episode() -> None:
    found = run(at_step(7, None))
    assert found.values["steps"] == 7
    assert found.values["metres"] == pytest.approx(2.1)
    assert found.values["coverage_10_steps"] == found.values["coverage"]


def test_an_episode_ends_where_all_is_seen() -> None:
    """From 0.6 m on it sees the corners behind it; those before it at x = 13 - sqrt(0.75), 11.53 m further on."""
    near = replace(TINY, config=replace(ALONG, start=StartConfig(random=False, x_m=0.6, y_m=0.5)))
    found = EpisodeRunner(near, named(forward), [CORRIDOR]).run(CASE)
    assert (found.values["steps"], found.values["coverage"]) == (39, 1.0)


def test_equal_cases_are_equal_and_know_no_other() -> None:
    runner = EpisodeRunner(TINY, named(forward), [CORRIDOR])
    one, _, again = runner.run(CASE), runner.run(Case("corridor", 9)), runner.run(CASE)
    assert one == again


@pytest.mark.parametrize(
    ("factory", "said"),
    [
        (at_step(4, math.nan), r"step 4: action: expected 0 \(forward\), 1 \(left\) or 2 \(right\), found nan$"),
        (at_step(0, 3), r"step 0: action: expected 0 .* or 2 \(right\), found .*3"),
        (always(np.zeros(3)), r"step 0: action: expected a single number, found an array of shape \(3,\)$"),
        (always("forward"), r"step 0: action: expected 0 .* or 2 \(right\), found 'forward'$"),
        (at_step(2, lambda: {}["no"]), r"step 2: it raised KeyError: 'no' \(.*policies.py, line \d+\)$"),
        (at_step(2, lambda: np.stack([])), r"step 2: it raised ValueError: .* \(.*policies.py, line \d+\)$"),
        (at_step(2, sys.exit), r"step 2: it raised SystemExit \(.*policies.py, line \d+\)$"),
        (lambda _robot, _seed: 1 / 0, r"step 0: it raised ZeroDivisionError: division by zero"),
        (lambda _robot, _seed: 0, r"step 0: expected a test to be a factory: .* it returned 0$"),
    ],
)
def test_a_policy_that_fails_is_named_with_plan_and_step(factory: Callable[..., Any], said: str) -> None:
    with pytest.raises(PolicyError, match=rf"^policy 'mine': plan 'corridor', {said}"):
        run(factory)


def test_a_policy_is_shown_what_it_asks_for() -> None:
    found = run(Continuous)
    assert found.values["steps"] == 40
    assert 10 * 0.15 < found.values["metres"] <= 40 * 0.15 + 1e-6  # it goes round, and along the wall


def test_what_a_policy_knows_is_its_own_and_no_truth() -> None:
    seen: list[Knowledge] = []
    robots: list[Robot] = []

    def factory(robot: Robot, _: int) -> Any:
        robots.append(robot)

        def policy(_: Any, info: Knowledge) -> int | None:
            seen.append(info)
            info["map"][:] = 255  # does no harm
            return 0 if info["steps"] < 3 else None

        return policy

    found = run(factory)
    assert found.values["metres"] == pytest.approx(0.9)
    assert robots[0].world is None
    assert all(set(info) == {"map", "pose_px", "collided", "steps", "path_m"} for info in seen)
    assert [info["path_m"] for info in seen] == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert seen[1]["pose_px"][0] - seen[0]["pose_px"][0] == pytest.approx(0.3 * 20)


def test_only_who_asks_for_the_truth_is_given_it() -> None:
    class Seer:
        interface = Interface(sees_truth=True)
        worlds: list[World | None] = []  # noqa: RUF012

        def __init__(self, robot: Robot, _: int) -> None:
            self.worlds.append(robot.world)

        def __call__(self, _: Any, __: Knowledge) -> None:
            return None

    run(Seer)
    assert Seer.worlds[0] is not None
    assert Seer.worlds[0].plan_id == "corridor"


def test_decisions_are_timed_where_there_are_some() -> None:
    class Lazy:
        def __init__(self, _: Robot, __: int) -> None:
            self.decided = False

        def __call__(self, _: Any, info: Knowledge) -> int:
            self.decided = info["steps"] % 4 == 0
            return 0

    assert len(run(Lazy).decisions_ms) == math.ceil(run(forward).values["steps"] / 4)
    assert len(run(forward).decisions_ms) == run(forward).values["steps"]


def test_an_environment_that_something_changed_ends_the_episode() -> None:
    trace = Trace()
    trace.add(3, 1.0, {"coverage": 0.5, "collisions": 0})
    with pytest.raises(ValueError, match="a coverage of 114"):
        trace.add(4, 1.1, {"coverage": 1.14})
    with pytest.raises(ValueError, match="reset the environment"):
        trace.add(0, 0.0, {"coverage": 0.1})
    held: list[EpisodeRunner] = []
    reset = at_step(2, lambda: held[0].env.reset(seed=4) and 0)
    held.append(EpisodeRunner(TINY, named(reset), [CORRIDOR]))
    with pytest.raises(PolicyError, match="reset the environment in the middle"):
        held[0].run(CASE)


class Masked:
    """Goes ahead where the mask of motions allows it, else turns."""

    interface = Interface(action_mask=True)

    def __init__(self, robot: Robot, _seed: int) -> None:
        assert robot.observation_space["action_mask"].n == 3  # type: ignore[index]

    def __call__(self, observation: Any, info: Knowledge) -> int:
        assert not info["collided"]
        return 0 if observation["action_mask"][0] else 1


def test_a_policy_gets_the_mask_of_motions_that_it_asks_for() -> None:
    assert run(Masked).values["coverage"] > 0.9
