"""Real houses in the files that people have today: exact plans, and the same plan as from a mesh of the house."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from msgspec import json

from houseexpo.floorplan import FloorPlan
from pipeline.sources import find, reader
from tests.builders.shared import DATA, as_json, case, needs_shared, plan_nearest, planned, scorer

pytestmark = needs_shared
RAW = sorted(path.stem for path in (DATA / "cases_raw").glob("*.json"))
LEAST_IOU = {"furnished": 0.95}
"""By the kind of a case; 0.98 for all others."""


def truth_of(name):
    return json.decode((DATA / "cases_raw" / f"{name}.json").read_bytes())


def raw_plan(truth):
    path = DATA / truth["mesh"]
    (level,) = (level for item in find(str(path)) for level in reader(item.reader).read(item))
    return planned(level)


def placed(plan: FloorPlan) -> shapely.Geometry:
    """The free space of a plan in the source's plan axes."""
    (a, b, tx), (c, d, ty) = plan.frame.matrix
    return shapely.affinity.affine_transform(plan.free_space, [a, b, c, d, tx, ty])


@pytest.mark.parametrize("name", RAW)
def test_a_source_gives_the_exact_plan(name):
    truth = truth_of(name)
    score = scorer()(as_json(raw_plan(truth)), truth)
    assert score["free_iou"] >= LEAST_IOU.get(truth["kind"], 0.98)
    assert (score["room_recall"], score["room_precision"]) == (1.0, 1.0)
    assert (score["door_recall"], score["door_precision"]) == (1.0, 1.0)
    assert score["width_error_m"] <= 0.05
    assert score["cuts"] <= score["cuts_needed"]
    assert truth["kind"] == "furnished" or score["label_accuracy"] >= 0.95  # a Gazebo world names no room
    assert score["valid"]


@pytest.mark.parametrize("name", RAW)
def test_the_same_house_as_a_mesh_gives_the_same_plan(name):
    """The mesh may lie with its axes in another order, and mirrored: of the eight ways the best is taken."""
    truth, mesh = truth_of(name), case(name.rpartition("_")[0])
    ours = placed(raw_plan(truth))
    theirs = placed(plan_nearest(DATA / mesh["mesh"], mesh["floor_z"]))
    assert max(overlap(ours, way) for way in eight_ways(theirs)) >= 0.97


def eight_ways(shape):
    """A shape turned by quarters and mirrored, moved to where its middle is 0."""
    for mirror in (1.0, -1.0):
        for quarter in range(4):
            yield shapely.affinity.rotate(shapely.affinity.scale(shape, mirror, 1.0), 90 * quarter)


def overlap(ours, theirs):
    """Intersection over union, the middles of the boxes put upon each other."""
    middles = [np.reshape(shape.bounds, (2, 2)).mean(axis=0) for shape in (ours, theirs)]
    moved = shapely.affinity.translate(theirs, *(middles[0] - middles[1]))
    return ours.intersection(moved).area / ours.union(moved).area
