"""Rasterise a plan or polygon: mask of free cells, ids of rooms or doors (-1 for none), distances to walls (metres).

A cell is inside a polygon if its centre is.

Painting the boundary of a polygon too (``cv2.fillPoly``) adds half a pixel on all sides: 3% of the area of a flat at 25
px/m, and walls of one pixel disappear. Cell centres are unbiased: the area is preserved, and polygons with a common
edge have no common cell.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.plan import Door, PlanObject, Ring, Room
from houseexpo.plan.model import PlanData
from houseexpo.tolerances import TIE_PX

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Space: TypeAlias = Union[PlanData, "Polygon", "MultiPolygon"]
Mask: TypeAlias = npt.NDArray[np.bool_]


NOTHING = -1
"""The value in ``room_ids`` and ``door_ids`` of cells without a room or door (ids start at 0)."""


def free_mask(
    space: Space,
    pixels_per_metre: float = 25.0,
    *,
    frame: GridFrame | None = None,
    margin_px: int = 1,
    y_up: bool = False,
) -> tuple[Mask, GridFrame]:
    """Rasterise the free space of a plan, or a polygon.

    Parameters
    ----------
    space
        A plan or a shapely polygon, metres. Rings are filled by the even-odd rule, even if they are invalid.
    pixels_per_metre, margin_px, y_up
        Properties of a new grid around the space (``GridFrame.around``); ignored if ``frame`` is given.
    frame
        The grid to fill; the space outside it is ignored.

    Returns
    -------
    mask : (rows, cols) bool, True for free cells
    frame : the position of the grid

    Raises
    ------
    ConfigError
        ``pixels_per_metre`` is not a positive number, or a new grid would have too many cells.

    Examples
    --------
    >>> plan = PlanData("square", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
    >>> mask, frame = free_mask(plan, 10)
    >>> mask.shape, int(mask.sum())
    ((22, 22), 400)
    """
    rings = all_rings(space)
    if frame is None:
        frame = GridFrame.around(_bounds(rings), pixels_per_metre, margin_px=margin_px, y_up=y_up)
    mask = np.zeros(frame.shape, dtype=bool)
    _fill(mask, rings, frame, True)
    return mask, frame


def fill_cells(mask: npt.NDArray[np.generic], space: Space, frame: GridFrame, value: int) -> None:
    """Set the cells of ``mask`` (rows, cols) whose centres lie in the space to ``value``, in place."""
    _fill(mask, all_rings(space), frame, value)


def room_ids(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return the id of the room in each cell (rows, cols), -1 in cells without a room.

    Parameters
    ----------
    plan
        A plan with rooms; ``with_rooms`` adds rooms to a published plan.
    frame
        The cells, for example ``plan.grid_frame(25)``.
    """
    return _ids(plan.rooms, frame)


def door_ids(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return the id of the door or entrance in each cell (rows, cols), -1 in cells without a door.

    Parameters
    ----------
    plan
        A plan with doors; ``with_rooms`` adds doors to a published plan.
    frame
        The cells, for example ``plan.grid_frame(25)``.
    """
    return _ids(plan.doors, frame)


def object_ids(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return the id of the piece of furniture in each cell (rows, cols), -1 in cells without one."""
    return _ids(plan.objects, frame)


def distance_field(mask: Mask, pixels_per_metre: float) -> npt.NDArray[np.float32]:
    """Return the distance in metres from the centre of each True cell to the nearest False one, 0 in False cells.

    This is the exact Euclidean distance between centres minus half a cell, the part that lies in the wall. The area
    outside the grid does not count as a wall, so the grid needs a margin, such as ``GridFrame.around`` leaves.

    Raises
    ------
    ConfigError
        Every cell is True.
    """
    import cv2

    if mask.all():
        raise ConfigError(f"distance_field: expected a wall somewhere, found {mask.size} free cells; leave a margin")
    distance = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    metres: npt.NDArray[np.float32] = (np.maximum(distance - 0.5, 0) / pixels_per_metre).astype(np.float32)
    return metres


def all_rings(space: Space) -> list[Ring]:
    """Return all rings (n, 2) of a plan or polygon, in no particular order: the even-odd rule treats holes alike.

    Points and lines, which differences of touching areas leave in a collection, are skipped.
    """
    if isinstance(space, PlanData):
        return [space.verts, *space.holes]
    polygons = getattr(space, "geoms", [space])
    rings = [ring for p in polygons if p.area for ring in (p.exterior, *p.interiors)]
    return [np.asarray(ring.coords)[:-1, :2] for ring in rings]


def _ids(parts: Iterable[Room | Door | PlanObject], frame: GridFrame) -> npt.NDArray[np.int32]:
    mask = np.full(frame.shape, NOTHING, dtype=np.int32)
    for part in parts:
        holes = part.holes if isinstance(part, Room) else ()
        _fill(mask, [part.ring, *holes], frame, part.id)
    return mask


def _bounds(rings: list[Ring]) -> tuple[float, float, float, float]:
    if not rings:
        return 0.0, 0.0, 0.0, 0.0
    low = np.min([ring.min(axis=0) for ring in rings], axis=0)
    high = np.max([ring.max(axis=0) for ring in rings], axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _fill(mask: npt.NDArray[np.generic], rings: list[Ring], frame: GridFrame, value: int) -> None:
    """Set the cells whose centres lie inside the rings (even-odd).

    Every column is a scanline through its cells' centres. An edge toggles the first cell below its crossing, and the
    running parity down the column tells which cells are inside. Spans are half-open, so that a vertex counts once and
    the parity ends at zero.
    """
    if not rings:
        return
    row, col = _crossings(rings, frame)
    if not len(row):
        return
    top, left, right = int(row.min()), int(col.min()), int(col.max()) + 1
    height, width = (
        int(row.max()) - top,
        right - left,
    )  # toggles in the last row or below the grid set no cell
    stride = -(-width // 8) * 8  # whole words: eight cells are toggled at once
    parity = np.zeros((height + 1) * stride, np.uint8)
    np.bitwise_xor.at(parity, (row - top) * stride + col - left, 1)  # few cells toggle; most of the grid is not touched
    words = parity.view(np.uint64).reshape(height + 1, stride // 8)[:height]
    np.bitwise_xor.accumulate(words, axis=0, out=words)
    rows = parity.reshape(height + 1, stride)[:height, :width]
    np.copyto(mask[top : top + height, left:right], np.asarray(value, mask.dtype), where=rows.view(bool))


def _crossings(rings: list[Ring], frame: GridFrame) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return row and column of each toggle; rows run from 0 to ``rows`` (one below the grid), columns stay on it."""
    start, end = edges_in_pixels(rings, frame)
    rows, cols = frame.shape
    # columns c with start.x <= c + 0.5 < end.x
    first, last = np.clip(_centre_from(np.stack([start[:, 0], end[:, 0]])), 0, cols).astype(np.intp)
    spans = last - first
    edge = np.repeat(np.arange(len(spans)), spans)
    col = np.arange(len(edge)) - np.repeat(np.cumsum(spans) - spans - first, spans)
    with np.errstate(divide="ignore", invalid="ignore"):  # vertical edges span no column
        slope = (end[:, 1] - start[:, 1]) / (end[:, 0] - start[:, 0])
    crossing = start[edge, 1] + (col + 0.5 - start[edge, 0]) * slope[edge]
    return np.clip(_centre_from(crossing), 0, rows).astype(np.intp), col


def _centre_from(position: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the first cell whose centre lies at or after a position.

    "At" means within ``TIE_PX``: walls on the 1 cm grid run through centres, and rounding must not decide on which side
    of the wall a centre lies.
    """
    first: npt.NDArray[np.float64] = np.ceil(position - 0.5 - TIE_PX)
    return first


def edges_in_pixels(rings: list[Ring], frame: GridFrame) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the left ends (n, 2) and the right ends (n, 2) of all edges, in pixels.

    Two polygons that share an edge get it in the same direction and so compute exactly the same crossings.
    """
    ends = [frame.pixels_from_points(ring) for ring in rings]
    here = np.concatenate(ends)
    there = np.concatenate([part for ring in ends for part in (ring[1:], ring[:1])])
    swap = (here[:, 0] > there[:, 0])[:, None]
    return np.where(swap, there, here), np.where(swap, here, there)
