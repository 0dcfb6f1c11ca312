"""A policy in a process of its own: it reaches nothing of the environment, and what cannot be is refused."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.benchmark import policy_process as benchmark_player
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
from houseexpo.pseudoslam.benchmark.measures import Trace
from houseexpo.pseudoslam.benchmark.policy_process import (
    SHARED_BYTES,
    PolicyProcess,
    PolicyProcessError,
    _copy_shared,
    _new_shared,
    _share_arrays,
)
from tests.builders.policies import CORRIDOR, TINY, at_step, named

PEEK = """
import gc, os, sys

def policy(robot, seed):
    def act(observation, info):
        frame, held = sys._getframe(1), []
        while frame is not None:
            held += [name for name in frame.f_locals if name in {"env", "case", "track", "runner"}]
            frame = frame.f_back
        kinds = {type(each).__name__ for each in gc.get_objects()}
        held += sorted(kinds & {"ExplorationEnv", "Runner", "World", "Dataset", "State"})
        held += [each.id for each in gc.get_objects() if type(each).__name__ == "FloorPlan" and "room" not in each.id]
        held += [key for key in os.environ if key.startswith("SECRET")]
        if held:
            raise RuntimeError(" ".join(held))
        return None
    return act
"""


def policy_file(folder: Path, text: str) -> str:
    file = folder / "mine.py"
    file.write_text(text)
    return str(file)


def runner_of(player: PolicyProcess) -> EpisodeRunner:
    return EpisodeRunner(TINY, player.policy, [CORRIDOR], 0, player)


def case() -> Any:
    from houseexpo.pseudoslam.benchmark.cases import Case

    return Case("corridor", 1)


def test_a_policy_finds_neither_environment_nor_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET_PLACE", "of the plans")
    with PolicyProcess(policy_file(tmp_path, PEEK)) as player:
        outcome = runner_of(player).run(case())
    assert outcome.values["steps"] == 0


@pytest.mark.slow
def test_the_same_policy_gives_the_same_outcome_in_either_process() -> None:
    from houseexpo.pseudoslam.agents.loading import load_policy

    with PolicyProcess("frontier") as player:
        apart = runner_of(player).run(case())
    together = EpisodeRunner(TINY, load_policy("frontier"), [CORRIDOR]).run(case())
    assert apart == together
    assert len(apart.decisions_ms) == len(together.decisions_ms)


PICKLES = """
import gc
from multiprocessing.connection import Connection

def policy(robot, seed):
    def act(observation, info):
        next(each for each in gc.get_objects() if isinstance(each, Connection)).send({"action": 0})
        return 0
    return act
"""
FAILING = {
    "to be a factory": "def policy(robot, seed):\n    return 7\n",
    "it raised ZeroDivisionError: .*mine.py, line 2": "def policy(robot, seed):\n    return lambda o, i: 1 / 0\n",
    "its process died, exit code 5": "import os\n\ndef policy(robot, seed):\n    return lambda o, i: os._exit(5)\n",
    "an answer that cannot be read": PICKLES,
}


@pytest.mark.slow
@pytest.mark.parametrize("said", FAILING)
def test_a_policy_that_fails_is_told_apart(tmp_path: Path, said: str) -> None:
    with PolicyProcess(policy_file(tmp_path, FAILING[said])) as player, pytest.raises(PolicyError, match=said):
        runner_of(player).run(case())


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".pt", ".json"])
def test_a_file_without_a_policy_is_refused_in_a_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str
) -> None:
    if suffix == ".pt":
        pytest.importorskip("torch")
    file = tmp_path / f"mine{suffix}"
    file.write_bytes(b"nothing of the kind")
    with pytest.raises(ConfigError, match=f"mine{suffix}.*: expected"):
        PolicyProcess(str(file))
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("answer", ['{"name": 1}', '{"interface": 7, "training": null}', "[" * 100_000])
def test_a_module_that_answers_for_itself_is_refused(tmp_path: Path, answer: str) -> None:
    text = f"""
import gc
from multiprocessing.connection import Connection

next(each for each in gc.get_objects() if isinstance(each, Connection)).send_bytes({answer!r}.encode())
"""
    with pytest.raises(PolicyProcessError, match="an answer that cannot be read"):
        PolicyProcess(policy_file(tmp_path, text))


@pytest.mark.slow
def test_the_process_ends_with_the_one_that_started_it(tmp_path: Path) -> None:
    file = policy_file(tmp_path, "import time\n\ndef policy(robot, seed):\n    while True:\n        time.sleep(0.01)\n")
    code = (
        "import sys; from houseexpo.pseudoslam.benchmark.policy_process import PolicyProcess; "
        "player = PolicyProcess(sys.argv[1]);"
        "print(player._process.pid, flush=True); player.ask('new', None, 0)"
    )
    with subprocess.Popen([sys.executable, "-c", code, file], stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        pid = int(started.stdout.readline())
        os.kill(started.pid, signal.SIGKILL)
    for _ in range(100):
        with suppress(ProcessLookupError):
            os.kill(pid, 0)
            time.sleep(0.1)
            continue
        return
    pytest.fail("the policy's process is still there after 10 s")


COMPILES = """
import gc, json
from multiprocessing.connection import Connection

