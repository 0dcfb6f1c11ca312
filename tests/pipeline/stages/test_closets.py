"""Closets as deep as a thick wall, and doors in walls thicker than usual, in houses that are one body throughout."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_largest_building
from pipeline.config import PipelineConfig
from pipeline.sources import mesh_file
from tests.builders.meshes import Rectangle, box

CEILING_M, HEAD_M = 2.6, 2.05


def plan_of(
    path: Path,
    block: Rectangle,
    rooms: Sequence[Rectangle],
    doors: Sequence[Rectangle],
    leaves: Sequence[Rectangle] = (),
) -> FloorPlan:
    """The plan of a block from which rooms and doors are taken, with leaves put in."""
    holes = [box(room, 0.0, CEILING_M + 1.0) for room in rooms] + [box(door, -0.001, HEAD_M) for door in doors]
    walls = trimesh.boolean.difference([box(block, 0.0, CEILING_M), *holes], engine="manifold")
    scene = trimesh.Scene([walls, box(block, -0.2, 0.0), box(block, CEILING_M, CEILING_M + 0.2)])
    for leaf in leaves:
        scene.add_geometry(box(leaf, 0.01, HEAD_M - 0.01))
    scene.export(path)
    (level,) = mesh_file.read(next(mesh_file.find(str(path), up="z", units="m")))
    return plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))


@pytest.mark.parametrize("deep_m", [0.5, 0.65])
def test_a_closet_is_a_room_with_a_door(tmp_path: Path, deep_m: float) -> None:
    closet = (0.2, 4.3, 2.0, 4.3 + deep_m)
    plan = plan_of(tmp_path / "a.glb", (0, 0, 5, 5.2), [(0.2, 0.2, 4.8, 4.2), closet], [(0.5, 4.1, 1.7, 4.4)])
    assert sorted(round(room.area, 1) for room in plan.rooms) == [round(1.8 * deep_m, 1), pytest.approx(18.4)]
    assert [(door.kind, round(door.width, 2)) for door in plan.doors] == [("door", 1.2)]


def test_a_shaft_that_nobody_enters_stays_wall(tmp_path: Path) -> None:
    rooms = [(0.2, 0.2, 4.8, 4.2), (4.9, 0.2, 8.0, 4.2)]
    shaft = (0.3, 4.3, 1.9, 4.9)
    plan = plan_of(tmp_path / "a.glb", (0, 0, 8.2, 5.2), [*rooms, shaft], [(4.7, 1.0, 5.0, 1.9)])
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["door"]


@pytest.mark.parametrize("thick_m", [0.2, 0.8, 1.0])
def test_a_leaf_at_the_face_of_a_thick_wall_is_a_door(tmp_path: Path, thick_m: float) -> None:
    x = 4.0 + thick_m
    rooms = [(0.2, 0.2, 4.0, 4.0), (x, 0.2, x + 4.0, 4.0)]
    leaf = (x - 0.06, 1.505, x - 0.02, 2.395)
    plan = plan_of(tmp_path / "a.glb", (0, 0, x + 4.2, 4.2), rooms, [(3.9, 1.5, x + 0.1, 2.4)], [leaf])
    (door,) = plan.doors
    assert (door.kind, round(door.width, 2)) == ("door", 0.9)
