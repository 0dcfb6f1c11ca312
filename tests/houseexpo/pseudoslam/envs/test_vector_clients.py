"""What programs that train ask of a vector environment: a plan for each, gymnasium's wrappers, attributes."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import RecordEpisodeStatistics, RecordVideo

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.tasks import Exploration, ObstacleAvoidance
from tests.builders.simulations import HUTS, assert_same, native, singles

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=4)


def explorers(number: int = 3, **given: Any) -> Any:
    return native("Exploration", number, **{"dataset": HUTS, "config": SMALL, "success_coverage": None, **given})


def test_each_environment_gets_the_plan_that_is_named_for_it() -> None:
    env = explorers()
    _, infos = env.reset(seed=0, options={"plan_id": ["large", "small", "middle"]})
    assert infos["plan_id"].tolist() == ["large", "small", "middle"]
    mask = np.array([False, True, True])
    _, infos = env.reset(options={"plan_id": [None, "middle", None], "reset_mask": mask})
    assert infos["plan_id"].tolist()[:2] == ["large", "middle"]


def test_a_random_plan_is_the_one_that_it_would_have_been_alone() -> None:
    named, plain = explorers(), explorers()
    named.reset(seed=5, options={"plan_id": [None, None, "small"]})
    plain.reset(seed=5)
    for i in range(2):
        assert np.array_equal(named.state(i).known, plain.state(i).known)


def test_episodes_are_counted_by_a_wrapper() -> None:
    env, plain = RecordEpisodeStatistics(explorers()), explorers()
    env.reset(seed=1)
    plain.reset(seed=1)
    total = np.zeros(3)
    for _ in range(4):
        *_, infos = env.step(np.zeros(3, np.int64))
        total += plain.step(np.zeros(3, np.int64))[1]
    assert infos["episode"]["l"].tolist() == [4, 4, 4]
    np.testing.assert_allclose(infos["episode"]["r"], total, rtol=1e-6)


def test_attributes_are_those_of_all() -> None:
    env = explorers()
    env.reset(seed=0, options={"plan_id": "small"})
    assert env.get_attr("config") == (SMALL,) * 3
    assert env.call("render_mode") == (None,) * 3
    states = env.call("state")
    assert [np.array_equal(one.known, env.state(i).known) for i, one in enumerate(states)] == [True] * 3
    assert env.call("render") == (None,) * 3
    with pytest.raises(ConfigError, match="config: this attribute is fixed when the environments are made"):
        env.set_attr("config", [SMALL] * 3)
    with pytest.raises(ConfigError, match=r"reset: this method is for all environments together; call reset\(\)"):
        env.call("reset", seed=1)
    drawn = explorers(render_mode="rgb_array")
    drawn.reset(seed=0)
    assert all(map(np.array_equal, drawn.call("render"), drawn.render()))


def test_what_counts_and_which_plans_come_can_be_set() -> None:
    env, plain = explorers(), explorers(reward="coverage")
    env.set_attr("task", Exploration(None, reward="coverage"))
    for one in (env, plain):
        one.reset(seed=3)
    actions = np.zeros(3, np.int64)
    assert env.step(actions)[1].tolist() == plain.step(actions)[1].tolist()
    env.set_attr("plan_ids", ["middle"])
    assert env.get_attr("plan_ids") == (["middle"],) * 3
    assert env.reset()[1]["plan_id"].tolist() == ["middle"] * 3
    env.set_attr("stage", [2, 2, 2])  # names of the caller's own
    env.set_attr("weights", [np.ones(2), np.ones(2), np.ones(2)])
    with pytest.raises(ConfigError, match="weights: expected one value, or 3 equal ones"):
        env.set_attr("weights", [np.ones(2), np.zeros(2), np.ones(2)])
    env.set_attr("stage", 3)
    assert env.get_attr("stage") == (3, 3, 3)


@pytest.mark.parametrize(
    ("name", "values", "text"),
    [
        ("task", ObstacleAvoidance(), "task: expected a task of the same kind, Exploration, found ObstacleAvoidance"),
        ("task", Exploration(cost_per_turn=1.0), "task: expected the same rewards_add_up as that of"),
        ("stage", [1, 2, 3], "stage: expected one value, or 3 equal ones, since all environments share it"),
        ("stage", [1, 1], "stage: expected one value, or 3 equal ones"),
        ("plan_ids", ["tiny"], "plan_ids: none of the 3 plans has the id 'tiny'"),
        ("plan_ids", "small", "plan_ids: expected a list of plans' ids or None"),
        ("num_envs", 4, "num_envs: this attribute is fixed"),
    ],
)
def test_what_cannot_be_set_is_refused(name: str, values: Any, text: str) -> None:
    env = explorers()
    with pytest.raises(ConfigError, match=text):
        env.set_attr(name, values)


def test_a_task_that_looks_farther_round_the_robot_needs_new_environments() -> None:
    env = native("ObstacleAvoidance", 2)
    with pytest.raises(ConfigError, match=r"the clearance that the current task measures, 0.5 m, found 0.7 m"):
        env.set_attr("task", ObstacleAvoidance(safe_m=0.7))


@pytest.mark.parametrize("steps", [3, 6])
def test_the_length_of_episodes_can_be_said_as_gymnasium_does(steps: int) -> None:
    env = explorers(max_episode_steps=steps)
    env.reset(seed=0)
    for step in range(1, steps + 1):
        *_, truncated, _ = env.step(np.zeros(3, np.int64))
        assert truncated.tolist() == [step == steps] * 3


def length(env: gymnasium.Env) -> int:
    env.reset(seed=0)
    return next(step for step in range(1, 99) if env.step(1)[3])


@pytest.mark.parametrize("steps", [3, 6])
def test_a_single_environment_lasts_as_long_as_gymnasium_is_told(steps: int) -> None:
    given = {"dataset": HUTS, "config": SMALL, "success_coverage": None, "max_episode_steps": steps}
    env = gymnasium.make("PseudoSLAM/Exploration-v0", **given)
    assert length(env) == steps
    assert length(gymnasium.make(env.spec)) == steps
    envs = gymnasium.make_vec("PseudoSLAM/Exploration-v0", 2, "sync", **given)
    envs.reset(seed=0)
    assert [envs.step([1, 1])[3].all() for _ in range(steps)] == [False] * (steps - 1) + [True]


def test_a_registration_may_say_how_long_an_episode_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gymnasium.envs.registration, "registry", dict(gymnasium.registry))
    gymnasium.register("Mine-v0", "houseexpo.pseudoslam.envs.single:ExplorationEnv", max_episode_steps=7)
    given = {"dataset": HUTS, "config": SMALL, "success_coverage": None}
    assert length(gymnasium.make("Mine-v0", **given)) == 7
    assert length(gymnasium.make("Mine-v0", **given, max_episode_steps=6)) == 6
    assert length(gymnasium.make("Mine-v0", **given, max_episode_steps=-1)) == SMALL.max_steps


def test_an_environment_inside_another_one_keeps_its_own_length(monkeypatch: pytest.MonkeyPatch) -> None:
    class Outer(gymnasium.Env):
        def __init__(self) -> None:
            self.inner = ExplorationEnv(HUTS, SMALL, success_coverage=None)

    monkeypatch.setattr(gymnasium.envs.registration, "registry", dict(gymnasium.registry))
    gymnasium.register("Outer-v0", Outer, disable_env_checker=True)
    env = gymnasium.make("Outer-v0", max_episode_steps=9).unwrapped
    assert isinstance(env, Outer)
    assert length(env.inner) == SMALL.max_steps


@pytest.mark.parametrize("steps", [0, 1.5, "3"])
def test_a_length_that_is_none_is_refused(steps: Any) -> None:
    with pytest.raises(ConfigError, match="max_episode_steps: expected a whole number of at least 1"):
        explorers(max_episode_steps=steps)


class Clip:
    """What gymnasium's wrapper uses of MoviePy, which asks for an older Pillow than this project does."""

    written: ClassVar[list[tuple[str, int]]] = []

    def __init__(self, frames: list[Any], **_: Any) -> None:
        self.frames = frames

    def write_videofile(self, path: str, **_: Any) -> None:
        assert {(frame.shape, frame.dtype) for frame in self.frames} == {((360, 2 * 480, 3), np.dtype(np.uint8))}
        self.written.append((Path(path).name, len(self.frames)))


