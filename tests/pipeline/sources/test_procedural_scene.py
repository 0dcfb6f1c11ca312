"""Houses on disk: SUNCG's layout, the same bytes for the same seed, closed slabs with its heights, rooms as true."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh

from pipeline.sources import suncg
from pipeline.sources.meshes import obj
from pipeline.sources.procedural import Truth, scene_id, write_house, write_houses
from pipeline.sources.procedural.house import role_of
from pipeline.sources.procedural.truth import TrueDoor, TrueRoom
from pipeline.values import Level

COUNT, SEED = 30, 2


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    write_houses(folder, COUNT, SEED)
    return folder


@pytest.fixture(scope="module")
def levels(root: Path) -> dict[str, Level]:
    found = [level for item in suncg.find(str(root)) for level in suncg.read(item)]
    return {level.id: level for level in found if isinstance(level, Level)}


@pytest.fixture(scope="module")
def truths(tmp_path_factory: pytest.TempPathFactory) -> list[Truth]:
    folder = tmp_path_factory.mktemp("again")
    return [truth for index in range(COUNT) for truth in write_house(folder, index, SEED)]


def _polygon(room: TrueRoom) -> shapely.Polygon:
    return shapely.Polygon(room.polygon, room.holes)


def _digest(folder: Path, pattern: str) -> str:
    files = sorted(path for path in folder.glob(pattern) if path.is_file())
    return hashlib.sha256(b"".join(path.name.encode() + path.read_bytes() for path in files)).hexdigest()


def test_a_house_is_the_same_whatever_others_are_made(root: Path, tmp_path: Path) -> None:
    write_house(tmp_path, 17, SEED)
    name = scene_id(17, SEED)
    assert re.fullmatch("[0-9a-f]{32}", name)
    for pattern in (f"house/{name}/*", f"room/{name}/*", f"truth/{name}*"):
        assert _digest(tmp_path, pattern) == _digest(root, pattern)


def test_every_level_reads_back_as_it_was_made(levels: dict[str, Level], truths: list[Truth]) -> None:
    assert set(levels) == {truth.id for truth in truths}
    for truth in truths:
        level = levels[truth.id]
        assert level.room_count == truth.room_num
        assert level.frame.level == truth.level
        assert (len(level.walls.faces) == 0) == (truth.expected == "rejected:no_layout")
        if len(level.walls.faces):
            assert level.frame.floor == pytest.approx(truth.floor_z)
            assert level.ceiling_m == pytest.approx(2.73)
        words = [room.words for room in level.rooms]
        assert all(tuple(room.labels) in words for room in truth.rooms)
        assert level.n_objects > 0 or truth.expected == "rejected:characters"


def test_floors_lie_under_all_rooms(levels: dict[str, Level], truths: list[Truth]) -> None:
    for truth in truths:
        for room in truth.rooms:
            floor = levels[truth.id].floor
            assert floor is not None
            assert floor.buffer(1e-3).covers(_polygon(room))


def test_slabs_are_closed_and_as_thick_and_high_as_suncgs(root: Path) -> None:
    for path in sorted(root.glob("room/*/*w.obj"))[:20]:
        mesh = obj.parse(path.read_bytes(), path.name)
        names = re.findall(r"^o Wall(?:Inside|Outside)#(\S+)$", path.read_text(), re.MULTILINE)
        slabs = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).split(only_watertight=False)
        assert len(slabs) == len(names) == 2 * len(set(names))
        for slab in slabs:
            assert slab.is_watertight
            assert slab.volume > 0
            heights = np.unique(slab.vertices[:, 1].round(6)) % 2.8
            known = [0.0, 0.04, 0.87, 2.12, 2.23, 2.73]
            assert all(np.abs(height - np.array(known)).min() < 1e-5 for height in heights)
            normal = slab.face_normals[np.argmax(slab.area_faces)]  # a slab's largest faces are its sides
            assert np.ptp(slab.vertices @ normal) == pytest.approx(0.05, abs=1e-4)


def test_doors_are_open_above_their_sills_and_join_the_rooms_they_name(
    levels: dict[str, Level], truths: list[Truth]
) -> None:
    for truth in truths:
        rooms = [_polygon(room) for room in truth.rooms]
        doors = [door for door in truth.doors if door.interior]
        if not doors:
            continue
        mesh = trimesh.Trimesh(levels[truth.id].walls.vertices, levels[truth.id].walls.faces, process=False)
        for door in doors:
            centre = shapely.Point(door.centre)
            first, second = (index for index in door.rooms if index is not None)
            for index in (first, second):
                assert rooms[index].distance(centre) < 0.05 + 0.04  # half a wall, and what a skewed one drifts
            along = np.array(door.direction) * (door.width / 2 + 0.099)
            faces = [rooms[index].buffer(0.13) for index in (first, second)]
            ends = shapely.LineString([np.array(door.centre) - along, np.array(door.centre) + along])
            assert all(face.covers(ends) for face in faces)  # 0.1 m clear of every corner
        assert _crossed(mesh, doors, 0.02) == {True}
        assert _crossed(mesh, doors, 0.2) == {False}
        assert _crossed(mesh, doors, 2.4) == {True}


def _crossed(mesh: trimesh.Trimesh, doors: list[TrueDoor], height: float) -> set[bool]:
    """Return whether a way through the middle of each door meets a wall at a height."""
    walls = trimesh.intersections.mesh_plane(mesh, plane_normal=[0, 0, 1], plane_origin=[0, 0, height])[:, :, :2]
    tree = shapely.STRtree(shapely.linestrings(walls))
    across = [np.array([-door.direction[1], door.direction[0]]) * 0.12 for door in doors]
    ways = [
        shapely.LineString([door.centre - step, door.centre + step]) for door, step in zip(doors, across, strict=True)
    ]
    return {len(tree.query(way, predicate="intersects")) > 0 for way in ways}


def test_rooms_are_disjoint_and_labels_come_first(truths: list[Truth]) -> None:
    for truth in truths:
        rooms = [_polygon(room) for room in truth.rooms]
        assert all(room.is_valid for room in rooms)
        assert sum(room.area for room in rooms) == pytest.approx(shapely.union_all(rooms).area, abs=1e-6)
        assert all(room.label == (room.labels[0] if room.labels else None) for room in truth.rooms)


def test_truth_is_written_beside_the_houses(root: Path, truths: list[Truth]) -> None:
    for truth in truths:
        written = json.loads((root / "truth" / f"{truth.id}.json").read_text())
        assert written["expected"] == truth.expected
        assert {"rooms", "doors", "zones", "floor_z", "outline", "filled", "erased", "cuts"} <= set(written)


@pytest.mark.parametrize("kind", ["open_front", "half_open_front"])
def test_an_open_front_lacks_a_wall_that_the_truth_still_draws(kind: str, tmp_path: Path) -> None:
    index = next(k for k in range(200) if role_of(k, SEED) == kind)
    truth = write_house(tmp_path, index, SEED)[0]
    (item,) = suncg.find(str(tmp_path))
    level = next(iter(suncg.read(item)))
    assert isinstance(level, Level)
    assert _unwalled(level, truth) > 1.5


def test_sound_houses_are_walled_all_round(levels: dict[str, Level], truths: list[Truth]) -> None:
    for truth in truths:
        if truth.expected != "plan" or truth.difficulties:
            continue
        assert _unwalled(levels[truth.id], truth) < 0.01


def _unwalled(level: Level, truth: Truth) -> float:
    """Return the length of the rooms' outer centre lines, in metres, on which no wall has its foot."""
    triangles = level.walls.vertices[level.walls.faces]
    feet = shapely.polygons(triangles[(triangles[:, :, 2] < 1e-6).all(axis=1)][:, :, :2])
    rim = shapely.union_all([_polygon(room).buffer(0.05, join_style="mitre") for room in truth.rooms]).boundary
    return float(rim.difference(shapely.union_all(feet).buffer(0.02)).length)
