"""Walls made of two sheets, one on each face: the slit between them is wall, and their faces are the wall's faces.

R1  A slit narrower than any door between two sheets that stand along much of its edge is the inside of a wall. Whether
    wall lies over it does not matter: beside an opening up to the ceiling, it is open at all heights.
R2  A sheet of such a wall needs no thickness of its own: the half of it that lies outside the wall is taken off, but
    where more wall stands against it.
"""

from __future__ import annotations

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.doorways import box_of
from pipeline.geometry.overlay import clipped, mitred, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import opened
from pipeline.geometry.walls import close_cracks

SLIT_M = 0.38
"""The widest slit inside a wall: narrower than any door."""
THINNEST_M = 0.01
"""Slits thinner than this are cracks, and closed as such."""
SLIVER_M = 0.04
CRACK_M = 0.005
LIKE_A_SHEET = 1.3
EPS_M = 1e-4
CLOSED = 0.3
FEW_M2 = 0.05


def joined_sheets(walls: BaseGeometry, sheet_m: float) -> BaseGeometry:
    """Walls with the slits between their sheets filled; ``sheet_m`` is how thick a sheet was drawn, metres."""
    thick = opened(walls, LIKE_A_SHEET * sheet_m)
    sheets = opened(subtract(walls, thick), SLIVER_M)  # without the crumbs of corners
    if sheets.area < FEW_M2:
        return walls
    slits = united(p for p in _slits(sheets, walls) if _closed(p, walls) > CLOSED)  # R1
    if slits.is_empty:
        return walls
    around = mitred(slits, sheet_m + EPS_M)
    outer = overlap(walls, subtract(around, mitred(slits, sheet_m / 2)))
    more = opened(subtract(walls, mitred(slits, sheet_m + 2 * EPS_M)), SLIVER_M)
    left = subtract(united([walls, slits]), subtract(outer, mitred(more, 2 * sheet_m)))  # R2
    return close_cracks(left, sheet_m / 2 + CRACK_M)  # R3


def long_slits(walls: BaseGeometry) -> BaseGeometry:
    """The slits between walls that are longer than any is wide."""
    return united(p for p in _slits(walls, walls) if box_of(p).width > SLIT_M)


def _slits(faces: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    closed = mitred(mitred(faces, SLIT_M / 2), -SLIT_M / 2)
    return polygons_of(opened(subtract(closed, walls), THINNEST_M))


def _closed(slit: Polygon, walls: BaseGeometry) -> float:
    """The share of a slit's edge that lies along walls."""
    x1, y1, x2, y2 = slit.bounds
    near = clipped(walls, x1 - SLIVER_M, y1 - SLIVER_M, x2 + SLIVER_M, y2 + SLIVER_M)
    return float(shapely.intersection(slit.exterior, shapely.buffer(near, EPS_M)).length / slit.exterior.length)
