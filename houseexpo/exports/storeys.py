"""Stack the plans of one house: their order, how high each lies, and how they lie over each other.

Exports of several storeys (``ifc``, ``rmf``) use it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.exports.orientation import Orientation, orient_plan
from houseexpo.floorplan import FloorPlan
from houseexpo.tolerances import SAME_M

STOREY_HEIGHT_M: Final = 3.0
"""From floor to floor, where the plans do not state how high they lie."""


@dataclass(frozen=True)
class Storey:
    """A plan in a building: it lies at ``offset``, metres along the export's axes, ``elevation_m`` over the lowest."""

    plan: FloorPlan
    offset: tuple[float, float]
    elevation_m: float


def stack_storeys(plans: Sequence[FloorPlan], name: str, orientation: Orientation = "world") -> list[Storey]:
    """Return the storeys of a building, lowest first.

    Plans whose frames state heights that differ are stacked as these say, and lie over each other as in their source.
    Other plans are stacked in the order given, every STOREY_HEIGHT_M, each in its own axes.

    Raises
    ------
    ConfigError
        Where there is no plan, or the name of the building cannot be the name of a file.
    """
    if not plans:
        raise ConfigError(f"export: expected the plans of building {name!r}, found none")
    if not name or name.startswith(".") or any(letter in name for letter in "/\\:\0\n"):
        raise ConfigError(f"export: expected a name that a file can have for the building, found {name!r}")
    floors = [plan.frame.floor for plan in plans if plan.frame is not None]
    if len(set(floors)) < len(plans):
        return [Storey(plan, (0.0, 0.0), i * STOREY_HEIGHT_M) for i, plan in enumerate(plans)]
    ordered = [plan for _, plan in sorted(zip(floors, plans, strict=True), key=lambda pair: pair[0])]
    frames = [np.array(frame.matrix) for plan in ordered if (frame := orient_plan(plan, orientation).frame) is not None]
    axes = frames[0][:, :2]
    is_one_source = all(np.abs(each[:, :2] - axes).max() < SAME_M for each in frames)
    storeys = []
    for plan, each, floor in zip(ordered, frames, sorted(floors), strict=True):
        x, y = np.linalg.solve(axes, each[:, 2] - frames[0][:, 2]).round(4).tolist() if is_one_source else (0.0, 0.0)
        storeys.append(Storey(plan, (x + 0.0, y + 0.0), round(floor - min(floors), 4)))
    return storeys
