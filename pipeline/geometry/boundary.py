"""A boundary for a house that its walls leave open."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.gaps import WallEnd, gap_at, wall_ends
from pipeline.geometry.overlay import mitred, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import enclosed, filled, opened

BAND_M = 0.1
NEAR_M = 0.25
WALLED = 0.5
"""At least this share of an open room's edge has to be wall; a slab in a garden is no room."""
FARTHEST_M = 10.0
SURROUNDED = 0.8
"""A place that walls surround along this share of its hull is a room, whose one side is a front."""
FRONT_M = 6.0
HELD = 0.5
"""A room of which walls enclose less than this share lies open."""


def from_floor(floor: BaseGeometry, ground: BaseGeometry, least_m2: float) -> list[Polygon]:
    """Bands along the edges of the floor slab where it is open.

    ``ground`` is the closed plane so far. A part of the floor that it does not enclose is a room that lacks a wall if
    it has ``least_m2`` and walls along half of its edge. Where a wall ends at the opening and goes on behind
    it, the band goes on from its end; elsewhere it lies outside the slab, so that all of the slab stays free.
    """
    open_floor = polygons_of(opened(subtract(floor, filled(ground)), 0.5))
    large = [part for part in open_floor if part.area >= least_m2]
    if not large:
        return []
    bands: list[Polygon] = []
    ends = list(wall_ends(ground))
    near_walls = shapely.buffer(ground, NEAR_M, quad_segs=2)
    for part in large:
        edge = part.exterior
        if shapely.intersection(edge, near_walls).length < WALLED * edge.length:
            continue
        bare = shapely.difference(edge, shapely.buffer(ground, 0.02, quad_segs=2))
        going_on = [
            gap for end in ends if (gap := gap_at(end, ground, FARTHEST_M)) is not None and _lies_along(gap, bare)
        ]
        bands += going_on
        rest = shapely.difference(bare, shapely.buffer(united(going_on), NEAR_M, cap_style="flat"))
        if rest.length > NEAR_M:
            lines = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(rest)))
            band = shapely.buffer(lines, BAND_M, cap_style="square", join_style="mitre")
            bands += polygons_of(subtract(band, united([floor, ground])))
    return bands


def from_rooms(named: list[Polygon], ground: BaseGeometry, rooms: list[Polygon], least_m2: float) -> list[Polygon]:
    """Bands around those of the source's own rooms that lie open; they lie outside all of these rooms.

    ``ground`` is the closed plane so far and ``rooms`` what it encloses.
    """
    if not named:
        return []
    known = united(rooms)
    lying_open = [room for room in named if room.area >= least_m2 and overlap(room, known).area < HELD * room.area]
    if not lying_open:
        return []
    return polygons_of(subtract(united(mitred(room, BAND_M) for room in lying_open), united([*named, ground])))


def _lies_along(gap: Polygon, edge: BaseGeometry) -> bool:
    return bool(overlap(gap, shapely.buffer(edge, NEAR_M, quad_segs=2)).area > 0.9 * gap.area)


def from_wall_ends(tall: BaseGeometry, ground: BaseGeometry, least_m2: float) -> list[Polygon]:
    """Straight closings between wall ends, shortest first, each kept if it encloses ``least_m2`` more."""
    ends = list(wall_ends(tall))
    straight = [gap_at(end, ground, FARTHEST_M) for end in ends]
    slanted = [_between(a, b, ground) for a, b in combinations(ends, 2)]
    candidates = sorted((c for c in straight + slanted if c is not None), key=lambda c: (round(c.length, 6), c.bounds))
    kept: list[Polygon] = []
    so_far = enclosed_area(ground)
    hull = shapely.convex_hull(tall).area
    for candidate in candidates:
        if so_far > WALLED * hull:
            break
        trial = united([ground, candidate])
        area = enclosed_area(trial)
        if area >= so_far + least_m2:
            kept.append(candidate)
            ground, so_far = trial, area
    return kept


def from_hull(tall: BaseGeometry, least_m2: float) -> list[Polygon]:
    """Bands along the fronts of a single room that is open to one side or two: where no wall stands along its hull.

    There are none where walls stand along less than ``SURROUNDED`` of it (a corner piece, a stage), or where a front is
    wider than ``FRONT_M``.
    """
    hull = shapely.convex_hull(tall)
    if hull.geom_type != "Polygon" or hull.area < least_m2:
        return []
    bare = shapely.difference(hull.exterior, shapely.buffer(tall, NEAR_M, quad_segs=2))
    fronts = shapely.get_parts(shapely.line_merge(bare)) if not bare.is_empty else np.zeros(0, np.object_)
    if bare.length > (1 - SURROUNDED) * hull.length or any(front.length > FRONT_M for front in fronts):
        return []
    bands = shapely.buffer(fronts, NEAR_M, cap_style="square", join_style="mitre")
    inner = shapely.buffer(hull, -BAND_M, join_style="mitre")
    return [part for band in bands for part in polygons_of(subtract(band, united([inner, tall])))]


def enclosed_area(walls: BaseGeometry) -> float:
    """Square metres of free space that the walls close all round."""
    return float(sum(r.area for r in enclosed(walls)[1]))


def _between(first: WallEnd, second: WallEnd, ground: BaseGeometry) -> Polygon | None:
    """The band between two wall ends, if nothing but the ends themselves stands between them."""
    a, b = (first.a + first.b) / 2, (second.a + second.b) / 2
    length = float(np.hypot(*(b - a)))
    if not 0.05 < length <= FARTHEST_M:
        return None
    line = shapely.linestrings([a, b])
    within_ends = (np.hypot(*(first.b - first.a)) + np.hypot(*(second.b - second.a))) / 2
    if shapely.intersection(line, ground).length > within_ends + 0.05:
        return None
    return polygons_of(shapely.buffer(line, BAND_M / 2, cap_style="square"))[0]


def closes_most(rooms: list[Polygon], tall: BaseGeometry) -> bool:
    """Whether the rooms fill half of what the walls span: then the house counts as closed."""
    return bool(sum(r.area for r in rooms) > WALLED * shapely.convex_hull(tall).area)
