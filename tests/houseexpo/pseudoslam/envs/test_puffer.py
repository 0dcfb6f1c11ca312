"""The adapter for PufferLib 3, with the library itself, in a process of its own: it changes warnings and the folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need
from tests.builders.simulations import explorers

ROOT = Path(__file__).parents[4]
PUFFER = Path(sys.prefix) / "puffer"
HEAD = """
import gymnasium
import numpy as np
import pufferlib.vector
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.puffer import PseudoSlamPufferEnv
from tests.builders.simulations import HUTS

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=36), max_steps=9)
GIVEN = {"num_envs": 4, "dataset": HUTS, "config": SMALL, "threads": 1}
def drawn(env, n): return np.random.default_rng(n).integers(0, 3, env.num_agents).astype(np.int32)
if __name__ == "__main__":
"""
SAME = """
for task, more in (("Exploration", {}), ("Exploration", {"observation": "scales"}), ("ObstacleAvoidance", {})):
    given = {**GIVEN, **more}
    env = pufferlib.vector.make(PseudoSlamPufferEnv, [task], given)
    seeds = np.random.SeedSequence(7).generate_state(4).tolist()
    number = given.pop("num_envs")
    plain = gymnasium.make_vec(f"PseudoSLAM/{task}-v0", number, autoreset_mode="SameStep", **given)
    seen, _ = env.reset(seed=7)
    held, returns, ends = env.observations, np.zeros(4), []
    np.testing.assert_array_equal(seen, plain.reset(seed=seeds)[0])
    if not more:
        assert np.shares_memory(seen, env.envs.state(0).view)
    for n in range(25):
        actions = drawn(env, n)
        seen, rewards, terminals, truncations, infos = env.step(actions)
        wanted = plain.step(actions)
        returns += wanted[1]
        for found, expected in zip((seen, rewards, terminals, truncations), wanted, strict=False):
            np.testing.assert_array_equal(found, expected.astype(found.dtype))
        assert seen is held and rewards is env.rewards and env.masks.all()
        over = np.flatnonzero(wanted[2] | wanted[3])
        assert len(infos) == len(over)
        for i, info in zip(over, infos, strict=True):
            assert abs(info["episode_return"] - returns[i]) < 1e-9
            assert info["coverage"] == wanted[4]["final_info"]["coverage"][i]
            ends.append(info["episode_length"])
        returns[over] = 0.0
    assert len(ends) >= 8 and max(ends) == 9.0
"""
BACKENDS = """
found = []
for backend, more in (("Serial", {}), ("Multiprocessing", {"num_workers": 2})):
    env = pufferlib.vector.make(PseudoSlamPufferEnv, env_kwargs=GIVEN, backend=backend, num_envs=2, **more)
    seen = [env.reset(seed=3)[0].copy()]
    for n in range(12):
        seen.append(env.step(np.random.default_rng(n).integers(0, 3, 8).astype(np.int32))[0].copy())
    found.append(np.array(seen))
    env.close()
assert found[0].any()
np.testing.assert_array_equal(found[0][:, :4], found[1][:, :4])
"""
TRAINER = """
import pufferlib.models
from pufferlib import pufferl

envs = pufferlib.vector.make(PseudoSlamPufferEnv, ["Exploration"], GIVEN)
settings = pufferl.load_config("default")
settings["train"] |= {"device": "cpu", "total_timesteps": 1024, "minibatch_size": 256}
logs = pufferl.train("pseudoslam", settings, envs, pufferlib.models.Default(envs))
assert 0.0 < logs[-1]["environment/coverage"] <= 1.0, logs[-1]
"""
REFUSED = """
for words, given in (
    ("found several", {"observation": "dict"}),
    ("found several", {"task": "Navigation", "config": None}),
    ("task: expected one of Exploration", {"task": "Exploring"}),
    ("copy: PufferLib determines this argument", {"copy": True}),
):
    try:
        PseudoSlamPufferEnv(**{**GIVEN, **given})
    except ConfigError as error:
        assert words in str(error), error
    else:
        raise AssertionError(words)
"""


def run(lines: list[str], folder: Path) -> str:
    """Run a program beside PufferLib; return what it prints."""
    need(folders=[PUFFER / "pufferlib"], how="make puffer")
    environment = {**os.environ, "PYTHONPATH": f"{PUFFER}{os.pathsep}{ROOT}"}
    done = subprocess.run(
        [sys.executable, *lines], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("lines", [SAME, BACKENDS, TRAINER, REFUSED], ids=["same", "backends", "trainer", "refused"])
def test_beside_the_library(lines: str, tmp_path: Path) -> None:
    if lines is TRAINER:
        need(folders=[PUFFER / "pyro"], how="make puffer")  # an older folder lacks what the trainer imports
    program = tmp_path / "program.py"
    program.write_text(HEAD + "\n".join(f"    {line}" for line in lines.splitlines()) + "\n")
    run([str(program)], tmp_path)


@pytest.mark.slow
def test_the_example_runs(tmp_path: Path) -> None:
    run_build([Path("procedural:4")], tmp_path / "plans", seed=3, plan=plan_level)
    said = run([str(ROOT / "docs" / "examples" / "puffer.py"), "--dataset", "plans", "--steps", "210"], tmp_path)
    assert "steps a second" in said
    assert "64 episodes" in said


def test_maps_are_drawn_into_an_array_of_the_callers() -> None:
    plain, envs = explorers(3), explorers(3, copy=False)
    maps = np.zeros((3, *envs.single_observation_space.shape), np.uint8)
    envs.draw_into(maps)
    assert np.shares_memory(envs.reset(seed=1)[0], maps)
    np.testing.assert_array_equal(maps, plain.reset(seed=1)[0])
    for step in range(70):  # over the end of an episode
        actions = np.full(3, step % 3)
        envs.step(actions)
        np.testing.assert_array_equal(maps, plain.step(actions)[0])


@pytest.mark.parametrize("given", [{"copy": True}, {"copy": False, "layout": "HWC"}])
def test_only_where_maps_are_views_of_that_shape(given: dict[str, object]) -> None:
    envs = explorers(2, **given)
    with pytest.raises(ConfigError, match="copy=False and layout"):
        envs.draw_into(np.zeros((2, 1, 48, 48), np.uint8))


@pytest.mark.parametrize(
    "maps", [np.zeros((2, 1, 9, 9), np.uint8), np.zeros((2, 1, 48, 48)), np.zeros((2, 1, 48, 96), np.uint8)[..., ::2]]
)
def test_what_does_not_fit_is_refused(maps: np.ndarray) -> None:
    envs = explorers(2, copy=False)
    with pytest.raises(ConfigError, match="draw_into: expected a C-contiguous uint8 array of shape"):
        envs.draw_into(maps)
