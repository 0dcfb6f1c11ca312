"""Find the walls and doorways of a scan in its columns: masks on a raster, with holes closed, and their polygons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import buffer_mitred, drop_lines_and_points, subtract, unite
from pipeline.geometry.scan_columns import CUT_SPREAD_CELLS, Bools, Columns, Floats, Raster
from pipeline.tolerances import (
    AROUND_M,
    BLOCK_M,
    BLUR_PX,
    EDGE_BAND_M,
    HAND_M,
    HARDLY,
    HEAD_M,
    HOLE_M,
    MOST,
    PARTITION_M,
    RUN_M,
    SHEET_M,
    SINGLE_DOOR_M,
    SKEW,
    SLIVER_M,
    SOME,
    STANDS,
    STUB_M,
    THICK_WALL_M,
    THIN_WALL_M,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# Masks on a raster: grown, closed, opened, and the parts of them that meet something.
# ---------------------------------------------------------------------------------------------------------------------

Pixels = npt.NDArray[np.uint8]

SHEET = 3
"""The least width, cells, of a sheet that later steps keep."""


def square_kernel(cells: int) -> Pixels:
    """Return a square, ``cells`` wide, as the kernel of a filter."""
    return np.ones((cells, cells), np.uint8)


def line_kernel(angle: float, cells: int) -> Pixels:
    """Return a straight line, ``cells`` long, at ``angle`` radians, as the kernel of a filter."""
    half = (cells + 1) // 2
    x, y = (round(half * float(v)) for v in (np.cos(angle), np.sin(angle)))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    cv2.line(kernel, (half - x, half - y), (half + x, half + y), 1)
    return kernel


def grow_mask(mask: Bools, cells: int) -> Bools:
    """Return a mask grown by ``cells`` on each side."""
    return dilate_mask(mask, square_kernel(2 * cells + 1))


def dilate_mask(mask: Bools, kernel: Pixels) -> Bools:
    """Return a mask dilated by a kernel."""
    return np.asarray(cv2.dilate(mask.view(np.uint8), kernel).view(bool))


def close_mask(mask: Bools, cells: int) -> Bools:
    """Return a mask with its gaps narrower than ``cells`` filled (morphological closing)."""
    return np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_CLOSE, square_kernel(cells)).view(bool))


def open_mask(mask: Bools, kernel: Pixels) -> Bools:
    """Return a mask without the parts that a kernel does not fit into (morphological opening)."""
    return np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, kernel).view(bool))


def mostly_marked_parts(mask: Bools, marked: Bools, share: float) -> Bools:
    """Return the connected parts of a mask of which at least a share is ``marked``."""
    count, label = cv2.connectedComponents(mask.view(np.uint8), connectivity=8)
    kept = np.bincount(label[mask & marked], minlength=count) >= share * np.bincount(label[mask], minlength=count)
    return np.asarray(kept[label] & mask)


def parts_touching(mask: Bools, marked: Bools) -> Bools:
    """Return the connected parts of a mask that share a cell with another."""
    count, label = cv2.connectedComponents(mask.view(np.uint8), connectivity=8)
    kept = np.bincount(label[mask & marked], minlength=count) > 0
    return np.asarray(kept[label] & mask)


# ---------------------------------------------------------------------------------------------------------------------
# Holes in the walls of a scan, closed: a part of every scan is missing.
#
# R1  A hole between the end of a straight wall and another wall before that end is closed if it is short and has traces
#     of a wall, or if something stands below all along it. A hole at a corner of two walls is closed if something
#     stands below.
# R2  All steps are repeated until no hole is left, since a closed hole may end before another one. A passage has no
#     traces of a wall. A short hole may lack them too: where no ceiling was seen, it is closed in the end if it lies
#     before a free end of a wall. It stays open if that end meets a crossing wall, as beside a corridor.
# R3  The top of a short wall with a door may be missing entirely. It is closed if in one line between two walls stand
#     two jambs with a gap as wide as a door between them, or one jamb that faces the end of a wall in that line. Jambs
#     are as thick as walls, unlike leaves. No other wall may run close by, as behind the fronts of two cupboards.
# R4  Two walls at right angles that end before their corner go on to it if nothing was seen there, not even ground: a
#     scanner does not see every corner. In a passage there is ground.
# ---------------------------------------------------------------------------------------------------------------------

TURNS = 24
PASSES, FILLING = 6, 2
"""The first passes also fill what is rough."""
ALONGSIDE = 2
CORNER_M = 0.75
"""R4: the greatest distance from the end of a wall to its corner, metres."""
CLOSE_BY_M = 0.8
"""The depth of a deep cupboard: a wall runs at most this far behind its front, metres."""


def close_wall_holes(reaching: Bools, body: Bools, traces: Bools, raster: Raster, *, has_ceiling: bool) -> Bools:
    """Close the holes in ``reaching``, the cells that reach the top of the walls (R1 to R3).

    ``body`` has the cells where something stands below, ``traces`` those with faint signs of a wall.
    """
    untraced = has_ceiling
    for k in range(PASSES):  # R2
        found = _continue_runs(_between_jambs(reaching, body, raster), body, traces, raster)
        if k >= FILLING:
            found = reaching | _holes(found, reaching)
        if (found == reaching).all():
            if untraced:
                break
            untraced, found = True, reaching | _holes(_without_traces(reaching, raster), reaching)
        reaching = found
    return reaching


def _holes(found: Bools, reaching: Bools) -> Bools:
    """Return the newly closed parts, without those that lie along a wall: a wavy wall would grow with each pass."""
    return parts_touching(found & ~reaching, ~grow_mask(reaching, ALONGSIDE))


def _continue_runs(reaching: Bools, body: Bools, traces: Bools, raster: Raster) -> Bools:
    """Return the walls with straight runs continued to what stands before their ends, and to their corners."""
    below = grow_mask(body, 1)
    angles = np.pi * np.arange(TURNS) / TURNS
    runs = _runs(reaching, raster)
    found, beyond = reaching.copy(), []
    for turn, angle in enumerate(angles):
        if not runs[turn].any():
            beyond.append(runs[turn])
            continue
        ending = runs[turn] & ~_across(runs, turn)
        lanes = _gaps_in_line(reaching, ending, angle, raster.size(HOLE_M))
        found |= parts_touching(mostly_marked_parts(lanes, traces, HARDLY), grow_mask(ending, 1))
        lanes = _gaps_in_line(reaching, ending, angle, raster.size(BLOCK_M), below)
        found |= parts_touching(lanes, grow_mask(ending, 1))
        beyond.append(dilate_mask(ending, line_kernel(angle, raster.size(HOLE_M))) & below)
    for turn, going_on in enumerate(beyond):
        found |= going_on & _across(beyond, turn)
    return _as_sheets(found, reaching)


def _without_traces(reaching: Bools, raster: Raster) -> Bools:
    """Return the walls with short holes before their free ends closed, traces or not."""
    found = reaching.copy()
    for turn, run in enumerate(_runs(reaching, raster)):
        angle = np.pi * turn / TURNS
        crossing = open_mask(reaching, line_kernel(angle + np.pi / 2, raster.size(THICK_WALL_M)))
        ending = run & ~grow_mask(crossing, 2)
        if ending.any():
            found |= parts_touching(_gaps_in_line(reaching, ending, angle, raster.size(HOLE_M)), grow_mask(ending, 1))
    return _as_sheets(found, reaching)


def _runs(reaching: Bools, raster: Raster) -> list[Bools]:
    """Return the straight walls in each direction; runs inside a wavy wall along the raster are not oblique walls."""
    wavy = grow_mask(reaching, 2)
    long = raster.size(HOLE_M)
    straight = wavy & grow_mask(
        open_mask(wavy, line_kernel(0.0, long)) | open_mask(wavy, line_kernel(np.pi / 2, long)), 1
    )
    found = []
    for turn in range(TURNS):
        oblique = turn % (TURNS // 2) != 0
        run = open_mask(reaching, line_kernel(np.pi * turn / TURNS, raster.size(HOLE_M if oblique else RUN_M)))
        found.append(run & ~straight if oblique else run)
    return found


def _gaps_in_line(reaching: Bools, ending: Bools, angle: float, cells: int, within: Bools | None = None) -> Bools:
    """Return the gaps of at most ``cells`` between two walls, at ``angle`` radians, beyond the end of a run."""
    hole = line_kernel(angle, cells)
    gaps = cv2.morphologyEx(reaching.view(np.uint8), cv2.MORPH_CLOSE, hole).view(bool) & ~reaching
    if within is not None:
        gaps &= within
    return np.asarray(gaps & dilate_mask(ending, line_kernel(angle, 2 * cells)))


def _as_sheets(found: Bools, reaching: Bools) -> Bools:
    """Return the found cells beyond ``reaching``, widened to the width of the walls seen."""
    thin = found & ~reaching & ~open_mask(found, square_kernel(SHEET))
    return found | grow_mask(thin, CUT_SPREAD_CELLS)


def _across(by_turn: list[Bools], turn: int) -> Bools:
    """Return the cells of the directions that cross direction ``turn``."""
    return np.asarray(
        np.logical_or.reduce([by_turn[(turn + k) % TURNS] for k in range(TURNS // 3, 2 * TURNS // 3 + 1)])
    )


def add_unseen_corners(reaching: Bools, unseen: Bools, raster: Raster) -> Bools:
    """Continue walls to the corners that were not seen (R4); ``unseen`` is where the scan holds nothing."""
    runs, cells = _runs(reaching, raster), raster.size(CORNER_M)
    open_ = grow_mask(unseen, raster.size(HAND_M)) & ~reaching  # ground is drawn wider than it was seen
    arms: list[Bools] = []
    for turn, run in enumerate(runs):
        ending = run & ~_across(runs, turn)
        beyond = dilate_mask(ending, line_kernel(np.pi * turn / TURNS, 2 * cells)) & open_
        arms.append(parts_touching(beyond, grow_mask(ending, 1)) if beyond.any() else beyond)
    found = reaching.copy()
    for turn, arm in enumerate(arms):
        corners = arm & arms[(turn + TURNS // 2) % TURNS]
        if corners.any():
            lanes = line_kernel(np.pi * turn / TURNS, cells)
            closed = cv2.morphologyEx((reaching | corners).view(np.uint8), cv2.MORPH_CLOSE, lanes).view(bool)
            found |= corners | parts_touching(closed & arm, corners)
    return _as_sheets(found, reaching)


def _between_jambs(reaching: Bools, body: Bools, raster: Raster) -> Bools:
    """Close the tops of doors in short walls: two jambs in one line, or a jamb that faces the end of a wall."""
    found = reaching.copy()
    for walls, standing, marked in ((reaching, body, found), (reaching.T, body.T, found.T)):
        beside = _close_by(walls, raster)
        for row, first, last in _short_walls(walls, standing, raster):
            if beside[row, first:last].mean() < MOST:
                marked[row, first:last] = True
    return _as_sheets(found, reaching)


def _close_by(walls: Bools, raster: Raster) -> Bools:
    """Return where a wall lies beside, above or below in the raster, as close as the wall behind a cupboard."""
    near, far = (raster.size(m) for m in (WALL_M, CLOSE_BY_M))
    reach = np.zeros((2 * far + 1, 1), np.uint8)
    reach[: far - near] = reach[far + near + 1 :] = 1
    return dilate_mask(walls, reach)


def _short_walls(walls: Bools, standing: Bools, raster: Raster) -> Iterator[tuple[int, int, int]]:
    """Yield (row, first cell, cell after the last) where two jambs stand between two walls."""
    least, most = (raster.size(m) for m in SINGLE_DOOR_M)
    jamb, longest = raster.size(HAND_M), raster.size(BLOCK_M)
    in_line = open_mask(np.ascontiguousarray(walls), line_kernel(0.0, raster.size(RUN_M)))
    thin, thick = (raster.size(m) for m in (THIN_WALL_M, WALL_M))
    solid = open_mask(close_mask(np.ascontiguousarray(walls | standing), thick), square_kernel(thin))
    for row in np.flatnonzero((standing & ~walls).any(axis=1)):
        at = np.flatnonzero(walls[row])
        for k in np.flatnonzero((np.diff(at) > least + jamb) & (np.diff(at) <= longest)):
            first, last = int(at[k]) + 1, int(at[k + 1])
            gap = _gap(standing[row, first:last])
            if gap is None or not least <= gap[1] - gap[0] <= most:
                continue
            parts = solid[row, first : first + gap[0]], solid[row, first + gap[1] : last]
            jambs = [len(part) >= jamb and part.mean() > MOST for part in parts]
            ends = in_line[row, first - 1], in_line[row, last]
            if all(jambs) or (jambs[0] and ends[1]) or (jambs[1] and ends[0]):
                yield int(row), first, last


def _gap(standing: npt.NDArray[np.bool_]) -> tuple[int, int] | None:
    """Return where the gap in what stands begins and ends, or None unless there is exactly one."""
    free = np.flatnonzero(~standing)
    if not len(free) or free[-1] - free[0] + 1 != len(free):
        return None
    return int(free[0]), int(free[-1]) + 1


# ---------------------------------------------------------------------------------------------------------------------
# Walls and the free places in them, from the columns of a scan: masks on its raster.
#
# R1  What reaches the top of the walls, above doors, furniture and open leaves, is wall or hangs over a doorway.
# R2  A part of every scan is missing: holes in the walls are closed, as above.
# R3  Two faces at most a wall's thickness apart are the two sides of one wall.
# R4  An outer wall surrounds the inside, also where none was seen. A stretch of it longer than a hole, where nothing
#     was seen standing, is not a wall but the edge of the scan (``open_edge``): the room goes on there.
# R5  A region between walls without ground is filled, as it is not a room, if the scan has ground elsewhere. A region
#     with hardly a wall along its edge, other than the largest, is filled too: a scanner saw it through a window or a
#     door.
# R6  A doorway is a place in a wall where nothing stands from the floor to head height, as long as a door is wide, with
#     air of the house on both sides. A window or a door to the outside has no such air behind it.
# ---------------------------------------------------------------------------------------------------------------------

ABOVE_DOORS_M = 2.2
"""In a high house, more of the wall can be looked at above all doors."""
BEFORE = 4
"""So many cells before a wall its air is looked at."""


@dataclass(frozen=True, eq=False)
class WallMasks:
    """``walls`` (rows, columns) with all doorways closed, and the ``doorways``: rectangles (4, 2) of pixels (x, y).

    ``open_edge`` (rows, columns) is the part of ``walls`` at which only what was seen ends (R4).
    """

    raster: Raster
    walls: Bools
    doorways: tuple[Floats, ...]
    open_edge: Bools


def wall_top_height(columns: Columns) -> float:
    """Return the height, metres, up to which walls stand: above it, far fewer cells are marked than halfway up."""
    amount = columns.amount
    middle = np.median(amount[columns.heights < HEAD_M]) if len(amount) else 0.0
    high = columns.heights[amount > STANDS * middle]
    return float(high.max()) if len(high) else 0.0


def find_wall_masks(columns: Columns) -> WallMasks:
    """Return the walls of a scan and the doorways in them, from what its columns hold at which height."""
    raster, top = columns.raster, columns.ceiling_m or wall_top_height(columns) - SLIVER_M
    body = columns.share(EDGE_BAND_M, HEAD_M)
    seen_m = max(top - EDGE_BAND_M, min(HEAD_M, top - SLIVER_M))
    lowest = seen_m if columns.ceiling_m is None else top - HAND_M  # a lintel may be as low
    high = columns.share(lowest, top) >= MOST
    if lowest > ABOVE_DOORS_M:
        high |= columns.share(max(top - STUB_M, ABOVE_DOORS_M), top) >= MOST
    reaching = _without_specks(high, raster)  # R1
    seen = (body >= HARDLY) | (columns.share(lowest, top) > 0)
    reaching = close_wall_holes(reaching, body >= STANDS, seen, raster, has_ceiling=columns.ceiling_m is not None)  # R2
    inside = columns.ground | (body >= STANDS)
    thick = close_mask(reaching, raster.size(WALL_M))  # R3
    outside = _outside(thick | inside, raster)
    whole = (
        add_unseen_corners(reaching, ~inside, raster) if _has_ground(~(thick | outside), columns) else reaching
    )  # R2
    if not np.array_equal(whole, reaching):
        thick = close_mask(whole, raster.size(WALL_M))
        outside = _outside(thick | inside, raster)
    band = outside & grow_mask(~outside, raster.size(PARTITION_M))  # R4
    house = close_mask(thick | band, raster.size(WALL_M))
    air = ~(house | outside)
    solid = house | _unseen_cells(air, columns) | _regions_without_walls(air, thick)  # R5
    standing = close_mask((body >= HARDLY) & thick, raster.size(WALL_M)) & thick
    behind = grow_mask(standing, raster.size(PARTITION_M)) & solid & ~thick
    free = solid & ~(standing | behind)
    walls = _shrink(solid)
    beside = grow_mask(~(solid | outside), raster.size(PARTITION_M) + BEFORE)
    open_edge = _open_edge(band & walls & beside, thick, columns)  # R4
    return WallMasks(raster, walls, _doorways(free & walls, ~(walls | outside), raster), open_edge)  # R6


def _without_specks(mask: Bools, raster: Raster) -> Bools:
    """Return a mask without the parts shorter than any wall."""
    count, label, boxes, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    long = np.maximum(boxes[:, cv2.CC_STAT_WIDTH], boxes[:, cv2.CC_STAT_HEIGHT]) >= raster.size(RUN_M)
    long[0] = False
    return np.asarray(long[label]) if count else mask


def _outside(inside: Bools, raster: Raster) -> Bools:
    """Return the air around the house, entered through nothing that is narrower than ``AROUND_M``."""
    half = raster.size(AROUND_M / 2)
    air = (~grow_mask(inside, half)).view(np.uint8)
    _, label = cv2.connectedComponents(np.pad(air, 1, constant_values=1), connectivity=4)
    around = (label == label[0, 0])[1:-1, 1:-1]
    return grow_mask(around, half) & ~inside


def _open_edge(band: Bools, walls: Bools, columns: Columns) -> Bools:
    """Return the parts of the band around the house that are longer than a hole and have nothing standing near.

    Neighbouring cells count together: in a wall that was hardly seen, each cell has other heights.
    """
    raster = columns.raster
    far = raster.size(PARTITION_M) + BEFORE
    bare = _longer_than_a_hole(band & ~grow_mask(walls, far), raster)
    if not bare.any():
        return bare
    body = columns.stands[(columns.heights >= EDGE_BAND_M) & (columns.heights <= HEAD_M)]
    beside = [grow_mask(layer, CUT_SPREAD_CELLS) for layer in body]
    standing = _without_specks(np.asarray(np.mean(beside, axis=0, dtype=np.float32) >= STANDS), raster)
    return _longer_than_a_hole(bare & ~grow_mask(standing, far), raster)


def _longer_than_a_hole(mask: Bools, raster: Raster) -> Bools:
    """Return the connected parts of a mask that are longer than a hole in a wall."""
    _, label, boxes, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    long = np.maximum(boxes[:, cv2.CC_STAT_WIDTH], boxes[:, cv2.CC_STAT_HEIGHT]) > raster.size(HOLE_M)
    long[0] = False
    return np.asarray(long[label])


def _has_ground(air: Bools, columns: Columns) -> bool:
    """Return whether so much ground was seen under the air that missing ground means something."""
    return bool(air.any() and columns.ground[air].mean() >= SOME)


def _unseen_cells(air: Bools, columns: Columns) -> Bools:
    """Return the regions without ground; nothing if the scan has little ground at all."""
    import scipy.ndimage

    if not _has_ground(air, columns):
        return np.zeros_like(air)
    count, label = cv2.connectedComponents(air.view(np.uint8), connectivity=4)
    share = scipy.ndimage.mean(columns.ground, label, np.arange(count))
    hidden = np.asarray(share) < SOME
    hidden[0] = False
    return np.asarray(hidden[label])


def _regions_without_walls(air: Bools, walls: Bools) -> Bools:
    """Return all regions but the largest that have walls along less than ``SOME`` of their edge."""
    count, label, boxes, _ = cv2.connectedComponentsWithStats(air.view(np.uint8), connectivity=4)
    found, margin = np.zeros_like(air), 2 * CUT_SPREAD_CELLS
    largest = 1 + int(np.argmax(boxes[1:, cv2.CC_STAT_AREA])) if count > 1 else 0
    for k in range(1, count):
        x, y, w, h = (int(v) for v in boxes[k, :4])
        window = np.s_[max(y - margin, 0) : y + h + margin, max(x - margin, 0) : x + w + margin]
        region = label[window] == k
        edge = grow_mask(region, margin) & ~region
        if k != largest and walls[window][edge].mean() < SOME:
            found[window] |= region
    return found


def _shrink(solid: Bools) -> Bools:
    """Return the walls, shrunk by the cells that noise and raster added; a sheet that would vanish is kept."""
    core = open_mask(
        cv2.erode(solid.view(np.uint8), square_kernel(2 * CUT_SPREAD_CELLS + 1)).view(bool), square_kernel(SHEET)
    ).view(bool)
    return core | (solid & ~grow_mask(core, CUT_SPREAD_CELLS + 1))


def _doorways(free: Bools, air: Bools, raster: Raster) -> tuple[Floats, ...]:
    """Return the places in walls, as long as doors, where nothing stands up to head height, with air on both sides."""
    count, label, boxes, _ = cv2.connectedComponentsWithStats(free.view(np.uint8), connectivity=4)
    found = []
    for k in range(1, count):
        x, y, w, h, pixels = (int(v) for v in boxes[k])
        if max(w, h) < raster.size(STUB_M):
            continue
        box = _box(np.argwhere(label[y : y + h, x : x + w] == k)[:, ::-1] + (x, y), pixels)
        if all(_share(air, side) > MOST for side in _sides(box)):
            found.append(_stretch_to_jambs(box))
    return tuple(found)


def _box(points: npt.NDArray[np.int64], pixels: int) -> Floats:
    """Return a rectangle (4, 2) around pixels, long side first: along the raster if they fill that, else the least."""
    low, high = points.min(axis=0), points.max(axis=0)
    (x1, y1), (x2, y2) = low, high
    box = np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]], float)
    if pixels < MOST * np.prod(high - low + 1):
        box = np.asarray(cv2.boxPoints(cv2.minAreaRect(points.astype(np.float32))), float)
    return box if np.hypot(*(box[1] - box[0])) >= np.hypot(*(box[2] - box[1])) else np.roll(box, -1, axis=0)


def _sides(box: Floats) -> tuple[Floats, Floats]:
    """Return the middle lines (2, 2) of what lies before each long side."""
    across = box[3] - box[0]
    off = BEFORE * across / max(float(np.hypot(*across)), 1e-9) if across.any() else np.array([0.0, BEFORE])
    return box[:2] - off, box[2:] + off


def _share(mask: Bools, line: Floats) -> float:
    """Return the share of a line that lies in a mask."""
    points = np.round(np.linspace(line[0], line[1], 20)).astype(int)
    rows, columns = np.clip(points[:, 1], 0, mask.shape[0] - 1), np.clip(points[:, 0], 0, mask.shape[1] - 1)
    return float(mask[rows, columns].mean())


def _stretch_to_jambs(box: Floats) -> Floats:
    """Return a doorway's box from jamb to jamb, without the spread of the faces, and deeper for a wall that bulges."""
    centre = box.mean(axis=0)
    along, across = box[1] - box[0], box[3] - box[0]
    length, depth = float(np.hypot(*along)), float(np.hypot(*across))
    along /= length
    across = np.array([-along[1], along[0]])
    half_along, half_across = along * (length / 2 + CUT_SPREAD_CELLS), across * (depth / 2 + 2 * CUT_SPREAD_CELLS)
    return np.array([centre + i * half_along + j * half_across for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


# ---------------------------------------------------------------------------------------------------------------------
# Masks on a raster as areas with few, straight edges.
# ---------------------------------------------------------------------------------------------------------------------

CONTOUR_ROUGH_M = 0.045
"""Contours are drawn with as few corners as this allows."""
EDGE = 0.25
"""Cells by which a contour through the middles of cells lies inside the mask's edge."""


def mask_to_area(mask: Bools, raster: Raster) -> BaseGeometry:
    """A mask as an area in the level frame."""
    smooth = cv2.medianBlur(mask.view(np.uint8) * 255, BLUR_PX)
    contours, tree = cv2.findContours(smooth, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    shapes = []
    for k, contour in enumerate(contours):
        if tree[0][k][3] >= 0:
            continue
        holes, child = [], int(tree[0][k][2])
        while child >= 0:
            holes.append(_ring(np.asarray(contours[child][:, 0], float), raster))
            child = int(tree[0][child][0])
        ring = _ring(np.asarray(contour[:, 0], float), raster)
        if len(ring) >= 3:
            inner = [shapely.make_valid(Polygon(hole)) for hole in holes if len(hole) >= 3]
            shapes.append(subtract(shapely.make_valid(Polygon(ring)), unite(inner)))
    pixels = buffer_mitred(buffer_mitred(unite(shapes), 0.5), EDGE - 0.5)
    return drop_lines_and_points(shapely.transform(pixels, raster.level_points))


def _ring(points: Floats, raster: Raster) -> Floats:
    """Return the corners of a contour (n, 2), its edges along the raster where they nearly are."""
    loose = CONTOUR_ROUGH_M / raster.cell_m
    corners = cv2.approxPolyDP(points.astype(np.int32)[:, None], loose, closed=True)[:, 0].astype(float)
    return (
        _square_edges(_sharpen_corners(corners, THIN_WALL_M / raster.cell_m), SHEET_M / raster.cell_m)
        if len(corners) >= 3
        else corners
    )


def _sharpen_corners(corners: Floats, longest: float) -> Floats:
    """Replace each short edge between a level and an upright edge by their corner, which noise has cut off."""
    d = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(*d.T)
    level, upright = np.abs(d[:, 1]) <= SKEW * np.abs(d[:, 0]), np.abs(d[:, 0]) <= SKEW * np.abs(d[:, 1])
    found: list[Floats] = []
    last_cut = False
    for k in range(-1, len(corners)):
        came, goes = k - 1, (k + 1) % len(corners)
        turns = (level[came] and upright[goes]) or (upright[came] and level[goes])
        is_cut = bool(turns and length[k] < min(longest, length[came], length[goes]) and not (level[k] or upright[k]))
        if is_cut and k >= 0:
            p, q = corners[k], corners[goes]
            found.append(np.array([q[0], p[1]] if level[came] else [p[0], q[1]]))
        elif k >= 0 and not last_cut:
            found.append(corners[k])
        last_cut = is_cut
    return np.array(found)


def _square_edges(corners: Floats, slack: float) -> Floats:
    """Return a ring in which each nearly level or upright edge is exactly so, at the mean of its ends."""
    ends = np.roll(corners, -1, axis=0)
    d = np.abs(ends - corners)
    level = (d[:, 1] <= SKEW * d[:, 0]) & (d[:, 1] <= 2 * slack)
    upright = (d[:, 0] <= SKEW * d[:, 1]) & (d[:, 0] <= 2 * slack) & ~level
    middle = (corners + ends) / 2
    found: list[Floats] = []
    for k, corner in enumerate(corners):
        came = k - 1
        into, out = corner.copy(), corner.copy()
        for axis, lies in ((1, level), (0, upright)):
            if lies[came]:
                into[axis] = middle[came, axis]
            if lies[k]:
                out[axis] = middle[k, axis]
        if level[came] and upright[k]:
            found.append(np.array([middle[k, 0], middle[came, 1]]))
        elif upright[came] and level[k]:
            found.append(np.array([middle[came, 0], middle[k, 1]]))
        elif (into == out).all() or not (level[came] | upright[came]):
            found.append(out)
        else:
            found += [into, out]
    return np.array(found)
