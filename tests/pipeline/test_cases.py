"""Real houses with known truth, from the mesh alone: the table of what must hold."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from PIL import Image

from tests.builders.shared import CASES, DATA, as_json, case, levels, needs_shared, plan_nearest, planned, scorer

pytestmark = needs_shared
SHEETS = {"procthor_0", "procthor_1"}
BUILDINGS = [name for name in CASES if "ifc" in case(name)]


@pytest.mark.parametrize("name", CASES)
def test_a_mesh_gives_the_plan_that_is_known(name):
    truth = case(name)
    score = scorer()(as_json(plan_nearest(DATA / truth["mesh"], truth["floor_z"])), truth)
    sheets = name in SHEETS
    assert score["free_iou"] >= (0.95 if sheets else 0.97)
    assert score["room_recall"] >= (1.0 if sheets else 0.9)
    assert score["room_precision"] >= (1.0 if sheets else 0.75)
    assert score["door_recall"] >= (1.0 if sheets else 0.9)
    assert score["door_precision"] >= (1.0 if sheets else 0.75)
    assert score["width_error_m"] <= 0.06
    assert score["cuts"] <= score["cuts_needed"] + (0 if sheets else 1)
    assert score["components"] == 1
    assert score["valid"]


@pytest.mark.parametrize("name", BUILDINGS)
def test_an_ifc_building_gives_the_same_plan_divided_and_named_as_its_spaces(name):
    truth = case(name)
    plan = plan_nearest(DATA / truth["ifc"], truth["floor_z"])
    mesh = scorer()(as_json(plan_nearest(DATA / truth["mesh"], truth["floor_z"])), truth)
    score = scorer()(as_json(plan), {**truth, "zones": None})
    assert score["free_iou"] >= mesh["free_iou"] - 0.005
    assert score["room_recall"] == 1.0
    assert score["room_precision"] == 1.0
    assert score["label_accuracy"] >= 0.95
    assert score["door_recall"] == 1.0
    assert score["door_precision"] >= 0.75
    assert score["components"] == 1
    assert score["valid"]


def test_a_furnished_house_agrees_with_a_map_that_slam_made_of_it():
    folder = DATA / "gazebo" / "aws_small_house"
    (level,) = levels(folder / "furnished_collision.ply")
    plan = planned(level)
    seen = np.asarray(Image.open(folder / "map.pgm")) >= 250
    rows, columns = seen.shape
    x = -12.5 + 0.05 * (np.arange(columns) + 0.5)
    y = -12.5 + 0.05 * (rows - np.arange(rows) - 0.5)
    (a, b, tx), (c, d, ty) = plan.frame.matrix
    free = shapely.affinity.affine_transform(plan.free_space, [a, b, c, d, tx, ty])
    ours = shapely.contains_xy(free, *np.meshgrid(x, y))
    assert (ours & seen).sum() / (ours | seen).sum() >= 0.95
    assert plan.navigability["0.20"].components == 1


def test_a_house_without_its_front_door_is_closed_all_the_same():
    (level,) = levels(DATA / "gazebo" / "aws_small_house" / "structure_nodoors_visual.ply")
    plan = planned(level)
    assert plan.area == pytest.approx(175, abs=4)
    assert [door.kind for door in plan.doors if door.rooms[1] is None] == ["entrance"]


@pytest.mark.parametrize(
    "name", ["ahg_apartment/all_collision", "pal_home/all_collision", "pal_home/structure_collision"]
)
def test_houses_without_lintels_end_as_connected_plans(name):
    (level,) = levels(DATA / "gazebo" / f"{name}.ply")
    plan = planned(level)
    assert plan.free_space.is_valid
    assert plan.area > 100
    assert plan.navigability["0.20"].components == 1
