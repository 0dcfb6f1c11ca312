"""Walls made of two sheets, one on each face: the slit between them is wall, and their faces are the wall's faces.

R1  A slit narrower than any door between two sheets, longer than it is wide, is the inside of a wall. Whatever closes
    it elsewhere does not matter: where an opening goes up to the ceiling, it is open at all heights.
R2  A sheet of such a wall needs no thickness of its own: the half of it that lies outside the wall is taken off, but
    where more wall stands against it.
"""

from __future__ import annotations

from shapely.geometry.base import BaseGeometry

from pipeline.geometry.doorways import box_of
from pipeline.geometry.overlay import mitred, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import opened

SLIT_M = 0.38
"""The widest slit inside a wall: narrower than any door."""
SLIVER_M = 0.04
LIKE_A_SHEET = 1.3
HAIR_M = 1e-4
FEW_M2 = 0.05


def joined_sheets(walls: BaseGeometry, sheet_m: float) -> BaseGeometry:
    """Walls with the slits between their sheets filled; ``sheet_m`` is how thick a sheet was drawn, metres."""
    sheets = subtract(walls, opened(walls, LIKE_A_SHEET * sheet_m))
    if sheets.area < FEW_M2:
        return walls
    slits = united(long_slits(sheets, walls))  # R1
    if slits.is_empty:
        return walls
    around = mitred(slits, sheet_m + HAIR_M)
    outer = overlap(walls, subtract(around, mitred(slits, sheet_m / 2)))
    against = mitred(opened(subtract(walls, mitred(slits, sheet_m + 2 * HAIR_M)), SLIVER_M), sheet_m)
    return subtract(united([walls, slits]), subtract(outer, against))  # R2


def long_slits(faces: BaseGeometry, walls: BaseGeometry) -> list[BaseGeometry]:
    """The slits between ``faces`` that are longer than wide and not wall yet."""
    closed = mitred(mitred(faces, SLIT_M / 2), -SLIT_M / 2)
    return [p for p in polygons_of(opened(subtract(closed, walls), SLIVER_M)) if box_of(p).width > SLIT_M]
