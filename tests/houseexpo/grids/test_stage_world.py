"""Worlds of the simulator Stage: what is their floor plan, how large it is, and where it lies."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo.grids import MapError, read_map
from houseexpo.grids.robot_map import drop_map_pictures
from houseexpo.grids.stage_world import FloorModel, WorldError, is_stage_world, read_floor_model
from houseexpo.pseudoslam.worlds.maps import open_maps

WORLD = """
# as people write them
include "robot.inc"
define floorplan model
(
  color "gray30"   boundary 1
  gui_nose 0
)
window ( size [ 600.0 700.0 ] scale 60 )
resolution 0.02
floorplan ( name "maze" bitmap "maze.png" size [ 4.0 2.0 0.8 ] pose [ 2.0 1.0 0.000 0.000 ] )
robot ( pose [ 1 1 0 0 ] block ( points 2 point[0] [0 0] point[1] [1 0] ) )
"""


def world(folder: Path, text: str = WORLD, *, cells: tuple[int, int] = (20, 40)) -> Path:
    """Write a world with a picture: black at its edge, white inside."""
    shades = np.zeros(cells, np.uint8)
    shades[1:-1, 1:-1] = 255
    Image.fromarray(shades).save(folder / "maze.png")
    path = folder / "maze.world"
    path.write_text(text)
    return path


def test_the_floor_plan_is_the_largest_model_with_a_bitmap(tmp_path: Path) -> None:
    text = WORLD + 'model ( bitmap "robot.png" size [0.5 0.5 0.2] pose [1 1 0 0] )\n'
    found = read_floor_model(world(tmp_path, text))
    assert found == FloorModel("maze.png", (4.0, 2.0), (2.0, 1.0, 0.0), boundary=True)
    assert read_floor_model(world(tmp_path, "\ufeff" + text)) == found


def test_a_world_is_a_map(tmp_path: Path) -> None:
    found = read_map(world(tmp_path))
    assert found.resolution_m == pytest.approx(0.1)
    assert found.origin == pytest.approx((0.0, 0.0, 0.0))
    assert int(found.free.sum()) == 18 * 38
    (house,) = open_maps(tmp_path)
    assert house.id == "maze"


def test_pose_turns_about_the_middle(tmp_path: Path) -> None:
    found = read_map(world(tmp_path, WORLD.replace("pose [ 2.0 1.0 0.000 0.000 ]", "pose [ 5 7 0 90 ]")))
    assert found.origin == pytest.approx((5 + 1.0, 7 - 2.0, math.pi / 2))


def test_without_a_boundary_the_size_is_that_of_what_is_not_free(tmp_path: Path) -> None:
    path = world(tmp_path, WORLD.replace("boundary 1", "boundary 0"))
    shades = np.full((40, 80), 255, np.uint8)
    shades[10:30, 20:60] = 0
    shades[11:29, 21:59] = 255
    Image.fromarray(shades).save(tmp_path / "maze.png")
    found = read_map(path)
    assert found.resolution_m == pytest.approx(0.1)
    assert found.origin == pytest.approx((-2.0, -1.0, 0.0))


def test_a_stretched_bitmap_gets_square_cells(tmp_path: Path) -> None:
    found = read_map(world(tmp_path, cells=(40, 40)))
    assert found.resolution_m == pytest.approx(0.05)
    assert found.occupancy.shape == (40, 80)


def test_what_is_included_is_read_and_what_lies_outside_is_not(tmp_path: Path) -> None:
    folder = tmp_path / "world"
    folder.mkdir()
    (folder / "plan.inc").write_text('define plan model ( boundary 1 size [8 4 1] bitmap "maze.png" )\n')
    (tmp_path / "outside.inc").write_text('define plan model ( size [80 40 1] bitmap "maze.png" )\n')
    text = 'include "plan.inc"\ninclude "../outside.inc"\ninclude "gone.inc"\nplan ( pose [0 0 0 0] )\n'
    assert read_map(world(folder, text)).resolution_m == pytest.approx(0.2)


def test_grey_that_most_is_is_unknown(tmp_path: Path) -> None:
    path = world(tmp_path)
    shades = np.asarray(Image.open(tmp_path / "maze.png")).copy()
    shades[5:10, 5:10] = 206
    Image.fromarray(shades).save(tmp_path / "maze.png")
    found = read_map(path)
    assert (found.occupancy[5:10, 5:10] == -1).all()
    assert found.unknown_shade == 206


def test_the_picture_of_a_world_is_no_map_by_itself(tmp_path: Path) -> None:
    path = world(tmp_path)
    assert drop_map_pictures([path, tmp_path / "maze.png"]) == [path]


@pytest.mark.parametrize(
    ("text", "said"),
    {
        "model ( size [1 1 1] block ( points 3 point[0] [0 0] ) )\n": "expected a model with a bitmap",
        'model ( bitmap "gone.png" size [1 1 1] )\n': "found none of the name 'gone.png'",
        'model ( bitmap "../maze.png" size [1 1 1] \n': "breaks off",
        "model ( size [1 1 1 \n": "breaks off",
        "model ( " * 100: "deeper than",
        'define plan ( bitmap "maze.png" )\n': "expected a name",
        "model ( size [nan nan 1] bitmap )\n": "expected a model with a bitmap",
    }.items(),
)
def test_what_is_wrong_with_a_world_is_said(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(MapError, match=said):
        read_map(world(tmp_path, text))


def test_includes_that_name_each_other_end(tmp_path: Path) -> None:
    (tmp_path / "one.inc").write_text('include "two.inc"\n')
    (tmp_path / "two.inc").write_text('include "one.inc"\ninclude "maze.world"\n')
    with pytest.raises(WorldError):
        read_floor_model(world(tmp_path, 'include "one.inc"\n'))


@pytest.mark.parametrize(
    ("head", "is_one"),
    [(b"<?xml version='1.0'?><sdf>", False), (b"# by hand\ndefine floorplan model\n(", True), (b"\0\1garbage", False)],
)
def test_worlds_of_gazebo_are_xml(head: bytes, is_one: bool) -> None:
    assert is_stage_world(head) == is_one
