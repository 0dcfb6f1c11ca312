"""A garden in its fence is no room of the house that stands in it; a hall lower than the rest of its house is one."""

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

HOUSE: Rectangle = (0.0, 0.0, 6.0, 4.0)
DOOR = (2.5, 3.4)


def rim(plan: Rectangle, low: float, high: float, door: tuple[float, float] | None = None) -> list[trimesh.Trimesh]:
    """Walls of 20 cm around a plan, the lower one with a door from x to x."""
    x1, y1, x2, y2 = plan
    walls = [(x1, y2 - 0.2, x2, y2), (x1, y1 + 0.2, x1 + 0.2, y2 - 0.2), (x2 - 0.2, y1 + 0.2, x2, y2 - 0.2)]
    front: list[Rectangle] = [(x1, y1, x2, y1 + 0.2)]
    if door is not None:
        front = [(x1, y1, door[0], y1 + 0.2), (door[1], y1, x2, y1 + 0.2)]
    lintel = [] if door is None else [box((door[0], y1, door[1], y1 + 0.2), 2.1, high)]
    return [box(wall, low, high) for wall in walls + front] + lintel


def plan_of(parts: Sequence[trimesh.Trimesh], path: Path) -> FloorPlan:
    trimesh.Scene(list(parts)).export(path)
    (level,) = mesh_file.read(next(mesh_file.find(str(path), up="z", units="m")))
    return plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))


def house() -> list[trimesh.Trimesh]:
    return [*rim(HOUSE, 0.0, 2.7, DOOR), box(HOUSE, -0.2, 0.0), box(HOUSE, 2.7, 2.9)]


def test_a_garden_in_its_fence_is_no_room(tmp_path: Path) -> None:
    around = (-6.0, -8.0, 12.0, 12.0)
    ground = box(around, -0.3, -0.2)
    plan = plan_of([*house(), ground, *rim(around, -0.2, 0.9)], tmp_path / "garden.glb")
    assert plan.area == pytest.approx(5.6 * 3.6, abs=0.1)
    assert [door.kind for door in plan.doors] == ["entrance"]


def test_a_hall_lower_than_the_house_is_a_room(tmp_path: Path) -> None:
    hall = (0.0, -8.0, 6.0, 0.0)
    walls = [wall for wall in rim(hall, 0.0, 2.3) if wall.bounds[1][1] <= -0.2 + 1e-9]
    parts = [*house(), *walls, box(hall, -0.2, 0.0), box(hall, 2.3, 2.5)]
    plan = plan_of(parts, tmp_path / "hall.glb")
    assert sorted(round(room.area) for room in plan.rooms) == [20, 44]
    assert [door.kind for door in plan.doors] == ["door"]
