"""Journey 8: a policy that the benchmark has measured drives in ``houseexpo ros`` and in the browser, the same way.

The commands are those of docs/pseudoslam/ros.md, "Let a policy drive", and of docs/guide-drive.md, "Your own policy".
"""

from __future__ import annotations

import csv
import io
import math
import shlex
import shutil
import subprocess
import sys
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from houseexpo import open_dataset
from houseexpo.pseudoslam.benchmark.result import decode_actions, read_result
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from tests.builders.needs import need
from tests.builders.training import write_split_huts
from tests.journeys.pages import ROOT, commands

ROS_PAGE, DRIVE_PAGE = "docs/pseudoslam/ros.md", "docs/guide-drive.md"
MINE = '''
import random

def policy(robot, seed):
    """Goes by chance, without a look at the map, so that only the same seed goes the same way."""
    chance = random.Random(seed)
    return lambda observation, info: None if info["steps"] >= 50 else chance.choice([0, 0, 1, 2])
'''


class Measured(NamedTuple):
    """An episode of the benchmark: where it was, what it did, and the poses (steps + 1, 3) on its way."""

    plan: str
    seed: int
    coverage: float
    steps: int
    poses: Any


def run(command: str, folder: Path) -> str:
    words = [sys.executable, "-m", *shlex.split(command)]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def measured(policy: str, folder: Path) -> Measured:
    """Run the page's benchmark of a policy; its actions, played in an environment, give the way."""
    plans = write_split_huts(folder)
    if policy == "mine.py":
        (folder / policy).write_text(MINE)
    elif policy == "policy.pt":
        need(modules=["torch", "stable_baselines3", "sb3_contrib"], how="make learn")
        shutil.copy(ROOT / "experiments/paper/exploration-0/policy.pt", folder)
    elif policy == "policy.onnx":
        need(modules=["torch", "stable_baselines3", "sb3_contrib", "onnx", "onnxruntime"], how="make learn")
        run(f"houseexpo export {ROOT / 'experiments/paper/exploration-0'} --to onnx --out .", folder)
    command = next(line for line in commands(ROS_PAGE, "shown.json", "text") if line.startswith("houseexpo benchmark"))
    run(command.replace("plans/demo", "huts").replace("frontier", policy), folder)
    result = read_result(folder / "shown.json")
    (name,), (seed,), (actions,) = result.episodes["plan"], result.episodes["seed"], result.actions  # type: ignore[misc]
    env = ExplorationEnv(open_dataset(plans), find_track("quality").config, success_coverage=0.99)
    env.reset(seed=seed, options={"plan_id": name})
    poses = [env.simulator.pose(env.state)]
    for action in decode_actions(actions):
        _, _, _, _, info = env.step(action)
        poses.append(env.simulator.pose(env.state))
    (coverage,) = result.column("coverage")
    assert coverage is not None
    assert info["coverage"] == pytest.approx(coverage, abs=1e-4)
    return Measured(name, seed, coverage, len(poses) - 1, np.array(poses))


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["frontier", "mine.py", "policy.pt", "policy.onnx"])
def test_in_ros_it_goes_where_it_went_in_the_benchmark(policy: str, tmp_path: Path) -> None:
    need(modules=["cyclonedds"], how="make ros")
    from houseexpo.pseudoslam.io.ros_messages import TOPICS
    from houseexpo.pseudoslam.ros.dds import Participant
    from houseexpo.pseudoslam.ros.node import COMMANDS, EVENTS
    from tests.builders.ros.judge import DOMAIN

    found = measured(policy, tmp_path)
    (shown,) = (line for line in commands(ROS_PAGE, "shown.json", "text") if "--plan ID" in line)
    shown = shown.replace("plans/demo", "huts").replace("frontier", policy)
    shown = shown.replace("ID", found.plan).replace("SEED", str(found.seed))
    (tmp_path / "random.py").write_text("raise SystemExit('nobody asked for this file')")
    steps = min(found.steps, 120)
    kinds = {f"/{name}": TOPICS[name].kind for name in ("odom", "scan", "map", "tf", "clock")}
    kinds |= {"/cmd_vel": COMMANDS[0], EVENTS: "std_msgs/msg/String"}
    heard: dict[str, list[Any]] = {topic: [] for topic in kinds}
    with closing(Participant(DOMAIN, local=True, warn=pytest.fail)) as network, ThreadPoolExecutor(1) as pool:
        listened = {topic: network.subscribe(topic, kind) for topic, kind in kinds.items()}
        words = f"{shown} --local --domain {DOMAIN} --rate 10 --speed 10 --for {steps * 0.5 + 0.1}"
        ended = pool.submit(run, words, tmp_path)
        last = False
        while not last:
            last = ended.done()
            time.sleep(0.05)
            for topic, messages in listened.items():
                heard[topic] += [message.fields for message in messages.take()]
        ended.result()
    assert all(heard.values())
    assert {message["angular"]["z"] for message in heard["/cmd_vel"]} - {0.0}

    (events,) = ([message["data"] for message in heard["/houseexpo/event"] if "is done" in message["data"]],)
    if steps == found.steps:
        assert f"{found.coverage:.1%} seen in {found.steps} steps" in events[0]
    x, y, heading = found.poses[0]
    for pose in (message["pose"]["pose"] for message in heard["/odom"]):  # relative to the start
        ahead, left = pose["position"]["x"], pose["position"]["y"]
        at = (
            x + ahead * math.cos(heading) - left * math.sin(heading),
            y + ahead * math.sin(heading) + left * math.cos(heading),
        )
        assert np.hypot(*(found.poses[:, :2] - at).T).min() <= 0.151  # half a step from one of its places
    assert at == pytest.approx(tuple(found.poses[steps, :2]), abs=1e-5)


