"""Runs of some hundred steps: what they leave, how they go on after a kill, what they refuse."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError, TrainingError
from houseexpo.pseudoslam.learning.config import EnvironmentConfig, EvaluationConfig, PPOConfig, TrainConfig
from houseexpo.pseudoslam.learning.environments import make_environments
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.training import TEST, run, tiny, write_tiny

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("learn")]
ROOT = Path(__file__).parents[4]
COMMAND = "import typer; from houseexpo.commands.train import train; typer.run(train)"


def weights(folder: Path) -> dict[str, Any]:
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    return {
        name: value.numpy() for name, value in read_policy(folder / "policy.pt").network.policy.state_dict().items()
    }


def assert_same_run(one: Path, other: Path) -> None:
    """Weights, curves and what is said of them are the same, bit by bit."""
    first, second = weights(one), weights(other)
    assert first.keys() == second.keys()
    for name, values in first.items():
        np.testing.assert_array_equal(values, second[name], err_msg=name)
    for name in ("learning.csv", "evaluation.csv", "policy.json"):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def rows(file: Path) -> list[dict[str, str]]:
    with file.open() as stream:
        return list(csv.DictReader(stream))


def test_a_run_leaves_a_policy_curves_and_logs(tmp_path: Path) -> None:
    said: list[str] = []
    score = run(tmp_path / "a", say=said.append)
    assert said[0].startswith("learns in ")  # before the first result, which may take minutes
    assert [line.split(" steps:")[0] for line in said[1:]] == [f"{n} of 384" for n in (64, 128, 256, 384)]
    assert "a step" in said[1]  # a figure after the first update
    about = json.loads((tmp_path / "a" / "policy.json").read_text())
    assert (about["task"], about["seed"], about["steps"]) == ("avoidance", 0, 384)
    assert about["score"] == score
    assert about["config"] == tiny().record()
    assert set(about["versions"]) >= {"houseexpo", "torch", "stable-baselines3"}
    tested = rows(tmp_path / "a" / "evaluation.csv")
    assert [row["steps_done"] for row in tested] == ["128", "256", "384"]
    assert float(tested[-1]["return"]) == pytest.approx(score["return"], rel=1e-4)
    learned = rows(tmp_path / "a" / "learning.csv")
    assert [row["steps_done"] for row in learned] == [str(64 * n) for n in range(1, 7)]
    assert sum(int(row["episodes"]) for row in learned) == 3 * 2 * 3  # 64 of the 20 steps, thrice, in two environments
    assert list((tmp_path / "a" / "tensorboard").glob("events.out.tfevents.*"))
    assert len(list((tmp_path / "a" / "checkpoints").iterdir())) == 2
    run(tmp_path / "b", tiny(seed=1))
    assert any((values != weights(tmp_path / "b")[name]).any() for name, values in weights(tmp_path / "a").items())


@pytest.mark.parametrize(
    ("task", "policy", "given"),
    [
        ("exploration", "cnn-lstm", {"task": {"reward": "coverage"}, "observation": "scales", "preset": "view-10m"}),
        ("navigation", "cnn-lstm", {"actions": "continuous"}),
        ("exploration", "set", {"actions": "frontier", "task": {"reward": "coverage"}}),
    ],
)
def test_all_tasks_are_learned_and_tested_on_other_plans(
    task: str, policy: Any, given: dict[str, Any], tmp_path: Path
) -> None:
    from houseexpo.pseudoslam.learning.policy_file import EpisodeActor, read_policy

    place = EnvironmentConfig(simulator=tiny().environment.simulator, **given)
    config = replace(tiny(steps=64), policy=policy, environment=place)
    score = run(tmp_path / "a", config, task)
    assert 0 < score["coverage"] <= 1
    lists = json.loads((tmp_path / "a" / "policy.json").read_text())["lists"]
    assert (lists["train"]["plans"], lists["test"]["plans"]) == (3, len(TEST))
    trained = read_policy(tmp_path / "a" / "policy.pt", task)
    env = make_environments(task, place, open_dataset(tmp_path / "huts"), number=1, threads=1)
    ways = []
    for _ in range(2):  # a policy's memory and chance are its own
        actor = EpisodeActor(trained, seed=5)
        observation, _ = env.reset(seed=3, options={"plan_id": "hut_e"})
        way = []
        for _ in range(8):
            one = {k: v[0] for k, v in observation.items()} if isinstance(observation, dict) else observation[0]
            action = actor(one)
            assert env.single_action_space.contains(action)
            observation, *_ = env.step(np.asarray([action]))
            way.append(action)
        ways.append(np.array(way))
    np.testing.assert_array_equal(*ways)


@pytest.mark.parametrize("policy", ["cnn", "cnn-lstm"])
def test_convolutions_in_bfloat16_are_nearly_those_in_float32(policy: Any) -> None:
    import torch

    from houseexpo.pseudoslam.learning.model import new_learner, wrap_for_learner

    values, coarse = [], None
    for precision in ("float32", "bfloat16"):
        config = replace(tiny(), policy=policy, ppo=replace(tiny().ppo, precision=precision))
        envs = make_environments("avoidance", config.environment, ROOM, number=2, threads=1)
        learner = new_learner(wrap_for_learner(envs, config), config)
        learner.learn(config.steps_per_update)
        assert {weight.dtype for weight in learner.policy.parameters()} == {torch.float32}
        if coarse is None:
            coarse = {name: weight.clone() for name, weight in learner.policy.state_dict().items()}
        learner.policy.load_state_dict(coarse)
        seen = torch.linspace(0, 1, envs.single_observation_space.shape[-1] ** 2).reshape(
            1, *envs.single_observation_space.shape
        )
        values.append(learner.policy.features_extractor(seen))
        envs.close()
    assert values[1].dtype == torch.float32
    assert (values[0] != values[1]).any()
    torch.testing.assert_close(*values, rtol=0.03, atol=0.01)


def test_a_run_that_is_killed_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    config = write_tiny(tmp_path, steps=1280)  # ten checkpoints
    words = ["avoidance", "--config", str(config), "--out", str(tmp_path / "killed"), "--threads", "1"]
    command = [sys.executable, "-c", COMMAND, *words]
    environ = {**os.environ, "PYTHONPATH": str(ROOT)}
    running = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL)
    try:
        while not list((tmp_path / "killed").glob("checkpoints/[0-9]*.zip")):
            assert running.poll() is None, "it ended before its first checkpoint"
            time.sleep(0.005)
    finally:
        running.kill()
        running.wait()
    assert not (tmp_path / "killed" / "policy.pt").exists()
    done = subprocess.run([*command, "--resume"], env=environ, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "continues from" in done.stdout
    run(tmp_path / "whole", tiny(steps=1280))
    assert_same_run(tmp_path / "killed", tmp_path / "whole")


@pytest.mark.parametrize(
    ("task", "policy", "given"),
    [
        ("avoidance", "cnn-lstm", {}),
        ("exploration", "cnn", {"task": {"reward": "coverage"}}),
        ("navigation", "cnn-lstm", {"actions": "continuous"}),
        ("exploration", "set", {"actions": "frontier"}),
    ],
)
def test_a_checkpoint_in_the_middle_of_episodes_goes_on_with_the_same_bits(
    task: str, policy: Any, given: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A checkpoint after each update; the run ends at the third, between two places where episodes begin anew."""
    from houseexpo.pseudoslam.learning import training

    place = EnvironmentConfig(simulator=tiny().environment.simulator, **given)
    config = replace(tiny(checkpoint_every=256), policy=policy, environment=place)
    run(tmp_path / "whole", config, task)
    monkeypatch.setattr(training, "KEEP_S", 0.0)
    save, saved = training.checkpoints.save_checkpoint, []

    def stop_at_third(*args: Any) -> Path:
        saved.append(save(*args))
        if len(saved) == 3:
            raise KeyboardInterrupt
        return saved[-1]

    monkeypatch.setattr(training.checkpoints, "save_checkpoint", stop_at_third)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "cut", config, task)
    assert saved[-1].name == f"{3 * 64:012d}.zip"
    run(tmp_path / "cut", config, task, resume=True)
    assert_same_run(tmp_path / "cut", tmp_path / "whole")


