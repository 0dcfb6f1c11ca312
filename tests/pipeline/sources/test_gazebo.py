import math

import numpy as np
import pytest

from pipeline.geometry.meshes import Bodies
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, gazebo
from tests.builders.batch import lines, run_build
from tests.builders.damage import outcome
from tests.builders.formats.gazebo import WALLS, box, cube, house, model, part, world
from tests.builders.houses import kinds, levels_of, plan_of
from tests.builders.meshes import as_trimesh, joined, one_level
from tests.builders.meshes import box as corners


def one(tmp_path, *parts, **options):
    file = tmp_path / "house.world"
    file.write_text(world(*parts))
    (level,) = levels_of(file, **options)
    return level


def bounds(mesh):
    return np.concatenate([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])


def rejected(tmp_path, text, **options):
    file = tmp_path / "house.world"
    file.write_text(text)
    found = outcome(file, **options)
    assert isinstance(found, Rejection)
    return found


def test_walls_of_boxes_give_rooms_and_the_door(tmp_path):
    level = one(tmp_path, house())
    assert bounds(level.walls) == pytest.approx([-0.2, -0.2, 0.0, 7.4, 3.2, 2.5])  # the ground is no part of it
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.01)
    assert kinds(plan) == ["door"]


def test_a_world_is_known_by_its_content(tmp_path):
    file = tmp_path / "anything.xyz"
    file.write_text(world(house()))
    assert [item.reader for item in find(str(file))] == ["gazebo"]


def test_poses_turn_and_add_up_through_models_links_and_frames(tmp_path):
    link = (
        f"<link name='l'><pose relative_to='f'>1 0 0 0 0 0</pose>{box('v', (4.0, 0.2, 2.5), '0 0 1.25 0 0 0')}</link>"
    )
    frame = f"<frame name='f'><pose>0 0 0 0 0 {math.pi / 2}</pose></frame>"
    inner = f"<model name='inner'><pose>10 0 0 0 0 0</pose>{frame}{link}</model>"
    outer = f"<model name='outer'><static>1</static><pose>0 5 0 0 0 0</pose>{inner}</model>"
    level = one(tmp_path, outer)
    assert bounds(level.walls) == pytest.approx([9.9, 4.0, 0.0, 10.1, 8.0, 2.5])


def test_a_model_in_a_model_as_gazebo_saves_it_has_frames_with_its_name(tmp_path):
    frame = "<frame name='in::__model__' attached_to='in::l'><pose relative_to='__model__'>10 0 0 0 0 0</pose></frame>"
    shape = box("v", (4.0, 0.2, 2.5), "0 0 1.25 0 0 0")
    link = f"<link name='in::l'><pose relative_to='in::__model__'>1 0 0 0 0 0</pose>{shape}</link>"
    level = one(tmp_path, f"<model name='saved'><static>1</static><pose>0 5 0 0 0 0</pose>{frame}{link}</model>")
    assert bounds(level.walls) == pytest.approx([9.0, 4.9, 0.0, 13.0, 5.1, 2.5])


def polyline(name, height, *points):
    ring = "".join(f"<point>{x} {y}</point>" for x, y in points)
    return f"<visual name='{name}'><geometry><polyline>{ring}<height>{height}</height></polyline></geometry></visual>"


def test_pieces_of_a_link_that_touch_and_are_equally_high_are_one_body(tmp_path):
    pieces = polyline("a", 2.5, (0.0, 0.0), (4.0, 0.01), (4.0, 0.2)) + polyline(
        "b", 2.5, (0.0, 0.0), (4.0, 0.2), (0.0, 0.2)
    )
    lower = polyline("c", 1.0, (5.0, 0.0), (8.0, 0.0), (8.0, 0.2), (5.0, 0.2))
    apart = box("d", (4.0, 0.2, 2.5), "2 3 1.25 0 0 1.5")
    tilted = box("e", (4.0, 0.2, 2.5), "12 0 2 0 1.5707963 0")
    link = f"<link name='l'>{pieces}{lower}{apart}{tilted}</link>"
    level = one(tmp_path, f"<model name='m'><static>1</static><pose>0 5 0 0 0 0</pose>{link}</model>")
    bodies = Bodies.of(level.walls)
    boxes = sorted(
        (float(low[0]), float(high[0]), float(high[2] - low[2]))
        for low, high in zip(bodies.low, bodies.high, strict=True)
    )
    assert [each[2] for each in boxes] == pytest.approx([2.5, 2.5, 1.0, 4.0])
    assert boxes[0][:2] == pytest.approx((0.0, 4.0))
    assert boxes[3][:2] == pytest.approx((10.75, 13.25))


