"""Robots' maps as map_server, arrays and bags have them: a small map with one cell of each kind, known by hand."""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from houseexpo.grids import MapError, RobotMap, read_map
from houseexpo.grids.robot_map import EVEN, FREE_TO, MAX_MAP_CELLS, is_map_yaml, map_picture_path

SHADES = np.array([[254, 205, 0], [255, 100, 37]], np.uint8)
"""White is free, black is occupied; darkness 0.004, 0.196, 1 and 0, 0.608, 0.855."""


def saved(folder: Path, name: str = "map.pgm", shades: np.ndarray = SHADES, **keys: Any) -> Path:
    """Write a map_server map, and return the path of its yaml."""
    Image.fromarray(shades).save(folder / name)
    settings = {"image": name, "resolution": 0.05, "origin": [-1.0, 2.0, 0.0], "negate": 0} | keys
    settings = {"occupied_thresh": 0.65, "free_thresh": 0.196} | settings
    file = folder / "map.yaml"
    file.write_text("".join(f"{key}: {value}\n" for key, value in settings.items() if value is not None))
    return file


def bagged(folder: Path, topics: dict[str, np.ndarray], plugin: str = "MCAP", yaw: float = 0.0) -> Path:
    """Write a bag with maps, rows from the lowest y up, after an older map of each topic that is all unknown."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    time = types["builtin_interfaces/msg/Time"](0, 0)
    turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](1.0, 2.0, 0.0), turn)
    header = types["std_msgs/msg/Header"](time, "map")
    path = folder / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        for topic, cells in topics.items():
            rows, cols = cells.shape
            info = types["nav_msgs/msg/MapMetaData"](time, 0.1, cols, rows, pose)
            kind = "nav_msgs/msg/OccupancyGrid"
            connection = writer.add_connection(topic, kind, typestore=store)
            for stamp, data in ((1, np.full(cells.size, -1, np.int8)), (2, cells.ravel())):
                message = types[kind](header, info, data)
                writer.write(connection, stamp, store.serialize_cdr(message, kind))
    return path


@pytest.mark.parametrize("yaw", ["-nan", "nan", ".nan", "-.NaN"])
def test_a_yaw_that_is_not_a_number_is_0_and_the_map_says_so(tmp_path: Path, yaw: str) -> None:
    found = read_map(saved(tmp_path, origin=f"[-1.0, 2.0, {yaw}]"))
    assert (found.origin, found.yaw_note) == ((-1.0, 2.0, 0.0), "not a number, read as 0")
    assert not read_map(saved(tmp_path, origin=[-1.0, 2.0])).yaw_note
    with pytest.raises(MapError, match="origin: expected a number, found 'nan'"):
        read_map(saved(tmp_path, origin="[nan, 2.0, 0.0]"))


@pytest.mark.parametrize("yaw", [90, -180.0, 270])
def test_a_yaw_in_degrees_counts_as_radians_and_is_said(tmp_path: Path, yaw: float) -> None:
    found = read_map(saved(tmp_path, origin=[-1.0, 2.0, yaw]))
    assert found.origin[2] == yaw
    assert f"if they are degrees, write {math.radians(yaw):.6g}" in found.yaw_note
    assert not read_map(saved(tmp_path, origin=[-1.0, 2.0, 6.28])).yaw_note


@pytest.mark.parametrize("yaw", [0.3, -1.2, math.pi / 2, math.pi, 7.0])
def test_an_upright_map_has_each_place_where_the_turned_one_has_it(yaw: float) -> None:
    blocks = np.random.default_rng(0).choice([0, -1, 100], (6, 8)).astype(np.int8)
    turned = RobotMap(blocks.repeat(5, axis=0).repeat(5, axis=1), 0.1, (3.0, -2.0, yaw))
    upright = turned.upright()
    assert upright.origin[2] == 0
    for row, col in np.ndindex(blocks.shape):
        ((x, y),) = turned.points_from_pixels([(5 * col + 2.5, 5 * row + 2.5)])
        at_col, up = int((x - upright.origin[0]) / 0.1), int((y - upright.origin[1]) / 0.1)
        assert upright.occupancy[::-1][up, at_col] == blocks[row, col]


def test_no_wall_of_one_cell_opens_when_a_map_is_turned() -> None:
    cells = np.full((60, 60), 0, np.int8)
    cells[[10, 50], 10:51] = cells[10:51, [10, 50]] = 100
    for yaw in np.linspace(0.0, 1.5, 16):
        free = RobotMap(cells, 0.05, (0.0, 0.0, float(yaw))).upright().free
        _, label = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
        assert label.max() == 2


CELLS = np.array([[0, 100, -1], [50, 0, 0]], np.int8)


SAVED = np.array([[254, 205, 0], [254, 254, 205]], np.uint8)


def test_the_unknown_cells_of_map_saver_stay_unknown_with_the_threshold_of_nav2(tmp_path: Path) -> None:
    """Nav2 wrote 0.25 until 2025 (ros-navigation/navigation2#5278), by which 205 would be free."""
    expected = [[0, -1, 100], [0, 0, -1]]
    for keys in ({"mode": "trinary", "free_thresh": 0.25}, {"free_thresh": 0.25}, {}):
        assert read_map(saved(tmp_path, shades=SAVED, **keys)).occupancy.tolist() == expected
    assert read_map(saved(tmp_path, shades=SAVED, free_thresh=0.25, mode="scale")).occupancy[0, 1] == 0
    assert read_map(saved(tmp_path, shades=SAVED, free_thresh=0.25)).unknown_shade == 205
    assert read_map(saved(tmp_path, shades=SAVED)).unknown_shade is None  # by its threshold, not against it


def test_a_few_cells_of_other_shades_do_not_make_the_unknown_cells_of_map_saver_free(tmp_path: Path) -> None:
    """People erase with white (255) and draw with soft brushes; shades of all kinds are a map of another program."""
    shades = np.full((60, 100), 205, np.uint8)
    shades[10:50, 10:90], shades[10, 10:90] = 254, 0
    shades[20, 20:25] = 255
    shades[30, 20:60] = np.linspace(1, 253, 40)
    found = read_map(saved(tmp_path, shades=shades, free_thresh=0.25))
    assert (found.occupancy[shades == 205] == -1).all()
    assert (found.free == ((shades > 255 * 0.75) & (shades != 205))).all()  # all other shades are read by the letter
    shades[40:50, :40] = np.linspace(150, 240, 400).reshape(10, 40)
    shades[:10], shades[50:] = 220, 190
    mixed = read_map(saved(tmp_path, shades=shades, free_thresh=0.25))
    assert mixed.free[shades == 205].all()
    assert mixed.unknown_shade is None


def test_a_threshold_that_is_missing_fits_the_other(tmp_path: Path) -> None:
    """Old maps say occupied_thresh alone, and a low one."""
    found = read_map(saved(tmp_path, shades=np.array([[255, 0]], np.uint8), occupied_thresh=0.05, free_thresh=None))
    assert found.occupancy.tolist() == [[0, 100]]


def test_a_picture_without_white_has_205_for_free(tmp_path: Path) -> None:
    shades = np.array([[205, 205, 0]], np.uint8)
    assert read_map(saved(tmp_path, shades=shades, free_thresh=0.25)).occupancy.tolist() == [[0, 0, 100]]


def test_trinary_is_the_default(tmp_path: Path) -> None:
    found = read_map(saved(tmp_path))
    assert found.occupancy.tolist() == [[0, -1, 100], [0, -1, 100]]
    assert found.resolution_m == 0.05
    assert found.origin == (-1.0, 2.0, 0.0)


def test_scale_keeps_what_is_between_the_thresholds(tmp_path: Path) -> None:
    found = read_map(saved(tmp_path, mode="scale")).occupancy
    assert found[:, [0, 2]].tolist() == [[0, 100], [0, 100]]
    assert found[1, 1] == pytest.approx(98 * (155 / 255 - 0.196) / (0.65 - 0.196) + 1, abs=0.51)


def test_raw_values_are_the_occupancy(tmp_path: Path) -> None:
    found = read_map(saved(tmp_path, mode="raw"))
    assert found.occupancy.tolist() == [[-1, -1, 0], [-1, 100, 37]]


def test_a_map_says_that_it_has_walls_alone(tmp_path: Path) -> None:
    assert read_map(saved(tmp_path, walls_only="true")).walls_only
    assert not read_map(saved(tmp_path)).walls_only
    with pytest.raises(MapError, match="walls_only: expected 0 or 1, found 'perhaps'"):
        read_map(saved(tmp_path, walls_only="perhaps"))


def test_a_png_says_that_it_has_walls_alone(tmp_path: Path) -> None:
    text = PngInfo()
    text.add_text("walls_only", "true")
    Image.fromarray(SHADES).save(tmp_path / "drawn.png", pnginfo=text)
    Image.fromarray(SHADES).save(tmp_path / "other.png")
    assert read_map(tmp_path / "drawn.png", 0.05).walls_only
    assert not read_map(tmp_path / "other.png", 0.05).walls_only


def test_a_png_of_walls_alone_says_where_it_lies(tmp_path: Path) -> None:
    for name, texts in {
        "drawn": {"walls_only": "true", "resolution": "0.02", "origin": "[-1.5, 2, 0.35]"},
        "photo": {"resolution": "0.02", "origin": "[-1.5, 2, 0.35]"},
        "odd": {"walls_only": "true", "resolution": "0.02", "origin": "[["},
    }.items():
        text = PngInfo()
        for key, value in texts.items():
            text.add_text(key, value)
        Image.fromarray(SHADES).save(tmp_path / f"{name}.png", pnginfo=text)
    found = read_map(tmp_path / "drawn.png")
    assert (found.resolution_m, found.origin) == (0.02, (-1.5, 2.0, 0.35))
    assert read_map(tmp_path / "drawn.png", 0.05).resolution_m == 0.05
    with pytest.raises(MapError, match="expected the side of a cell"):
        read_map(tmp_path / "photo.png")
    with pytest.raises(MapError, match="origin"):
        read_map(tmp_path / "odd.png")


def test_negate_swaps_black_and_white(tmp_path: Path) -> None:
    found = read_map(saved(tmp_path, negate=1))
    assert found.occupancy.tolist() == [[100, 100, 0], [100, -1, 0]]


def test_a_colour_picture_is_averaged_and_transparent_pixels_are_unknown(tmp_path: Path) -> None:
    shades = np.zeros((1, 3, 4), np.uint8)
    shades[0] = [[255, 255, 255, 255], [0, 0, 0, 255], [255, 255, 255, 0]]
    assert read_map(saved(tmp_path, "map.png", shades)).occupancy.tolist() == [[0, 100, -1]]


def test_the_origin_turns_the_grid_about_its_lower_left_corner(tmp_path: Path) -> None:
    found = read_map(saved(tmp_path, origin=[1.0, 2.0, math.pi / 2]))
    lower_left, upper_right = found.points_from_pixels([(0, 2), (3, 0)])
    assert lower_left == pytest.approx([1.0, 2.0])
    assert upper_right == pytest.approx([1.0 - 0.1, 2.0 + 0.15])  # 0.15 m to the right became up, 0.1 m up became left


@pytest.mark.parametrize("named", ["/home/someone/maps/map.pgm", "../other/map.pgm", r"C:\maps\map.pgm"])
def test_a_picture_of_another_folder_is_looked_for_beside_the_yaml(tmp_path: Path, named: str) -> None:
    file = saved(tmp_path)
    file.write_text(file.read_text().replace("map.pgm", named))
    assert read_map(file).occupancy.shape == (2, 3)
    assert map_picture_path(file) == (tmp_path / "map.pgm").resolve()


def test_a_picture_outside_the_folder_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    Image.fromarray(SHADES).save(tmp_path / "secret.pgm")
    (tmp_path / "maps" / "link.pgm").symlink_to(tmp_path / "secret.pgm")
    for named in ("../secret.pgm", "link.pgm"):
        (tmp_path / "maps" / "map.yaml").write_text(f"image: {named}\nresolution: 0.05\n")
        with pytest.raises(MapError, match="image: expected a picture in the folder of the yaml") as caught:
            read_map(tmp_path / "maps" / "map.yaml")
        assert caught.value.fault == "missing_file"


def test_a_picture_alone_has_grey_as_unknown(tmp_path: Path) -> None:
    saved(tmp_path)
    assert read_map(tmp_path / "map.pgm", 0.1).occupancy.tolist() == [[0, -1, 100], [0, -1, 100]]
    with pytest.raises(MapError, match=r"found none \(name map.yaml, which lies beside it, .*\); give the resolution"):
        read_map(tmp_path / "map.pgm")
    (tmp_path / "map.yaml").unlink()
    with pytest.raises(MapError, match="expected the side of a cell, found none; give the resolution"):
        read_map(tmp_path / "map.pgm")


@pytest.mark.parametrize(("unknown", "lighter"), [(205, 221), (153, 184), (230, 238)])
def test_in_a_picture_alone_what_is_lighter_than_three_tenths_of_the_way_to_white_is_free(
    tmp_path: Path, unknown: int, lighter: int
) -> None:
    """Pictures of SLAM's maps have shades where few rays passed, and where they were scaled."""
    shades = np.full((20, 20), unknown, np.uint8)
    shades[:, 10:] = 254
    shades[4, :3] = lighter, lighter - 1, 60
    for negate in (False, True):
        saved(tmp_path, shades=255 - shades if negate else shades)
        read = read_map(tmp_path / "map.pgm", 0.05, negate=negate)
        found = read.occupancy
        assert found[4, [0, 2, 3]].tolist() == [0, 100, -1]
        assert FREE_TO < found[4, 1] < EVEN
        assert (found[:, 10:] == 0).all()


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        (np.array([[True, False]]), [[100, 0]]),
        (np.array([[0.0, 0.37, 1.0, np.nan, 2.0]]), [[0, 37, 100, -1, -1]]),
        (np.array([[0, 37, 100, -1, 120]]), [[0, 37, 100, -1, -1]]),
        (np.array([[0, 255]], np.uint8), [[0, -1]]),
    ],
)
def test_arrays(tmp_path: Path, array: np.ndarray, expected: list[list[int]]) -> None:
    np.save(tmp_path / "map.npy", array)
    assert read_map(tmp_path / "map.npy", 0.05).occupancy.tolist() == expected


