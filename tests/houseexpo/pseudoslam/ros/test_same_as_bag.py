"""A bag of ``houseexpo record`` and a node of ``houseexpo ros`` give the same messages for the same plan and motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from houseexpo import FloorPlan
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.io.bag_maps import map_from_bag
from houseexpo.pseudoslam.io.record import record_episode
from houseexpo.pseudoslam.io.ros_messages import TOPICS
from houseexpo.pseudoslam.ros.fleet import Fleet
from houseexpo.pseudoslam.ros.node import Node, NodeConfig
from tests.builders.needs import need
from tests.houseexpo.pseudoslam.ros.test_requests import Recorded, drive

PLAN = FloorPlan(
    "hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {}, holes=([(5.0, 1.0), (6.0, 1.0), (6.0, 2.0), (5.0, 2.0)],)
)
FORWARD, LEFT, RIGHT = 0, 1, 2
ACTIONS = [FORWARD, FORWARD, LEFT, FORWARD, RIGHT, RIGHT, FORWARD, FORWARD, LEFT, LEFT, FORWARD]
STEP_S, CELL_M = 0.25, 0.05
CONFIG = SimulatorConfig(
    pixels_per_metre=20.0,
    start=StartConfig(random=False, x_m=2.0, y_m=1.5, heading_deg=30.0),
    laser=LaserConfig(3.0, 180.0, 1.0),
    step_s=STEP_S,
)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need(modules=["rosbags.rosbag2"], how="pip install -e '.[bag]'")
    path = tmp_path_factory.mktemp("bag") / "run.mcap"
    env, actions = ExplorationEnv(PLAN, CONFIG, success_coverage=None), iter(ACTIONS)
    record_episode(env, lambda _: next(actions), None, steps=len(ACTIONS), seed=4, bag=path)
    return path


@pytest.fixture(scope="module")
def recorded(bag: Path) -> dict[str, list[Any]]:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    types, found = get_typestore(Stores.ROS2_JAZZY), dict[str, list[Any]]()
    with Reader(bag) as reader:
        for connection, _, data in reader.messages():
            found.setdefault(connection.topic, []).append(types.deserialize_cdr(data, connection.msgtype))
    return found


@pytest.fixture(scope="module")
def live() -> Recorded:
    graph = Recorded()
    robot = CONFIG.robot
    fleet = Fleet(PLAN, CONFIG, seed=4, starts=[(2.0, 1.5, math.radians(30.0))], tick_s=STEP_S)
    node = Node(graph, fleet, NodeConfig(scan_hz=1 / STEP_S, maps="slam"))
    for action in ACTIONS:
        ahead = robot.step_m / STEP_S if action == FORWARD else 0.0
        turn = {FORWARD: 0.0, LEFT: 1.0, RIGHT: -1.0}[action] * math.radians(robot.turn_deg) / STEP_S
        drive(graph, ahead, turn)
        node._next_map_ns = 0  # a map each tick, as a bag has
        node.tick()
    return graph


def plain(message: Any) -> Any:
    """Return a message of rosbags as nested dictionaries."""
    if isinstance(message, list):
        return [plain(one) for one in message]
    if hasattr(message, "__msgtype__"):
        return {name: plain(getattr(message, name)) for name in vars(message) if name != "__msgtype__"}
    return message


def assert_same(found: Any, expected: Any, where: str) -> None:
    if isinstance(expected, dict):
        for name, value in expected.items():
            assert_same(found[name], value, f"{where}.{name}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for k, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_same(one, other, f"{where}[{k}]")
    elif isinstance(expected, str):
        assert found == expected, where
    else:
        assert np.allclose(found, expected, rtol=1e-6, atol=1e-9, equal_nan=True), (where, found, expected)


@pytest.mark.parametrize("name", ["clock", "tf", "tf_static", "odom"])
def test_messages_are_equal(recorded: dict[str, list[Any]], live: Recorded, name: str) -> None:
    messages = [plain(message) for message in recorded[f"/{name}"]]
    assert len(messages) == (1 if name == "tf_static" else len(ACTIONS) + 1)
    assert_same(messages, live.heard[f"/{name}"], name)


def test_maps_are_equal_and_a_node_leaves_out_those_that_do_not_change(
    recorded: dict[str, list[Any]], live: Recorded
) -> None:
    changed: list[Any] = []
    for message in map(plain, recorded["/map"]):
        if not changed or not np.array_equal(message["data"], changed[-1]["data"]):
            changed.append(message)
    assert len(changed) > 5
    assert_same(changed, live.heard["/map"], "map")


def test_scans_are_equal_but_for_the_cells(recorded: dict[str, list[Any]], live: Recorded) -> None:
    """A bag's scans end at the cells of walls, a node's at the walls: a beam along a wall aside, a cell and a half."""
    messages = [plain(message) for message in recorded["/scan"]]
    for found, expected in zip(messages, live.heard["/scan"], strict=True):
        ranges, exact = found.pop("ranges"), expected["ranges"]
        assert_same(found, {name: value for name, value in expected.items() if name != "ranges"}, "scan")
        both = np.isfinite(ranges) & np.isfinite(exact)
        assert both.mean() > 0.5
        off = np.abs(ranges[both] - exact[both])
        assert np.median(off) < CELL_M
        assert np.mean(off < 1.5 * CELL_M) > 0.95
        assert np.mean(np.isfinite(ranges) == np.isfinite(exact)) > 0.97


def test_a_bag_offers_the_qualities_of_the_node(bag: Path, live: Recorded) -> None:
    from rosbags.interfaces import QosDurability, QosReliability
    from rosbags.rosbag2 import Reader

    with Reader(bag) as reader:
        offered = {connection.topic: connection for connection in reader.connections}
    assert set(offered) == {f"/{name}" for name in TOPICS}
    for topic, quality in live.qualities.items():
        if topic not in offered:
            continue
        (qos,) = offered[topic].ext.offered_qos_profiles
        assert (qos.depth, qos.durability == QosDurability.TRANSIENT_LOCAL) == (quality.depth, quality.latched)
        assert qos.reliability == QosReliability.RELIABLE


def test_the_bag_plays_back_into_a_map_of_the_house(bag: Path) -> None:
    found = map_from_bag(bag, CELL_M)
    assert found.free.sum() * CELL_M**2 > 8.0
    rows, cols = np.nonzero(found.occupancy == 100)
    x = found.origin[0] + (cols + 0.5) * CELL_M
    y = found.origin[1] + (found.occupancy.shape[0] - rows - 0.5) * CELL_M
    walls = shapely.union_all([shapely.LinearRing(ring) for ring in (PLAN.verts, *PLAN.holes)])
    assert shapely.distance(shapely.points(x, y), walls).max() < 2 * CELL_M
