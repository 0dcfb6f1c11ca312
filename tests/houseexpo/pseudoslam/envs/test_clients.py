"""TorchRL and RLlib take our observations and actions as they are, in processes of their own: they change them.

What they learn is tested by the recipes of docs/pseudoslam/clients.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.builders.needs import need

ROOT = Path(__file__).parents[4]
HEAD = """
import gymnasium
import houseexpo.pseudoslam
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.tasks import ROOM

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=36), max_steps=9)
EXPLORE, NAVIGATE = ("PseudoSLAM/Exploration-v0", {"dataset": ROOM, "config": SMALL}), (
    "PseudoSLAM/Navigation-v0", {"dataset": ROOM})
"""
TORCHRL = """
from torchrl.envs import GymEnv, GymWrapper, check_env_specs

for (name, given), more in (
    (EXPLORE, {}),
    (EXPLORE, {"observation": "dict"}),
    (EXPLORE, {"observation": "scales", "actions": "continuous"}),
    (EXPLORE, {"action_mask": True}),
    (EXPLORE, {"actions": "frontier"}),
    (EXPLORE, {"motion": "differential"}),
    (NAVIGATE, {}),
):
    one = GymEnv(name, **given, **more)
    check_env_specs(one)
    assert one.rollout(5, break_when_any_done=False).shape == (5,), more
    for mode, texts in (("Disabled", True), ("SameStep", False)):
        envs = gymnasium.make_vec(name, 3, autoreset_mode=mode, text_info=texts, **given, **more)
        many = GymWrapper(envs)
        check_env_specs(many)
        assert many.rollout(12, break_when_any_done=False).shape == (3, 12), (mode, more)
"""
PROCESSES = """
from torchrl.envs import GymEnv, check_env_specs

if __name__ == "__main__":
    many = GymEnv(EXPLORE[0], num_envs=2, text_info=False, **EXPLORE[1])
    check_env_specs(many)
    assert many.rollout(12, break_when_any_done=False).shape == (2, 12)
    many.close()
"""
RLLIB = """
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import FlattenObservations
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

config = (
    PPOConfig()
    .environment(EXPLORE[0], env_config={**EXPLORE[1], "observation": "dict", "actions": "continuous"})
    .env_runners(
        num_env_runners=0, num_envs_per_env_runner=2, env_to_module_connector=lambda *_, **__: FlattenObservations()
    )
    .rl_module(model_config=DefaultModelConfig(fcnet_hiddens=[16]))
    .training(train_batch_size_per_learner=40, minibatch_size=20, num_epochs=1)
)
algorithm = config.build_algo()
for _ in range(2):
    found = algorithm.train()
assert found["env_runners"]["num_episodes"] > 0
algorithm.stop()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "modules"),
    [(TORCHRL, ["torchrl"]), (PROCESSES, ["torchrl"]), (RLLIB, ["ray", "tree"])],
    ids=["torchrl", "processes", "rllib"],
)
def test_a_library_takes_them_unedited(lines: str, modules: list[str], tmp_path: Path) -> None:
    need(modules=modules, how="make clients")
    program = tmp_path / "program.py"
    program.write_text(HEAD + lines)
    done = subprocess.run(
        [sys.executable, str(program)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "RAY_ADDRESS": "local"},  # and not a cluster that another test left
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr[-4000:]
