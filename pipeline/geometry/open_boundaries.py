"""Find what closes a house that its walls leave open: bands along its floor, its rooms, or between ends of walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    Shapes,
    areas_inside,
    buffer_mitred,
    drop_thin_parts,
    enclosed_area,
    fill_enclosed,
    intersect,
    intersect_pairs,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.openings import Opening, area_outside, grow_to_overlap
from pipeline.geometry.wall_gaps import WallEnd, gap_beyond_wall_end, wall_ends
from pipeline.tolerances import (
    BESIDE_M,
    CRACK_M,
    GROUP,
    HAIR_M,
    HALL_M,
    HAND_M,
    LARGELY,
    MOST,
    MOSTLY,
    PLACE_M,
    POINT_M,
    SOME,
    STANDS,
    WALL_M,
)

LONGEST_SIDE_M = 10.0
DISCS_M = (1.0, 1.5, 2.0, 2.5)


def bands_at_floor_edge(
    floor: BaseGeometry, ground: BaseGeometry, least_m2: float, *, joined: bool = True
) -> list[Opening]:
    """Bands along the edges of the floor slab where it is open.

    ``ground`` is the closed plane so far. A part of the floor that it does not enclose is a room that lacks a wall if
    it has ``least_m2`` and walls along half of its edge. Where a wall ends at the opening and goes on behind it, the
    band goes on from its end; elsewhere it lies outside the slab, so that all of the slab stays free. A slab may jut
    out from under its walls by a finger's breadth, so that a band lies a crack away from them: where such cracks leave
    a part open that has walls along ``LARGELY`` of its edge, they are filled; a terrace has fewer. Where an inner wall
    ends before the edge of the slab, the bands on its two sides are ``joined`` if that closes a part. Where walls end
    before it by the thickness of a wall, as around an outer wall that is missing, they go on to the bands.
    """
    open_floor = polygons_of(drop_thin_parts(subtract(floor, fill_enclosed(ground)), 0.5))
    large = [part for part in open_floor if part.area >= least_m2]
    if not large:
        return []
    bands: list[Polygon] = []
    insides: list[Point] = []
    ends = list(wall_ends(ground))
    near_walls = shapely.buffer(ground, BESIDE_M, quad_segs=2)
    for part in large:
        edge = part.exterior
        walled = shapely.intersection(edge, near_walls).length / edge.length
        if walled < MOST:
            continue
        bare = shapely.difference(edge, shapely.buffer(ground, 0.02, quad_segs=2))
        going_on = [
            gap
            for end in ends
            if (gap := gap_beyond_wall_end(end, ground, LONGEST_SIDE_M)) is not None and _lies_along(gap, bare)
        ]
        bands += going_on
        rest = shapely.difference(bare, shapely.buffer(unite(going_on), BESIDE_M, cap_style="flat"))
        if rest.length > BESIDE_M:
            lines = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(rest)))
            band = shapely.buffer(lines, HAND_M, cap_style="square", join_style="mitre")
            bands += polygons_of(subtract(band, unite([floor, ground])))
            inside = part.representative_point()
            insides.append(inside)
            if walled > LARGELY and not fill_enclosed(unite([ground, *bands])).contains(inside):
                bands += _in_cracks(bands, ground)
    if joined and not all(fill_enclosed(unite([ground, *bands])).contains(inside) for inside in insides):
        bands += _between_bands(bands, unite([floor, ground]))
    if joined and not all(fill_enclosed(unite([ground, *bands])).contains(inside) for inside in insides):
        edge = unite(bands)
        bands += [gap for end in ends if (gap := gap_beyond_wall_end(end, edge, WALL_M)) is not None]
    return [Opening.closing(band, "floor_edge") for band in bands]


def _between_bands(bands: list[Polygon], standing: BaseGeometry) -> list[Polygon]:
    """Return what joins bands that lie in line, a wall's thickness apart at most, over nothing that stands there."""
    whole = buffer_mitred(buffer_mitred(unite(bands), WALL_M / 2), -WALL_M / 2)
    return grow_to_overlap(polygons_of(subtract(whole, unite([standing, *bands]))))


def _in_cracks(bands: list[Polygon], ground: BaseGeometry) -> list[Polygon]:
    """Return what fills the cracks between bands and the walls beside them."""
    house = unite([ground, *bands])
    whole = shapely.buffer(buffer_mitred(house, CRACK_M), -CRACK_M, join_style="mitre")
    near = shapely.buffer(unite(bands), 2 * CRACK_M)
    return grow_to_overlap(polygons_of(intersect(subtract(whole, house), near)))


