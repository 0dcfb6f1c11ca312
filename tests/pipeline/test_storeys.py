"""Write the storeys of one house as one file, and read them back as several plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo import save_plan
from houseexpo.errors import ConfigError
from houseexpo.exports import export
from houseexpo.plan import Frame, PlanObject
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from tests.builders.batch import labels, likeness
from tests.builders.commands import call
from tests.builders.houses import Hole, plan_of, two_rooms

NEEDS = {
    "glb": "trimesh",
    "ifc": "ifcopenshell",
    "mjcf": "shapely",
    "obj": "trimesh",
    "rmf": "yaml",
    "sdf": "shapely",
    "usd": "pxr",
}
SUFFIX = {**{form: f".{form}" for form in NEEDS}, "rmf": ".building.yaml", "usd": ".usda", "mjcf": ".xml"}


def storeys():
    """A ground floor of two rooms, and above it the same, 1 m to the right and 2 m farther."""
    low = replace(plan_of(two_rooms(Hole(1.0, 1.9))), id="low")
    frames = [Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", floor, level) for level, (x, y, floor) in enumerate(PLACES)]
    return [replace(low, id=name, frame=frame) for name, frame in zip(("low", "high"), frames, strict=True)]


PLACES = ((5.0, 7.0, 0.0), (6.0, 9.0, 2.8))


def levels_of(path):
    (item,) = find(str(path))
    return list(reader(item.reader).read(item))


@pytest.mark.parametrize("form", sorted(NEEDS))
def test_two_storeys_come_back_from_one_file_as_two_plans(tmp_path, form):
    pytest.importorskip(NEEDS[form])
    low, high = storeys()
    written = export([high, low], form, tmp_path, building="home")
    path = tmp_path / f"home{SUFFIX[form]}"
    assert path in written
    levels = levels_of(path)
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8], abs=0.01)
    for level, plan in zip(levels, (low, high), strict=True):
        (found,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        assert likeness(plan, found) > 0.99
        assert len(found.doors) == len(plan.doors)
        assert labels(found) == labels(plan)


def test_storeys_of_ifc_lie_over_each_other_as_in_their_source(tmp_path):
    pytest.importorskip("ifcopenshell")
    export(storeys(), "ifc", tmp_path, building="home")
    low, high = (level.walls.vertices.min(axis=0)[:2] + _shift(level) for level in levels_of(tmp_path / "home.ifc"))
    assert (high - low).tolist() == pytest.approx([1.0, 2.0], abs=0.01)


def _shift(level):
    return np.array(level.frame.matrix)[:, 2]


@pytest.mark.parametrize("form", ["glb", "mjcf", "obj", "sdf", "usd"])
def test_storeys_of_scenes_lie_over_each_other_as_in_their_source(tmp_path, form):
    pytest.importorskip(NEEDS[form])
    export(storeys(), form, tmp_path, building="home")
    rooms = []
    for level in levels_of(tmp_path / f"home{SUFFIX[form]}"):
        (found,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        turn = np.array(found.frame.matrix) if found.frame.up == "z" else np.diag([1, -1]) @ found.frame.matrix
        rooms.append(turn @ [*found.bbox[:2], 1.0])
    assert (rooms[1] - rooms[0]).tolist() == pytest.approx([1.0, 2.0], abs=0.01)


@pytest.mark.parametrize("form", ["glb", "mjcf", "obj", "sdf", "usd"])
def test_furniture_and_storeys_called_floor_come_back(tmp_path, form):
    pytest.importorskip(NEEDS[form])
    names = ("ground floor", "1st_floor")
    table = PlanObject(0, "table", 0, [(1, 1), (2, 1), (2, 2), (1, 2)], 0.8)
    plans = [replace(plan, id=name, objects=(table,)) for name, plan in zip(names, storeys(), strict=True)]
    export(plans, form, tmp_path, building="home")
    levels = levels_of(tmp_path / f"home{SUFFIX[form]}")
    assert [level.frame.floor for level in levels] == pytest.approx([0.0, 2.8], abs=0.01)
    for level, plan in zip(levels, plans, strict=True):
        assert [len(each.mesh.faces) for each in level.furniture] == [12]
        (found,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        assert likeness(replace(plan, objects=()), replace(found, objects=())) > 0.99
        assert labels(found) == labels(plan)


def test_usd_core_finds_each_storey_as_a_prim_at_its_place(tmp_path):
    usd = pytest.importorskip("pxr.Usd")
    geometry = pytest.importorskip("pxr.UsdGeom")
    low, high = storeys()
    export([low, replace(high, id="2 high")], "usd", tmp_path, building="home")
    stage = usd.Stage.Open(str(tmp_path / "home.usda"))
    root = stage.GetDefaultPrim()
    assert root.GetAttribute("houseexpo:id").Get() == "home"
    assert [each.GetName() for each in root.GetChildren()] == ["low", "_2_high"]
    assert [each.GetAttribute("houseexpo:id").Get() for each in root.GetChildren()] == ["low", "2 high"]
    upper = root.GetChild("_2_high")
    assert upper.GetDisplayName() == "2 high"
    place = geometry.XformCache().GetLocalToWorldTransform(upper).ExtractTranslation()
    assert tuple(place) == pytest.approx((1.0, 2.0, 2.8))
    assert {each.GetName() for each in upper.GetChildren()} == {"Walls", "Floors", "Doors"}
    box = geometry.BBoxCache(usd.TimeCode.Default(), ["default"]).ComputeWorldBound(upper.GetChild("Walls"))
    assert box.ComputeAlignedRange().GetMin()[2] == pytest.approx(2.8)


def test_mujoco_takes_a_body_for_each_storey_and_things_rest_on_the_upper_floor(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    low, high = storeys()
    export([low, high], "mjcf", tmp_path, building="home")
    spec = mujoco.MjSpec.from_file(str(tmp_path / "home.xml"))
    x, y = np.array(high.rooms[0].polygon.representative_point().coords[0])
    ball = spec.worldbody.add_body(name="ball", pos=[x + 1.0, y + 2.0, 3.2])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    assert model.body("low").pos.tolist() == [0.0, 0.0, 0.0]
    assert model.body("high").pos.tolist() == pytest.approx([1.0, 2.0, 2.8])
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.body("ball").xpos[2] == pytest.approx(2.9, abs=0.02)


@pytest.mark.parametrize("form", ["glb", "mjcf", "sdf", "usd"])
def test_storeys_too_near_for_a_door_are_refused(tmp_path, form):
    pytest.importorskip("trimesh")
    low, high = storeys()
    near = replace(high, frame=replace(high.frame, floor=1.5))
    with pytest.raises(ConfigError, match=r"storeys low and high are 1\.5 m apart, expected 2\.15 m or more"):
        export([low, near], form, tmp_path, building="home")


def test_fiducials_of_rmf_say_how_the_levels_lie(tmp_path):
    import yaml

    export(storeys(), "rmf", tmp_path, building="home")
    levels = yaml.safe_load((tmp_path / "home.building.yaml").read_text())["levels"]
    assert list(levels) == ["L1", "L2"]
    (low, *_), (high, *_) = (level["fiducials"] for level in levels.values())
    assert low[2] == high[2]
    a, b, about = levels["L1"]["measurements"][0]
    corners = levels["L1"]["vertices"]
    scale = about["distance"][1] / np.hypot(corners[a][0] - corners[b][0], corners[a][1] - corners[b][1])
    assert ((low[0] - high[0]) * scale, (high[1] - low[1]) * scale) == pytest.approx((1.0, 2.0), abs=0.01)


def test_plans_without_heights_are_stacked_in_their_order(tmp_path):
    pytest.importorskip("ifcopenshell")
    plans = [replace(plan, frame=None) for plan in storeys()]
    export(plans, "ifc", tmp_path, building="home")
    assert [level.frame.floor for level in levels_of(tmp_path / "home.ifc")] == pytest.approx([0.0, 3.0], abs=0.01)


@pytest.mark.parametrize(
    ("form", "name", "said"),
    [("svg", "home", "glb, ifc, mjcf, obj, rmf, sdf, usd"), ("rmf", "a/b", "name that a file")],
)
def test_what_cannot_be_one_building_is_refused(tmp_path, form, name, said):
    with pytest.raises(ConfigError, match=said):
        export(storeys(), form, tmp_path, building=name)


def test_the_command_writes_one_building(tmp_path):
    (tmp_path / "plans").mkdir()
    for plan in storeys():
        save_plan(plan, tmp_path / "plans" / f"{plan.id}.json")
    asked = [
        "export",
        str(tmp_path / "plans"),
        "--to",
        "rmf",
        "--building",
        "home",
        "--out",
        str(tmp_path / "out"),
    ]
    call(*asked)
    assert (tmp_path / "out" / "home.building.yaml").exists()
