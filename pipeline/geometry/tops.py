"""Where things end: below the walls beside them, with them, or at a sloped roof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.caps import OVER_FLOOR_M
from pipeline.geometry.cutting import Cutter
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.overlay import EMPTY, clipped, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import opened

SLIVER_M = 0.04
BESIDE_M = 0.3
GOES_ON = 0.75
KNEE_M = 0.4
"""A roof begins so far above the wall that carries it, at most."""
LOOKS = 5
HEADROOM_M = (1.0, 1.9)
LARGE_M2 = 0.5


def hanging_free(above: Sequence[BaseGeometry], standing: BaseGeometry) -> BaseGeometry:
    """What hangs over what does not stand, in sections ``above`` each other, up to where the walls beside it end."""
    found: list[BaseGeometry] = []
    higher, kept = EMPTY, EMPTY
    for here in reversed(above):
        closing = opened(subtract(here, standing), SLIVER_M)
        ending = opened(subtract(closing, kept), SLIVER_M)
        walls = overlap(here, standing)
        house_goes_on = overlap(walls, higher).area > GOES_ON * walls.area
        loose = [part for part in polygons_of(ending) if _walls_go_on(part, walls, higher, alone=house_goes_on)]
        kept = subtract(closing, united(loose)) if loose else closing
        found.append(kept)
        higher = here
    return opened(united(found), SLIVER_M) if found else EMPTY


@dataclass(frozen=True, eq=False)
class Ending:
    """A piece of what stands that ends; ``stood_m`` is the height of the last section in which it is there."""

    part: Polygon
    stood_m: float


def ending_below(standing: BaseGeometry, above: Sequence[BaseGeometry], heights: Sequence[float]) -> list[Ending]:
    """The pieces of what stands that end, in sections ``above`` each other, where the walls beside them go on.

    ``heights`` are those of what stands and of the sections above it.
    """
    found: list[Ending] = []
    present = standing
    for here, below_m in zip(above, heights, strict=False):
        still = overlap(present, here)
        house_goes_on = still.area > 0.5 * present.area
        found += [
            Ending(part, below_m)
            for part in polygons_of(opened(subtract(present, still), SLIVER_M))
            if _walls_go_on(part, subtract(_around(part, present), part), here, alone=house_goes_on)
        ]
        present = still
    return found


def _around(part: Polygon, walls: BaseGeometry) -> BaseGeometry:
    x1, y1, x2, y2 = part.bounds
    return clipped(walls, x1 - 1.0, y1 - 1.0, x2 + 1.0, y2 + 1.0)


def _walls_go_on(part: Polygon, walls: BaseGeometry, higher: BaseGeometry, *, alone: bool) -> bool:
    """Whether the walls beside a part reach higher than it does; ``alone`` is the answer where none is beside it.

    Under a sloped roof the wall on one side of a door goes on and the other does not: both have to.
    """
    beside = overlap(shapely.buffer(part, BESIDE_M, quad_segs=2), _around(part, walls))
    if beside.is_empty:
        return alone
    return bool(overlap(beside, _around(part, higher)).area > GOES_ON * beside.area)


def without_headroom(mesh: Mesh) -> BaseGeometry:
    """Where a roof or a ceiling hangs too low to stand under: the plan area of large faces at such a height."""
    corners = mesh.vertices[mesh.faces]
    top = corners[:, :, 2].max(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plan_m2 = np.abs(normal[:, 2]) / 2
    low = (top > HEADROOM_M[0]) & (top < HEADROOM_M[1]) & (plan_m2 > LARGE_M2)
    return united(shapely.polygons(corners[low][:, :, :2])) if low.any() else EMPTY


def meets_slope(part: Polygon, cutter: Cutter, stood_m: float = OVER_FLOOR_M) -> bool:
    """Whether a piece that stands up to a height ends over that at a sloped roof."""
    inside = np.array([p.coords[0] for p in _places(part)])
    meets = cutter.caps.slopes_over(inside, KNEE_M, stood_m)
    return bool(meets.sum() > len(meets) / 2)


def _places(part: Polygon) -> list[shapely.Point]:
    """Points spread over a part: one in each of a few pieces of it."""
    x1, y1, x2, y2 = part.bounds
    along_x = x2 - x1 >= y2 - y1
    edges = np.linspace(x1 if along_x else y1, x2 if along_x else y2, LOOKS + 1)
    boxes = [shapely.box(a, y1, b, y2) if along_x else shapely.box(x1, a, x2, b) for a, b in pairwise(edges)]
    pieces = [overlap(part, box) for box in boxes]
    return [piece.representative_point() for piece in pieces if not piece.is_empty]