@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_the_last_map_of_a_bag_with_the_lowest_row_first(tmp_path: Path, plugin: str) -> None:
    bag = bagged(tmp_path, {"/global_costmap/costmap": CELLS * 0, "/map": CELLS}, plugin, yaw=0.5)
    whole = read_map(bag)
    assert whole.occupancy.tolist() == CELLS[::-1].tolist()
    assert whole.origin == pytest.approx((1.0, 2.0, 0.5))
    assert whole.resolution_m == pytest.approx(0.1)
    (file,) = [path for path in bag.iterdir() if path.suffix in {".mcap", ".db3"}]
    assert read_map(file).occupancy.tolist() == CELLS[::-1].tolist()
    assert read_map(bag, topic="/global_costmap/costmap").occupancy.tolist() == (CELLS * 0).tolist()


def test_the_topic_of_a_bag(tmp_path: Path) -> None:
    only = bagged(tmp_path, {"/robot/slam": CELLS})
    assert read_map(only).occupancy.shape == (2, 3)
    with pytest.raises(MapError, match="expected the topic /none, found /robot/slam; name one of them"):
        read_map(only, topic="/none")
    (tmp_path / "two").mkdir()
    with pytest.raises(MapError, match="expected one topic with maps, found /a/map, /b/map"):
        read_map(bagged(tmp_path / "two", {"/a/map": CELLS, "/b/map": CELLS}))
    (tmp_path / "few").mkdir()
    assert read_map(bagged(tmp_path / "few", {"/a/costmap": CELLS, "/a/map": CELLS})).name == "bag /a/map"


