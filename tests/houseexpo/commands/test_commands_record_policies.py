"""``houseexpo record`` shows a policy what it wants to see, and says which policy failed, and where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError, PolicyError
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.agents.policies import make_policy
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv
from houseexpo.pseudoslam.tasks import ROOM

POLICIES = """
import numpy as np
from houseexpo.pseudoslam.agents.protocol import Interface
from houseexpo.pseudoslam.config import ObservationConfig


def factory(act, **wanted):
    def made(robot, seed):
        return lambda observation, info: act(robot, observation)

    made.interface = Interface(**wanted)
    return made


def seen(robot, observation):
    assert robot.observation_space.contains(observation), "shown what the space does not hold"
    return 1


on_map = factory(seen)
near = factory(seen, view=ObservationConfig(size_m=2.0))
ranges = factory(lambda robot, shown: int(shown["ranges"].max() < 1.0), observation="dict")
steering = factory(lambda robot, shown: np.array([0.5, 1.0]), actions="continuous")
frontiers = factory(lambda robot, shown: int(shown["action_mask"].argmax()), actions="frontier")
places = factory(lambda robot, shown: int(shown["action_mask"].argmax()), actions="neighbour", observation="graph")
points = factory(lambda robot, shown: np.array([0.5, 0.0]), actions="waypoint")
done = factory(lambda robot, shown: None, actions="continuous")
broken = factory(lambda robot, shown: shown["nothing"])
direct = lambda observation, info: 1
"""


@pytest.fixture
def words(tmp_path: Path) -> list[str]:
    (tmp_path / "mine.py").write_text(POLICIES)
    (tmp_path / "room.json").write_bytes(encode(ROOM))
    return ["record", str(tmp_path / "room.json"), "--steps", "8", "--size", "80", "60"]


@pytest.mark.parametrize(
    "name",
    [
        *("on_map", "near", "ranges", "steering", "done"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("frontiers", "places", "points", "on_map,frontiers")),
    ],
)
def test_a_file_s_policy_sees_and_acts_as_it_says(tmp_path: Path, words: list[str], name: str) -> None:
    asked = ",".join(f"{tmp_path / 'mine.py'}:{each}" for each in name.split(","))
    result = CliRunner().invoke(make_app(), [*words, "--policy", asked, "--out", str(tmp_path / "run.gif")])
    assert result.exit_code == 0, result.output
    assert "8 steps" in result.output
    assert (tmp_path / "run.gif").is_file()


@pytest.mark.parametrize("task", ["exploration", "navigation"])
def test_a_bag_changes_nothing_of_what_a_policy_is_shown(tmp_path: Path, words: list[str], task: str) -> None:
    pytest.importorskip("rosbags")
    asked = ["--policy", f"{tmp_path / 'mine.py'}:on_map", "--task", task, "--bag", str(tmp_path / "run.mcap")]
    result = CliRunner().invoke(make_app(), [*words, *asked])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "run.mcap").is_file()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--policy", "greedy"], "'greedy': expected a task that it was made for (navigation), found exploration"),
        (["--policy", "frontier,a-star"], "that it was made for (navigation), found exploration"),
        (["--policy", "frontier", "--task", "navigation"], "made for (exploration), found navigation"),
        (["--policy", "frontier,forward", "--shows", "beside"], "--policy: several make a movie"),
        (["--policy", "FILE:broken"], "plan 'room-5.5x3.2', step 0: it raised IndexError"),
        (["--policy", "FILE:broken"], "mine.py, line"),
        (["--policy", "FILE:direct"], "mine.py:direct to be a factory: called with (robot, seed), it returns a policy"),
    ],
)
def test_what_fails_is_said_in_a_line(tmp_path: Path, words: list[str], asked: list[str], said: str) -> None:
    asked = [word.replace("FILE", str(tmp_path / "mine.py")) for word in asked]
    result = CliRunner().invoke(make_app(), [*words, *asked, "--out", str(tmp_path / "run.gif")])
    assert result.exit_code == 2
    assert said in result.output.replace("\n", "")
    assert "Traceback" not in result.output
    assert not (tmp_path / "run.gif").exists()


def test_a_policy_is_refused_where_it_would_see_or_act_otherwise(tmp_path: Path, words: list[str]) -> None:
    file, config = tmp_path / "mine.py", SimulatorConfig(pixels_per_metre=16.0)
    assert words
    with pytest.raises(ConfigError, match="expected an environment with discrete actions, found continuous actions"):
        make_policy("frontier", ExplorationEnv(ROOM, config, actions="continuous"))
    with pytest.raises(ConfigError, match="expected an environment that shows 'dict', found 'map'"):
        make_policy(f"{file}:ranges", ExplorationEnv(ROOM, config))
    env = NavigationEnv(ROOM, config)
    observation, _ = env.reset(seed=0)
    with pytest.raises(PolicyError, match=r"mine.py:broken': plan 'room-5.5x3.2', step 0: it raised KeyError"):
        make_policy(f"{file}:broken", env)(observation)
    shown = NavigationEnv(ROOM, config, observation="dict")
    observation, _ = shown.reset(seed=0)
    assert make_policy(f"{file}:on_map", shown)(observation) == 1
    assert np.array_equal(observation["map"], env.reset(seed=0)[0]["map"])
