"""Read SUNCG houses and their OBJ files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import trimesh

from houseexpo.errors import ConfigError
from pipeline.rejection import Reason, Rejection
from pipeline.sources import suncg
from pipeline.sources.meshes import obj
from pipeline.values import Level, RejectedLevel
from tests.builders.formats.suncg_tree import HOUSE, write_house, write_tree
from tests.builders.suncg_houses import write_houses


def _read(root: Path, **options: str) -> dict[str, Level | RejectedLevel]:
    (item,) = suncg.find(str(root), **options)
    return {each.id: each for each in suncg.read(item)}


def _level(root: Path, suffix: str = "", **options: str) -> Level:
    level = _read(root, **options)[HOUSE + suffix]
    assert isinstance(level, Level)
    return level


def _rejection(root: Path, suffix: str = "") -> Rejection:
    rejected = _read(root)[HOUSE + suffix]
    assert isinstance(rejected, RejectedLevel)
    assert rejected.rejection.stage == "source"
    assert rejected.rejection.advice
    return rejected.rejection


def test_lists_scenes_in_order(tmp_path: Path) -> None:
    write_tree(tmp_path)
    for name in ("b", "a"):
        (tmp_path / "house" / name).mkdir()
    (tmp_path / "house" / "notes.txt").write_text("")
    assert [item.key for item in suncg.find(str(tmp_path))] == [HOUSE, "a", "b"]


def test_levels_that_are_not_valid_are_skipped_and_the_lowest_has_the_scene_id(tmp_path: Path) -> None:
    write_tree(tmp_path)
    assert list(_read(tmp_path)) == [HOUSE, f"{HOUSE}_L2", f"{HOUSE}_L3"]


def test_frame_keeps_x_and_z_and_counts_heights_from_the_walls(tmp_path: Path) -> None:
    write_tree(tmp_path)
    level = _level(tmp_path, "_L2")
    assert level.walls.vertices.min(axis=0) == pytest.approx([9.9, 19.9, 0.0])
    assert level.walls.vertices.max(axis=0) == pytest.approx([14.1, 23.1, 2.73])
    assert level.ceiling_m == pytest.approx(2.73)
    assert (level.frame.up, level.frame.floor, level.frame.level) == ("y", pytest.approx(2.9), 2)
    assert level.frame.matrix == ((1, 0, 0), (0, 1, 0))
    assert level.sills


def test_only_walls_that_are_shown_are_cut(tmp_path: Path) -> None:
    write_tree(tmp_path)
    level = _level(tmp_path)  # fr_0rm_3 hides its walls, fr_0rm_2 is not valid, neither has a wall file
    assert len(level.walls.faces) == 12 * (4 + 2)
    assert level.walls.vertices[:, 0].max() == 18.0


def test_floor_is_what_rooms_stand_on(tmp_path: Path) -> None:
    write_tree(tmp_path)
    floor = _level(tmp_path).floor
    assert floor is not None
    assert floor.area == pytest.approx(4 * 3 + 4 * 3 + 4 * 2)  # the ground's 50 by 50 m are no floor
    assert floor.bounds == pytest.approx((10, 20, 18, 25))


def test_rooms_words_labels_and_boxes(tmp_path: Path) -> None:
    write_tree(tmp_path)
    level = _level(tmp_path)
    assert [room.words for room in level.rooms] == [("Bedroom", "Office"), (), ("living room", "Winter garden")]
    assert [room.labels for room in level.rooms] == [("Bedroom", "Office"), (), ("Living_Room",)]
    assert level.rooms[0].box == pytest.approx((9.9, 19.9, 14.1, 23.1))
    assert (level.room_count, level.n_objects) == (3, 1)
    assert level.provenance["rooms_of_scene"] == 4
    assert level.provenance["file"] == f"house/{HOUSE}/house.json"


def test_room_types_may_be_absent(tmp_path: Path) -> None:
    house = write_tree(tmp_path)
    del house["levels"][0]["nodes"][0]["roomTypes"]
    write_house(tmp_path, house)
    assert _level(tmp_path).rooms[0].words == ()


def test_a_level_of_objects_alone_has_no_walls(tmp_path: Path) -> None:
    write_tree(tmp_path)
    level = _level(tmp_path, "_L3")
    assert len(level.walls.faces) == 0
    assert (level.n_objects, level.room_count, level.floor) == (2, 0, None)


def test_furniture_stands_where_its_columns_say(tmp_path: Path) -> None:
    write_tree(tmp_path)
    assert _level(tmp_path).furniture == ()
    (table,) = _level(tmp_path, furniture="yes").furniture
    furniture = table.mesh
    assert furniture.vertices.min(axis=0) == pytest.approx([11.5, 20.0, 0.05])
    assert furniture.vertices.max(axis=0) == pytest.approx([12.5, 22.0, 0.55])


def test_a_mirroring_transform_keeps_faces_outward(tmp_path: Path) -> None:
    house = write_tree(tmp_path)
    volumes = []
    for sign in (1, -1):
        house["levels"][0]["nodes"][6]["transform"][0:3] = [0, 0, -sign]
        write_house(tmp_path, house)
        (table,) = _level(tmp_path, furniture="yes").furniture
        furniture = table.mesh
        a, b, c = np.moveaxis(furniture.vertices[furniture.faces], 1, 0)
        volumes.append(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6))
    assert volumes == pytest.approx([volumes[0]] * 2)


def test_door_leaves_are_no_furniture(tmp_path: Path) -> None:
    house = write_tree(tmp_path)
    house["levels"][0]["nodes"][6]["modelId"] = "122"
    write_house(tmp_path, house)
    assert _level(tmp_path, furniture="yes").furniture == ()


def test_scale_to_meters(tmp_path: Path) -> None:
    write_tree(tmp_path, scale=0.5)
    level = _level(tmp_path, "_L2")
    assert level.walls.vertices.max(axis=0) == pytest.approx([7.05, 11.55, 1.365])
    assert level.frame.floor == pytest.approx(1.45)
    assert level.rooms[0].box == pytest.approx((4.95, 9.95, 7.05, 11.55))


def test_far_scenes_are_moved_near_and_the_frame_says_how(tmp_path: Path) -> None:
    write_tree(tmp_path, scale=60.0)
    level = _level(tmp_path, "_L2")
    back = np.array(level.frame.matrix)
    corner = level.walls.vertices[:, :2].max(axis=0)
    assert np.abs(corner).max() < 200
    assert back[:, :2] @ corner + back[:, 2] == pytest.approx([14.1 * 60, 23.1 * 60])


def test_hash_covers_each_file_of_the_level_and_no_other(tmp_path: Path) -> None:
    write_tree(tmp_path)
    ground, upper = _level(tmp_path), _level(tmp_path, "_L2")
    floor = tmp_path / "room" / HOUSE / "fr_0rm_3f.obj"
    floor.write_text(floor.read_text() + "# seen\n")
    assert _level(tmp_path).provenance["sha256"] != ground.provenance["sha256"]
    assert _level(tmp_path, "_L2").provenance["sha256"] == upper.provenance["sha256"]
    assert str(tmp_path) not in str(dict(ground.provenance))


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (None, Reason.MISSING_FILE),
        (lambda _: b"", Reason.EMPTY),
        (lambda _: b"# nothing here\n", Reason.UNREADABLE),
        (lambda _: bytes(range(256)) * 9, Reason.UNREADABLE),
        (lambda _: b"\xff\xd8 v f garbage\n" * 9, Reason.UNREADABLE),
        (lambda data: data[: len(data) // 2], Reason.UNREADABLE),
        (lambda data: data[:-8], Reason.UNREADABLE),
        (lambda data: data.replace(b"v 9.9", b"v nan"), Reason.NOT_FINITE),
        (lambda data: data.replace(b"v 9.9", b"v inf"), Reason.NOT_FINITE),
        (lambda data: data.replace(b"v 9.9", b"v nine"), Reason.UNREADABLE),
        (lambda data: data.replace(b"v 9.9", b"v 9900"), Reason.BAD_UNITS),
        (lambda data: data.replace(b"f 1/", b"f 999/"), Reason.UNREADABLE),
        (lambda data: b"\n".join(x for x in data.split(b"\n") if not x.startswith(b"f")), Reason.EMPTY),
    ],
)
def test_a_bad_wall_file_rejects_its_level_alone(tmp_path: Path, spoil, reason: Reason) -> None:  # type: ignore[no-untyped-def]
    write_tree(tmp_path)
    path = tmp_path / "room" / HOUSE / "fr_0rm_0w.obj"
    path.unlink() if spoil is None else path.write_bytes(spoil(path.read_bytes()))
    rejection = _rejection(tmp_path)
    assert rejection.reason == reason
    assert str(tmp_path) not in rejection.detail
    assert isinstance(_read(tmp_path)[f"{HOUSE}_L2"], Level)


def test_a_missing_material_rejects_the_level(tmp_path: Path) -> None:
    write_tree(tmp_path)
    (tmp_path / "room" / HOUSE / "walls.mtl").unlink()
    rejection = _rejection(tmp_path)
    assert rejection.reason == Reason.MISSING_FILE
    assert "walls.mtl" in rejection.detail


def test_a_level_of_nothing_is_empty(tmp_path: Path) -> None:
    house = write_tree(tmp_path)
    house["levels"][3]["nodes"] = []
    write_house(tmp_path, house)
    assert _rejection(tmp_path, "_L3").reason == Reason.EMPTY


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, Reason.MISSING_FILE),
        ("", Reason.EMPTY),
        ('{"levels": [', Reason.UNREADABLE),
        ('{"levels": [{"nodes": [{"type": 7}]}]}', Reason.UNREADABLE),
        ('{"levels": []}', Reason.EMPTY),
        ('{"levels": [], "scaleToMeters": 0}', Reason.BAD_UNITS),
        ('{"levels": [], "up": [0, 0, 1]}', Reason.UNREADABLE),
        ('{"levels": [], "front": [1, 0, 0]}', Reason.UNREADABLE),
    ],
)
def test_a_bad_house_json_rejects_the_house(tmp_path: Path, text: str | None, reason: Reason) -> None:
    write_tree(tmp_path)
    path = tmp_path / "house" / HOUSE / "house.json"
    path.unlink() if text is None else path.write_text(text)
    with pytest.raises(Rejection) as caught:
        _read(tmp_path)
    assert (caught.value.stage, caught.value.reason) == ("source", reason)


def test_options_and_roots_that_are_wrong_are_refused(tmp_path: Path) -> None:
    write_tree(tmp_path)
    with pytest.raises(ConfigError, match="furnitur"):
        list(suncg.find(str(tmp_path), furnitur="yes"))
    with pytest.raises(Rejection, match="house"):
        list(suncg.find(str(tmp_path / "room")))


# The small OBJ reader: equal to trimesh's loader on what houses are made of, strict about all else.


def _triangles(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return all triangles' corners (n, 9), sorted, so that neither order nor welding matters."""
    flat = vertices[faces].reshape(-1, 9).round(6)
    return flat[np.lexsort(flat.T)]


