"""Bodies are told by place, whatever rounding does to it."""

import numpy as np
import pytest

from pipeline.geometry.meshes import Bodies, Mesh, cells_along, number_places
from tests.builders.meshes import box, joined


def test_rounding_parts_no_cell():
    at_an_edge = np.array([0.5, 0.5 - 1e-9, 0.5 + 1e-9, 0.7, 1.5])
    assert cells_along(at_an_edge, 1.0).tolist() == [0, 0, 0, 1, 2]
    assert cells_along(at_an_edge + 0.1, 1.0).tolist() == [1, 1, 1, 1, 2]


@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-7])
def test_corners_at_one_place_are_one_however_they_are_rounded(noise):
    mesh = joined([box((0.00005, 0.00015, 3.0, 0.2), 0.0, 2.7)])  # corners on the edges of cells
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    corners = corners + np.random.default_rng(1).uniform(-noise, noise, corners.shape)
    assert number_places(corners).max() == 7
    assert len(Bodies.of(Mesh(corners, np.arange(len(corners)).reshape(-1, 3))).low) == 1
