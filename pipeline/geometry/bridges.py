"""Where a piece of wall separates two spaces: straight strips from one's face to the other's.

A lintel, a sill or the filling of a gap is a piece of wall that stands in one plane and not in the other. Its outline
is walked; each stretch of it faces a room, the outside, or more wall. Two stretches that face each other across the
piece and look into different spaces bound a *bridge*: the strip between them, as far as nothing stands there in the
door plane.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bridge import PARALLEL, Bridge, Vector, free_intervals, joined, strips_of
from pipeline.geometry.outlines import outlines
from pipeline.geometry.overlay import Shapes, areas, clipped, overlaps
from pipeline.geometry.regions import WALL, locate

STEP_M = 0.08
DETAIL_M = 0.004
REACH_M = 0.02
DEEPEST_M = 1.2
NEAR_M = 1.0
FILLED = 0.9
"""At least this share of a strip is the piece or stands in the door plane."""
SHORT_M = 0.05


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A straight part of the piece's outline, ``a`` to ``b`` with the piece on its left, facing one space."""

    a: Vector
    b: Vector
    faces: int


def bridges(
    pieces: Sequence[Polygon], rooms: list[Polygon], walls: BaseGeometry, door_plane: BaseGeometry
) -> list[list[Bridge]]:
    """For each of the pieces all strips through it that join two different spaces.

    Parameters
    ----------
    pieces
        Wall that does not stand in the door plane.
    rooms
        The closed spaces; a bridge's ``sides`` are indices into them, or OUTSIDE.
    walls
        All walls of the closed plane, the pieces included.
    door_plane
        What stands in the door plane; a strip is cut off where it does.
    """
    facing = [
        (k, whole)
        for k, stretches in enumerate(_stretches(pieces, rooms, walls))
        for first, second in combinations(stretches, 2)
        if (whole := _across(first, second)) is not None
    ]
    if not facing:
        return [[] for _ in pieces]
    of_piece = np.array([k for k, _ in facing])
    near = _around(pieces, door_plane)
    strips = strips_of([whole for _, whole in facing])
    filled = shapely.area(overlaps(strips, np.array(pieces, dtype=np.object_)[of_piece]))
    standing = overlaps(strips, near[of_piece])
    real = filled + shapely.area(standing) >= FILLED * shapely.area(strips)
    found: list[list[Bridge]] = [[] for _ in pieces]
    for j in np.flatnonzero(real).tolist():
        k, whole = facing[j]
        found[k] += [whole.narrowed(s, e) for s, e in free_intervals(whole, areas(standing[j]))]
    return [joined(each, plane) for each, plane in zip(found, near, strict=True)]


def _around(pieces: Sequence[Polygon], door_plane: BaseGeometry) -> Shapes:
    """For each piece what stands near it."""
    found = np.empty(len(pieces), np.object_)
    for k, (x1, y1, x2, y2) in enumerate(shapely.bounds(pieces)):
        found[k] = clipped(door_plane, x1 - NEAR_M, y1 - NEAR_M, x2 + NEAR_M, y2 + NEAR_M)
    return found


def _stretches(pieces: Sequence[Polygon], rooms: list[Polygon], walls: BaseGeometry) -> list[list[_Stretch]]:
    """Walk the outlines in steps, look outwards from each, and join neighbours that see the same space, if not wall."""
    found: list[list[_Stretch]] = [[] for _ in pieces]
    if not pieces:
        return found
    outline = outlines(pieces, DETAIL_M)
    start = outline.points
    edge = start[outline.after] - start
    steps = np.maximum(1, np.ceil(np.hypot(*edge.T) / STEP_M)).astype(np.int64)
    edges = np.repeat(np.arange(len(edge)), steps)
    step = np.arange(len(edges)) - np.repeat(np.cumsum(steps) - steps, steps)
    each = 1.0 / steps[edges]
    until = np.where(step + 1 == steps[edges], 1.0, (step + 1) * each)
    a = start[edges] + (step * each)[:, None] * edge[edges]
    b = start[edges] + until[:, None] * edge[edges]
    along = b - a
    length = np.hypot(*along.T)
    outwards = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.where(length > 0, length, 1.0)[:, None]
    faces = locate((a + b) / 2 + REACH_M * outwards, rooms, walls)
    change = np.flatnonzero((np.diff(edges) != 0) | (np.diff(faces) != 0)) + 1
    first, last = np.concatenate([[0], change]), np.concatenate([change, [len(a)]]) - 1
    long = np.hypot(*(b[last] - a[first]).T) > SHORT_M
    for i, j in zip(first[long & (faces[first] != WALL)], last[long & (faces[first] != WALL)], strict=True):
        found[outline.area[edges[i]]].append(_Stretch(a[i], b[j], int(faces[i])))
    return found


def _across(first: _Stretch, second: _Stretch) -> Bridge | None:
    """The strip from one stretch to the other, or None if they see one space or do not face each other."""
    if first.faces == second.faces:
        return None
    d1, d2 = first.b - first.a, second.b - second.a
    u1, u2 = d1 / math.hypot(*d1), d2 / math.hypot(*d2)
    if u1 @ u2 > -PARALLEL:
        return None
    along = u1 - u2  # the two run against each other
    along /= math.hypot(*along)
    across = np.array([-along[1], along[0]])  # into the piece, seen from the first stretch
    depth = float(((second.a + second.b) / 2 - (first.a + first.b) / 2) @ across)
    low = max(first.a @ along, second.b @ along)
    high = min(first.b @ along, second.a @ along)
    if not 0 < depth <= DEEPEST_M or high - low < SHORT_M:
        return None
    middle = ((first.a + first.b) / 2 + (second.a + second.b) / 2) @ across / 2
    centre = along * (low + high) / 2 + across * middle
    return Bridge(centre, along, float(high - low), depth, (first.faces, second.faces))
