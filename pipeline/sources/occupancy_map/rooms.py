"""Label a map's cells by room (0 for none), furniture included and the outside told apart; find the ways between.

R1  Clutter and noise are left out (``clutter``).
R2  Basins are joined, the least likely border first, as long as a border more probably does not separate rooms
    (``narrow_places``). A border of several narrow places is as likely as the least likely of them.
    A place wider than WIDE_M needs log-odds of WIDE_ODDS: to cut a corridor costs more of its area than to join two
    rooms. The value was chosen on empty maps that were left out of the fit.
R11 Through a slit, narrower than PARTITION_M, nobody goes: a thin wall was not seen whole there. Where it is in a wall
    thinner than RAIL_M, and ROOMY_M2 or more lie on both sides, it parts rooms. It is a way only where nothing
    else joins its rooms.
R3  A room has space for a disc of SMALLEST_M across, and SMALLEST_M2 of area. What is left of the others may go to the
    rooms by R5.
R4  Where two rooms meet, the widest of the narrow places within WAYS_APART_M of each other is a way between them. So is
    every other place where free cells of both touch for SHOULDERS_M or more: two basins may meet beside a narrow place.
R5  Furniture along a wall belongs to the room: what lies between two parts of a room, REACH_M apart at
    most, or in the rectangle around it, is filled, unless it is beside another room, deeper than DEEPEST_M, larger than
    SPACE_M2, or as thin as a wall. What is unseen is filled behind furniture, not behind a wall: where more than MOST
    of what it shares with the room is occupied, more than MOST of its other edge is, too.
R6  A gap in the line of a wall (``gaps``) parts what R2 joined, where it leaves SMALLEST_M2 or more on both sides: the
    cells are divided again, with the gap closed, and with the pieces of wall beside it that are clutter by R1.
R9  Where it is known which cells are occupied, rays correct the rooms (``rays``).
R8  Where all that is not free is wall, there is no clutter and no furniture, and the ways are the doorways between the
    ends of walls (``gaps``) that part rooms of NEARLY_ALL of SMALLEST_M2 or more.
R12 Where walls enclose a room, and the robot saw beyond them, the room ends there (``enclosure``). A room of which it
    saw a fan alone is outside. What no way leads to is no room where it is a closed block, or was seen through glass
    (``enclosure``).
R7  Where half of the picture's border or more is free, the map has a margin that no wall encloses: a room that touches
    the border is outside, unless all do. A free line around the picture, with unseen space beyond it for the most part,
    is a frame and no margin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.geometry.groups import Groups
from pipeline.sources.occupancy_map.clutter import drop_scraps, fill_clutter, free_beside_dashes
from pipeline.sources.occupancy_map.enclosure import (
    SPACE_M2,
    fill_between_rays,
    find_fans,
    is_marked,
    unreached_rooms,
    unseen_islands,
    with_scattered_cells,
    without_fans,
)
from pipeline.sources.occupancy_map.gaps import REACH_M, find_doorways, find_gaps
from pipeline.sources.occupancy_map.narrow_places import (
    Basins,
    Bools,
    Floats,
    Labels,
    NarrowPlaces,
    find_basins,
    measure_gaps,
    separation_log_odds,
)
from pipeline.sources.tolerances import SCARCELY
from pipeline.tolerances import BESIDE_M, MOST, NEARLY_ALL, PARTITION_M, RAIL_M, ROOMY_M2, SAME, SHOULDERS_M

WIDE_M = 1.2
WIDE_ODDS = 0.9
SMALLEST_M = 0.7
SMALLEST_M2 = 1.0
WAYS_APART_M = 0.75
DEEPEST_M = 1.2
MOST_CELLS = 5_000_000
"""Larger maps are divided into blocks of cells first."""
_BORDER = (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1])
BEYOND_CELLS = 2
"""R5: by so many cells, at most, furniture lies beyond the box around its room, and what decides on it: OpenCV closes
with kernels of even length askew."""


@dataclass(frozen=True, eq=False)
class RoomConnection:
    """A way between two rooms: their labels, the (across, down) of its jambs in cells, and its wall."""

    rooms: tuple[int, int]
    jambs: Floats
    width_m: float
    thick_m: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The rooms of a map.

    ``label`` (rows, cols) is 0 in no room, else the room's number from 1 on; ``ways`` join the rooms. The numbers in
    ``outside`` are no rooms, but what lies outside of the house. ``enclosed`` (rows, cols) is ``label`` without what
    the robot saw beyond walls, and without closed blocks (R12), or None if there is nothing of that.
    """

    label: Labels
    ways: tuple[RoomConnection, ...]
    cell_m: float
    scale: int
    outside: frozenset[int] = frozenset()
    enclosed: Labels | None = None

    @property
    def rooms(self) -> Labels:
        """The labels (rows, cols) of the rooms as far as walls enclose them."""
        return self.label if self.enclosed is None else self.enclosed

    def to_cells(self, values: npt.NDArray[Any], shape: tuple[int, int]) -> npt.NDArray[Any]:
        """Return what each of the map's own cells has of values that have the shape of ``label``; 0 beyond."""
        if self.scale == 1:
            return values
        found = np.zeros(shape, values.dtype)
        whole = values.repeat(self.scale, axis=0).repeat(self.scale, axis=1)
        found[: whole.shape[0], : whole.shape[1]] = whole
        return found