def test_videos_are_recorded_by_a_wrapper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("moviepy", "moviepy.video", "moviepy.video.io", "moviepy.video.io.ImageSequenceClip")
    for name in names:
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
        sys.modules[name].ImageSequenceClip = Clip
    monkeypatch.setattr(Clip, "written", [])
    envs = explorers(2, render_mode="rgb_array")
    env = RecordVideo(envs, str(tmp_path / "films"), (2, 1), episode_trigger=lambda episode: episode == 0)
    env.reset(seed=0, options={"plan_id": ["small", "large"]})  # houses of two sizes, pictures of one
    for _ in range(6):
        env.step(np.zeros(2, np.int64))
    env.close()
    assert Clip.written == [("rl-video-episode-0.mp4", 5)]  # the start, and after each of four steps


def test_single_and_vector_environments_start_where_they_are_told_alike() -> None:
    poses = [(1.0, 1.5, 0.25), None, (4.0, 3.0, -3.0)]
    env = explorers()
    one, its = env.reset(seed=7, options={"plan_id": ["small", None, "large"], "pose": poses})
    assert its["pose"][0] == pytest.approx(poses[0])
    assert its["pose"][2] == pytest.approx(poses[2])
    alone = singles("Exploration", 3, dataset=HUTS, config=SMALL, success_coverage=None)
    other, infos = np.zeros_like(one), []
    for i, (plan_id, pose) in enumerate(zip(("small", None, "large"), poses, strict=True)):
        other[i], info = alone.unwrapped.envs[i].reset(seed=7 + i, options={"plan_id": plan_id, "pose": pose})
        infos.append(info["pose"].tolist())
    assert_same(one, other)
    assert its["pose"].tolist() == infos


def test_one_pose_is_for_all_and_its_heading_is_within_half_a_turn() -> None:
    env = explorers()
    _, infos = env.reset(seed=1, options={"pose": np.array([1.0, 1.0, 7.0])})
    assert infos["pose"] == pytest.approx(np.tile([1.0, 1.0, 7.0 - 2 * np.pi], (3, 1)))


@pytest.mark.parametrize(
    ("pose", "text"),
    [
        ((1.0, 1.0), r"options\['pose'\]: expected \(x, y, heading\) in metres and radians, a list of 3 of them"),
        ([(1.0, 1.0, 0.0)] * 2, "a list of 3 of them or None"),
        ([(1.0, 1.0, np.nan), None, None], "nan"),
        (["abc", None, None], "abc"),
        ((0.05, 1.0, 0.0), r"options\['pose'\]: a robot of radius 0.2 m does not fit at \(0.05, 1\) m in plan"),
    ],
)
def test_a_pose_that_cannot_be_is_refused(pose: Any, text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        explorers().reset(seed=0, options={"pose": pose})


def test_a_pose_of_one_that_cannot_be_is_refused() -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HUTS, config=replace(SMALL, max_steps=9))
    with pytest.raises(ConfigError, match=r"options\['pose'\]: expected \(x, y, heading\) in metres and radians or"):
        env.reset(options={"pose": (1.0, np.inf, 0.0)})
