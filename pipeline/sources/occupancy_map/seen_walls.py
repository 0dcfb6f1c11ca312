"""Find walls inside the rooms of a map, which hang at one end or stand free, and entrances in the rooms' own walls.

``clutter`` takes what stands alone, and smoothing a room's edge takes what is thin. What a robot saw as a wall stays:

W1  A wall is a straight piece of what is not free, ``THICKEST_PIECE_M`` thick at most and ``LONG_M`` or longer; or
    ``PIECE_M`` or longer, if a wall is in its line beyond one of its ends: over ``STANDS`` of ``REACH_M``.
W2  Rays ended along ``RAYS_HIT`` of it or more: unseen wedges between rays are thin and straight as well.
W3  Where its end is ``RUN_M`` or nearer to the edge of its room, it hangs there: nobody passes.
W4  An entrance is a gap in a straight side of a room, ``GAP_M`` wide: rays ended on both sides of it, over ``BESIDE_M``
    or more, and none in it. Free cells come up to it, and behind it, ``BEHIND_M`` from the side, nothing was seen, or
    the picture ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.sources.occupancy_map.clutter import PIECE_M, THICKEST_PIECE_M, slender_pieces
from pipeline.sources.occupancy_map.gaps import REACH_M
from pipeline.sources.occupancy_map.narrow_places import Bools, Floats
from pipeline.tolerances import BESIDE_M, HAND_M, MOSTLY, PARTITION_M, RUN_M, STANDS

LONG_M: Final = 1.5
"""W1: furniture that a laser sees as one thin line is shorter."""
RAYS_HIT: Final = 0.6
GAP_M: Final = (0.6, 1.5)
BEHIND_M: Final = (0.2, 0.35, 0.5)
"""W4: walls are as thick."""


def walls_in_rooms(rooms: Bools, free: Bools, occupied: Bools, cell_m: float, angle: float) -> Floats:
    """Return the walls (n, 4, 2) inside rooms, as corners (across, down) in cells.

    Arrays are (rows, cols): which cells are in rooms, free, and hit by rays. ``angle`` is the main direction of walls.
    """
    size = 2 * round(THICKEST_PIECE_M / cell_m / 2) + 3
    solid = (~free).view(np.uint8)
    thick = cv2.morphologyEx(solid, cv2.MORPH_OPEN, np.ones((size, size), np.uint8))
    thin = (rooms & (solid > thick)).view(np.uint8)
    if not thin.any():
        return np.zeros((0, 4, 2))
    hit = cv2.dilate((occupied & ~free).view(np.uint8), np.ones((3, 3), np.uint8)).view(bool)
    # W4: the cells at which rays ended on a room's side lie so near to it
    edge = 2 * round(PARTITION_M / cell_m) + 1
    inner = cv2.erode(rooms.view(np.uint8), np.ones((edge, edge), np.uint8)).view(bool)
    beyond = (occupied & ~inner).view(np.uint8)
    # a wall so near to the line of a piece is in line with it
    reach = 2 * max(round(HAND_M / cell_m), 1) + 1
    beyond = cv2.dilate(beyond, np.ones((reach, reach), np.uint8)).view(bool)
    found: list[Floats] = []
    left = thin.copy()
    along = (None, angle, angle + np.pi / 2)  # first what is straight by itself, then what meets other walls
    for turn in along:
        part = left if turn is None else cv2.morphologyEx(left, cv2.MORPH_OPEN, _line(LONG_M / cell_m / 2, turn))
        _, pieces, stats, _ = cv2.connectedComponentsWithStats(part, connectivity=8)
        long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) * cell_m >= PIECE_M
        long[0] = False
        numbers, ends = slender_pieces(
            pieces, stats, np.flatnonzero(long), cell_m, PIECE_M, THICKEST_PIECE_M + 2 * cell_m
        )
        for number, line in zip(numbers.tolist(), ends, strict=True):
            if _is_wall(line + 0.5, hit, beyond, cell_m):
                x, y, wide, high = stats[number, : cv2.CC_STAT_AREA].tolist()
                box = (slice(y, y + high), slice(x, x + wide))
                own = pieces[box] == number
                cells = np.argwhere(own)[:, ::-1] + (x + 0.5, y + 0.5)
                found.append(_around(cells, line + 0.5, HAND_M / cell_m))
                left[box][own] = 0
    return np.array(found).reshape(-1, 4, 2)


def _line(length: float, angle: float) -> npt.NDArray[np.uint8]:
    """Return a kernel of cells on a line through its middle."""
    half = max(round(length / 2), 1)
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    right, down = np.rint(half * np.array([np.cos(angle), np.sin(angle)])).astype(int).tolist()
    cv2.line(kernel, (half - right, half - down), (half + right, half + down), 1, 1)
    return kernel


def _is_wall(line: Floats, hit: Bools, walls: Bools, cell_m: float) -> bool:
    """W1, W2, for a piece with ends (2, 2)."""
    way = line[1] - line[0]
    length = float(np.hypot(*way))
    way = way / max(length, 1e-9)
    steps = np.arange(0.0, length + 1e-6, 1.0)
    across = np.array([-way[1], way[0]])
    sides = np.arange(-THICKEST_PIECE_M / 2, THICKEST_PIECE_M / 2 + 1e-6, cell_m) / cell_m
    lanes = line[0] + steps[:, None, None] * way + sides[:, None] * across
    if _at(hit, lanes).any(axis=1).mean() < RAYS_HIT:
        return False
    if length * cell_m >= LONG_M:
        return True
    steps = np.arange(1.0, max(REACH_M / cell_m, 2.0))
    ahead = (line[0] - steps[:, None] * way, line[1] + steps[:, None] * way)
    return max(float(_at(walls, points).mean()) for points in ahead) >= STANDS


def _at(cells: Bools, points: Floats) -> Bools:
    """Return whether the cells at points (..., 2), (across, down), are true; False beyond the map."""
    col, row = np.moveaxis(np.floor(points).astype(np.int64), -1, 0)
    inside = (row >= 0) & (row < cells.shape[0]) & (col >= 0) & (col < cells.shape[1])
    found: Bools = np.zeros(inside.shape, bool)
    found[inside] = cells[row[inside], col[inside]]
    return found


def _around(cells: Floats, line: Floats, thinnest: float) -> Floats:
    """Return the rectangle (4, 2) around the middles of cells (n, 2) along a line (2, 2)."""
    way = (line[1] - line[0]) / max(float(np.hypot(*(line[1] - line[0]))), 1e-9)
    across = np.array([-way[1], way[0]])
    far, aside = (cells - line[0]) @ way, (cells - line[0]) @ across
    low, high = float(np.quantile(aside, 0.05)) - 0.5, float(np.quantile(aside, 0.95)) + 0.5  # without single cells
    spread = max(thinnest - (high - low), 0.0) / 2
    start, end = float(far.min()) - 0.5, float(far.max()) + 0.5
    corners = [(start, low - spread), (end, low - spread), (end, high + spread), (start, high + spread)]
    return np.array([line[0] + a * way + b * across for a, b in corners])


def cut_walls(room: Polygon, walls: Sequence[Polygon]) -> Polygon:
    """Return a room without the walls in it, metres; a wall that hangs on its edge leaves a slit (W3).

    What runs along the room's edge, THICKEST_PIECE_M from it, is the edge itself, seen twice. A wall that would part
    the room is left out: what parts rooms is told elsewhere.
    """
    for wall in walls:
        if shapely.intersection(room, wall).area < wall.area / 2:
            continue
        if shapely.intersection(wall, shapely.buffer(room.exterior, THICKEST_PIECE_M)).area > wall.area / 2:
            continue
        left = shapely.difference(room, _hung(wall, room))
        if left.geom_type == "Polygon":
            room = left
    return room


def _hung(wall: Polygon, room: Polygon) -> Polygon:
    """W3."""
    corners = shapely.get_coordinates(wall)[:4]
    if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
        corners = np.roll(corners, -1, axis=0)
    way = (corners[1] - corners[0]) / float(np.hypot(*(corners[1] - corners[0])))
    for pair, out in (((0, 3), -way), ((1, 2), way)):
        end = shapely.LineString(corners[list(pair)])
        reach = out * (RUN_M + HAND_M)
        if not room.contains(shapely.Point(shapely.get_coordinates(end.centroid)[0] + reach)):
            corners[list(pair)] += reach
    return Polygon(corners)


def entrance_gaps(room: Polygon, others: Sequence[shapely.Geometry], sides: SeenSides) -> list[tuple[Floats, Floats]]:
    """W4: return the ends (2, 2) of each entrance on the sides of a room, and the direction (2,) out of it, metres.

    ``others`` are the other rooms and the known ways: there is no entrance beside them.
    """
    around = np.array(others, dtype=np.object_)
    around = around[shapely.dwithin(room, around, 3 * PARTITION_M)]  # a span and its surroundings are within 2
    ring = shapely.get_coordinates(shapely.orient_polygons(room).exterior)[:-1]
    has_recess = len(ring) >= 6  # a recess and the wall beside it have five sides
    found = []
    for k, (a, b) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
        length = float(np.hypot(*(b - a)))
        way = (b - a) / max(length, 1e-9)
        out = np.array([way[1], -way[0]])  # the ring turns counter-clockwise
        gaps = sides.gaps_in(a, way, length)
        if has_recess and GAP_M[0] <= length <= GAP_M[1] and sides.is_recess(np.roll(ring, 2 - k, axis=0)[:6]):
            gaps = [np.stack([a, b])]
        for gap in gaps:
            span = shapely.LineString(gap + out * PARTITION_M)
            if sides.leads_out(gap, out) and not shapely.dwithin(around, span, PARTITION_M).any():
                found.append((gap, out))
    return found


class SeenSides:
    """What a robot saw along the sides of rooms: cells (rows, cols), asked by points in metres, y up.

    The cells are ``cell_m`` wide, row 0 at the highest y.
    """

    def __init__(self, free: Bools, occupied: Bools, cell_m: float) -> None:
        self._cell_m, self._height_m = cell_m, free.shape[0] * cell_m
        self._reach = round(PARTITION_M / cell_m)
        size = 2 * self._reach + 1
        self._free, self._known = free, free | occupied
        self._wall = cv2.dilate(occupied.view(np.uint8), np.ones((size, size), np.uint8)).view(bool)

    def _at(self, cells: Bools, points: Floats) -> Bools:
        return _at(cells, np.column_stack([points[:, 0], self._height_m - points[:, 1]]) / self._cell_m)

    def _points(self, start: Floats, end: Floats) -> Floats:
        steps = max(round(float(np.hypot(*(end - start))) / self._cell_m), 1)
        found: Floats = start + (np.arange(steps)[:, None] + 0.5) / steps * (end - start)
        return found

    def gaps_in(self, start: Floats, way: Floats, length: float) -> list[Floats]:
        """Return the ends (2, 2) of the gaps between seen parts of a side."""
        if length < GAP_M[0] + 2 * BESIDE_M:
            return []
        points = self._points(start, start + way * length)
        runs, at = [], 0
        for is_wall, group in groupby(self._at(self._wall, points).tolist()):
            count = len(list(group))
            runs.append((is_wall, at, at + count))
            at += count
        found = []
        for (is_wall, low, _), (_, first, last), (_, _, high) in zip(runs, runs[1:], runs[2:], strict=False):
            begin, end = max(first - self._reach, low), min(last + self._reach, high)
            wide_m, jamb_m = (end - begin) * self._cell_m, min(begin - low, high - end) * self._cell_m
            if is_wall and GAP_M[0] <= wide_m <= GAP_M[1] and jamb_m >= BESIDE_M:
                found.append(np.stack([points[begin], points[end - 1]]))
        return found

    def is_recess(self, corners: Floats) -> bool:
        """Return whether the third of five sides (corners (6, 2)) is the end of a gap in the first and the fifth."""
        ways = np.diff(corners, axis=0)
        turns = ways[:-1, 0] * ways[1:, 1] - ways[:-1, 1] * ways[1:, 0]
        if not (turns * (-1, 1, 1, -1) > 0).all() or np.hypot(*ways[[1, 3]].T).max() > BEHIND_M[-1]:
            return False
        step = ways[2] / float(np.hypot(*ways[2])) * (PARTITION_M + self._cell_m)  # beyond it, no jamb is near
        inner = self._points(corners[2] + step, corners[3] - step)
        jambs = [
            self._points(corner + way / max(float(np.hypot(*way)), 1e-9) * BESIDE_M, corner)
            for corner, way in ((corners[1], -ways[0]), (corners[4], ways[4]))
        ]
        return not self._at(self._wall, inner).any() and all(
            self._at(self._wall, jamb).mean() > RAYS_HIT for jamb in jambs
        )

    def leads_out(self, gap: Floats, out: Floats) -> bool:
        """Return whether free cells come up to a gap (2, 2), and nothing was seen behind it."""
        points = self._points(*gap)
        behind = (points + out * (depth + self._cell_m) for depth in BEHIND_M)
        is_unseen = any(not self._at(self._known, each).any() for each in behind)
        # W4: free cells come up to most of a gap
        return is_unseen and float(self._at(self._free, points - out * 2 * self._cell_m).mean()) >= MOSTLY
