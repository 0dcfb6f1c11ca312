"""Sections of meshes: faces in a plane, heights of levels."""

import numpy as np
import pytest
import shapely

from pipeline.geometry.mesh_slicing import (
    MeshSlicer,
    distinct_vertex_heights,
    height_or_middle_of_widest_gap,
    section_heights,
)
from pipeline.geometry.meshes import merge_meshes
from pipeline.values import Mesh
from tests.builders.meshes import box, joined, sheet

CUBE = joined([box((0, 0, 2, 1), 0.0, 1.0)])


def signed_area(ends: np.ndarray) -> float:
    (x1, y1), (x2, y2) = ends[:, 0].T, ends[:, 1].T
    return float((x1 * y2 - x2 * y1).sum() / 2)


def test_the_section_of_a_box_is_its_outline_with_the_inside_on_the_left() -> None:
    cut = MeshSlicer(CUBE).cut(0.5)
    assert shapely.linestrings(cut.ends).ndim == 1
    assert np.hypot(*(cut.ends[:, 1] - cut.ends[:, 0]).T).sum() == pytest.approx(6.0)
    assert signed_area(cut.ends) == pytest.approx(2.0)


def test_a_body_turned_inside_out_runs_the_other_way() -> None:
    inverted = Mesh(CUBE.vertices, CUBE.faces[:, ::-1])
    assert signed_area(MeshSlicer(inverted).cut(0.5).ends) == pytest.approx(-2.0)


def test_faces_that_share_vertices_are_one_body() -> None:
    two = joined([box((0, 0, 1, 1), 0, 1), box((0.5, 0, 2, 1), 0, 1)])
    assert len(np.unique(MeshSlicer(two).cut(0.5).body)) == 2
    soup = Mesh(CUBE.vertices[CUBE.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert len(np.unique(MeshSlicer(soup).cut(0.5).body)) == 8  # of 12 triangles, those of top and bottom are not cut


def test_upright_only_leaves_slopes_out() -> None:
    slope = joined([sheet((0, 0), (4, 0), 0, 2)])
    lying = Mesh(slope.vertices[:, [0, 2, 1]] * [1, 1, 0.2] + [0, 0, 0.0], slope.faces)
    tilted = Mesh(np.column_stack([lying.vertices[:, :2], lying.vertices[:, 1] * 0.3]), lying.faces)
    assert len(MeshSlicer(tilted).cut(0.1).ends)
    assert not len(MeshSlicer(tilted).cut(0.1, upright_only=True).ends)
    assert len(MeshSlicer(slope).cut(0.1, upright_only=True).ends)


@pytest.mark.parametrize("height", [-0.5, 1.5])
def test_a_cut_beside_the_mesh_is_empty(height: float) -> None:
    cut = MeshSlicer(CUBE).cut(height)
    assert cut.ends.shape == (0, 2, 2)
    assert cut.body.shape == (0,)


def test_sections_are_the_same_between_heights_where_nothing_ends_and_all_stands_upright() -> None:
    steps = MeshSlicer(joined([box((0, 0, 2, 1), 0.0, 1.0), box((3, 0, 5, 1), 0.0, 2.5)]))
    assert steps.is_upright_between(0.1, 0.9)
    assert not steps.is_upright_between(0.9, 1.1)
    assert steps.is_upright_between(1.1, 2.4)
    leaning = Mesh(CUBE.vertices + CUBE.vertices[:, 2:] * (0.001, 0, 0), CUBE.faces)
    assert not MeshSlicer(leaning).is_upright_between(0.1, 0.9)


def test_merged_meshes_keep_their_faces() -> None:
    both = merge_meshes([CUBE, None, joined([box((5, 5, 6, 6), 0, 1)])])
    assert (len(both.vertices), len(both.faces)) == (16, 24)
    assert signed_area(MeshSlicer(both).cut(0.5).ends) == pytest.approx(3.0)
    assert merge_meshes([None]).faces.shape == (0, 3)


def test_a_height_that_is_clear_stays() -> None:
    assert height_or_middle_of_widest_gap(0.2, np.array([0.0, 0.1, 2.5])) == 0.2
    assert height_or_middle_of_widest_gap(0.2, np.array([])) == 0.2


@pytest.mark.parametrize("level", [0.2, 0.2 + 1e-4, 0.1985])
def test_a_cut_through_coplanar_faces_moves_into_the_widest_gap_near_it(level: float) -> None:
    z = np.array([0.0, 0.12, level, 2.5])
    height = height_or_middle_of_widest_gap(0.2, z)
    assert np.abs(z - height).min() > 0.02
    assert 0.1 <= height <= 0.3
    # between 0.1 and 0.3 the widest gap is the one above
    assert height == pytest.approx((level + 0.3) / 2, abs=1e-3)


def test_heights_are_distinct_to_the_millimetre() -> None:
    z = np.array([2.1, 2.1 + 1e-5, 2.5, 0.1, 1.8])
    np.testing.assert_allclose(distinct_vertex_heights(z, 1.8, 2.5), [1.8, 2.1, 2.5])


def test_one_cut_between_neighbouring_heights() -> None:
    z = np.array([0.0, 2.0, 2.1, 2.15, 2.5])
    assert section_heights(z, 1.8, 2.5, smallest_gap=0.08, most=12) == pytest.approx([1.9, 2.05, 2.325])
    assert section_heights(z, 2.5, 1.8, smallest_gap=0.08, most=12) == []


def test_a_scan_has_a_vertex_everywhere_and_is_cut_evenly() -> None:
    z = np.linspace(0, 2.5, 5000)
    heights = section_heights(z, 1.8, 2.5, smallest_gap=0.08, most=6)
    assert len(heights) == 6
    assert np.diff(heights) == pytest.approx(0.1, abs=0.005)
