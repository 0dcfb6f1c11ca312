"""Read drawn plans: published data sets, traffic_editor's buildings, hostile files."""

import copy
import json

import pytest
import shapely
import yaml

from houseexpo.exports import rmf
from houseexpo.plan.room_labels import UNLABELLED
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from pipeline.sources.drawn_storeys import Hole, Wall, deepen_to_wall_faces
from tests.builders.batch import plans_of
from tests.builders.damage import rejected
from tests.builders.formats import published_plans as published
from tests.builders.houses import levels_of


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_two_rooms_with_a_door_in_a_drawing_without_a_scale(tmp_path):
    """The scale is a guess: doors of 0.8 m, where they are 0.9 m wide."""
    (plan,) = plans_of(written(tmp_path / "model.svg", published.cubicasa()))
    assert {room.label for room in plan.rooms} == {"Kitchen", "Bedroom"}
    assert [door.kind for door in plan.doors] == ["door"]
    shrunk = (8 / 9) ** 2
    assert plan.area == pytest.approx(published.AREA_M2 * shrunk, rel=0.01)
    assert plan.doors[0].width == pytest.approx(0.9 * shrunk**0.5, abs=0.02)


def test_svg_with_entities_is_refused(tmp_path):
    bomb = '<!DOCTYPE svg [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>'
    found = rejected(written(tmp_path / "model.svg", bomb + published.cubicasa().replace("<text>x", "<text>&b;&c;")))
    assert "entity" in found.detail


def test_a_drawing_without_a_door_has_no_scale(tmp_path):
    svg = '<svg><g class="Wall"><polygon points="0,0 1,0 1,1"/></g></svg>'
    assert "door" in str(rejected(written(tmp_path / "model.svg", svg)))


# Open-RMF buildings: scale, walls, doors, lifts and names, and what is refused.


SCALE = 0.05
CORNERS = [(0, 0), (120, 0), (120, 80), (0, 80), (60, 0), (60, 30), (60, 48), (60, 80)]
DOOR = {"name": [1, "d"], "type": [1, "hinged"]}
TWO_ROOMS = {
    "coordinate_system": "reference_image",
    "levels": {
        "L1": {
            "elevation": 0.0,
            "vertices": [*([x, y, 0, ""] for x, y in CORNERS), [30, 40, 0, "kitchen"], [90, 40, 0, "spot_7"]],
            "measurements": [[0, 1, {"distance": [3, 120 * SCALE]}]],
            "walls": [[0, 1, {}], [1, 2, {}], [2, 3, {}], [3, 0, {}], [4, 5, {}], [6, 7, {}]],
            "doors": [[5, 6, DOOR]],
        }
    },
    "lifts": {},
    "name": "two rooms",
}


def built(tmp_path, building, name="two.building.yaml"):
    (tmp_path / name).write_text(yaml.safe_dump(building))
    return plans_of(tmp_path / name)


def changed(**level):
    building = copy.deepcopy(TWO_ROOMS)
    building["levels"]["L1"].update(copy.deepcopy(level))
    return building


@pytest.mark.parametrize(
    ("floors", "inside", "rooms"), [(True, [], 1), (False, [], 2), (True, [[60, 40, 0, "spot"]], 2)]
)
def test_a_block_between_corridors_is_no_room_where_floors_are_drawn(tmp_path, floors, inside, rooms):
    outer, inner = [(0, 0), (120, 0), (120, 80), (0, 80)], [(20, 20), (100, 20), (100, 60), (20, 60)]
    floor = [0, 1, 2, 3, 0, 4, 7, 6, 5, 4]
    building = changed(
        vertices=[*([x, y, 0, ""] for x, y in (*outer, *inner)), *inside],
        walls=[[a + k, a + (k + 1) % 4, {}] for a in (0, 4) for k in range(4)],
        doors=[],
        floors=[{"parameters": {}, "vertices": floor}] if floors else [],
    )
    (plan,) = built(tmp_path, building)
    assert len(plan.rooms) == rooms


def test_a_building_of_two_rooms_with_a_door(tmp_path):
    (plan,) = built(tmp_path, TWO_ROOMS)
    assert sorted(room.label for room in plan.rooms) == ["Kitchen", UNLABELLED]
    (door,) = plan.doors
    assert (door.kind, round(door.width, 2)) == ("door", 0.9)
    assert plan.area == pytest.approx(2 * 2.9 * 3.9 + 0.9 * 0.1, abs=0.02)  # walls are 0.1 m thick
    assert plan.provenance["source"] == "open-rmf"
    kitchen = next(room for room in plan.rooms if room.label == "Kitchen")
    assert kitchen.polygon.centroid.x < plan.bbox[2] / 2


