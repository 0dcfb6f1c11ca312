"""What a node publishes and how it answers requests, over a graph that only records."""

from __future__ import annotations

import math
import signal
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.commands.ros import _watch_signals
from houseexpo.errors import ConfigError
from houseexpo.exports.rasters import WALL, occupancy_picture
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig
from houseexpo.pseudoslam.io.poses import Pose
from houseexpo.pseudoslam.io.ros_messages import FIELDS, Message, TopicQuality, heading_from_quaternion
from houseexpo.pseudoslam.ros import node as node_module
from houseexpo.pseudoslam.ros.dds import Subscription
from houseexpo.pseudoslam.ros.fleet import Fleet
from houseexpo.pseudoslam.ros.node import Node, NodeConfig

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
OTHER = FloorPlan("other", [(0, 0), (0, 3), (3, 3), (3, 0)], 1, {})
CONFIG = SimulatorConfig(laser=LaserConfig(12.0, 360.0, 10.0), noise=NoiseConfig(odometry_way=0.3))
TWIST, PUT = "geometry_msgs/msg/Twist", "geometry_msgs/msg/PoseWithCovarianceStamped"


class Recorded:
    """A graph without a network: keeps what is published, hands in what a test sends."""

    def __init__(self) -> None:
        self.heard: dict[str, list[dict[str, Any]]] = {}
        self.qualities: dict[str, TopicQuality] = {}
        self._inward: dict[tuple[str, str], Subscription] = {}

    def advertise(self, topic: str, kind: str, quality: TopicQuality) -> None:
        assert kind in FIELDS
        self.heard[topic], self.qualities[topic] = [], quality

    def publish(self, topic: str, message: Message) -> None:
        self.heard[topic].append(message.fields)

    def has_subscribers(self, topic: str) -> bool:
        return topic in self.heard

    def subscribe(self, topic: str, kind: str, quality: TopicQuality | None = None) -> Subscription:
        assert quality is None
        return self._inward.setdefault((topic, kind), Subscription(kind))

    def send(self, topic: str, kind: str, **fields: Any) -> None:
        self._inward[topic, kind].add(fields)

    def look(self) -> None:
        """There is nobody else."""

    @property
    def events(self) -> list[str]:
        return [fields["data"] for fields in self.heard["/houseexpo/event"]]


def made(config: NodeConfig | None = None, robots: int = 1, **given: Any) -> tuple[Recorded, Node]:
    graph = Recorded()
    starts = [(2.0, 2.0, 0.5), (6.0, 2.0, 0.0)][:robots]
    fleet = Fleet(HALL, CONFIG, robots=robots, starts=starts)
    return graph, Node(graph, fleet, config or NodeConfig(), **given)


def drive(graph: Recorded, ahead: float, turning: float = 0.0, topic: str = "/cmd_vel") -> None:
    graph.send(topic, TWIST, linear={"x": ahead, "y": 0.0, "z": 0.0}, angular={"x": 0.0, "y": 0.0, "z": turning})


