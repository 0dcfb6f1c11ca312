from __future__ import annotations

import numpy as np
import pytest
import shapely

from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import NOTHING, door_ids, fill_cells, free_mask, room_ids


def slow_mask(shape: shapely.Geometry, frame: GridFrame) -> np.ndarray:
    """The obvious twin: ask for every cell's centre."""
    centres = frame.points_from_cells(np.stack(np.indices(frame.shape), axis=-1))
    return shapely.contains_xy(shape, centres[..., 0], centres[..., 1])


def test_a_triangle_cell_by_cell():
    mask, frame = free_mask(shapely.Polygon([(0, 0), (4, 0), (0, 3.9)]), 1, margin_px=0)
    assert frame.shape == (4, 4)
    assert mask.astype(int).tolist() == [[1, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]
    picture, _ = free_mask(shapely.Polygon([(0, 0), (4, 0), (0, 4)]), 1, margin_px=0, y_up=True)
    assert not picture[0, -1]
    assert picture[-1, 0]


def test_a_wall_of_one_cell_stays():
    plan = FloorPlan("u", [(0, 0), (0, 1), (0.4, 1), (0.4, 0.2), (0.5, 0.2), (0.5, 1), (1, 1), (1, 0)], 1, {})
    mask, _ = free_mask(plan, 10, margin_px=0)
    assert mask.sum() == 100 - 8
    assert not mask[2:, 4].any()


def test_agrees_with_the_slow_twin(published_lines):
    for line in published_lines[:40]:
        plan = decode(line)
        mask, frame = free_mask(plan, 8.37)
        assert (mask == slow_mask(plan.free_space, frame)).all(), plan.id


def test_a_ring_that_crosses_itself_is_even_odd():
    plan = FloorPlan("bow", [(0.0, 0.0), (2.1, 1.9), (2.0, 0.0), (0.0, 2.0)], 1, {})
    mask, frame = free_mask(plan, 7.3)
    assert (mask == slow_mask(plan.free_space, frame)).all()


def test_area_survives_the_round_trip(published_lines):
    plans = [decode(line) for line in published_lines]
    errors = [abs(free_mask(plan, 25)[0].sum() / 625 / plan.area - 1) for plan in plans]
    assert np.median(errors) < 0.002
    assert max(errors) < 0.02


def test_a_given_grid_cuts_off_what_lies_outside():
    square = shapely.box(0, 0, 10, 10)
    frame = GridFrame((8.0, -1.0), 2.0, (6, 8))
    mask, same = free_mask(square, frame=frame)
    assert same is frame
    assert (mask == slow_mask(square, frame)).all()
    for origin in ((-20.0, 0.0), (20.0, 0.0), (0.0, -20.0), (0.0, 20.0)):
        assert not free_mask(square, frame=GridFrame(origin, 1.0, (5, 5)))[0].any()


def test_moving_a_plan_keeps_its_raster(two_rooms):
    mask, _ = free_mask(two_rooms, 25)
    moved, frame = free_mask(two_rooms.moved(3.217, -8.113), 25)
    assert (moved == mask).mean() > 0.999
    assert frame.origin_m == pytest.approx((0.1 + 3.217 - 0.04, 0.1 - 8.113 - 0.04))


def test_rooms_and_doors_share_no_cell_and_fill_the_free_space(two_rooms):
    free, frame = free_mask(two_rooms, 21)
    rooms, doors = room_ids(two_rooms, frame), door_ids(two_rooms, frame)
    assert rooms.dtype == doors.dtype == np.int32
    assert set(np.unique(rooms)) == {NOTHING, 0, 1}
    assert (rooms == 0).sum() / 441 == pytest.approx(11.84, rel=0.02)
    inner = doors == 0
    assert not ((rooms != NOTHING) & inner).any()
    assert (((rooms != NOTHING) | inner) == free).all()


def test_neighbours_along_an_oblique_wall_share_no_cell():
    a, b = (0.313, 0.127), (7.771, 5.519)
    one = shapely.Polygon([a, b, (0.313, 5.519)])
    other = shapely.Polygon([b, a, (7.771, 0.127)])
    frame = GridFrame.around((0, 0, 8, 6), 50)
    count = np.zeros(frame.shape, dtype=int)
    for part in (one, other):
        mask = np.zeros(frame.shape, dtype=bool)
        fill_cells(mask, part, frame, True)
        count += mask
    assert (count == slow_mask(shapely.box(*one.union(other).bounds), frame)).all()


def test_an_empty_polygon_is_an_empty_mask():
    mask, _ = free_mask(shapely.Polygon(), 10)
    assert not mask.any()


def test_what_has_no_area_in_a_collection_fills_nothing():
    frame = GridFrame.around((0, 0, 4, 4), 1, margin_px=0)
    square = shapely.box(1, 1, 3, 3)
    loose = shapely.GeometryCollection([square, shapely.Point(0, 0), shapely.LineString([(0, 0), (4, 4)])])
    mask, alone = np.zeros(frame.shape, np.uint8), np.zeros(frame.shape, np.uint8)
    fill_cells(mask, loose, frame, 1)
    fill_cells(alone, square, frame, 1)
    assert (mask == alone).all()
    assert mask.sum() == 4