def test_a_picture_runs_down_and_metres_run_up(tmp_path):
    building = changed(vertices=[*TWO_ROOMS["levels"]["L1"]["vertices"][:8], [30, 10, 0, "bedroom"], [0, 0, 0, ""]])
    building["levels"]["L1"]["walls"].append([9, 8, {}])  # a wall that stands in the upper left corner
    down = built(tmp_path, building)[0]
    building["coordinate_system"] = "cartesian_meters"
    for vertex in building["levels"]["L1"]["vertices"]:
        vertex[0], vertex[1] = vertex[0] * SCALE, -vertex[1] * SCALE
    up = built(tmp_path, building, "metres.building.yaml")[0]
    assert shapely.equals_exact(shapely.normalize(down.free_space), shapely.normalize(up.free_space), 0.011)


def test_a_door_beside_a_corner_is_as_deep_as_its_own_wall():
    """The lane through the door runs along the face of the wall at the corner, a rounding error within it."""
    walls = [Wall(shapely.box(1.5, 0.1, 1.6, 5.0), 0.0, 2.5), Wall(shapely.box(0.0, 0.0, 3.0, 0.1), 0.0, 2.5)]
    hole = Hole(shapely.box(1.5, 0.1 - 1e-7, 1.6, 0.9), 0.0, 2.1, across=(1.0, 0.0))
    assert deepen_to_wall_faces(hole, walls).shape.area == pytest.approx(0.08, abs=1e-4)


def test_floors_with_one_name_each_are_the_rooms(tmp_path):
    """A wall that leaves a gap of 1 m in a room parts no room that is drawn as one floor."""
    vertices = [[0, 0, 0, ""], [120, 0, 0, ""], [120, 80, 0, ""], [0, 80, 0, ""], [60, 0, 0, ""], [60, 80, 0, ""]]
    vertices += [[30, 40, 0, "kitchen"], [90, 40, 0, "bedroom"], [90, 0, 0, ""], [90, 60, 0, ""]]
    walls = [[0, 4, {}], [4, 8, {}], [8, 1, {}], [1, 2, {}], [2, 5, {}], [5, 3, {}], [3, 0, {}], [4, 5, {}], [8, 9, {}]]
    floors = [{"vertices": [0, 4, 5, 3], "parameters": {}}, {"vertices": [4, 1, 2, 5], "parameters": {}}]
    (whole,) = built(tmp_path, changed(vertices=vertices, walls=walls, floors=floors, doors=[]))
    assert sorted(room.label for room in whole.rooms) == ["Bedroom", "Kitchen"]


def test_a_lift_is_a_room_with_a_door(tmp_path):
    building = changed()
    vertices = building["levels"]["L1"]["vertices"]
    vertices += [[120, 20, 0, ""], [160, 20, 0, ""], [160, 60, 0, ""], [120, 60, 0, ""]]
    building["levels"]["L1"]["walls"] = [*building["levels"]["L1"]["walls"], [10, 11, {}], [11, 12, {}], [12, 13, {}]]
    cabin = {"x": 140, "y": 40, "yaw": 0.0, "width": 1.7, "depth": 1.7, "level_doors": {"L1": ["front"]}}
    door = {"x": -1.0, "y": 0.0, "width": 0.9, "motion_axis_orientation": 1.5708, "door_type": 2}
    building["lifts"] = {"one": {**cabin, "doors": {"front": door}}}
    (plan,) = built(tmp_path, building)
    assert "Passenger_elevator" in {room.label for room in plan.rooms}
    assert len(plan.doors) == 2


def test_a_level_without_a_measurement_takes_the_scale_of_the_other(tmp_path):
    building = changed()
    upper = copy.deepcopy(building["levels"]["L1"])
    upper["measurements"], upper["elevation"] = [], 3.0
    building["levels"]["L2"] = upper
    low, high = built(tmp_path, building)
    assert low.area == pytest.approx(high.area)
    assert high.frame.floor == 3.0
    assert "no measurement" in high.provenance["left_out"]


def test_what_names_a_vertex_that_is_not_there_is_left_out(tmp_path):
    level = TWO_ROOMS["levels"]["L1"]
    (plan,) = built(tmp_path, changed(walls=[*level["walls"], [0, 99, {}]], doors=[*level["doors"], ["a", None, {}]]))
    assert len(plan.rooms) == 2
    assert "walls[6]" in plan.provenance["left_out"]
    assert "doors[1]" in plan.provenance["left_out"]