def test_equals_trimesh_on_all_files_of_generated_houses(tmp_path: Path) -> None:
    write_houses(tmp_path, 4, seed=5)
    paths = sorted(tmp_path.glob("room/*/*.obj"))
    assert len(paths) > 20
    for path in paths:
        ours = obj.parse_plain_obj(path.read_bytes(), path.name)
        theirs = trimesh.load_mesh(path, process=False, maintain_order=True, skip_materials=True)
        assert np.array_equal(_triangles(ours.vertices, ours.faces), _triangles(theirs.vertices, theirs.faces))


@pytest.mark.parametrize("corner", ["{}", "{}/1", "{}//1", "{}/1/1"])
def test_takes_every_way_to_write_a_corner(corner: str) -> None:
    face = " ".join(corner.format(i) for i in (1, 2, 3, 4))
    mesh = obj.parse_plain_obj(f"v 0 0 0\nv 1\t0 0\r\nv 1 1 0\nv 0 1 0\nvt 0 0\nf {face}\n".encode(), "a")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_a_corner_written_otherwise_than_the_rest_is_read_as_it_stands() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 2/2 3/3\nf 2/2/2 3/ 1/1\nf 3 1/9 2//7\n"
    assert obj.parse_plain_obj(text.encode(), "a").faces.tolist() == [[0, 1, 2], [1, 2, 0], [2, 0, 1]]


