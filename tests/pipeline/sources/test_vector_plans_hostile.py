"""Drawn plans made to do harm: each ends as levels or as a rejection, soon, and what is sound of a house stays."""

import json
import pickle
import struct

import pytest

from pipeline.rejection import Rejection
from pipeline.sources import find, reader

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
BOMB = b"\x80\x04K\x01\x94" + b"".join(b"0h%ch%c\x86\x94" % (i, i) for i in range(60)) + b"0"
"""A tuple of tuples of tuples, 60 deep, in 300 bytes: its hash and its text have no end."""
SVG = (
    '<svg><g class="Door"><polygon points="10,0 18,0 18,2 10,2"/></g><g class="Wall">'
    '<polygon points="0,0 90,0 90,2 0,2"/></g><g class="Wall">{}</g></svg>'
)


def levels(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return [level for item in find(str(path)) for level in reader(item.reader).read(item)]


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
        (
            "zind_data.json",
            json.dumps(
                {
                    "redraw": {"1": {"r": {"vertices": SQUARE}, "q": {"vertices": [[BIG, 0], [0, 1], [1, 1]]}}},
                    "scale_meters_per_coordinate": {"1": 1},
                }
            ),
        ),
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
        ("a.pkl", BOMB + b"}hKK\x01s.".replace(b"hK", b"h<"), "keys"),
        ("a.pkl", BOMB + b"}(h<K\x01u.", "keys"),
        ("a.pkl", BOMB + b"(h<K\x01d.", "keys"),
        ("a.pkl", BOMB + b"\x8f(h<\x90.", "set"),
        ("a.pkl", BOMB + b"(h<\x91.", "set"),
        ("a.pkl", b"\x80\x05\x96" + struct.pack("<Q", 6 << 30) + b".", "byte array"),
        (
            "a.pkl",
            b"\x80\x04](}(\x8c\x04wallK\x01\x8c\x02id\x8b" + struct.pack("<i", 3000) + b"\x7f" * 3000 + b"ue.",
            "digits",
        ),
        ("a.pkl", pickle.dumps([{"wall": 1, "inner": 1, "area": BIG}]), "scale"),
        ("annotation_3d.json", json.dumps({"junctions": [{"coordinate": [BIG, 0, 0]}]}), "Overflow"),
    ],
)
def test_what_has_no_end_is_refused(tmp_path, name, text, said):
    with pytest.raises(Rejection, match=said):
        levels(tmp_path / name, text)


def test_a_kind_of_number_is_no_text_without_end(tmp_path):
    assert levels_or_none(tmp_path / "a.pkl", BOMB + b"cnumpy\ndtype\nh<\x85R.") is None


def levels_or_none(path, text):
    try:
        return levels(path, text)
    except Rejection:
        return None


def test_includes_in_a_long_chain(tmp_path):
    for number in range(1, 1200):
        (tmp_path / f"c{number}.xml").write_text(f'<mujocoinclude><include file="c{number + 1}.xml"/></mujocoinclude>')
    assert len(levels(tmp_path / "a.xml", mujoco("", '<include file="c1.xml"/>'))) == 1


def test_blocks_within_blocks_are_counted_as_often_as_drawn(tmp_path, monkeypatch):
    ezdxf = pytest.importorskip("ezdxf")
    from pipeline.sources.vector_plans import dxf

    monkeypatch.setattr(dxf, "MOST_ENTITIES", 1000)
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

    monkeypatch.setattr(usd, "MOST_PRIMS", 3)
    with pytest.raises(Rejection, match="more than 3 prims"):
        levels(tmp_path / "a.usda", USD + 'def "b" (references = </Side>) {\n}\n')


def test_collections_within_collections_end_no_reader(tmp_path):
    head = "floor_id,entity_type,entity_subtype,geometry\n"
    wall = '1,separator,WALL,"POLYGON((0 0,5 0,5 1,0 1,0 0))"\n'
    deep = "GEOMETRYCOLLECTION(" * 50_000 + "POINT(1 1)" + ")" * 50_000
    assert len(levels(tmp_path / "a.csv", f'{head}{wall}1,area,KITCHEN,"{deep}"\n')) == 1
    wkb = b"\x01\x07\x00\x00\x00\x01\x00\x00\x00" * 200_000
    text = b"\x80\x04](}(\x8c\x04wallcshapely\nfrom_wkb\nB" + struct.pack("<I", len(wkb)) + wkb + b"\x85Rue."
    with pytest.raises(Rejection, match="scale"):
        levels(tmp_path / "a.pkl", text)


def test_fiducials_without_number(tmp_path):
    many = ", ".join(f"[{i}, {i * i % 997}, f{i}]" for i in range(3000))
    second = f"  L2:\n    vertices: []\n    walls: []\n    fiducials: [{many}]\n"
    text = RMF.format(head="", x=1) + f"    fiducials: [{many}]\n{second}"
    assert len(levels(tmp_path / "a.building.yaml", text)) == 1


def test_a_long_name_in_a_table_gives_an_id_that_a_plan_can_have(tmp_path):
    text = f'floor_id,entity_type,entity_subtype,geometry\n{"z" * 5000},separator,WALL,"POINT(0 0)"\n'
    (tmp_path / "a.csv").write_text(text)
    (item,) = find(str(tmp_path / "a.csv"))
    assert len(item.id) <= 180


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
