"""Lay stairs: straight, with a quarter turn of winders at the foot, or with a half turn; the prisms of their steps.

S1  A stair stands in a cell of its own that ends at the landing in the north. It is the same cell on every storey, so
    that stairs stand above stairs, and the floor above is open over all of it.
S2  A stair with a half turn begins and ends at the landing. Any other ends there and begins at the far end of the cell:
    a straight one at a free place before its foot, one with a quarter turn at the side where the hall is.
S3  A step rises by ``RISE_M`` and goes forward by 0.24 m at least (DIN 18065 asks of stairs in dwellings for at most
    0.20 m and at least 0.23 m).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
import shapely

from pipeline.sources.homes.level import WALL_TOP_M
from pipeline.sources.homes.values import Rect

StairKind: TypeAlias = Literal["straight", "quarter", "half"]

SLAB_M: Final = 0.2
STOREY_M: Final = WALL_TOP_M + SLAB_M
"""From floor to floor."""
RISERS: Final = 16
RISE_M: Final = STOREY_M / RISERS
LANDING_M: Final = 0.9
"""The free place before the foot of a straight stair (S2), and the least depth of a landing in a stair."""
_WINDERS: Final = 3
_THICK_M: Final = 0.18
_WIDTH_M: Final = {"straight": (0.95, 1.1), "quarter": (0.95, 1.1), "half": (2.0, 2.2)}
_DEPTH_M: Final = {"straight": (4.55, 4.8), "quarter": (4.0, 4.3), "half": (2.8, 3.3)}


class Step(NamedTuple):
    """A tread or a landing: its area in the plan, and the height of its upper face over the floor, metres."""

    area: shapely.Polygon
    top_m: float

    @property
    def prism(self) -> tuple[shapely.Polygon, float, float]:
        """The solid: its area, its bottom and its top, metres."""
        return self.area, max(self.top_m - RISE_M - _THICK_M, 0.0), self.top_m


@dataclass(frozen=True)
class Stair:
    """A stair in a cell, up to the centre lines of its walls; the hall lies at the side ``foot`` of its foot.

    The landing of the upper storey is north of the cell.
    """

    kind: StairKind
    rect: Rect
    foot: Literal["west", "north", "east"]


def draw_stair_size(kind: StairKind, rng: np.random.Generator) -> tuple[float, float]:
    """Return the clear width and depth of a stair's cell, metres."""
    return float(rng.uniform(*_WIDTH_M[kind])), float(rng.uniform(*_DEPTH_M[kind]))


def steps_of(stair: Stair, wall_m: float) -> tuple[Step, ...]:
    """Return the steps from the lowest to the highest; the floor above is the last rise after them."""
    x1, y1, x2, y2 = stair.rect
    x1, y1, x2 = x1 + wall_m / 2, y1 + wall_m / 2, x2 - wall_m / 2
    y2 += wall_m / 2
    if stair.kind == "half":
        return tuple(_half_turn(x1, y1, x2, y2))
    if stair.kind == "straight":
        ys = np.linspace(y1 + LANDING_M, y2, RISERS)
        areas = [shapely.box(x1, a, x2, b) for a, b in pairwise(ys.tolist())]
    else:
        areas = _winders(x1, y1, x2, stair.foot == "west")
        ys = np.linspace(y1 + x2 - x1, y2, RISERS - _WINDERS)
        areas += [shapely.box(x1, a, x2, b) for a, b in pairwise(ys.tolist())]
    return tuple(Step(area, (k + 1) * RISE_M) for k, area in enumerate(areas))


def _half_turn(x1: float, y1: float, x2: float, y2: float) -> list[Step]:
    """Two flights side by side; what the treads do not need of the depth is the landing between them."""
    flight = RISERS // 2 - 1
    middle, gap = (x1 + x2) / 2, 0.05
    going = min((y2 - y1 - LANDING_M) / flight, 0.28)
    ys = y2 - going * np.arange(flight + 1)
    up = [shapely.box(x1, b, middle - gap, a) for a, b in pairwise(ys.tolist())]
    on = [shapely.box(middle + gap, b, x2, a) for a, b in pairwise(ys.tolist())][::-1]
    areas = [*up, shapely.box(x1, y1, x2, float(ys[-1])), *on]
    return [Step(area, (k + 1) * RISE_M) for k, area in enumerate(areas)]


def _winders(x1: float, y1: float, x2: float, from_west: bool) -> list[shapely.Polygon]:
    """The square at the foot as treads round its inner corner, which is at the side of the hall in the north."""
    wide = x2 - x1
    side = wide * float(np.tan(np.pi / 6))
    corner, far = ((x1, y1 + wide), x2) if from_west else ((x2, y1 + wide), x1)
    near = corner[0]
    turn = 1.0 if from_west else -1.0
    return [
        shapely.Polygon([corner, (near, y1), (near + turn * side, y1)]),
        shapely.Polygon([corner, (near + turn * side, y1), (far, y1), (far, y1 + wide - side)]),
        shapely.Polygon([corner, (far, y1 + wide - side), (far, y1 + wide)]),
    ]
