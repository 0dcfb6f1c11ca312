"""Bags of simulated runs, read back with the library that writes them."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from houseexpo import FloorPlan
from houseexpo.commands.record import record as command
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import LaserConfig, NoiseConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.io.record import record_episode
from houseexpo.pseudoslam.io.ros_messages import TOPICS
from houseexpo.pseudoslam.tasks import ROOM
from tests.builders.needs import need

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
START = StartConfig(random=False, x_m=2.0, y_m=1.5, heading_deg=90.0)
CONFIG = SimulatorConfig(pixels_per_metre=20.0, start=START, laser=LaserConfig(3.0, 180.0, 1.0), step_s=0.25)
FORWARD, LEFT = 0, 1


@pytest.fixture(autouse=True)
def _rosbags() -> None:
    need(modules=["rosbags.rosbag2"], how="pip install -e '.[bag]'")


def made(config: SimulatorConfig = CONFIG, **given: Any) -> ExplorationEnv:
    return ExplorationEnv(HALL, config, success_coverage=None, **given)


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return stamps and messages by their topics."""
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    types, found = get_typestore(Stores.ROS2_JAZZY), dict[str, list[tuple[int, Any]]]()
    with Reader(path) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
        assert kinds == {f"/{name}": topic.kind for name, topic in TOPICS.items()}
        for connection, stamp, data in reader.messages():
            message = types.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp, message))
    return found


def heading(quaternion: Any) -> float:
    return 2 * math.atan2(quaternion.z, quaternion.w)


def test_a_run_is_read_back_as_it_was(tmp_path: Path) -> None:
    env, actions = made(), iter([FORWARD, FORWARD, LEFT, FORWARD])
    done = record_episode(env, lambda _: next(actions), None, steps=4, seed=0, bag=tmp_path / "new" / "run.mcap")
    assert done.steps == 4
    found = read(tmp_path / "new" / "run.mcap")
    counts = {topic: len(messages) for topic, messages in found.items()}
    assert counts == {f"/{name}": 1 if name == "tf_static" else 5 for name in TOPICS}
    for messages in (found[f"/{name}"] for name in TOPICS if name != "tf_static"):
        assert [stamp for stamp, _ in messages] == [10**9 + k * 250_000_000 for k in range(5)]
    _, grid = found["/map"][-1]
    expected = env.simulator.map(env.state)
    assert (grid.header.frame_id, grid.info.resolution) == ("map", pytest.approx(0.05))
    assert np.array_equal(grid.data.reshape(grid.info.height, grid.info.width), expected.data)
    assert (grid.info.origin.position.x, grid.info.origin.position.y) == expected.origin
    _, odometry = found["/odom"][-1]
    at = odometry.pose.pose
    turned = math.radians(10)  # from the start, ahead is x: two steps, and a third to the left of them
    assert (at.position.x, at.position.y) == pytest.approx((0.6 + 0.3 * math.cos(turned), 0.3 * math.sin(turned)))
    assert heading(at.orientation) == pytest.approx(turned)
    _, tree = found["/tf"][-1]
    frames = [(one.header.frame_id, one.child_frame_id) for one in tree.transforms]
    assert frames == [("map", "odom"), ("odom", "base_footprint")]
    start, here = (one.transform for one in tree.transforms)
    assert (start.translation.x, start.translation.y) == pytest.approx((2.0, 1.5))
    assert heading(start.rotation) == pytest.approx(math.pi / 2)
    assert (here.translation.x, here.translation.y) == pytest.approx((at.position.x, at.position.y))


@pytest.mark.parametrize("observation", ["map", "dict"])
def test_a_scan_goes_from_the_right_to_the_left(tmp_path: Path, observation: str) -> None:
    """From (2, 1.5) looking up: the wall on the left is 2 m away, that ahead 2.5 m, and on the right there is none."""
    record_episode(made(observation=observation), lambda _: LEFT, None, steps=1, seed=0, bag=tmp_path / "run.mcap")
    (_, scan), *_ = read(tmp_path / "run.mcap")["/scan"]
    assert (scan.header.frame_id, len(scan.ranges)) == ("base_scan", 180)
    assert scan.angle_min == pytest.approx(-math.pi / 2)
    assert scan.angle_max == pytest.approx(scan.angle_min + 179 * scan.angle_increment)
    assert scan.range_max == pytest.approx(3.0)
    assert scan.ranges[0] == math.inf
    assert scan.ranges[90] == pytest.approx(2.5, abs=0.05)
    assert scan.ranges[179] == pytest.approx(2.0, abs=0.05)


def test_lost_beams_are_not_a_number_and_odometry_errs(tmp_path: Path) -> None:
    noise = NoiseConfig(drop_out=0.3, odometry_way=0.2)
    env = made(replace(CONFIG, noise=noise), observation="dict")
    record_episode(env, lambda _: FORWARD, None, steps=3, seed=0, bag=tmp_path / "run.mcap")
    found = read(tmp_path / "run.mcap")
    lost = np.mean([np.isnan(scan.ranges).mean() for _, scan in found["/scan"]])
    assert lost == pytest.approx(0.3, abs=0.1)
    assert all(scan.ranges[np.isfinite(scan.ranges)].min() > 0.5 for _, scan in found["/scan"])
    x, y, _ = env.simulator.believed_pose(env.state)
    at = found["/odom"][-1][1].pose.pose.position
    assert (at.x, at.y) == pytest.approx((y - 1.5, 2.0 - x))
    assert at.x != pytest.approx(0.9, abs=1e-3)


def test_equal_runs_are_equal_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        record_episode(made(), lambda _: FORWARD, None, steps=3, seed=0, bag=tmp_path / f"{name}.mcap")
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "two.mcap").read_bytes()


def test_a_run_that_fails_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="action: expected"):
        record_episode(made(), lambda _: 7, None, steps=3, seed=0, bag=tmp_path / "run.mcap")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_bag_beside_a_movie_or_alone(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(command)
    (tmp_path / "room.json").write_bytes(encode(ROOM))
    words = [str(tmp_path / "room.json"), "--steps", "5", "--bag", str(tmp_path / "run.mcap")]
    for more in ([], ["--out", str(tmp_path / "run.gif"), "--size", "300", "200"]):
        result = CliRunner().invoke(app, [*words, *more], catch_exceptions=False)
        assert result.exit_code == 0
        assert "run.mcap: " in result.output
        assert len(read(tmp_path / "run.mcap")["/map"]) >= 2
        (tmp_path / "run.mcap").unlink()
    assert (tmp_path / "run.gif").exists()


def test_what_cannot_be_written_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"bag: expected a file that ends in .mcap, found 'run.bag'"):
        record_episode(made(), lambda _: 0, None, bag=tmp_path / "run.bag")
    with pytest.raises(ConfigError, match="record: expected a movie or a bag to write, found neither"):
        record_episode(made(), lambda _: 0, None)
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(MissingDependencyError, match=r"bags need rosbags, .*: .*pip install -e '.\[bag\]'"):
        record_episode(made(), lambda _: 0, None, bag=tmp_path / "run.mcap")
    assert not list(tmp_path.iterdir())
