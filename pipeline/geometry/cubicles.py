"""Doors of cubicles (toilets, changing rooms): lower than any other, in partitions that end below the ceiling.

R1  The leaf is a thin plate that stands on the floor or a little above, as high as a person, and as wide as a door.
R2  Thin partitions in line with it, or one with a cut-out for it, hold both of its ends. They are higher than the leaf
    and end below the ceiling; so a headboard or the panel of a desk is none.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.geometry.bodies import Bodies, Box
from pipeline.geometry.doorways import rectangle
from pipeline.geometry.leaves import CEILING_M, FOOT_M, TALL_M, TOUCH_M, Leaf

WIDTH_M = (0.5, 1.0)
MIN_M = 1.2
PLATE_M = 0.06
HIGHER_M = 0.05
HIGHEST_M = 2.4
IN_LINE_M = 0.05
PARALLEL = np.cos(np.deg2rad(4.0))


def cubicle_leaves(bodies: Bodies, ceiling_m: float) -> list[Leaf]:
    """All that is shaped and held as the door of a cubicle; heights count from the level's floor."""
    return [Leaf(box, (k,), (box,), box.thickness) for k, box in _plates(bodies) if _is_held(k, box, bodies, ceiling_m)]


def _plates(bodies: Bodies) -> Iterator[tuple[int, Box]]:
    """R1."""
    low, high = bodies.low, bodies.high
    tall = high[:, 2] - low[:, 2]
    extent = np.hypot(*(high - low)[:, :2].T)
    likely = (low[:, 2] <= FOOT_M) & (tall >= MIN_M) & (tall < TALL_M)
    for k in np.flatnonzero(likely & (extent >= WIDTH_M[0]) & (extent <= WIDTH_M[1] + PLATE_M)):
        box = bodies.box(int(k))
        if WIDTH_M[0] <= box.width <= WIDTH_M[1] and box.thickness <= PLATE_M:
            yield int(k), box


def _is_held(plate: int, box: Box, bodies: Bodies, ceiling_m: float) -> bool:
    """R2."""
    low, high = bodies.low, bodies.high
    near = (low[:, :2] <= high[plate, :2] + TOUCH_M).all(axis=1) & (high[:, :2] >= low[plate, :2] - TOUCH_M).all(axis=1)
    top = min(ceiling_m - CEILING_M, HIGHEST_M)
    near &= (high[:, 2] >= box.high + HIGHER_M) & (high[:, 2] <= top) & (low[:, 2] < box.high)
    partitions = [rectangle(each, depth=max(each.thickness, PLATE_M)) for each in _in_line(near, box, bodies)]
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    return bool(partitions) and bool((shapely.distance(shapely.multipolygons(partitions), ends) <= TOUCH_M).all())


def _in_line(near: npt.NDArray[np.bool_], box: Box, bodies: Bodies) -> Iterator[Box]:
    """The thin upright boxes among bodies that lie in line with a plate."""
    for k in np.flatnonzero(near):
        each = bodies.box(int(k))
        aside = abs((each.centre - box.centre) @ box.across)
        if each.thickness <= PLATE_M and aside < IN_LINE_M and abs(each.along @ box.along) > PARALLEL:
            yield each