def bands_around_rooms(
    named: list[Polygon], ground: BaseGeometry, rooms: list[Polygon], least_m2: float
) -> list[Opening]:
    """Bands around those of the source's own rooms that lie open; they lie outside all of these rooms.

    Rooms that lie open and meet count together: around less than ``least_m2`` there is no band. ``ground`` is the
    closed plane so far and ``rooms`` what it encloses.
    """
    if not named:
        return []
    drawn, spaces = np.array(named, np.object_), np.array(rooms, np.object_)
    of_drawn, of_space = shapely.STRtree(spaces).query(drawn, predicate="intersects")
    shared = shapely.area(intersect_pairs(drawn[of_drawn], spaces[of_space]))
    area, covered = shapely.area(drawn), np.bincount(of_drawn, shared, minlength=len(named))
    lying_open = drawn[covered < MOST * area]
    wider = polygons_of(unite(buffer_mitred(room, HAND_M) for room in lying_open))
    wide = [group for group in wider if areas_inside(lying_open, group).sum() >= least_m2]
    bands = polygons_of(subtract(unite(wide), unite([*named, ground]))) if wide else []
    return [Opening.closing(band, "room_edge") for band in bands]


def _lies_along(gap: Polygon, edge: BaseGeometry) -> bool:
    return bool(intersect(gap, shapely.buffer(edge, BESIDE_M, quad_segs=2)).area > 0.9 * gap.area)


def closings_between_wall_ends(tall: BaseGeometry, ground: BaseGeometry, least_m2: float) -> list[Opening]:
    """Straight closings between wall ends, shortest first, each kept if it encloses ``least_m2`` more.

    Once half of what the walls span is enclosed, only fronts no wider than those closed so far are closed.
    """
    ends = list(wall_ends(tall))
    straight = [gap_beyond_wall_end(end, ground, LONGEST_SIDE_M) for end in ends]
    candidates = [c for c in straight if c is not None] + _bands_between_ends(ends, ground)
    candidates.sort(key=lambda c: (round(c.length, 6), c.bounds))
    kept: list[Polygon] = []
    so_far = enclosed_area(ground)
    parts = np.array(polygons_of(ground), dtype=np.object_)
    hull = shapely.convex_hull(tall).area
    touching = bool(candidates) and _do_any_touch(parts)
    for candidate in candidates:
        if so_far > MOST * hull and (not kept or candidate.length > kept[-1].length + 2 * HAND_M):
            break
        if not makes_a_ring(candidate, parts, touching=touching):
            continue
        met = shapely.intersects(parts, candidate)
        joined = np.array([*polygons_of(unite([*parts[met], candidate])), *parts[~met]], dtype=np.object_)
        area = enclosed_area(shapely.multipolygons(joined))
        if area >= so_far + least_m2:
            kept.append(candidate)
            parts, so_far, touching = joined, area, _do_any_touch(joined)
    return [Opening.closing(band, "wall_ends") for band in kept]


def makes_a_ring(closing: Polygon, parts: Shapes, *, touching: bool | None = None) -> bool:
    """Return whether walls, polygons (n,), may enclose more with a closing.

    It meets one of them, or what touches it, in two places. ``touching``: whether any of them touch, if that is known.
    """
    met = parts[shapely.intersects(parts, closing)]
    shared = intersect_pairs(met, np.full(len(met), closing, np.object_))
    if (shapely.get_num_geometries(shared) > 1).any():
        return True
    if len(met) < 2:
        return False
    return _do_any_touch(parts) if touching is None else touching


def _do_any_touch(parts: Shapes) -> bool:
    one, other = shapely.STRtree(parts).query(parts, predicate="dwithin", distance=POINT_M)
    return bool((one != other).any())


def bands_at_open_fronts(tall: BaseGeometry, least_m2: float) -> list[Opening]:
    """Bands along the fronts of a single room that is open to one side or two: where no wall stands along its hull.

    There are none where walls stand along less than ``MOSTLY`` of it (a corner piece, a stage), or where a front is
    wider than ``HALL_M``.
    """
    hull = shapely.convex_hull(tall)
    if hull.geom_type != "Polygon" or hull.area < least_m2:
        return []
    bare = shapely.difference(hull.exterior, shapely.buffer(tall, BESIDE_M, quad_segs=2))
    fronts = shapely.get_parts(shapely.line_merge(bare)) if not bare.is_empty else np.zeros(0, np.object_)
    if bare.length > (1 - MOSTLY) * hull.length or any(front.length > HALL_M for front in fronts):
        return []
    bands = shapely.buffer(fronts, BESIDE_M, cap_style="square", join_style="mitre")
    inner = shapely.buffer(hull, -HAND_M, join_style="mitre")
    parts = [part for band in bands for part in polygons_of(subtract(band, unite([inner, tall])))]
    return [Opening.closing(part, "wall_ends") for part in parts]