def test_quaternions_degrees_and_placement_frames(tmp_path):
    link = f"<link name='l'><pose>3 0 0 0 0 0</pose>{box('v', (4.0, 0.2, 2.5), '0 0 1.25 0 0 0')}</link>"
    for pose in ("<pose degrees='true'>0 0 0 0 0 90</pose>", "<pose rotation_format='quat_xyzw'>0 0 0 0 0 1 1</pose>"):
        level = one(tmp_path, f"<model name='m' placement_frame='l'><static>1</static>{pose}{link}</model>")
        assert bounds(level.walls) == pytest.approx([-0.1, -2.0, 0.0, 0.1, 2.0, 2.5])


def test_movable_and_low_inner_models_are_furniture_a_door_is_a_leaf(tmp_path):
    level = one(
        tmp_path,
        house(),
        cube("cart", "1 1 0.3 0 0 0", static=False),
        cube("shelf", "5 1 0.3 0 0 0"),
        cube("tower", "5 2 1.25 0 0 0", size=2.5),
        cube("front_door", "2 0 0.5 0 0 0"),
        cube("outdoor_bench", "1 2 0.3 0 0 0"),
    )
    assert [each.words for each in level.furniture] == [("cart",), ("shelf",), ("outdoor_bench",)]
    assert [each.words for each in level.leaves] == [("front_door",)]
    assert bounds(level.furniture[1].mesh) == pytest.approx([4.7, 0.7, 0.0, 5.3, 1.3, 0.6])


def floor(name, corners):
    return f"<model name='{name}'><static>1</static><link name='l'>{part(0, corners)}</link></model>"


def test_floors_of_rooms_and_thresholds_are_no_furniture(tmp_path):
    level = one(
        tmp_path,
        house(),
        floor("kitchen_floor", (0.0, 0.0, 0.0, 4.0, 3.0, 0.01)),
        floor("rug", (4.5, 0.5, 0.0, 6.0, 2.0, 0.01)),
        floor("door_threshold", (4.0, 1.0, 0.0, 4.2, 1.9, 0.01)),
        floor("dead_threshold", (4.0, 2.0, 0.0, 4.2, 2.9, 0.01)),
    )
    assert not level.furniture
    assert [(room.labels, round(room.polygon.area, 2)) for room in level.rooms] == [(("Kitchen",), 12.0)]
    (opening,) = level.openings
    assert opening.polygon.bounds == pytest.approx((4.0, 1.0, 4.2, 1.9))
    plan = plan_of(level)
    assert sorted(room.label for room in plan.rooms) == ["Kitchen", "Unlabelled"]
    assert kinds(plan) == ["door"]


def test_a_door_that_the_building_editor_built_of_walls_is_a_wall(tmp_path):
    wall = f"<link name='Wall_1'>{box('v', (0.1, 3.0, 2.5), '2 1.5 1.25 0 0 0')}</link>"
    level = one(tmp_path, house(), f"<model name='door_edited'><static>1</static>{wall}</model>")
    assert not level.leaves
    assert sorted(room.area for room in plan_of(level).rooms) == pytest.approx([5.85, 5.85, 9.0], rel=0.02)


@pytest.mark.parametrize(
    ("name", "link", "leaves"), [("house_2", "door", 1), ("house_2", "d", 0), ("fridge", "door", 0)]
)
def test_a_link_called_door_is_a_leaf_unless_its_model_is_furniture(tmp_path, name, link, leaves):
    """The leaf stands at the face of the outer wall, in which nobody cut a hole."""
    of_link = f"<link name='{link}'>{box('v', (0.9, 0.06, 2.0), '2 -0.21 1 0 0 0')}</link>"
    beside = f"<link name='step'>{box('v', (0.9, 0.3, 0.1), '2 -0.4 0.05 0 0 0')}</link>"
    level = one(tmp_path, house(), f"<model name='{name}'><static>1</static>{of_link}{beside}</model>")
    assert len(level.leaves) == leaves
    assert kinds(plan_of(level)) == ["door", "entrance"][: 1 + leaves]


