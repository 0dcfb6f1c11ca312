"""Triangles of polygons: they cover them, turn one way, and have no corner of their own."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon

from pipeline.geometry.areas import triangulate

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
