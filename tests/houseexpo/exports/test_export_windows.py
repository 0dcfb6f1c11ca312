"""Windows in exports: gaps in drawings, holes with glass between sill and head in 3D, and plans that are read back."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from houseexpo.exports.dxf import dxf
from houseexpo.exports.formats import export
from houseexpo.exports.geojson import geojson
from houseexpo.exports.ifc import ifc
from houseexpo.exports.mesh import glb
from houseexpo.exports.mjcf import mjcf
from houseexpo.exports.plan_bodies import DOOR_HEIGHT_M, WALL_THICKNESS_M, WINDOW_SILL_M, plan_bodies
from houseexpo.exports.rmf import rmf
from houseexpo.exports.sdf import sdf
from houseexpo.exports.svg import svg
from houseexpo.exports.usd import usd
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door
from tests.builders.batch import likeness, plans_of
from tests.houseexpo.exports.conftest import box

OUTER = Door(0, "window", ((5.0, 0.0), (6.2, 0.0)), 1.2, box(5.0, -0.1, 6.2, 0.1), (1, None), sill=1.0, head=2.2)
INNER = Door(1, "window", ((2.0, 3.2), (3.0, 3.2)), 1.0, box(2.0, 3.1, 3.0, 3.3), (0, 2))


@pytest.fixture
def lit(flat: FloorPlan) -> FloorPlan:
    return replace(flat, id="flat", windows=(OUTER, INNER))


def only(files: dict[str, bytes]) -> bytes:
    (data,) = files.values()
    return data


def test_windows_take_the_wall_as_it_is_drawn_between_their_heights(lit: FloorPlan) -> None:
    outer, inner = plan_bodies(lit).windows
    assert outer.shape.bounds == pytest.approx((5.0, 0.1 - WALL_THICKNESS_M, 6.2, 0.1))
    assert inner.shape.bounds == pytest.approx((2.0, 3.1, 3.0, 3.3))
    assert (outer.sill, outer.head) == (1.0, 2.2)
    assert (inner.sill, inner.head) == (WINDOW_SILL_M, DOOR_HEIGHT_M)  # the plan does not state them
    (low,) = plan_bodies(lit, wall_height=0.95, door_height=0.95).windows
    assert (low.window, low.head) == (INNER, 0.95)  # the walls end below the other one's sill


def test_drawings_show_windows_apart_from_doors(lit: FloorPlan) -> None:
    features = json.loads(only(geojson(lit)))["features"]
    (first, second) = (each["properties"] for each in features if each["properties"]["kind"] == "window")
    assert first == {"kind": "window", "window": 0, "width": 1.2, "rooms": [1, None], "sill": 1.0, "head": 2.2}
    assert (second["rooms"], second["sill"]) == ([0, 2], None)
    assert only(svg(lit)).decode().count("<title>window</title>") == 2
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.read(io.StringIO(only(dxf(lit)).decode()))
    assert len(drawing.modelspace().query('LWPOLYLINE[layer=="WINDOWS"]')) == 2


def test_walls_of_a_mesh_have_holes_with_glass(lit: FloorPlan, flat: FloorPlan) -> None:
    whole, pierced = (trimesh.load(io.BytesIO(only(glb(plan))), file_type="glb") for plan in (flat, lit))
    glass = [pierced.geometry[f"window_{number}"] for number in (0, 1)]
    assert [each.volume for each in glass] == pytest.approx([1.2 * 0.1 * 1.2, 1.0 * 0.2 * 1.2])
    assert all(each.is_watertight for each in (pierced.geometry["walls"], *glass))
    taken = whole.geometry["walls"].volume - pierced.geometry["walls"].volume
    assert taken == pytest.approx(sum(each.volume for each in glass))
    assert glass[0].bounds[:, 1] == pytest.approx([1.0, 2.2])


def test_an_open_rmf_building_has_windows_as_walls_that_one_sees_through(lit: FloorPlan) -> None:
    data = next(data for name, data in rmf(lit).items() if name.endswith(".yaml"))
    level = yaml.safe_load(data)["levels"]["L1"]
    (a, b, said) = level["measurements"][0]
    points = np.array([vertex[:2] for vertex in level["vertices"]])
    metre = np.hypot(*(points[a] - points[b])) / said["distance"][1]
    glass = [(a, b) for a, b, look in level["walls"] if look["alpha"][1] < 1]
    assert max(np.ptp(points[np.ravel(glass)], axis=0)) > metre, "several windows"
    lengths = sorted({round(float(np.hypot(*(points[a] - points[b])) / metre), 2) for a, b in glass})
    assert {0.9, 1.1} <= set(lengths), "lines inside windows of 1.0 and 1.2 m, half of 0.1 m within each end"


@pytest.mark.parametrize("write", [sdf, mjcf, usd])
def test_worlds_have_wall_below_glass_and_wall_above(lit: FloorPlan, flat: FloorPlan, write) -> None:
    text = only(write(lit)).decode().lower()
    assert "window" not in only(write(flat)).decode().lower().replace("(windows", "")
    for name in ("wall_under_window_1", "window_lintel_1", "window_0", "window_1"):
        assert name in text, name


def test_an_ifc_file_has_windows_in_openings_of_walls(lit: FloorPlan) -> None:
    ifcopenshell = pytest.importorskip("ifcopenshell")
    model = ifcopenshell.file.from_string(only(ifc(lit)).decode())
    for window, sizes in zip(model.by_type("IfcWindow"), [(1.2, 1.2), (1.0, 1.2)], strict=True):
        assert (window.OverallWidth, window.OverallHeight) == pytest.approx(sizes)
        (fills,) = window.FillsVoids
        (voids,) = fills.RelatingOpeningElement.VoidsElements
        assert voids.RelatingBuildingElement.is_a("IfcWall")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ifc", "glb", "obj", "usd", "sdf", "mjcf", "rmf", "dxf", "geojson", "svg"])
def test_a_plan_with_windows_is_read_back(lit: FloorPlan, tmp_path: Path, name: str) -> None:
    export([lit], name, tmp_path)
    file = next(each for each in sorted(tmp_path.rglob("flat*")) if each.suffix not in {".mtl", ".png", ".json"})
    (back,) = plans_of(file)
    assert likeness(lit, back) > 0.99
    assert len(back.rooms) == len(lit.rooms)
    assert sorted(door.kind for door in back.doors) == sorted(door.kind for door in lit.doors)
    if name in {"sdf", "rmf"}:  # these are not searched for windows
        assert back.windows == ()
        return
    found = {None in window.rooms: (window.width, window.sill, window.head) for window in back.windows}
    if name in {"dxf", "svg"}:  # drawings have no heights
        assert found == {True: (1.2, None, None), False: (1.0, None, None)}
    else:
        assert found[True] == (1.2, 1.0, 2.2)
        assert found[False] == (1.0, *((None, None) if name == "geojson" else (0.9, 2.1)))