@pytest.mark.parametrize("high", [0.15, 1.0])
def test_low_walls_stand_for_walls_of_full_height_and_that_is_a_guess(tmp_path, high):
    walls = [(x1, y1, 0.0, x2, y2, high) for x1, y1, bottom, x2, y2, _ in WALLS if bottom == 0.0]
    parts = "".join(part(k, wall) for k, wall in enumerate(walls))
    low = f"<model name='house'><static>true</static><link name='walls'>{parts}</link></model>"
    level = one(tmp_path, low, cube("crate", "1 1 0.05 0 0 0", size=0.1))
    assert level.guesses == ("wall height",)
    assert level.provenance["wall_height"] == f"stretched from {high:.2f} m to 2.5 m"
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.01)
    assert kinds(plan) == ["opening"]


def test_the_saved_state_says_where_a_model_stands(tmp_path):
    state = "<state world_name='w'><model name='cart'><pose>2 2 0.3 0 0 0</pose></model></state>"
    level = one(tmp_path, house(), cube("cart", "1 1 0.3 0 0 0", static=False), state)
    assert bounds(level.furniture[0].mesh) == pytest.approx([1.7, 1.7, 0.0, 2.3, 2.3, 0.6])


def test_the_fuller_of_visual_and_collision_counts(tmp_path):
    plain = box("c", (7.6, 3.4, 2.5), "3.6 1.5 1.25 0 0 0", "collision")
    level = one(tmp_path, house().replace("</link>", f"{plain}</link>"))
    assert len(plan_of(level).rooms) == 2
    missing = "<visual name='m'><geometry><mesh><uri>model://none/a.dae</uri></mesh></geometry></visual>"
    level = one(tmp_path, house(), cube("cart", "1 1 0.3 0 0 0").replace("</link>", f"{missing}{plain}</link>"))
    assert bounds(level.walls)[3] > 7.0
    assert level.provenance["missing"] == "model://none/a.dae"


def test_models_are_found_in_the_folder_and_on_the_model_path(tmp_path, monkeypatch):
    file = tmp_path / "src" / "house.world"
    model(tmp_path / "src" / "deep" / "models", "walls", house())
    model(tmp_path / "far", "cart", cube("cart", "0 0 0.3 0 0 0", static=False))
    include = "<include><uri>model://{}</uri><pose>1 1 0 0 0 0</pose></include>"
    file.write_text(world(include.format("walls"), include.format("cart")))
    (level,) = levels_of(file)
    assert bounds(level.walls)[:2] == pytest.approx([0.8, 0.8])
    assert level.provenance["missing"] == "model://cart"
    (level,) = levels_of(file, model_path=str(tmp_path / "far"))
    assert len(level.furniture) == 1
    assert "missing" not in level.provenance
    monkeypatch.setenv("GZ_SIM_RESOURCE_PATH", str(tmp_path / "far"))
    assert len(levels_of(file)[0].furniture) == 1


def test_a_folder_gives_its_worlds_and_not_their_models_nor_these_models_meshes(tmp_path):
    file = model(tmp_path / "models", "walls", house())
    as_trimesh(one_level()).export(file.parent / "mesh.ply")
    assert [item.id for item in find(str(tmp_path))] == ["models_walls_model"]
    (tmp_path / "a.world").write_text(world("<include><uri>model://walls</uri></include>"))
    assert [item.id for item in find(str(tmp_path))] == ["a"]


def test_meshes_are_scaled_and_placed(tmp_path):
    as_trimesh(one_level()).export(tmp_path / "walls.ply")
    mesh = "<geometry><mesh><uri>walls.ply</uri><scale>0.5 1 1</scale></mesh></geometry>"
    model_ = f"<model name='m'><static>1</static><link name='l'><visual name='v'>{mesh}</visual></link></model>"
    level = one(tmp_path, model_)
    own = bounds(one_level())
    assert bounds(level.walls)[[0, 1, 3, 4]] == pytest.approx(own[[0, 1, 3, 4]] * [0.5, 1, 0.5, 1])