def bands_around_open_house(
    floor: BaseGeometry, roof: BaseGeometry, tall: BaseGeometry, least_m2: float
) -> list[Opening]:
    """Bands outside the edges of a floor of which walls leave most open, but where walls stand.

    Each piece of the floor of ``least_m2`` or more counts that has walls along ``STANDS`` of its edge, or that lies
    under a ``roof`` for the most part, on ``GROUP`` posts or walls at its edge.
    """
    standing = np.array(polygons_of(tall), np.object_)
    near_walls = shapely.buffer(tall, BESIDE_M, quad_segs=2)
    bands: list[Polygon] = []
    for part in polygons_of(drop_thin_parts(floor, PLACE_M)):
        edge = part.exterior
        walled = shapely.intersection(edge, near_walls).length / edge.length
        posts = int(shapely.dwithin(standing, edge, BESIDE_M).sum())
        on_posts = posts >= GROUP and intersect(part, roof).area > MOST * part.area
        if part.area < least_m2 or not (walled > STANDS or on_posts):
            continue
        band = subtract(shapely.buffer(part, 2 * HAND_M, join_style="mitre"), unite([part, tall]))
        bands += grow_to_overlap(polygons_of(band))
    return [Opening.closing(band, "floor_edge") for band in bands]


def bands_across_hall_openings(
    ground: BaseGeometry, ways: Sequence[tuple[BaseGeometry, int]], least_m2: float
) -> list[Opening]:
    """Bands across the openings of a hall that lies open, where it is what joins the parts of the house.

    ``ground`` is the closed plane so far; ``ways`` are its entrances, each with the number of the part of the house
    that it leads into. A hall is a place that a disc cannot enter from outside, with ways into ``GROUP`` parts or
    more, whose openings take ``SOME`` of its edge at most. The smallest disc of ``DISCS_M`` that stays out is taken.
    """
    if len({part for _, part in ways}) < GROUP:
        return []
    air = area_outside(ground, 2 * DISCS_M[-1] + 1.0)
    for radius in DISCS_M:
        wide = [p for p in polygons_of(shapely.buffer(air, -radius)) if len(p.interiors)]
        reached = shapely.buffer(unite(wide), radius + HAIR_M)
        bands: list[Polygon] = []
        for hall in polygons_of(drop_thin_parts(subtract(air, reached), 2 * BESIDE_M)):
            into = {part for way, part in ways if way.distance(hall) < BESIDE_M}
            if hall.area < least_m2 or len(into) < GROUP:
                continue
            bare = shapely.difference(hall.exterior, shapely.buffer(ground, BESIDE_M / 2, quad_segs=2))
            edges = [e for e in shapely.get_parts(shapely.line_merge(bare)) if e.length > BESIDE_M]
            if sum(edge.length for edge in edges) < SOME * hall.length:
                bands += [band for edge in edges for band in polygons_of(_across_opening(edge, ground))]
        if bands:
            return [Opening.closing(band, "wall_ends") for band in bands]
    return []


def _across_opening(edge: BaseGeometry, ground: BaseGeometry) -> BaseGeometry:
    """Return the straight band between the walls that are nearest to the ends of an open edge."""
    ends = [shapely.get_point(edge, 0), shapely.get_point(edge, -1)]
    line = shapely.linestrings([shapely.get_coordinates(shapely.shortest_line(ground, end))[0] for end in ends])
    return subtract(shapely.buffer(line, HAND_M / 2, cap_style="square"), ground)


def _bands_between_ends(ends: Sequence[WallEnd], ground: BaseGeometry) -> list[Polygon]:
    """Return the bands between two wall ends each, where nothing but the ends themselves stands between them."""
    middles = np.array([(end.a + end.b) / 2 for end in ends]).reshape(-1, 2)
    widths = np.array([np.hypot(*(end.b - end.a)) for end in ends])
    one, other = np.triu_indices(len(ends), 1)
    lengths = np.hypot(*(middles[other] - middles[one]).T)
    near = (lengths > 0.05) & (lengths <= LONGEST_SIDE_M)
    one, other = one[near], other[near]
    lines = shapely.linestrings(np.stack([middles[one], middles[other]], axis=1))
    parts = np.array(polygons_of(ground), dtype=np.object_)
    line, part = shapely.STRtree(parts).query(lines, predicate="intersects")
    crossed = shapely.length(shapely.intersection(lines[line], parts[part]))
    inside = np.bincount(line, crossed, minlength=len(lines))
    free = inside <= (widths[one] + widths[other]) / 2 + 0.05
    return [polygons_of(band)[0] for band in shapely.buffer(lines[free], HAND_M / 2, cap_style="square")]


def are_rooms_half_of_house(rooms: list[Polygon], tall: BaseGeometry) -> bool:
    """Return whether the rooms fill half of what the walls span: then the house counts as closed."""
    return bool(sum(r.area for r in rooms) > MOST * shapely.convex_hull(tall).area)
