"""Cut the voids of a storey's floor out of rooms, and tell rooms whose shape is unlikely: too small, narrow, ragged."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.tolerances import SAME_M2
from pipeline.geometry.areas import buffer_mitred, drop_thin_parts, intersect, polygons_of, subtract, unite
from pipeline.tolerances import CRACK_M, HARDLY, MOST, PATCH_M2, SHOULDERS_M, STAND_M, STUB_M, WALL_M

# ---------------------------------------------------------------------------------------------------------------------
# Holes in a storey's floor through which the storey below shows: there is no free space over them.
#
# R1  An open part of a room's floor is a hole if it is at least as wide as a stair and half of it shows the storey
#     below (the upper steps of a flight hide the rest).
# R2  The area of a room that the source names has no holes: many sources draw a stair's void as part of the hall.
# R3  The rest of a room beside the hole is a room if a person can stand on it, which excludes the upper half of a hall.
# ---------------------------------------------------------------------------------------------------------------------


def subtract_floor_voids(room: Polygon, floor: BaseGeometry, below: BaseGeometry, named: BaseGeometry) -> list[Polygon]:
    """Return the parts of a room that have a floor: the room, a smaller part, several if a void parts it, or nothing.

    ``floor`` is the area of the source's floor faces, ``below`` the area where the storey below shows, ``named`` the
    area of the source's own rooms; plan areas in the level frame.
    """
    bare = drop_thin_parts(subtract(room, unite([buffer_mitred(floor, CRACK_M), named])), SHOULDERS_M)  # R2
    voids = [hole for hole in polygons_of(bare) if intersect(hole, below).area > MOST * hole.area]  # R1
    if not voids:
        return [room]
    left = polygons_of(subtract(room, buffer_mitred(unite(voids), CRACK_M)))
    return [part for part in left if part.area > PATCH_M2 and not drop_thin_parts(part, SHOULDERS_M).is_empty]  # R3


# ---------------------------------------------------------------------------------------------------------------------
# Rooms of an unlikely shape: by their size, their width, and walls that end in the middle of them.
# ---------------------------------------------------------------------------------------------------------------------

SMALLEST_ROOM_M2, LARGEST_ROOM_M2 = 1.5, 200.0
NARROWEST_ROOM_M = 0.85

Bools = npt.NDArray[np.bool_]


@lru_cache(maxsize=1)  # grounds, passages and rooms ask for the same rooms
def are_rooms_misshapen(rooms: tuple[Polygon, ...]) -> Bools:
    """Return which rooms (n,) are too small, too large, too narrow or too ragged for a room."""
    area, length = shapely.area(rooms), shapely.length(rooms)
    sized = (area >= SMALLEST_ROOM_M2) & (area <= LARGEST_ROOM_M2)
    ragged = 4 * math.pi * area / length**2 < HARDLY
    return np.asarray(~sized | ragged | shapely.is_empty(buffer_mitred(np.array(rooms), -NARROWEST_ROOM_M / 2)))


@lru_cache(maxsize=1)
def have_jutting_walls(rooms: tuple[Polygon, ...]) -> Bools:
    """Return into which rooms (n,) a wall juts by more than ``STUB_M`` and ends; most walls go on to another wall."""
    every = shapely.polygons(shapely.get_exterior_ring(np.array(rooms)))
    dented = np.flatnonzero(shapely.area(shapely.convex_hull(every)) - shapely.area(every) > SAME_M2)
    whole = every[dented]
    closed = buffer_mitred(buffer_mitred(whole, WALL_M / 2), -WALL_M / 2)
    juts, room = shapely.get_parts(shapely.difference(closed, whole), return_index=True)
    found = np.zeros(len(rooms), np.bool_)
    if len(juts):
        half = shapely.length(juts) / 2
        thickness = shapely.area(juts) / np.maximum(half, 1e-9)
        found[dented[room[(thickness > STAND_M) & (half - thickness > STUB_M)]]] = True
    return found