def test_a_corner_of_a_mesh_that_lies_far_away_costs_its_faces_alone(tmp_path):
    table_top = as_trimesh(joined([corners((2.0, 2.0, 3.0, 3.0), 0.7, 0.75)]))
    table_top.vertices[0] *= 1e6
    as_trimesh(joined([as_trimesh(one_level()), table_top])).export(tmp_path / "walls.ply")
    mesh = "<geometry><mesh><uri>walls.ply</uri></mesh></geometry>"
    level = one(
        tmp_path, f"<model name='m'><static>1</static><link name='l'><visual name='v'>{mesh}</visual></link></model>"
    )
    assert bounds(level.walls) == pytest.approx(bounds(one_level()))
    assert "walls.ply: " in level.provenance["left_out"]
    assert "far away" in level.provenance["left_out"]


@pytest.mark.parametrize("uri", ["file://models/walls/meshes/m.ply", "file://walls/meshes/m.ply"])
def test_a_file_is_looked_for_in_the_model_folders_too(tmp_path, uri):
    mesh = f"<geometry><mesh><uri>{uri}</uri></mesh></geometry>"
    model_ = f"<model name='m'><static>1</static><link name='l'><visual name='v'>{mesh}</visual></link></model>"
    file = model(tmp_path / "models", "walls", model_)
    (file.parent / "meshes").mkdir()
    as_trimesh(one_level()).export(file.parent / "meshes" / "m.ply")
    (tmp_path / "worlds").mkdir()
    (tmp_path / "worlds" / "house.world").write_text(world("<include><uri>model://walls</uri></include>"))
    (level,) = levels_of(tmp_path / "worlds" / "house.world", model_path=str(tmp_path / "models"))
    assert bounds(level.walls) == pytest.approx(bounds(one_level()))
    assert "missing" not in level.provenance


@pytest.mark.parametrize(
    "uri",
    ["model://../out", "file://../out/m.ply", "../out/m.ply", "https://host/m.ply", "file:///etc/m.ply", "link.ply"],
)
def test_what_leaves_the_folder_or_names_a_host_is_left_out(tmp_path, uri):
    (tmp_path / "out").mkdir()
    (tmp_path / "in").mkdir()
    as_trimesh(one_level()).export(tmp_path / "out" / "m.ply")
    (tmp_path / "in" / "link.ply").symlink_to(tmp_path / "out" / "m.ply")
    mesh = f"<visual name='m'><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual>"
    level = one(tmp_path / "in", house(), cube("cart", "1 1 0.3 0 0 0").replace("</link>", f"{mesh}</link>"))
    assert level.provenance["missing"] == (uri if "model:" in uri or "https" in uri else uri.rpartition("/")[2])
    assert str(tmp_path) not in str(level.provenance)


def test_a_model_that_includes_itself_is_rejected(tmp_path):
    include = "<include><uri>model://{}</uri></include>"
    model(tmp_path, "a", f"<model name='a'>{include.format('b')}</model>")
    model(tmp_path, "b", f"<model name='b'>{include.format('a')}</model>")
    found = rejected(tmp_path, world(include.format("a")))
    assert "includes itself" in found.detail


@pytest.mark.slow
def test_models_that_multiply_are_too_many(tmp_path):
    for k in range(15):
        inner = f"<include><uri>model://m{k + 1}</uri></include>" * 3
        model(tmp_path, f"m{k}", f"<model name='m{k}'>{inner}</model>")
    model(tmp_path, "m15", cube("c", "0 0 0 0 0 0"))
    found = rejected(tmp_path, world("<include><uri>model://m0</uri></include>"))
    assert found.reason is Reason.TOO_LARGE


@pytest.mark.parametrize(
    "text",
    [
        "<!DOCTYPE sdf [<!ENTITY a 'b'>]><sdf><world>&a;</world></sdf>",
        "<!DOCTYPE sdf [<!ENTITY x SYSTEM 'file:///etc/hostname'>]><sdf><world>&x;</world></sdf>",
        "<sdf>" + "<model name='a'>" * 3000,
        "<sdf><world name='w'></world></sdf>",
        world(house(pose="0 0 nan 0 0 0")),
        world(house(pose="1 2")),
        world(house(pose="1e300 0 0 0 0 0")),
        world(house(inner="<frame name='a' attached_to='b'/><frame name='b' attached_to='a'/>")
              .replace("<link name='walls'>", "<link name='walls'><pose relative_to='a'/>")),
        world(house()).replace("<size>0.2", "<size>-0.2"),
    ],
)  # fmt: skip
def test_bad_worlds(tmp_path, text):
    rejected(tmp_path, text)


