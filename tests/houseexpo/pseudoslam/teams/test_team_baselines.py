"""The baseline of each task does the task in a small house."""

from __future__ import annotations

from typing import Any

import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import parallel_env
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.teams.baselines import BASELINES, make_baseline
from houseexpo.pseudoslam.teams.tasks import TASKS

pytest.importorskip("pettingzoo")

TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (8, 4), (8, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)
STARTS = {"pose": [(1.0, 1.0, 0.0), (7.0, 1.0, 0.0)]}


def _run(task: str, **options: Any) -> dict[str, Any]:
    """Return the measures of the baseline's episode in two rooms, which two robots start."""
    env = parallel_env(task, robots=2, dataset=TWO_ROOMS, **options)
    _, infos = env.reset(seed=0, options=STARTS)
    policy = make_baseline(env)
    while env.agents:
        _, _, _, _, infos = env.step(policy(env))
    return infos["robot_0"]["team"]


def test_there_is_one_for_each_task() -> None:
    assert BASELINES.keys() == TASKS.keys()
    env = parallel_env("rendezvous", dataset=TWO_ROOMS, actions="continuous")
    with pytest.raises(ConfigError, match="actions: expected discrete ones"):
        make_baseline(env)


@pytest.mark.slow
def test_robots_meet_though_they_start_in_two_rooms() -> None:
    team = _run("rendezvous")
    assert 5 < team["steps_to_meet"] < 200
    assert team["spread_m"] <= 1.5


@pytest.mark.slow
def test_a_patrol_visits_all_places_and_beats_robots_that_stand() -> None:
    team = _run("patrol", config=SimulatorConfig(known_map=True, max_steps=400))
    assert team["visited"] == 1.0
    assert team["mean_idleness"] < 80  # 28 places for two robots, some 5 steps apart; robots that stand leave 186
    assert team["worst_idleness"] < 300


@pytest.mark.slow
def test_rooms_are_covered() -> None:
    team = _run("coverage", success_coverage=0.9, tool_m=0.4)
    assert team["steps_to_cover"] is not None
    assert team["covered"] >= 0.9
    assert 0.0 < team["overlap"] < 0.9


@pytest.mark.slow
def test_a_person_is_caught() -> None:
    team = _run("pursuit")
    assert team["steps_to_detect"] <= team["steps_to_capture"]
    assert team["caught"] == 1.0
