"""A leaf that stands ajar closes nothing, though its free end comes near to a wall that crosses."""

import numpy as np
import pytest
import shapely
import trimesh

from pipeline.geometry.known_doors import find_leaves
from pipeline.geometry.meshes import Bodies
from pipeline.values import SourceObject
from tests.builders.houses import Hole, Parts, kinds, level, plan_of, two_rooms, wall
from tests.builders.meshes import box, joined

HINGE = np.array([4.0, 1.05])
WIDTH, THICK = 0.88, 0.04


def leaf(degrees: float) -> trimesh.Trimesh:
    """A leaf that hangs at the left face of the wall between the rooms, in its hole from y = 1 to 1.9."""
    body = trimesh.creation.box(bounds=[[0.0, 0.0, 0.005], [THICK, WIDTH, 2.09]])
    body.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), (0, 0, 1)))
    body.apply_translation((*HINGE, 0.0))
    return body


def house() -> Parts:
    """Two rooms, the left one parted by a wall that meets the inner wall beside its door; it has one of its own."""
    return [*two_rooms(Hole(1.0, 1.9)), *wall((0.0, 2.0, 4.0, 2.1), Hole(1.0, 1.9))]


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 9.0, 15.0, 40.0])
def test_the_door_is_where_its_lintel_is(degrees: float, named: bool) -> None:
    leaves = (SourceObject(("door",), joined([leaf(degrees)])),) if named else ()
    made = house() if named else [*house(), leaf(degrees)]
    plan = plan_of(level(joined(made), leaves=leaves))
    assert kinds(plan) == ["door", "door"]
    assert len(plan.rooms) == 3
    matrix = np.asarray(plan.frame.matrix)
    middles = [np.mean(door.segment, axis=0) @ matrix[:, :2].T + matrix[:, 2] for door in plan.doors]
    assert min(np.hypot(*(middle - (4.1, 1.45))) for middle in middles) < 0.05
    rooms = shapely.union_all([shapely.Polygon(room.polygon) for room in plan.rooms])
    assert rooms.area == pytest.approx(20.6, abs=0.1)


def test_leaves_of_two_doors_that_meet_open_are_leaves_of_their_own() -> None:
    """One stands at right angles to its wall, one ajar in a frame parallel to that leaf, and they touch."""
    frame = [box((1.0, 1.99, 1.03, 2.11), 0.0, 2.1), box((1.87, 1.99, 1.9, 2.11), 0.0, 2.1)]
    frame.append(box((1.0, 1.99, 1.9, 2.11), 2.06, 2.1))
    framed = trimesh.boolean.union(frame, engine="manifold")
    ajar = trimesh.creation.box(bounds=[[-0.8, 0.0, 0.005], [0.0, THICK, 2.05]])
    ajar.apply_transform(trimesh.transformations.rotation_matrix(np.radians(35), (0, 0, 1)))
    ajar.apply_translation((1.86, 1.94, 0.0))
    tip = ajar.vertices[:, :2].min(axis=0)
    other = box((tip[0] - 0.02, tip[1] - 0.06, tip[0] + 0.86, tip[1] - 0.02), 0.005, 2.05)
    bodies = Bodies.of(joined([framed, ajar, other]))
    assert sorted(len(leaf.bodies) for leaf in find_leaves(bodies, 2.5)) == [1, 1, 1]
