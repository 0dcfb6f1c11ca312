import pytest
import shapely

from pipeline.rejection import Reason, Rejection
from tests.builders.damage import outcome
from tests.builders.formats.front3d import BEDROOM, LIVING, box, mesh, room, scene, write
from tests.builders.houses import kinds, levels_of, plan_of


def one(tmp_path, value):
    (level,) = levels_of(write(tmp_path / "scene.json", value))
    return level


def flipped(rectangle):
    x1, z1, x2, z2 = rectangle
    return (x1, -z2, x2, -z1)


def test_rooms_doors_and_frame_are_the_files_own(tmp_path):
    level = one(tmp_path, scene())
    living, bedroom = level.rooms
    assert (living.words, living.labels) == (("LivingDiningRoom",), ("Living_Room", "Dining_Room"))
    assert (bedroom.labels, bedroom.polygon.bounds) == (("Bedroom",), flipped(BEDROOM))
    between, front = level.openings  # one door, though each of its rooms has a mesh of it; the window is none
    assert between.polygon.bounds == pytest.approx((3.0, -1.9, 3.2, -1.0), abs=1e-6)
    assert front.polygon.bounds[1::2] == pytest.approx((-3.0, -2.0), abs=1e-6)
    assert (level.frame.matrix, level.frame.up, level.ceiling_m) == (((1, 0, 0), (0, -1, 0)), "y", 2.8)


def test_the_plan_has_both_rooms_the_door_and_the_entrance(tmp_path):
    plan = plan_of(one(tmp_path, scene()))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([12.0, 20.0], rel=0.01)
    assert kinds(plan) == ["door", "entrance"]
    assert {room.label for room in plan.rooms} == {"Bedroom", "Living_Room"}


def test_floors_that_meet_have_no_wall_between_them(tmp_path):
    x1, _, x2, z2 = LIVING
    kitchen = ("Kitchen", [mesh("k", "Floor", [(x1, 0, z2), (x1, 0, 6.0), (x2, 0, 6.0), (x2, 0, z2)])])
    plan = plan_of(one(tmp_path, scene(kitchen)))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([10.0, 12.0, 20.0], rel=0.01)
    assert kinds(plan) == ["door", "entrance"]


def test_a_hole_is_an_opening_and_a_flat_door_mesh_is_a_door(tmp_path):
    hall = ("Aisle", [*room("h", (0.0, 4.2, 8.2, 6.0)), box("o", "Hole", (1.0, 4.0, 2.0, 4.2), 0.0, 2.2)])
    flat = ("none", [mesh("s", "Door", [(5.0, 0.0, 4.1), (6.0, 0.0, 4.1), (6.0, 2.1, 4.1), (5.0, 2.1, 4.1)])])
    level = one(tmp_path, scene(hall, flat))
    assert [opening.has_door for opening in level.openings] == [True, True, False, True]
    assert level.openings[3].polygon.bounds == pytest.approx((5.0, -4.2, 6.0, -4.0), abs=1e-6)
    assert kinds(plan_of(level)) == ["door", "door", "entrance", "opening"]


def test_a_shaft_between_rooms_is_wall(tmp_path):
    around = [(0.0, 4.2, 3.0, 7.0), (5.0, 4.2, 8.2, 7.0), (3.0, 6.0, 5.0, 7.0)]
    more = [("Storage", room(f"s{k}", each)[:1]) for k, each in enumerate(around)]
    level = one(tmp_path, scene(*more))
    triangles = level.walls.vertices[level.walls.faces]
    solid = shapely.union_all(shapely.polygons(triangles[:, :, :2])[triangles[:, :, 2].min(axis=1) > 2.7])
    assert solid.contains(shapely.Point(4.0, -5.0))


def test_floors_of_two_storeys_are_two_levels(tmp_path):
    value = scene(("Library", [*room("u", (0.0, 0.0, 4.0, 4.0), 3.0)]))
    below, above = levels_of(write(tmp_path / "scene.json", value))
    assert [level.frame.floor for level in (below, above)] == [0.0, 3.0]
    assert [len(level.rooms) for level in (below, above)] == [2, 1]
    assert above.rooms[0].labels == ("Office",)
    assert (below.id[-3:], above.frame.level) == ("_L0", 1)


def test_furniture_stands_where_it_is_put_and_turned(tmp_path):
    (sofa,) = one(tmp_path, scene()).furniture
    assert sofa.words == ("Sofa",)
    assert shapely.MultiPoint(sofa.mesh.vertices[:, :2]).bounds == pytest.approx((5.5, -3.0, 6.5, -1.0), abs=1e-5)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda s: s.update(mesh=[]), Reason.NO_LEVEL),
        (lambda s: s["mesh"][0].update(faces=[0, 1, 99]), Reason.UNREADABLE),
        (lambda s: s["mesh"][0].update(xyz=[0.0, 1.0]), Reason.UNREADABLE),
        (lambda s: s["mesh"][0]["xyz"].__setitem__(0, 1e9), Reason.BAD_UNITS),
        (lambda s: s["scene"].update(room="x"), Reason.UNREADABLE),
    ],
)
def test_bad_scenes(tmp_path, change, reason):
    value = scene()
    change(value)
    found = outcome(write(tmp_path / "scene.json", value))
    assert isinstance(found, Rejection)
    assert found.reason is reason


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (lambda s: s["furniture"].append({"uid": "s", "bbox": [[0, 0, 0], [1, 1, 1]]}), ""),
        (lambda s: s["furniture"].append({"uid": 7}), "furniture 1: Expected `str`"),
        (lambda s: s.update(furniture={"sofa": 1}), ""),
        (lambda s: s["furniture"][0].update(size=[1e31, 1.0, 1.0]), "length of 1e+31 m"),
        (lambda s: s["scene"]["room"][0]["children"].append({"ref": None}), "child of"),
        (lambda s: s["mesh"].append({"uid": "c", "type": "Ceiling", "xyz": [0.0, 1.0], "faces": []}), "mesh c"),
        (lambda s: s["mesh"].append({"uid": "c", "type": "Ceiling", "xyz": "zero"}), "mesh 1"),
    ],
)
def test_a_fault_costs_the_part_that_it_is_in(tmp_path, change, note):
    value = scene()
    value["furniture"] = [{"uid": "bed", "size": [2.0, 0.5, 1.6], "category": "Bed"}]
    value["scene"]["room"][0]["children"].append({"ref": "bed", "pos": [5.0, 0.0, 1.5]})
    change(value)
    level = one(tmp_path, value)
    assert len(level.rooms) == 2
    assert note in level.provenance.get("left_out", "")
    assert bool(level.provenance.get("left_out")) == bool(note)
