"""Make the ground truth of a plan as rasters: occupied cells, where the robot can stand, what it can see from there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame, check_not_too_coarse
from houseexpo.grids.raster import free_mask
from houseexpo.pseudoslam.kernels.body_tracks import Tracks, no_tracks
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.placement import count_before_rows
from houseexpo.pseudoslam.kernels.planning.fields import FlowField, no_flow_field
from houseexpo.pseudoslam.kernels.planning.goal_paths import CornerGraph, make_corner_graph
from houseexpo.pseudoslam.kernels.sensing.visibility import (
    find_nearest_standing_cells,
    mark_seen_from_nearest,
    mark_visible_cells,
)
from houseexpo.pseudoslam.kernels.tolerances import FREE_HALF_PX, GOAL_LINE_M
from houseexpo.pseudoslam.kernels.types import Offsets

MAX_WORLD_CELLS = 100_000_000
"""Largest number of cells of a grid; making a world takes about 30 bytes per cell."""
_NO_OFFSETS = np.empty((0, 2), np.int16)

Cells = npt.NDArray[np.uint8]
Buffers: TypeAlias = tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.float64]]


class GoalRegion(NamedTuple):
    """Where goals of a kind are, (rows, cols) uint8.

    ``inside`` is 1 for cells where a robot has reached one, as far as it can stand there. ``marked`` is 1 for the cells
    by which it is seen: the floor of rooms, the footprints of furniture.
    """

    inside: Cells
    marked: Cells


@dataclass(frozen=True, eq=False)
class World:
    """One house for one robot; arrays are (rows, cols) uint8, row 0 at the highest y, and read-only.

    Parameters
    ----------
    frame
        The position of the grid in the plan.
    occupied
        1 in walls, obstacles and outside, including the border.
    traversable
        1 if the robot can stand at the centre of the cell and go to all other such cells.
    observable
        1 for free cells whose centre can be seen from the centre of a traversable cell, which coverage counts.
    tracks
        The trajectories of moving shapes, if there are any.
    flow
        The paths of people to the rooms, if there are any.
    margin_px
        Width of the margin for what noise moves out of the house (``worlds.cache``), cells.
    regions
        The regions of goals by their kind of room or furniture (``worlds.goal_regions``), if there are any.
    labels
        With ``regions``: 1 plus the place in ``LABELS`` of the room of each cell, 0 for no room with a label.
    """

    plan_id: str
    frame: GridFrame
    occupied: Cells
    traversable: Cells
    observable: Cells
    tracks: Tracks = field(default_factory=no_tracks)
    flow: FlowField = field(default_factory=no_flow_field)
    margin_px: int = 0
    regions: Mapping[str, GoalRegion] = field(default_factory=dict)
    labels: Cells = field(default_factory=lambda: np.empty((0, 0), np.uint8))

    @cached_property
    def observable_cells(self) -> int:
        """The number of cells that coverage counts."""
        return int(np.count_nonzero(self.observable))

    @property
    def inside_margin(self) -> tuple[slice, slice]:
        """The rows and columns of the house, without the margin."""
        rows, cols = self.occupied.shape
        return slice(self.margin_px, rows - self.margin_px), slice(self.margin_px, cols - self.margin_px)

    @cached_property
    def unknown(self) -> Cells:
        """The empty map (rows, cols), all 0, read-only."""
        unknown = np.zeros_like(self.occupied)
        unknown.flags.writeable = False
        return unknown

    @cached_property
    def known(self) -> Cells:
        """The complete map (rows, cols) without obstacles, read-only."""
        known = self.map_of(self.occupied)
        known.flags.writeable = False
        return known

    def map_of(self, occupied: Cells) -> Cells:
        """Return the complete map (rows, cols) of these occupied cells; the margin is unknown."""
        found, house = np.zeros_like(occupied), self.inside_margin
        found[house] = np.where(occupied[house], np.uint8(OBSTACLE), np.uint8(FREE))
        return found

    @cached_property
    def corner_m(self) -> tuple[float, float]:
        """The upper left corner of the first cell, (x, y) in the plan's metres."""
        x, y = self.frame.points_from_pixels([0.0, 0.0]).tolist()
        return x, y

    @cached_property
    def nearest(self) -> Offsets:
        """Offsets (cells, 2) from observable cells to an approximately nearest standing cell."""
        nearest = np.empty((self.occupied.size, 2), np.int16)
        asked, visible = np.empty(self.occupied.size, np.int32), np.empty_like(self.occupied)
        traversable, observable = (
            self.traversable.copy(),
            self.observable.copy(),
        )  # or the kernel is compiled again for read-only arrays
        find_nearest_standing_cells(traversable, observable, _NO_OFFSETS, 0.0, asked, nearest, visible)
        return nearest

    @cached_property
    def free_before(self) -> npt.NDArray[np.int64]:
        """``count_before_rows`` of the free cells."""
        return count_before_rows(self.occupied, 0)

    @cached_property
    def traversable_before(self) -> npt.NDArray[np.int64]:
        """``count_before_rows`` of the standing cells."""
        return count_before_rows(self.traversable, 1)

    @cached_property
    def _corner_graphs(self) -> dict[float, CornerGraph]:
        return {}

    def corner_graph(self, radius_px: float) -> CornerGraph:
        """Return the corners round which the robot's paths to a goal lead, the same for all goals."""
        if radius_px not in self._corner_graphs:
            self._corner_graphs[radius_px] = make_corner_graph(
                self.traversable.copy(),  # kernels are compiled again for read-only arrays
                self.occupied.copy(),
                radius_px,
                GOAL_LINE_M * self.frame.pixels_per_metre,
            )
        return self._corner_graphs[radius_px]


