"""Holes in a storey's floor through which one looks down onto the storey below: there is no free space over them.

R1  A hole counts where the floor of a room is open, at least as wide as a stair, and half of it shows the storey below
    (the upper steps of a flight hide the rest).
R2  A room that the source names holds what it covers: many draw a stair's void as part of the hall around it.
R3  What is left of a room beside the hole is a room if a person can stand on it; the upper half of a hall is none.
"""

from __future__ import annotations

from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import mitred, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import opened

EDGE_M = 0.02
NARROWEST_M = 0.6
SHOWN = 0.5
STANDING_M = 0.6
MIN_M2 = 0.7


def without_voids(room: Polygon, floor: BaseGeometry, below: BaseGeometry, named: BaseGeometry) -> list[Polygon]:
    """What of a room has a floor: itself, a smaller piece, several where a void parts it, or none.

    ``floor`` is where the source has floor faces, ``below`` where the storey below shows, ``named`` what the source's
    own rooms cover; plan areas in the level frame.
    """
    bare = opened(subtract(room, united([mitred(floor, EDGE_M), named])), NARROWEST_M)  # R2
    voids = [hole for hole in polygons_of(bare) if overlap(hole, below).area > SHOWN * hole.area]  # R1
    if not voids:
        return [room]
    left = polygons_of(subtract(room, mitred(united(voids), EDGE_M)))
    return [part for part in left if part.area > MIN_M2 and not opened(part, STANDING_M).is_empty]  # R3
