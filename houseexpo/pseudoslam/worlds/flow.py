"""The paths to the rooms of a house, computed once for each world."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import clearance, room_mask
from houseexpo.pseudoslam.kernels.planning import flow as kernels
from houseexpo.pseudoslam.kernels.planning.flow import FAR, FLOW_SIZES, Flow
from houseexpo.pseudoslam.worlds.traversable import traversable_cells

_BLOCK_M = 0.2
_MIN_GOALS, _MAX_GOALS = 4, 24  # if a plan has no rooms to go to

Ints = npt.NDArray[np.int32]
Mask = npt.NDArray[np.uint8]


def make_flow(occupied: Mask, frame: GridFrame, radius_m: float, plan: FloorPlan) -> Flow:
    """Return the paths to all rooms of a plan for a disc of a person's radius.

    The goal in a room is its widest place. If the plan records fewer than two rooms that can be reached, goals are
    places far from each other; there are ``room_num`` of them, but at least 4 and at most 24.

    Raises
    ------
    ConfigError
        A person of this radius does not fit anywhere.
    """
    traversable = traversable_cells(occupied, radius_m * frame.pixels_per_metre)
    if not traversable.any():
        raise ConfigError(
            f"people.radius_m: people of radius {radius_m:g} m fit nowhere in plan {plan.id!r} at "
            f"{frame.pixels_per_metre:g} px/m; make them smaller, or have none"
        )
    side = max(round(_BLOCK_M * frame.pixels_per_metre), 1)
    ways = _Ways(traversable, side)
    goals = ways.connected(_room_cells(plan, frame, occupied, traversable) if len(plan.rooms) > 1 else [])
    if len(goals) < 2:
        goals = ways.spread(min(max(plan.room_num, _MIN_GOALS), _MAX_GOALS))
    toward = np.stack([ways.toward(goal) for goal in goals])
    sizes = np.array([(*ways.links.shape, side, len(goals))], FLOW_SIZES)
    return Flow(sizes, toward.ravel(), ways.spots.reshape(-1, 2), np.array(goals, np.int32))


def _room_cells(plan: FloorPlan, frame: GridFrame, occupied: Mask, traversable: Mask) -> list[tuple[int, int]]:
    """Return the cell (row, col) with the largest clearance in each room."""
    ids = room_mask(plan, frame)
    room_m = np.where(traversable != 0, clearance(occupied == 0, 1.0), -1.0)
    found = []
    for room in plan.rooms:
        inside = np.where(ids == room.id, room_m, -1.0)
        cell = int(inside.argmax())
        if inside.flat[cell] >= 0:
            found.append(divmod(cell, traversable.shape[1]))
    return found


class _Ways:
    """Blocks of cells, their links, and their largest connected component."""

    def __init__(self, traversable: Mask, side: int) -> None:
        shape = math.ceil(traversable.shape[0] / side), math.ceil(traversable.shape[1] / side)
        self.side = side
        self.spots: Ints = np.empty((*shape, 2), np.int32)
        self.links: Mask = np.empty(shape, np.uint8)
        self._queue, self._queued = np.empty(self.links.size, np.int32), np.empty(self.links.size, np.uint8)
        kernels.find_spots(traversable, side, self.spots)
        kernels.find_links(traversable, self.spots, self.links)
        self.joined = self._biggest()

    def distances(self, goal: int) -> Ints:
        """Return the distance from each block to a goal."""
        found = np.empty(self.links.shape, np.int32)
        kernels.find_distances(self.links, goal, found, self._queue, self._queued)
        return found

    def toward(self, goal: int) -> Mask:
        """Return the next block on the path from each block to a goal."""
        found = np.empty(self.links.shape, np.uint8)
        kernels.find_toward(self.links, self.distances(goal), found)
        return found

    def connected(self, cells: list[tuple[int, int]]) -> list[int]:
        """Return the blocks of cells that can be reached, each once."""
        blocks = [row // self.side * self.links.shape[1] + col // self.side for row, col in cells]
        return [block for block in dict.fromkeys(blocks) if self.joined.flat[block]]

    def spread(self, number: int) -> list[int]:
        """Return blocks, each as far as possible from the earlier ones; these are mostly at the ends of rooms."""
        roomy = self.joined & (np.bitwise_count(self.links) == 8)
        candidates = roomy if roomy.any() else self.joined
        nearest = self.distances(int(candidates.argmax()))
        goals: list[int] = []
        for _ in range(min(number, int(candidates.sum()))):
            goals.append(int(np.where(candidates, nearest, -1).argmax()))
            reach = self.distances(goals[-1])
            nearest = reach if len(goals) == 1 else np.minimum(nearest, reach)
        return goals

    def _biggest(self) -> npt.NDArray[np.bool_]:
        left = self.spots[..., 0] >= 0
        best = np.zeros_like(left)
        while left.sum() > best.sum():
            part = self.distances(int(left.argmax())) < FAR
            best = part if part.sum() > best.sum() else best
            left &= ~part
        return best
