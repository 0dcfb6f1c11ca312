"""The libraries that people learn with: they take our environments, and learn some steps."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from tests.builders.needs import need
from tests.builders.simulations import HUTS, assert_same_step, native, singles

EXAMPLES = Path(__file__).parents[4] / "docs" / "examples"
SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=36), max_steps=20)
TASKS: list[tuple[str, dict[str, Any], str]] = [
    ("ObstacleAvoidance", {"reward": "way"}, "CnnPolicy"),
    ("Exploration", {"dataset": HUTS, "reward": "coverage", "observation": "scales"}, "CnnPolicy"),
    ("Exploration", {"dataset": HUTS, "layout": "HWC", "config": "view-10m"}, "CnnPolicy"),
    ("Navigation", {"dataset": HUTS, "actions": "continuous"}, "MultiInputPolicy"),
]

pytestmark = pytest.mark.slow


@pytest.fixture
def learn() -> None:
    """The extra ``learn``, with one thread: tests share the machine."""
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard"], how="make learn")
    import torch

    torch.set_num_threads(1)


@pytest.mark.parametrize(("task", "given", "policy"), TASKS)
def test_ppo_learns(learn: None, task: str, given: dict[str, Any], policy: str, tmp_path: Path) -> None:
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.vec_env import VecMonitor

    from houseexpo.pseudoslam.sb3 import SB3VecEnv

    given = {"config": SMALL, **given}
    check_env(gymnasium.make(f"PseudoSLAM/{task}-v0", **given))
    env = VecMonitor(SB3VecEnv(native(task, 4, "SameStep", max_episode_steps=20, **given)))
    model = PPO(policy, env, n_steps=32, batch_size=32, n_epochs=1, seed=0, tensorboard_log=str(tmp_path))
    model.learn(4 * 32 * 2)
    lengths = [episode["l"] for episode in model.ep_info_buffer]
    assert len(lengths) >= 8
    assert max(lengths) <= 20
    assert list(tmp_path.rglob("events.out.tfevents.*"))
    actions, _ = model.predict(env.reset(), deterministic=True)
    assert len(actions) == 4


def test_a_policy_with_a_memory_learns(learn: None) -> None:
    from sb3_contrib import RecurrentPPO

    from houseexpo.pseudoslam.sb3 import SB3VecEnv

    env = SB3VecEnv(native("Exploration", 2, "SameStep", dataset=HUTS, config=SMALL))
    policy = {"lstm_hidden_size": 16}
    model = RecurrentPPO("CnnLstmPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0, policy_kwargs=policy)
    model.learn(2 * 32 * 2)
    state, starts, observation = None, np.ones(2, bool), env.reset()
    for _ in range(25):
        actions, state = model.predict(observation, state=state, episode_start=starts, deterministic=True)
        observation, _, starts, _ = env.step(actions)
    assert state[0].shape[-1] == 16


def test_sb3s_wrappers_go_round_the_adapter(learn: None) -> None:
    from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize, VecTransposeImage

    from houseexpo.pseudoslam.sb3 import SB3VecEnv

    inner = SB3VecEnv(native("Exploration", 2, "SameStep", dataset=HUTS, config=SMALL, layout="HWC"))
    env = VecFrameStack(VecTransposeImage(VecNormalize(VecMonitor(inner), norm_obs=False)), 3)
    assert env.reset().shape == (2, 3, 48, 48)
    for _ in range(21):
        shown, _, _, infos = env.step(np.zeros(2, np.int64))
    assert shown.shape == (2, 3, 48, 48)
    assert inner.get_attr("task") == env.get_attr("task")
    assert len(infos) == 2


def test_one_file_of_ppo_in_the_form_of_cleanrl_learns(learn: None) -> None:
    """docs/examples/ppo.py on the vector form, its episodes counted by gymnasium's wrapper."""
    example = imported(EXAMPLES / "ppo.py")
    room = {"config": replace(SMALL, max_steps=15), "reward": "way"}
    args = example.Args("PseudoSLAM/ObstacleAvoidance-v0", num_envs=4, num_steps=16, total_steps=256, env=room)
    first, second = (example.train(args) for _ in range(2))
    assert len(first.returns) == 256 // 15 // 4 * 4
    assert first.returns == second.returns  # a seed decides
    assert all(np.isfinite(first.losses))
    assert len(first.losses) == 4
    assert first.change > 0


def test_the_file_of_ppo_says_where_it_learned_too_little_to_tell(learn: None) -> None:
    words = [sys.executable, str(EXAMPLES / "ppo.py"), "PseudoSLAM/ObstacleAvoidance-v0", "--total-steps", "1"]
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")
    assert "no episode ended: give it more --total-steps" in done.stderr
    assert "Warning" not in done.stderr


def imported(file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(file.stem, file)
    module = sys.modules[file.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("observation", ["map", "dict"])
def test_processes_of_their_own_agree_with_our_vectors(observation: str) -> None:
    """As RLlib and others do: AsyncVectorEnv over single environments, with shared memory."""
    given = {"dataset": HUTS, "config": SMALL, "observation": observation}
    others = gymnasium.make_vec(
        "PseudoSLAM/Exploration-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"context": "spawn"}, **given
    )
    ours, theirs = native("Exploration", 2, **given), singles("Exploration", 2, **given)
    try:
        assert_same_step(others.reset(seed=3), theirs.reset(seed=3))
        ours.reset(seed=3)
        for step in range(25):
            actions = np.array([step % 3 == 2, 0], np.int64)
            found = others.step(actions)
            assert_same_step(found, theirs.step(actions), step)
            assert_same_step(ours.step(actions), found, step)
        assert others.get_attr("config") == (SMALL, SMALL)
        others.set_attr("plan_ids", [["small"], ["small"]])
        assert others.reset()[1]["plan_id"].tolist() == ["small", "small"]
    finally:
        others.close()
