from __future__ import annotations

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame, plan_points_from_source, source_points_from_plan
from houseexpo.plan import Frame


def test_as_published_row_0_lies_at_the_lowest_y():
    frame = GridFrame((1.0, 2.0), 10.0, (30, 20))
    assert frame.cells_from_points((1.0, 2.0)).tolist() == [0, 0]
    assert frame.cells_from_points([(1.55, 2.05), (2.95, 4.95)]).tolist() == [[0, 5], [29, 19]]
    np.testing.assert_allclose(frame.points_from_cells([(0, 0), (29, 19)]), [(1.05, 2.05), (2.95, 4.95)])


def test_as_a_ros_map_row_0_lies_at_the_highest_y_and_the_origin_is_the_lower_left():
    frame = GridFrame((1.0, 2.0), 10.0, (30, 20), y_up=True)
    assert frame.cells_from_points([(1.05, 2.05), (1.05, 4.95)]).tolist() == [[29, 0], [0, 0]]
    np.testing.assert_allclose(frame.points_from_cells((29, 0)), (1.05, 2.05))
    np.testing.assert_allclose(frame.points_from_pixels((0, 30)), (1.0, 2.0))


@pytest.mark.parametrize("y_up", [False, True])
def test_there_and_back(y_up):
    frame = GridFrame((-3.3, 0.7), 23.0, (41, 57), y_up)
    cells = np.stack(np.indices(frame.shape), axis=-1)
    assert (frame.cells_from_points(frame.points_from_cells(cells)) == cells).all()
    points = np.random.default_rng(0).uniform(-5, 5, (50, 2))
    np.testing.assert_allclose(frame.points_from_pixels(frame.pixels_from_points(points)), points)
    for point in points.tolist():
        pixel = frame.pixel_from_point(*point)
        assert pixel == tuple(frame.pixels_from_points(point).tolist())
        assert frame.point_from_pixel(*pixel) == tuple(frame.points_from_pixels(pixel).tolist())
    assert frame.contains(cells).all()
    assert not frame.contains([(-1, 0), (41, 0), (0, 57)]).any()


def test_around_holds_the_bounds_and_the_margin_and_no_more():
    frame = GridFrame.around((0.1, 0.1, 4.1, 3.1), 25, margin_px=2)
    assert frame.shape == (75 + 4, 100 + 4)
    assert frame.origin_m == pytest.approx((0.02, 0.02))
    assert frame.cell_m == 0.04


def test_a_scale_must_be_positive():
    with pytest.raises(ConfigError, match="pixels_per_metre: expected a positive number, found 0"):
        GridFrame((0, 0), 0, (1, 1))
    for scale in (0, float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="pixels_per_metre: expected a positive number"):
            GridFrame.around((0, 0, 4, 3), scale)


def test_plan_to_source_and_back():
    frame = Frame(((0.0, -1.0, 5.0), (1.0, 0.0, -2.0)), "z", 0.0, 0)  # a quarter turn, then a shift
    assert source_points_from_plan(frame, (3.0, 1.0)).tolist() == [4.0, 1.0]
    points = np.random.default_rng(1).uniform(-9, 9, (7, 3, 2))
    np.testing.assert_allclose(plan_points_from_source(frame, source_points_from_plan(frame, points)), points)


def test_a_grid_that_no_memory_holds_is_refused_with_its_size():
    with pytest.raises(ConfigError, match=r"found 125,002 x 125,002; choose fewer pixels per metre"):
        GridFrame.around((0, 0, 5000, 5000), 25)
