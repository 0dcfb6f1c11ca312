"""Everything that may close the door plane, and what closes a house that its walls leave open.

R1  Lintels and sills close doors; gaps of full height up to ``gap_m``, to the outside ``entrance_m``, close where no
    door or lintel runs along them, and they do not lie within one room of the source (the bend of an L-shaped hall).
R2  Where the source names its openings, or its doors, what hangs or stands right before a doorway of theirs (a beam
    along the wall, a frame deeper than the wall) does not close it: the doorway does.
R3  Cracks of a hand's breadth between walls that nearly meet are closed, and so are points in which walls touch.
R4  A gap between two railings or low walls, or between one and a wall, closes where that encloses a place under a roof
    that walls bound for the most part: a low front with an entrance in it. In a house without roofs, two doors or more
    lead from rooms into such a place, and walls, windows and doors bound ``LARGELY`` of it.
R5  A gap of up to ``HALL_M`` between the ends of walls in line closes to the outside where only such gaps open a place
    that walls bound for ``MOSTLY`` of its edge: under a roof, or in a house without roofs if ``GROUP`` ways lead into
    it from rooms, or two into one that is most of the house. It is no court then, but a hall with a wide entrance.
R6  Floor that is closed neither at the ground nor above its doors may be closed in between (railings).
R7  An open or half-open house gets its boundary from the floor slab where the source has one, ...
R8  ... else from the ends of its walls. Either is marked in the plan.
R9  A room that the source names, and that walls leave open (under a roof without knee walls), is closed at its edge.
    Where such rooms take less than half of the floor, they say nothing of the rest of it (R7).
R10 A place outside that joins three parts of the house or more, which nothing else joins, and that walls surround for
    the most part, is a hall whose openings are wide: these are closed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    buffer_mitred,
    enclosed_pieces,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.meshes import box_around_polygon, box_polygon, boxes_around_polygons
from pipeline.geometry.open_boundaries import (
    are_rooms_half_of_house,
    bands_across_hall_openings,
    bands_around_rooms,
    bands_at_floor_edge,
    closings_between_wall_ends,
)
from pipeline.geometry.openings import close_plane, grow_to_overlap
from pipeline.geometry.wall_gaps import WallEnd, contact_fillings, crack_fillings, gap_fillings, wall_ends
from pipeline.stages.habitable import (
    part_under_cover,
)
from pipeline.tolerances import (
    BESIDE_M,
    GROUP,
    HALL_M,
    LARGELY,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PASSABLE_M,
    SPECK,
)
from pipeline.values import Layout, Level, Opening, Planes


def find_closing_candidates(level: Level, planes: Planes, config: LayoutConfig) -> list[Opening]:
    """Return everything that may close the door plane, before it is known what it separates (R1)."""
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
    candidates += _gates_of_railings(level, planes, candidates, config)
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


def _gates_of_railings(level: Level, planes: Planes, pieces: list[Opening], config: LayoutConfig) -> list[Opening]:
    """Return the gaps of a low front under a roof (R4)."""
    if level.sills or planes.rails.is_empty:
        return []
    ground = close_plane(planes.door, pieces)
    ends = unite([planes.tall, planes.rails])
    standing = [planes.door, planes.rails, *(p.polygon for p in pieces)]
    found = gap_fillings(ends, standing, config.entrance_m)
    near = shapely.buffer(planes.rails, BESIDE_M)
    found = [gap for gap in found if gap.intersects(near)]
    if not found:
        return []
    fenced = unite([ground, planes.rails])
    closed = enclosed_pieces(fenced)[1]
    known, roofless = unite(closed), not any(_is_covered(room, level) for room in closed)
    beside, house = (shapely.buffer(walls, BESIDE_M, quad_segs=2) for walls in (planes.tall, ground))

    def is_of_house(place: Polygon) -> bool:
        return shapely.intersection(place.exterior, beside).length > MOST * place.length and (
            _is_covered(place, level)
            or (
                roofless
                and shapely.intersection(place.exterior, house).length > LARGELY * place.length
                and sum(_leads_into(piece, place, known) for piece in pieces) > 1
            )
        )

    return _gates_into_new_places(found, fenced, known, is_of_house, config)


def _wide_gates(
    level: Level,
    planes: Planes,
    pieces: list[Opening],
    ends: list[WallEnd],
    config: LayoutConfig,
) -> list[Opening]:
    """Return the wide openings of walls that alone leave a place of the house open (R5)."""
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
    """Return, as gates, the gaps that enclose a place of the house outside what is ``known`` to be enclosed."""
    new = [
        place
        for place in enclosed_pieces(unite([ground, *grow_to_overlap(gaps)]))[1]
        if place.area >= config.area_m2 and not place.representative_point().intersects(known) and is_of_house(place)
    ]
    around = shapely.buffer(unite(new), BESIDE_M)
    return [Opening.closing(gap, "gate") for gap in gaps if gap.intersects(around)]


def _has_ways(place: Polygon, pieces: list[Opening], rooms: BaseGeometry, main_m2: float) -> bool:
    """Return whether ``GROUP`` ways lead from rooms into a place, or two into one of more than ``main_m2`` (R5)."""
    near = [shapely.buffer(piece.polygon, BESIDE_M) for piece in pieces if not is_crack(piece)]
    ways = sum(bool(each.intersects(place) and each.intersects(rooms)) for each in near)
    return ways >= GROUP or (ways > 1 and place.area > main_m2)


def _is_covered(room: Polygon, level: Level) -> bool:
    return bool(intersect(room, part_under_cover(room, level)).area > MOST * room.area)


def _leads_into(piece: Opening, place: Polygon, rooms: BaseGeometry) -> bool:
    """Return whether a door or a lintel stands between a place and a room."""
    near = shapely.buffer(piece.polygon, BESIDE_M)
    return piece.closed_by in {"door", "opening", "lintel"} and bool(near.intersects(place) and near.intersects(rooms))


def boundaries(
    level: Level,
    planes: Planes,
    pieces: list[Opening],
    whole: tuple[BaseGeometry, list[Polygon]],
    config: LayoutConfig,
) -> Iterator[list[Opening]]:
    """Yield what may close the house where its walls leave it open (R6, R7, R8, R9); the largest house counts.

    A closing between the ends of walls may also end at a wide gap, or only at what surely closes.
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
    """Return the railings, between h_d and head height, that enclose floor which nothing else encloses (R6)."""
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
    """Return the edges of the source's rooms (R9) or of its floor (R7) where they lie open."""
    named = [room.polygon for room in level.rooms if room.polygon is not None]
    edges = bands_around_rooms(named, ground, rooms, config.area_m2)
    if level.floor is None or (edges and unite(named).area > MOST * level.floor.area):
        return edges
    if edges:
        ground = close_plane(ground, edges)
    return [*edges, *bands_at_floor_edge(level.floor, ground, config.area_m2, joined=not level.sills)]


def hall_closings(layout: Layout, least_m2: float) -> list[Opening]:
    """Return the bands that close the openings of a hall (R10)."""
    openings = [(c.polygon, set(c.sides)) for c in layout.candidates if c.is_strip]
    joined = (sides for _, sides in openings if len(sides) == 2 and OUTSIDE not in sides)
    part = {room: k for k, rooms in enumerate(connected_groups(len(layout.rooms), joined)) for room in rooms}
    ways = [(p, part[room]) for p, sides in openings if OUTSIDE in sides for room in sides - {OUTSIDE}]
    return bands_across_hall_openings(layout.ground, ways, least_m2)
