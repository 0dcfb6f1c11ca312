"""Every format is read back by a library that is not ours, and the free area is the plan's."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import shapely
import trimesh
import yaml
from PIL import Image

from houseexpo import FloorPlan, decode
from houseexpo.export import (
    FORMATS,
    geojson,
    glb,
    graphml,
    npz,
    obj,
    oriented,
    png,
    pol,
    published,
    ros,
    sdf,
    stage,
    svg,
)
from houseexpo.plan import PlanObject, Quality
from tests.houseexpo.export.readers import box_of, enclosed, parsed, polyline_of, solid_at, stage_blocks

SQUARE = "square", [(0.1, 0.1), (0.1, 2.1), (2.1, 2.1), (2.1, 0.1)], 1, {}


def near(plan):
    return pytest.approx(plan.area, rel=0.01)


def test_ros_map_through_yaml_and_pillow(plans):
    for plan in plans:
        files = ros(plan)
        found = yaml.safe_load(files[f"{plan.id}.yaml"])
        pixels = np.asarray(Image.open(io.BytesIO(files[found["image"]])))
        occupied = (255 - pixels.astype(float)) / 255
        assert (occupied < found["free_thresh"]).sum() * found["resolution"] ** 2 == near(plan)
        assert {"free", "wall"} <= {{254: "free", 0: "wall", 205: "unknown"}[v] for v in np.unique(pixels).tolist()}
        between = (occupied > found["free_thresh"]) & (occupied < found["occupied_thresh"])
        assert (between == (pixels == 205)).all()


def test_ros_origin_is_the_lower_left_corner_of_the_lower_left_pixel(flat):
    files = ros(flat, resolution=0.02)
    found = yaml.safe_load(files[f"{flat.id}.yaml"])
    pixels = np.asarray(Image.open(io.BytesIO(files[f"{flat.id}.pgm"])))
    x0, y0, yaw = found["origin"]
    rng = np.random.default_rng(1)
    points = rng.uniform((0.2, 0.2), (7.6, 5.2), (200, 2))
    cols, rows = ((points - (x0, y0)) / found["resolution"]).astype(int).T
    clear = shapely.distance(flat.free_space.boundary, shapely.points(points)) > 0.03
    free = shapely.contains_xy(flat.free_space, points)
    assert yaw == 0.0
    assert clear.sum() > 100
    assert ((pixels[len(pixels) - 1 - rows, cols] == 254) == free)[clear].all()


def test_sdf_boxes_and_prisms(plans):
    for plan in plans:
        root = parsed(sdf(plan)[f"{plan.id}.sdf"])
        assert root.find("world").get("name") == plan.id
        parts = [c for c in root.iter("collision") if not c.get("name").startswith("ground")]
        shapes = [box_of(c) or polyline_of(c) for c in parts]
        walls = [shape for shape, low, _ in shapes if low == 0.0]
        assert enclosed(walls).area == near(plan)
        assert {high for _, _, high in shapes} == {2.5}
        assert shapely.union_all(walls).area == pytest.approx(sum(wall.area for wall in walls), rel=1e-3)
        lintels = [(shape.area, low) for shape, low, _ in shapes if low > 0]
        assert lintels == ([(pytest.approx(0.08), pytest.approx(2.1))] if plan.rooms else [])


def test_sdf_oblique_walls_are_not_boxes(flat):
    root = parsed(sdf(flat)[f"{flat.id}.sdf"])
    walls = [polyline_of(c) for c in root.iter("collision") if c.find("geometry/polyline") is not None]
    oblique = shapely.union_all([shape for shape, _, _ in walls])
    assert oblique.covers(shapely.LineString([(6.3, 3.05), (7.6, 1.75)]))


def test_stage_blocks_stand_where_their_points_say(plans):
    for plan in plans:
        blocks, size, pose = stage_blocks(stage(plan)[f"{plan.id}.world"].decode())
        assert enclosed(blocks).area == near(plan)
        x1, y1, x2, y2 = shapely.total_bounds(blocks)
        assert size == pytest.approx((x2 - x1, y2 - y1, 2.5), abs=2e-4)  # else Stage would scale and shift them
        assert pose == pytest.approx(((x1 + x2) / 2, (y1 + y2) / 2, 0, 0), abs=2e-4)
        assert all(block.equals(block.convex_hull) or block.convex_hull.area - block.area < 1e-6 for block in blocks)


def test_irsim_opens_its_world(plans, tmp_path):
    irsim = pytest.importorskip("irsim")
    from houseexpo.export import irsim as write

    for plan in plans[:4]:
        file = tmp_path / "world.yaml"
        file.write_bytes(write(plan)[f"{plan.id}.irsim.yaml"])
        world = irsim.make(str(file), headless=True, log_level="ERROR")
        assert enclosed([obstacle.geometry for obstacle in world.obstacle_list]).area == near(plan)
        for _ in range(3):
            world.step(np.array([[0.3], [0.1]]))
        assert not world.robot.collision
        assert np.asarray(world.get_lidar_scan()["ranges"]).min() > 0.2
        goal = shapely.Point(world.robot.goal[:2, 0])
        assert oriented(plan).free_space.buffer(-0.19).intersects(goal)
        world.end(0)


@pytest.mark.parametrize("write", [glb, obj])
def test_meshes_through_trimesh(plans, write):
    for plan in plans:
        ((name, data),) = write(plan).items()
        scene = trimesh.load_scene(io.BytesIO(data), file_type=name.rsplit(".", 1)[1], split_objects=True)
        walls, floor = scene.geometry["walls"], scene.geometry["floor"]
        for body in (walls, floor):
            # a ring that touches itself gives walls that meet in a line; the reader welds what stands apart there
            assert body.is_watertight or not shapely.Polygon(plan.verts).is_valid
            assert body.volume > 0
        assert walls.bounds[:, 1] == pytest.approx((0.0, 2.5), abs=1e-6)
        assert floor.bounds[:, 1] == pytest.approx((-0.05, 0.0), abs=1e-6)
        assert enclosed(solid_at(walls, 1.03)).area == near(plan)
        if plan.rooms:  # the door's lintel, and none over the opening
            assert enclosed(solid_at(walls, 2.3)).area == pytest.approx(plan.area - 0.08, rel=1e-3)


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
    (turned,) = oriented(replace(mirrored, objects=(oven,))).objects
    assert turned.shape.equals(shapely.Polygon(oriented(mirrored).holes[0]))
    assert not turned.shape.equals(oven.shape)


def test_graphml_through_networkx(flat):
    graph = nx.read_graphml(io.BytesIO(graphml(flat)[f"{flat.id}.graphml"]), node_type=int, force_multigraph=True)
    assert nx.get_node_attributes(graph, "label") == {0: "Living_Room", 1: "Bedroom", 2: "Unlabelled"}
    assert {frozenset(edge) for edge in graph.edges()} == {frozenset((0, 1)), frozenset((0, 2))}
    assert sorted(nx.get_edge_attributes(graph, "kind").values()) == ["door", "opening"]
    assert graph.graph["area"] == near(flat)
    doors = sum(door.shape.area for door in flat.doors if door.kind != "entrance")
    assert sum(nx.get_node_attributes(graph, "area").values()) + doors == near(flat)


def test_graphml_of_a_label_with_characters_that_xml_cannot_hold():
    plan = FloorPlan("a", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {"Bed\x01ro\x0bom": [(0, 0, 2, 2)]})
    graph = nx.read_graphml(io.BytesIO(graphml(plan)["a.graphml"]))
    assert [label for _, label in graph.nodes(data="label")] == ["Bed\ufffdro\ufffdom"]


def test_graphml_of_a_published_plan_has_its_boxes(published):
    plan = max(published, key=lambda plan: len(plan.room_category))
    graph = nx.read_graphml(io.BytesIO(graphml(plan)[f"{plan.id}.graphml"]))
    assert sorted(set(nx.get_node_attributes(graph, "label").values())) == sorted(plan.room_category)
    assert set(nx.get_node_attributes(graph, "source").values()) == {"box"}
    assert not graph.edges


def test_png_through_pillow(plans):
    for plan in plans:
        pixels = np.asarray(Image.open(io.BytesIO(png(plan)[f"{plan.id}.png"])))
        assert set(np.unique(pixels)) == {0, 255}
        assert (pixels == 255).sum() * 0.02**2 == near(plan)


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
        data = published(plan)[f"{plan.id}.json"]
        found = json.loads(data)
        assert set(found) == {"id", "verts", "bbox", "room_num", "room_category"}
        back = decode(data)
        assert back.area == near(plan)
        if not plan.holes:
            assert np.array_equal(back.verts, plan.verts)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_equal_plans_give_equal_bytes(flat, mirrored, name):
    def made():
        return list(FORMATS[name].files([flat, mirrored]))

    assert made() == made()
    assert all(b"/tmp" not in content and b"2026" not in content for _, content in made())
