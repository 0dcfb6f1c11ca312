"""Columns of points: two rooms of 3 x 3 m, a wall of 0.2 m between them, no noise but where it is asked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import box

from pipeline.geometry.scan_columns import columns_of_points, denoise_points
from pipeline.geometry.scan_walls import find_wall_masks, mask_to_area

HEIGHT_M = 2.5


def sheet(a, b, low, high, density=1500.0, seed=0):
    """Points on an upright rectangle over the line from a to b."""
    rng = np.random.default_rng(seed)
    count = int(density * np.hypot(*np.subtract(b, a)) * (high - low))
    u, v = rng.random((2, count))
    return np.column_stack([np.array(a) + u[:, None] * np.subtract(b, a), low + v * (high - low)])


def floor(x1, y1, x2, y2, density=1500.0):
    xy = np.random.default_rng(1).random((int(density * (x2 - x1) * (y2 - y1)), 2)) * (x2 - x1, y2 - y1) + (x1, y1)
    return np.column_stack([xy, np.zeros(len(xy))])


def room(x1, y1, x2, y2, **options):
    corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1)]
    sides = [sheet(a, b, 0.0, HEIGHT_M, seed=k, **options) for k, (a, b) in enumerate(pairwise(corners))]
    return np.concatenate([*sides, floor(x1, y1, x2, y2, **options)])


def walls_of(points):
    masks = find_wall_masks(columns_of_points(points, 0.15, HEIGHT_M, 0.025))
    return mask_to_area(masks.walls, masks.raster), masks


def rooms_of(walls):
    return sorted((shapely.Polygon(ring) for part in shapely.get_parts(walls) for ring in part.interiors), key=str)


TWO = [(0.0, 0.0, 3.0, 3.0), (3.2, 0.0, 6.2, 3.0)]


@pytest.mark.parametrize("density", [1500.0, 500.0])
def test_two_rooms_of_points_are_two_rooms(density):  # R1, R2
    walls, _ = walls_of(np.concatenate([room(*each, density=density) for each in TWO]))
    found = rooms_of(walls)
    assert len(found) == 2
    assert all(min(one.symmetric_difference(box(*each)).area for each in TWO) < 0.5 for one in found)


def three_walls(density=1500.0, gap=(0.0, 3.0)):
    """A room of 3 x 3 m whose south wall was not seen between two places."""
    corners = [(3.0, 0.0), (3.0, 3.0), (0.0, 3.0), (0.0, 0.0)]
    sides = [sheet(a, b, 0.0, HEIGHT_M, density, seed=k) for k, (a, b) in enumerate(pairwise(corners))]
    south = [sheet((a, 0.0), (b, 0.0), 0.0, HEIGHT_M, density) for a, b in ((0.0, gap[0]), (gap[1], 3.0)) if b > a]
    return np.concatenate([*sides, *south, floor(0.0, 0.0, 3.0, 3.0, density=density)])


def open_edge_of(points):
    _, masks = walls_of(points)
    return mask_to_area(masks.open_edge, masks.raster)


def test_the_side_that_was_not_seen_is_an_open_edge():  # walls R4
    edge = open_edge_of(three_walls())
    x1, y1, x2, y2 = edge.bounds
    assert y2 < 0.1
    assert y1 > -0.4
    assert x2 - x1 > 2.0
    assert open_edge_of(three_walls(gap=(0.6, 2.8))).area > 0.2


@pytest.mark.parametrize("points", [room(*TWO[0]), room(*TWO[0], density=100.0), three_walls(gap=(1.0, 2.3))])
def test_a_whole_room_a_sparse_one_and_one_with_a_hole_have_no_open_edge(points):  # walls R4 must leave alone
    assert open_edge_of(points).is_empty


def test_floor_and_low_things_beside_the_house_are_no_room():  # walls R5
    beyond = [floor(4.0, 0.5, 6.0, 2.5), sheet((6.0, 0.5), (6.0, 2.5), 0.0, 1.2)]
    walls, masks = walls_of(np.concatenate([room(*TWO[0]), *beyond]))
    (found,) = rooms_of(walls)
    assert found.symmetric_difference(box(*TWO[0])).area < 0.5
    assert not masks.open_edge.any()


def test_a_thin_cloud_has_thick_layers():  # R2
    dense, thin = (columns_of_points(room(*TWO[0], density=d), 0.15, HEIGHT_M, 0.025) for d in (3000.0, 200.0))
    assert len(dense.heights) > 70
    assert len(thin.heights) < 30


def test_the_raster_lies_along_turned_walls():  # R1
    turn = np.deg2rad(27.0)
    matrix = np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    along = columns_of_points(room(*TWO[0]) @ matrix, 0.15, HEIGHT_M, 0.025).raster.along
    assert np.rad2deg(np.arctan2(along[1], along[0])) % 90 == pytest.approx(27.0, abs=0.6)


def test_outliers_are_no_ground():  # R3
    rng = np.random.default_rng(2)
    wild = rng.random((2000, 3)) * (9.0, 9.0, HEIGHT_M) + (3.1, -3.0, -0.1)
    columns = columns_of_points(np.concatenate([room(*TWO[0]), wild]), 0.15, HEIGHT_M, 0.025)
    inside = columns.raster.cells(np.array([[1.5, 1.5]]))
    outside = columns.raster.cells(rng.random((200, 2)) * (0.7, 2.8) + (3.1, 0.1))
    assert columns.ground.reshape(-1)[inside].all()
    assert columns.ground.reshape(-1)[outside].mean() < 0.02


def test_a_low_lintel_under_the_ceiling_parts_two_rooms():
    lintels = [sheet((x, 1.0), (x, 1.9), 2.35, HEIGHT_M) for x in (3.0, 3.2)]
    jambs = [sheet((3.0, y), (3.2, y), 0.0, 2.35) for y in (1.0, 1.9)]
    points = np.concatenate([room(*each) for each in TWO])
    opened = points[(np.abs(points[:, 0] - 3.1) > 0.11) | (np.abs(points[:, 1] - 1.45) > 0.45)]
    walls, masks = walls_of(np.concatenate([opened, *lintels, *jambs]))
    assert len(rooms_of(walls)) == 2
    assert len(masks.doorways) == 1


def test_a_corridor_is_not_closed_where_a_wall_ends_before_another():
    """A wall ends 1 m before another; nothing hangs or stands between them."""
    stub = [sheet((1.5, 0.0), (1.5, 2.0), 0.0, HEIGHT_M), sheet((1.6, 0.0), (1.6, 2.0), 0.0, HEIGHT_M)]
    walls, masks = walls_of(np.concatenate([room(*TWO[0]), *stub, sheet((1.5, 2.0), (1.6, 2.0), 0.0, HEIGHT_M)]))
    assert len(rooms_of(walls)) == 1
    assert masks.doorways == ()


def test_noise_is_drawn_in_and_outliers_are_dropped():
    rng = np.random.default_rng(3)
    faces = np.concatenate([sheet((0.0, y), (4.0, y), 0.0, 1.2) for y in (0.0, 0.1)])
    noisy = faces + rng.normal(0.0, 0.02, faces.shape) * (0.0, 1.0, 0.0)
    wild = rng.random((300, 3)) * (4.0, 3.0, 1.2) + (0.0, 0.5, 0.0)
    found = denoise_points(np.concatenate([noisy, wild]))
    off = np.minimum(np.abs(found[:, 1]), np.abs(found[:, 1] - 0.1))
    assert np.quantile(off, 0.9) < 0.015  # before: 0.033
    assert (found[:, 1] > 0.5).sum() < 30
    assert len(found) > 0.95 * len(faces)


def test_no_points_are_none():
    assert len(denoise_points(np.empty((0, 3)))) == 0
