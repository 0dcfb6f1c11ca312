"""Place windows in the walls of a plan.

W1  From its middle, a window looks across its wall both ways. The nearest room each way, at most ``REACH_M`` away, is
    beside it, and the edge of that room is the face of the wall there.
W2  Where no room is, a window looks outside; the face of the wall there is that of the window as it is drawn.
W3  It ends where no room is beside it any more: a row of panes may go on before a terrace that the plan lacks.
W4  A window without a room beside it, inside a room, between two parts of one room, or shorter than the grid is no
    window of the plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.inference.snapping import snap_polygon
from houseexpo.plan import Door, PlanObject, Room
from houseexpo.tolerances import ENTRANCE_REACH_M, GRID_M

Ends: TypeAlias = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]

REACH_M: Final = ENTRANCE_REACH_M
_LEAST_DEPTH_M: Final = 0.1  # a window that is drawn as a line is as deep as its frame


def place_windows(
    windows: Iterable[Door], rooms: Sequence[Room], objects: Sequence[PlanObject] = ()
) -> tuple[Door, ...]:
    """Return the windows that lie in walls of these rooms, numbered, with the rooms beside them.

    ``windows`` are as they are drawn: a segment in the wall and a ring round it; their ids and rooms do not count.
    ``objects`` is the furniture, which is cut out of the rooms. A window that lies in its wall already keeps its shape.
    """
    drawn = list(windows)
    if not drawn:
        return ()
    floors = [room.with_furniture(objects) for room in rooms]
    ends = np.array([window.segment for window in drawn], np.float64).reshape(-1, 2, 2)
    middle, width = ends.mean(axis=1), np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    found: list[Door] = []
    for window, centre, length, (a, b) in zip(drawn, middle, width.tolist(), ends, strict=True):
        if length < GRID_M:
            continue
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        depth = (window.ring - centre) @ across
        halves = [max(float(each), _LEAST_DEPTH_M / 2) for each in (depth.max(), -depth.min())]
        looks = zip((across, -across), halves, strict=True)
        sides = [_nearest(centre, to, max(REACH_M, half), floors) for to, half in looks]
        depths = [half if side is None else side[1] for side, half in zip(sides, halves, strict=True)]  # W2
        beside = [rooms[side[0]].id for side in sides if side is not None]
        if not beside or len(set(beside)) < len(beside) or sum(depths) < GRID_M:  # W4
            continue
        met = [
            (floors[side[0]], to * (side[1] + 2 * GRID_M))
            for side, to in zip(sides, (across, -across), strict=True)
            if side
        ]
        ends_there = _beside((a, b), met)
        if ends_there is None:
            continue
        placed = _in_wall(window, ends_there, across, (-depths[1], depths[0]))
        if placed is not None:
            found.append(replace(placed, id=len(found), rooms=(beside[0], beside[1] if len(beside) > 1 else None)))
    return tuple(found)


def _nearest(
    start: npt.NDArray[np.float64], to: npt.NDArray[np.float64], reach_m: float, floors: Sequence[shapely.Geometry]
) -> tuple[int, float] | None:
    """Return the first room that a look from a point meets, and how far away it is (W1)."""
    look = shapely.LineString([start, start + reach_m * to])
    near = np.flatnonzero(shapely.intersects(floors, look))
    met = [(k, float(shapely.intersection(floors[k], look).distance(shapely.Point(start)))) for k in near.tolist()]
    return min(met, key=lambda side: side[1], default=None)


def _beside(ends: Ends, met: Iterable[tuple[shapely.Geometry, npt.NDArray[np.float64]]]) -> Ends | None:
    """Return the ends of what has a room beside it (W3), None without any; ``met`` has rooms and ways into them."""
    (a, b), along = ends, (ends[1] - ends[0]) / math.dist(*ends)
    seen = [
        shapely.get_coordinates(shapely.intersection(floor, shapely.LineString([a + way, b + way])))
        for floor, way in met
    ]
    reach = (np.vstack(seen) - a) @ along
    if not len(reach):
        return None
    low, high = float(reach.min()), float(reach.max())
    return a + low * along if low > 2 * GRID_M else a, a + high * along if high < math.dist(a, b) - 2 * GRID_M else b


def _in_wall(
    window: Door,
    ends: Ends,
    across: npt.NDArray[np.float64],
    faces: tuple[float, float],
) -> Door | None:
    """Return a window from face to face of its wall, on the grid; None where nothing of it is left there."""
    (a, b), (low, high) = ends, faces
    corners = [a + low * across, b + low * across, b + high * across, a + high * across]
    ring, _ = snap_polygon(shapely.Polygon(corners))
    if len(ring) < 3:
        return None
    if {tuple(corner) for corner in ring.tolist()} == {tuple(corner) for corner in window.ring.tolist()}:
        return window
    (ax, ay), (bx, by) = np.round([end + (low + high) / 2 * across for end in ends], 2).tolist()
    return replace(window, segment=((ax, ay), (bx, by)), width=round(math.dist((ax, ay), (bx, by)), 2), ring=ring)
