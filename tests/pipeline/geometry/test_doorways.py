"""Boxes around plan polygons, and strips beside boxes, one by one and at once."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from pipeline.geometry.meshes import box_polygon, boxes_around_polygons, strips_beside

SHAPES = [rotate(shapely.box(k, 0, k + 0.9, 0.1), turn) for k, turn in enumerate((0.0, 30.0, 90.0, -75.0))]


def test_boxes_lie_around_their_polygons():
    boxes = boxes_around_polygons(SHAPES)
    for shape, box in zip(SHAPES, boxes, strict=True):
        assert (box.width, box.thickness) == pytest.approx((0.9, 0.1))
        assert box_polygon(box).symmetric_difference(shape).area == pytest.approx(0.0, abs=1e-9)
    assert boxes_around_polygons([]) == []


def test_strips_lie_beside_both_long_sides():
    boxes = boxes_around_polygons(SHAPES)
    strips = strips_beside(boxes, [0.5] * len(boxes), off_m=0.02, depth_m=0.3)
    assert strips.shape == (len(boxes), 2)
    for box, pair in zip(boxes, strips, strict=True):
        for strip, sign in zip(pair, (-1.0, 1.0), strict=True):
            middle = box.centre + sign * box.across * (0.05 + 0.02 + 0.15)
            expected = box_polygon(replace(box, centre=middle), width=0.5, depth=0.3)
            assert expected.symmetric_difference(strip).area == pytest.approx(0.0, abs=1e-9)
    assert strips_beside([], [], off_m=0.0, depth_m=0.1).shape == (0, 2)
    assert np.all(shapely.is_valid(strips))