def test_triangles_and_larger_polygons_mix() -> None:
    mesh = obj.parse_plain_obj(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0.5 0\nf 1 2 3\nf 1 2 5 3 4\n", "a")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 4], [0, 4, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("text", "reason", "says"),
    [
        ("", Reason.EMPTY, "is empty"),
        ("hello\n", Reason.UNREADABLE, "found none"),
        ("v 0 0 0\n", Reason.EMPTY, "no faces"),
        ("v 0 0\nv 1 0\nv 1 1\nf 1 2 3\n", Reason.UNREADABLE, "expected 3 numbers"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\n", Reason.UNREADABLE, "'f 1 2'"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n", Reason.UNREADABLE, "vertex 4 of 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 c\n", Reason.UNREADABLE, "expected vertex numbers"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 /2 3/3\n", Reason.UNREADABLE, "expected vertex numbers"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 99999999999999999999 2 3\n", Reason.UNREADABLE, "of 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 99999999999999999999 2 3 1\n", Reason.UNREADABLE, "a face names"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 1e999\nf 1 2 3\n", Reason.NOT_FINITE, "vertex 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 2 2 0\nf 1 2 3\n", Reason.UNREADABLE, "breaks off"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3", Reason.UNREADABLE, "breaks off"),
    ],
)
def test_says_what_is_wrong(text: str, reason: Reason, says: str) -> None:
    with pytest.raises(Rejection) as caught:
        obj.parse_plain_obj(text.encode(), "wall.obj")
    assert caught.value.reason == reason
    assert says in caught.value.detail
    assert "wall.obj" in caught.value.detail


def test_a_closed_mesh_may_end_without_a_line_end() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4"
    assert len(obj.parse_plain_obj(text.encode(), "a").faces) == 4


def test_finds_the_material_file() -> None:
    assert obj.read_mtllib_name(b"# a\nmtllib two words.mtl\r\nv 0 0 0\n") == "two words.mtl"
    assert obj.read_mtllib_name(b"v 0 0 0\n# mtllib none\n") is None
