"""Rings on the grid of a plan."""

import numpy as np
import shapely

from houseexpo.inference.snapping import snap_polygon, snap_polygons, snap_ring

ROOM = shapely.box(0.004, 0, 4, 3).union(shapely.box(4, 1, 4.002, 2))
"""A rectangle with a nib of 2 mm, which is none on the grid."""
COURT = shapely.box(0, 0, 9, 9).difference(shapely.box(4, 4, 5, 5)).difference(shapely.box(2, 2, 2.001, 3))
"""With a hole, and one that has no area on the grid."""


def test_rings_have_no_vertices_that_they_do_not_need() -> None:
    ring, holes = snap_polygon(ROOM)
    assert sorted(ring.tolist()) == [[0.0, 0.0], [0.0, 3.0], [4.0, 0.0], [4.0, 3.0]]
    assert holes == ()


def test_several_polygons_are_snapped_as_each_by_itself() -> None:
    shift = np.array([0.1, -0.2])
    found = snap_polygons([COURT, ROOM], shift)
    assert [len(holes) for _, holes in found] == [1, 0]
    for (ring, holes), shape in zip(found, (COURT, ROOM), strict=True):
        moved = shapely.transform(shape, lambda points: points + shift)
        assert np.array_equal(ring, snap_ring(moved.exterior, clockwise=True))
        assert shapely.LinearRing(ring).is_ccw is False
        assert all(shapely.LinearRing(hole).is_ccw for hole in holes)
