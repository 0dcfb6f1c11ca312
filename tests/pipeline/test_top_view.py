from __future__ import annotations

import io

import numpy as np
import numpy.typing as npt
import trimesh
from PIL import Image

from pipeline.png import PNG_SIDE_PX, draw_top_view
from pipeline.values import Mesh


def seen(mesh: Mesh, up: int = 2) -> npt.NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(draw_top_view(mesh, up))))


def block(*bounds: list[list[float]]) -> Mesh:
    found = trimesh.util.concatenate([trimesh.creation.box(bounds=b) for b in bounds])
    return Mesh(np.array(found.vertices), np.array(found.faces, np.int64))


STEPS = block([[0, 0, 0], [4, 4, 0.1]], [[4, 0, 0], [8, 4, 3]])  # low on the left, high on the right


def test_what_is_higher_is_darker_and_nothing_is_white() -> None:
    view = seen(STEPS)
    assert view.shape == (PNG_SIDE_PX // 2, PNG_SIDE_PX)
    assert view[50, 150] < view[50, 50] < 255
    apart = seen(block([[0, 0, 0], [1, 1, 1]], [[9, 9, 0], [10, 10, 1]]))
    assert apart[10, 10] == apart[190, 190] == 255
    assert apart[10, 190] < 255
    assert apart[190, 10] < 255


def test_y_points_up_and_a_y_up_mesh_is_seen_from_above_too() -> None:
    x, y, z = STEPS.vertices.T
    assert (seen(Mesh(np.column_stack([x, z, -y]), STEPS.faces), up=1) == seen(STEPS)).mean() > 0.97


def test_the_same_mesh_gives_the_same_bytes_and_one_without_area_none() -> None:
    assert draw_top_view(STEPS) == draw_top_view(STEPS)
    assert draw_top_view(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))) == b""
    assert draw_top_view(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))) == b""
