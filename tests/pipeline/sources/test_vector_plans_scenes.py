"""Read drawn scenes: MuJoCo, USD, Webots, scene states."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from houseexpo.floorplan import FloorPlan
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from pipeline.sources.drawn_storeys import Hole, Wall, deepen_to_wall_faces
from pipeline.sources.vector_plans import geojson
from pipeline.sources.vector_plans.drawing import deepen_to_wall, deepen_to_walls, passage_rectangles
from pipeline.sources.vector_plans.scene_bodies import (
    body_from_box,
    body_from_many_triangles,
    body_from_triangles,
    body_kind,
    box_mesh,
)
from tests.builders.batch import plans_of
from tests.builders.damage import rejected

MOLMO = """<mujoco model="house">
  <compiler angle="radian"/>
  <default><default class="structural"><geom type="box" rgba="1 1 1 1"/></default></default>
  <worldbody>
    <geom name="floor" type="plane" size="10 10 1"/>
    <body name="structure" pos="5 5 0" childclass="structural">
      <geom name="room|2" pos="2 2 -0.05" size="2 2 0.05"/>
      <geom name="room|3" pos="6 2 -0.05" size="2 2 0.05"/>
      <geom name="wall|2|0" pos="4 -0.05 1.25" size="4.1 0.05 1.25"/>
      <geom name="wall|2|1" pos="4 4.05 1.25" size="4.1 0.05 1.25"/>
      <geom name="wall|2|2" pos="-0.05 2 1.25" size="0.05 2.1 1.25"/>
      <geom name="wall|3|0" pos="8.05 2 1.25" size="0.05 2.1 1.25"/>
      <geom name="wall|2|3" pos="4 0.75 1.25" size="0.05 0.75 1.25"/>
      <geom name="wall|2|4" pos="4 3.2 1.25" size="0.8 0.05 1.25" euler="0 0 1.5707963"/>
      <geom name="lintel|0" pos="4 1.95 2.3" size="0.05 0.45 0.2"/>
      <body name="door_0" pos="4 1.95 1.05"><geom name="door_0_leaf" size="0.02 0.45 1.05"/></body>
    </body>
    <body name="sofa_1" pos="7 7 0.4"><freejoint/><geom type="box" size="0.9 0.4 0.4"/></body>
  </worldbody>
