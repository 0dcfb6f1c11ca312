"""A split level: the halves of a house have floors of their own, half a storey apart, none of which covers the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.sources import mesh_file
from pipeline.values import Level
from tests.builders.mesh_files import as_trimesh
from tests.builders.meshes import Rectangle, box, joined

SLAB_M, CLEAR_M, HALF_M = 0.2, 2.7, 1.45
LEFT: Rectangle = (0.0, 0.0, 5.0, 8.0)
RIGHT: Rectangle = (5.0, 0.0, 10.0, 8.0)


def half(plan: Rectangle, low: float, storeys: int) -> list:
    x1, y1, x2, y2 = plan
    rim = ((x1, y1, x2, y1 + 0.2), (x1, y2 - 0.2, x2, y2), (x1, y1, x1 + 0.2, y2), (x2 - 0.2, y1, x2, y2))
    floors = [low + k * (CLEAR_M + SLAB_M) for k in range(storeys)]
    walls = [box(wall, floor, floor + CLEAR_M) for floor in floors for wall in rim]
    return walls + [box(plan, floor - SLAB_M, floor) for floor in [*floors, floors[-1] + CLEAR_M + SLAB_M]]


def levels_of(parts: list, path: Path) -> list[Level]:
    mesh = as_trimesh(joined(parts))
    mesh.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]]))
    mesh.export(path)
    return list(mesh_file.read(next(mesh_file.find(str(path)))))


def test_a_split_level_stands_upright_in_metres(tmp_path: Path) -> None:
    found = levels_of(half(LEFT, 0.0, 2) + half(RIGHT, HALF_M, 2), tmp_path / "split.glb")
    assert {level.provenance["units"] for level in found} == {"m"}
    assert [level.frame.floor for level in found] == pytest.approx([0.0, 1.45, 2.9, 4.35], abs=1e-3)
    assert not any(level.guesses for level in found)


def test_a_low_wing_leaves_the_storeys_of_the_house_alone(tmp_path: Path) -> None:
    found = levels_of(half(LEFT, 0.0, 2) + half(RIGHT, 0.0, 1), tmp_path / "wing.glb")
    assert {level.provenance["units"] for level in found} == {"m"}
    assert [level.frame.floor for level in found] == pytest.approx([0.0, 2.9], abs=1e-3)
