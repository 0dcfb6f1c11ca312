"""Regions of polygons, and triangles of polygons: they cover them, turn one way, and have no corner of their own."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon

from pipeline.geometry.areas import (
    OUTSIDE,
    WALL,
    areas_inside,
    buffer_mitred,
    drop_lines_and_points,
    drop_thin_parts,
    enclosed_pieces,
    intersect,
    locate_points,
    overlaps,
    polygons_of,
    shared_areas,
    smooth_edges,
    subtract,
    triangulate,
    unite,
)

FRAME = shapely.box(0, 0, 8, 5).difference(
    shapely.union_all([shapely.box(0.2, 0.2, 3, 4.8), shapely.box(3.2, 0.2, 7.8, 4.8)])
)


def test_overlays_leave_neither_lines_nor_points_behind() -> None:
    a, b = shapely.box(0, 0, 1, 1), shapely.box(1, 0, 2, 1)
    assert intersect(a, b).is_empty
    assert intersect(a, b).geom_type in {"Polygon", "MultiPolygon"}
    assert subtract(a, b).area == 1.0
    assert unite([a, b]).area == 2.0
    mixed = shapely.GeometryCollection([a, shapely.LineString([(0, 0), (5, 5)]), shapely.MultiPolygon([b])])
    assert drop_lines_and_points(mixed).area == 2.0
    assert [p.area for p in polygons_of(shapely.MultiPolygon([a, shapely.box(5, 5, 8, 8)]))] == [9.0, 1.0]


def test_what_each_of_some_areas_shares_with_each_of_others() -> None:
    ones = (shapely.box(0, 0, 2, 2), shapely.box(3, 0, 4, 1))
    others = (shapely.box(1, 0, 3, 2), shapely.box(3, 0, 4, 1), shapely.box(9, 9, 10, 10))
    assert shared_areas(ones, others).tolist() == [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    assert overlaps(ones, others) == pytest.approx(np.array([[1 / 3, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    assert shared_areas(ones, ()).shape == (2, 0)


def test_what_walls_close_all_round() -> None:
    walls, rooms = enclosed_pieces(FRAME)
    assert [round(r.area, 6) for r in rooms] == [round(4.6 * 4.6, 6), round(2.8 * 4.6, 6)]
    assert walls.equals(FRAME)
    assert enclosed_pieces(shapely.box(0, 0, 1, 1))[1] == []


def test_a_pillar_is_no_space_and_a_room_goes_round_it() -> None:
    pillar = shapely.box(5, 2, 5.4, 2.4)
    rooms = enclosed_pieces(unite([FRAME, pillar]))[1]
    assert rooms[0].area == pytest.approx(4.6 * 4.6 - 0.16)
    assert len(rooms[0].interiors) == 1


def test_a_room_within_a_room_is_a_space_of_its_own() -> None:
    ring = shapely.box(4.5, 1.5, 6.5, 3.5).difference(shapely.box(4.6, 1.6, 6.4, 3.4))
    assert sorted(round(r.area, 2) for r in enclosed_pieces(unite([FRAME, ring]))[1]) == [3.24, 12.88, 17.16]


def test_specks_between_pieces_of_one_wall_are_wall() -> None:
    crack = shapely.box(0.05, 1, 0.1, 2)
    walls, rooms = enclosed_pieces(subtract(FRAME, crack))
    assert len(rooms) == 2
    assert walls.area == pytest.approx(FRAME.area)


def test_opening_drops_what_is_thin_and_keeps_corners() -> None:
    shape = unite([shapely.box(0, 0, 2, 2), shapely.box(2, 0.9, 5, 0.95)])
    assert drop_thin_parts(shape, 0.1).symmetric_difference(shapely.box(0, 0, 2, 2)).area < 1e-4
    assert drop_thin_parts(shapely.box(0, 0, 3, 0.05), 0.1).is_empty


def test_locating_points() -> None:
    walls, rooms = enclosed_pieces(FRAME)
    points = np.array([(1.0, 1.0), (5.0, 1.0), (3.1, 1.0), (-1.0, 0.0)])
    assert locate_points(points, rooms, walls).tolist() == [1, 0, WALL, OUTSIDE]
    assert locate_points(np.zeros((0, 2)), rooms, walls).shape == (0,)


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
TOUCHING = shapely.from_wkt(  # walls of a made home: its rooms touch the outside in a corner; GEOS finds no triangles
    """POLYGON ((-0.05 10.4371, 6.696246356237309 10.4371, 10.4371 6.696246356237309, 10.4371 -0.05, -0.05 -0.05,
    -0.05 0.39966623673796575, 0.6571704630462522 2.106926759533889, 0.7495584162973808 2.0686584162973802,
    0.8419463695485095 2.0303900730608713, 0.7058225666572487 1.7017581419589876, 1.641344898178223 3.101866254415532,
    3.8658786437626915 5.3264, 0.38485106900584415 5.3264, -0.0493438545976766 9.097988280467035,
    0.0029716323298059 9.104010973603346, -0.05 10.027315015686229, -0.05 10.4371), (0.05 0.379775, 0.05 0.05,
    10.3371 0.05, 10.3371 5.3254, 10.3371 5.3264, 10.3371 5.4264, 10.3371 5.4274, 10.3371 6.654825, 6.654825 10.3371,
    0.05 10.3371, 0.05 10.03018125, 0.15530430989474175 8.19471024980098, 0.05 9.109425, 0.4739992914356056 5.4264,
    4.2438598383373645 5.4264, 4.2438598383373645 5.3264, 4.0073 5.3264, 1.7190199702171207 3.03811997021712,
    0.22488960407434522 0.801995854074345, 0.7495584162973808 2.0686584162973802, 0.05 0.379775))"""
)


@pytest.mark.parametrize(
    "polygon",
    [
        Polygon(SQUARE),
        Polygon(SQUARE[::-1], [[(1, 1), (2, 1), (2, 2), (1, 2)]]),
        Polygon([(0, 0), (2, 2), (4, 0), (4, 4), (0, 4)], [[(2, 2), (1, 3), (3, 3)]]),
        TOUCHING,
    ],
)
def test_they_cover_the_polygon_once(polygon: Polygon) -> None:
    corners, triangles = triangulate(polygon)
    assert {tuple(corner) for corner in corners.tolist()} == set(map(tuple, shapely.get_coordinates(polygon).tolist()))
    (a, b, c) = np.moveaxis(corners[triangles], 1, 0)
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (areas > -1e-12).all()
    assert areas.sum() == pytest.approx(polygon.area)
    covered = shapely.union_all(shapely.polygons(corners[triangles]))
    assert covered.symmetric_difference(polygon).area == pytest.approx(0, abs=1e-9)


def test_where_geos_fails_the_other_way_is_taken() -> None:
    with pytest.raises(shapely.GEOSException):
        shapely.constrained_delaunay_triangles(shapely.orient_polygons(TOUCHING))


def test_edges_are_smoothed_as_by_buffers_with_square_corners() -> None:
    shape = shapely.union_all(
        [
            shapely.box(0, 0, 3, 2),
            shapely.box(3.2, 0, 5, 2),  # beside a gap
            shapely.box(2, 2, 2.2, 4),  # a spur
            Polygon([(7, 0), (9, 0.5), (8.5, 2.5), (6.5, 2)]),  # askew, apart
        ]
    ).difference(shapely.box(1, 0.5, 2, 1.5))
    closed = buffer_mitred(buffer_mitred(shape, 0.15), -0.15)
    found = smooth_edges(shape, 0.3)
    assert shapely.symmetric_difference(found, drop_thin_parts(closed, 0.3)).area < 1e-6
    assert sorted(shapely.get_num_interior_rings(shapely.get_parts(found))) == [0, 1]
    assert all(smooth_edges(each, 0.3).is_empty for each in (Polygon(), shapely.box(0, 0, 0.2, 5)))


def test_shapes_far_from_an_area_share_nothing_with_it() -> None:
    shapes = [shapely.box(0, 0, 2, 1), shapely.box(1, 0, 3, 1), shapely.box(8, 8, 9, 9)]
    assert areas_inside(shapes, shapely.box(1, 0, 2, 5)).tolist() == [1.0, 1.0, 0.0]
    assert areas_inside(shapes, Polygon()).tolist() == [0.0, 0.0, 0.0]
    assert areas_inside([], shapely.box(0, 0, 1, 1)).tolist() == []
