"""Doors that are known before any gap is looked at: named by the source, or by the leaf that stands in them.

R1  A leaf that stands proud of the wall on both sides (a frame) is a door.
R2  A leaf with wall above it that is no thicker than itself is a piece of wall, but for one in a frame of its own as
    deep as that wall: a door in a thin partition.
R3  A leaf between two ends of one wall stands closed in a doorway, but not one that ends beside a lintel of its own
    width: that hangs over the doorway, and the leaf stands ajar against another wall.
R4  Any other leaf stands open, or is furniture where it is too thick for a leaf.
R5  A leaf that is one body with its wall shows by the recess under its lintel (``geometry.recesses``).
R6  An opening that the source names is a doorway, whatever stands in it, and so is a door that it names in a wall.
R7  A leaf that hangs at the end of a lintel about as wide and stands at an angle to it, with no lintel of its own over
    it, stands ajar, named or not: its free end may come so near to a crossing wall that it seems to close a doorway.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bodies import Bodies, Box, box_around
from pipeline.geometry.doorways import Doorway, box_of, doorway, rectangle, seated
from pipeline.geometry.leaves import DEEPEST_M, PLATE_M, WIDTH_M, Leaf, find_leaves
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.overlay import clipped, overlap, polygons_of, united
from pipeline.geometry.recesses import leaves_in_recesses

PROUD_M = 0.04
FRAME_M = 0.01
CLOSE_M = 0.005
SHEET_M = 0.05
ABOVE = 0.5
SAME = 0.3
HINGE_M = 0.15
ALIKE = 0.25
PARALLEL = np.cos(np.deg2rad(4.0))


@dataclass(frozen=True, eq=False)
class Judged:
    """What the leaves are: doorways, leaves closed or open, bodies that are wall after all, furniture (plan areas)."""

    doorways: tuple[Doorway, ...]
    leaves: tuple[Polygon, ...]
    walls: tuple[int, ...]
    furniture: BaseGeometry


def judge_leaves(leaves: Sequence[Leaf], walls: BaseGeometry, hanging: BaseGeometry) -> Judged:
    """Judge what is shaped as a door; ``walls`` and ``hanging`` are without it."""
    doorways: list[Doorway] = []
    found: list[Polygon] = []
    pieces: list[int] = []
    things: list[Polygon] = []
    for leaf in leaves:
        way = doorway(leaf.box, walls)
        plan = rectangle(leaf.box, depth=max(leaf.box.thickness, SHEET_M))
        if leaf.box.thickness <= PLATE_M and _stands_ajar(leaf.box, hanging):  # R7
            found.append(plan)
            continue
        over = _thickness_above(leaf.box, hanging)
        if way is not None and leaf.box.thickness >= way.thickness + PROUD_M and leaf.plate_m < way.thickness:  # R1
            doorways.append(Doorway(rectangle(way), "leaf"))
            found.append(plan)
        elif 0 < over <= 1.25 * max(leaf.plate_m, SHEET_M) and not _is_framed(leaf, over):  # R2
            pieces += leaf.bodies
        elif way is not None and (over > 0 or not _ends_beside_lintel(leaf.box, hanging)):  # R3
            doorways.append(Doorway(rectangle(way), "leaf"))
            found.append(plan)
        elif over > 0:
            pieces += leaf.bodies
        elif leaf.box.thickness <= PLATE_M:  # R4
            found.append(plan)
        else:
            things.append(plan)
    return Judged(tuple(doorways), tuple(found), tuple(pieces), united(things))


def _is_framed(leaf: Leaf, wall_m: float) -> bool:
    """R2: whether a leaf stands in a frame that is deeper than itself and at least as deep as the wall above."""
    return len(leaf.bodies) > 1 and leaf.box.thickness > max(leaf.plate_m + FRAME_M, wall_m - CLOSE_M)


def _thickness_above(box: Box, hanging: BaseGeometry) -> float:
    """How thick the wall is over a leaf, metres, or 0 if none is over half of it."""
    x, y = box.centre
    near = clipped(hanging, x - box.width, y - box.width, x + box.width, y + box.width)
    if overlap(rectangle(box, depth=SHEET_M), near).area < ABOVE * box.width * SHEET_M:
        return 0.0
    wide = overlap(rectangle(box, depth=2 * DEEPEST_M), near)
    return float(wide.area / box.width)


def _ends_beside_lintel(box: Box, hanging: BaseGeometry) -> bool:
    """Whether a lintel about as wide as a leaf begins at one of the leaf's ends."""
    reach = box.width / 2 + HINGE_M
    x, y = box.centre
    near = clipped(hanging, x - reach, y - reach, x + reach, y + reach)
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    if near.is_empty:
        return False
    beside = [p for p in polygons_of(hanging) if shapely.distance(ends, p).min() < HINGE_M]
    return any(abs(box_of(p).width - box.width) < ALIKE * box.width for p in beside)


def _stands_ajar(box: Box, hanging: BaseGeometry) -> bool:
    """R7."""
    plan = rectangle(box, depth=max(box.thickness, SHEET_M))
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    parts = [p for p in polygons_of(hanging) if shapely.distance(p, plan) < HINGE_M]
    lintels = [(p, box_of(p)) for p in parts]
    own = any(abs(lintel.along @ box.along) > PARALLEL and p.intersects(plan) for p, lintel in lintels)
    return not own and any(
        shapely.distance(ends, p).min() < HINGE_M
        and abs(lintel.along @ box.along) < PARALLEL
        and abs(lintel.width - box.width) < ALIKE * box.width
        for p, lintel in lintels
    )


def known_doorways(
    named: Iterable[Doorway], doors: Iterable[Mesh], walls: BaseGeometry, lintels: BaseGeometry, judged: Judged
) -> tuple[list[Doorway], list[Polygon]]:
    """All doorways in ``walls`` as they stand, and the leaves, closed or open; ``doors`` are those the source names."""
    found = [replace(each, polygon=seated(each.polygon, walls)) for each in named]
    leaves = list(judged.leaves)
    for box in (box for mesh in doors for box in _boxes(mesh)):
        leaves.append(rectangle(box, depth=max(box.thickness, SHEET_M)))
        way = None if _stands_ajar(box, lintels) else doorway(box, walls)  # R7
        if way is not None:
            found.append(Doorway(rectangle(way), "named"))
    found += judged.doorways
    found += [Doorway(strip, "recess") for strip in leaves_in_recesses(lintels, walls)]
    return _each_once(found), leaves


def _each_once(doorways: list[Doorway]) -> list[Doorway]:
    """The opening of a door, its leaf and its recess are one doorway: what comes first stands for the others."""
    kept: list[Doorway] = []
    for doorway_ in doorways:
        area = doorway_.polygon.area
        if not any(overlap(doorway_.polygon, k.polygon).area > SAME * min(area, k.polygon.area) for k in kept):
            kept.append(doorway_)
    return kept


def _boxes(mesh: Mesh) -> list[Box]:
    """The box of a leaf, or those of its parts where it is no plate as a whole (a leaf open in its frame)."""
    whole = box_around(mesh.vertices[mesh.faces].reshape(-1, 3))
    if WIDTH_M[0] <= whole.width <= 2 * WIDTH_M[1] and whole.thickness <= DEEPEST_M:
        return [whole]
    return [leaf.box for leaf in find_leaves(Bodies.of(mesh))]