def test_the_page_names_what_a_result_has() -> None:
    (line,) = (line for line in (ROOT / ROS_PAGE).read_text().splitlines() if line.startswith("python -c"))
    assert all(f"e['{key}']" in line for key in ("plan", "seed", "coverage"))


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("policy", ["frontier", "mine.py", "policy.onnx"])
def test_in_the_browser_it_goes_where_it_went_in_the_benchmark(policy: str, tmp_path: Path) -> None:
    need(modules=["starlette", "playwright"], how="make browser")
    from houseexpo.commands.serve import _check_policies
    from tests.builders.browsing import visited
    from tests.builders.services import running, service_of

    found = measured(policy, tmp_path)
    (served,) = (line for line in commands(DRIVE_PAGE, "--policy", "text"))
    assert served == "houseexpo serve plans/demo --policy first-run/policy.pt"
    own = _check_policies([str(tmp_path / policy)] if "." in policy else [])
    (driver,) = own or [policy]
    with running(service_of(tmp_path / "huts", policies=own)) as address:
        where = f"/huts/drive?plan={found.plan}&seed={found.seed}&driver={driver}"
        with visited(address, f"{where}&pace=120", accept_downloads=True) as page:
            page.wait_for_selector(".panel[data-state=ended]", timeout=240_000)
            assert page.inner_text(".result-words") in {"The whole house is seen", "The explorer is done"}
            with page.expect_download() as download:
                page.click(".result .save")
            download.value.save_as(tmp_path / "saved.zip")
        with visited(address, f"{where}&pace=15") as page:  # a person takes over, and the policy goes on
            page.wait_for_selector(".panel[data-state=driving]", timeout=60_000)
            page.keyboard.down("ArrowLeft")
            page.wait_for_timeout(600)
            page.keyboard.up("ArrowLeft")
            page.wait_for_selector(".panel[data-state=ended]", timeout=120_000)
    with zipfile.ZipFile(tmp_path / "saved.zip") as saved:
        rows = list(csv.DictReader(io.StringIO(saved.read("trajectory.csv").decode())))
    poses = np.array([[float(row[key]) for key in ("x_m", "y_m", "heading_rad")] for row in rows])
    assert np.allclose(poses, found.poses, atol=1e-6)
