"""Closets and shafts: narrow spaces in a closed body, as wide as the walls of other houses are thick.

In a section over the heads of the doors nothing opens them, and by its width alone such a space is the inside of a
thick wall. Where the body is closed and wound with care, it is told by what the section winds around: not around the
space, but around the wall on every side of it. Sheets around a room give no such thing, whichever way they look.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import EMPTY, mitred, overlap, united
from pipeline.geometry.winding import winding_number

MIN_DEPTH_M = 0.4  # the shallowest closet; less is the cavity of a wall
BESIDE_M = 0.02
ALL_ROUND = 0.95


def closets(faces: npt.NDArray[np.object_], solids: BaseGeometry, segments: npt.NDArray[np.float64]) -> BaseGeometry:
    """Those of the narrow ``faces`` of a section that are spaces.

    ``solids`` are its massive bodies, ``segments`` (n, 2, 2) are oriented.
    """
    wide = ~shapely.is_empty(mitred(faces, -MIN_DEPTH_M / 2))
    if not wide.any():
        return EMPTY
    winds = winding_number(shapely.point_on_surface(faces), segments)
    spaces = faces[wide & (winds == 0)]
    if not len(spaces):
        return EMPTY
    walls = united([*faces[winds > 0], solids])
    around = shapely.difference(mitred(spaces, BESIDE_M), spaces)
    closed = np.array([overlap(band, walls).area > ALL_ROUND * band.area for band in around], np.bool_)
    return united(spaces[closed])