def policy(robot, seed):
    pipe = next(each for each in gc.get_objects() if isinstance(each, Connection))
    def act(observation, info):
        while True:
            pipe.send_bytes(json.dumps({"compiling": True}).encode())
            SLEEP
    return act
"""


@pytest.mark.slow
@pytest.mark.parametrize("sleep", ["__import__('time').sleep(0.05)", "__import__('time').sleep(1e6)"])
def test_a_policy_that_only_says_that_it_compiles_is_timed_in_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sleep: str
) -> None:
    monkeypatch.setattr(benchmark_player, "COMPILING_S", 0.5)
    told: list[str] = []
    with PolicyProcess(policy_file(tmp_path, COMPILES.replace("SLEEP", sleep))) as player:

        def go_on() -> None:
            told.append("go on")
            player._process.kill()  # as the supervisor does when the time is over

        player.time_with(lambda: told.append("stop"), go_on)
        with pytest.raises(PolicyError, match="its process died"):
            runner_of(player).run(case())
    assert told == ["stop", "go on"]


SLOW = """
import time

def policy(robot, seed):
    asked = []
    def act(observation, info):
        asked.append(1)
        time.sleep(0.3 if len(asked) < 3 else 1e6)
        return 0
    return act
"""


@pytest.mark.slow
def test_a_policy_that_never_answers_is_ended(tmp_path: Path) -> None:
    with PolicyProcess(policy_file(tmp_path, SLOW), limit_s=2.0) as player:
        runner, steps = runner_of(player), []
        with pytest.raises(PolicyError, match="step 2: expected an answer within 2 s, found none"):
            runner.run(case(), steps.append)
        assert steps[-1] == 2
        assert player._process.wait(1.0)  # it does not go on
        with pytest.raises(PolicyProcessError, match="its process died"):
            player.ask("act", None, None)


COMPILES_ONCE = """
import gc, json, time
from multiprocessing.connection import Connection

def policy(robot, seed):
    pipe = next(each for each in gc.get_objects() if isinstance(each, Connection))
    asked = []
    def act(observation, info):
        asked.append(1)
        for busy in [True, False][:2 * (len(asked) == 1)]:
            pipe.send_bytes(json.dumps({"compiling": busy}).encode())
            time.sleep(1.5 * busy)
        time.sleep(1e6 * (len(asked) == 3))
        return 0
    return act
"""


@pytest.mark.slow
def test_compiling_does_not_count_as_time_of_an_answer(tmp_path: Path) -> None:
    with PolicyProcess(policy_file(tmp_path, COMPILES_ONCE), limit_s=1.0) as player:
        player.ask("new", None, 0)
        assert [player.ask("act", None, None)["action"] for _ in range(2)] == [0, 0]
        with pytest.raises(PolicyProcessError, match="expected an answer within 1 s"):
            player.ask("act", None, None)


def test_arrays_come_through_shared_memory_as_they_were() -> None:
    memory, descriptor = _new_shared()
    os.close(descriptor)
    rng = np.random.default_rng(1)
    large = rng.random((300, 200))
    arrays = {"map": large[::2, ::3], "flags": large > 0.5, "pose": large[0, :3]}
    question = ("act", arrays, (large.astype(np.float32),))
    sent = _share_arrays(question, memory)
    assert not isinstance(sent[1]["map"], np.ndarray)
    assert isinstance(sent[1]["pose"], np.ndarray)
    kind, fields, (single,) = _copy_shared(sent, memory)
    assert kind == "act"
    for key, array in arrays.items():
        assert np.array_equal(fields[key], array)
        assert fields[key].dtype == array.dtype
    assert np.array_equal(single, question[2][0])
    huge = np.zeros(SHARED_BYTES + 1, np.uint8)
    assert _share_arrays(huge, memory) is huge


def test_an_environment_that_something_changed_ends_the_episode() -> None:
    trace = Trace()
    trace.add(3, 1.0, {"coverage": 0.5, "collisions": 0})
    with pytest.raises(ValueError, match="a coverage of 114"):
        trace.add(4, 1.1, {"coverage": 1.14})
    with pytest.raises(ValueError, match="reset the environment"):
        trace.add(0, 0.0, {"coverage": 0.1})
    held: list[EpisodeRunner] = []
    reset = at_step(2, lambda: held[0].env.reset(seed=4) and 0)
    held.append(EpisodeRunner(TINY, named(reset), [CORRIDOR]))
    with pytest.raises(PolicyError, match="reset the environment in the middle"):
        held[0].run(case())


MASKED = """
from houseexpo.pseudoslam.agents.protocol import Interface

class policy:
    interface = Interface(action_mask=True)

    def __init__(self, robot, seed):
        assert robot.observation_space["action_mask"].n == 3

    def __call__(self, observation, info):
        assert not info["collided"]
        return 0 if observation["action_mask"][0] else 1
"""


def test_a_policy_gets_the_mask_of_motions_that_it_asks_for(tmp_path: Path) -> None:
    with PolicyProcess(policy_file(tmp_path, MASKED)) as player:
        outcome = runner_of(player).run(case())
    assert outcome.values["coverage"] > 0.9
