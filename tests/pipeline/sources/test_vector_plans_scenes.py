"""MJCF, USD, DXF and GeoJSON from elsewhere: what is named counts, and what is bad is refused with its reason."""

import json

import numpy as np
import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from tests.builders.round_trip import plans_of

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


def rejected(path) -> Rejection:
    (item,) = find(str(path))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    return caught.value


def test_mjcf_as_molmospaces_names_it(tmp_path):
    """The names are MolmoSpaces' own; the file is written here, since its scenes are no public repository's."""
    (tmp_path / "house.xml").write_text(MOLMO)
    (plan,) = plans_of(tmp_path / "house.xml")
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["door"]
    assert plan.area == pytest.approx(32 - 0.4 + 0.09, abs=0.1)
    assert plan.provenance["source"] == "mjcf"


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