@pytest.mark.parametrize(
    ("change", "reason", "said"),
    [
        ({"walls": []}, Reason.NO_LEVEL, "traffic map of lanes"),
        ({"measurements": []}, Reason.BAD_UNITS, "measurement"),
        ({"vertices": "none"}, Reason.BAD_UNITS, "measurement"),
    ],
)
def test_what_is_no_plan_is_refused_with_the_reason(tmp_path, change, reason, said):
    with pytest.raises(Rejection, match=said) as caught:
        built(tmp_path, changed(**change))
    assert caught.value.reason is reason


@pytest.mark.parametrize(
    "text",
    [
        "levels: &a [*a]\n",
        "a: &a [x, x]\nb: &b [*a, *a]\nlevels:\n  L1: {vertices: *b}\n",
        "levels: [1, 2\n",
        "levels:\n  !!python/object/apply:os.system ['touch /tmp/never']\n",
        "- 1\n",
        "levels: " + "[" * 50_000,
    ],
)
def test_yaml_that_is_no_building_is_rejected(tmp_path, text):
    path = tmp_path / "bad.building.yaml"
    path.write_text(text)
    (item,) = find(str(path))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason in {Reason.UNREADABLE, Reason.NO_LEVEL}


def test_the_export_is_as_traffic_editor_writes_it(tmp_path):
    (plan,) = built(tmp_path, TWO_ROOMS)
    files = rmf(plan)
    assert set(files) == {f"{plan.id}.building.yaml", f"{plan.id}.png"}
    building = yaml.safe_load(files[f"{plan.id}.building.yaml"])
    level = building["levels"]["L1"]
    assert level["drawing"]["filename"] in files
    assert {vertex[3] for vertex in level["vertices"]} == {"", "Kitchen"}
    for kind in ("walls", "doors", "measurements"):
        for start, end, parameters in level[kind]:
            assert {start, end} <= set(range(len(level["vertices"])))
            assert all(isinstance(value, list) and len(value) == 2 for value in parameters.values())
    assert len(level["floors"]) == 3
    assert b"*id" not in files[f"{plan.id}.building.yaml"]


# Drawn plans made to do harm: each ends as levels or as a rejection, soon, and what is sound of a house stays.


BIG = 10**400
SQUARE = [[0, 0], [6, 0], [6, 5], [0, 5], [0, 0]]
BOW = [[0, 0], [5, 5], [5, 0], [0, 6], [0, 0]]
RMF = """{head}levels:
  L1:
    vertices: [[0,0,0,""],[100,0,0,""],[100,100,0,""],[0,100,0,""],[{x},1,0,""]]
    walls: [[0,1,{{}}],[1,2,{{}}],[2,3,{{}}],[3,0,{{}}]]
    measurements: [[0,1,{{distance: [3, 10]}}]]
"""
WALLS = "".join(
    f'<geom name="wall_{i}" type="box" pos="{x} {y} 1.25" size="{a} {b} 1.25"/>'
    for i, (x, y, a, b) in enumerate([(3, 0, 3, 0.05), (3, 4, 3, 0.05), (0, 2, 0.05, 2), (6, 2, 0.05, 2)])
)
SVG = (
    '<svg><g class="Door"><polygon points="10,0 18,0 18,2 10,2"/></g><g class="Wall">'
    '<polygon points="0,0 90,0 90,2 0,2"/></g><g class="Wall">{}</g></svg>'
)


