"""Episodes as a Minari data set: Minari's own loader reads what the environment returned; a policy learns from it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, DatasetError, MissingDependencyError, PolicyError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.protocol import Interface
from houseexpo.pseudoslam.benchmark.collection import CollectSettings, collect_episodes
from houseexpo.pseudoslam.benchmark.tracks import find_track
from tests.builders.commands import call
from tests.builders.simulations import HUTS, assert_same, flat
from tests.houseexpo.pseudoslam.benchmark.test_benchmark_cases import data_set

minari: Any = pytest.importorskip("minari")
POINTGOAL = find_track("pointgoal")
NAME = "greedy-v0"


@pytest.fixture(scope="module")
def houses(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return data_set(tmp_path_factory.mktemp("houses") / "plans", {"train": HUTS})


@pytest.fixture(scope="module")
def collected(houses: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a data set of 60 episodes in three huts."""
    folder = tmp_path_factory.mktemp("collected")
    done = collect_episodes(POINTGOAL, "greedy", houses, folder / NAME, CollectSettings(60, "train"))
    assert (done.episodes, done.success) == (60, 1.0)
    return folder


def load(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
    return minari.load_dataset(NAME)


@pytest.mark.slow
def test_the_loader_reads_what_the_environment_returns(
    collected: Path, houses: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = load(collected, monkeypatch)
    env = POINTGOAL.environment(houses, Interface())
    assert found.observation_space == env.observation_space
    assert found.action_space == env.action_space
    said = list(found.storage.get_episode_metadata(range(60)))
    assert {each["options"]["plan_id"] for each in said[:3]} == {"small", "middle", "large"}
    assert len({each["seed"] for each in said}) == 60
    for number in (0, 7, 59):
        episode, metadata = found[number], said[number]
        observation, info = env.reset(seed=metadata["seed"], options=metadata["options"])
        seen, infos = [observation], [info]
        for step, action in enumerate(episode.actions):
            observation, reward, terminated, truncated, info = env.step(action)
            seen.append(observation)
            infos.append(info)
            assert reward == episode.rewards[step]
            assert (terminated, truncated) == (episode.terminations[step], episode.truncations[step])
        assert episode.terminations[-1]
        assert_same(episode.observations, {key: np.stack([each[key] for each in seen]) for key in seen[0]})
        for key, values in episode.infos.items():
            np.testing.assert_array_equal(values, [each[key] for each in infos])
        assert metadata["spl"] == pytest.approx(infos[-1]["spl"], abs=1e-6)


@pytest.mark.slow
def test_processes_make_no_difference(collected: Path, houses: Dataset, tmp_path: Path) -> None:
    for workers, seed in ((2, 0), (1, 1)):
        collect_episodes(
            POINTGOAL, "greedy", houses, tmp_path / str(seed) / NAME, CollectSettings(6, "", seed, workers)
        )
    for number in range(6):
        one, other, third = (
            folder.joinpath(NAME, "data", str(number), "part-0.parquet").read_bytes()
            for folder in (collected, tmp_path / "0", tmp_path / "1")
        )
        assert one == other
        assert one != third


def collect(
    houses: Dataset, folder: Path, policy: str = "greedy", track: str = "pointgoal", name: str = NAME, split: str = ""
) -> None:
    collect_episodes(find_track(track), policy, houses, folder / name, CollectSettings(2, split))


def test_what_cannot_be_collected_is_said_at_once(
    houses: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ConfigError, match=r"--out: expected a folder .* as Minari .*frontier-v0, found 'greedy'"):
        collect(houses, tmp_path, name="greedy")
    with pytest.raises(ConfigError, match=r"--out: expected a folder .* such as frontier-v0, found ''"):
        collect_episodes(POINTGOAL, "greedy", houses, Path(), CollectSettings(2))
    with pytest.raises(ConfigError, match="track kth-v1: expected a track on plans, found one on maps"):
        collect(houses, tmp_path, "frontier", "kth")
    with pytest.raises(ConfigError, match="episodes: expected a whole number of at least 1, found 0"):
        CollectSettings(0)
    assert not list(tmp_path.iterdir())
    (tmp_path / NAME).mkdir()
    with pytest.raises(ConfigError, match=r"--out: .*greedy-v0 is there already"):
        collect(houses, tmp_path)
    monkeypatch.setitem(sys.modules, "minari.dataset.minari_storage", None)
    with pytest.raises(MissingDependencyError, match=r"collect needs Minari: .*\[minari\]"):
        collect(houses, tmp_path)


@pytest.mark.slow
def test_policies_and_lists_are_checked_before_episodes_run(houses: Dataset, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"policy: no 'gredy'; known: .*greedy"):
        collect(houses, tmp_path, "gredy")
    with pytest.raises(ConfigError, match="made for exploration; track pointgoal-v2 is navigation"):
        collect(houses, tmp_path, "frontier")
    with pytest.raises(DatasetError, match="no list 'test'; known: train"):
        collect(houses, tmp_path, split="test")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_policy_that_takes_no_action_leaves_nothing(houses: Dataset, tmp_path: Path) -> None:
    with pytest.raises(PolicyError, match="step 0: expected an action, found none; there is nothing to learn from"):
        collect_episodes(POINTGOAL, f"{__name__}:idle", houses, tmp_path / NAME, CollectSettings(2))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_plans_without_goals_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plans = data_set(tmp_path / "plans", {"train": [*HUTS, *map(flat, "abc")]})
    collect_episodes(find_track("roomgoal"), "shortest", plans, tmp_path / NAME, CollectSettings(3))
    said = load(tmp_path, monkeypatch).storage.get_episode_metadata(range(3))
    assert {each["options"]["plan_id"] for each in said} == set("abc")


@pytest.mark.slow
def test_plans_without_room_for_the_robot_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slit = FloorPlan("slit", np.array([(0.0, 0.0), (0.0, 0.3), (4.0, 0.3), (4.0, 0.0)]), 1, {})
    plans = data_set(tmp_path / "plans", {"train": [slit, *HUTS]})
    done = collect_episodes(POINTGOAL, "greedy", plans, tmp_path / NAME, CollectSettings(4))
    assert (done.episodes, done.left_out) == (4, 1)
    said = load(tmp_path, monkeypatch).storage.get_episode_metadata(range(4))
    assert {each["options"]["plan_id"] for each in said} == {"small", "middle", "large"}
    with pytest.raises(ConfigError, match=r"track pointgoal-v2: .* a robot of 0.2 m fits, found none among 1 plan"):
        collect(data_set(tmp_path / "slits", {"train": [slit]}), tmp_path, name="none-v0")


def idle(*_: Any) -> Any:
    """The factory of a policy that is done at once."""
    return lambda *_: None


@pytest.mark.slow
def test_the_command_says_how_to_load_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path.parent)
    said = call("collect", "--policy", "forward", "--track", "avoidance", "--episodes", "2", "--workers", "1",
                "--out", f"{tmp_path.name}/forward-v1")  # fmt: skip
    assert "forward-v1: 2 episodes, 400 steps, mean reward" in said
    assert f"MINARI_DATASETS_PATH={tmp_path} lets minari.load_dataset('forward-v1') find it" in said
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    found = minari.load_dataset("forward-v1")
    assert list(minari.list_local_datasets()) == ["forward-v1"]
    assert not any(episode.terminations.any() for episode in found)
    assert all(episode.truncations[-1] for episode in found)
    call("collect", "--policy", "forward", "--out", tmp_path / "forward-v2", "--episodes", "0", code=2)
