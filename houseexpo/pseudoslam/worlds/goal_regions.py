"""Find where goals of a kind are in a house: the rooms with a label, or the places beside pieces of furniture.

R1  The rooms are those that the plan records, or those found from its labels (``FloorPlan.divided``). A robot is in a
    room if its centre is.
R2  A robot is at a piece of furniture if its centre is within ``OBJECT_M`` of it and the line to the nearest cell of
    its kind crosses nothing: from there, a robot that turns sees it. This is success in ObjectNav (Batra et al., 2020),
    but for the action to stop.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import object_ids, room_ids
from houseexpo.plan.room_labels import LABELS, canonical
from houseexpo.pseudoslam.config import GoalConfig
from houseexpo.pseudoslam.worlds.maps import House
from houseexpo.pseudoslam.worlds.world import GoalRegion, World
from houseexpo.words import suggest_name

OBJECT_M: Final = 1.0
"""How near a robot must come to a piece of furniture, metres (R2)."""
_SAMPLES_PER_CELL: Final = 2

Cells = npt.NDArray[np.uint8]


def make_goal_regions(plan: House, world: World, goal: GoalConfig) -> dict[str, GoalRegion]:
    """Return the regions of the goal's names that the house has, by name.

    Raises
    ------
    ConfigError
        The house has none of them that a robot can reach.
    """
    if not isinstance(plan, FloorPlan):
        raise ConfigError(
            f"goal: map {plan.id!r} has no {goal.kind}s with names; take a plan, or a goal that is a place"
        )
    parts: Iterable[Any] = plan.divided.rooms if goal.kind == "room" else plan.objects
    ids = room_ids(plan.divided, world.frame) if goal.kind == "room" else object_ids(plan, world.frame)
    named: dict[str, list[int]] = {}
    for part in parts:
        named.setdefault(part.label.casefold(), []).append(part.id)
    found = {}
    for name in goal.names:
        marked = np.isin(ids, named.get(name.casefold(), [])).view(np.uint8)
        inside = marked
        if goal.kind == "object" and marked.any():
            inside = cells_beside(marked, world.occupied, OBJECT_M * world.frame.pixels_per_metre)
        inside = inside & world.traversable
        if inside.any():
            found[name] = GoalRegion(inside, marked)
    if not found:
        here = sorted({part.label for part in parts})
        names = goal.names[0] if len(goal.names) == 1 else f"{goal.kind} of the names {', '.join(goal.names)}"
        raise ConfigError(
            f"goal: plan {plan.id!r} has no {names} that a robot can reach; it has "
            f"{', '.join(here) or f'no {goal.kind}s with names'}"
            + (suggest_name(goal.names[0], here) if len(goal.names) == 1 else "")
        )
    return found


def mark_room_labels(plan: House, frame: GridFrame) -> Cells:
    """Return 1 plus the place in ``LABELS`` of the room of each cell (rows, cols); 0 for no room with a label (R1)."""
    assert isinstance(plan, FloorPlan)  # noqa: S101  # make_goal_regions has said so
    ids = room_ids(plan.divided, frame)
    found = np.zeros(ids.shape, np.uint8)
    for room in plan.divided.rooms:
        label = canonical(room.label)
        found[ids == room.id] = LABELS.index(label) + 1 if label else 0
    return found


def cells_beside(marked: Cells, blocked: Cells, reach_px: float) -> Cells:
    """Return 1 for free cells within reach of a marked one, whose line to the nearest of them crosses nothing (R2).

    Parameters
    ----------
    marked
        (rows, cols), 1 for the marked cells, at least one.
    blocked
        (rows, cols), not 0 for cells that block the view; marked ones never do.
    """
    import cv2

    away, nearest = cv2.distanceTransformWithLabels(
        (marked == 0).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    targets = np.empty((int(nearest.max()) + 1, 2), np.int64)
    targets[nearest[marked != 0]] = np.argwhere(marked)
    cells = np.argwhere((away <= reach_px) & (blocked == 0) & (marked == 0))
    ends = targets[nearest[tuple(cells.T)]]
    hides = (blocked != 0) & (marked == 0)
    for share in np.linspace(0.0, 1.0, _SAMPLES_PER_CELL * math.ceil(reach_px) + 1).tolist():
        rows, cols = np.rint(cells + share * (ends - cells)).astype(np.int64).T
        sees = ~hides[rows, cols]
        cells, ends = cells[sees], ends[sees]
    found = np.zeros_like(marked)
    found[tuple(cells.T)] = 1
    return found