def make_world(plan: FloorPlan, pixels_per_metre: float, robot_radius_m: float, range_m: float) -> World:
    """Rasterise a plan by cell centres, and find where a robot of this size can go and what it can see from there.

    Raises
    ------
    ConfigError
        The grid would have more than ``MAX_WORLD_CELLS`` cells, the plan would be smaller than a few of them, or the
        robot does not fit anywhere.
    PlanError
        The plan has no free cell.
    """
    x1, y1, x2, y2 = plan.bbox
    cells = (x2 - x1) * (y2 - y1) * pixels_per_metre**2
    if cells > MAX_WORLD_CELLS:
        raise ConfigError(
            f"pixels_per_metre: {pixels_per_metre:g} makes {cells:.2g} cells of plan {plan.id!r} "
            f"({x2 - x1:.0f} x {y2 - y1:.0f} m), at most {MAX_WORLD_CELLS:.0e} are possible; use a coarser grid"
        )
    check_not_too_coarse(plan.bbox, pixels_per_metre, plan.id)
    free, frame = free_mask(plan, pixels_per_metre, y_up=True)
    if not free.any():
        found = f"found no free cell at {pixels_per_metre:g} px/m"
        raise PlanError(f"expected free space, {found}; use a finer grid or another plan", "verts", plan.id)
    return make_world_from_raster((~free).view(np.uint8), frame, robot_radius_m, range_m, plan.id)


def make_world_from_raster(
    occupied: Cells, frame: GridFrame, robot_radius_m: float, range_m: float, plan_id: str
) -> World:
    """Return the world of a raster whose border is occupied; raise ConfigError if the robot does not fit anywhere."""
    ppm = frame.pixels_per_metre
    traversable = traversable_cells(occupied, robot_radius_m * ppm)
    if not traversable.any():
        raise ConfigError(
            f"robot.radius_m: a robot of radius {robot_radius_m:g} m fits nowhere in plan {plan_id!r} "
            f"at {ppm:g} px/m; use a smaller robot or another plan"
        )
    world = World(
        plan_id,
        frame,
        occupied,
        traversable,
        find_observable_cells(occupied, traversable, robot_radius_m * ppm, range_m * ppm),
    )
    for array in (world.occupied, world.traversable, world.observable):
        array.flags.writeable = False
    return world