def levels(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return levels_of(path)


def collection(*features):
    made = [{"properties": about, "geometry": {"type": "Polygon", "coordinates": [ring]}} for about, ring in features]
    crs = {"properties": {"name": "LOCAL_CS metre"}}
    return json.dumps({"type": "FeatureCollection", "features": made, "crs": crs})


def mujoco(body, before=""):
    return f"<mujoco>{before}<worldbody>{WALLS}{body}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.building.yaml", RMF.format(head="", x=BIG)),
        ("a.geojson", collection(({"kind": "room"}, SQUARE), ({"kind": "room"}, [[0, 0], [BIG, 0], [1, 1], [0, 0]]))),
        ("a.geojson", collection(({"kind": "room"}, SQUARE), ({"kind": "object", "height": BIG}, SQUARE))),
        ("a.geojson", collection(({"kind": "room"}, SQUARE), ({"kind": "room"}, BOW))),
        ("a.xml", mujoco('<body name="x" pos="a b c"/><body name="y" quat="0 0 0 0"/>')),
        ("a.xml", mujoco("", f'<include file="{"a" * 300}.xml"/>')),
        ("a.xml", mujoco('<geom mesh="m"/>', f'<asset><mesh name="m" file="{"a" * 300}.obj"/></asset>')),
        (
            "a.xml",
            mujoco(
                '<geom mesh="m"/>',
                '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 1 99999999999999999999"/></asset>',
            ),
        ),
        ("a.svg", SVG.format('<path d="L1 1 2 2 3 3 H 1 V 2 Z"/>')),
    ],
)
def test_a_part_with_impossible_numbers_is_left_out(tmp_path, name, text):
    assert len(levels(tmp_path / name, text)) == 1


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.building.yaml", RMF.format(head="a: &a-0 [x]\nb: *a-0 # so\n", x=1), "alias"),
        ("a.building.yaml", RMF.format(head="a: &a [x]\nb: *a\n", x=1).encode("utf-16"), "alias"),
        ("a.building.yaml", RMF.format(head=f"a: {'[' * 200}{']' * 200}\n", x=1), "deep"),
    ],
)
def test_what_has_no_end_is_refused(tmp_path, name, text, said):
    with pytest.raises(Rejection, match=said):
        levels(tmp_path / name, text)


def test_a_scene_without_walls_says_which_includes_are_missing(tmp_path):
    text = '<mujoco><include file="../walls.xml"/><worldbody><geom type="box" size="1 1 1"/></worldbody></mujoco>'
    with pytest.raises(Rejection) as caught:
        levels(tmp_path / "kitchen.xml", text)
    assert "found none; left out" in caught.value.detail
    assert "../walls.xml" in caught.value.detail


def test_includes_in_a_long_chain(tmp_path):
    for number in range(1, 1200):
        (tmp_path / f"c{number}.xml").write_text(f'<mujocoinclude><include file="c{number + 1}.xml"/></mujocoinclude>')
    assert len(levels(tmp_path / "a.xml", mujoco("", '<include file="c1.xml"/>'))) == 1


def test_blocks_within_blocks_are_counted_as_often_as_drawn(tmp_path, monkeypatch):
    ezdxf = pytest.importorskip("ezdxf")
    from pipeline.sources.vector_plans import dxf

    monkeypatch.setattr(dxf, "MOST_PARTS", 1000)
    drawing = ezdxf.new("R2010")
    for number in range(12):
        block = drawing.blocks.new(f"WALL{number}")
        for place in range(10):
            block.add_blockref(f"WALL{number - 1}", (place, number)) if number else block.add_point((place, 0))
    drawing.modelspace().add_blockref("WALL11", (0, 0))
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.raises(Rejection, match="1,000 entities"):
        levels(tmp_path / "a.dxf", (tmp_path / "a.dxf").read_bytes())


USD = """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
class "Side" {
    def Cube "wall" {
        double size = 1
        double3 xformOp:scale = (6, 0.1, 2.5)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
}
def "a" (references = </Side>) { int semanticLabel = 5
}
"""


def test_usd_that_refers_to_itself_and_has_a_label_that_is_no_text(tmp_path):
    pytest.importorskip("pxr")
    assert len(levels(tmp_path / "a.usda", USD)) == 1


def test_usd_of_instances_without_end(tmp_path, monkeypatch):
    pytest.importorskip("pxr")
    from pipeline.sources.vector_plans import usd

    monkeypatch.setattr(usd, "MOST_PARTS", 3)
    with pytest.raises(Rejection, match="more than 3 prims"):
        levels(tmp_path / "a.usda", USD + 'def "b" (references = </Side>) {\n}\n')


def test_fiducials_without_number(tmp_path):
    many = ", ".join(f"[{i}, {i * i % 997}, f{i}]" for i in range(3000))
    second = f"  L2:\n    vertices: []\n    walls: []\n    fiducials: [{many}]\n"
    text = RMF.format(head="", x=1) + f"    fiducials: [{many}]\n{second}"
    assert len(levels(tmp_path / "a.building.yaml", text)) == 1


def test_usd_faces_with_fewer_corners_than_none(tmp_path):
    pytest.importorskip("pxr")
    mesh = """def Mesh "wall_9" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    int[] faceVertexCounts = [2147483647, -2147483644]
    int[] faceVertexIndices = [0, 1, 2]
}
"""
    (level,) = levels(tmp_path / "a.usda", USD + mesh)
    assert "wall_9" in level.provenance["left_out"]