</mujoco>"""


def test_mjcf_as_molmospaces_names_it(tmp_path):
    """The names are MolmoSpaces' own; the file is written here, since its scenes are no public repository's."""
    (tmp_path / "house.xml").write_text(MOLMO)
    (plan,) = plans_of(tmp_path / "house.xml")
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["door"]
    assert plan.area == pytest.approx(32 - 0.4 + 0.09, abs=0.1)
    assert plan.provenance["source"] == "mjcf"


@pytest.mark.parametrize("turns", [(0, 0, 0), (30, 0, 0), (15, 40, 70)])
def test_a_box_covers_what_its_faces_cover(turns):
    at = np.eye(4)
    at[:3, :3], at[:3, 3] = Rotation.from_euler("zyx", turns, degrees=True).as_matrix(), (1.0, 2.0, 3.0)
    half = np.array([2.0, 0.05, 1.25])
    box, whole = body_from_box(("wall",), at, half), body_from_triangles(("wall",), *box_mesh(at, half))
    assert box is not None
    assert whole is not None
    assert box.shape.symmetric_difference(whole.shape).area < 1e-3 * whole.shape.area
    assert (box.low_m, box.high_m) == (whole.low_m, whole.high_m)
    assert body_from_box(("wall",), at, np.array([2.0, np.nan, 1.0])) is None
    assert body_from_box(("wall",), np.eye(4), np.array([2.0, 0.0, 1.0])) is None


def test_triangles_of_four_corners_that_leave_a_part_of_them_open_are_no_box():
    square = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    for faces, area in (([(0, 1, 2), (0, 2, 3)], 1.0), ([(0, 1, 2), (0, 1, 3)], 0.75), ([(0, 1, 2)], 0.5)):
        body = body_from_triangles(("floor",), square, np.array(faces))
        assert body.shape.area == pytest.approx(area)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<!DOCTYPE x [<!ENTITY a "b">]><mujoco>&a;</mujoco>', "entity"),
        ("<mujoco><worldbody></mujoco>", "no XML"),
        ("<mujoco>" + "<a>" * 500 + "</a>" * 500 + "</mujoco>", "nested"),
        ("<mujoco><worldbody><geom type='box' size='1 1 1'/></worldbody></mujoco>", "named wall"),
    ],
)
def test_mjcf_that_is_no_house(tmp_path, text, said):
    (tmp_path / "bad.xml").write_text(text)
    assert said in rejected(tmp_path / "bad.xml").detail


def test_the_door_of_a_cupboard_is_furniture():
    assert body_kind(("kitchen_cabinet_door_2", "walls")) == "furniture"
    assert body_kind(("door_2", "walls")) == "door"


def test_an_include_outside_the_folder_or_of_itself_is_left_out(tmp_path):
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text(MOLMO)
    includes = '<include file="../secret.xml"/><include file="house.xml"/><include file="none.xml"/>'
    (folder / "house.xml").write_text(MOLMO.replace("<worldbody>", f"{includes}<worldbody>", 1))
    (plan,) = plans_of(folder / "house.xml")
    assert "../secret.xml is not in the folder" in plan.provenance["left_out"]
    assert "by itself" in plan.provenance["left_out"]
    assert len(plan.rooms) == 2


def _cube(name: str, at, size, more: str = "") -> str:
    half = ", ".join(f"{each / 2}" for each in size)
    place = ", ".join(map(str, at))
    return f"""
        def Cube "{name}" {{
            {more}
            double size = 2
            double3 xformOp:translate = ({place})
            float3 xformOp:scale = ({half})
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
        }}"""


def usd_scene(y_up: bool = False) -> str:
    """Two rooms by semantic labels, in centimetres; prim names say nothing."""

    def turned(x, y, z):
        return (x, z, -y) if y_up else (x, y, z)

    def sized(x, y, z):
        return (x, z, y) if y_up else (x, y, z)

    parts = [
        ("wall", (400, -5, 125), (820, 10, 250)),
        ("wall", (400, 405, 125), (820, 10, 250)),
        ("wall", (-5, 200, 125), (10, 400, 250)),
        ("wall", (805, 200, 125), (10, 400, 250)),
        ("wall", (400, 75, 125), (10, 150, 250)),
        ("wall", (400, 320, 125), (10, 160, 250)),
        ("door", (400, 195, 105), (4, 90, 210)),
        ("kitchen", (197.5, 200, -5), (395, 400, 10)),
        ("bedroom", (602.5, 200, -5), (395, 400, 10)),
    ]
    cubes = [
        _cube(f"p{i}", turned(*at), sized(*size), f'custom string semanticLabel = "{label}"')
        for i, (label, at, size) in enumerate(parts)
    ]
    up = "Y" if y_up else "Z"
    head = f'#usda 1.0\n(\n metersPerUnit = 0.01\n upAxis = "{up}"\n defaultPrim = "W"\n)\n'
    return f'{head}def Xform "W" {{{"".join(cubes)}\n}}\n'


@pytest.mark.parametrize("y_up", [False, True])
def test_usd_by_semantic_labels_units_and_axis(tmp_path, y_up):
    pytest.importorskip("pxr")
    (tmp_path / "scene.usda").write_text(usd_scene(y_up))
    (plan,) = plans_of(tmp_path / "scene.usda")
    assert {room.label for room in plan.rooms} == {"Kitchen", "Bedroom"}
    assert [door.kind for door in plan.doors] == ["door"]
    assert plan.area == pytest.approx(2 * 3.95 * 4 + 0.09, abs=0.1)


def test_furniture_of_many_faces_is_as_large_as_with_few() -> None:
    """An L of 3 m with faces of 5 mm, turned, and a plate of two faces on it."""
    steps = np.linspace(0.0, 3.0, 601)
    u, v = (each.ravel() for each in np.meshgrid(steps, steps, indexing="ij"))
    a = (np.arange(600)[:, None] * 601 + np.arange(600)).ravel()
    faces = np.concatenate([np.column_stack([a, a + 601, a + 602]), np.column_stack([a, a + 602, a + 1])])
    faces = faces[((u[faces] <= 1.0) | (v[faces] <= 1.0)).all(axis=1)]
    points = np.column_stack([0.8 * u - 0.6 * v, 0.6 * u + 0.8 * v, np.where(u > 2, 0.4, 0.8)])
    plate = np.array([(0, 0, 1.0), (-2, 0, 1.0), (-2, -1, 1.0), (0, -1, 1.0)])
    both = np.concatenate([points, plate])
    found = body_from_many_triangles(
        ("sofa",), both, np.concatenate([faces, len(points) + np.array([(0, 1, 2), (0, 2, 3)])])
    )
    assert found is not None
    assert found.shape.area == pytest.approx(5.0 + 2.0, rel=0.03)
    assert (found.low_m, found.high_m) == (0.4, 1.0)
    assert shapely.hausdorff_distance(found.shape, shapely.union_all([found.shape, shapely.box(-2, -1, 0, 0)])) < 0.03


def test_usd_through_references_payloads_and_instances(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "shell.usda").write_text(usd_scene())
    for arc in ("references", "payload"):
        (tmp_path / f"{arc}.usda").write_text(
            '#usda 1.0\n(\n metersPerUnit = 0.01\n upAxis = "Z"\n)\n'
            f'def Xform "A" (\n instanceable = true\n prepend {arc} = @./parts/shell.usda@\n) {{}}\n'
        )
        (plan,) = plans_of(tmp_path / f"{arc}.usda")
        assert len(plan.rooms) == 2


@pytest.mark.parametrize(
    "asset", ["./none.usda", "../outside.usda", "/etc/passwd", "https://host.invalid/a.usda", "a.abc"]
)
def test_usd_that_refers_to_what_is_not_beside_it(tmp_path, asset):
    pytest.importorskip("pxr")
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "outside.usda").write_text(usd_scene())
    (folder / "a.abc").write_bytes(b"x")
    (folder / "a.usda").write_text(f'#usda 1.0\ndef Xform "A" (\n prepend references = @{asset}@\n) {{}}\n')
    found = rejected(folder / "a.usda")
    assert found.reason is Reason.UNREADABLE
    assert "refers to" in found.detail


@pytest.mark.parametrize("end", [True, False])
def test_usd_that_is_nested_too_deeply_is_refused_before_the_library_ends_the_process(tmp_path, end):
    pytest.importorskip("pxr")
    deep = 'def Xform "a"\n{\n' * 20_000 + "}\n" * 20_000 * end
    (tmp_path / "deep.usda").write_text(f"#usda 1.0\n{deep}")
    found = rejected(tmp_path / "deep.usda")
    assert (found.reason, "more than 100 prims within each other" in found.detail) == (Reason.TOO_LARGE, True)


def test_usd_that_refers_to_itself_ends(tmp_path):
    pytest.importorskip("pxr")
    for one, other in (("a", "b"), ("b", "a")):
        text = f'#usda 1.0\n(\n defaultPrim = "A"\n)\ndef Xform "A" (\n prepend references = @./{other}.usda@\n) {{}}\n'
        (tmp_path / f"{one}.usda").write_text(text)
    assert rejected(tmp_path / "a.usda").reason in {Reason.UNREADABLE, Reason.NO_LEVEL}


@pytest.mark.parametrize("data", [b"PXR-USDC" + b"\x00" * 200, b"#usda 1.0\ndef Xform {", b"PXR-USDC\xff\xff\xff\xff"])
def test_damaged_usd(tmp_path, data):
    pytest.importorskip("pxr")
    (tmp_path / "a.usd").write_bytes(data)
    assert rejected(tmp_path / "a.usd").reason is Reason.UNREADABLE


def drawing(tmp_path, units: int, scale: float, name: str = "plan.dxf"):
    """Walls as pairs of lines, a door as a block with an arc, names as texts: as drawings usually are."""
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = units
    space = document.modelspace()

    def line(*points):
        scaled = [(x * scale, y * scale) for x, y in points]
        space.add_lwpolyline(scaled, close=True, dxfattribs={"layer": "A-WALL"})

    line((0, 0), (8.3, 0), (8.3, 4.2), (0, 4.2))
    line(
        (0.1, 0.1),
        (4.1, 0.1),
        (4.1, 1.5),
        (4.2, 1.5),
        (4.2, 0.1),
        (8.2, 0.1),
        (8.2, 4.1),
        (4.2, 4.1),
        (4.2, 2.4),
        (4.1, 2.4),
        (4.1, 4.1),
        (0.1, 4.1),
    )
    block = document.blocks.new("TUER 90")
    block.add_arc((0, 0), 0.9 * scale, 0, 90, dxfattribs={"layer": "0"})
    space.add_blockref("TUER 90", (4.15 * scale, 1.5 * scale), dxfattribs={"layer": "0"})
    space.add_text("Küche", dxfattribs={"layer": "TEXT"}).set_placement((2 * scale, 2 * scale))
    space.add_text("Bad", dxfattribs={"layer": "TEXT"}).set_placement((6 * scale, 2 * scale))
    document.saveas(tmp_path / name)
    return tmp_path / name


@pytest.mark.parametrize(
    ("units", "scale"), [(6, 1.0), (4, 1000.0), (5, 100.0), (0, 1000.0), (1, 39.37), (0, 39.37), (4, 39.37)]
)
def test_dxf_in_each_unit(tmp_path, units, scale):
    (plan,) = plans_of(drawing(tmp_path, units, scale))
    assert {room.label for room in plan.rooms} == {"Kitchen", "Bathroom"}
    assert [(door.kind, round(door.width, 2)) for door in plan.doors] == [("door", 0.9)]
    assert plan.area == pytest.approx(32.09, abs=0.1)


def test_a_unit_of_dxf_in_which_there_is_no_house_is_a_guess(tmp_path):
    (stated,) = plans_of(drawing(tmp_path, 1, 39.37, "stated.dxf"))
    (wrong,) = plans_of(drawing(tmp_path, 4, 39.37, "wrong.dxf"))  # millimetres, says a template, of inches
    assert (stated.quality.grounds["guesses"], wrong.quality.grounds["guesses"]) == (0.0, 0.5)
    refused = rejected(drawing(tmp_path, 4, 1e-6, "nothing.dxf"))
    assert refused.reason is Reason.BAD_UNITS
    assert "nothing.dxf states a unit of 0.001 m, and its walls are 8.3e-06 long: a house in none" in refused.detail


def test_dxf_that_is_none(tmp_path):
    pytest.importorskip("ezdxf")
    for data in (b"garbage", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n", bytes(100)):
        (tmp_path / "a.dxf").write_bytes(data)
        assert rejected(tmp_path / "a.dxf").reason in {Reason.UNREADABLE, Reason.NO_LEVEL}


def test_dxf_that_breaks_off_says_so(tmp_path):
    pytest.importorskip("ezdxf")
    whole = drawing(tmp_path, 6, 1.0).read_bytes()
    (tmp_path / "a.dxf").write_bytes(whole[: whole.index(b"ENTITIES") - 20])
    assert "breaks off before its end (EOF)" in rejected(tmp_path / "a.dxf").detail


def test_usd_says_what_is_wrong_with_it(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "a.usda").write_text('#usda 1.0\n\ndef Xform "Wall" {\n    double a = (\n}\n')
    assert "a.usda cannot be read as USD: a mistake in line" in rejected(tmp_path / "a.usda").detail
    (tmp_path / "b.usdc").write_bytes(b"PXR-USDC\0\0\1" + bytes(77))
    assert "version 0.0.1 of the format" in rejected(tmp_path / "b.usdc").detail


def collection(to=lambda x, y: (x, y), **about):
    rooms = [("Kitchen", 0.1, 4.1), ("Bedroom", 4.2, 8.2)]
    features = [
        {
            "type": "Feature",
            "properties": {"category": "room", "name": {"en": name}},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[to(*c) for c in ((a, 0), (b, 0), (b, 4), (a, 4), (a, 0))]],
            },
        }
        for name, a, b in rooms
    ]
    opening = {"type": "LineString", "coordinates": [to(4.15, 1.0), to(4.15, 1.9)]}
    features.append(
        {"type": "Feature", "feature_type": "opening", "properties": {"category": "door"}, "geometry": opening}
    )
    return {"type": "FeatureCollection", "features": features, **about}


def test_geojson_polygons_beside_others_are_read_as_they_are_alone():
    """Polygons are made together where all are plain; one with heights, or that is none, spoils no other."""
    plain = {"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]], [[1, 1], [2, 1], [2, 2]]]}
    high = {"type": "Polygon", "coordinates": [[[4, 0, 1], [8, 0, 1], [8, 3, 1], [4, 0, 1]]]}
    bad = {"type": "Polygon", "coordinates": [[[4, 0], ["x", 0], [8, 3], [4, 0]]]}
    line = {"type": "LineString", "coordinates": [[0, 0], [1, 0]]}
    for several in ([plain, line], [plain, high, line], [bad, plain], [plain, {"type": "Polygon", "coordinates": []}]):
        features = [{"geometry": each} for each in several]
        alone = [geojson.shape_of(each) for each in features]
        together = geojson._shapes_of([*features, None])
        assert together[-1] is None
        assert [each and each.wkt for each in together[:-1]] == [each and each.wkt for each in alone]


def test_a_door_in_a_gap_stays_as_it_is_and_one_in_the_wall_goes_through_it():
    walls = [shapely.box(0, 0, 2, 0.3), shapely.box(2.9, 0, 6, 0.3)]
    gap, thin = (
        Hole(each, 0.0, 2.1, True, (0.0, 1.0)) for each in (shapely.box(2, 0, 2.9, 0.3), shapely.box(4, 0.1, 4.9, 0.2))
    )
    same, deep = deepen_to_walls([gap, thin], walls)
    assert same is gap
    assert deep.shape.bounds == pytest.approx((4, 0, 4.9, 0.3))
    assert [each.shape.wkt for each in (same, deep)] == [deepen_to_wall(each, walls).shape.wkt for each in (gap, thin)]
    assert deepen_to_walls([gap], []) == [gap]


def test_passages_are_measured_together_as_they_are_alone():
    turned = shapely.affinity.rotate(shapely.box(0, 0, 0.9, 0.3), 30)
    shapes = [shapely.box(2, 0, 2.9, 0.3), shapely.LineString([(0, 0), (1, 0)]), turned, shapely.box(4, 0, 4.3, 0.9)]
    found = passage_rectangles(shapes)
    assert found == [each for shape in shapes for each in passage_rectangles([shape])]
    assert [each and tuple(map(abs, each[1])) for each in found] == [
        pytest.approx((0, 1), abs=1e-9),
        None,
        pytest.approx((0.5, 3**0.5 / 2)),
        pytest.approx((1, 0), abs=1e-9),
    ]
    assert passage_rectangles([]) == []


def test_geojson_of_rooms_in_degrees(tmp_path):
    def degrees(x, y):
        return [11.5 + np.degrees(x / (6_371_008.8 * np.cos(np.radians(48.1)))), 48.1 + np.degrees(y / 6_371_008.8)]

    (tmp_path / "unit.geojson").write_text(json.dumps(collection(degrees)))
    (plan,) = plans_of(tmp_path / "unit.geojson")
    assert {room.label for room in plan.rooms} == {"Kitchen", "Bedroom"}
    assert plan.area == pytest.approx(32.09, abs=0.1)
    assert len(plan.doors) == 1


def test_a_feature_that_cannot_be_read_is_left_out(tmp_path):
    found = collection()
    found["features"] += [{"properties": {"kind": "wall"}, "geometry": {"type": "Polygon", "coordinates": "x"}}, 7]
    (tmp_path / "unit.geojson").write_text(json.dumps(found))
    (plan,) = plans_of(tmp_path / "unit.geojson")
    assert "feature 3" in plan.provenance["left_out"]
    assert len(plan.rooms) == 2


# Scene states of smartscenes (HSSD, SceneEval): walls with holes, floors with the names of regions, both axes.


DOOR = {"id": "d", "type": "Door", "box": {"min": [1.0, 0.0], "max": [1.9, 2.1]}}
WINDOW = {"id": "w", "type": "window", "box": {"min": [1.0, 0.8], "max": [2.0, 2.0]}}


def wall(
    room: str, a: tuple[float, float], b: tuple[float, float], *holes: dict[str, Any], z: float = 0.0
) -> dict[str, Any]:
    """A wall of a room, on the line between two rooms, as the format has it."""
    return {
        "id": f"{room}{a}{b}", "type": "Wall", "roomId": room, "points": [[*a, z], [*b, z]],
        "height": 2.8, "depth": 0.1, "holes": list(holes), "materials": [{"name": "inside"}],
    }  # fmt: skip


def around(room: str, x: float, *holes: dict[str, Any], z: float = 0.0) -> list[dict[str, Any]]:
    """A room of 4 x 3 m, whose first side (from y = 0 to 3) and third side have these holes."""
    corners = [(x, 0.0), (x, 3.0), (x + 4, 3.0), (x + 4, 0.0)]
    sides = [wall(room, one, other, z=z) for one, other in zip(corners, corners[1:] + corners[:1], strict=True)]
    sides[0]["holes"], sides[1]["holes"] = list(holes[:1]), list(holes[1:2])
    floor = {
        "id": f"{room}f",
        "type": "Floor",
        "roomId": room,
        "points": [[*each, z] for each in corners],
        "depth": 0.05,
    }
    return [*sides, floor, {"id": f"{room}c", "type": "Ceiling", "roomId": room, "points": floor["points"]}]


def arch(elements: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    regions = [{"id": "0_0", "type": "Kitchen"}, {"id": "0_1", "label": "bedroom"}]
    return {
        "version": "arch@1.0.2",
        "up": [0, 0, 1],
        "scaleToMeters": 1,
        "elements": elements,
        "regions": regions,
        **more,
    }


def scene(tmp_path: Path, found: dict[str, Any]) -> Path:
    file = tmp_path / "house.scenestate.json"
    file.write_text(json.dumps({"format": "sceneState", "scene": {"id": "1", "arch": found, "object": [{}]}}))
    return file


def plan_of(path: Path) -> FloorPlan:
    (plan,) = plans_of(path)
    return plan


def test_rooms_share_a_wall_that_each_of_them_brings(tmp_path: Path) -> None:
    plan = plan_of(scene(tmp_path, arch([*around("0_0", 0.0, {}, WINDOW), *around("0_1", 4.0, DOOR)])))
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert [round(room.area, 1) for room in plan.rooms] == [11.3, 11.3]
    (door,) = plan.doors
    assert (door.kind, door.width) == ("door", pytest.approx(0.9, abs=0.02))
    assert plan.provenance is not None
    assert plan.provenance["source"] == "scene_state"


def test_a_door_that_each_of_its_rooms_brings_is_one(tmp_path: Path) -> None:
    left = around("0_0", 0.0)
    left[2]["holes"] = [{**DOOR, "box": {"min": [1.1, 0.0], "max": [2.0, 2.1]}}]  # this wall runs the other way
    (door,) = plan_of(scene(tmp_path, arch([*left, *around("0_1", 4.0, DOOR)]))).doors
    assert door.width == pytest.approx(0.9, abs=0.02)


def test_the_arch_alone_with_y_up_and_in_centimetres(tmp_path: Path) -> None:
    elements = [*around("0_0", 0.0), *around("0_1", 4.0, DOOR)]
    for element in elements:
        element["points"] = [[100 * x, 100 * z, -100 * y] for x, y, z in element["points"]]
        element |= {key: 100 * element[key] for key in ("height", "depth") if key in element}
        for hole in element.get("holes", []):
            if hole:
                hole["box"] = {key: [100 * each for each in hole["box"][key]] for key in ("min", "max")}
    found = arch(json.loads(json.dumps(elements)), up=[0, 1, 0], scaleToMeters=0.01)
    (tmp_path / "arch.json").write_text(json.dumps(found))
    plan = plan_of(tmp_path / "arch.json")
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["door"]
    assert plan.frame is not None
    assert plan.frame.up == "y"


def test_storeys_by_their_floors(tmp_path: Path) -> None:
    two = scene(tmp_path, arch([*around("0_0", 0.0), *around("0_1", 0.0, z=3.0)]))
    plans = plans_of(two)
    assert [plan.rooms[0].label for plan in plans] == ["Kitchen", "Bedroom"]
    assert [plan.frame.level for plan in plans if plan.frame] == [0, 1]


def test_what_cannot_be_read_costs_only_itself(tmp_path: Path) -> None:
    bad = [
        {"type": "Wall", "points": [[0, 0, float("nan")], [1, 0, 0]], "height": 2},
        {"type": "Wall", "points": [[0, 0, 0], [1, 0, 0]], "height": "high"},
        {"type": "Floor", "points": [[0, 0, 0], [1, 0, 0]]},
        {"type": "Wall"}, "wall", None,
    ]  # fmt: skip
    holes = [{}, {"type": "Door", "box": None}, {"type": "Door", "box": {"min": [2, 0], "max": [1, 2]}}]
    house = around("0_0", 0.0)
    house[0]["holes"] = holes
    plan = plan_of(scene(tmp_path, arch([*house, *bad])))
    assert len(plan.rooms) == 1
    assert plan.provenance is not None
    assert "element[6]" in plan.provenance["left_out"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"format": "sceneState", "scene": {}}', "expected scene.arch.elements"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": 3}}}', "TypeError"),
        ('{"format": "sceneState", ', "is no JSON"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": []}}}', "among 0 elements"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": [], "scaleToMeters": -1}}}', "a metre is -1.0"),
        ('{"format": "sceneState", "scene": ' + "[" * 60000, "is no JSON"),
    ],
)
def test_what_is_no_scene_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "bad.json").write_text(text)
    (item,) = find(str(tmp_path / "bad.json"))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert said in caught.value.detail


# Webots worlds: walls, doors and windows with z up and with y up, named floors, and what is refused or left out.


Z_UP, Y_UP = "#VRML_SIM R2023b utf8", "#VRML_SIM R2020a utf8"


def node(
    kind: str, x: float, y: float, length: float, *, across: bool = False, y_up: bool = False, more: str = ""
) -> str:
    """A Wall, Door or Window of the manual, 0.2 m thick and 2.5 m high, along x or across it."""
    at, size = ((x, 0, -y), (length, 2.5, 0.2)) if y_up else ((x, y, 0), (0.2, length, 2.5))
    turned = across if y_up else not across
    axis = "0 1 0" if y_up else "0 0 1"
    angle = math.pi / 2 if turned else 0.0
    numbers = " ".join(f"{each:g}" for each in size)
    place = " ".join(f"{each:g}" for each in at)
    fields = f'translation {place}\n  rotation {axis} {angle}\n  name "{kind.lower()}"\n  size {numbers}\n{more}'
    return f"{kind} {{\n  {fields}}}\n"


def world(y_up: bool = False, head: str = "", more: str = "") -> str:
    """Two rooms of 4 x 3 m with a door between them, a window and a door outside; furniture is a PROTO."""
    parts = [
        node("Wall", 4.1, -0.1, 8.6, y_up=y_up),
        node("Wall", 2.0, 3.1, 4.4, y_up=y_up),
        node("Window", 4.7, 3.1, 1.0, y_up=y_up),
        node("Wall", 6.8, 3.1, 3.2, y_up=y_up),
        node("Wall", -0.1, 1.5, 3.4, across=True, y_up=y_up),
        node("Wall", 8.3, 0.5, 1.0, across=True, y_up=y_up),
        node("Door", 8.3, 1.5, 1.0, across=True, y_up=y_up, more="  canBeOpen FALSE\n"),
        node("Wall", 8.3, 2.6, 1.2, across=True, y_up=y_up),
        node("Wall", 4.1, 0.5, 1.0, across=True, y_up=y_up),
        node("Door", 4.1, 1.4, 0.8, across=True, y_up=y_up, more="  doorHandle DoorLever { hasStaticParent TRUE }\n"),
        node("Wall", 4.1, 2.4, 1.2, across=True, y_up=y_up),
    ]
    sofa = "Sofa {\n  translation 1 1 0 # by the window\n}\n"
    return f"{head or (Y_UP if y_up else Z_UP)}\nWorldInfo {{\n  basicTimeStep 16\n}}\n{''.join(parts)}{sofa}{more}"


def plan_of_world(tmp_path: Path, text: str) -> FloorPlan:
    """The one plan of a world."""
    (tmp_path / "house.wbt").write_text(text)
    (plan,) = plans_of(tmp_path / "house.wbt")
    return plan


def refused(tmp_path: Path, text: str) -> Rejection:
    (tmp_path / "house.wbt").write_text(text)
    return rejected(tmp_path / "house.wbt")


@pytest.mark.parametrize("y_up", [False, True])
def test_a_world_of_walls_doors_and_windows(tmp_path: Path, y_up: bool) -> None:
    plan = plan_of_world(tmp_path, world(y_up))
    assert sorted(round(room.area, 1) for room in plan.rooms) == [12.0, 12.0]
    assert sorted(door.kind for door in plan.doors) == ["door", "entrance"]
    assert plan.provenance is not None
    assert plan.provenance["source"] == "webots"
    assert "1 Sofa" in plan.provenance["left_out"]
    assert plan.frame is not None
    assert plan.frame.up == ("y" if y_up else "z")


def test_both_axes_give_one_plan_at_its_place_in_the_world(tmp_path: Path) -> None:
    one, other = plan_of_world(tmp_path, world(False)), plan_of_world(tmp_path, world(True))
    assert shapely.equals_exact(one.outline.normalize(), other.outline.normalize(), 0.011)
    for plan in (one, other):
        assert plan.frame is not None
        (door,) = [door for door in plan.doors if door.kind == "door"]
        middle = np.array([*np.mean(door.segment, axis=0), 1.0])
        found = np.asarray(plan.frame.matrix) @ middle
        assert found == pytest.approx([4.1, 1.4 if plan.frame.up == "z" else -1.4], abs=0.02)


def test_walls_of_an_old_world_that_are_turned_upright_stand(tmp_path: Path) -> None:
    """Before R2021c people who wanted z up turned each wall by a quarter, in a world that says nothing of it."""

    def upright(found: re.Match[str]) -> str:
        x, y, angle = (float(found[k]) for k in (1, 2, 3))
        turn = Rotation.from_rotvec([math.pi / 2, 0, 0]) * Rotation.from_rotvec([0, angle, 0])
        way = turn.as_rotvec()
        axis = " ".join(f"{each:.6f}" for each in way / np.linalg.norm(way))
        return f"translation {x:g} {-y:g} 0\n  rotation {axis} {np.linalg.norm(way):.6f}"

    lying = re.sub(r"translation (\S+) 0 (\S+)\n  rotation 0 1 0 (\S+)", upright, world(True))
    plan = plan_of_world(tmp_path, lying)
    assert sorted(round(room.area, 1) for room in plan.rooms) == [12.0, 12.0]
    assert sorted(door.kind for door in plan.doors) == ["door", "entrance"]
    assert plan.frame is not None
    assert plan.frame.up == "z"


def test_the_world_names_its_axes_where_it_has_others_than_its_version(tmp_path: Path) -> None:
    text = world(True, head=Z_UP).replace("basicTimeStep 16", 'basicTimeStep 16\n  coordinateSystem "NUE"')
    assert len(plan_of_world(tmp_path, text).rooms) == 2


def test_floors_with_the_names_of_rooms_name_them(tmp_path: Path) -> None:
    floors = """DEF FLOOR Solid { translation 2 1.5 0 name "floor" children [
      DEF KITCHEN Transform { children [ Shape { geometry Plane { size 4, 3 } } ] }
      DEF BEDROOM_1 Pose { translation 4.2 0 0 children [ Shape { geometry Box { size 4 3 0.01 } } ] } ] }"""
    plan = plan_of_world(tmp_path, world(more=floors))
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]


def test_hidden_fields_in_which_webots_saves_states_are_read_over(tmp_path: Path) -> None:
    """Webots writes them into nodes of PROTOs that have moved, a Door among them."""
    saved = "Door {\n  hidden translation_5 0.001 9.87e-11 2.2e-15\n  hidden rotation_1 0 1 0 0.5\n  translation"
    text = world().replace("Door {\n  translation", saved)
    assert sorted(door.kind for door in plan_of_world(tmp_path, text).doors) == ["door", "entrance"]


def test_a_list_that_is_not_closed_ends_with_its_node(tmp_path: Path) -> None:
    text = world(more="Turtle {\n  children [\n\n}\nSofa {\n  translation 1 1 0\n}\n")
    assert len(plan_of_world(tmp_path, text).rooms) == 2


def test_a_wall_that_crosses_at_the_end_of_a_hole_does_not_deepen_it() -> None:
    """The crossing wall laps over the hole by a centimetre, and goes on to one side."""
    hole = Hole(shapely.box(0, 0, 1, 0.3), 0.0, 2.0, True, (0.0, 1.0))
    own, crossing = Wall(shapely.box(-0.3, 0, 3, 0.3), 0.0, 2.5), Wall(shapely.box(-0.3, -3, 0.01, 0.3), 0.0, 2.5)
    deep = deepen_to_wall_faces(hole, [own, crossing])
    assert deep is not None
    assert deep.shape.bounds == pytest.approx((0, 0, 1, 0.3), abs=0.01)


def test_floors_of_one_name_that_meet_without_a_wall_are_one_room(tmp_path: Path) -> None:
    floors = """Solid { translation 2 1.5 0 name "floor" children [
      DEF LIVING_ROOM_1 Transform { translation -1 0 0 children [ Shape { geometry Plane { size 2, 3 } } ] }
      DEF LIVING_ROOM_2 Transform { translation 1 0 0 children [ Shape { geometry Plane { size 2, 3 } } ] }
      DEF LIVING_ROOM_3 Pose { translation 4.2 0 0 children [ Shape { geometry Box { size 4 3 0.01 } } ] } ] }"""
    plan = plan_of_world(tmp_path, world(more=floors))
    assert sorted(round(room.area, 1) for room in plan.rooms) == [12.0, 12.0]


COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="{count}">{points}</float_array><technique_common>
   <accessor source="#pa" count="{third}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
   <param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="{faces}"><input semantic="VERTEX" source="#v" offset="0"/><p>{index}</p></triangles>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene>
 </library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def sheets(path: Path, corners: list[tuple[float, float]], height: float = 2.5) -> None:
    """Write upright faces between each two corners and the next two, as COLLADA."""
    points, index = [], []
    for (x1, y1), (x2, y2) in zip(corners[::2], corners[1::2], strict=True):
        k = len(points)
        points += [(x1, y1, 0), (x2, y2, 0), (x2, y2, height), (x1, y1, height)]
        index += [k, k + 1, k + 2, k, k + 2, k + 3]
    numbers = " ".join(str(each) for point in points for each in point)
    text = COLLADA.format(
        count=3 * len(points),
        points=numbers,
        third=len(points),
        faces=len(index) // 3,
        index=" ".join(map(str, index)),
    )
    path.write_text(text)


def test_meshes_beside_the_world_are_named_by_their_files_and_may_be_sheets(tmp_path: Path) -> None:
    pytest.importorskip("collada")
    outer = [(0, 0), (8, 0), (8, 0), (8, 3), (8, 3), (0, 3), (0, 3), (0, 0)]
    sheets(tmp_path / "walls_1.dae", [*outer, (4, 0), (4, 1), (4, 2), (4, 3)])
    mesh = 'Shape { geometry Mesh { url [ "walls_1.dae" ] } }'
    text = f'{Z_UP}\nWorldInfo {{\n}}\nSolid {{ name "solid(7)" children [ {mesh} ] }}\n'
    plan = plan_of_world(tmp_path, text)
    assert sorted(round(room.area) for room in plan.rooms) == [12, 12]
    assert [door.kind for door in plan.doors] == ["opening"]


def test_walls_that_are_plain_solids_count_by_their_names(tmp_path: Path) -> None:
    def box(name: str, at: str, size: str) -> str:
        return f'Solid {{ translation {at} name "{name}" children [ Shape {{ geometry Box {{ size {size} }} }} ] }}\n'

    def used(at: str) -> str:
        return f"Transform {{ translation {at} children [ USE SIDE ] }}\n"

    points = "0 -0.1 0, 4 -0.1 0, 4 0.1 0, 0 0.1 0, 0 -0.1 2.5, 4 -0.1 2.5, 4 0.1 2.5, 0 0.1 2.5"
    faces = "0 3 2 1 -1 4 5 6 7 -1 0 1 5 4 -1 1 2 6 5 -1 2 3 7 6 -1 3 0 4 7 -1"
    shape = (
        f"Shape {{ geometry IndexedFaceSet {{ coord Coordinate {{ point [ {points} ] }} coordIndex [ {faces} ] }} }}"
    )
    text = "\n".join(
        [
            Z_UP,
            box("wall south", "2 0 1.25", "4.2 0.2 2.5"),
            f'DEF SIDE Solid {{ rotation 0 0 1 1.5707963 name "wall side" children [ {shape} ] }}',
            used("4 0 0"),
            box("wall north", "2 4 1.25", "4.2 0.2 2.5"),
            box("cupboard", "1 1 0.5", "1 1 1"),
        ]
    )
    plan = plan_of_world(tmp_path, text)
    assert [round(room.area, 1) for room in plan.rooms] == [14.4]


def test_an_arena_has_the_walls_that_it_says(tmp_path: Path) -> None:
    arena = f"{Z_UP}\nRectangleArena {{ floorSize 5 4 wallThickness 0.1 wallHeight 2 }}\n"
    assert plan_of_world(tmp_path, arena).area == pytest.approx(20, abs=0.1)
    low = f"{Z_UP}\nRectangleArena {{ floorSize 5 4 }}\n"  # walls of 0.1 m: nothing stands there
    assert "among 1 nodes" in refused(tmp_path, low).detail


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (Z_UP, "expected Wall nodes"),
        (f"{Z_UP}\nSofa {{ }}\n", "among 1 nodes"),
        (f"{Z_UP}\nWall {{\n  size 1 2\n", "line 4: expected a node or a field, found the end of the file"),
        (f"{Z_UP}\nWall {{ ] }}\n", "found ]"),
        (f"{Z_UP}\n{{ }}\n", "found {"),
        (Z_UP + "\n" + "Group { children [ " * 200, "deep"),
    ],
)
def test_what_is_no_world_is_refused_with_the_line(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(tmp_path, text).detail


def test_impossible_numbers_and_meshes_elsewhere_cost_only_their_node(tmp_path: Path) -> None:
    more = """Wall { translation nan 0 0 size 1e400 -1 x }
    Solid { name "wall" children [ Shape { geometry Mesh { url "../../secret.stl" } }
      Shape { geometry Mesh { url "https://example.org/wall.stl" } }
      Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0 ] } coordIndex [ 0 1 2 ] } } ] }"""
    plan = plan_of_world(tmp_path, world(more=more))
    assert plan.provenance is not None
    assert "'../../secret.stl' is not in the folder" in plan.provenance["left_out"]
    assert "names a point that is not there" in plan.provenance["left_out"]


def test_a_node_used_without_end_is_refused(tmp_path: Path) -> None:
    layers = "".join(f"DEF A{k + 1} Group {{ children [ {' '.join([f'USE A{k}'] * 10)} ] }}\n" for k in range(8))
    text = f"{Z_UP}\nDEF A0 Group {{ children [ Wall {{ }} ] }}\n{layers}"
    assert "nodes, expected 1,000,000 at most" in refused(tmp_path, text).detail


@pytest.mark.parametrize(("gap_m", "kinds"), [(1.2, ["entrance", "opening"]), (2.2, ["entrance", "opening"])])
def test_a_gap_without_a_door_is_an_opening_though_there_are_doors_elsewhere(
    tmp_path: Path, gap_m: float, kinds: list[str]
) -> None:
    """Two rooms of 4 x 5 m; the outer door has a node."""
    low = (5.0 - gap_m) / 2
    parts = [
        node("Wall", 4.1, -0.1, 8.6),
        node("Wall", 4.1, 5.1, 8.6),
        node("Wall", -0.1, 2.5, 5.4, across=True),
        node("Wall", 8.3, 0.5, 1.0, across=True),
        node("Door", 8.3, 1.5, 1.0, across=True),
        node("Wall", 8.3, 3.6, 3.2, across=True),
        node("Wall", 4.1, low / 2, low, across=True),
        node("Wall", 4.1, 5.0 - low / 2, low, across=True),
    ]
    plan = plan_of_world(tmp_path, f"{Z_UP}\nWorldInfo {{\n}}\n{''.join(parts)}")
    assert sorted(door.kind for door in plan.doors) == kinds
    assert len(plan.rooms) == 2
