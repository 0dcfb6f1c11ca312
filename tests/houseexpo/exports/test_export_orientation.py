"""Mirrored plans are put right where the house is looked at, and nowhere else."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.exports import FORMATS, export, geojson, is_mirrored, orient_plan, world_from_plan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Frame


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


def test_a_left_corner_of_a_suncg_house_is_where_it_is_from_above():
    """X to the right, Z towards the viewer: the corner of lowest X and Z is the upper left one."""
    notch = [(0.1, 1.1), (0.1, 3.1), (4.1, 3.1), (4.1, 0.1), (1.1, 0.1), (1.1, 1.1)]  # none at lowest x and y
    plan = FloorPlan("notched", notch, 1, {})
    found = json.loads(geojson(plan)["notched.geojson"])
    free = shapely.geometry.shape(found["features"][0]["geometry"])
    assert not free.contains(shapely.Point(0.6, 2.6))
    assert free.contains(shapely.Point(0.6, 0.6))
    assert found["properties"]["world_from_plan"] == [[1, 0, 0], [0, -1, 3.2]]


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_orientation_can_be_chosen_for_every_format(mirrored, flat, name, tmp_path):
    if name in {"dxf", "ifc"}:
        pytest.importorskip({"dxf": "ezdxf", "ifc": "ifcopenshell"}[name])
    same = replace(mirrored, frame=flat.frame)
    plan, world = (export(mirrored, name, tmp_path / o, orientation=o) for o in ("plan", "world"))
    upright = export(same, name, tmp_path / "upright", orientation="world")
    differ = [a.read_bytes() != b.read_bytes() for a, b in zip(plan, world, strict=True)]
    assert any(differ)
    if name not in {"npz", "geojson"}:  # these two hold the matrix as well
        assert [a.read_bytes() for a in plan] == [a.read_bytes() for a in upright]


def test_no_third_orientation(flat):
    with pytest.raises(ConfigError, match="expected 'world' or 'plan', found 'up'"):
        world_from_plan(flat, "up")
