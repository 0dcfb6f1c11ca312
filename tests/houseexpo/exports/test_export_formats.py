"""Every format is read back by a library that is not ours, and the free area is the plan's."""

from __future__ import annotations

import io

import numpy as np
import pytest
import shapely
import trimesh
import yaml
from PIL import Image

from houseexpo import FloorPlan
from houseexpo.exports import (
    export,
    glb,
    obj,
    orient_plan,
    ros_map,
    sdf,
    stage,
)
from houseexpo.exports.plan_bodies import plan_bodies
from houseexpo.plan import PlanObject, Room
from tests.houseexpo.exports.readers import box_of, enclosed, near, parsed, polyline_of, solid_at, stage_blocks

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
