"""IFC, DXF, USD and MJCF are read back by the library that the format's users have; MuJoCo drives in its world."""

import io
from collections import Counter

import numpy as np
import pytest
import shapely

from houseexpo.exports import dxf, ifc, mjcf, orient_plan, usd
from tests.houseexpo.exports.readers import near


def test_ifc_through_ifcopenshell(plans):
    ifcopenshell = pytest.importorskip("ifcopenshell")
    from ifcopenshell import geom, validate

    for plan in plans:
        model = ifcopenshell.file.from_string(ifc(plan)[f"{plan.id}.ifc"].decode())
        log = validate.json_logger()
        validate.validate(model, log)
        assert not log.statements
        spaces = model.by_type("IfcSpace")
        assert Counter(space.ObjectType for space in spaces) == Counter(room.label for room in plan.rooms)
        assert len(model.by_type("IfcDoor")) == sum(door.kind in {"door", "entrance"} for door in plan.doors)
        assert len(model.by_type("IfcOpeningElement")) == len(plan.doors)
        assert len(model.by_type("IfcRelVoidsElement")) == len(plan.doors)
        for space in spaces:
            shape = geom.create_shape(geom.settings(), space)
            points = np.array(shape.geometry.verts).reshape(-1, 3)
            room = orient_plan(plan).room(int(space.Name))
            assert np.allclose(points[:, :2].min(axis=0), room.polygon.bounds[:2], atol=1e-3)
            assert np.allclose(points[:, 2].max(), 2.5)
        assert len({thing.GlobalId for thing in model.by_type("IfcRoot")}) == len(model.by_type("IfcRoot"))


def test_dxf_through_ezdxf(plans):
    pytest.importorskip("ezdxf")
    from ezdxf import recover

    for plan in plans:
        document, auditor = recover.read(io.BytesIO(dxf(plan)[f"{plan.id}.dxf"]))
        assert not auditor.errors
        assert document.header["$INSUNITS"] == 6
        space = document.modelspace()
        rings = [shapely.Polygon([p[:2] for p in each.get_points()]) for each in space.query('*[layer=="ROOMS"]')]
        holes = sum(len(room.holes) for room in plan.rooms)
        assert len(rings) == len(plan.rooms) + holes
        assert {text.dxf.text for text in space.query("TEXT")} >= {room.label for room in plan.rooms}
        named = Counter(each.dxf.layer for each in space if each.dxf.layer in {"DOORS", "OPENINGS", "ENTRANCES"})
        assert sum(named.values()) == len(plan.doors)


def test_usd_through_usd_core(plans, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdPhysics

    for number, plan in enumerate(plans):
        path = tmp_path / f"{number}.usda"
        path.write_bytes(usd(plan)[f"{plan.id}.usda"])
        stage = Usd.Stage.Open(str(path))
        assert UsdGeom.GetStageUpAxis(stage) == "Z"
        assert UsdGeom.GetStageMetersPerUnit(stage) == 1
        meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
        floors = [each for each in meshes if each.GetPrim().GetName().startswith("Floor")]
        assert sum(_flat(each) for each in floors) + sum(
            d.polygon.area for d in plan.doors if d.kind != "entrance"
        ) == near(plan)
        labels = {each.GetPrim().GetAttribute("semanticLabel").Get() for each in meshes}
        assert labels >= {room.label for room in plan.rooms} | {door.kind for door in plan.doors}
        for each in meshes:
            is_door = each.GetPrim().GetName().startswith("Door")
            assert each.GetPrim().HasAPI(UsdPhysics.CollisionAPI) != is_door
            assert (each.GetPurposeAttr().Get() == "guide") == is_door
            assert UsdGeom.Mesh.ValidateTopology(
                each.GetFaceVertexIndicesAttr().Get(),
                each.GetFaceVertexCountsAttr().Get(),
                len(each.GetPointsAttr().Get()),
            )


def _flat(mesh) -> float:
    """Area of a slab seen from above."""
    points = np.array(mesh.GetPointsAttr().Get())
    triangles = points[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)][:, :, :2]
    return float(shapely.union_all(shapely.polygons(triangles), grid_size=1e-4).area)


def test_mjcf_through_mujoco(plans):
    """A ball falls on the floor of each room; a ray through a door meets no wall, one beside it does."""
    mujoco = pytest.importorskip("mujoco")
    for plan in plans:
        model = mujoco.MjModel.from_xml_string(mjcf(plan)[f"{plan.id}.xml"].decode())
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        names = [model.geom(i).name for i in range(model.ngeom)]
        sites = [model.site(i).name for i in range(model.nsite)]
        assert len(sites) == len(plan.doors)
        assert {tuple(name.split("|")[1:3]) for name in names if name.startswith("room|")} == {
            (str(room.id), room.label) for room in plan.rooms
        }
        world = orient_plan(plan)
        rng = np.random.default_rng(3)
        x1, y1, x2, y2 = world.bbox
        points = rng.uniform((x1, y1), (x2, y2), (100, 2))
        points = points[shapely.distance(world.free_space.boundary, shapely.points(points)) > 0.03]
        hit = np.zeros(1, np.int32)
        for x, y in points:
            mujoco.mj_ray(model, data, np.array([x, y, 1.0]), np.array([0.0, 0.0, -1.0]), None, 1, -1, hit)
            inside = model.geom(int(hit[0])).name
            free = shapely.intersects_xy(world.free_space, x, y)
            assert inside.startswith(("room|", "floor_")) == free or not free
        for door in world.doors:
            if door.kind != "entrance":
                middle = np.mean(door.segment, axis=0)
                (ax, ay), (bx, by) = door.segment
                across = np.array([-(by - ay), bx - ax]) / door.width
                start = np.array([*(middle - 0.3 * across), 1.0])
                distance = mujoco.mj_ray(model, data, start, np.array([*across, 0.0]), None, 1, -1, hit)
                assert distance < 0 or distance > 0.55
