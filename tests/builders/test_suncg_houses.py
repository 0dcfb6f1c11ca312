"""Procedural houses: their plans, and the files that are written for them."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from pathlib import Path
from statistics import median

import numpy as np
import pytest
import shapely
import trimesh
from shapely.affinity import scale, translate

from houseexpo.plan.room_labels import LABELS
from pipeline.sources import suncg
from pipeline.sources.meshes import obj
from pipeline.values import Level
from tests.builders.suncg_houses import write_house, write_houses
from tests.builders.suncg_houses.house import (
    DUPLICATES,
    PER_HUNDRED,
    make_house,
    original_index,
    planted_fault,
    scene_id,
    storey_plan_id,
)
from tests.builders.suncg_houses.truth import TrueArea, TrueDoor, TrueRoom, Truth, storey_truth

SEED, COUNT = 11, 150


def _truths(index: int, seed: int) -> list[Truth]:
    house = make_house(index, seed)
    return [storey_truth(storey, storey_plan_id(house.id, k), k, 0.0) for k, storey in enumerate(house.storeys)]


@pytest.fixture(scope="module")
def houses() -> list[list[Truth]]:
    return [_truths(index, SEED) for index in range(COUNT)]


@pytest.fixture(scope="module")
def plans(houses: list[list[Truth]]) -> list[Truth]:
    return [truth for levels in houses for truth in levels if truth.expected == "plan"]


def _polygon(area: TrueArea | TrueRoom) -> shapely.Polygon:
    return shapely.Polygon(area.polygon, area.holes)


def _free(truth: Truth) -> shapely.Geometry:
    """Return the free space with its lower left corner at the origin."""
    free = shapely.union_all([_polygon(area) for area in truth.outline])
    return translate(free, -free.bounds[0], -free.bounds[1])


def _share(houses: list[list[Truth]], feature: str) -> float:
    return sum(any(feature in name for name in levels[0].features) for levels in houses) / len(houses)


@pytest.mark.slow
def test_number_of_rooms_is_that_of_published_plans(plans: list[Truth]) -> None:
    numbers = [truth.room_num for truth in plans]
    assert 6 <= median(numbers) <= 8
    assert min(numbers) == 1
    assert max(numbers) >= 20


@pytest.mark.slow
def test_labels_are_drawn_from_published_counts(plans: list[Truth]) -> None:
    published = {"Bedroom": 0.180, "Room": 0.159, "Bathroom": 0.134, "Toilet": 0.116, "Kitchen": 0.096, "Office": 0.050}
    found = Counter(label for truth in plans for room in truth.rooms for label in room.labels)
    assert set(found) <= set(LABELS)
    assert len(found) >= 18
    for label, share in published.items():
        assert found[label] / found.total() == pytest.approx(share, abs=0.05)
    assert any(not room.labels for truth in plans for room in truth.rooms)
    assert any(len(room.labels) == 2 for truth in plans for room in truth.rooms)


def test_rooms_are_as_large_as_their_use_asks(plans: list[Truth]) -> None:
    def typical(label: str) -> float:
        return median(_polygon(r).area for truth in plans for r in truth.rooms if r.labels == [label])

    assert 2 < typical("Toilet") < typical("Bathroom") < typical("Bedroom") < typical("Living_Room") < 35


def test_shapes_that_the_data_set_has(houses: list[list[Truth]], plans: list[Truth]) -> None:
    assert _share(houses, "loop") >= 0.25
    assert _share(houses, "ring") >= 0.15
    assert _share(houses, "oblique") >= 0.10
    assert _share(houses, "wing") >= 0.2
    assert sum(len(levels) > 1 for levels in houses) >= 0.05 * COUNT
    looped = [any(area.holes for area in truth.outline) for truth in plans]
    assert looped == ["loop" in truth.features for truth in plans]


def test_each_difficulty_has_its_share_and_half_the_houses_are_sound(houses: list[list[Truth]]) -> None:
    planted = Counter(name for levels in houses for name in levels[0].difficulties)
    assert sum(not levels[0].difficulties for levels in houses) >= 0.5 * COUNT
    for name in PER_HUNDRED:
        if name not in DUPLICATES:
            assert planted[name] >= 0.03 * COUNT, name
    assert planted["exact_duplicate"] >= 0.03 * COUNT
    assert sum(planted[name] for name in DUPLICATES if name != "exact_duplicate") >= 0.03 * COUNT


def test_every_room_can_be_reached_unless_its_door_was_left_out(plans: list[Truth]) -> None:
    for truth in plans:
        cuts = int("no_door" in truth.difficulties)
        assert (truth.cuts, len(truth.outline)) == (cuts, cuts + 1)
        standing = shapely.get_parts(_free(truth).buffer(-0.2))
        assert sum(part.area > 0.5 for part in standing) == cuts + 1


def test_closed_cells_are_small_and_said_to_be_filled(plans: list[Truth]) -> None:
    for truth in plans:
        cells = [_polygon(area) for area in truth.filled]
        assert bool(cells) == ("closed_cell" in truth.difficulties)
        assert all(0.05 < cell.area < 2.0 and cell.intersection(_free(truth)).area < 1e-6 for cell in cells)


def test_a_garage_apart_is_far_and_small(plans: list[Truth]) -> None:
    for truth in plans:
        assert bool(truth.erased) == ("garage_apart" in truth.difficulties)
        for area in truth.erased:
            main = shapely.union_all([_polygon(part) for part in truth.outline])
            assert _polygon(area).distance(main) - 0.2 > 2.0  # less a wall on either side
            assert _polygon(area).area < 0.25 * main.area


def test_scenes_without_a_layout_expect_rejection(houses: list[list[Truth]]) -> None:
    expected = {name: truth.expected for levels in houses for truth in levels for name in truth.difficulties}
    assert expected["objects_only"] == "rejected:no_layout"
    assert expected["characters"] == "rejected:characters"


@pytest.mark.parametrize("kind", DUPLICATES)
def test_duplicates_repeat_an_earlier_sound_house(kind: str) -> None:
    index = next(k for k in range(COUNT) if planted_fault(k, SEED) == kind)
    source = original_index(index, SEED)
    assert source < index
    assert planted_fault(source, SEED) == "sound"
    for copy, original in zip(_truths(index, SEED), _truths(source, SEED), strict=True):
        assert copy.expected == f"duplicate_of:{original.id}"
        a, b = _free(copy), _free(original)
        if kind == "mirrored_duplicate":
            a = scale(a, -1, 1, origin=a.centroid)
            a = translate(a, -a.bounds[0], -a.bounds[1])
        difference = a.symmetric_difference(b).area / max(a.area, b.area)
        assert difference < 0.01
        assert (difference > 1e-4) == (kind == "jittered_duplicate")


def test_a_house_depends_on_its_number_and_the_seed_alone() -> None:
    assert scene_id(3, 1) != scene_id(3, 2) != scene_id(4, 2)
    assert _truths(40, 1)[0].to_json() == _truths(40, 1)[0].to_json()
    assert _truths(40, 1)[0].to_json() != _truths(40, 2)[0].to_json()


# Houses on disk: SUNCG's layout, the same bytes for the same seed, closed slabs with its heights, rooms as true.


SCENE_COUNT, SCENE_SEED = 20, 2


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    write_houses(folder, SCENE_COUNT, SCENE_SEED)
    return folder


@pytest.fixture(scope="module")
def levels(root: Path) -> dict[str, Level]:
    found = [level for item in suncg.find(str(root)) for level in suncg.read(item)]
    return {level.id: level for level in found if isinstance(level, Level)}


@pytest.fixture(scope="module")
def truths(tmp_path_factory: pytest.TempPathFactory) -> list[Truth]:
    folder = tmp_path_factory.mktemp("again")
    return [truth for index in range(SCENE_COUNT) for truth in write_house(folder, index, SCENE_SEED)]


def _scene_polygon(room: TrueRoom) -> shapely.Polygon:
    return shapely.Polygon(room.polygon, room.holes)


def _digest(folder: Path, pattern: str) -> str:
    files = sorted(path for path in folder.glob(pattern) if path.is_file())
    return hashlib.sha256(b"".join(path.name.encode() + path.read_bytes() for path in files)).hexdigest()


def test_a_house_is_the_same_whatever_others_are_made(root: Path, tmp_path: Path) -> None:
    write_house(tmp_path, 17, SCENE_SEED)
    name = scene_id(17, SCENE_SEED)
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
            assert floor.buffer(1e-3).covers(_scene_polygon(room))


def test_slabs_are_closed_and_as_thick_and_high_as_suncgs(root: Path) -> None:
    for path in sorted(root.glob("room/*/*w.obj"))[:20]:
        mesh = obj.parse_plain_obj(path.read_bytes(), path.name)
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
        rooms = [_scene_polygon(room) for room in truth.rooms]
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
        rooms = [_scene_polygon(room) for room in truth.rooms]
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
    index = next(k for k in range(200) if planted_fault(k, SCENE_SEED) == kind)
    truth = write_house(tmp_path, index, SCENE_SEED)[0]
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
    rim = shapely.union_all([_scene_polygon(room).buffer(0.05, join_style="mitre") for room in truth.rooms]).boundary
    return float(rim.difference(shapely.union_all(feet).buffer(0.02)).length)