def find_observable_cells(
    occupied: Cells,
    traversable: Cells,
    radius_px: float,
    range_px: float,
    *,
    buffers: Buffers | None = None,
    empty: World | None = None,
) -> Cells:
    """Return 1 for free cells whose centre is visible within range from the centre of a standing cell.

    Most cells see a standing cell close to them. Only the others, in corners and behind gaps, need a search.

    Parameters
    ----------
    buffers
        The result of ``new_scan_buffers``, if there is one already.
    empty
        The house without obstacles, if there is one: cells that are not visible in it are not visible now, and its
        nearest standing cells are still valid for most cells.
    """
    wanted = (
        (empty.observable > occupied).view(np.uint8)
        if empty
        else free_pieces_with_standing_cells(traversable, occupied)
    )
    before, sure_px = empty.nearest if empty else _NO_OFFSETS, min(radius_px + FREE_HALF_PX, range_px)
    asked, away = np.empty(occupied.size, np.int32), np.empty((occupied.size, 2), np.int16)
    visible = traversable.copy()
    n_asked = find_nearest_standing_cells(traversable, wanted, before, sure_px, asked, away, visible)
    n_asked = mark_seen_from_nearest(occupied, asked, n_asked, away, sure_px, range_px, visible)
    runs, hit, slopes = buffers or new_scan_buffers(range_px)
    mark_visible_cells(occupied, traversable, asked, n_asked, away, sure_px, range_px, visible, runs, hit, slopes)
    return visible


def new_scan_buffers(range_px: float) -> Buffers:
    """Return memory for the runs of free cells, the obstacles and the slopes of a sector scan."""
    side = 2 * math.ceil(range_px) + 5
    return np.empty((side * side // 2 + side, 2), np.int32), np.empty(side * side, np.int32), np.empty((4, side + 8))


_FREE, _REACHED = 1, 2


def traversable_cells(occupied: Cells, radius_px: float) -> Cells:
    """Return 1 for cells around whose centre a disc is free, in the largest piece of such cells (4-connected).

    Of pieces of equal size, the one with the first cell in row order is used.
    """
    import cv2

    if 2 * radius_px > min(occupied.shape):
        return np.zeros_like(occupied)
    taken = np.zeros_like(occupied)
    for rows, cols in _rectangles(radius_px):
        square = np.ones((rows, cols), np.uint8)
        nearby = cv2.dilate(occupied, square, borderType=cv2.BORDER_CONSTANT, borderValue=1)
        np.bitwise_or(taken, nearby, out=taken)
    return _biggest_piece(_where(taken, 0))


def free_pieces_with_standing_cells(traversable: Cells, occupied: Cells) -> Cells:
    """Return 1 in the pieces of free space (4-connected) where the robot can stand; it cannot see other pieces."""
    image = _where(occupied, 0)
    standing, start = traversable, int(traversable.argmax())
    while standing.flat[start]:  # usually once
        _flood(image, start)
        standing = traversable & (image == _FREE)
        start = int(standing.argmax())
    return _where(image, _REACHED)


def _rectangles(radius_px: float) -> Iterator[tuple[int, int]]:
    """Yield rows and columns of rectangles that together form a disc (by near sides of cells), for fast dilation."""
    offsets = np.maximum(np.arange(math.ceil(radius_px) + 1) - 0.5, 0.0)  # distance to the near side of a cell
    wide = (np.hypot(offsets[:, None], offsets) < radius_px - 1e-9).sum(axis=1).tolist()  # including the middle one
    for away, (here, next_row) in enumerate(zip(wide, [*wide[1:], 0], strict=True)):
        if here > next_row:
            yield 2 * away + 1, 2 * here - 1


def _biggest_piece(image: Cells) -> Cells:
    """Return 1 in the largest piece of the cells that are 1."""
    import cv2

    cells = int(np.count_nonzero(image))
    if not cells:
        return image
    flooded = image.copy()
    if 2 * _flood(flooded, int(image.argmax())) >= cells:  # usually there is only one
        return _where(flooded, _REACHED)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(image, connectivity=4)
    return _where(labels, 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))


def _flood(image: Cells, start: int) -> int:
    """Set the piece of equal cells at a flat index to ``_REACHED``; return its number of cells."""
    import cv2

    rows, cols = image.shape
    row, col = divmod(start, cols)
    beside = np.zeros((rows + 2, cols + 2), np.uint8)
    return int(cv2.floodFill(image, beside, (col, row), _REACHED, flags=4)[0])


def _where(values: npt.NDArray[Any], value: int) -> Cells:
    """Return 1 for cells with this value, 0 elsewhere."""
    found: Cells = (values == value).view(np.uint8)
    return found
