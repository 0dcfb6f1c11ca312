import json
import struct
import sys
import zipfile

import numpy as np
import pytest
import shapely

from houseexpo.errors import MissingDependencyError
from pipeline.rejection import Reason, Rejection
from pipeline.sources import roomplan
from tests.builders.damage import outcome
from tests.builders.formats.roomplan import FLOOR, HEIGHT, bodies_usda, home, pack, room, surface, usda, whole, write
from tests.builders.houses import kinds, levels_of, plan_of
from tests.builders.meshes import one_level, y_up


def one(tmp_path, value):
    (level,) = levels_of(write(tmp_path / "scan.json", value))
    return level


def test_rooms_doors_and_frame_are_the_files_own(tmp_path):
    level = one(tmp_path, home())
    bedroom, kitchen = level.rooms
    assert bedroom.polygon.bounds == pytest.approx((0.0, -4.0, 3.0, 0.0))
    assert (kitchen.words, kitchen.labels) == (("kitchen",), ("Kitchen",))
    between, front = level.openings  # both rooms have the door; the windows are none
    assert between.polygon.bounds == pytest.approx((3.0, -1.9, 3.12, -1.0), abs=1e-6)
    assert front.polygon.bounds[1::2] == pytest.approx((-3.2, -2.0), abs=1e-6)
    assert [each.has_door for each in level.openings] == [True, False]
    assert (level.frame.matrix, level.frame.up) == (((1, 0, 0), (0, -1, 0)), "y")
    assert (level.frame.floor, level.ceiling_m) == pytest.approx((FLOOR, HEIGHT))


@pytest.mark.parametrize("floors", [True, False])
def test_the_plan_has_both_rooms_the_door_and_the_entrance(tmp_path, floors):
    plan = plan_of(one(tmp_path, home(floors)))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 20.0], rel=0.015)
    assert kinds(plan) == ["door", "entrance"]
    assert {room.label for room in plan.rooms} == {"Bedroom", "Kitchen"}


def test_a_wall_inside_a_floor_divides_it_and_sections_name_what_it_makes(tmp_path):
    plan = plan_of(one(tmp_path, whole()))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 20.0], rel=0.02)
    assert {room.label for room in plan.rooms} == {"Bedroom", "Living_Room"}
    assert kinds(plan) == ["door"]
    plan = plan_of(one(tmp_path, whole(divided=False)))
    assert [room.area for room in plan.rooms] == pytest.approx([32.0], rel=0.01)


def test_a_wall_divides_a_room_of_which_no_floor_was_found(tmp_path):
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    corners = [(0.0, 0.0), (7.0, 0.0), (7.0, 4.0), (4.0, 4.0), (4.0, 6.0), (0.0, 6.0)] @ turn
    inner, door = [(4.0, 0.0), (4.0, 4.0)] @ turn, [(4.0, 1.5), (4.0, 2.4)] @ turn
    walls = [surface("wall", corners[k - 1], corners[k]) for k in range(6)] + [surface("wall", *inner)]
    plan = plan_of(one(tmp_path, {"walls": walls, "doors": [surface("door", *door, 0.0, 2.0)]}))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 24.0], rel=0.02)
    assert kinds(plan) == ["door"]


def test_an_object_is_furniture(tmp_path):
    (bed,) = one(tmp_path, home()).furniture
    assert bed.words == ("bed",)
    assert shapely.MultiPoint(bed.mesh.vertices[:, :2]).bounds == pytest.approx((0.0, -1.8, 2.0, -0.2))
    assert bed.mesh.vertices[:, 2].min() == pytest.approx(0.0)


def test_two_storeys_are_two_levels(tmp_path):
    value = home()
    upper = json.loads(json.dumps(room("office", (0.0, 0.0, 3.0, 4.0))))
    for kind in ("walls", "floors", "windows"):
        for item in upper[kind]:
            item["transform"][13] += 3.0
    upper["sections"][0]["center"][1] += 3.0
    value["rooms"].append(upper)
    below, above = levels_of(write(tmp_path / "scan.json", value))
    assert (below.frame.floor, above.frame.floor) == pytest.approx((FLOOR, FLOOR + 3.0))
    assert [room.words for room in above.rooms] == [("office",)]