def segment_rooms(
    free: Bools,
    cell_m: float,
    *,
    occupied: Bools | None = None,
    walls_only: bool = False,
) -> Segmentation:
    """Return the rooms of the free cells (rows, cols) of a map, whose cells are ``cell_m`` wide.

    Where there are more than MOST_CELLS, the result has blocks of ``scale`` x ``scale`` cells for cells.
    ``occupied`` (rows, cols) are the cells at which a ray ended (R9); None if that is not known.
    ``walls_only``: what is not free is wall, neither furniture nor noise (R8).
    """
    scale = int(np.ceil(np.sqrt(free.size / MOST_CELLS)))
    if scale > 1:
        if occupied is not None:
            occupied = count_in_blocks(occupied, scale) > 0
        free, cell_m = _blocks(free, scale), cell_m * scale
    if walls_only:
        label, ways = _divide_at_wall_ends(drop_scraps(free, cell_m), cell_m)
        return Segmentation(label, ways, cell_m, scale, _outside(label, free, occupied, cell_m))
    clear = fill_clutter(free, cell_m, occupied)
    if occupied is not None and is_marked(clear, occupied, cell_m):
        clear = clear | unseen_islands(clear, occupied, cell_m)
    none: Floats = np.zeros((0, 2, 2))
    label, ways = _divide_cells(clear, none, none, cell_m)
    outside = _outside(label, free, occupied, cell_m)
    seen = clear if occupied is None else fill_between_rays(free | clear, occupied, cell_m)
    bare = free_beside_dashes(free, clear, cell_m)
    gaps, walls = find_gaps(clear, cell_m, main_edge_direction(clear), bare=bare, seen=seen)
    parting = _parts_a_room(gaps, walls, _clear_labels(label, outside), cell_m)
    gaps, walls = gaps[parting], walls[parting]
    if len(gaps):
        label, ways = _divide_cells(clear, gaps, walls, cell_m)
        outside = _outside(label, free, occupied, cell_m)
    if occupied is None:
        label = _fill_furniture(label, None, cell_m, outside)
        ways = _with_ways_where_rooms_touch(_without_slits(ways), label, free, cell_m)
        return Segmentation(label, ways, cell_m, scale, outside)
    cells = _Cells(free, occupied, cell_m)
    fans = find_fans(seen, occupied & ~clear, cell_m)
    enclosed, beyond = without_fans(label, fans, occupied, outside, cell_m)
    label = cells.whole_rooms(label, outside)
    if enclosed is not None:
        enclosed = cells.without(fans).whole_rooms(enclosed, outside | beyond)
    rooms = label if enclosed is None else enclosed
    ways = _with_ways_where_rooms_touch(_without_slits(ways), rooms, free, cell_m)
    outside |= beyond
    unreached = unreached_rooms(rooms, [way.rooms for way in ways], occupied, outside, cell_m)
    if unreached:
        enclosed = _clear_labels(rooms, unreached)
        ways = tuple(way for way in ways if unreached.isdisjoint(way.rooms))
    return Segmentation(label, ways, cell_m, scale, outside, enclosed)


