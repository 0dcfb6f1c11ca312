"""Find everything that may close the door plane, and close a house that its walls leave open.

R1  Lintels and sills close doors. A gap of full height up to ``gap_m`` wide (``entrance_m`` to the outside) closes if
    no door or lintel runs along it and it does not lie within one room of the source (the bend of an L-shaped hall).
R2  Where the source names its openings or its doors, what stands or hangs right before a named doorway (a beam along
    the wall, a frame deeper than the wall) does not close it: the doorway itself does.
R3  Cracks of a hand's breadth between walls that nearly meet are closed, and so are points in which walls touch.
R4  A gap of up to ``HALL_M`` between the ends of walls in line closes to the outside if only such gaps open a place
    with walls along ``MOSTLY`` of its edge (a hall with a wide entrance). The place has a roof; in a house without
    roofs, three ways lead into it from rooms, or two if it is most of the house, else it is a court.
R5  Floor that is enclosed neither at the ground nor above the doors may be enclosed at a height between (railings).
R6  An open or half-open house gets its boundary from the floor slab if the source has one, ...
R7  ... else from the ends of its walls. The plan is marked in both cases.
R8  A room that the source names, and that walls leave open (under a roof without knee walls), is closed at its edge.
    If such rooms take less than half of the floor, R6 still applies to the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    EMPTY,
    Shapes,
    areas_inside,
    buffer_mitred,
    drop_thin_parts,
    enclosed_area,
    enclosed_pieces,
    fill_enclosed,
    intersect,
    intersect_pairs,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.meshes import box_around_polygon, box_polygon, boxes_around_polygons
from pipeline.geometry.openings import Opening, close_plane, grow_to_overlap
from pipeline.geometry.wall_gaps import (
    WallEnd,
    contact_fillings,
    crack_fillings,
    gap_beyond_wall_end,
    gap_fillings,
    wall_ends,
)
from pipeline.stages.habitable import part_under_cover
from pipeline.tolerances import (
    BESIDE_M,
    CRACK_M,
    HALL_M,
    HAND_M,
    LARGELY,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PASSABLE_M,
    PLACE_M,
    POINT_M,
    SPECK,
    STANDS,
    WALL_M,
)
from pipeline.values import Level, Planes


def find_closing_candidates(level: Level, planes: Planes, config: LayoutConfig) -> list[Opening]:
    """Return everything that may close the door plane; ``sides`` are not known yet (R1)."""
    named = [d for d in planes.doorways if level.names_doors or (level.leaves and d.said_by == "named")]
    before = _before_doorways(named) if named else EMPTY
    lintels = subtract(planes.lintels, before)
    low = subtract(planes.sills, unite([planes.lintels, before]))
    pieces = [Opening.closing(p, "lintel") for p in grow_to_overlap(polygons_of(lintels))]
    pieces += [Opening.closing(p, "sill") for p in grow_to_overlap(polygons_of(low))]
    doorways = zip(planes.doorways, grow_to_overlap([d.polygon for d in planes.doorways]), strict=True)
    pieces += [replace(doorway, polygon=p) for doorway, p in doorways]
    filled = [planes.door, *(p.polygon for p in pieces)]
    ends = list(wall_ends(planes.tall, nibs=True))
    found = gap_fillings(planes.tall, filled, config.gap_m, ends=ends)
    wide = gap_fillings(planes.tall, [*filled, *found], config.entrance_m, ends=ends)
    wide = [gap for gap in wide if box_around_polygon(gap).width > config.gap_m]
    closed = unite([p.polygon for p in pieces] + found) if wide else EMPTY
    gates = [gap for gap in wide if not _is_closed(gap, closed)]
    real = [gap for gap in found if not _runs_along(gap, pieces) and not lies_in_room(gap, level)]
    cracks: list[Polygon] = []
    if not level.sills:  # R3
        standing = unite([*filled, *found])
        cracks = crack_fillings(standing)
        cracks += contact_fillings(unite([*filled, *found, *cracks]) if cracks else standing)
    candidates = [*pieces, *(Opening.closing(gap, "gap") for gap in [*real, *cracks])]
    candidates += [Opening.closing(gap, "gate") for gap in gates]
    return candidates + _wide_gates(level, planes, candidates, ends, config)


def _before_doorways(doorways: Sequence[Opening]) -> BaseGeometry:
    """Return the floor within ``BESIDE_M`` of both faces of each doorway, as wide as it (R2)."""
    boxes = boxes_around_polygons([each.polygon for each in doorways])
    return unite([box_polygon(b, depth=b.thickness + 2 * BESIDE_M) for b in boxes if b.thickness < MOSTLY * b.width])


def _is_closed(gap: Polygon, closed: BaseGeometry) -> bool:
    """Return whether a door, a lintel or a narrower gap stands in a wide gap."""
    return bool(intersect(gap, closed).area > SPECK * gap.area)


def _runs_along(gap: Polygon, pieces: list[Opening]) -> bool:
    """Return whether a door or lintel beside a gap already closes it (a gap between a frame and a curtain; R1)."""
    return box_around_polygon(gap).width > PASSABLE_M and any(
        intersect(gap, buffer_mitred(piece.polygon, BESIDE_M)).area > LARGELY * gap.area for piece in pieces
    )


def lies_in_room(gap: Polygon, level: Level) -> bool:
    """Return whether one room of the source continues through a gap and goes on beyond both of its faces (R1).

    A floor that reaches under a wall ends there.
    """
    box = box_around_polygon(gap)
    if box.thickness < MOSTLY * box.width:
        gap = box_polygon(box, depth=box.thickness + 2 * BESIDE_M)
    return any(
        intersect(gap, room.polygon).area > NEARLY_ALL * gap.area for room in level.rooms if room.polygon is not None
    )


def is_crack(piece: Opening) -> bool:
    """Return whether a piece fills a crack, through which nobody passes (R3)."""
    return piece.closed_by == "gap" and box_around_polygon(piece.polygon).width < PASSABLE_M


def _wide_gates(
    level: Level,
    planes: Planes,
    pieces: list[Opening],
    ends: list[WallEnd],
    config: LayoutConfig,
) -> list[Opening]:
    """Return the wide gaps that are all that leaves a place of the house open (R4)."""
    if level.sills:
        return []
    standing = [planes.door, *(piece.polygon for piece in pieces)]
    found = [
        gap
        for gap in gap_fillings(planes.tall, standing, HALL_M, ends=ends)
        if box_around_polygon(gap).width > config.entrance_m
    ]
    if not found:
        return []
    ground, closed = enclosed_pieces(close_plane(planes.door, pieces))
    known, roofless = unite(closed), not any(_is_covered(room, level) for room in closed)
    house, spanned = shapely.buffer(ground, BESIDE_M, quad_segs=2), shapely.convex_hull(planes.door).area

    def is_of_house(place: Polygon) -> bool:
        return shapely.intersection(place.exterior, house).length > MOSTLY * place.length and (
            _is_covered(place, level) or (roofless and _has_ways(place, pieces, known, MOST * spanned))
        )

    return _gates_into_new_places(found, ground, known, is_of_house, config)


def _gates_into_new_places(
    gaps: list[Polygon],
    ground: BaseGeometry,
    known: BaseGeometry,
    is_of_house: Callable[[Polygon], bool],
    config: LayoutConfig,
) -> list[Opening]:
    """Return, as gates, the gaps that enclose a place of the house that is not ``known`` to be enclosed."""
    new = [
        place
        for place in enclosed_pieces(unite([ground, *grow_to_overlap(gaps)]))[1]
        if place.area >= config.area_m2 and not place.representative_point().intersects(known) and is_of_house(place)
    ]
    around = shapely.buffer(unite(new), BESIDE_M)
    return [Opening.closing(gap, "gate") for gap in gaps if gap.intersects(around)]


def _has_ways(place: Polygon, pieces: list[Opening], rooms: BaseGeometry, main_m2: float) -> bool:
    """Return whether three ways lead from rooms into a place, or two if it is larger than ``main_m2`` (R4)."""
    near = [shapely.buffer(piece.polygon, BESIDE_M) for piece in pieces if not is_crack(piece)]
    ways = sum(bool(each.intersects(place) and each.intersects(rooms)) for each in near)
    return ways >= 3 or (ways > 1 and place.area > main_m2)


def _is_covered(room: Polygon, level: Level) -> bool:
    return bool(intersect(room, part_under_cover(room, level)).area > MOST * room.area)


def boundaries(
    level: Level,
    planes: Planes,
    pieces: list[Opening],
    whole: tuple[BaseGeometry, list[Polygon]],
    config: LayoutConfig,
) -> Iterator[list[Opening]]:
    """Yield alternative sets of closings for a house that its walls leave open (R5 to R8); the largest result counts.

    In the first set, closings between wall ends may end at a wide gap; in the second, only at what surely closes.
    """
    rails = _railings(level, planes, *whole, config)
    ground, rooms = enclosed_pieces(close_plane(whole[0], rails)) if rails else whole
    edges = _edges(level, ground, rooms, config)
    if edges or are_rooms_half_of_house(rooms, planes.tall):
        yield [*rails, *edges]
        return
    sure = [piece for piece in pieces if piece.closed_by != "gate"]
    for plane in [ground, close_plane(planes.door, [*rails, *sure])][: 2 if len(sure) < len(pieces) else 1]:
        yield [*rails, *closings_between_wall_ends(planes.tall, plane, config.area_m2)]


def _railings(
    level: Level, planes: Planes, ground: BaseGeometry, rooms: list[Polygon], config: LayoutConfig
) -> list[Opening]:
    """Return the railings, between h_d and head height, that enclose floor which nothing else encloses (R5)."""
    if level.sills or planes.rails.is_empty:
        return []
    known = unite(rooms)
    fenced = [
        r
        for r in enclosed_pieces(unite([ground, planes.rails]))[1]
        if r.area >= config.area_m2 and not r.representative_point().intersects(known)
    ]
    if not fenced:
        return []
    near = shapely.buffer(unite(fenced), 0.05)
    return [Opening.closing(p, "rail") for p in polygons_of(planes.rails) if p.intersects(near)]


def _edges(level: Level, ground: BaseGeometry, rooms: list[Polygon], config: LayoutConfig) -> list[Opening]:
    """Return the edges of the source's rooms (R8) or of its floor (R6) where they lie open."""
    named = [room.polygon for room in level.rooms if room.polygon is not None]
    edges = bands_around_rooms(named, ground, rooms, config.area_m2)
    if level.floor is None or (edges and unite(named).area > MOST * level.floor.area):
        return edges
    ground = close_plane(ground, edges) if edges else ground
    return [*edges, *bands_at_floor_edge(level.floor, ground, config.area_m2, joined=not level.sills)]


