"""``houseexpo ros`` against a node of real rclpy with Fast DDS, in another process on this machine."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.exports.rasters import WALL, occupancy_picture
from tests.builders.needs import need
from tests.builders.ros.judge import ended, judged, started, surroundings

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


@pytest.fixture(autouse=True)
def _needs() -> None:
    need(modules=["cyclonedds", "rclpy"], how="make ros")


@pytest.mark.slow
def test_rclpy_hears_drives_and_puts_the_robot(tmp_path: Path) -> None:
    HALL.save(tmp_path / "hall.json")
    process = started(tmp_path / "hall.json", "--start", "2,2", "--map", "slam")
    try:
        found = judged(12.0)
    finally:
        said = ended(process)
    topics = found["topics"]
    assert topics["/clock"] == ["rosgraph_msgs/msg/Clock"]
    assert sorted(topics["/cmd_vel"]) == [TWIST, STAMPED]
    assert topics["/tf"] == topics["/tf_static"] == ["tf2_msgs/msg/TFMessage"]
    assert found["frames"] == ["odom", "base_footprint", "base_scan"]
    assert found["gaps_ns"] == [20_000_000]  # 50 a second, none lost
    first, step, beams = found["angles"]
    angles = first + step * np.arange(beams)
    assert np.allclose(found["scan_still"], to_walls(2.0, 2.0, angles), atol=0.01)
    assert np.allclose(found["scan_last"], to_walls(1.0, 1.0, angles), atol=0.01)  # it was put there
    assert 0.4 < found["odom_x"] < 1.0  # 4 s at 0.2 m/s, less what it took to find each other
    assert found["map"][3] == found["map"][0] * found["map"][1] > 0
    assert found["events"] == ["robot 1 was put at (1.00, 1.00) m"]
    assert "robot 1 was put at" in said


def to_walls(x: float, y: float, angles: np.ndarray[Any, np.dtype[np.float64]]) -> list[float]:
    """Return the way in each direction to the walls of the hall, which is 8 x 4 m."""
    ways = []
    for angle in angles.tolist():
        right, up = math.cos(angle), math.sin(angle)
        across = (8.0 - x) / right if right > 1e-12 else -x / right if right < -1e-12 else math.inf
        along = (4.0 - y) / up if up > 1e-12 else -y / up if up < -1e-12 else math.inf
        ways.append(min(across, along))
    return ways


@pytest.mark.slow
def test_rclpy_chooses_a_house_and_gets_its_map_over_topics(tmp_path: Path) -> None:
    large = FloorPlan("large", [(0, 0), (0, 20), (30, 20), (30, 0)], 1, {})
    for plan in (HALL, large):
        plan.save(tmp_path / f"{plan.id}.json")
    process = started(tmp_path, "--plan", "hall", "--map", "house")
    try:
        code = "from tests.builders.ros.judge import move; move('large')"
        words = [sys.executable, "-c", code]
        found = subprocess.run(words, env=surroundings(), capture_output=True, text=True, timeout=120, check=True)
    finally:
        said = ended(process)
    assert json.loads(found.stdout.splitlines()[-1]) == [size_and_walls(HALL), size_and_walls(large)]
    assert "house large" in said


def size_and_walls(plan: FloorPlan) -> list[int]:
    """Return the width, height and occupied cells of the map of a plan, cells of 4 cm."""
    pixels, _ = occupancy_picture(plan, 0.04, 0.04, "world")
    return [pixels.shape[1], pixels.shape[0], int((pixels == WALL).sum())]


@pytest.mark.slow
def test_ctrl_c_leaves_no_process_and_bad_words_are_told(tmp_path: Path) -> None:
    HALL.save(tmp_path / "hall.json")
    said = ended(started(tmp_path / "hall.json", "--robots", "2", "--people", "1"))
    assert "simulated seconds" in said
    assert "ended after 0.0 simulated seconds" in ended(started(tmp_path / "hall.json", "--stepped"))
    words = [sys.executable, "-m", "houseexpo", "ros", str(tmp_path / "hall.json"), "--start", "1,1", "--start", "1,1"]
    refused = subprocess.run(words, env=surroundings(), capture_output=True, text=True, timeout=120, check=False)
    assert refused.returncode == 2
    assert "starts: expected at most one for each of 1 robots, found 2" in refused.stderr + refused.stdout
    assert "Traceback" not in refused.stderr


@pytest.mark.slow
def test_a_second_simulator_in_the_same_domain_is_refused(tmp_path: Path) -> None:
    HALL.save(tmp_path / "hall.json")
    process = started(tmp_path / "hall.json")
    try:
        words = [sys.executable, "-m", "houseexpo", "ros", str(tmp_path / "hall.json"), "--for", "5"]
        refused = subprocess.run(words, env=surroundings(), capture_output=True, text=True, timeout=120, check=False)
    finally:
        ended(process)
    assert refused.returncode == 2
    assert "another simulator publishes on /houseexpo/event already; end it, or use another" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.slow
def test_other_types_and_other_publishers_are_told_and_nothing_stops(tmp_path: Path) -> None:
    HALL.save(tmp_path / "hall.json")
    process = started(tmp_path / "hall.json", "--start", "2,2")
    try:
        code = "from tests.builders.ros.judge import disturb; disturb(6.0)"
        subprocess.run([sys.executable, "-c", code], env=surroundings(), timeout=60, check=True)
    finally:
        said = ended(process)
    flat = " ".join(said.split())
    assert "/scan: a subscriber expects nav_msgs/msg/Odometry, but its messages are sensor_msgs/msg/LaserScan" in flat
    assert f"/cmd_vel: expected messages of {TWIST} or {STAMPED}, but others publish std_msgs/msg/String" in flat
    assert "/odom: another program publishes on it too; end it, or use another --domain" in flat
    assert float(flat.split("ended after ")[1].split()[0]) > 6.0


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_subscriber_that_stands_still_or_dies_stops_nothing(tmp_path: Path, number: signal.Signals) -> None:
    HALL.save(tmp_path / "hall.json")
    process = started(tmp_path / "hall.json", "--start", "2,2", "--map", "slam")
    began = time.monotonic()
    code = "from tests.builders.ros.judge import listen; listen()"
    listener = subprocess.Popen([sys.executable, "-c", code], env=surroundings(), stdout=subprocess.PIPE, text=True)
    try:
        assert listener.stdout is not None
        assert listener.stdout.readline() == "heard\n"
        listener.send_signal(number)
        time.sleep(8.0)
        passed_s = time.monotonic() - began
    finally:
        said = ended(process)
        listener.kill()
        listener.communicate(timeout=30)
    assert float(said.split("ended after ")[1].split()[0]) > 0.9 * passed_s
