"""Plans written as drawings, graphs and arrays, read back with the libraries that people read them with."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo import FloorPlan, decode
from houseexpo.exports import (
    FORMATS,
    geojson,
    graphml,
    npz,
    orient_plan,
    pol,
    published_json,
    svg,
)
from houseexpo.plan import PlanObject, Quality
from tests.builders.needs import need
from tests.houseexpo.exports.readers import enclosed, near, parsed


def _filled(rings):
    """Even-odd: walls from the rings that bound them."""
    shape = shapely.Polygon()
    for ring in rings:
        shape = shapely.symmetric_difference(shape, shapely.make_valid(ring, method="linework"))
    return [shape]


def test_geojson_through_shapely(plans):
    for plan in plans:
        data = geojson(plan)[f"{plan.id}.geojson"]
        shapes = shapely.get_parts(shapely.from_geojson(data.decode()))
        kinds = [feature["properties"]["kind"] for feature in json.loads(data)["features"]]
        of = {kind: [s for s, k in zip(shapes, kinds, strict=True) if k == kind] for kind in set(kinds)}
        (free,) = of["free_space"]
        assert free.area == near(plan)
        assert enclosed(of["wall"]).area == near(plan)
        assert [s.area for s in of.get("room", [])] == pytest.approx([room.area for room in plan.rooms], rel=1e-3)
        assert len(of.get("door", [])) == len(plan.doors)
        rings = [part.exterior for s in shapes for part in shapely.get_parts(s)]
        assert shapely.is_ccw(rings).all()


def test_geojson_is_in_metres_for_geopandas(flat, tmp_path):
    need(modules=["geopandas"], how="make readers")
    import geopandas

    (tmp_path / "a.geojson").write_bytes(geojson(flat)[f"{flat.id}.geojson"])
    table = geopandas.read_file(tmp_path / "a.geojson")
    assert [axis.unit_name for axis in table.crs.axis_info] == ["metre", "metre"]  # not degrees
    assert table[table.kind == "free_space"].area.sum() == near(flat)


def test_geojson_and_svg_carry_furniture_and_quality(flat):
    oven = PlanObject(4, "Oven & <hob>", 0, flat.holes[0][::-1], 0.9)
    told = replace(flat, objects=(oven,), quality=Quality(0.7, {"cut_share": 0.5}))
    collection = json.loads(geojson(told)[f"{flat.id}.geojson"])
    (found,) = [f for f in collection["features"] if f["properties"]["kind"] == "object"]
    assert found["properties"] == {"kind": "object", "object": 4, "label": "Oven & <hob>", "room": 0, "height": 0.9}
    assert shapely.geometry.shape(found["geometry"]).area == pytest.approx(0.16)
    assert collection["properties"]["quality"] == {"score": 0.7, "grounds": {"cut_share": 0.5}}
    assert json.loads(geojson(flat)[f"{flat.id}.geojson"])["properties"]["quality"] is None
    groups = {group.get("id"): group for group in parsed(svg(told)[f"{flat.id}.svg"]) if group.get("id")}
    assert [path[0].text for path in groups["objects"]] == ["Oven & <hob>"]
    assert b'"objects"' not in svg(flat)[f"{flat.id}.svg"]


def test_furniture_of_a_mirrored_house_is_turned_back_with_it(mirrored):
    oven = PlanObject(0, "oven", 0, mirrored.holes[0][::-1], 0.9)
    (turned,) = orient_plan(replace(mirrored, objects=(oven,))).objects
    assert turned.polygon.equals(shapely.Polygon(orient_plan(mirrored).holes[0]))
    assert not turned.polygon.equals(oven.polygon)


def test_graphml_through_networkx(flat):
    graph = nx.read_graphml(io.BytesIO(graphml(flat)[f"{flat.id}.graphml"]), node_type=int, force_multigraph=True)
    assert nx.get_node_attributes(graph, "label") == {0: "Living_Room", 1: "Bedroom", 2: "Unlabelled"}
    assert {frozenset(edge) for edge in graph.edges()} == {frozenset((0, 1)), frozenset((0, 2))}
    assert sorted(nx.get_edge_attributes(graph, "kind").values()) == ["door", "opening"]
    assert graph.graph["area"] == near(flat)
    doors = sum(door.polygon.area for door in flat.doors if door.kind != "entrance")
    assert sum(nx.get_node_attributes(graph, "area").values()) + doors == near(flat)


def test_graphml_of_a_label_with_characters_that_xml_cannot_hold():
    plan = FloorPlan("a", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {"Bed\x01ro\x0bom": [(0, 0, 2, 2)]})
    graph = nx.read_graphml(io.BytesIO(graphml(plan)["a.graphml"]))
    assert [label for _, label in graph.nodes(data="label")] == ["Bed\ufffdro\ufffdom"]


def test_npz_through_numpy(flat, mirrored):
    for plan in (flat, mirrored):
        found = np.load(io.BytesIO(npz(plan)[f"{plan.id}.npz"]))
        cell = found["resolution"] ** 2
        assert (found["occupancy"] == 0).sum() * cell == near(plan)
        assert [(found["rooms"] == i).sum() * cell for i in found["room_ids"]] == pytest.approx(
            [room.area for room in plan.rooms], rel=0.02
        )
        row, col = ((np.array((4.15, 1.5)) - found["origin"]) / found["resolution"]).astype(int)[::-1]
        assert found["doors"][row, col] == 0  # in the plan's own axes, mirrored or not
        assert found["distance"].max() > 0.9


def test_svg_is_to_scale(plans):
    for plan in plans:
        root = parsed(svg(plan)[f"{plan.id}.svg"])
        groups = {group.get("id"): group for group in root if group.get("id")}
        (path,) = groups["free-space"]
        rings = [
            np.array([p.split(",") for p in ring.strip("MZ ").split()], float)
            for ring in path.get("d").split("Z")
            if ring
        ]
        assert _filled([shapely.Polygon(ring) for ring in rings])[0].area == near(plan)
        x, y, wide, high = map(float, root.get("viewBox").split())
        assert (float(root.get("width")), float(root.get("height"))) == pytest.approx((50 * wide, 50 * high), abs=0.01)
        assert shapely.box(x, y, x + wide, y + high).buffer(1e-3).covers(shapely.MultiPoint(np.concatenate(rings)))
        assert len(groups.get("rooms", ())) == len(plan.rooms)


def test_pol_is_one_polygon_of_fractions(flat, published):
    for plan in (flat, published[0]):
        words = pol(plan)[f"{plan.id}.pol"].decode().split()
        rings = []

        def ring(words=words, rings=rings):
            count = int(words.pop(0))
            values = [int(a) / int(b) for a, b in (words.pop(0).split("/") for _ in range(2 * count))]
            rings.append(shapely.LinearRing(np.array(values).reshape(-1, 2)))

        ring()
        for _ in range(int(words.pop(0)) if words else 0):
            ring()
        assert not words
        assert shapely.Polygon(rings[0], rings[1:]).area == near(plan)
        assert [r.is_ccw for r in rings] == [True] + [False] * len(plan.holes)


def test_published_json_through_json(plans):
    for plan in plans:
        data = published_json(plan)[f"{plan.id}.json"]
        found = json.loads(data)
        assert set(found) == {"id", "verts", "bbox", "room_num", "room_category"}
        back = decode(data)
        assert back.area == near(plan)
        if not plan.holes:
            assert np.array_equal(back.verts, plan.verts)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_equal_plans_give_equal_bytes(flat, mirrored, name):
    if name in {"dxf", "ifc"}:
        pytest.importorskip({"dxf": "ezdxf", "ifc": "ifcopenshell"}[name])

    def made():
        return list(FORMATS[name].files([flat, mirrored]))

    assert made() == made()
    assert all(b"/tmp" not in content and b"2026" not in content for _, content in made())