def test_damaged_bags(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    for name, data in (("a.mcap", b"\x89MCAP0\r\n" + b"\xff" * 64), ("b.db3", b"SQLite format 3\0" + b"\xff" * 64)):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(MapError, match="cannot be read as a bag"):
            read_map(tmp_path / name)
    whole = bagged(tmp_path, {"/map": CELLS}) / "bag.mcap"
    whole.write_bytes(whole.read_bytes()[:-300])
    with pytest.raises(MapError):
        read_map(whole)


FAULTS = {
    "image: map.pgm\n": "expected the keys image and resolution, found no resolution",
    "resolution: 0.05\n": "expected the keys image and resolution, found no image",
    "image: none.pgm\nresolution: 0.05\n": "found none of the name 'none.pgm'",
    "image: map.pgm\nresolution: 0\n": "resolution: expected 0.0001 to 10 m a cell, found 0",
    "image: map.pgm\nresolution: .nan\n": "resolution: expected a number",
    "image: map.pgm\nresolution: -0.05\n": "resolution: expected 0.0001 to 10 m a cell, found -0.05",
    "image: map.pgm\nresolution: 0.05\nmode: wild\n": "mode: expected trinary, scale or raw, found 'wild'",
    "image: map.pgm\nresolution: 0.05\nnegate: maybe\n": "negate: expected 0 or 1, found 'maybe'",
    "image: map.pgm\nresolution: 0.05\norigin: [1]\n": "origin: expected",
    "image: map.pgm\nresolution: 0.05\norigin: [1, x, 0]\n": "origin: expected a number, found 'x'",
    "image: map.pgm\nresolution: 0.05\norigin: [1, .inf, 0]\n": "origin: expected a number",
    "image: map.pgm\nresolution: 0.05\nfree_thresh: 0.9\n": "expected thresholds from 0 to 1, free not above occupied",
    "image: [a]\nresolution: 0.05\n": "found none of the name",
    "- image\n": "expected a mapping",
    "image: &a map.pgm\nresolution: *a\n": "by an alias (*name), which is not followed: write it out there",
    "image: {{{\n": "is no YAML",
    "image: map.pgm\nresolution: 0.05\nfree_thresh: 0.0\n": "expected free space, found no free cell; check the thresh",
    "[" * 5000: "is nested more than 20 deep",
}


@pytest.mark.parametrize("text", FAULTS)
def test_what_is_wrong_is_named(tmp_path: Path, text: str) -> None:
    file = saved(tmp_path)
    file.write_text(text)
    with pytest.raises(MapError) as caught:
        read_map(file)
    assert FAULTS[text] in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)  # noqa: S301 - our own