# ---------------------------------------------------------------------------------------------------------------------
# What closes a house that its walls leave open: bands along its floor, its rooms, or between ends of walls.
# ---------------------------------------------------------------------------------------------------------------------

LONGEST_SIDE_M = 10.0


def bands_at_floor_edge(
    floor: BaseGeometry, ground: BaseGeometry, least_m2: float, *, joined: bool = True
) -> list[Opening]:
    """Bands along the edges of the floor slab where it is open.

    ``ground`` is the closed plane so far. A part of the floor that it does not enclose is a room that lacks a wall if
    it has ``least_m2`` and walls along half of its edge. A band continues a wall that ends at the opening and goes on
    behind it; elsewhere the band lies outside the slab, so that all of the slab stays free. A slab may jut out from
    under its walls by a finger's breadth, which leaves a crack between band and wall. Such cracks are filled if they
    leave open a part with walls along ``LARGELY`` of its edge (a terrace has fewer). If an inner wall ends before the
    edge of the slab, the bands on its two sides are ``joined`` if that closes a part. Walls that end before the edge by
    the thickness of a wall, as where an outer wall is missing, are continued to the bands.
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
    """Return fillings between bands in line, at most a wall's thickness apart, with nothing standing between them."""
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
    """Return bands around the source's own rooms that lie open; the bands lie outside all of these rooms.

    Open rooms that meet count together; below ``least_m2`` in all they get no band. ``ground`` is the closed plane so
    far, ``rooms`` are the spaces that it encloses.
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

    That is so if the closing meets one wall, or walls that touch each other, in two places. ``touching``: whether any
    of the walls touch, if that is known.
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
    """Return bands along the open fronts of a single room: the parts of the walls' hull where no wall stands.

    The list is empty if walls stand along less than ``MOSTLY`` of the hull (a corner piece, a stage), or if a front is
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
    """Return bands outside the edges of a floor that walls leave mostly open, except where walls stand.

    A piece of the floor counts if it has ``least_m2`` or more, and walls along ``STANDS`` of its edge, or three
    posts or walls at its edge that carry a ``roof`` over most of it.
    """
    standing = np.array(polygons_of(tall), np.object_)
    near_walls = shapely.buffer(tall, BESIDE_M, quad_segs=2)
    bands: list[Polygon] = []
    for part in polygons_of(drop_thin_parts(floor, PLACE_M)):
        edge = part.exterior
        walled = shapely.intersection(edge, near_walls).length / edge.length
        posts = int(shapely.dwithin(standing, edge, BESIDE_M).sum())
        on_posts = posts >= 3 and intersect(part, roof).area > MOST * part.area
        if part.area < least_m2 or not (walled > STANDS or on_posts):
            continue
        band = subtract(shapely.buffer(part, 2 * HAND_M, join_style="mitre"), unite([part, tall]))
        bands += grow_to_overlap(polygons_of(band))
    return [Opening.closing(band, "floor_edge") for band in bands]


def _bands_between_ends(ends: Sequence[WallEnd], ground: BaseGeometry) -> list[Polygon]:
    """Return the bands that each join two wall ends with nothing standing between the two."""
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