@dataclass(frozen=True, eq=False)
class _Cells:
    """Which cells (rows, cols) are free and occupied; nothing is filled beside ``shut``."""

    free: Bools
    occupied: Bools
    cell_m: float
    shut: Bools | None = None

    def without(self, fans: Bools) -> _Cells:
        """Return what it is if nothing was seen in ``fans`` (rows, cols)."""
        return _Cells(self.free & ~fans, self.occupied | fans, self.cell_m, fans)

    def whole_rooms(self, label: Labels, outside: frozenset[int]) -> Labels:
        """Return the labels with furniture (R5) and the ends of rays (R9)."""
        label = _fill_furniture(label, self.occupied, self.cell_m, outside, self.shut)
        return with_scattered_cells(label, self.free, self.occupied, self.cell_m)


def _divide_at_wall_ends(clear: Bools, cell_m: float) -> tuple[Labels, tuple[RoomConnection, ...]]:
    """Return the rooms of the cells (rows, cols) and the ways between them."""
    doorways = find_doorways(clear, cell_m)
    while True:
        left = clear & ~_cells_inside(doorways, clear.shape)
        _, pieces, stats, _ = cv2.connectedComponentsWithStats(left.view(np.uint8), connectivity=4)
        room = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= NEARLY_ALL * SMALLEST_M2  # less the cells on its edge
        room[0] = False
        label = np.where(room, np.cumsum(room), 0)[pieces].astype(np.int32)
        jambs = np.stack([doorways[:, :2].mean(axis=1), doorways[:, 2:].mean(axis=1)], axis=1)
        thick = np.hypot(*(doorways[:, 1] - doorways[:, 0]).T)
        sides = _beside(jambs, label, cell_m, thick * (cell_m / 2))
        parts = (sides[:, 0] != sides[:, 1]) & (sides > 0).all(axis=1)
        if parts.all():
            break
        doorways = doorways[parts]
    width = np.hypot(*(jambs[:, 1] - jambs[:, 0]).T)
    ways = [
        RoomConnection((int(min(pair)), int(max(pair))), jamb, float(wide * cell_m), float(deep * cell_m))
        for pair, jamb, wide, deep in zip(sides.tolist(), jambs, width, thick, strict=True)
    ]
    return label, tuple(sorted(ways, key=lambda way: (way.rooms, *way.jambs.ravel().tolist())))


def _cells_inside(shapes: Floats, shape: tuple[int, ...]) -> Bools:
    """Return the cells (rows, cols) whose middles lie in shapes (n, 4, 2) of corners (across, down)."""
    inside = np.zeros(shape, bool)
    for corners in shapes:
        (left, top), (right, bottom) = (
            np.floor(corners.min(axis=0)).astype(int),
            np.ceil(corners.max(axis=0)).astype(int),
        )
        cols, rows = np.meshgrid(np.arange(max(left, 0), right), np.arange(max(top, 0), bottom))
        part = inside[max(top, 0) : bottom, max(left, 0) : right]
        part |= shapely.contains_xy(Polygon(corners), cols + 0.5, rows + 0.5)[: part.shape[0], : part.shape[1]]
    return inside


