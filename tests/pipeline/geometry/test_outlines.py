import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import outlines
from pipeline.geometry.closing import wall_ends


def tee(middle_y: float) -> shapely.Polygon:
    """A wall that juts up from another, whose end has a point in its middle: of all it lies farthest from the other."""
    stem = [(-0.1, 0), (-0.1, 2), (0, middle_y), (0.1, 2), (0.1, 0)]
    return shapely.Polygon([(-4, 0), *stem, (4, 0), (3, -0.2), (-3, -0.2)])


def test_a_point_in_the_middle_of_an_edge_is_no_corner() -> None:
    wall = tee(2.00001)
    assert len(wall.simplify(0.002).exterior.coords) - 1 == 9  # what simplifying alone leaves
    found = outlines([wall], 0.002).points
    assert len(found) == 8
    assert shapely.Polygon(found).symmetric_difference(wall).area < 1e-5
    assert [np.round(end.out, 6).tolist() for end in wall_ends(wall) if end.out[1] > 0.9] == [[0.0, 1.0]]


def test_details_larger_than_asked_for_stay() -> None:
    found = outlines([tee(2.005)], 0.002).points
    assert len(found) == 9
    nib = shapely.union(shapely.box(0, 0, 2, 0.2), shapely.box(1.0, 0.2, 1.5, 0.21))
    assert len(outlines([nib], 0.002).points) == 8


@pytest.mark.parametrize("size_m", [0.001, 0.003, 1.0])
def test_of_a_rectangle_all_corners_stay(size_m: float) -> None:
    found = outlines([shapely.box(0, 0, size_m, size_m)], 0.002).points
    assert len(found) >= 3


def test_each_corner_knows_its_ring_its_area_and_its_neighbours() -> None:
    yard = shapely.box(0, 0, 9, 9).difference(shapely.box(3, 3, 4, 4))
    found = outlines([shapely.box(20, 0, 21, 1), yard], 0.002)
    assert found.ring.tolist() == [0] * 4 + [1] * 4 + [2] * 4
    assert found.area.tolist() == [0] * 4 + [1] * 8
    assert found.after.tolist() == [1, 2, 3, 0, 5, 6, 7, 4, 9, 10, 11, 8]
    assert found.before.tolist() == [3, 0, 1, 2, 7, 4, 5, 6, 11, 8, 9, 10]
    x, y = found.points.T
    turned = x * y[found.after] - x[found.after] * y
    assert (np.bincount(found.ring, turned) / 2).round(9).tolist() == [1.0, 81.0, -1.0]  # a hole runs clockwise
