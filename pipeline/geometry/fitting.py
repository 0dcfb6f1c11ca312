"""Passages fitted between the faces of the two spaces that each joins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from pipeline.geometry.bridge import Bridge, Vector, strips_of
from pipeline.geometry.overlay import areas, differences, polygons_of
from pipeline.geometry.regions import OUTSIDE

REACH_M = 0.15


def fitted(bridges: Sequence[Bridge], rooms: Sequence[Polygon]) -> list[Bridge]:
    """The bridges with their faces where the rooms' are now; on the outside, where they were."""
    limits = [[-bridge.depth / 2, bridge.depth / 2] for bridge in bridges]
    ends = [(i, k) for i, bridge in enumerate(bridges) for k in (0, 1) if bridge.sides[k] != OUTSIDE]
    facing = np.array([rooms[bridges[i].sides[k]] for i, k in ends], dtype=np.object_)
    rays = shapely.linestrings(np.array([_ray(bridges[i], k) for i, k in ends]).reshape(-1, 2, 2))
    for (i, k), hit in zip(ends, shapely.intersection(rays, facing), strict=True):
        if not hit.is_empty:
            at = (shapely.get_coordinates(hit) - bridges[i].centre) @ bridges[i].across
            limits[i][k] = float(at.max() if k == 0 else at.min())
    return [_between(bridge, low, high) for bridge, (low, high) in zip(bridges, limits, strict=True)]


def _ray(bridge: Bridge, k: int) -> list[Vector]:
    """From one face of a bridge across to its other one, number ``k``, and ``REACH_M`` further."""
    near, far = -bridge.depth / 2, bridge.depth / 2
    ends = (far, near - REACH_M) if k == 0 else (near, far + REACH_M)
    return [bridge.centre + at * bridge.across for at in ends]


def _between(bridge: Bridge, low: float, high: float) -> Bridge:
    """The bridge with its faces at two distances (metres) across the wall from its centre, if it has a depth then."""
    if high - low < 1e-3:
        return bridge
    return replace(bridge, centre=bridge.centre + bridge.across * (low + high) / 2, depth=high - low)


def opening_polygons(bridges: Sequence[Bridge], rooms: Sequence[Polygon]) -> list[Polygon]:
    """The area between the two faces of each bridge, corner to corner, also where they are not quite parallel."""
    entrance = np.array([OUTSIDE in bridge.sides for bridge in bridges], np.bool_)
    strips = np.where(entrance, strips_of(bridges), strips_of(bridges, deeper_m=REACH_M))
    rest = strips.copy()
    for k in (0, 1):
        inner = [i for i, bridge in enumerate(bridges) if bridge.sides[k] != OUTSIDE]
        rest[inner] = differences(rest[inner], np.array([rooms[bridges[i].sides[k]] for i in inner], np.object_))
    return [_holding(bridge, polygons_of(areas(r)) or [s]) for bridge, r, s in zip(bridges, rest, strips, strict=True)]


def _holding(bridge: Bridge, pieces: list[Polygon]) -> Polygon:
    """The piece that holds a bridge's centre, else the largest."""
    centre = shapely.points(bridge.centre)
    return next((piece for piece in pieces if len(pieces) > 1 and piece.distance(centre) < 1e-6), pieces[0])
