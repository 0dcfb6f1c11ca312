"""Many teams at once: the bits of single teams, step by step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import PeopleConfig, SimulatorConfig, Trajectory, parallel_env, parallel_vector_env
from houseexpo.pseudoslam.config import NoiseConfig
from houseexpo.pseudoslam.config.obstacles import Circle
from houseexpo.pseudoslam.teams import team

pytest.importorskip("pettingzoo")

HALL = FloorPlan(
    "hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {}, holes=([(5.0, 1.0), (6.0, 1.0), (6.0, 2.0), (5.0, 2.0)],)
)
TWO_ROOMS = FloorPlan(  # a wall of 0.4 m between two rooms, with a door at the top
    "two rooms", [(0, 0), (0, 4), (9, 4), (9, 0), (4.4, 0), (4.4, 3), (4, 3), (4, 0)], 1, {}
)
PLANS = [HALL, TWO_ROOMS]
SHORT = SimulatorConfig(max_steps=12)
NOISY = replace(SHORT, noise=NoiseConfig(odometry_way=0.05, odometry_deg_per_m=2.0, laser_m=0.02, slip=0.1))
BODY = Trajectory(Circle(0.3), (0.0, 1.0), ((1.0, 3.0, 0.0), (3.0, 3.0, 0.0)), loop=True)
CASES: dict[str, dict[str, Any]] = {
    "exploration": {"config": SHORT, "robots": 3},
    "early ends": {"config": SHORT, "robots": 2, "success_coverage": 0.55, "observation": "dict", "radio": "sight"},
    "one robot": {"config": SHORT, "robots": 1, "reward": "coverage"},
    "one robot and a body": {"config": replace(SHORT, trajectories=(BODY,)), "robots": 1},
    "noise": {"config": NOISY, "robots": 3, "radio": "always", "until": "robot"},
    "people": {"config": replace(SHORT, people=PeopleConfig(2)), "robots": 3, "until": "report"},
    "drives": {"config": SHORT, "robots": 3, "motion": "differential", "radio": "range"},
    "scales": {"config": SHORT, "robots": 2, "observation": "scales", "layout": "HWC"},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_many_teams_have_the_bits_of_single_ones(name: str) -> None:
    teams, robots = 3, CASES[name]["robots"]
    envs = parallel_vector_env(num_envs=teams, dataset=PLANS, threads=2, **CASES[name])
    singles = [parallel_env(dataset=PLANS, **CASES[name]) for _ in range(teams)]
    observed, infos = envs.reset(seed=5)
    assert envs.observation_space.contains(observed)
    each = [env.reset(seed=5 + i) for i, env in enumerate(singles)]
    _check(observed, infos, [one[0] for one in each], [one[1] for one in each])
    rng, ended, ends = np.random.default_rng(3), np.zeros(teams, bool), 0
    for _ in range(30):
        shape = (teams, robots) if envs.single_action_space.shape == (robots,) else (teams, robots, 2)
        actions = rng.choice([0, 0, 1, 2], shape) if len(shape) == 2 else rng.uniform(-1, 1, shape)
        observed, rewards, terminated, truncated, infos = envs.step(actions)
        for i, env in enumerate(singles):
            if ended[i]:  # the vector starts the next episode
                each[i] = env.reset()
                assert not rewards[i].any()
                ended[i] = False
            else:
                one, gained, ends_now, cut, own = env.step(dict(zip(env.possible_agents, actions[i], strict=True)))
                each[i] = one, own
                assert list(gained.values()) == rewards[i].tolist()
                assert all(ends_now.values()) == terminated[i]
                assert all(cut.values()) == truncated[i]
                ended[i] = terminated[i] or truncated[i]
                ends += int(ended[i])
        _check(observed, infos, [one[0] for one in each], [one[1] for one in each])
    assert ends >= 3
    envs.close()


def _check(observed: Any, infos: dict[str, Any], singles: list[Any], own: list[Any]) -> None:
    """Compare the observations and infos of the vector with those of single environments."""
    for i, (agents, info) in enumerate(zip(singles, own, strict=True)):
        for k, agent in enumerate(agents):
            if isinstance(agents[agent], dict):
                assert observed.keys() == agents[agent].keys()
                for key, part in agents[agent].items():
                    np.testing.assert_array_equal(observed[key][i, k], part)
            else:
                np.testing.assert_array_equal(observed[i, k], agents[agent])
            for key, value in info[agent].items():
                if key not in {"team", "plan_id"}:
                    np.testing.assert_array_equal(infos[key][i, k], value)
        assert infos["plan_id"][i] == info["robot_0"]["plan_id"]
        assert infos["team"].keys() == info["robot_0"]["team"].keys()
        for key, value in info["robot_0"]["team"].items():
            np.testing.assert_array_equal(infos["team"][key][i], np.nan if value is None else value)


def test_reset_takes_plans_poses_and_a_mask() -> None:
    envs = parallel_vector_env(num_envs=2, robots=2, dataset=PLANS, config=SHORT, threads=1)
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros((2, 2), int))
    starts = [[(1.0, 1.0, 0.0), (3.0, 3.0, 0.0)], None]
    _, infos = envs.reset(seed=0, options={"plan_id": ["hall", "two rooms"], "pose": starts})
    assert infos["plan_id"].tolist() == ["hall", "two rooms"]
    np.testing.assert_allclose(infos["pose"][0, :, :2], [(1.0, 1.0), (3.0, 3.0)])
    envs.step(np.zeros((2, 2), int))
    _, infos = envs.reset(options={"reset_mask": np.array([False, True]), "plan_id": "hall"})
    assert infos["plan_id"].tolist() == ["hall", "hall"]
    assert infos["team"]["makespan"].tolist() == [1, 0]
    assert infos["_pose"].tolist() == [False, True]
    with pytest.raises(ConfigError, match="actions: expected an array of shape"):
        envs.step(np.zeros(4, int))
    with pytest.raises(ConfigError, match="options: unknown key 'poses'"):
        envs.reset(options={"poses": []})
    envs.close()


@pytest.mark.parametrize("vector", [False, True])
def test_later_episodes_look_up_no_compiled_functions(vector: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    options: dict[str, Any] = {"robots": 2, "dataset": PLANS, "config": SHORT, "radio": "sight"}
    env: Any = parallel_vector_env(threads=1, **options) if vector else parallel_env(**options)
    env.reset(seed=0)
    monkeypatch.delattr(team, "compiled_function")  # it takes longer than a start
    env.reset(seed=1)


def test_without_texts_infos_hold_numbers_only() -> None:
    for text_info in (True, False):
        envs = parallel_vector_env(
            num_envs=2, robots=2, dataset=PLANS, config=SHORT, threads=1, radio="sight", text_info=text_info
        )
        _, infos = envs.reset(seed=0)
        *_, later = envs.step(np.zeros((2, 2), int))
        for found in (infos, later):
            parts = {**found, **found["team"]}
            texts = {
                key for key, part in parts.items() if isinstance(part, np.ndarray) and part.dtype.kind not in "bif"
            }
            assert texts == ({"plan_id"} if text_info else set())
            assert ("_plan_id" in found) == text_info
        envs.close()
