"""A robot behind a rosbridge: a server that follows rosbridge v2.0 to the letter, in this process."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from houseexpo import FloorPlan
from houseexpo.commands.ros import ros as command
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.io.ros_messages import FIELDS, Message, empty_fields
from houseexpo.pseudoslam.ros import bridge as bridge_module
from houseexpo.pseudoslam.ros.bridge import Bridge
from houseexpo.pseudoslam.ros.fleet import Fleet
from houseexpo.pseudoslam.ros.node import COMMANDS, Node, NodeConfig
from tests.builders.ros.rosbridge import Rosbridge

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
CONFIG = SimulatorConfig(laser=LaserConfig(3.0, 360.0, 10.0), noise=NoiseConfig(drop_out=0.2))
ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}


class Robot:
    """A node on a bridge, running in a thread of its own."""

    def __init__(self, server: Rosbridge, **config: Any) -> None:
        self.said: list[str] = []
        self.bridge = Bridge(server.url, warn=self.said.append)
        fleet = Fleet(HALL, CONFIG, starts=[(2.0, 2.0, 0.5)])
        self.node = Node(self.bridge, fleet, NodeConfig(commands=COMMANDS[:1], maps="house", **config))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self.node.run, kwargs={"until": self._ended.is_set})
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join(10.0)
        self.bridge.close()


@pytest.fixture
def server() -> Iterator[Rosbridge]:
    with Rosbridge() as made:
        yield made


@pytest.fixture
def robot(server: Rosbridge) -> Iterator[Robot]:
    made = Robot(server)
    try:
        server.wait(lambda: len(server.heard.get("/odom", [])) > 3 and "/scan" in server.heard)
        yield made
    finally:
        made.close()


def test_all_topics_are_there_and_nothing_breaks_the_protocol(server: Rosbridge, robot: Robot) -> None:
    assert server.topics["/scan"] == ("sensor_msgs/msg/LaserScan", False)
    assert server.topics["/map"] == ("nav_msgs/msg/OccupancyGrid", True)
    assert server.topics["/tf_static"] == ("tf2_msgs/msg/TFMessage", True)
    assert server.subscribed["/cmd_vel"] == "geometry_msgs/msg/Twist"
    assert server.faults == []
    robot.close()
    server.wait(lambda: not server.topics)
    assert robot.said == []


def test_messages_have_the_fields_of_their_types(server: Rosbridge, robot: Robot) -> None:
    for topic, (kind, _) in list(server.topics.items()):
        for message in server.heard.get(topic, [])[:3]:
            assert message.keys() == FIELDS[kind].keys(), topic
    grid = server.heard["/map"][0]
    assert len(grid["data"]) == grid["info"]["width"] * grid["info"]["height"]
    scan = server.heard["/scan"][0]
    ranges = np.array(scan["ranges"])
    assert len(ranges) == 36
    assert 0 < np.mean(ranges == 0.0) < 0.6  # lost beams
    assert np.isinf(ranges).any()  # beyond 3 m
    hit = ranges[np.isfinite(ranges) & (ranges > 0.0)]
    assert (hit.min(), hit.max()) == (pytest.approx(2.0, abs=0.05), pytest.approx(3.0, abs=0.4))


def test_a_velocity_moves_the_robot_and_a_pose_puts_it(server: Rosbridge, robot: Robot) -> None:
    server.publish("/cmd_vel", {"linear": {**ZERO, "x": 0.5}, "angular": ZERO})
    server.wait(lambda: server.heard["/odom"][-1]["pose"]["pose"]["position"]["x"] > 0.1)
    pose = {"position": {**ZERO, "x": 5.0, "y": 1.0}, "orientation": {**ZERO, "w": 1.0}}
    server.publish("/initialpose", {"header": {"frame_id": "map"}, "pose": {"pose": pose}})
    server.wait(lambda: "/houseexpo/event" in server.heard)
    assert server.heard["/houseexpo/event"] == [{"data": "robot 1 was put at (5.00, 1.00) m"}]


HOSTILE = (
    "[" * 200_000,
    '{"op": "publish", "topic": ["/cmd_vel"], "msg": {}}',
    '{"op": "status", "level": ["error"]}',
    '{"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 1' + 400 * "0" + "}}}",
    '{"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 1' + 5000 * "0" + "}}}",
)


def test_hostile_messages_cost_themselves_and_the_robot_listens_on(server: Rosbridge, robot: Robot) -> None:
    for hostile in HOSTILE:
        server.say(hostile)
    server.publish("/cmd_vel", {"linear": {**ZERO, "x": 0.5}, "angular": ZERO})
    server.wait(lambda: server.heard["/odom"][-1]["pose"]["pose"]["position"]["x"] > 0.1)
    assert robot.said
    assert "begins again" not in "".join(robot.said)


def test_a_thread_that_ends_by_an_error_says_so_and_begins_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bridge_module, "_RETRY_S", 0.01)
    said, times = list[str](), list[int]()

    def work() -> None:
        times.append(1)
        if len(times) < 3:
            raise RuntimeError("as told")

    thread = bridge_module._start_lasting_thread(work, "listening", closed=threading.Event(), warn=said.append)
    thread.join(5.0)
    assert not thread.is_alive()
    assert len(times) == 3
    assert said == ["listening: RuntimeError: as told; it begins again in 0.01 s"] * 2


def test_what_does_not_fit_is_told_and_left_out(server: Rosbridge, robot: Robot) -> None:
    for message in ("ahead", {"linear": {"x": "fast"}}, {"speed": 1.0}, {"linear": {"x": True}}):
        server.publish("/cmd_vel", message)  # type: ignore[arg-type]
    server.publish("/houseexpo/step", {"data": -1})
    server.say("no JSON")
    server.say('{"op": "status", "level": "error", "msg": "no such package"}')
    server.say('{"op": "dance"}')
    server.say('["publish"]')
    server.wait(lambda: len(robot.said) >= 7)
    told = "\n".join(robot.said)
    assert "/cmd_vel: msg: expected an object of geometry_msgs/msg/Twist, found 'ahead'; it was left out" in told
    assert "/cmd_vel: msg.linear.x: expected float64, found 'fast'" in told
    assert "/cmd_vel: msg.linear.x: expected float64, found True" in told
    assert "/cmd_vel: msg: expected fields of geometry_msgs/msg/Twist, found 'speed'" in told
    assert "/houseexpo/step: msg.data: expected uint32, found -1" in told
    assert "expected JSON, found 'no JSON'" in told
    assert "the rosbridge reports: no such package" in told
    server.publish("/houseexpo/reset", {})
    server.wait(lambda: {"data": "reset"} in server.heard.get("/houseexpo/event", []))  # it is still there


def test_a_rosbridge_that_goes_away_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bridge_module, "_RETRY_S", 0.05)
    with Rosbridge() as first:
        robot = Robot(first)
        first.wait(lambda: "/odom" in first.heard)
        port = int(first.url.rsplit(":", 1)[1])
    try:
        ticks = robot.node.elapsed_s
        deadline = time.monotonic() + 20.0
        while robot.node.elapsed_s < ticks + 0.2:
            assert time.monotonic() < deadline, "the simulation stands still"
            time.sleep(0.01)
        with Rosbridge(port) as second:
            second.wait(lambda: len(second.heard.get("/odom", [])) > 3)
            assert second.heard["/map"]  # latched: it did not change since
            assert second.heard["/tf_static"]
            second.publish("/cmd_vel", {"linear": {**ZERO, "x": 0.5}, "angular": ZERO})
            second.wait(lambda: second.heard["/odom"][-1]["twist"]["twist"]["linear"]["x"] > 0.4)
            assert second.faults == []
            robot.close()
    finally:
        robot.close()
    assert "the connection broke: " in robot.said[0]
    assert robot.said[-1].endswith("connected again")


def test_numbers_that_json_lacks() -> None:
    value = {"say": 'NaN and "Infinity"', "ranges": [math.inf, -math.inf, math.nan, 1.5]}
    said = bridge_module._json(value)
    assert json.loads(said, parse_constant=pytest.fail) == {
        "say": 'NaN and "Infinity"',
        "ranges": [math.inf, -math.inf, 0.0, 1.5],
    }


@pytest.mark.parametrize("kind", sorted(FIELDS))
def test_messages_come_back(kind: str) -> None:
    sent = bridge_module._object(kind, empty_fields(kind))
    found = bridge_module._fields(kind, json.loads(bridge_module._json(sent)), "msg")
    assert bridge_module._object(kind, found) == sent
    assert Message(kind, found).fields.keys() == FIELDS[kind].keys()


def test_what_cannot_be_reached_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(
        ConfigError, match=r"no rosbridge answers at ws://127.0.0.1:1: .*; start rosbridge_server there"
    ):
        Bridge("ws://127.0.0.1:1", warn=print)
    for url in ("localhost:9090", "http://localhost:9090", "ws://"):
        with pytest.raises(ConfigError, match="expected an address such as ws://localhost:9090"):
            Bridge(url, warn=print)
    HALL.save(tmp_path / "hall.json")
    app = typer.Typer()
    app.command()(command)
    for words in (["--stamped"], ["--bridge", "ws://localhost:1", "--local"]):
        with pytest.raises(ConfigError, match=r"leave --domain and --local out|--stamped is for --bridge"):
            CliRunner().invoke(app, [str(tmp_path / "hall.json"), *words], catch_exceptions=False)
    monkeypatch.setitem(sys.modules, "websockets.sync.client", None)
    with pytest.raises(MissingDependencyError, match=r"a rosbridge needs websockets, .*\[bridge\]"):
        Bridge("ws://localhost:9090", warn=print)


@pytest.mark.slow
def test_the_command_ends_by_itself_and_leaves_nothing(server: Rosbridge, tmp_path: Path) -> None:
    HALL.save(tmp_path / "hall.json")
    words = [
        sys.executable,
        "-m",
        "houseexpo",
        "ros",
        str(tmp_path / "hall.json"),
        "--bridge",
        server.url,
        "--for",
        "1",
    ]
    done = subprocess.run([*words, "--stamped"], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "ended after 1.0 simulated seconds" in done.stdout
    assert server.subscribed["/cmd_vel"] == "geometry_msgs/msg/TwistStamped"
    assert len(server.heard["/clock"]) == 51
    assert server.faults == []
