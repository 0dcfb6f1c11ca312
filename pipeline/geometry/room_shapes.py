"""What is odd about the shape of a room: its size, its width, and walls that end in the middle of it."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.geometry.overlay import mitred

SMALLEST_M2, LARGEST_M2 = 1.5, 200.0
NARROWEST_M = 0.85
RAGGED = 0.15  # 4 pi area / length of the edge squared; a square has 0.79, a corridor of 1 : 10 has 0.26
THICKEST_M = 0.4
THINNEST_M = 0.03
SHORTEST_M = 0.5

Bools = npt.NDArray[np.bool_]


def odd(rooms: list[Polygon]) -> Bools:
    """Which rooms (n,) are too small, too large, too narrow or too ragged for a room."""
    area, length = shapely.area(rooms), shapely.length(rooms)
    sized = (area >= SMALLEST_M2) & (area <= LARGEST_M2)
    ragged = 4 * math.pi * area / length**2 < RAGGED
    return np.asarray(~sized | ragged | shapely.is_empty(mitred(np.array(rooms), -NARROWEST_M / 2)))


def with_loose_ends(rooms: list[Polygon]) -> Bools:
    """Into which rooms (n,) a wall juts by more than ``SHORTEST_M`` and ends: most walls go on to the next one."""
    whole = shapely.polygons(shapely.get_exterior_ring(np.array(rooms)))
    closed = mitred(mitred(whole, THICKEST_M / 2), -THICKEST_M / 2)
    juts, room = shapely.get_parts(shapely.difference(closed, whole), return_index=True)
    found = np.zeros(len(rooms), np.bool_)
    if len(juts):
        half = shapely.length(juts) / 2
        thickness = shapely.area(juts) / np.maximum(half, 1e-9)
        found[room[(thickness > THINNEST_M) & (half - thickness > SHORTEST_M)]] = True
    return found
