"""Masks on a raster as areas with few, straight edges."""

from __future__ import annotations

import cv2
import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import areas, mitred, subtract, united
from pipeline.geometry.scan_columns import Bools, Floats, Raster

ROUGH_M = 0.045
"""Contours are drawn with as few corners as this allows."""
SMOOTH = 5
EDGE = 0.25
"""Cells by which a contour, drawn through the middles of cells, lies inside: a face is in the middle of its cell."""
AXIS = np.tan(np.deg2rad(12.0))
CUT_M = 0.15
SLACK_M = 0.07
"""An edge is put along the raster if none of its ends moves more than that."""


def area_of(mask: Bools, raster: Raster) -> BaseGeometry:
    """A mask as an area in the level frame."""
    smooth = cv2.medianBlur(mask.view(np.uint8) * 255, SMOOTH)
    contours, tree = cv2.findContours(smooth, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    shapes = []
    for k, contour in enumerate(contours):
        if tree[0][k][3] >= 0:
            continue
        holes, child = [], int(tree[0][k][2])
        while child >= 0:
            holes.append(_ring(np.asarray(contours[child][:, 0], float), raster))
            child = int(tree[0][child][0])
        ring = _ring(np.asarray(contour[:, 0], float), raster)
        if len(ring) >= 3:
            inner = [shapely.make_valid(Polygon(hole)) for hole in holes if len(hole) >= 3]
            shapes.append(subtract(shapely.make_valid(Polygon(ring)), united(inner)))
    pixels = mitred(mitred(united(shapes), 0.5), EDGE - 0.5)
    return areas(shapely.transform(pixels, raster.placed))


def _ring(points: Floats, raster: Raster) -> Floats:
    """The corners of a contour (n, 2), its edges along the raster where they nearly are."""
    loose = ROUGH_M / raster.cell_m
    corners = cv2.approxPolyDP(points.astype(np.int32)[:, None], loose, closed=True)[:, 0].astype(float)
    return (
        _squared(_sharpened(corners, CUT_M / raster.cell_m), SLACK_M / raster.cell_m) if len(corners) >= 3 else corners
    )


def _sharpened(corners: Floats, longest: float) -> Floats:
    """A short edge between a level and an upright one is their corner, which noise has cut off."""
    d = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(*d.T)
    level, upright = np.abs(d[:, 1]) <= AXIS * np.abs(d[:, 0]), np.abs(d[:, 0]) <= AXIS * np.abs(d[:, 1])
    found: list[Floats] = []
    last_cut = False
    for k in range(-1, len(corners)):
        came, goes = k - 1, (k + 1) % len(corners)
        turns = (level[came] and upright[goes]) or (upright[came] and level[goes])
        is_cut = bool(turns and length[k] < min(longest, length[came], length[goes]) and not (level[k] or upright[k]))
        if is_cut and k >= 0:
            p, q = corners[k], corners[goes]
            found.append(np.array([q[0], p[1]] if level[came] else [p[0], q[1]]))
        elif k >= 0 and not last_cut:
            found.append(corners[k])
        last_cut = is_cut
    return np.array(found)


def _squared(corners: Floats, slack: float) -> Floats:
    """Each edge that is nearly level or upright becomes so, at the mean of its ends."""
    ends = np.roll(corners, -1, axis=0)
    d = np.abs(ends - corners)
    level = (d[:, 1] <= AXIS * d[:, 0]) & (d[:, 1] <= 2 * slack)
    upright = (d[:, 0] <= AXIS * d[:, 1]) & (d[:, 0] <= 2 * slack) & ~level
    middle = (corners + ends) / 2
    found: list[Floats] = []
    for k, corner in enumerate(corners):
        came = k - 1
        into, out = corner.copy(), corner.copy()
        for axis, lies in ((1, level), (0, upright)):
            if lies[came]:
                into[axis] = middle[came, axis]
            if lies[k]:
                out[axis] = middle[k, axis]
        if level[came] and upright[k]:
            found.append(np.array([middle[k, 0], middle[came, 1]]))
        elif upright[came] and level[k]:
            found.append(np.array([middle[came, 0], middle[k, 1]]))
        elif (into == out).all() or not (level[came] | upright[came]):
            found.append(out)
        else:
            found += [into, out]
    return np.array(found)