def test_a_usdz_says_the_same_as_the_json(tmp_path):
    pytest.importorskip("pxr")
    (level,) = levels_of(pack(tmp_path / "scan.usdz", {"scan.usda": usda(home())}))
    for found, same in zip(level.rooms, one(tmp_path, home()).rooms, strict=True):
        assert found.polygon.bounds == pytest.approx(same.polygon.bounds, abs=1e-5)
    assert len(level.furniture) == 1
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 20.0], rel=0.015)
    assert kinds(plan) == ["door", "entrance"]


def test_a_parametric_usdz_has_cubes_and_the_labels_of_its_sections(tmp_path):
    pytest.importorskip("pxr")
    (level,) = levels_of(pack(tmp_path / "scan.usdz", {"scan.usda": usda(home(), parametric=True)}))
    assert [room.labels for room in level.rooms] == [("Bedroom",), ("Kitchen",)]
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 20.0], rel=0.015)
    assert kinds(plan) == ["door", "entrance"]


@pytest.mark.parametrize("size", [None, 1.0])
def test_a_usdz_of_cubes_that_is_no_scan_is_a_mesh(tmp_path, size):
    pytest.importorskip("pxr")
    boxes = [((0, -2), (5, 0.1)), ((0, 2), (5, 0.1)), ((-2.5, 0), (0.1, 4)), ((2.5, 0), (0.1, 4))]
    cubes = "".join(
        f'def Cube "side{k}"\n{{\n{"" if size is None else f"    double size = {size}"}\n'
        f"    double3 xformOp:translate = ({x}, {y}, 1.3)\n"
        f"    double3 xformOp:scale = {tuple(each / (size or 2.0) for each in (*widths, 2.6))}\n"
        '    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]\n}\n'
        for k, ((x, y), widths) in enumerate(boxes)
    )
    scene = f'#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n{cubes}'
    (level,) = levels_of(pack(tmp_path / "model.usdz", {"a.usda": scene}))
    assert np.ptp(level.walls.vertices, axis=0) == pytest.approx([5.1, 4.1, 2.6], abs=0.11)


def test_the_openings_of_a_usdz_are_the_holes_of_its_walls(tmp_path):
    pytest.importorskip("pxr")
    way, window, french = (0, 1.0, 2.2, 0.0, 2.1), (1, 1.0, 2.0, 0.9, 2.0), (2, 2.0, 3.5, 0.0, 2.1)
    scene = bodies_usda((0.0, 0.0, 5.0, 4.0), [way, window, french], glazed=2)
    (level,) = levels_of(pack(tmp_path / "scan.usdz", {"scan.usda": scene}))
    (opening,) = level.openings
    assert not opening.has_door
    assert opening.polygon.bounds[::2] == pytest.approx((1.0, 2.2), abs=0.01)
    assert level.floor.area == pytest.approx(20.0, rel=0.01)  # less what lies under the walls
    plan = plan_of(level)
    assert [room.area for room in plan.rooms] == pytest.approx([20.0], rel=0.01)
    assert kinds(plan) == ["entrance"]


def test_a_side_of_a_floor_along_which_nothing_was_seen_is_open(tmp_path):
    value = room("kitchen", (0.0, 0.0, 5.0, 4.0), windows=[])
    del value["walls"][1]  # the right side
    value["walls"][0] = surface("wall", (0.0, 0.0), (4.8, 0.0))  # a wall that ends before its corner is closed
    level = one(tmp_path, value)
    (opening,) = level.openings
    assert opening.polygon.bounds[1::2] == pytest.approx((-4.0, 0.0), abs=0.2)
    assert kinds(plan_of(level)) == ["entrance"]


def test_an_opening_as_wide_as_the_closet_behind_it_is_kept(tmp_path):
    value = room("bathroom", (0.0, 0.0, 3.0, 4.0), windows=[])
    value["walls"] += [surface("wall", *ends) for ends in (((2.0, 0.0), (2.0, 1.0)), ((2.0, 1.0), (3.0, 1.0)))]
    value["openings"] = [surface("opening", (2.0, 0.05), (2.0, 0.95), 0.0, 1.9)]
    level = one(tmp_path, value)
    assert len(level.openings) == 1
    plan = plan_of(level)
    assert sorted(round(room.area) for room in plan.rooms) == [1, 11]
    assert kinds(plan) == ["opening"]


