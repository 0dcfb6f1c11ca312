"""Give a storey what has no right angles: a bay before a day room, a party wall that follows a plot at an angle.

B1  A bay takes the place of a window of a room to live or eat in: a trapezium before the wall, with the window in its
    front. It keeps clear of other rooms, doors and windows, and of balconies.
B2  An angled wall takes the place of an outer wall without doors and windows; what lies beyond it is cut off from the
    rooms. Rooms keep their limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final, TypeAlias

import numpy as np
import shapely
from shapely.affinity import affine_transform

from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.values import OUTDOORS, Storey
from pipeline.sources.tolerances import QUARTER

Keeps: TypeAlias = Callable[[str, shapely.Polygon], bool]
"""Say whether a room of a label keeps the limits."""

_BAYED: Final = frozenset({"Living_Room", "Dining_Room"})
_BAY_M: Final = (0.6, 0.95)
"""How far a bay comes forward, from the inner face of the wall to that of its front."""
_BAY_WIDTH_M: Final = (2.2, 3.2)
_BAY_WINDOW_M: Final = 0.9
"""The least width of the window in its front."""
_SLANTS: Final = (0.5, 1.0)
"""How far the sides of a bay lean, over their depth."""
_ANGLE: Final = (0.06, 0.17)
"""The slope of an angled wall."""
_CLEAR_M: Final = 0.35
"""What is free between an angled wall and doors and windows, and of a bay's walls, metres."""


def add_bay(storey: Storey, outer_m: float, keeps: Keeps, rng: np.random.Generator) -> Storey:
    """Return the storey with a bay (B1), or the storey itself where none has a place."""
    for k in rng.permutation(len(storey.windows)).tolist():
        window = storey.windows[k]
        room = storey.rooms[window.room]
        if storey.labels[window.room] not in _BAYED:
            continue
        x1, y1, x2, y2 = window.rect
        across = x2 - x1 < y2 - y1
        inside = room.bounds[0 if across else 1] < (x1 if across else y1) < room.bounds[2 if across else 3] + 1e-3
        # turned so that the wall lies along x and the outside is north
        outward = 1 if inside else -1
        matrix = [0, outward, outward, 0, 0, 0] if across else [1, 0, 0, outward, 0, 0]
        low, face, high, _ = affine_transform(shapely.box(*window.rect), matrix).bounds
        middle, wide = (low + high) / 2, float(rng.uniform(*_BAY_WIDTH_M))
        deep, lean = round(float(rng.uniform(*_BAY_M)), 2), float(rng.uniform(*_SLANTS))
        a, b = round(middle - wide / 2, 2), round(middle + wide / 2, 2)
        c, d = round(a + lean * deep, 2), round(b - lean * deep, 2)
        base = shapely.LineString([(a - _CLEAR_M, face), (b + _CLEAR_M, face)])
        turned = affine_transform(room, matrix)
        bay = shapely.Polygon([(a, face), (b, face), (d, face + deep), (c, face + deep)])
        pane = shapely.box(c + 0.1, face + deep, d - 0.1, face + deep + outer_m)
        if d - c - 0.2 < _BAY_WINDOW_M or not turned.boundary.buffer(0.01).covers(base):
            continue
        grown = shapely.union(turned, bay, grid_size=1e-4)
        back = affine_transform(grown, matrix)
        around = affine_transform(bay, matrix).buffer(outer_m + _CLEAR_M, join_style="mitre")
        others = [each for n, each in enumerate(storey.rooms) if n != window.room]
        taken = [shapely.box(*each.rect) for each in (*storey.doors, *storey.fronts)]
        taken += [shapely.box(*each.rect) for n, each in enumerate(storey.windows) if n != k]
        if not keeps(storey.labels[window.room], back) or around.intersects(shapely.union_all([*others, *taken])):
            continue
        rect = _rounded(affine_transform(pane, matrix).bounds)
        rooms = [back if n == window.room else each for n, each in enumerate(storey.rooms)]
        windows = [replace(window, rect=rect) if n == k else each for n, each in enumerate(storey.windows)]
        return replace(storey, rooms=tuple(rooms), windows=tuple(windows))
    return storey


def angle_wall(storey: Storey, keeps: Keeps, rng: np.random.Generator) -> Storey:
    """Return the storey with an angled outer wall (B2), or the storey itself where none has a place."""
    inside = [k for k, label in enumerate(storey.labels) if label not in OUTDOORS]
    x1, y1, x2, y2 = shapely.union_all([storey.rooms[k] for k in inside]).bounds
    rects = [each.rect for each in (*storey.doors, *storey.fronts)] + [each.rect for each in storey.windows]
    taken = shapely.union_all([shapely.box(*rect).buffer(_CLEAR_M) for rect in rects])
    outdoors = shapely.union_all([storey.rooms[k] for k in storey.balconies])
    for side in rng.permutation(4).tolist():
        slope = float(rng.uniform(*_ANGLE))
        upright = side % 2 == 0
        cut = round(slope * (y2 - y1 if upright else x2 - x1), 2)
        at, inward = ((x1, 1), (y1, 1), (x2, -1), (y2, -1))[side]
        ends = (y1, y2) if upright else (x1, x2)
        if rng.random() < 0.5:
            ends = ends[::-1]
        corners = [(at, ends[0]), (at + inward * cut, ends[1]), (at, ends[1])]
        off = shapely.Polygon(corners if upright else [(y, x) for x, y in corners])
        if off.intersects(taken) or off.distance(outdoors) < _CLEAR_M:
            continue
        rooms = [
            room if k in storey.balconies or not room.intersects(off) else shapely.difference(room, off, grid_size=1e-4)
            for k, room in enumerate(storey.rooms)
        ]
        if all(
            _is_whole(one, other) and (one is other or keeps(label, other))
            for one, other, label in zip(storey.rooms, rooms, storey.labels, strict=True)
        ):
            return replace(storey, rooms=tuple(rooms))
    return storey


def _is_whole(before: shapely.Polygon, after: shapely.Geometry) -> bool:
    """Return whether what is left of a room is one piece and most of it."""
    # no angled wall cuts off more
    return isinstance(after, shapely.Polygon) and after.area >= (1 - QUARTER) * before.area


def _rounded(bounds: tuple[float, float, float, float]) -> Rect:
    x1, y1, x2, y2 = (round(float(value), 4) for value in bounds)
    return x1, y1, x2, y2
