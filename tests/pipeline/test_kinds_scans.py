"""Scans: dense meshes whose every vertex is a little off."""

from __future__ import annotations

import numpy as np
import pytest

from tests.builders.houses import kinds, level, plan_of
from tests.builders.meshes import joined
from tests.pipeline.test_kinds_solids import flat, in_courses


@pytest.mark.parametrize("noise_m", [0.0, 0.002, 0.004])
def test_a_noisy_dense_mesh_has_the_rooms_and_doors_of_a_clean_one(noise_m: float) -> None:
    walls, doorway = flat()
    parts = [body.subdivide_to_size(0.12) for body in in_courses(walls, doorway)]
    mesh = joined(parts)
    noise = np.random.default_rng(0).normal(0.0, noise_m, mesh.vertices.shape)
    plan = plan_of(level(type(mesh)(mesh.vertices + noise, mesh.faces)))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.02)
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.9, abs=0.06)
