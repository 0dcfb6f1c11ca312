"""Each format puts a plan back into its source's frame: what other readers find there is what the source has there."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
import yaml
from shapely.geometry.base import BaseGeometry

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports import FORMATS, default_frame, export, is_mirrored, orient_plan, world_from_plan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame
from tests.builders.tries import slow_but
from tests.houseexpo.exports.readers import READERS

YAW = 0.4
COS, SIN = math.cos(YAW), math.sin(YAW)
MAP = {"source": "robot's map", "file": "map.yaml"}
FLOOR_M = 1.25
FRAMES = {
    "shifted": Frame(((1.0, 0.0, -10.0), (0.0, 1.0, -5.0)), "z", FLOOR_M, 0),
    "turned": Frame(((COS, -SIN, -10.0), (SIN, COS, -5.0)), "z", FLOOR_M, 0),
    "y-up": Frame(((1.0, 0.0, 3.0), (0.0, -1.0, -2.0)), "y", FLOOR_M, 0),
    "mirrored": Frame(((COS, SIN, 3.0), (-SIN, COS, -2.0)), "y", FLOOR_M, 0),
    "far": Frame(((1.0, 0.0, 500_000.25), (0.0, 1.0, 5_400_000.5)), "z", FLOOR_M, 0),
}
LEAST_IOU = 0.95
"""Cells of 0.04 to 0.05 m cost up to 3% of a flat of 30 m2."""


def in_source(plan: FloorPlan, shape: BaseGeometry) -> BaseGeometry:
    """Return a shape of the plan where its source has it, as seen from above, by the definition in docs/format.md."""
    (a, b, x), (c, d, y) = plan.frame.matrix
    up = -1.0 if plan.frame.up == "y" else 1.0
    return shapely.transform(shape, lambda p: np.column_stack([p @ (a, b) + x, up * (p @ (c, d) + y)]))


@pytest.fixture
def placed(flat: FloorPlan, request: pytest.FixtureRequest) -> FloorPlan:
    return replace(flat, id="flat", frame=FRAMES[request.param], provenance=MAP)


def test_all_formats_are_tried() -> None:
    assert READERS.keys() == FORMATS.keys()


@pytest.mark.parametrize("placed", slow_but(FRAMES, "turned", "mirrored"), indirect=True)
@pytest.mark.parametrize("name", sorted(FORMATS))
def test_what_a_file_has_lies_where_its_source_has_it(placed, name, tmp_path):
    if name in {"dxf", "ifc"}:
        pytest.importorskip({"dxf": "ezdxf", "ifc": "ifcopenshell"}[name])
    if name == "json" and placed.frame is FRAMES["far"]:
        with pytest.raises(PlanError, match=r"found 5,400,00\d m from its origin; use the plan's frame"):
            export(placed, name, tmp_path)
        return
    files = export(placed, name, tmp_path, orientation="world")
    found = READERS[name]({file.name: file.read_bytes() for file in files})
    if name == "graphml":
        rooms = [in_source(placed, room.polygon) for room in placed.rooms]
        assert all(room.contains(point) for room, point in zip(rooms, found.geoms, strict=True))
        return
    expected = in_source(placed, placed.free_space)
    assert shapely.intersection(found, expected).area >= LEAST_IOU * shapely.union(found, expected).area


def test_maps_drawings_and_scans_go_back_by_default_and_models_do_not(flat):
    for source in ("robot's map", "dxf", "points", "gazebo"):
        assert default_frame(replace(flat, provenance={"source": source, "file": "a"})) == "source"
    for source in ("mesh", "ifc", "suncg", "sweethome"):
        assert default_frame(replace(flat, provenance={"source": source, "file": "a"})) == "plan"
    assert default_frame(replace(flat, provenance={"source": "generated", "sha256": "a"})) == "plan"
    assert default_frame(replace(flat, frame=None, provenance=MAP)) == "plan"
    assert default_frame(flat) == "plan"


def test_a_plan_without_a_source_is_not_put_back(flat, tmp_path):
    with pytest.raises(PlanError, match="use the plan's frame"):
        export(replace(flat, frame=None), "ros", tmp_path, frame="source")
    with pytest.raises(ConfigError, match="expected 'source' or 'plan', found 'world'"):
        export(flat, "ros", tmp_path, frame="world")
    doubled = Frame(((2.0, 0.0, 0.0), (0.0, 2.0, 0.0)), "z", 0.0, 0)
    with pytest.raises(PlanError, match="axes of 1 m at right angles"):
        export(replace(flat, frame=doubled), "ros", tmp_path, frame="source")


@pytest.mark.parametrize("placed", ["turned"], indirect=True)
def test_a_floor_lies_as_high_as_in_the_source(placed, tmp_path):
    glb, obj, sdf, mjcf, rmf = (export(placed, name, tmp_path)[0] for name in ("glb", "obj", "sdf", "mjcf", "rmf"))
    for mesh in (glb, obj):
        assert trimesh.load(mesh).bounds[0, 1] == pytest.approx(FLOOR_M - 0.05, abs=1e-3)
    poses = {model.get("name"): model.findtext("pose") for model in ET.parse(sdf).iter("model")}  # noqa: S314
    assert {pose.split()[2] for pose in poses.values()} == {f"{FLOOR_M:g}"}
    (body,) = ET.parse(mjcf).iter("body")  # noqa: S314
    assert body.get("pos").split()[2] == f"{FLOOR_M:g}"
    (level,) = yaml.safe_load(rmf.read_text())["levels"].values()
    assert level["elevation"] == FLOOR_M


@pytest.mark.parametrize("kind", ["glb", "ifc", "rmf"])
def test_storeys_lie_over_each_other_in_the_frame_of_the_source(flat, kind, tmp_path):
    if kind == "ifc":
        pytest.importorskip("ifcopenshell")
    low, high = (
        replace(flat, id=word, provenance=MAP, frame=Frame(((1.0, 0.0, x), (0.0, 1.0, -5.0)), "z", z, k))
        for k, (word, x, z) in enumerate([("low", -10.0, 2.0), ("high", -9.0, 5.0)])
    )
    files = export([high, low], kind, tmp_path, building="house")
    name = next(file for file in files if file.suffix in {".glb", ".ifc", ".yaml"})
    if kind == "glb":
        bounds = trimesh.load(name).bounds
        assert bounds[:, 1] == pytest.approx((2.0 - 0.05, 5.0 + 2.5), abs=1e-3)
        assert bounds[:, 0] == pytest.approx((-10.0, -9.0 + 7.8), abs=0.01)
    elif kind == "ifc":
        import ifcopenshell

        storeys = ifcopenshell.open(name).by_type("IfcBuildingStorey")
        assert [each.Elevation for each in storeys] == [2.0, 5.0]
    else:
        levels = yaml.safe_load(name.read_text())["levels"]
        assert [each["elevation"] for each in levels.values()] == [2.0, 5.0]
        assert len({json.dumps(each["fiducials"]) for each in levels.values()}) == 1


# Mirrored plans are put right where the house is looked at, and nowhere else.


def test_who_is_mirrored(flat, mirrored):
    assert not is_mirrored(flat)
    assert is_mirrored(mirrored)
    assert is_mirrored(replace(flat, frame=None))  # as published
    assert not is_mirrored(replace(flat, frame=Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "y", 0.0, 0)))
    assert is_mirrored(replace(flat, frame=Frame(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), "z", 0.0, 0)))


def test_left_handed_sources_are_not_mirrored(mirrored, flat):
    """Unity has x right and z up on its plan, Sweet Home 3D x right and y down."""
    assert not is_mirrored(replace(mirrored, provenance={"source": "procthor", "file": "house.json"}))
    down = Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "z", 0.0, 0)
    home = replace(flat, frame=down, provenance={"source": "sweethome", "file": "home.sh3d"})
    assert not is_mirrored(home)
    assert world_from_plan(home, frame="source") == ((1, 0, 0), (0, 1, 0))


def test_the_transform_undoes_the_mirror(flat, mirrored):
    assert orient_plan(flat) is flat
    assert orient_plan(mirrored, "plan") is mirrored
    turned = orient_plan(mirrored)
    assert turned.bbox == mirrored.bbox
    assert not is_mirrored(turned)
    (a, b, tx), (c, d, ty) = world_from_plan(mirrored)
    expected = shapely.affinity.affine_transform(mirrored.free_space, [a, b, c, d, tx, ty])
    assert shapely.symmetric_difference(turned.free_space, expected).area < 1e-6
    for room, old in zip(turned.rooms, mirrored.rooms, strict=True):
        assert turned.free_space.covers(room.polygon.buffer(-1e-6))
        assert room.area == pytest.approx(old.area)
    assert not shapely.LinearRing(turned.verts).is_ccw
    source = source_points_from_plan(mirrored.frame, mirrored.verts)
    assert np.allclose(source_points_from_plan(turned.frame, turned.verts)[::-1], source)
    assert turned.room_category["Bedroom"] == (pytest.approx((4.2, 2.2, 7.8, 5.3)),)


def test_no_third_orientation(flat):
    with pytest.raises(ConfigError, match="expected 'world' or 'plan', found 'up'"):
        world_from_plan(flat, "up")