@pytest.mark.parametrize(("up", "unit", "scale"), [("Y", 1.0, 1.0), ("Z", 0.01, 100.0)])
def test_a_usdz_that_is_no_scan_is_a_mesh(tmp_path, up, unit, scale):
    pytest.importorskip("pxr")
    mesh = one_level() if up == "Z" else y_up(one_level())
    points = ", ".join(str(tuple(point)) for point in (mesh.vertices * scale).tolist())
    scene = (
        f'#usda 1.0\n(\n    metersPerUnit = {unit}\n    upAxis = "{up}"\n)\n'
        f'def Mesh "house"\n{{\n    point3f[] points = [{points}]\n'
        f"    int[] faceVertexCounts = {[3] * len(mesh.faces)}\n"
        f"    int[] faceVertexIndices = {mesh.faces.ravel().tolist()}\n}}\n"
    )
    (level,) = levels_of(pack(tmp_path / "model.usdz", {"a.usda": scene}))
    assert level.provenance["source"] == "mesh"
    assert np.ptp(level.walls.vertices, axis=0) == pytest.approx(np.ptp(one_level().vertices, axis=0), abs=0.5)


def test_a_usdz_may_refer_to_its_own_layers_only(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "secret.usda").write_text(usda(home()))
    for target in ("../secret.usda", str(tmp_path / "secret.usda"), "https://host/a.usda", "secret.usda"):
        layer = usda({"rooms": []}, f"(\n    prepend references = @{target}@\n)")
        found = outcome(pack(tmp_path / "scan.usdz", {"scan.usda": layer}))
        assert isinstance(found, Rejection)
        assert "not in the archive" in found.detail
    layers = {"scan.usda": usda({"rooms": []}, "(\n    prepend references = @in/a.usda@\n)"), "in/a.usda": usda(home())}
    assert len(levels_of(pack(tmp_path / "scan.usdz", layers))[0].rooms) == 2


def test_hostile_archives(tmp_path, monkeypatch):
    pytest.importorskip("pxr")
    monkeypatch.setattr("pipeline.sources.roomplan_scan.LARGEST_BYTES", 1 << 20)
    path, layer = tmp_path / "scan.usdz", usda(home())
    outside = outcome(pack(path, {"../scan.usda": layer}))
    assert isinstance(outside, Rejection)
    assert not (tmp_path.parent / "scan.usda").exists()
    data = bytearray(pack(path, {"scan.usda": layer}).read_bytes())
    place = data.rindex(b"PK\x01\x02")
    path.write_bytes(data[: place + 42] + struct.pack("<I", 12345678) + data[place + 46 :])  # where a member begins
    assert outcome(path).reason is Reason.UNREADABLE
    path.write_bytes(data[: place + 24] + struct.pack("<I", 1 << 31) + data[place + 28 :])  # how long it is
    assert outcome(path).reason in {Reason.TOO_LARGE, Reason.UNREADABLE}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scan.usda", layer + " " * (1 << 20))
    assert outcome(path).reason is Reason.TOO_LARGE


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    (item,) = roomplan.find(str(pack(tmp_path / "scan.usdz", {"a.usda": usda(home())})))
    with pytest.raises(MissingDependencyError, match="scans"):
        list(roomplan.read(item))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda s: s["rooms"].clear() or s["walls"].clear(), Reason.EMPTY),
        (lambda s: s["rooms"][0]["walls"][0].update(transform=[1.0]), Reason.UNREADABLE),
        (lambda s: s["rooms"][0]["walls"][0]["transform"].__setitem__(12, 1e9), Reason.BAD_UNITS),
        (lambda s: s["rooms"][0].update(sections=[{"label": "a", "center": []}]), Reason.UNREADABLE),
    ],
)
def test_bad_scans(tmp_path, change, reason):
    value = home()
    change(value)
    path = write(tmp_path / "scan.json", value)
    (item,) = roomplan.find(str(path))
    with pytest.raises(Rejection) as caught:
        list(roomplan.read(item))
    assert caught.value.reason is reason
