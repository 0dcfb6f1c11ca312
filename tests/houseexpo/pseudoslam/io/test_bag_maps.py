"""Bags played back: the map of a recorded run is that of the robot, and a bag made by hand gives the map drawn here."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.grids.robot_map import MapError, RobotMap, read_map
from houseexpo.pseudoslam import open_maps
from houseexpo.pseudoslam.agents.policies import make_policy
from houseexpo.pseudoslam.io.bag_maps import map_from_bag
from houseexpo.pseudoslam.io.record import record_episode
from tests.builders.commands import call
from tests.builders.needs import need
from tests.houseexpo.pseudoslam.io.test_bags import CONFIG, made


@pytest.fixture(autouse=True)
def _rosbags() -> None:
    need(modules=["rosbags.rosbag2"], how="pip install -e '.[bag]'")


Moved = tuple[str, float, str, str, tuple[float, float, float]]
"""A transform: topic, stamp, parent, child, and (x, y, yaw)."""


def bag(folder: Path, scans: list[dict[str, Any]], transforms: list[Moved]) -> Path:
    """Write a bag: scans with ``stamp``, ``ranges`` and other fields, and transforms."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types

    def header(stamp: float, frame: str) -> Any:
        time = types["builtin_interfaces/msg/Time"](int(stamp), round(stamp % 1 * 1e9))
        return types["std_msgs/msg/Header"](time, frame)

    path = folder / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics: dict[str, Any] = {}

        def write(topic: str, kind: str, stamp: float, message: Any) -> None:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(topics[topic], round(stamp * 1e9), store.serialize_cdr(message, kind))

        for topic, stamp, parent, child, (x, y, yaw) in transforms:
            turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
            way = types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](x, y, 0.0), turn)
            stamped = types["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, way)
            write(topic, "tf2_msgs/msg/TFMessage", stamp, types["tf2_msgs/msg/TFMessage"]([stamped]))
        for scan in scans:
            ranges = np.array(scan["ranges"], np.float32)
            message = types["sensor_msgs/msg/LaserScan"](
                header(scan["stamp"], scan.get("frame", "laser")),
                scan.get("first", 0.0),
                0.0,
                scan.get("step", math.pi / 2),
                0.0,
                0.1,
                scan.get("least", 0.1),
                scan.get("most", 5.0),
                ranges,
                np.zeros(0, np.float32),
            )
            write(scan.get("topic", "/scan"), "sensor_msgs/msg/LaserScan", scan["stamp"], message)
    return path


def at(found: RobotMap, x: float, y: float) -> int:
    """Return the occupancy at a point."""
    col = math.floor((x - found.origin[0]) / found.resolution_m)
    row = found.occupancy.shape[0] - 1 - math.floor((y - found.origin[1]) / found.resolution_m)
    return int(found.occupancy[row, col])


def test_a_recorded_run_gives_the_map_of_its_robot(tmp_path: Path) -> None:
    env = made(CONFIG)
    policy = make_policy("frontier", env, 0)
    record_episode(env, policy, None, steps=60, seed=3, bag=tmp_path / "run.mcap")
    own, found = read_map(tmp_path / "run.mcap"), map_from_bag(tmp_path / "run.mcap", 0.05)
    rows, cols = np.nonzero(own.occupancy >= 0)
    height = own.occupancy.shape[0]
    x = own.origin[0] + (cols + 0.5) * 0.05
    y = own.origin[1] + (height - rows - 0.5) * 0.05
    north = found.origin[1] + found.occupancy.shape[0] * found.resolution_m
    there = np.floor((north - y) / 0.05).astype(int), np.floor((x - found.origin[0]) / 0.05).astype(int)
    shape = found.occupancy.shape
    inside = (there[0] >= 0) & (there[0] < shape[0]) & (there[1] >= 0) & (there[1] < shape[1])
    assert inside.mean() > 0.97
    played = found.occupancy[there[0][inside], there[1][inside]]
    before = own.occupancy[rows[inside], cols[inside]]
    both = played >= 0
    assert both.mean() > 0.95
    assert ((played > 50) == (before > 50))[both].mean() > 0.97
    free_m2 = found.free.sum() * 0.05**2, own.free.sum() * 0.05**2
    assert free_m2[0] == pytest.approx(free_m2[1], rel=0.05)


def test_beams_are_placed_by_interpolated_and_static_transforms(tmp_path: Path) -> None:
    """The robot goes from (0, 0.04) to (2, 0.04) in 2 s; the laser is 0.5 m ahead and looks to the left."""
    transforms = [
        ("/tf", 0.0, "odom", "base", (0.0, 0.04, 0.0)),
        ("/tf", 2.0, "odom", "base", (2.0, 0.04, 0.0)),
        ("/tf_static", 0.0, "base", "laser", (0.5, 0.0, math.pi / 2)),
    ]
    found = map_from_bag(bag(tmp_path, [{"stamp": 1.0, "ranges": [2.02, math.inf]}], transforms), 0.1)
    assert at(found, 1.55, 2.05) == 100  # ahead of the laser, which is at (1.5, 0)
    assert at(found, 1.55, 1.0) == 0
    assert at(found, -3.4, 0.05) == 0  # 5 m to its left, where nothing is hit
    assert at(found, 0.0, 1.0) == -1


def test_what_is_hit_in_few_of_the_scans_is_free(tmp_path: Path) -> None:
    """A person stood in the beam in one scan of ten."""
    transforms = [("/tf", float(k), "map", "laser", (0.0, 0.0, 0.0)) for k in range(11)]
    scans = [{"stamp": k + 0.5, "ranges": [1.02 if k == 4 else 3.02]} for k in range(10)]
    found = map_from_bag(bag(tmp_path, scans, transforms), 0.1)
    assert at(found, 1.05, 0.05) == 0
    assert at(found, 3.05, 0.05) == 100


def test_ranges_that_say_nothing_are_passed_over(tmp_path: Path) -> None:
    transforms = [("/tf_static", 0.0, "map", "laser", (0.0, 0.0, 0.0))]
    scan = {"stamp": 1.0, "ranges": [2.02, math.nan, 0.05, 7.0]}
    found = map_from_bag(bag(tmp_path, [scan], transforms), 0.1)
    assert at(found, 2.05, 0.05) == 100
    assert at(found, 0.05, -4.9) == 0  # 7 m is beyond the laser's range
    assert (found.occupancy == 100).sum() == 1


@pytest.mark.parametrize(
    ("scans", "transforms", "topic", "said"),
    [
        ([], [("/tf", 0.0, "map", "laser", (0.0, 0.0, 0.0))], None, "expected one topic of type sensor_msgs"),
        ([{"stamp": 1.0, "ranges": [1.0]}], [], None, "expected a transform of 'laser'"),
        ([{"stamp": 1.0, "ranges": [1.0]}], [], "/other", "expected a topic '/other'.*found /scan"),
        (
            [{"stamp": 1.0, "ranges": [math.nan]}],
            [("/tf_static", 0.0, "map", "laser", (0.0, 0.0, 0.0))],
            None,
            "no beam of any scan",
        ),
    ],
)
def test_a_bag_without_a_map_in_it_is_refused(
    tmp_path: Path, scans: list[Any], transforms: list[Any], topic: str | None, said: str
) -> None:
    with pytest.raises(MapError, match=said):
        map_from_bag(bag(tmp_path, scans, transforms), scan_topic=topic)


def test_files_that_are_no_bags_are_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(50))
    with pytest.raises(MapError, match=r"mine\.mcap cannot be read as a bag"):
        map_from_bag(tmp_path / "mine.mcap")
    with pytest.raises(MapError, match="no such file"):
        map_from_bag(tmp_path / "none.mcap")
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(MapError, match="found a device or a pipe; save its content to a file"):
        map_from_bag(tmp_path / "pipe.mcap")


def test_the_command_writes_a_map_that_the_simulator_opens(tmp_path: Path) -> None:
    env = made(CONFIG)
    record_episode(env, make_policy("frontier", env, 0), None, steps=30, seed=1, bag=tmp_path / "run.mcap")
    words = ["replay", str(tmp_path / "run.mcap"), "--out", str(tmp_path / "maps"), "--resolution", "0.1"]
    done = call(*words)
    assert "m² free" in done
    (house,) = open_maps(tmp_path / "maps" / "map.yaml")
    assert house.pixels_per_metre == pytest.approx(10.0)
    assert (house.occupied == 0).sum() > 500