def test_a_run_without_a_checkpoint_begins_anew_and_says_so(tmp_path: Path) -> None:
    run(tmp_path / "a")
    shutil.rmtree(tmp_path / "a" / "checkpoints")  # as when it was killed before the first
    (tmp_path / "a" / "policy.pt").unlink()
    said: list[str] = []
    run(tmp_path / "a", resume=True, say=said.append)
    assert said[0] == "begins anew, since the run has no checkpoint yet"
    run(tmp_path / "b")
    assert_same_run(tmp_path / "a", tmp_path / "b")


def test_what_is_damaged_is_passed_over_for_the_one_before(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run(tmp_path / "a")
    run(tmp_path / "b")
    first, last = sorted((tmp_path / "b" / "checkpoints").iterdir())
    last.write_bytes(last.read_bytes()[:-1000])
    said: list[str] = []
    run(tmp_path / "b", resume=True, say=said.append)
    assert said[0] == f"continues from {first}"
    assert "found it damaged" in caplog.text
    assert_same_run(tmp_path / "a", tmp_path / "b")
    for file in (tmp_path / "b" / "checkpoints").iterdir():
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 255
        file.write_bytes(data)
    with pytest.raises(TrainingError, match="expected a whole checkpoint, found 2, all damaged"):
        run(tmp_path / "b", resume=True)


def test_another_run_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "a"
    run(folder, tiny(steps=128))
    with pytest.raises(TrainingError, match="a: holds a run; continue it with --resume, or name another folder"):
        run(folder)
    with pytest.raises(TrainingError, match=r"another run: config.ppo.learning_rate is 0.003 there, 0.1 here"):
        run(folder, replace(tiny(), ppo=PPOConfig(0.1, 32, 32, 1)), resume=True)
    with pytest.raises(TrainingError, match=r"another run: config.seed is 0 there, 1 here"):
        run(folder, tiny(seed=1), resume=True)
    with pytest.raises(TrainingError, match=r"another run: task is 'avoidance' there, 'exploration' here"):
        run(folder, task="exploration", resume=True)
    (folder / "run.json").unlink()
    with pytest.raises(TrainingError, match=r"000128.zip: belongs to another run: config.seed"):
        run(folder, tiny(seed=1), resume=True)
    run(folder, tiny(steps=256), resume=True)  # for longer
    assert json.loads((folder / "policy.json").read_text())["steps"] == 256


def test_a_policy_that_breaks_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before a step that it cannot decide, and after an update that spoilt it."""
    import torch

    from houseexpo.pseudoslam.learning import training

    learn = training.new_learner

    def broken(*given: Any) -> Any:
        learner = learn(*given)
        with torch.no_grad():
            learner.policy.action_net.bias[1] = np.nan
        return learner

    monkeypatch.setattr(training, "new_learner", broken)
    said = "after 0 steps: expected finite weights, found NaN or infinity in the policy's 'action_net.bias'; take a"
    with pytest.raises(TrainingError, match=f"update 1, {said}"):
        run(tmp_path / "a")
    assert not list((tmp_path / "a").glob("**/*.zip"))
    assert not (tmp_path / "a" / "policy.pt").exists()
    monkeypatch.setattr(training, "new_learner", learn)
    monkeypatch.setattr(learn(*_wrapped(tiny())).__class__, "train", _spoil)
    with pytest.raises(TrainingError, match=r"update 1, after 64 steps: .* 'value_net.weight'"):
        run(tmp_path / "b")
    assert not list((tmp_path / "b").glob("**/*.zip"))


def _wrapped(config: TrainConfig) -> tuple[Any, TrainConfig]:
    from houseexpo.pseudoslam.learning.model import wrap_for_learner

    return wrap_for_learner(
        make_environments("avoidance", config.environment, ROOM, number=2, threads=1), config
    ), config


def _spoil(learner: Any) -> None:
    learner.policy.value_net.weight.data.fill_(np.inf)


def test_a_test_leaves_learning_as_it_was(tmp_path: Path) -> None:
    """With tests at other times the same is learned, and a test in a room has as many episodes as plans are asked."""
    often, seldom = EvaluationConfig(64, 5), EvaluationConfig(10_000, 2)
    for name, evaluation in (("a", often), ("b", seldom)):
        run(tmp_path / name, replace(tiny(), evaluation=evaluation))
    for name, values in weights(tmp_path / "a").items():
        np.testing.assert_array_equal(values, weights(tmp_path / "b")[name], err_msg=name)
    assert len(rows(tmp_path / "a" / "evaluation.csv")) == 6
    assert len(rows(tmp_path / "b" / "evaluation.csv")) == 1
    assert make_environments("avoidance", tiny().environment, ROOM, number=1).config.max_steps == 20


def test_a_policy_with_masks_never_chooses_what_they_forbid(tmp_path: Path) -> None:
    import torch

    from houseexpo.pseudoslam.learning.policy_file import read_policy

    plain = tiny().environment
    config = tiny(policy="cnn", environment=replace(plain, action_mask=True))
    run(tmp_path / "run", config, "exploration")
    policy = read_policy(tmp_path / "run" / "policy.pt", "exploration").network.policy
    envs = make_environments("exploration", config.environment, ROOM, number=4, threads=1)
    seen, forbidden = envs.reset(seed=0)[0], 0
    with torch.inference_mode():
        for _ in range(40):
            chances = policy.get_distribution(policy.obs_to_tensor(seen)[0]).distribution.probs.numpy()
            allowed = seen["action_mask"].astype(bool)
            assert (chances[~allowed] == 0.0).all()
            assert (chances[allowed] > 0.0).all()
            forbidden += np.count_nonzero(~allowed)
            seen = envs.step(np.where(allowed[:, 0], 0, 1))[0]
    assert forbidden > 0
    assert "action_mask" not in tiny().record()["environment"]
    with pytest.raises(ConfigError, match=r"environment.action_mask: expected policy = .cnn."):
        tiny(policy="cnn-lstm", environment=replace(plain, action_mask=True))
