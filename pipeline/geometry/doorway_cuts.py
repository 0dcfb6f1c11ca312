"""Cut straight doorways where lines between two points cross walls; find hints of doors in walls, likeliest first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import clip_to_box, dot_product, polygons_of
from pipeline.geometry.doorways import box_around_polygon
from pipeline.geometry.openings import Opening
from pipeline.tolerances import (
    ALMOST_ALL,
    AROUND_M,
    BESIDE_M,
    BLOCK_M,
    CM_M,
    DOORWAY_M,
    HAND_M,
    LARGELY,
    NEARLY_ALL,
    PASSABLE_M,
    PLACE_M,
    SPECK,
)

# ---------------------------------------------------------------------------------------------------------------------
# A doorway cut through a wall: straight, at right angles to it, where the line between two points meets it.
# ---------------------------------------------------------------------------------------------------------------------

Vector = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CutRules:
    """How wide a cut is, and how deep at most.

    It stands at most ``slide_m`` beside its line, and of all such places where the wall is thinnest, if that is less
    than ``LARGELY`` of what it mostly is: a leaf or a niche is a better place than bare wall.
    """

    width_m: float
    deepest_m: float
    slide_m: float = BLOCK_M


def cut_walls_along_lines(
    lines: Floats, pieces: list[Polygon], floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Iterator[tuple[Floats, Opening]]:
    """Cuts near the lines (n, 2, 2) from point to point, each with its line (2, 2), in the order of the lines.

    Only walls are cut that stand between two of the ``pieces`` in which a robot can stand: a line may cross many rooms.
    The thinnest wall of each line comes first. Lines that meet a wall at about the same place (``PLACE_M``) stand for
    each other.
    """
    tried: set[tuple[int, ...]] = set()
    tree = shapely.STRtree(pieces)
    for line, crossed in zip(lines, shapely.difference(shapely.linestrings(lines), floor), strict=True):
        walls_met = [p for p in shapely.get_parts(crossed) if p.length > 1e-6]
        for wall in sorted(walls_met, key=lambda p: (p.length, p.bounds)):
            start, end = shapely.get_coordinates(wall)[[0, -1]]
            place = tuple(np.round(np.concatenate([start, end]) / PLACE_M).astype(int).tolist())
            if place in tried:
                continue
            tried.add(place)
            if tree.nearest(shapely.points(start)) == tree.nearest(shapely.points(end)):
                continue
            cut = _straight_cut(start, end, floor, walls, rules)
            if cut is not None:
                yield line, cut


def _straight_cut(
    start: Vector, end: Vector, floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Opening | None:
    along = _face_direction(start, _clip_around(start, floor, AROUND_M))
    if along is None:
        return None
    across = np.array([-along[1], along[0]])
    if dot_product(across, end - start) < 0:
        along, across = -along, -across
    reach = rules.deepest_m + BLOCK_M + 1.0
    near = _clip_around(start, floor, reach)
    steps = np.arange(0.0, rules.slide_m, HAND_M)
    slides = np.array(sorted({*steps, *-steps}, key=lambda s: (abs(s), s)))
    feet = start + slides[:, None] * along
    depth = _depths(feet, across, near, rules.deepest_m)
    through = np.flatnonzero(depth > CM_M)
    cuts = [Opening(feet[k] + across * depth[k] / 2, along, rules.width_m, float(depth[k]), (0, 0)) for k in through]
    clean = _are_clean(cuts, near, _clip_around(start, walls, reach))
    if not clean.any():
        return None
    slim = clean & (depth[through] < LARGELY * np.median(depth[through]))
    return cuts[int(np.argmax(slim if slim.any() else clean))]


def _clip_around(point: Vector, shape: BaseGeometry, reach_m: float) -> BaseGeometry:
    """What of a shape lies in the square of ``reach_m`` to each side of a point: a storey has hundreds of walls."""
    x, y = point
    return clip_to_box(shape, x - reach_m, y - reach_m, x + reach_m, y + reach_m)


def _face_direction(point: Vector, floor: BaseGeometry) -> Vector | None:
    """Unit direction of the edge of the floor that a point lies on."""
    best, direction = 0.01, None
    for ring in shapely.get_parts(shapely.get_parts(floor.boundary)):
        points = shapely.get_coordinates(ring)
        a, d = points[:-1], np.diff(points, axis=0)
        length2 = np.maximum((d**2).sum(axis=1), 1e-12)
        t = np.clip(((point - a) * d).sum(axis=1) / length2, 0.0, 1.0)
        distance = np.hypot(*(a + t[:, None] * d - point).T)
        k = int(np.argmin(distance))
        if distance[k] < best:
            best, direction = float(distance[k]), d[k] / np.sqrt(length2[k])
    return direction


def _depths(feet: Floats, across: Vector, floor: BaseGeometry, deepest_m: float) -> Floats:
    """Return how far it is through the wall from points (n, 2) on its face, or 0 if there is no other side in reach."""
    rays = shapely.linestrings(np.stack([feet + 1e-3 * across, feet + deepest_m * across], axis=1))
    points, ray = shapely.get_coordinates(shapely.intersection(rays, floor), return_index=True)
    depth = np.full(len(feet), np.inf)
    np.minimum.at(depth, ray, dot_product(points - feet[ray], across))
    return np.where(np.isfinite(depth), depth, 0.0)


def _are_clean(cuts: list[Opening], floor: BaseGeometry, walls: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Of which cuts the strip is wall throughout, and the floor before and behind it is free."""
    clean = np.ones(len(cuts), np.bool_)
    for side in (-1.0, 1.0):
        before = [
            replace(c, centre=c.centre + side * c.across * (c.depth + PASSABLE_M) / 2, depth=PASSABLE_M) for c in cuts
        ]
        clean &= _shares(before, floor) >= ALMOST_ALL
    strips = [c for c, free in zip(cuts, clean, strict=True) if free]
    clean[clean] = (_shares(strips, floor) <= SPECK) & (_shares(strips, walls) >= NEARLY_ALL)
    return clean