def _divide_cells(
    clear: Bools, gaps: Floats, walls: Floats, cell_m: float
) -> tuple[Labels, tuple[RoomConnection, ...]]:
    """Return the rooms of the cells (rows, cols) and the ways between them; ``gaps`` are closed, as ``walls`` says."""
    closed = _cells_of_gaps(walls, clear.shape) & clear
    basins = find_basins(clear & ~closed, cell_m)
    numbers = _number_rooms(_merge_basins(basins), basins)
    label = numbers.astype(np.int32)[basins.label]
    narrows, rooms = basins.narrows, numbers[basins.narrows.sides]
    if len(gaps):
        bare = np.nonzero(closed & (label == 0))
        label[bare] = cv2.dilate(label.astype(np.float32), np.ones((3, 3), np.uint8))[bare].astype(np.int32)
        through = _beside(gaps, label, cell_m)
        narrows = narrows.and_those_of(measure_gaps(clear, through, gaps[:, :, ::-1], cell_m))
        rooms = np.concatenate([rooms, through])
    return label, _ways(rooms, narrows)


def _cells_of_gaps(gaps: Floats, shape: tuple[int, ...]) -> Bools:
    """Return the cells (rows, cols) on the lines of gaps."""
    drawn = np.zeros(shape, np.uint8)
    for one, other in np.rint(gaps).astype(int).tolist():
        cv2.line(drawn, one, other, 1, 1)
    return drawn.view(bool)


def _beside(gaps: Floats, label: Labels, cell_m: float, beyond_m: Floats | float = 0.0) -> npt.NDArray[np.int64]:
    """Return the labels (n, 2) on both sides of gaps (n, 2, 2), 0 for none, BESIDE_M from ``beyond_m`` (n,)."""
    cells = _cells_beside(gaps, label.shape, cell_m, beyond_m)
    return label[cells[..., 1], cells[..., 0]].astype(np.int64)


def _cells_beside(
    gaps: Floats, shape: tuple[int, ...], cell_m: float, beyond_m: Floats | float = 0.0
) -> npt.NDArray[np.int64]:
    """Return the (across, down) of the cells (n, 2, 2) on both sides of gaps."""
    along = gaps[:, 1] - gaps[:, 0]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    # R6: how far from the middle of a gap its rooms are looked for.
    step = across * ((BESIDE_M + np.broadcast_to(beyond_m, len(gaps))) / cell_m)[:, None]
    middle = gaps.mean(axis=1)
    cells = np.rint(np.stack([middle - step, middle + step], axis=1)).astype(np.int64)
    return np.asarray(cells.clip(0, (shape[1] - 1, shape[0] - 1)))


def _parts_a_room(gaps: Floats, walls: Floats, label: Labels, cell_m: float) -> Bools:
    """Return which gaps (n), closed as ``walls`` says, are in one room and leave enough of it on both sides; R6."""
    sides = _beside(gaps, label, cell_m)
    found: Bools = (sides[:, 0] == sides[:, 1]) & (sides[:, 0] > 0)
    open_ = ~_cells_of_gaps(walls[found], label.shape)
    boxes = dict(label_boxes(label)) if found.any() else {}
    for number in np.unique(sides[found, 0]).tolist():
        rows, cols = boxes[number]
        inside = ((label[rows, cols] == number) & open_[rows, cols]).view(np.uint8)
        _, pieces, stats, _ = cv2.connectedComponentsWithStats(inside, connectivity=4)
        large = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= SMALLEST_M2
        large[0] = False
        here = np.flatnonzero(found & (sides[:, 0] == number))
        cells = _cells_beside(gaps[here], label.shape, cell_m) - (cols.start, rows.start)
        found[here] = large[pieces[cells[..., 1], cells[..., 0]]].all(axis=1)
    return found


