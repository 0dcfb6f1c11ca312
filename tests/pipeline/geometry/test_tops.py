"""What ends at a sloped roof: a gable over the x axis, 0.3 m thick, from eaves at 1.2 m up to a ridge at 4.4 m."""

import numpy as np
import pytest
import trimesh
from shapely import box as area

from pipeline.geometry.cutting import Cutter
from pipeline.geometry.walls import ending_below, meets_slope
from pipeline.values import Mesh
from tests.builders.meshes import box, joined

PIECE = area(4.5, 0.0, 5.5, 0.3)


def gable() -> trimesh.Trimesh:
    ring = [(0.0, 0.0), (8.0, 0.0), (8.0, 1.2), (4.0, 4.4), (0.0, 1.2)]
    points = [(x, y, z) for y in (0.0, 0.3) for x, z in ring]
    sides = [face for k in range(5) for face in ((k, (k + 1) % 5, k + 5), ((k + 1) % 5, (k + 1) % 5 + 5, k + 5))]
    caps = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (5, 6, 7), (5, 7, 8), (5, 8, 9)]
    made = trimesh.Trimesh(np.array(points), np.array([*sides, *caps]), process=False)
    if made.volume < 0:
        made.invert()
    return made


def cutter(*parts: trimesh.Trimesh) -> Cutter:
    mesh = joined(list(parts))
    return Cutter(Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))


def test_a_wall_that_ends_at_a_slope_meets_it() -> None:
    assert meets_slope(PIECE, cutter(gable()))


def test_a_window_in_a_gable_does_not_hide_that_the_wall_over_it_meets_the_slope() -> None:
    house = cutter(gable(), box((4.4, 0.1, 5.6, 0.2), 0.9, 2.3))
    assert not meets_slope(PIECE, house)
    assert meets_slope(PIECE, house, stood_m=3.1)


def test_a_cupboard_under_a_slope_does_not_meet_it() -> None:
    roof = gable()
    roof.apply_scale((1.0, 10.0, 1.0))
    roof.apply_translation((0.0, 0.0, 1.0))
    assert not meets_slope(area(4.5, 1.0, 5.5, 2.0), cutter(roof, box((4.5, 1.0, 5.5, 2.0), 0.0, 0.9)))


@pytest.mark.parametrize(("size", "low", "meets"), [(0.6, 0.7, False), (2.0, 0.7, True), (0.6, 2.0, True)])
def test_the_top_of_a_cushion_is_no_roof(size: float, low: float, meets: bool) -> None:
    """A wedge that rises by half its depth; as large as a roof it is one, and over head height a small piece is."""
    wedge = box((0.0, 0.0, size, size), 0.0, low)
    points = np.array(wedge.vertices)
    points[(points[:, 2] == low) & (points[:, 1] > 0), 2] += size / 2
    made = trimesh.Trimesh(points, wedge.faces, process=False)
    assert meets_slope(area(0.1, 0.1, size - 0.1, size - 0.1), cutter(made)) == meets


def test_what_ends_knows_the_last_height_at_which_it_stands() -> None:
    wall, cupboard = area(0, 0, 5, 0.3), area(5, 0, 6, 0.3)
    both = wall.union(cupboard)
    (found,) = ending_below(both, [both, wall], [1.7, 1.9, 2.4])
    assert found.part.symmetric_difference(cupboard).area < 1e-6
    assert found.stood_m == 1.9