def _shares(strips: list[Opening], shape: BaseGeometry) -> Floats:
    """Return the share (n,) of each strip that lies in a shape."""
    boxes = np.array([strip.strip() for strip in strips], np.object_)
    return np.asarray(shapely.area(shapely.intersection(boxes, shape)) / shapely.area(boxes))


# ---------------------------------------------------------------------------------------------------------------------
# Where a wall is better cut than elsewhere: places with some evidence of a door, though not enough to be one.
#
# R1  A doorway that the evidence knows and no passage uses, then a leaf beside no passage, then a lintel that closes
#     nothing: in this order, the larger ones first.
# R2  The way through is square to what lies in the wall; of a leaf, which may stand open, along it too.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class DoorHint:
    """A line (2, 2) across the place of a door that may be, and what speaks for it, in words."""

    line: npt.NDArray[np.float64]
    why: str


def find_door_hints(
    doorways: Iterable[Polygon], leaves: Iterable[Polygon], lintels: BaseGeometry, passages: Sequence[Opening]
) -> Iterator[DoorHint]:
    """Yield the places, the likeliest first: doorways, leaves of doors and lintels that no passage uses."""
    ways = shapely.STRtree([p.strip() for p in passages])
    kinds: list[tuple[str, Iterable[Polygon], bool]] = [
        ("a doorway that nothing else leads through", doorways, False),
        ("the leaf of a door", leaves, True),
        ("a lintel", polygons_of(lintels), False),
    ]
    return chain.from_iterable(_of_kind(why, shapes, ways, leaf) for why, shapes, leaf in kinds)


def _of_kind(why: str, shapes: Iterable[Polygon], ways: shapely.STRtree, leaf: bool) -> Iterator[DoorHint]:
    """R1, R2."""
    for shape in sorted(shapes, key=lambda p: (-p.area, p.bounds)):
        box = box_around_polygon(shape)
        if not DOORWAY_M[0] <= box.width <= DOORWAY_M[1] or len(ways.query(shape, "dwithin", BESIDE_M)):
            continue
        yield DoorHint(_line(box.centre, box.across, AROUND_M), why)
        if leaf:
            yield DoorHint(_line(box.centre, box.along, box.width / 2 + AROUND_M), why)


def _line(centre: npt.NDArray[np.float64], way: npt.NDArray[np.float64], reach_m: float) -> npt.NDArray[np.float64]:
    return np.stack([centre - reach_m * way, centre + reach_m * way])
