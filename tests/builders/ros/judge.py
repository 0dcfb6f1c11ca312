"""``houseexpo ros`` in a process of its own, and a node of real rclpy that judges it in another.

The judge drives the robot, and prints what it heard as JSON: ``python -m tests.builders.ros.judge SECONDS``, with
ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE set.
"""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

DOMAIN = 77


def surroundings() -> dict[str, str]:
    """Return the environment of both sides: only this machine, and a domain of their own for each test process."""
    return {
        **os.environ,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(DOMAIN + os.getpid() % 100),
    }


def started(plan: Path, *options: str) -> subprocess.Popen[str]:
    """Start the command; return when it says that the robots are there."""
    words = [sys.executable, "-m", "houseexpo", "ros", str(plan), *options]
    process = subprocess.Popen(words, env=surroundings(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    said = ""
    while "Ctrl-C ends it" not in said:
        line = process.stdout.readline()
        assert line, said
        said += line
    return process


def ended(process: subprocess.Popen[str]) -> str:
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=30)
    assert process.returncode == 0, said
    return said


def judged(seconds: float) -> dict[str, Any]:
    """Run ``judge`` in a process of its own, beside what ``started`` runs, and return what it found."""
    words = [sys.executable, "-m", "tests.builders.ros.judge", str(seconds)]
    limit = seconds + 110.0
    done = subprocess.run(words, env=surroundings(), capture_output=True, text=True, timeout=limit, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def judge(seconds: float) -> dict[str, Any]:
    """Listen for ``seconds`` after the first clock; from a third on, drive ahead at 0.2 m/s; at two thirds, be put."""
    import rclpy
    from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
    from nav_msgs.msg import OccupancyGrid, Odometry
    from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import String

    rclpy.init()
    node = rclpy.create_node("judge")
    heard: dict[str, list[Any]] = {name: [] for name in ("clock", "odom", "scan", "map", "event")}
    late: dict[str, list[float]] = {name: [] for name in heard}

    def keep(name: str) -> Any:
        def heard_one(message: Any, info: dict[str, int]) -> None:
            heard[name].append(message)
            late[name].append((info["received_timestamp"] - info["source_timestamp"]) / 1e6)

        return heard_one

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(Clock, "clock", keep("clock"), 50)
    node.create_subscription(Odometry, "odom", keep("odom"), 50)
    node.create_subscription(LaserScan, "scan", keep("scan"), qos_profile_sensor_data)
    node.create_subscription(OccupancyGrid, "map", keep("map"), latched)
    node.create_subscription(String, "houseexpo/event", keep("event"), 10)
    drive = node.create_publisher(TwistStamped, "cmd_vel", 10)
    put = node.create_publisher(PoseWithCovarianceStamped, "initialpose", 10)
    waited = time.monotonic()
    while not heard["clock"] and time.monotonic() - waited < 60.0:
        rclpy.spin_once(node, timeout_sec=0.05)
    began, placed, odom_when_placed = time.monotonic(), False, 0.0
    scan_still: list[float] = []
    while (gone := time.monotonic() - began) < seconds:
        rclpy.spin_once(node, timeout_sec=0.02)
        if gone > seconds / 3 and not placed:
            if not scan_still and heard["scan"]:
                scan_still = list(heard["scan"][-1].ranges)
            message = TwistStamped()
            message.twist.linear.x = 0.2
            drive.publish(message)
        if gone > seconds * 2 / 3 and not placed:
            placed, odom_when_placed = True, heard["odom"][-1].pose.pose.position.x
            pose = PoseWithCovarianceStamped()
            pose.header.frame_id = "map"
            pose.pose.pose.position.x, pose.pose.pose.position.y = 1.0, 1.0
            pose.pose.pose.orientation.w = 1.0
            put.publish(pose)
    times = {name: [_stamp_ns(message) for message in heard[name]] for name in ("clock", "odom", "scan")}
    stamps = times["odom"]
    scan, grid = heard["scan"][-1], heard["map"][-1]
    infos = node.get_publishers_info_by_topic("/scan")
    return {
        "topics": {name: kinds for name, kinds in node.get_topic_names_and_types() if not name.startswith("/ro")},
        "counts": {name: len(messages) for name, messages in heard.items()},
        "gaps_ns": sorted({b - a for a, b in itertools.pairwise(stamps)}),
        "odom_x": odom_when_placed,
        "frames": [heard["odom"][-1].header.frame_id, heard["odom"][-1].child_frame_id, scan.header.frame_id],
        "scan_still": scan_still,
        "scan_last": list(scan.ranges),
        "angles": [scan.angle_min, scan.angle_increment, len(scan.ranges)],
        "map": [grid.info.width, grid.info.height, grid.info.resolution, len(grid.data)],
        "events": [message.data for message in heard["event"]],
        "missing": {name: _missing(found) for name, found in times.items()},
        "late_ms": {name: sorted(late[name]) for name in times},
        "reliability": [str(info.qos_profile.reliability) for info in infos],
    }


def _stamp_ns(message: Any) -> int:
    stamp = message.clock if hasattr(message, "clock") else message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _missing(stamps: list[int]) -> int:
    """Return how many stamps are missing in a row that should be evenly spaced."""
    gaps = [b - a for a, b in itertools.pairwise(stamps)]
    usual = sorted(gaps)[len(gaps) // 2]
    return sum(round(gap / usual) - 1 for gap in gaps)


def disturb(seconds: float) -> None:
    """Do on the robot's topics what does not fit: other types, and a second publisher."""
    import rclpy
    from nav_msgs.msg import Odometry
    from std_msgs.msg import String

    rclpy.init()
    node = rclpy.create_node("disturber")
    node.create_subscription(Odometry, "scan", lambda _: None, 10)
    told, second = node.create_publisher(String, "cmd_vel", 10), node.create_publisher(Odometry, "odom", 10)
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        told.publish(String(data="ahead"))
        second.publish(Odometry())
        rclpy.spin_once(node, timeout_sec=0.05)


def move(house: str) -> None:
    """Ask for another house on its topic; print the size and the occupied cells of each map that comes latched."""
    import rclpy
    from nav_msgs.msg import OccupancyGrid
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import String

    rclpy.init()
    node, came = rclpy.create_node("mover"), list[list[int]]()

    def heard(grid: Any) -> None:
        came.append([grid.info.width, grid.info.height, sum(cell == 100 for cell in grid.data)])

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(OccupancyGrid, "map", heard, latched)
    chosen = node.create_publisher(String, "houseexpo/house", 10)
    until = time.monotonic() + 60.0
    while len(came) < 2 and time.monotonic() < until:
        if came:
            chosen.publish(String(data=house))
        rclpy.spin_once(node, timeout_sec=0.5)
    sys.stdout.write(json.dumps(came) + "\n")


def listen() -> None:
    """Listen reliably until killed; print a line at the first message."""
    import rclpy
    from nav_msgs.msg import OccupancyGrid, Odometry
    from sensor_msgs.msg import LaserScan

    rclpy.init()
    node, said = rclpy.create_node("listener"), list[str]()

    def heard(_: Any) -> None:
        if not said:
            said.append("heard")
            sys.stdout.write("heard\n")
            sys.stdout.flush()

    for kind, topic in ((Odometry, "odom"), (LaserScan, "scan"), (OccupancyGrid, "map")):
        node.create_subscription(kind, topic, heard, 10)
    rclpy.spin(node)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(judge(float(sys.argv[1]))) + "\n")
