"""What a run's file may say, and where it learns and is tested; nothing of this needs PyTorch."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from houseexpo.configuration import config_from_mapping, read_config
from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError, MissingDependencyError, TrainingError
from houseexpo.pseudoslam import learning as needs
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig
from houseexpo.pseudoslam.learning.config import EnvironmentConfig, TrainConfig
from houseexpo.pseudoslam.learning.environments import (
    check_task_options,
    choose_plans,
    make_environments,
    make_simulator_config,
)
from houseexpo.pseudoslam.learning.records import CurveFile, begin_run
from houseexpo.pseudoslam.tasks import ROOM, ObstacleAvoidance
from tests.builders.training import TEST, TRAIN, tiny, write_split_huts, write_tiny

ROOT = Path(__file__).parents[4]


def read(tmp_path: Path, text: str) -> TrainConfig:
    file = tmp_path / "run.toml"
    file.write_text(text)
    return read_config(TrainConfig, file)


def test_what_a_file_leaves_out_keeps_its_default(tmp_path: Path) -> None:
    found = read(tmp_path, 'steps = 5000\n[environment]\ntask = { reward = "coverage" }\n')
    assert found == TrainConfig(steps=5000, environment=EnvironmentConfig(task={"reward": "coverage"}))
    assert read_config(TrainConfig, write_tiny(tmp_path)) == tiny()


def test_a_record_gives_the_configuration_again() -> None:
    assert config_from_mapping(TrainConfig, tiny().record()) == tiny()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stepps = 1", "unknown key 'stepps'; did you mean 'steps'?"),
        ("[ppo]\nlr = 1", "unknown key 'ppo.lr'; known: ppo.learning_rate"),
        ("steps = 0", "steps: expected a whole number of at least 1, found 0"),
        ("seed = -1", "seed: expected a whole number of at least 0, found -1"),
        ('policy = "mlp"', "policy: expected one of cnn, cnn-lstm, set; found 'mlp'"),
        ("[ppo]\nlearning_rate = nan", "ppo.learning_rate: expected a finite number, found nan"),
        ("[ppo]\nlearning_rate = 3.0", "ppo.learning_rate: expected at most 1, found 3.0"),
        ("[ppo]\ngamma = 1.5", "ppo.gamma: expected at most 1, found 1.5"),
        ('[environment]\nactions = "fly"', "environment.actions: expected one of discrete, continuous, frontier"),
        (
            'policy = "set"',
            'policy: expected "set" with environment.actions = "frontier", and only there; found \'set\'',
        ),
        ('[environment]\nactions = "frontier"', "and only there; found 'cnn-lstm' with 'frontier'"),
        ('[ppo]\ndiscount = "seconds"', "ppo.discount: expected one of actions, steps, metres; found 'seconds'"),
        ('policy = "cnn"\n[ppo]\ndiscount = "steps"', 'ppo.discount: expected "actions", since steps are counted for'),
        ('[ppo]\nprecision = "half"', "ppo.precision: expected one of float32, bfloat16; found 'half'"),
        (
            'policy = "set"\n[ppo]\nprecision = "bfloat16"\n[environment]\nactions = "frontier"',
            'ppo.precision: expected "float32" with policy = "set"',
        ),
        ('[environment]\nmotion = "fly"', "environment.motion: expected one of discrete, differential, ackermann"),
        ('[environment]\nmotion = "ackermann"', "environment.actions: expected continuous for the motion"),
        ("[environment]\ntask = 3", "environment.task: expected a table, found 3"),
        ("[environment]\ndataset = 3", "environment.dataset: expected a name, found 3"),
        ("steps = ", "expected TOML, found"),
    ],
)
def test_what_cannot_be_is_named_with_its_file(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=f"run.toml: .*{re.escape(said)}"):
        read(tmp_path, text)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none.toml: cannot be read"):
        read_config(TrainConfig, tmp_path / "none.toml")


@pytest.mark.parametrize(("name", "view_m", "reward"), [("avoidance", 3.0, "paper"), ("exploration", 4.0, "area")])
def test_the_papers_experiments_can_be_read(name: str, view_m: float, reward: str) -> None:
    found = read_config(TrainConfig, ROOT / "experiments" / f"{name}.toml")
    check_task_options(name, found.environment)
    assert (found.policy, found.memory) == ("cnn-lstm", 128)
    assert dict(found.environment.task) == {"reward": reward}  # and so no coverage at which an episode ends
    config = make_simulator_config(name, found.environment)
    assert (config.laser.range_m, config.observation.size_m, config.max_steps) == (5.0, view_m, 200)
    if name == "avoidance":
        assert config.obstacles == ObstacleAvoidance.default.obstacles
    else:
        assert config.obstacles == ObstaclesConfig()


def test_the_experiment_without_a_memory_is_else_the_same() -> None:
    found, without = (
        read_config(TrainConfig, ROOT / "experiments" / f"exploration-view-10m{ending}.toml") for ending in ("", "-cnn")
    )
    assert without == replace(found, policy="cnn")


def test_a_simulator_is_the_tasks_with_changes() -> None:
    changed = EnvironmentConfig(simulator={"robot": {"radius_m": 0.1}, "max_steps": 7})
    plain = ObstacleAvoidance.default
    assert make_simulator_config("avoidance", changed) == replace(
        plain, robot=replace(plain.robot, radius_m=0.1), max_steps=7
    )
    assert make_simulator_config("exploration", EnvironmentConfig(preset="view-10m")).observation.size_m == 10.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"task": {"safe_m": 1.0}}, "unknown key 'environment.task.safe_m'; known: environment.task.success_coverage"),
        ({"task": {"reward": "way"}}, "reward: expected one of area, coverage"),
        ({"simulator": {"max_step": 3}}, "unknown key 'environment.simulator.max_step'"),
        ({"preset": "owl"}, "config: expected a SimulatorConfig or one of paper"),
    ],
)
def test_options_of_another_task_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(said)):
        check_task_options("exploration", EnvironmentConfig(**given))


def test_plans_are_learned_in_or_tested_in(tmp_path: Path) -> None:
    plans = open_dataset(write_split_huts(tmp_path))
    found = choose_plans(plans, EnvironmentConfig(), 9)
    assert found.train == TRAIN
    assert sorted(found.test or ()) == list(TEST)
    assert choose_plans(plans, EnvironmentConfig(), 1).test == (found.test or ())[:1]
    envs = make_environments("exploration", tiny().environment, found.source, number=2, plan_ids=found.train)
    assert envs.plan_ids == list(TRAIN)
    assert choose_plans(None, EnvironmentConfig(), 9).source is ROOM


def test_a_plan_on_both_sides_is_refused(tmp_path: Path) -> None:
    plans = open_dataset(write_split_huts(tmp_path, test=("hut_d", "hut_a")))
    with pytest.raises(ConfigError, match="'train' and 'test' share 1 of their plans, such as 'hut_a'"):
        choose_plans(plans, EnvironmentConfig(), 9)


def test_a_curve_that_goes_on_drops_what_came_later(tmp_path: Path) -> None:
    file = tmp_path / "curve.csv"
    first = CurveFile(file, 0)
    for steps in (10, 20, 30):
        first.add(steps, {"return": steps / 4, "steps": float("nan")})
    file.write_bytes(file.read_bytes() + b"40,1")  # it was killed while it wrote
    CurveFile(file, 20).add(25, {"return": 1.0, "steps": 2.0})
    assert file.read_text() == "steps_done,return,steps\n10,2.5,\n20,5,\n25,1,2\n"
    CurveFile(file, 0)
    assert file.read_bytes() == b""


def test_what_is_missing_is_one_line_that_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(needs, "find_spec", lambda name: None if name in {"torch", "sb3_contrib"} else object())
    with pytest.raises(MissingDependencyError) as found:
        needs.need_extra("learn", "houseexpo train")
    assert str(found.value) == (
        "houseexpo train needs PyTorch, sb3-contrib, not installed here: "
        "in a clone of the project, pip install -e '.[learn]'"
    )


@pytest.mark.parametrize("text", ["", '{"seed": 0, "popul'])
def test_a_run_whose_description_is_damaged_is_no_run_to_go_on_with(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(TrainingError, match=r"run\.json: damaged; name another folder"):
        begin_run(tmp_path, {"seed": 0}, resume=True)