def free_share_of_border(free: Bools, occupied: Bools | None, cell_m: float) -> float:
    """Return which share of the cells on the border of a map (rows, cols) is free; 0 for a frame (R7)."""
    share = float(np.concatenate([free[side] for side in _BORDER]).mean())
    frame = min(round(SMALLEST_M / cell_m), (min(free.shape) - 1) // 2)
    beyond = np.s_[frame : free.shape[0] - frame, frame : free.shape[1] - frame]
    if occupied is not None:
        seen = [free[beyond][side] | occupied[beyond][side] for side in _BORDER]
        if float(np.concatenate(seen).mean()) < MOST:  # R7
            return 0.0
    return share


def _clear_labels(label: Labels, numbers: frozenset[int]) -> Labels:
    """Return labels (rows, cols) that are 0 where they are one of some numbers."""
    if not numbers:
        return label
    kept = np.arange(int(label.max(initial=0)) + 1, dtype=np.int32)
    kept[list(numbers)] = 0
    return np.asarray(kept[label])


def _outside(label: Labels, free: Bools, occupied: Bools | None, cell_m: float) -> frozenset[int]:
    """Return the labels of what lies outside of the house; R7."""
    if free_share_of_border(free, occupied, cell_m) < MOST:
        return frozenset()
    touching = frozenset(np.concatenate([label[side] for side in _BORDER]).tolist()) - {0}
    return touching if len(touching) < int(label.max(initial=0)) else frozenset()


def _blocks(free: Bools, scale: int) -> Bools:
    """Return which blocks of cells are free: those of which less than one row's worth is not."""
    return count_in_blocks(free, scale) > scale * (scale - 1)


def count_in_blocks(cells: Bools, scale: int) -> npt.NDArray[np.integer[Any]]:
    """Return how many cells (rows, cols) of each block of ``scale`` x ``scale`` cells are true; scraps are left out."""
    rows, cols = (length // scale * scale for length in cells.shape)
    found = np.zeros((rows // scale, cols // scale), np.uint8 if scale < 16 else np.int64)  # of a byte, it is quick
    for down, right in np.ndindex(scale, scale):
        found += cells[down:rows:scale, right:cols:scale]
    return found


def _merge_basins(basins: Basins) -> npt.NDArray[np.int64]:
    """Return the room of each basin."""
    root = np.arange(len(basins.peak_m))
    peak, area = basins.peak_m.copy(), basins.area_m2.copy()
    narrows = basins.narrows
    slits = (narrows.width_m < PARTITION_M) & (narrows.thin_m < RAIL_M)
    while True:
        sides = root[narrows.sides]
        odds = separation_log_odds(narrows, peak[sides], area[sides]) - WIDE_ODDS * (narrows.width_m > WIDE_M)
        odds[slits & (area[sides].min(axis=1) >= ROOMY_M2)] = np.inf  # R11
        apart = sides[:, 0] != sides[:, 1]
        low, high = sides[apart].min(axis=1), sides[apart].max(axis=1)
        least = np.full(len(peak), np.inf)
        for side in (low, high):
            np.minimum.at(least, side, odds[apart])
        best = (odds[apart] < 0) & (odds[apart] <= least[low]) & (odds[apart] <= least[high])
        if not best.any():
            return root
        pairs = np.unique(np.stack([low[best], high[best]], axis=1), axis=0)
        taken: set[int] = set()
        for one, other in pairs.tolist():
            if one in taken or other in taken:
                continue
            taken |= {one, other}
            root[root == other] = one
            peak[one] = max(peak[one], peak[other])
            area[one] += area[other]


def _number_rooms(root: npt.NDArray[np.int64], basins: Basins) -> npt.NDArray[np.int64]:
    """Return the number of the room of each basin, 0 for none."""
    count = len(root)
    area = np.bincount(root, weights=basins.area_m2, minlength=count)
    peak = np.zeros(count)
    np.maximum.at(peak, root, basins.peak_m)
    room = (area >= SMALLEST_M2) & (2 * peak >= SMALLEST_M)
    numbers = np.zeros(count, np.int64)
    numbers[room] = np.arange(1, int(room.sum()) + 1)
    return np.asarray(numbers[root])


def _ways(rooms: npt.NDArray[np.int64], narrows: NarrowPlaces) -> tuple[RoomConnection, ...]:
    """Return the widest of the narrow places that lie close together; ``rooms`` (n, 2) are the rooms on their sides."""
    found: list[RoomConnection] = []
    middles: dict[tuple[int, int], list[Floats]] = {}
    apart = np.flatnonzero((rooms[:, 0] != rooms[:, 1]) & (rooms > 0).all(axis=1))
    for k in apart[np.argsort(-narrows.half_m[apart], kind="stable")].tolist():
        pair = int(rooms[k].min()), int(rooms[k].max())
        jambs = narrows.jambs[k][:, ::-1] + 0.5
        middle = jambs.mean(axis=0)
        near = WAYS_APART_M / (narrows.width_m[k] / max(float(np.hypot(*(jambs[1] - jambs[0]))), 1e-6))
        if all(np.hypot(*(middle - other)) > near for other in middles.setdefault(pair, [])):
            middles[pair].append(middle)
            found.append(RoomConnection(pair, jambs, float(narrows.width_m[k]), float(narrows.thin_m[k])))
    return tuple(sorted(found, key=lambda way: (way.rooms, *way.jambs.ravel().tolist())))


def _with_ways_where_rooms_touch(
    ways: tuple[RoomConnection, ...], label: Labels, free: Bools, cell_m: float
) -> tuple[RoomConnection, ...]:
    """Return ways, and those at other places where free cells of two rooms touch; arrays are (rows, cols)."""
    touching, pairs = np.zeros(label.shape, np.uint8), [np.zeros((0, 2), np.int64)]
    cells, middles = [np.zeros((0, 2), np.int64)], [np.zeros((0, 2))]
    for down, right in ((0, 1), (1, 0)):
        here, there = np.s_[: len(label) - down, : label.shape[1] - right], np.s_[down:, right:]
        meet = (label[here] != label[there]) & (label[here] > 0) & (label[there] > 0) & free[here] & free[there]
        at = np.argwhere(meet)
        touching[here][meet] = touching[there][meet] = 1
        pairs.append(np.sort(np.stack([label[here][meet], label[there][meet]], axis=1), axis=1).astype(np.int64))
        cells.append(at)
        middles.append(at[:, ::-1] + 0.5 + np.array([right, down]) / 2)
    if not touching.any():
        return ways
    _, places = cv2.connectedComponents(touching, connectivity=8)
    row, col = np.concatenate(cells).T
    keys = np.column_stack([np.concatenate(pairs), places[row, col]])
    groups, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    edges = np.split(np.concatenate(middles)[order], np.searchsorted(group[order], np.arange(1, len(groups))))
    found = list(ways)
    for (low, high, _), points in zip(groups.tolist(), edges, strict=True):
        jambs = _ends_of_row(points)
        width_m = float(np.hypot(*(jambs[1] - jambs[0]))) * cell_m
        known = np.array([way.jambs.mean(axis=0) for way in ways if way.rooms == (low, high)]).reshape(-1, 1, 2)
        near = np.hypot(*np.moveaxis(points - known, 2, 0)) * cell_m <= WAYS_APART_M
        if width_m >= SHOULDERS_M and not near.any():
            found.append(RoomConnection((low, high), jambs, width_m, 0.0))
    return tuple(sorted(found, key=lambda way: (way.rooms, *way.jambs.ravel().tolist())))


def _without_slits(ways: tuple[RoomConnection, ...]) -> tuple[RoomConnection, ...]:
    """Return ways without the slits between rooms that others join."""
    joined, kept = Groups(1 + max((max(way.rooms) for way in ways), default=0)), list[RoomConnection]()
    for way in sorted(ways, key=lambda way: -way.width_m):
        if joined.join(*way.rooms) or way.width_m >= PARTITION_M:
            kept.append(way)
    return tuple(way for way in ways if way in kept)


def _ends_of_row(points: Floats) -> Floats:
    """Return the ends (2, 2) of edges of cells, in cells, whose middles (n, 2) lie in a row."""
    middle = points.mean(axis=0)
    x, y = (points - middle).T
    angle = np.arctan2(2 * (x * y).sum(), (x * x - y * y).sum()) / 2
    along = np.array([np.cos(angle), np.sin(angle)])
    far = (points - middle) @ along
    half_cell = along / 2
    return np.stack([middle + along * float(far.min()) - half_cell, middle + along * float(far.max()) + half_cell])


def _fill_furniture(
    label: Labels, occupied: Bools | None, cell_m: float, outside: frozenset[int], shut: Bools | None = None
) -> Labels:
    """Return the labels with furniture; nothing stands against a wall ``outside``, or beside what is ``shut``."""
    filled = label.copy()
    walls = np.ones(label.shape, bool)
    if occupied is not None:
        reach = 2 * max(round(PARTITION_M / cell_m), 1) + 1
        walls = cv2.dilate(occupied.view(np.uint8), np.ones((reach, reach), np.uint8)).view(bool)
    for number, (rows, cols) in label_boxes(label):
        if number in outside:
            continue
        margin = round(2 * DEEPEST_M / cell_m) + 2
        top, left = max(rows.start - margin, 0), max(cols.start - margin, 0)
        part = np.s_[top : rows.stop + margin, left : cols.stop + margin]
        room = label[part] == number
        other = (filled[part] > 0) & ~room
        if shut is not None:
            other |= shut[part]
        mended = _mend_room(room, other, walls[part], main_edge_direction(room), cell_m)
        filled[part][mended & ~other] = number
    return filled


def label_boxes(label: Labels) -> list[tuple[int, tuple[slice, slice]]]:
    """Return each label with the rows and columns that it lies in, the largest first."""
    import scipy.ndimage

    boxes = enumerate(scipy.ndimage.find_objects(label), 1)
    found = [(number, box) for number, box in boxes if box is not None]
    sizes = np.bincount(label.ravel())
    return sorted(found, key=lambda each: -int(sizes[each[0]]))  # a large room's corner is not a small one's


def main_edge_direction(mask: Bools) -> float:
    """Return the direction, -45 to 45 degrees in radians, that the edges of a mask have, or nearly have."""
    padded = np.zeros((mask.shape[0] + 6, mask.shape[1] + 6), np.float32)  # np.pad takes as long as the rest
    padded[3:-3, 3:-3] = mask
    smooth = cv2.GaussianBlur(padded, (0, 0), 1.5)
    del padded  # of a large map, each of these takes 64 MB
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    right = cv2.Sobel(smooth, cv2.CV_32F, 1, 0)
    del smooth
    # a smoothed mask that is less steep has no edge
    steep = np.flatnonzero((np.abs(down) > SAME) | (np.abs(right) > SAME))
    if not len(steep):
        return 0.0
    twice = (right.ravel()[steep] + 1j * down.ravel()[steep]) ** 2  # what looks left or right has one direction
    return float(np.angle((twice**2 / np.abs(twice)).sum()) / 4)  # and so has what looks up or down


def _mend_room(room: Bools, other: Bools, walls: Bools, angle: float, cell_m: float) -> Bools:
    """Return a room (rows, cols) with what R5 adds to it; ``walls`` are cells at which something was seen."""
    if abs(angle) < 0.01:
        turned, taken, seen, back = room, other, walls, None
    else:
        rows, cols = room.shape
        side = int(np.ceil(np.hypot(rows, cols))) + 2
        turn = np.asarray(cv2.getRotationMatrix2D(((cols - 1) / 2, (rows - 1) / 2), np.degrees(angle), 1.0), np.float64)
        turn[:, 2] += (side - cols) / 2, (side - rows) / 2
        turned, taken, seen = (_warp(mask, turn, (side, side)) for mask in (room, other, walls))
        back = np.asarray(cv2.invertAffineTransform(turn), np.float64)
    part = _box_of(turned)
    added = np.zeros(turned.shape, bool)
    added[part] = _furniture_of_room(turned[part], taken[part], seen[part], cell_m)
    if back is None or not added.any():
        return room | added[: room.shape[0], : room.shape[1]]
    return room | _warp(added, back, room.shape)


def _box_of(mask: Bools) -> tuple[slice, slice]:
    """Return the rows and columns of a mask's true cells, and BEYOND_CELLS more on each side."""
    left, top, wide, high = cv2.boundingRect(mask.view(np.uint8))
    return np.s_[
        max(top - BEYOND_CELLS, 0) : top + high + BEYOND_CELLS, max(left - BEYOND_CELLS, 0) : left + wide + BEYOND_CELLS
    ]


def _furniture_of_room(room: Bools, taken: Bools, walls: Bools, cell_m: float) -> Bools:
    """Return what R5 adds to a room (rows, cols) whose walls run along the rows and columns."""
    wide = np.ones((1, round(REACH_M / cell_m)), np.uint8)
    pixels = np.zeros((room.shape[0] + 2 * wide.size, room.shape[1] + 2 * wide.size), np.uint8)
    middle = np.s_[wide.size : -wide.size, wide.size : -wide.size]
    pixels[middle] = room
    open_, near = ~taken, cv2.dilate(taken.view(np.uint8), np.ones((3, 3), np.uint8)).view(bool)
    filled = room
    for way in (wide, wide.T):
        niche = cv2.morphologyEx(pixels, cv2.MORPH_CLOSE, way)[middle].view(bool)
        filled = filled | _furniture((niche > room) & open_, near, room, walls, cell_m)
    top, bottom, left, right = _sides(room)
    inside = np.zeros(room.shape, bool)
    inside[top : bottom + 1, left : right + 1] = True
    return (filled | _furniture((inside > filled) & open_, near, filled, walls, cell_m)) > room


def _furniture(missing: Bools, near_others: Bools, room: Bools, walls: Bools, cell_m: float) -> Bools:
    """Return those pieces of what a room misses that are furniture by R5; ``near_others`` is in or at other rooms."""
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(missing.view(np.uint8), connectivity=4)
    fill = stats[:, cv2.CC_STAT_AREA] * cell_m**2 < SPACE_M2
    fill[0] = False
    fill[pieces[near_others]] = False
    if not fill.any():
        return np.zeros(missing.shape, bool)
    padded = np.ones((missing.shape[0] + 2, missing.shape[1] + 2), np.uint8)
    padded[1:-1, 1:-1] = missing
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, 5)[1:-1, 1:-1]
    deepest = np.zeros(count, depth.dtype)  # one type for all, or NumPy takes a hundred times as long
    cells = np.flatnonzero(missing)
    np.maximum.at(deepest, pieces.ravel()[cells].astype(np.intp), depth.ravel()[cells])
    deepest = deepest.astype(np.float64)
    fill &= (2 * deepest * cell_m < DEEPEST_M) & (2 * deepest * cell_m > PARTITION_M)
    fill &= ~_behind_walls(pieces, count, room, walls)
    return np.asarray(fill[pieces])


def _behind_walls(pieces: npt.NDArray[Any], count: int, room: Bools, walls: Bools) -> Bools:
    """Return which of some pieces (count,) of cells (rows, cols) lie behind a wall of the room."""
    around = cv2.dilate(pieces.astype(np.float32), np.ones((3, 3), np.uint8)).astype(np.int64)
    around[pieces > 0] = 0
    shares = []
    for side in (room, ~room):
        edge = around[side & (around > 0)]
        seen = around[side & walls & (around > 0)]
        shares.append(np.bincount(seen, minlength=count) - MOST * np.bincount(edge, minlength=count))
    return np.asarray((shares[0] > 0) & (shares[1] <= 0))


def _warp(mask: Bools, turn: npt.NDArray[np.float64], shape: tuple[int, ...]) -> Bools:
    flags = cv2.INTER_NEAREST
    return np.asarray(cv2.warpAffine(mask.astype(np.uint8), turn, (shape[1], shape[0]), flags=flags).view(bool))


def _sides(mask: Bools) -> tuple[int, int, int, int]:
    """Return the first and last row and the first and last column of a mask, without what sticks out."""
    found = []
    for every in (np.ascontiguousarray(mask.T), mask):  # columns say where the upper and lower sides are
        lines = every[every.any(axis=1)]
        first = lines.argmax(axis=1)
        last = lines.shape[1] - 1 - lines[:, ::-1].argmax(axis=1)
        # a room's side: so many of its rows or columns reach at least as far
        (low, _), (_, high) = np.quantile([first, last], (SCARCELY, 1 - SCARCELY), axis=1).T
        found += [int(low), int(high)]
    return found[0], found[1], found[2], found[3]