def test_a_yaml_of_two_megabytes_is_not_parsed(tmp_path: Path) -> None:
    file = saved(tmp_path)
    file.write_text("image: map.pgm\nresolution: 0.05\n#" + "x" * (2 << 20))
    with pytest.raises(MapError, match="which no map"):
        read_map(file)


def test_pictures_that_say_they_are_huge_are_refused_unopened(tmp_path: Path) -> None:
    for rows, cols in ((20_000, 20_000), (2_000_000_000, 2_000_000_000), (1, MAX_MAP_CELLS + 1)):
        (tmp_path / "map.pgm").write_bytes(f"P5 {cols} {rows} 255\n".encode() + b"\0" * 100)
        with pytest.raises(MapError):
            read_map(tmp_path / "map.pgm", 0.05)


def test_damaged_pictures_and_arrays(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"\0" * 40)
    (tmp_path / "b.pgm").write_bytes(b"P5 100 100 255\n" + b"\xff" * 20)
    (tmp_path / "c.npy").write_bytes(b"\x93NUMPY\x01\x00v\x00{'descr': '|O', 'fortran_order': False, 'shape': (1, 1)}")
    np.save(tmp_path / "d.npy", np.zeros((3, 3, 3)))
    np.save(tmp_path / "e.npy", np.array([["a", "b"]]))
    np.save(tmp_path / "f.npy", np.array([[object()]]), allow_pickle=True)
    np.save(tmp_path / "g.npy", np.zeros((0, 4)))
    for file in sorted(tmp_path.iterdir()):
        with pytest.raises(MapError):
            read_map(file, 0.05)
    with pytest.raises(MapError, match="there is no such file"):
        read_map(tmp_path / "none.png", 0.05)


