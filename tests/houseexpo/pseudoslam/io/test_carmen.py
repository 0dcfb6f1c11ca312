"""CARMEN logs of simulated runs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.worlds.world import World, make_world_from_raster
from research.carmen_logs import (
    OdometryDrift,
    Pose,
    Reading,
    Scanner,
    format_laser_line,
    simulate_readings,
    write_log,
)

ROOM = GridFrame((-1.0, -2.0), 10.0, (42, 62), y_up=True)  # 6 x 4 m inside, a wall of one cell round it


@pytest.fixture(scope="module")
def world() -> World:
    occupied = np.zeros(ROOM.shape, np.uint8)
    occupied[[0, -1]] = occupied[:, [0, -1]] = 1
    return make_world_from_raster(occupied, ROOM, 0.2, 5.0, "room")


def test_a_beam_is_as_long_as_the_way_to_the_wall(world: World) -> None:
    pose = (1.1, -0.4, math.pi / 2)  # the walls' inner sides: x -0.9 to 5.1, y -1.9 to 2.1
    right, ahead, left = Scanner(180.0, 3).look(world.occupied, ROOM, pose)
    np.testing.assert_allclose([right, ahead, left], [4.0, 2.5, 2.0])
    assert Scanner(180.0, 3, 2.2).look(world.occupied, ROOM, pose).tolist() == pytest.approx([2.2, 2.2, 2.0])


def test_beams_lie_from_edge_to_edge() -> None:
    np.testing.assert_allclose(np.degrees(Scanner(270.0, 4).angles_rad), [-135, -45, 45, 135])


def test_a_line_has_its_fields_in_order() -> None:
    words = format_laser_line(
        Scanner(180.0, 3, 8.0), Reading((1.0, -2.5, 0.5), np.array([1.25, 8.0, 0.5])), 0.4
    ).split()
    assert words[:2] == ["ROBOTLASER1", "3"]
    np.testing.assert_allclose([float(word) for word in words[2:5]], [-math.pi / 2, math.pi, math.pi / 2], atol=1e-8)
    assert words[5:9] == ["8", "0.01", "0", "3"]
    assert [float(word) for word in words[9:12]] == [1.25, 8.0, 0.5]
    assert words[12] == "0"
    assert [float(word) for word in words[13:19]] == [1.0, -2.5, 0.5] * 2
    assert words[19:] == ["0"] * 5 + ["0.400", "houseexpo", "0.400"]


def test_a_log_has_a_line_a_reading_and_its_times(world: World, tmp_path: Path) -> None:
    scanner, poses = Scanner(360.0, 9, 9.0), [(1.0, 0.0, 0.0), (1.3, 0.0, 0.0), (1.3, 0.0, 0.2)]
    count = write_log(
        tmp_path / "run.log", scanner, simulate_readings(world, scanner, poses, np.random.default_rng(0)), seconds=0.5
    )
    lines = (tmp_path / "run.log").read_text().splitlines()
    assert (count, len(lines)) == (3, 4)
    assert lines[0].startswith("#")
    assert [float(line.split()[-1]) for line in lines[1:]] == [0.0, 0.5, 1.0]
    for line, pose in zip(lines[1:], poses, strict=True):
        words = line.split()
        np.testing.assert_allclose(
            [float(word) for word in words[9:18]], scanner.look(world.occupied, ROOM, pose), atol=1e-4
        )
        assert tuple(float(word) for word in words[22:25]) == pose


def test_noise_moves_what_is_met_and_only_that(world: World) -> None:
    scanner, poses = Scanner(360.0, 360, 3.0), [(1.0, 0.0, 0.0)] * 50
    clean = scanner.look(world.occupied, ROOM, poses[0])
    noisy = np.array(
        [one.ranges_m for one in simulate_readings(world, scanner, poses, np.random.default_rng(1), laser_m=0.02)]
    )
    met = clean < 2.9
    assert met.any()
    assert (noisy[:, clean == 3.0] == 3.0).all()
    errors = (noisy - clean)[:, met]
    assert abs(errors.mean()) < 0.002
    assert errors.std() == pytest.approx(0.02, rel=0.05)


def test_without_drift_odometry_is_right_and_with_it_wrong_as_told() -> None:
    ring: list[Pose] = [(math.cos(a), math.sin(a), a + math.pi / 2) for a in np.linspace(0, 2 * math.pi, 101).tolist()]
    exact = list(OdometryDrift(0.0, 0.0, 0.0).walk(ring, np.random.default_rng(0)))
    np.testing.assert_allclose(np.array(exact)[:, :2], np.array(ring)[:, :2], atol=1e-9)
    ends = np.array(
        [list(OdometryDrift(0.0, 0.0, 2.0).walk(ring, np.random.default_rng(seed)))[-1] for seed in range(400)]
    )
    assert np.degrees(ends[:, 2] - math.pi / 2).std() == pytest.approx(2.0, rel=0.1)  # a full turn
    line: list[Pose] = [(0.3 * i, 0.0, 0.0) for i in range(31)]  # 9 m
    ends = np.array(
        [list(OdometryDrift(0.01, 0.0, 0.0).walk(line, np.random.default_rng(seed)))[-1] for seed in range(400)]
    )
    np.testing.assert_allclose((ends[:, :2] - (9.0, 0.0)).std(axis=0), 0.03, rtol=0.1)
    assert (ends[:, 2] == 0.0).all()


def test_equal_seeds_write_equal_bytes(world: World, tmp_path: Path) -> None:
    scanner, poses = Scanner(), [(1.0, 0.0, 0.0), (1.3, 0.0, 0.1)]
    for name in ("a", "b"):
        run = simulate_readings(world, scanner, poses, np.random.default_rng(7), drift=OdometryDrift(), laser_m=0.01)
        write_log(tmp_path / name, scanner, run)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize(
    "given", [{"fov_deg": 0.0}, {"fov_deg": 361.0}, {"beams": 1}, {"range_m": 0.0}, {"range_m": math.inf}]
)
def test_scanners_that_cannot_be_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="scanner"):
        Scanner(**given)  # type: ignore[arg-type]
