import numpy as np
import pytest
import shapely

from pipeline.geometry.cutting import Cutter, merge_meshes
from pipeline.values import Mesh
from tests.builders.meshes import box, joined, sheet

CUBE = joined([box((0, 0, 2, 1), 0.0, 1.0)])


def signed_area(ends: np.ndarray) -> float:
    (x1, y1), (x2, y2) = ends[:, 0].T, ends[:, 1].T
    return float((x1 * y2 - x2 * y1).sum() / 2)


def test_the_section_of_a_box_is_its_outline_with_the_inside_on_the_left() -> None:
    cut = Cutter(CUBE).cut(0.5)
    assert shapely.linestrings(cut.ends).ndim == 1
    assert np.hypot(*(cut.ends[:, 1] - cut.ends[:, 0]).T).sum() == pytest.approx(6.0)
    assert signed_area(cut.ends) == pytest.approx(2.0)


def test_a_body_turned_inside_out_runs_the_other_way() -> None:
    inverted = Mesh(CUBE.vertices, CUBE.faces[:, ::-1])
    assert signed_area(Cutter(inverted).cut(0.5).ends) == pytest.approx(-2.0)


def test_faces_that_share_vertices_are_one_body() -> None:
    two = joined([box((0, 0, 1, 1), 0, 1), box((0.5, 0, 2, 1), 0, 1)])
    assert len(np.unique(Cutter(two).cut(0.5).body)) == 2
    soup = Mesh(CUBE.vertices[CUBE.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert len(np.unique(Cutter(soup).cut(0.5).body)) == 8  # of 12 triangles, those of top and bottom are not cut


def test_upright_only_leaves_slopes_out() -> None:
    slope = joined([sheet((0, 0), (4, 0), 0, 2)])
    lying = Mesh(slope.vertices[:, [0, 2, 1]] * [1, 1, 0.2] + [0, 0, 0.0], slope.faces)
    tilted = Mesh(np.column_stack([lying.vertices[:, :2], lying.vertices[:, 1] * 0.3]), lying.faces)
    assert len(Cutter(tilted).cut(0.1).ends)
    assert not len(Cutter(tilted).cut(0.1, upright_only=True).ends)
    assert len(Cutter(slope).cut(0.1, upright_only=True).ends)


@pytest.mark.parametrize("height", [-0.5, 1.5])
def test_a_cut_beside_the_mesh_is_empty(height: float) -> None:
    cut = Cutter(CUBE).cut(height)
    assert cut.ends.shape == (0, 2, 2)
    assert cut.body.shape == (0,)


def test_merged_meshes_keep_their_faces() -> None:
    both = merge_meshes(CUBE, None, joined([box((5, 5, 6, 6), 0, 1)]))
    assert (len(both.vertices), len(both.faces)) == (16, 24)
    assert signed_area(Cutter(both).cut(0.5).ends) == pytest.approx(3.0)
    assert merge_meshes(None).faces.shape == (0, 3)