def test_a_map_of_one_value_is_made_by_hand() -> None:
    made = RobotMap(np.zeros((2, 3), np.int8), 0.1)
    assert made.free.all()
    assert not made.occupied.any()
    with pytest.raises(MapError, match="expected rows and columns of cells"):
        RobotMap(np.zeros(3, np.int8), 0.1)
    with pytest.raises(MapError, match="origin: expected x, y and yaw"):
        RobotMap(np.zeros((2, 3), np.int8), 0.1, (0.0, math.nan, 0.0))


def test_trimming_takes_off_what_is_unknown_and_keeps_places() -> None:
    cells = np.full((60, 80), -1, np.int8)
    cells[20, 30] = cells[50, 40] = 0
    found = RobotMap(cells, 0.1, (1.0, 2.0, 0.7)).trimmed(0.3)
    assert found.occupancy.shape == (37, 17)
    before, after = RobotMap(cells, 0.1, (1.0, 2.0, 0.7)).points_from_pixels((30, 20)), found.points_from_pixels((3, 3))
    assert after == pytest.approx(before)


def test_a_map_yaml_is_known_by_its_keys(tmp_path: Path) -> None:
    assert is_map_yaml(saved(tmp_path).read_bytes())
    assert not is_map_yaml(b"levels:\n  image: a\n  resolution: 1\n")
