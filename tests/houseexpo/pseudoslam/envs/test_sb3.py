"""The adapter for Stable-Baselines3: with the library where it is installed, else with a stand-in for its base."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import gymnasium
import numpy as np
import pytest

from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.tasks import Exploration
from tests.builders.simulations import HUTS, assert_same, native

MODULE = "houseexpo.pseudoslam.sb3"
HAS_SB3 = find_spec("stable_baselines3") is not None
SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=36), max_steps=9)


class StandIn:
    """What the adapter uses of ``VecEnv``."""

    def __init__(self, num_envs: int, observation_space: Any, action_space: Any) -> None:
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self.render_mode = self.get_attr("render_mode")[0]
        self._reset_seeds()
        self._reset_options()

    def _reset_seeds(self) -> None:
        self._seeds: list[int | None] = [None] * self.num_envs

    def _reset_options(self) -> None:
        self._options: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]

    def seed(self, seed: int) -> list[int]:
        self._seeds = [seed + i for i in range(self.num_envs)]
        return self._seeds

    def set_options(self, options: Any) -> None:
        self._options = [options] * self.num_envs if isinstance(options, dict) else options

    def step(self, actions: Any) -> Any:
        self.step_async(actions)
        return self.step_wait()


@pytest.fixture
def adapter(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The adapter's class."""
    if not HAS_SB3:
        for name in ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env"):
            monkeypatch.setitem(sys.modules, name, ModuleType(name))
        sys.modules["stable_baselines3.common.vec_env"].VecEnv = StandIn
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    yield import_module(MODULE).SB3VecEnv
    sys.modules.pop(MODULE, None)


def explorers(number: int = 3, mode: str = "SameStep", **given: Any) -> Any:
    return native("Exploration", number, mode, **{"dataset": HUTS, "config": SMALL, "success_coverage": 0.5, **given})


@pytest.mark.parametrize("observation", ["map", "dict"])
def test_it_says_what_the_vector_environment_does(adapter: Any, observation: str) -> None:
    """Infos a dictionary each; at an end the end's, with its observation, while what is returned begins anew."""
    ours, plain = adapter(explorers(observation=observation)), explorers(observation=observation)
    ours.seed(4)
    first, infos = plain.reset(seed=4)
    assert_same(ours.reset(), first)
    assert [info["plan_id"] for info in ours.reset_infos] == infos["plan_id"].tolist()
    moves = np.random.default_rng(0)
    ends = {True: 0, False: 0}
    for _ in range(30):
        actions = moves.choice(3, size=3, p=[0.2, 0.7, 0.1])
        shown, rewards, terminated, truncated, infos = plain.step(actions)
        found, its_rewards, done, each = ours.step(actions)
        assert_same(found, shown)
        assert_same(its_rewards, rewards.astype(np.float32))
        assert_same(done, terminated | truncated)
        assert isinstance(each, list)
        for i in range(3):
            its = infos["final_info"] if done[i] else infos
            assert each[i]["pose"].tolist() == its["pose"][i].tolist()
            assert type(each[i]["coverage"]) is float
            assert type(each[i]["is_success"]) is bool
            assert not any(key.startswith(("_", "final")) for key in each[i])
            assert ("terminal_observation" in each[i]) == ("TimeLimit.truncated" in each[i]) == done[i]
            if done[i]:
                assert_same(each[i]["terminal_observation"], infos["final_obs"][i])
                assert each[i]["TimeLimit.truncated"] == (truncated[i] and not terminated[i])
                ends[each[i]["TimeLimit.truncated"]] += 1
    assert min(ends.values()) > 0


def test_seeds_and_options_are_used_once(adapter: Any) -> None:
    ours = adapter(explorers())
    starts = []
    for _ in range(2):
        ours.seed(7)
        ours.set_options({"plan_id": "large"})
        starts.append((ours.reset(), [info["pose"].tolist() for info in ours.reset_infos]))
        assert {info["plan_id"] for info in ours.reset_infos} == {"large"}
    assert_same(starts[0][0], starts[1][0])
    assert starts[0][1] == starts[1][1]
    ours.reset()  # without: other starts, any plan
    assert [info["pose"].tolist() for info in ours.reset_infos] != starts[0][1]
    ours.set_options([{"plan_id": "large"}, {"plan_id": "small"}, {"plan_id": "large"}])
    ours.reset()
    assert [info["plan_id"] for info in ours.reset_infos] == ["large", "small", "large"]
    ours.set_options([{"pose": (1.0, 1.5, 0.5)}, {"plan_id": "small"}, {}])
    ours.reset()
    assert ours.reset_infos[0]["pose"].tolist() == pytest.approx([1.0, 1.5, 0.5])
    assert ours.reset_infos[1]["plan_id"] == "small"
    ours.set_options([{"plan": "large"}, {}, {}])
    with pytest.raises(ConfigError, match="options: unknown key 'plan'; known: 'plan_id'"):
        ours.reset()


def test_wrappers_that_it_would_pass_over_are_refused(adapter: Any) -> None:
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(explorers())
    with pytest.raises(ConfigError, match="without wrappers, found <RecordEpisodeStatistics"):
        adapter(wrapped)


def test_attributes_and_methods_are_those_of_all(adapter: Any) -> None:
    ours = adapter(explorers(render_mode="rgb_array"))
    ours.reset()
    assert ours.get_attr("render_mode") == ["rgb_array"] * 3
    assert ours.get_attr("config", indices=[0, 2]) == [SMALL] * 2
    (state,) = ours.env_method("state", indices=1)
    assert np.array_equal(state.known, ours.env.state(1).known)
    pictures = ours.env_method("render", indices=[2, 0])
    assert all(map(np.array_equal, pictures, [ours.get_images()[i] for i in (2, 0)]))
    assert ours.env_is_wrapped(object) == [False] * 3
    assert [image.shape[2] for image in ours.get_images()] == [3] * 3
    with pytest.raises(ConfigError, match="config: this attribute is fixed"):
        ours.set_attr("config", SMALL)
    with pytest.raises(ConfigError, match="task: all environments share this attribute; set it for all of them"):
        ours.set_attr("task", Exploration(), indices=[0])
    ours.set_attr("task", Exploration(0.7))
    assert ours.get_attr("task") == [Exploration(0.7)] * 3
    ours.close()


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_another_autoreset_mode_is_refused(adapter: Any, mode: str) -> None:
    with pytest.raises(ConfigError, match=r'env: expected .* autoreset_mode="SameStep", found'):
        adapter(explorers(mode=mode))


def test_another_environment_is_refused(adapter: Any) -> None:
    other = gymnasium.make_vec("CartPole-v1", num_envs=2, vectorization_mode="sync")
    with pytest.raises(ConfigError, match="env: expected a PseudoSLAM vector environment"):
        adapter(other)


def test_without_the_library_the_message_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.vec_env", None)
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    with pytest.raises(MissingDependencyError, match=r"needs Stable-Baselines3.*: pip install stable-baselines3"):
        import_module(MODULE)