def put(graph: Recorded, x: float, y: float, frame: str = "map") -> None:
    pose = {"position": {"x": x, "y": y, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    graph.send("/initialpose", PUT, header={"frame_id": frame}, pose={"pose": pose})


def placed_in(parent: Pose, transform: dict[str, Any]) -> Pose:
    """Return the pose of a child frame, by plain trigonometry."""
    x, y, heading = parent
    moved, turned = transform["translation"], heading_from_quaternion(transform["rotation"])
    cos, sin = math.cos(heading), math.sin(heading)
    return x + moved["x"] * cos - moved["y"] * sin, y + moved["x"] * sin + moved["y"] * cos, heading + turned


def test_the_frames_lead_to_the_true_pose_whatever_the_wheels_say() -> None:
    graph, node = made()
    for _ in range(40):
        drive(graph, 0.4, 0.3)
        node.tick()
    to_odom, to_base = (part["transform"] for part in graph.heard["/tf"][-1]["transforms"])
    assert placed_in(placed_in((0.0, 0.0, 0.0), to_odom), to_base) == pytest.approx(node.fleet.pose(0), abs=1e-9)
    assert graph.heard["/odom"][-1]["pose"]["pose"]["position"]["x"] == node.fleet.odometry(0)[0]
    assert to_odom["translation"]["x"] != pytest.approx(2.0, abs=1e-4)  # the wheels have drifted


def test_a_localisation_of_others_is_left_its_transform() -> None:
    graph, node = made(NodeConfig(localised=False, static=False))
    node.tick()
    assert [part["child_frame_id"] for part in graph.heard["/tf"][-1]["transforms"]] == ["base_footprint"]
    assert "/tf_static" not in graph.heard


def test_rates_and_stamps() -> None:
    graph, node = made(NodeConfig(scan_hz=5.0))
    for _ in range(100):  # 2 s
        node.tick()
    clocks = [fields["clock"]["sec"] * 10**9 + fields["clock"]["nanosec"] for fields in graph.heard["/clock"]]
    assert clocks == [10**9 + k * 20_000_000 for k in range(101)]
    assert len(graph.heard["/scan"]) == 11
    assert graph.qualities["/tf_static"].latched
    assert not graph.qualities["/scan"].latched


def test_a_robot_stops_a_second_after_the_last_velocity() -> None:
    graph, node = made()
    drive(graph, 0.2)
    for _ in range(200):
        node.tick()
    x, y, _ = node.fleet.pose(0)
    assert math.hypot(x - 2.0, y - 2.0) == pytest.approx(0.2, abs=0.01)


def test_several_robots_have_topics_of_their_own() -> None:
    graph, node = made(robots=2)
    drive(graph, 0.5, topic="/robot2/cmd_vel")
    node.tick()
    assert (node.fleet.velocity(0).ahead_m_s, node.fleet.velocity(1).ahead_m_s) == (0.0, pytest.approx(0.5))
    assert "/robot1/scan" in graph.heard
    assert "/scan" not in graph.heard


@pytest.mark.parametrize(
    ("ahead", "turning", "told"),
    [
        (math.nan, 0.0, "a velocity that is no number was passed over"),
        (0.0, math.inf, "a velocity that is no number was passed over"),
        (11.0, 0.0, "expected at most 10 m/s and 30 rad/s, found 11 and 0 m/s, 0 rad/s"),
    ],
)
def test_velocities_that_cannot_be_are_told_and_passed_over(ahead: float, turning: float, told: str) -> None:
    graph, node = made()
    drive(graph, ahead, turning)
    node.tick()
    assert told in graph.events[0]
    assert node.fleet.pose(0) == (2.0, 2.0, 0.5)


def test_a_robot_is_put_and_forgets_the_velocity_of_the_other_place() -> None:
    graph, node = made()
    drive(graph, 0.5)
    put(graph, 5.0, 1.0)
    for _ in range(10):
        node.tick()
    assert node.fleet.pose(0) == pytest.approx((5.0, 1.0, 0.0))
    assert graph.events == ["robot 1 was put at (5.00, 1.00) m"]


def test_a_pose_that_cannot_be_is_told_and_nothing_moves() -> None:
    graph, node = made()
    put(graph, 5.0, 1.0, frame="odom")
    node.tick()
    assert "expected a pose in the frame 'map', found 'odom'" in graph.events[-1]
    graph, node = made()
    put(graph, 9.0, 1.0)
    node.tick()
    assert "does not fit at (9, 1) m in plan 'hall'" in graph.events[-1]
    assert node.fleet.pose(0) == (2.0, 2.0, 0.5)


def test_reset_and_another_house() -> None:
    graph, node = made(house=lambda name: Fleet({"other": OTHER}[name], CONFIG, starts=[(1.0, 1.0, 0.0)]))
    drive(graph, 0.5)
    node.tick()
    graph.send("/houseexpo/reset", "std_msgs/msg/Empty")
    node.tick()
    assert node.fleet.pose(0) == (2.0, 2.0, 0.5)
    graph.send("/houseexpo/house", "std_msgs/msg/String", data="other")
    node.tick()
    assert node.fleet.plan.id == "other"
    assert graph.events == ["reset", "house other"]


def test_an_unknown_house_is_told_and_the_old_one_stays() -> None:
    def refuse(name: str) -> Fleet:
        raise ConfigError(f"house {name!r}: there is no such plan")

    graph, node = made(house=refuse)
    graph.send("/houseexpo/house", "std_msgs/msg/String", data="nowhere")
    node.tick()
    assert graph.events == ["/houseexpo/house: house 'nowhere': there is no such plan"]
    assert node.fleet.plan.id == "hall"


def test_stepped_time_stands_still_until_ticks_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    graph, node = made(NodeConfig(stepped=True))
    waits = iter([lambda: graph.send("/houseexpo/step", "std_msgs/msg/UInt32", data=7)])

    def wait(_seconds: float) -> None:
        act = next(waits, None)
        if act is None:
            raise KeyboardInterrupt
        act()

    monkeypatch.setattr(node_module.time, "sleep", wait)
    with pytest.raises(KeyboardInterrupt):
        node.run()
    assert node.now_s == pytest.approx(1.0 + 7 * 0.02)


class Wall:
    """A wall clock that moves only by sleeping, by ``work_s`` at each look, and in jumps."""

    def __init__(self, work_s: float = 0.0) -> None:
        self.now_s, self.work_s, self.sleeps, self.jumps = 100.0, work_s, 0, dict[int, float]()

    def monotonic(self) -> float:
        self.now_s += self.work_s
        return self.now_s

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.sleeps += 1
        self.now_s += seconds + self.jumps.get(self.sleeps, 0.0)

    def time_ns(self) -> int:
        return round(self.now_s * 1e9)


@pytest.mark.parametrize(("speed", "passed_s"), [(1.0, 4.0), (8.0, 0.5), (0.5, 8.0), (math.inf, 0.0)])
def test_time_runs_at_the_speed_asked_for(monkeypatch: pytest.MonkeyPatch, speed: float, passed_s: float) -> None:
    _, node = made(NodeConfig(speed=speed))
    wall = Wall()
    monkeypatch.setattr(node_module, "time", wall)
    node.run(4.0)
    assert node.now_s == pytest.approx(5.0)
    assert wall.now_s - 100.0 == pytest.approx(passed_s)


def test_after_the_machine_slept_time_goes_on_without_a_burst(monkeypatch: pytest.MonkeyPatch) -> None:
    _, node = made()
    wall = Wall()
    wall.jumps[50] = 3600.0
    monkeypatch.setattr(node_module, "time", wall)
    node.run(4.0)
    assert wall.now_s - 100.0 - 3600.0 == pytest.approx(4.0, abs=0.1)
    assert wall.sleeps >= 198


def test_on_a_slow_machine_time_runs_slowly_and_every_tick_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    graph, node = made()
    monkeypatch.setattr(node_module, "time", Wall(work_s=0.05))
    node.run(2.0)
    clocks = [fields["clock"]["sec"] * 10**9 + fields["clock"]["nanosec"] for fields in graph.heard["/clock"]]
    assert clocks == [10**9 + k * 20_000_000 for k in range(101)]


def test_the_map_of_the_house_is_the_one_that_export_writes() -> None:
    graph, node = made(NodeConfig(maps="house"))
    (grid,) = graph.heard["/map"]
    for _ in range(60):
        node.tick()
    assert len(graph.heard["/map"]) == 1  # it does not change
    pixels, frame = occupancy_picture(HALL, 0.04, 0.04, "world")
    data = grid["data"].reshape(grid["info"]["height"], grid["info"]["width"])
    assert np.array_equal(data[::-1] == 100, pixels == WALL)
    assert (grid["info"]["origin"]["position"]["x"], grid["info"]["origin"]["position"]["y"]) == frame.origin_m


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_a_second_one_interrupts_and_handlers_come_back(number: signal.Signals) -> None:
    _, node = made()
    before = signal.getsignal(number)
    with _watch_signals() as is_told:
        assert not is_told()
        signal.raise_signal(number)
        assert is_told()
        node.run(until=is_told)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert signal.getsignal(number) is before
    assert node.elapsed_s == 0.0


def test_configurations_that_cannot_be_are_refused() -> None:
    with pytest.raises(ConfigError, match="scan-hz: expected a number above 0, found 0"):
        NodeConfig(scan_hz=0.0)
    with pytest.raises(ConfigError, match="speed: expected a number above 0, or inf, found nan"):
        NodeConfig(speed=math.nan)
    with pytest.raises(ConfigError, match="time that is stepped cannot be the wall clock's"):
        NodeConfig(stepped=True, wall_time=True)
