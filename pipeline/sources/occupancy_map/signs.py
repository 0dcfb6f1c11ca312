"""Measure what the cells of a map say against its plan: grounds of the plan's quality that only maps have, 0 to 1.

Only the finished rooms and doorways, and the map's own cells count. So it does not matter how the rooms were found.

S1  ``half_seen_rooms``: the share of the rooms of whose edge more than ``FEW`` shows no wall: no occupied cell is
    ``PARTITION_M`` or nearer. Doorways do not count. Such a room ends where the robot saw no further.
S2  ``beyond_rooms``: what the map shows and the plan lacks: the share of the free cells ``PARTITION_M`` or farther from
    the rooms, or that of the occupied cells ``PLACE_M`` or farther from them, whichever is more. Free cells
    that reach the picture's border without a room between are the ground outside, or a margin. What is solid
    over twice ``PLACE_M`` both ways is a block (a chimney, a bed, ground that is drawn filled), and no wall.
S3  ``ragged_room``: how much of its convex hull the most ragged room lacks. Several rooms that are one, and what fans
    of rays have drawn, are ragged.
S4  ``free_wall``: how long the longest piece of occupied cells is that stands in a room, away from its edge, as a
    share of the way from ``FREE_WALL_M[0]`` to ``FREE_WALL_M[1]``. Furniture is seldom so long; walls that stand free
    make a room of several, a maze or a ground with obstacles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.sources.occupancy_map.narrow_places import Bools
from pipeline.sources.occupancy_map.rooms import MOST_CELLS
from pipeline.sources.tolerances import FEW
from pipeline.tolerances import PARTITION_M, PLACE_M, THIN_WALL_M

FREE_WALL_M: Final = (1.0, 4.0)
_SUBPIXEL: Final = 8


def measure_signs(
    free: Bools, occupied: Bools, cell_m: float, rooms: Sequence[Polygon], doorways: Sequence[Polygon]
) -> dict[str, float]:
    """Return the grounds by name, each 0 to 1, in four digits.

    Parameters
    ----------
    free, occupied
        (rows, cols), row 0 at the highest y, cells ``cell_m`` metres wide.
    rooms, doorways
        Those of the plan, metres from the lower-left corner of the cells, y up.
    """
    scale = int(np.ceil(np.sqrt(free.size / MOST_CELLS)))
    height_m = free.shape[0] * cell_m
    cells = _Cells(_blocks(occupied, scale), cell_m * scale, height_m)
    seen_free = _blocks(free, scale) & ~cells.occupied
    inside = cells.drawn([*rooms, *doorways])
    found = {
        "half_seen_rooms": _half_seen(cells, rooms, doorways),
        "beyond_rooms": _beyond(cells, seen_free, inside),
        "ragged_room": max((1.0 - room.area / room.convex_hull.area for room in rooms), default=0.0),
        "free_wall": _free_wall(cells, inside),
    }
    return {name: round(float(value), 4) for name, value in found.items()}


class _Cells:
    """The occupied cells of a map, ``cell_m`` wide, (rows, cols); its upper edge lies at ``height_m``."""

    def __init__(self, occupied: Bools, cell_m: float, height_m: float) -> None:
        self.occupied, self.cell_m, self.height_m = occupied, cell_m, height_m

    def drawn(self, shapes: Sequence[Polygon]) -> Bools:
        """Return which cells lie in one of the shapes."""
        pixels = np.zeros(self.occupied.shape, np.uint8)
        for shape in shapes:
            rings = [self._pixels(ring) for ring in (shape.exterior, *shape.interiors)]
            cv2.fillPoly(pixels, rings, 1, shift=_SUBPIXEL)
        return pixels.view(bool)

    def _pixels(self, ring: shapely.LinearRing) -> npt.NDArray[np.int32]:
        x, y = shapely.get_coordinates(ring).T
        across_down = np.stack([x, self.height_m - y], axis=1) / self.cell_m - 0.5
        return np.asarray(np.round(across_down * 2**_SUBPIXEL), np.int32)

    def at(self, cells: Bools, points: npt.NDArray[np.float64]) -> Bools:
        """Return what cells (rows, cols) have at points (n, 2), metres."""
        rows, cols = cells.shape
        col = (points[:, 0] / self.cell_m).astype(np.int64).clip(0, cols - 1)
        row = ((self.height_m - points[:, 1]) / self.cell_m).astype(np.int64).clip(0, rows - 1)
        return np.asarray(cells[row, col])

    def grown(self, cells: Bools, by_m: float) -> Bools:
        """Return cells (rows, cols) grown by a distance."""
        return _dilate(cells, by_m / self.cell_m)


def _half_seen(cells: _Cells, rooms: Sequence[Polygon], doorways: Sequence[Polygon]) -> float:
    """S1."""
    if not rooms:
        return 0.0
    walls = cells.grown(cells.occupied, PARTITION_M)
    ways = cells.grown(cells.drawn(doorways), THIN_WALL_M)
    few = 0
    for room in rooms:
        points = np.concatenate([_along(ring, cells.cell_m) for ring in (room.exterior, *room.interiors)])
        at_wall = cells.at(walls, points)[~cells.at(ways, points)]
        few += bool(len(at_wall)) and float((~at_wall).mean()) > FEW
    return few / len(rooms)


def _along(ring: shapely.LinearRing, step_m: float) -> npt.NDArray[np.float64]:
    """Return points (n, 2) along a ring, a step apart."""
    places = np.arange(0.0, ring.length, step_m)
    return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(ring, places)))


def _beyond(cells: _Cells, free: Bools, inside: Bools) -> float:
    """S2."""
    lost = free & ~cells.grown(inside, PARTITION_M)
    _, pieces = cv2.connectedComponents(lost.view(np.uint8), connectivity=4)
    border = np.unique(np.concatenate([pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1]]))
    lost &= ~np.isin(pieces, border)
    side = 2 * max(round(PLACE_M / cells.cell_m), 1) + 1
    blocks = cv2.morphologyEx(cells.occupied.view(np.uint8), cv2.MORPH_OPEN, np.ones((side, side), np.uint8))
    walls = cells.occupied & ~blocks.view(bool)
    far = walls & ~cells.grown(inside, PLACE_M)
    return max(_share(lost, free), _share(far, walls))


def _share(part: Bools, whole: Bools) -> float:
    return float(part.sum()) / max(float(whole.sum()), 1.0)


def _free_wall(cells: _Cells, inside: Bools) -> float:
    """S4."""
    deep = ~cells.grown(np.pad(~inside, 1, constant_values=True), THIN_WALL_M)[1:-1, 1:-1]
    _, _, stats, _ = cv2.connectedComponentsWithStats((cells.occupied & deep).view(np.uint8), connectivity=8)
    sides = stats[1:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]]
    least, most = FREE_WALL_M
    longest = float(sides.max(initial=0)) * cells.cell_m
    return float(np.clip((longest - least) / (most - least), 0.0, 1.0))


def _dilate(cells: Bools, by: float) -> Bools:
    reach = 2 * max(round(by), 1) + 1
    return np.asarray(cv2.dilate(cells.view(np.uint8), np.ones((reach, reach), np.uint8)).view(bool))


def _blocks(cells: npt.NDArray[Any], scale: int) -> Bools:
    """Return which blocks of ``scale`` x ``scale`` cells have one that is true; the last may be smaller."""
    if scale == 1:
        return np.ascontiguousarray(cells, bool)
    rows, cols = (-(-side // scale) * scale for side in cells.shape)
    whole = np.zeros((rows, cols), bool)
    whole[: cells.shape[0], : cells.shape[1]] = cells
    return np.asarray(whole.reshape(rows // scale, scale, cols // scale, scale).any(axis=(1, 3)))
