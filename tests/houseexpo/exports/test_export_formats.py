"""IFC, DXF, USD and MJCF are read back by the library that the format's users have; MuJoCo drives in its world."""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
import yaml
from PIL import Image

from houseexpo import FloorPlan
from houseexpo.exports import (
    dxf,
    export,
    glb,
    ifc,
    irsim,
    mjcf,
    obj,
    orient_plan,
    ros_map,
    sdf,
    stage,
    usd,
)
from houseexpo.exports.plan_bodies import plan_bodies
from houseexpo.plan import Frame, PlanObject, Room
from tests.houseexpo.exports.readers import READERS, box_of, enclosed, near, parsed, polyline_of, solid_at, stage_blocks


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


def test_the_long_name_of_a_space_is_no_word_among_several(plans):
    pytest.importorskip("ifcopenshell")
    plan = next(plan for plan in plans if plan.rooms)
    room = replace(plan.rooms[0], label="Bathroom", source_labels=("Küche", "Bad"))
    text = ifc(replace(plan, rooms=(room, *plan.rooms[1:])))[f"{plan.id}.ifc"].decode()
    import ifcopenshell

    spaces = {each.Name: each for each in ifcopenshell.file.from_string(text).by_type("IfcSpace")}
    assert (spaces[str(room.id)].LongName, spaces[str(room.id)].Description) == ("Bathroom", "Küche / Bad")


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


# Formats of simulators and viewers.


FLOORS = ["living_room_floor_0", "bedroom_floor_1", "unlabelled_floor_2", "door_threshold_0", "opening_threshold_1"]


def test_ros_map_through_yaml_and_pillow(plans):
    for plan in plans:
        files = ros_map(plan)
        found = yaml.safe_load(files[f"{plan.id}.yaml"])
        pixels = np.asarray(Image.open(io.BytesIO(files[found["image"]])))
        occupied = (255 - pixels.astype(float)) / 255
        assert (occupied < found["free_thresh"]).sum() * found["resolution"] ** 2 == near(plan)
        assert {"free", "wall"} <= {{254: "free", 0: "wall", 205: "unknown"}[v] for v in np.unique(pixels).tolist()}
        between = (occupied > found["free_thresh"]) & (occupied < found["occupied_thresh"])
        assert (between == (pixels == 205)).all()


def test_sdf_boxes_and_prisms(plans):
    for plan in plans:
        root = parsed(sdf(plan)[f"{plan.id}.sdf"])
        assert root.find("world").get("name") == plan.id
        parts = [c for c in root.iter("collision") if not c.get("name").startswith("ground")]
        shapes = [box_of(c) or polyline_of(c) for c in parts]
        walls = [shape for shape, low, _ in shapes if low == 0.0]
        assert enclosed(walls).area == near(plan)
        doors = [shape for shape, _, high in shapes if high == pytest.approx(2.1)]  # entrances are shut
        assert {high for _, _, high in shapes} == ({2.1, 2.5} if plan.rooms else {2.5})
        assert sum(shape.area for shape in doors) == (pytest.approx(0.09) if plan.rooms else 0)
        assert shapely.union_all(walls).area == pytest.approx(sum(wall.area for wall in walls), rel=1e-3)
        lintels = sorted((shape.area, low) for shape, low, _ in shapes if low > 0)
        over = [(pytest.approx(area), pytest.approx(2.1)) for area in (0.08, 0.09)]  # a door, an entrance
        assert lintels == (over if plan.rooms else [])


def test_sdf_has_a_model_for_each_floor_doorway_and_entrance(flat):
    root = parsed(sdf(flat)[f"{flat.id}.sdf"])
    models = {model.get("name"): model for model in root.iter("model")}
    assert list(models) == ["ground", "walls", "entrance_door_2", *FLOORS]
    assert all(model.findtext("static") == "true" for model in models.values())
    assert all(models[name].find("link/collision") is None for name in FLOORS)


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
    from houseexpo.exports import irsim as write

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
        assert orient_plan(plan).free_space.buffer(-0.19).intersects(goal)
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
        doors = [mesh for name, mesh in scene.geometry.items() if name.startswith("entrance_door")]
        assert enclosed([part for body in (walls, *doors) for part in solid_at(body, 1.03)]).area == near(plan)
        if plan.rooms:  # the door's lintel, and none over the opening
            assert enclosed(solid_at(walls, 2.3)).area == pytest.approx(plan.area - 0.08, rel=1e-3)


@pytest.mark.parametrize("write", [glb, obj])
def test_meshes_name_the_floors_of_rooms_doorways_and_entrances(flat, write):
    ((name, data),) = write(flat).items()
    scene = trimesh.load_scene(io.BytesIO(data), file_type=name.rsplit(".", 1)[1], split_objects=True)
    assert sorted(scene.geometry) == sorted(["walls", "entrance_door_2", *FLOORS, "floor"])
    assert scene.geometry["entrance_door_2"].volume == pytest.approx(0.09 * 2.1)
    assert scene.geometry["living_room_floor_0"].volume == pytest.approx(flat.rooms[0].area * 0.05, rel=1e-3)
    whole = trimesh.util.concatenate(list(scene.geometry.values()))
    built = plan_bodies(flat)
    walls, slab = shapely.union_all(built.walls), shapely.union_all([built.space, *built.walls])
    assert whole.volume == pytest.approx(2.5 * walls.area + 0.4 * 0.08 + 0.05 * slab.area, rel=1e-5)


@pytest.mark.parametrize("to", ["dxf", "geojson", "graphml", "ifc", "mjcf", "rmf", "sdf", "svg", "usd"])
def test_words_that_no_file_can_hold(tmp_path, to):
    """Control characters and halves of surrogate pairs, as a plan may have them from its source."""
    word = "bell\x07\ufffe\ud800"
    square = np.array([(0, 0), (4, 0), (4, 4), (0, 4)], np.float64)
    sofa = PlanObject(0, word, 0, square / 4 + 1, 1.0)
    room = Room(0, "Unlabelled", square, (), (word,))
    made = FloorPlan(id="p", verts=square, room_num=1, room_category={}, rooms=(room,), objects=(sofa,))
    for file in export(made, to, tmp_path):
        if file.suffix != ".png":
            text = file.read_bytes().decode()
            assert "\x07" not in text or to == "dxf"
        if file.suffix in {".svg", ".graphml", ".xml", ".sdf"}:
            parsed(file.read_bytes())


@pytest.mark.parametrize("write", [irsim, mjcf, sdf, stage, usd])
def test_a_robots_world_shuts_the_opening_over_a_stair(write):
    room = np.array([(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)])
    well = PlanObject(0, "stairs", None, np.array([(0.5, 4.1), (0.5, 8.1), (2.5, 8.1), (2.5, 4.1)]), 0.0)
    source = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
    plan = FloorPlan("0" * 32, room, 1, {}, objects=(well,), frame=source)
    free = READERS[write.__name__](write(plan, frame="source", orientation="plan"))
    assert free.symmetric_difference(plan.free_space).area < 0.1
