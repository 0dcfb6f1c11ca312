"""Made houses with a closed space of known size, from a slit to a room: which of them a plan has, and what it notes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import ConnectivityConfig, PipelineConfig
from pipeline.values import Level
from tests.builders.houses import Hole, Parts, level, shell, wall
from tests.builders.meshes import Rectangle

SILL_M = 0.05
NARROWEST_M = 0.42
"""Faces that are closer are those of one wall."""
LEFT_OUT = ("closed_spaces", "left_out", "erased_parts", "filled_cells", "filled_pockets", "no_rooms")
Rule = Literal["by_source", "join", "leave"]


@dataclass(frozen=True)
class ClosedRoom:
    """A house of two rooms with a door, and the rectangle of a closed space at its end or in a corner."""

    level: Level
    closed: Rectangle

    @property
    def area(self) -> float:
        """Square metres of the closed space."""
        return float(shapely.box(*self.closed).area)


def closed_room(seed: int, *, marked: bool, least_m2: float = 2.1, most_m2: float = 9.0) -> ClosedRoom:
    """Return the house of a seed; ``marked``: a sill marks each door, as in SUNCG."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(3.2, 4.5)
    area = max(rng.uniform(least_m2, most_m2), NARROWEST_M * depth)
    first, second = rng.uniform(3.0, 5.0), rng.uniform(3.6, 4.6)
    x, low = first + 0.1, SILL_M if marked else 0.0
    start = rng.uniform(0.2, depth - 1.2)
    end = x + second
    inner: Parts
    if rng.random() < 0.5:  # over the whole depth of the house
        right = end + 0.1 + area / depth
        closed = (end + 0.1, 0.0, right, depth)
        inner = wall((end, 0.0, end + 0.1, depth))
    else:  # in the corner of the second room
        right, side = end, min(float(np.sqrt(area)), second - 1.2, depth - 1.2)
        closed = (right - side, depth - min(area / side, depth - 1.2), right, depth)
        x1, y1 = closed[0] - 0.1, closed[1] - 0.1
        inner = [*wall((x1, y1, right, closed[1])), *wall((x1, closed[1], closed[0], depth))]
    front = [Hole(1.0, 1.9, low)]
    between = wall((first, 0.0, x, depth), Hole(start, start + 0.9, low))
    parts = [*shell((0.0, 0.0, right, depth), front=front), *between, *inner]
    slab = shapely.box(0.0, 0.0, right, depth)
    floors = (None, slab, slab.difference(shapely.box(*closed)))
    made = level(parts, id=f"closed_{seed}", sills=marked, floor=floors[int(rng.integers(3))])
    return ClosedRoom(made, closed)


def outcome(house: ClosedRoom, rule: Rule = "by_source") -> str:
    """Return what became of the closed space: "joined", "noted", or "lost" without a note."""
    config = PipelineConfig(connectivity=ConnectivityConfig(closed_spaces=rule))
    plans = [each for each in plan_level(house.level, config, np.random.default_rng(0)) if isinstance(each, FloorPlan)]
    x1, y1, x2, y2 = house.closed
    for plan in plans:
        (_, _, tx), (_, _, ty) = plan.frame.matrix
        middle = shapely.Point((x1 + x2) / 2 - tx, (y1 + y2) / 2 - ty)
        if plan.free_space.contains(middle):
            return "joined"
    return "noted" if any((plan.provenance or {})["notes"].keys() & set(LEFT_OUT) for plan in plans) else "lost"