def _include(name):
    return f"<include><uri>model://{name}</uri></include>"


def _mesh(uri):
    return f"<visual name='m'><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual>"


@pytest.mark.parametrize(
    "after", ["<sdf version='1.7'/>", "<?xml version='1.0'?>\n<sdf version='1.7'/>", "</sdf>", "and so on"]
)
def test_what_follows_the_first_document_is_left_out(tmp_path, after):
    file = tmp_path / "house.world"
    file.write_text(world(house()) + after)
    (level,) = gazebo.read(next(gazebo.find(str(file))))
    assert kinds(plan_of(level)) == ["door"]
    assert "what follows the first document in house.world, from line" in level.provenance["left_out"]


@pytest.mark.parametrize("up", ["Y_UP", "Z_UP"])
def test_the_up_axis_of_a_collada_mesh_does_not_turn_it(tmp_path, up):
    """Gazebo's loader of COLLADA does not read it (gazebo-classic, issue 1305)."""
    text = as_trimesh(one(tmp_path, house()).walls).export(file_type="dae").decode()
    (tmp_path / "walls.dae").write_text(text.replace("Y_UP", up))
    level = one(tmp_path, f"<model name='m'><static>1</static><link name='l'>{_mesh('walls.dae')}</link></model>")
    assert bounds(level.walls) == pytest.approx([-0.2, -0.2, 0.0, 7.4, 3.2, 2.5])


def _beside(tmp_path, fault):
    """A cart whose file has a fault, beside a house that has none; what the world says of it, and what it is."""
    cart = cube("cart", "1 1 0.3 0 0 0", static=False)
    folder = model(tmp_path, "cart", cart).parent
    if fault == "an unescaped & in its config":
        (folder / "model.config").write_text("<model><name>A & B</name><sdf>model.sdf</sdf></model>")
    elif fault == "a mesh without faces":
        (tmp_path / "none.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
        return cart.replace("</link>", f"{_mesh('none.obj')}</link>"), "none.obj holds no face"
    elif fault == "a mesh that is garbage":
        (tmp_path / "bad.dae").write_bytes(b"<COLLADA><library")
        return cart.replace("</link>", f"{_mesh('bad.dae')}</link>"), "bad.dae cannot be read as dae"
    elif fault == "a file that is no XML":
        (folder / "model.sdf").write_text("<sdf><model>")
        return _include("cart"), "model.sdf is no XML"
    elif fault == "a size below zero":
        return cart.replace("<size>0.", "<size>-0."), "expected 0 m or more"
    elif fault == "an impossible pose":
        return cart.replace("<pose>1 1 0.3 0 0 0", "<pose>1e300 0 0 0 0 0"), "pose"
    return _include("cart"), ""


@pytest.mark.parametrize(
    "fault",
    [
        "an unescaped & in its config",
        "a mesh without faces",
        "a mesh that is garbage",
        "a file that is no XML",
        "a size below zero",
        "an impossible pose",
    ],
)
def test_a_fault_costs_the_model_that_it_is_in(tmp_path, fault):
    words, note = _beside(tmp_path, fault)
    level = one(tmp_path, house(), words)
    assert kinds(plan_of(level)) == ["door"]
    assert note in level.provenance.get("left_out", "")
    assert str(tmp_path) not in str(level.provenance)


def test_a_rejection_names_what_was_missing(tmp_path):
    (tmp_path / "in").mkdir()
    link = f"<link name='l'>{box('v', (0.2, 0.2, 2.5), '0 0 1.25 0 0 0')}</link>"
    wall = f"<model name='post'><static>1</static>{link}</model>"
    (tmp_path / "in" / "house.world").write_text(world(wall, _include("wall_north"), _include("wall_south")))
    run_build([tmp_path / "in"], tmp_path / "out")
    (found,) = lines(tmp_path / "out" / "rejected.jsonl")
    assert "missing: model://wall_north, model://wall_south" in found["detail"]
