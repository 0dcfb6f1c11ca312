"""``houseexpo record``, and movies of any policy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import gymnasium
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError, MissingDependencyError, PolicyError
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.agents.policies import make_policy
from houseexpo.pseudoslam.config import SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv
from houseexpo.pseudoslam.io.record import record_episode, record_race, write_movie
from houseexpo.pseudoslam.render.picture import draw_episode
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.commands import call

CONFIG = SimulatorConfig(pixels_per_metre=16.0, start=StartConfig(random=False, x_m=1.0, y_m=1.0), max_steps=500)


def made(**other: object) -> ExplorationEnv:
    return ExplorationEnv(ROOM, replace(CONFIG, **other), success_coverage=None)


def frames(path: Path) -> list[np.ndarray]:
    with Image.open(path) as movie:
        found = []
        for number in range(movie.n_frames):
            movie.seek(number)
            found.append(np.asarray(movie.convert("RGB")))
        return found


def test_a_gif_has_a_picture_for_each_step(tmp_path: Path) -> None:
    env = made()
    done = record_episode(env, lambda _: 1, tmp_path / "new" / "run.gif", steps=12, seed=0, fps=20, shows="map")
    shown = frames(tmp_path / "new" / "run.gif")
    assert (done.steps, done.ended, len(shown)) == (12, False, 13)
    with Image.open(tmp_path / "new" / "run.gif") as movie:
        assert movie.info["duration"] == 50
        assert movie.info["loop"] == 0
        movie.seek(12)
        assert movie.info["duration"] == 50 + 1500
    last = draw_episode(env.simulator, env.state, [env.state.poses_px] * 2, shows="map", most_px=(640, 480))
    assert np.abs(shown[-1].astype(int) - last).mean() < 0.5  # the palette costs little
    exact = (shown[-1] == last).all(axis=2).mean()
    assert exact > 0.98


def test_a_film_is_an_mp4(tmp_path: Path) -> None:
    try:
        record_episode(made(), lambda _: 2, tmp_path / "run.mp4", steps=5, fps=10)
    except MissingDependencyError:
        pytest.skip("this build of OpenCV writes no MP4")
    film = cv2.VideoCapture(str(tmp_path / "run.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 6
    assert film.get(cv2.CAP_PROP_FPS) == 10
    frame = film.read()[1][..., ::-1]
    assert frame.shape[0] % 2 == frame.shape[1] % 2 == 0
    assert (frame.reshape(-1, 3).max(axis=0) > 240).all()


@pytest.mark.parametrize("name", ["run.gif", "run.mp4"])
def test_a_film_that_fails_leaves_what_was_there(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("the film of yesterday")
    actions = [0, 0]
    with pytest.raises(IndexError):
        record_episode(made(), lambda _: actions.pop(), tmp_path / name, steps=5)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [(name, "the film of yesterday")]


def test_a_policy_of_ones_own_sees_what_gymnasium_shows(tmp_path: Path) -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=ROOM, config=CONFIG, success_coverage=None)
    seen = []

    def policy(observation: np.ndarray) -> int:
        seen.append(observation)
        return len(seen) % 3

    done = record_episode(env, policy, tmp_path / "run.gif", steps=4, seed=1, shows="beside")
    first, _ = env.reset(seed=1)
    assert np.array_equal(seen[0], first)
    assert len(seen) == 4
    assert done.info["coverage"] > 0.1
    wide, high = Image.open(tmp_path / "run.gif").size
    assert high > wide  # the room is wide: one below the other


def test_random_is_seeded_and_takes_any_action(tmp_path: Path) -> None:
    for actions in ("discrete", "continuous"):
        env = ExplorationEnv(ROOM, CONFIG, actions=actions)
        drawn = [[make_policy("random", env, seed)(None) for _ in range(20)] for seed in (0, 0, 1)]
        assert np.array_equal(drawn[0], drawn[1]) or actions == "continuous"
        assert all(env.action_space.contains(action) for action in drawn[0])
    done = [
        record_episode(made(), make_policy("random", made(), 4), tmp_path / "run.gif", 15, seed=2).reward
        for _ in range(2)
    ]
    assert done[0] == done[1]


def test_the_command_writes_a_movie_of_a_plan(tmp_path: Path) -> None:
    (tmp_path / "room.json").write_bytes(encode(ROOM))
    words = ["record", str(tmp_path / "room.json"), "--out", str(tmp_path / "run.gif"), "--steps", "10"]
    for policy in ("frontier", "forward", "random"):
        result = call(*words, "--policy", policy, "--size", "300", "200")
        assert "steps in plan room-5.5x3.2" in result
        assert Image.open(tmp_path / "run.gif").size <= (300, 200)
    files = [(tmp_path / "run.gif").read_bytes()]
    for seed in ("0", "1"):
        CliRunner().invoke(make_app(), [*words, "--policy", "random", "--size", "300", "200", "--seed", seed])
        files.append((tmp_path / "run.gif").read_bytes())
    assert files[0] == files[1] != files[2]


def test_each_task_has_a_policy_that_is_made_for_it(tmp_path: Path) -> None:
    (tmp_path / "room.json").write_bytes(encode(ROOM))
    words = ["record", str(tmp_path / "room.json"), "--out", str(tmp_path / "run.gif"), "--size", "80", "60"]
    result = call(*words, "--task", "navigation")
    assert "0 collisions" in result
    assert float(result.rpartition("reward")[2]) > 1.0, "it gets to its goal"


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    result = call("record", "--task", "avoidance", "--out", tmp_path / "run.avi", code=2)
    assert "expected a file that ends in .gif or .mp4, found 'run.avi'" in result
    with pytest.raises(ConfigError, match="fps: expected more than 0, at most 100, found 0"):
        write_movie([], tmp_path / "run.gif", 0)
    with pytest.raises(ConfigError, match="steps and every to be at least 1, found 0 and 1"):
        record_episode(made(), lambda _: 0, tmp_path / "run.gif", 0)
    with pytest.raises(ConfigError, match="shows: expected one of map, both, truth, beside; found 'all'"):
        record_episode(made(), lambda _: 0, tmp_path / "run.gif", shows="all")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="env: expected an environment of PseudoSLAM"):
        record_episode(gymnasium.make("CartPole-v1"), lambda _: 0, tmp_path / "run.gif")
    with pytest.raises(ConfigError, match="found 0 policies"):
        record_race([], tmp_path / "a.gif")
    with pytest.raises(ConfigError, match="policy: no 'forwards'"):
        make_policy("forwards", made())
    with pytest.raises(ConfigError, match="policy 'forward': expected an environment with discrete actions"):
        make_policy("forward", ExplorationEnv(ROOM, CONFIG, actions="continuous"))
    assert not list(tmp_path.iterdir())


def test_policies_go_side_by_side(tmp_path: Path) -> None:
    """Each in a panel of its own, from one start; what has ended stands still."""
    (tmp_path / "room.json").write_bytes(encode(ROOM))
    words = ["--steps", "40", "--every", "10", "--policy", "frontier,forward", "--size", "600", "240"]
    names = ["record", str(tmp_path / "room.json"), "--out", str(tmp_path / "race.gif")]
    done = call(*names, *words)
    assert "frontier: " in done
    assert "forward: " in done
    shown = frames(tmp_path / "race.gif")
    assert len(shown) >= 2
    high, wide, _ = shown[0].shape
    assert (wide, high <= 240) == (600, True)
    left, right = shown[0][40:, :296], shown[0][40:, 304:]
    assert (left == right).all()
    left, right = shown[-1][40:, :296], shown[-1][40:, 304:]
    assert (left != right).any()


# A policy is shown what it wants to see; which policy failed, and where, is said.


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
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("frontiers", "on_map,frontiers")),
    ],
)
def test_a_file_s_policy_sees_and_acts_as_it_says(tmp_path: Path, words: list[str], name: str) -> None:
    asked = ",".join(f"{tmp_path / 'mine.py'}:{each}" for each in name.split(","))
    result = call(*words, "--policy", asked, "--out", tmp_path / "run.gif")
    assert "8 steps" in result
    assert (tmp_path / "run.gif").is_file()


@pytest.mark.parametrize("task", ["exploration", "navigation"])
def test_a_bag_changes_nothing_of_what_a_policy_is_shown(tmp_path: Path, words: list[str], task: str) -> None:
    pytest.importorskip("rosbags")
    asked = ["--policy", f"{tmp_path / 'mine.py'}:on_map", "--task", task, "--bag", str(tmp_path / "run.mcap")]
    call(*words, *asked)
    assert (tmp_path / "run.mcap").is_file()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--policy", "greedy"], "'greedy': expected a task that it was made for (navigation), found exploration"),
        (["--policy", "frontier,a-star"], "that it was made for (navigation), found exploration"),
        (["--policy", "frontier", "--task", "navigation"], "made for (exploration), found navigation"),
        (["--policy", "frontier,forward", "--shows", "beside"], "--policy: several make a movie"),
        (["--policy", "seek", "--task", "navigation"], "(goal.kind room or object), found place"),
        (["--policy", "FILE:broken"], "plan 'room-5.5x3.2', step 0: it raised IndexError"),
        (["--policy", "FILE:broken"], "mine.py, line"),
        (["--policy", "FILE:direct"], "mine.py:direct to be a factory: called with (robot, seed), it returns a policy"),
    ],
)
def test_what_fails_is_said_in_a_line(tmp_path: Path, words: list[str], asked: list[str], said: str) -> None:
    asked = [word.replace("FILE", str(tmp_path / "mine.py")) for word in asked]
    result = call(*words, *asked, "--out", tmp_path / "run.gif", code=2)
    assert said in result.replace("\n", "")
    assert "Traceback" not in result
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
