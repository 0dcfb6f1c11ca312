"""A passage fitted between the faces of the two spaces it joins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bridge import Bridge
from pipeline.geometry.overlay import polygons_of, subtract
from pipeline.geometry.regions import OUTSIDE

REACH_M = 0.15


def fitted(bridge: Bridge, rooms: list[Polygon]) -> Bridge:
    """The bridge with its faces where the rooms' are now; on the outside, where it was."""
    near, far = -bridge.depth / 2, bridge.depth / 2
    limits = [near, far]
    for k, side in enumerate(bridge.sides):
        if side == OUTSIDE:
            continue
        inner, outer = (far, near - REACH_M) if k == 0 else (near, far + REACH_M)
        ray = shapely.linestrings([bridge.centre + inner * bridge.across, bridge.centre + outer * bridge.across])
        hit = shapely.intersection(ray, rooms[side])
        if not hit.is_empty:
            at = (shapely.get_coordinates(hit) - bridge.centre) @ bridge.across
            limits[k] = float(at.max() if k == 0 else at.min())
    low, high = limits
    if high - low < 1e-3:
        return bridge
    return replace(bridge, centre=bridge.centre + bridge.across * (low + high) / 2, depth=high - low)


def opening_polygon(bridge: Bridge, rooms: list[Polygon]) -> Polygon:
    """The area between the two faces, corner to corner, also where they are not quite parallel."""
    sides = [rooms[s] for s in bridge.sides if s != OUTSIDE]
    deeper = 0.0 if OUTSIDE in bridge.sides else REACH_M
    strip = bridge.strip(deeper_m=deeper)
    rest: BaseGeometry = strip
    for side in sides:
        rest = subtract(rest, side)
    pieces = polygons_of(rest)
    centre = shapely.points(np.asarray(bridge.centre))
    holding = [p for p in pieces if p.distance(centre) < 1e-6] or pieces or [strip]
    return holding[0]
