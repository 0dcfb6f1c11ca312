"""Close the openings of the door plane so that walls enclose spaces, as Algorithm 1 assumes, or reject the level.

R1  Lintels and sills close doors; gaps of full height up to ``gap_m``, to the outside ``entrance_m``, are closed
    where that parts two spaces, no door or lintel runs along them, and they do not lie within one room of the source
    (the bend of an L-shaped hall).
R18 Where the source names its openings, or its doors, what hangs or stands right before a doorway of theirs (a beam
    along the wall, a frame deeper than the wall) does not close it: the doorway does.
R21 A lintel over one room of the source, which no wall but posts and nibs goes on from, is a beam and closes nothing. A
    room that is most of what the source draws may be the floor of a storey, and says nothing.
R24 A gap of up to ``HALL_M`` between the ends of walls in line closes to the outside where only such gaps open a place
    that walls bound for ``MOSTLY`` of its edge: under a roof, or in a house without roofs if ``GROUP`` ways lead into
    it from rooms, or two into one that is most of the house. It is no court then, but a hall with a wide entrance.
R19 Cracks of a hand's breadth between walls that nearly meet are closed, and so are points in which walls touch.
R2  Floor that is closed neither at the ground nor above its doors may be closed in between (railings).
R17 A gap between two railings or low walls, or between one and a wall, closes where that encloses a place under a roof
    that walls bound for the most part: a low front with an entrance in it. In a house without roofs, two doors or more
    lead from rooms into such a place, and walls, windows and doors bound ``LARGELY`` of it.
R3  An open or half-open house gets its boundary from the floor slab where the source has one, ...
R4  ... else from the ends of its walls. Either is marked in the plan.
R5  A piece that parts nothing (a shelf, a wall cabinet) is dropped, and so is a beam: one that spans more than
    ``beam_m`` between walls that cross its line, or between pillars that leave nearly the whole breadth of the room
    open on both sides, or more than ``header_m`` and hangs down by a hand's breadth at most. Wide bays in a row with
    nothing but pillars between them are one opening. So are ``GROUP`` gaps or more in a row between the same two
    spaces, with posts between them (a colonnade).
R6  A gap is dropped where it would part off less than a room, but for a closet that is wider than it. So are all strips
    around a space that has less than ``walled`` of its edge along walls (what hangs from a ceiling is no room), or that
    is too narrow to stand in.
R7  Walls that spell characters are no layout: strokes that stand apart from each other without a door in any of them,
    and that enclose little of what they span. Characters have no floor of their own and no furniture; each takes a
    small part of what all of them span, has its place to itself, and encloses no more than ``GROUP`` spaces.
R9, R10  Which of the spaces are rooms, and what of them is floor, says ``stages.habitable``.
R11  A room that the source names, and that walls leave open (under a roof without knee walls), is closed at its edge.
    Where such rooms take less than half of the floor, they say nothing of the rest of it (R3).
R13 Where a room is narrow between two broad parts of it, these are rooms of their own, unless the source says that
    they are one room, or names openings, and none there (``geometry.closing_candidates``, mouths). In a world that
    robots drive through, a gap is a way though doors have names (``Level.unnamed_gaps``). A door of such a world that
    parts nothing by itself, beside a mouth, closes with it, and so does a lintel where no openings have names. So does
    a gap in another wall: of two ways into a side room, one may be wide, and neither parts it alone.
R23 A door that the source names parts two rooms. Where both of its faces look into one, because its wall goes on under
    a beam or ends before another wall, what closes that line closes: lintels and gaps up to ``entrance_m``.
R16 Where two rooms that the source draws meet between the ends of a wall (``geometry.doorless_openings``), and that
    parts them, there is an opening.
R12 Where all that leaves no room, and walls surround one place nearly all round, what they leave open is its front.
R14 A place outside that joins three parts of the house or more, which nothing else joins, and that walls surround for
    the most part, is a hall whose openings are wide: these are closed.
R15 A slit between two walls, too narrow for anybody, parts the rooms at its ends.
R22 Where a scan ends and nothing stands (``Evidence.open_edge``), the house is closed as by its walls, and what closes
    it there is the edge of its floor (R3). That it was not seen whole makes it no stage (R20).
R20 What has walls on two sides only is a stage, and no room: where what was guessed to close the house takes more than
    ``OPEN_EDGE`` of the edges of all rooms together, and no room has a name, there is no layout.
R25 Where the source names no walls, a room that is most of what it draws may be a whole storey under the name of one
    (an artist's mesh, whose floor is called "Room"): the layout is found without it, and stands if it takes
    ``LARGELY`` of it. Otherwise that room closes at its edge (R11), and parts at mouths (R13).
R8  Nor has what encloses less than ``area_m2`` after all this.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import networkx as nx
import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    are_too_narrow,
    buffer_mitred,
    dot_product,
    enclosed_pieces,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.closing_candidates import (
    WallEnd,
    are_rooms_half_of_house,
    assign_sides,
    bands_across_hall_openings,
    bands_around_rooms,
    bands_at_floor_edge,
    bands_at_open_fronts,
    close_plane,
    closings_between_wall_ends,
    contact_fillings,
    crack_fillings,
    gap_fillings,
    grow_to_overlap,
    minimal_separators,
    mouth_fillings,
    split_at_portals,
    wall_ends,
)
from pipeline.geometry.doorless_openings import find_doorless_openings
from pipeline.geometry.doorways import Doorway, box_around_polygon, box_polygon, boxes_around_polygons
from pipeline.geometry.portals import Portal
from pipeline.rejection import Reason, Rejection
from pipeline.stages.habitable import (
    clip_rooms_to_floor,
    filled_spaces,
    keep_habitable_spaces,
    part_under_cover,
)
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    CRACK_M,
    DOORWAY_M,
    GROUP,
    HAIR_M,
    HALL_M,
    HAND_M,
    LAP_M,
    LARGELY,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    OPEN_EDGE,
    PARALLEL,
    PASSABLE_M,
    SOME,
    SPECK,
    THICK_WALL_M,
)
from pipeline.values import ClosingCandidate, Evidence, Layout, Level, Planes

KNOWN = frozenset({"door", "opening"})
EDGES = frozenset({"rail", "room_edge", "floor_edge", "wall_ends"})
CLOSET_M2 = 0.9
SLIT_M = 0.25
WHOLE_BREADTH = 0.85


def close_openings(level: Level, evidence: Evidence, planes: Planes, config: LayoutConfig) -> Layout:
    """Close the walls of the door plane; raise Rejection if nothing worth a plan is enclosed."""
    storey = _storey_drawn_as_room(level)
    if storey is not None:  # R25
        others = tuple(room for room in level.rooms if room.polygon is not storey)
        try:
            found = _close(replace(level, rooms=others), evidence, planes, config)
        except Rejection:
            pass
        else:
            if intersect(storey, unite(found.rooms)).area > LARGELY * storey.area:
                return found
    return _close(level, evidence, planes, config)


def _storey_drawn_as_room(level: Level) -> Polygon | None:
    """Return the room that is most of what a source draws that names no walls, or None (R25)."""
    rooms = [] if level.only_walls else [room.polygon for room in level.rooms if room.polygon is not None]
    largest = max(rooms, key=lambda room: room.area, default=None)
    return largest if largest is not None and largest.area > MOST * sum(room.area for room in rooms) else None


def _close(level: Level, evidence: Evidence, planes: Planes, config: LayoutConfig) -> Layout:
    walls, ends = planes.door, [ClosingCandidate(p, "floor_edge") for p in polygons_of(evidence.open_edge)]
    if ends:  # R22
        planes = replace(
            planes,
            door=unite([planes.door, evidence.open_edge]),
            tall=unite([planes.tall, evidence.open_edge]),
        )
    pieces = find_closing_candidates(level, planes, config)
    whole = enclosed_pieces(close_plane(planes.door, pieces))
    if config.characters and (level.sills or not (_is_floored(level, planes, whole[1]) or level.n_objects)):
        _reject_characters(planes, whole[1])

    def within(fixed: list[ClosingCandidate]) -> Layout:
        """Return the layout in which all of ``fixed`` closes, whether or not it separates anything."""
        standing = close_plane(planes.door, fixed) if fixed else planes.door
        ground, rooms = enclosed_pieces(close_plane(standing, pieces)) if fixed else whole
        strips, rest = split_at_portals(standing, pieces, ground, rooms)
        strips = [strip for strip in strips if not _is_beam_in_room(strip, standing, level)]  # R21
        strips, ground, rooms = _keep_separating(standing, evidence.shallow_headers, strips, rest, config)
        if not level.sills and (
            slits := [slit for room in rooms for slit in _impassable_slits(room, config.area_m2)]
        ):  # R15
            ground, rooms = enclosed_pieces(unite([ground, *slits]))
        ways, ground, rooms = _at_doorless_openings(level, planes.door, ground, rooms)  # R16
        strips = strips + ways
        gapless = level.sills or (bool(level.openings) and not level.unnamed_gaps)
        if not gapless:  # R13
            doorways = _without_effect(pieces, KNOWN if level.unnamed_gaps else {"lintel"}, strips, ground)
            strips, ground, rooms = _part_at_mouths(level, doorways, (strips, ground, rooms))
            if gaps := _without_effect(pieces, {"gap"}, strips, ground):
                strips, ground, rooms = _part_at_mouths(level, gaps, (strips, ground, rooms))
        strips, ground, rooms = _in_line_with_idle_doors(
            planes.doorways, pieces, (strips, ground, rooms), config
        )  # R23
        candidates = assign_sides(strips + fixed, rooms, ground)
        filled = filled_spaces(rooms, candidates, evidence, level)  # what hangs over their edges is no way outside
        candidates = [c for c in candidates if c.portal is None or not filled.intersection(c.portal.sides)] + ends
        kept = keep_habitable_spaces(rooms, candidates, planes, evidence, level, filled=filled)
        of_rooms = clip_rooms_to_floor(kept, level)
        sides = tuple(assign_sides(candidates, of_rooms, ground))
        return Layout(walls, ground, sides, tuple(of_rooms), tuple(rooms), tuple(candidates))

    found = max(map(within, _boundaries(level, planes, pieces, whole, config)), key=_area)
    if not found.rooms and (
        fronts := [ClosingCandidate(p, "wall_ends") for p in bands_at_open_fronts(planes.tall, config.area_m2)]
    ):  # R12
        found = within(fronts)
    if not level.sills and (
        openings := [ClosingCandidate(p, "wall_ends") for p in _of_hall(found, config.area_m2)]
    ):  # R14
        edges = [c for c in found.candidates if c.kind in EDGES and c not in ends]
        found = within([*edges, *openings])
    area = _area(found)
    if area < config.area_m2:  # R8
        raise Rejection(
            "layout",
            Reason.NOT_ENCLOSED,
            f"the walls enclose {area:.2f} m2, expected at least {config.area_m2:g} m2; "
            + _what_stands(planes, whole[1]),
            "walls must close at some height up to the ceiling, or the house needs a floor slab" + _guesses(level),
        )
    is_named = any(room.polygon is not None for room in level.rooms)
    if (
        not (level.sills or level.walls.is_cloud or is_named) and (open_share := _open_share(found, ends)) > OPEN_EDGE
    ):  # R20
        raise Rejection(
            "layout",
            Reason.NOT_ENCLOSED,
            f"nothing stands along {open_share:.0%} of the edge of the rooms: walls on two sides are no room",
            "draw the walls that are missing, or give the rooms names",
        )
    return found


def _guesses(level: Level) -> str:
    """Say what of the size was guessed, for the advice on a mesh without rooms: another size may give some."""
    if level.provenance.get("source") != "mesh" or not level.guesses:
        return ""
    size = f"a unit of {level.provenance['units']}, {level.provenance['up']} up"
    return f"; {size} is a guess ({', '.join(level.guesses)}): if it is wrong, say --units, --scale or --up"


def _what_stands(planes: Planes, spaces: list[Polygon]) -> str:
    """Say which walls there are, and what they close, for the message on a house without rooms (R8)."""
    parts = polygons_of(planes.door)
    if not parts:
        return "nothing stands up to the height of doors"
    x1, y1, x2, y2 = shapely.total_bounds(parts)
    pieces = "one piece" if len(parts) == 1 else f"{len(parts)} pieces"
    found = f"walls stand in {pieces} on {x2 - x1:.1f} x {y2 - y1:.1f} m"
    if not spaces:
        return f"{found}, and close no place all round"
    return f"{found}; the largest of {len(spaces)} closed places has {spaces[0].area:.1f} m2"


def _without_effect(
    pieces: Sequence[ClosingCandidate],
    kinds: Collection[str],
    strips: Sequence[ClosingCandidate],
    ground: BaseGeometry,
) -> list[ClosingCandidate]:
    """Return what parted nothing of some kinds: doors and openings, lintels over doorways of others, gaps (R13).

    A wide opening beside a doorway may leave nothing that the doorway parts by itself. A lintel or a gap that would
    part spaces was dropped for another reason, and is not returned.
    """
    taken = unite([strip.polygon for strip in strips])
    found = [piece for piece in pieces if piece.kind in kinds]
    found = [piece for piece in found if intersect(piece.polygon, taken).area < MOST * piece.polygon.area]
    found = [piece for piece in found if piece.kind != "lintel" or _is_over_doorway(piece.polygon)]
    if all(piece.kind in KNOWN for piece in found):
        return found
    closed, parts = enclosed_pieces(close_plane(ground, found))
    return [piece for piece in found if not _parts_spaces(piece, ground, closed, parts)]


def _part_at_mouths(
    level: Level,
    beside: Sequence[ClosingCandidate],
    found: tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]],
) -> tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]]:
    """Return the strips, the closed plane and its spaces with the mouths, and what parts only ``beside`` them (R13).

    A gap in line with a mouth is one of its row (``mouth_fillings``), and does not close beside it.
    """
    strips, ground, rooms = found
    storey = _storey_drawn_as_room(level)
    drawn = replace(level, rooms=tuple(room for room in level.rooms if room.polygon is not storey)) if storey else level
    for row in mouth_fillings(*_closed_by(ground, beside, rooms)):
        if any(_lies_in_room(mouth, drawn) for mouth in row):
            continue
        mouths = [ClosingCandidate(mouth, "mouth") for mouth in row]
        others = [
            piece
            for piece in beside
            if piece.kind != "gap" or not any(_width_in_line(mouth, piece.polygon) for mouth in row)
        ]
        closed, parts = enclosed_pieces(close_plane(ground, mouths + others))
        needed = [piece for piece in others if _is_crack(piece) or _parts_spaces(piece, ground, closed, parts)]
        if len(needed) < len(others):
            closed, parts = enclosed_pieces(close_plane(ground, mouths + needed))
        ways = split_at_portals(ground, mouths + needed, closed, parts)[0]
        if any(way.kind == "mouth" for way in ways):
            strips, ground, rooms = strips + ways, closed, parts
    return strips, ground, rooms


def _in_line_with_idle_doors(
    doorways: Sequence[Doorway],
    pieces: Sequence[ClosingCandidate],
    found: tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]],
    config: LayoutConfig,
) -> tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]]:
    """Return the strips, the closed plane and its spaces with those of named doors that parted nothing (R23)."""
    strips, ground, rooms = found
    named = unite([each.polygon for each in doorways if each.source == "named" and each.has_door])
    if named.is_empty:
        return found
    taken = unite([strip.polygon for strip in strips])
    idle = [
        each
        for each in pieces
        if each.kind in {"door", "lintel", "gate"} and intersect(each.polygon, taken).area < MOST * each.polygon.area
    ]
    for door in [each for each in idle if each.kind == "door" and each.polygon.intersects(named)]:
        in_line = [
            replace(each, polygon=box_polygon(box_around_polygon(each.polygon), width=width + 2 * BESIDE_M))
            for each in idle
            if each.kind != "door" and (width := _width_in_line(door.polygon, each.polygon))
        ]
        if not in_line or _parting(door, in_line, ground, config) is None:
            continue
        for each in list(in_line):
            fewer = [other for other in in_line if other is not each]
            in_line = fewer if _parting(door, fewer, ground, config) is not None else in_line
        closed, parts = _parting(door, in_line, ground, config) or (ground, rooms)
        ways = split_at_portals(ground, [door, *in_line], closed, parts)[0]
        strips, ground, rooms = strips + ways, closed, parts
    return strips, ground, rooms


def _parting(
    door: ClosingCandidate, beside: Sequence[ClosingCandidate], ground: BaseGeometry, config: LayoutConfig
) -> tuple[BaseGeometry, list[Polygon]] | None:
    """Return the plane and its spaces where a door, closed with others, parts two that are rooms, else None (R23)."""
    closed, parts = enclosed_pieces(close_plane(ground, [door, *beside]))
    ways = split_at_portals(ground, [door], closed, parts)[0]
    sides = [way.portal.sides for way in ways if way.portal is not None]
    are_rooms = (
        one != other and OUTSIDE not in {one, other} and min(parts[one].area, parts[other].area) >= config.area_m2
        for one, other in sides
    )
    return (closed, parts) if any(are_rooms) else None


def _width_in_line(door: Polygon, other: Polygon) -> float:
    """Return the width of a piece that is as thin as a wall and in line with a door, else 0 (R23)."""
    box, there = box_around_polygon(door), box_around_polygon(other)
    aside = abs(float(dot_product(there.centre - box.centre, box.across)))
    runs = abs(float(dot_product(box.along, there.along))) > PARALLEL
    in_line = runs and there.thickness <= THICK_WALL_M and aside <= (box.thickness + there.thickness) / 2
    return there.width if in_line else 0.0


def _is_over_doorway(lintel: Polygon) -> bool:
    """Return whether a lintel is as wide as a doorway, and no deeper than a wall."""
    box = box_around_polygon(lintel)
    return DOORWAY_M[0] <= box.width <= DOORWAY_M[1] and box.thickness <= THICK_WALL_M


def _is_crack(piece: ClosingCandidate) -> bool:
    """Return whether a piece fills a crack, through which nobody passes (R19)."""
    return piece.kind == "gap" and box_around_polygon(piece.polygon).width < PASSABLE_M


def _parts_spaces(piece: ClosingCandidate, ground: BaseGeometry, closed: BaseGeometry, parts: list[Polygon]) -> bool:
    """Return whether a piece leads from one space of the closed plane to another (R13)."""
    ways = split_at_portals(ground, [piece], closed, parts)[0]
    return any(way.portal is not None and way.portal.sides[0] != way.portal.sides[1] for way in ways)


def _closed_by(
    ground: BaseGeometry, pieces: Sequence[ClosingCandidate], rooms: list[Polygon]
) -> tuple[list[Polygon], BaseGeometry]:
    """Return the spaces and the plane that more pieces close."""
    if not pieces:
        return rooms, ground
    closed, parts = enclosed_pieces(close_plane(ground, pieces))
    return parts, closed


def _open_share(found: Layout, unseen: Sequence[ClosingCandidate]) -> float:
    """Return the share of the edges of all rooms that only guesses close (R20), without what was not seen (R22)."""
    guessed = unite([c.polygon for c in found.candidates if c.kind in {"floor_edge", "wall_ends"} and c not in unseen])
    if guessed.is_empty:
        return 0.0
    near = shapely.buffer(guessed, CRACK_M, quad_segs=2)
    bare = shapely.difference(near, shapely.buffer(found.door, 2 * HAND_M, quad_segs=2))
    edges = [room.exterior for room in found.rooms]
    return float(shapely.length(shapely.intersection(edges, bare)).sum() / shapely.length(edges).sum())


def _at_doorless_openings(
    level: Level, walls: BaseGeometry, ground: BaseGeometry, rooms: list[Polygon]
) -> tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]]:
    """Return the openings without a door between named rooms, and the closed plane with its spaces (R16)."""
    named = [] if level.sills else [room.polygon for room in level.rooms if room.polygon is not None]
    if len(named) < 2:
        return [], ground, rooms
    met = shapely.STRtree(rooms).query(named, predicate="intersects")[1]
    if len(np.unique(met)) == len(met):  # no space holds two rooms
        return [], ground, rooms
    found = find_doorless_openings(named, unite(rooms), walls)
    depths = [max(HAND_M - opening.apart_m, 0.0) / 2 for opening in found]
    strips = [opening.strip(deeper_m=depth, wider_m=LAP_M) for opening, depth in zip(found, depths, strict=True)]
    while strips:
        pieces = [ClosingCandidate(strip, "opening") for strip in strips]
        closed, parts = enclosed_pieces(close_plane(ground, pieces))
        held = [any(intersect(room, part).area > MOST * room.area for room in named) for part in parts]
        ways = split_at_portals(ground, pieces, closed, parts)[0]
        parting = [way.polygon for way in ways if _parts_two(way, held)]
        kept = [strip for strip in strips if intersect(strip, unite(parting)).area > MOST * strip.area]
        if len(kept) == len(strips):
            return ways, closed, parts
        strips = kept
    return [], ground, rooms


def _parts_two(way: ClosingCandidate, held: Sequence[bool]) -> bool:
    """Return whether a way leads from one space to another, each of which holds a room (R16)."""
    if way.portal is None or OUTSIDE in way.portal.sides or way.portal.sides[0] == way.portal.sides[1]:
        return False
    return all(held[side] for side in way.portal.sides)


def _area(layout: Layout) -> float:
    return float(sum(room.area for room in layout.rooms))


def _boundaries(
    level: Level,
    planes: Planes,
    pieces: list[ClosingCandidate],
    whole: tuple[BaseGeometry, list[Polygon]],
    config: LayoutConfig,
) -> Iterator[list[ClosingCandidate]]:
    """Yield what may close the house where its walls leave it open (R2, R3, R4, R11); the largest house counts.

    A closing between the ends of walls may also end at a wide gap, or only at what surely closes.
    """
    rails = _railings(level, planes, *whole, config)
    ground, rooms = enclosed_pieces(close_plane(whole[0], rails)) if rails else whole
    edges = _edges(level, ground, rooms, config)
    if edges or are_rooms_half_of_house(rooms, planes.tall):
        yield [*rails, *edges]
        return
    sure = [piece for piece in pieces if piece.kind != "gate"]
    for plane in [ground, close_plane(planes.door, [*rails, *sure])][: 2 if len(sure) < len(pieces) else 1]:
        yield [
            *rails,
            *(ClosingCandidate(p, "wall_ends") for p in closings_between_wall_ends(planes.tall, plane, config.area_m2)),
        ]


def _impassable_slits(room: Polygon, least_m2: float) -> list[Polygon]:
    """Return the slits that join parts of a room of ``least_m2`` or more (R15)."""
    pieces = polygons_of(buffer_mitred(room, -SLIT_M / 2))
    if len(pieces) < 2:
        return []
    parts = [intersect(buffer_mitred(piece, SLIT_M / 2 + HAIR_M), room) for piece in pieces]
    large = [part for part in parts if part.area >= least_m2]
    if len(large) < 2:
        return []
    between = [intersect(one, other) for one, other in combinations(large, 2)]
    rest = polygons_of(subtract(room, unite(parts)))
    between += [slit for slit in rest if sum(slit.distance(part) < HAIR_M for part in large) > 1]
    return grow_to_overlap([slit for shape in between for slit in polygons_of(shape)])


def _of_hall(layout: Layout, least_m2: float) -> list[Polygon]:
    """Return the bands that close the openings of a hall (R14)."""
    portals = [(c.polygon, set(c.portal.sides)) for c in layout.candidates if c.portal is not None]
    joined = nx.Graph()
    joined.add_nodes_from(range(len(layout.rooms)))
    joined.add_edges_from(sorted(sides) for _, sides in portals if len(sides) == 2 and OUTSIDE not in sides)
    part = {room: k for k, rooms in enumerate(nx.connected_components(joined)) for room in rooms}
    ways = [(p, part[room]) for p, sides in portals if OUTSIDE in sides for room in sides - {OUTSIDE}]
    return bands_across_hall_openings(layout.ground, ways, least_m2)


def find_closing_candidates(level: Level, planes: Planes, config: LayoutConfig) -> list[ClosingCandidate]:
    """Return everything that may close the door plane, before it is known what it separates (R1)."""
    named = [d for d in planes.doorways if level.names_doors or (level.leaves and d.source == "named")]
    before = _before_doorways(named) if named else EMPTY
    lintels = subtract(planes.lintels, before)
    low = subtract(planes.sills, unite([planes.lintels, before]))
    pieces = [ClosingCandidate(p, "lintel") for p in grow_to_overlap(polygons_of(lintels))]
    pieces += [ClosingCandidate(p, "sill") for p in grow_to_overlap(polygons_of(low))]
    doorways = zip(planes.doorways, grow_to_overlap([d.polygon for d in planes.doorways]), strict=True)
    pieces += [ClosingCandidate(p, "door" if d.has_door else "opening") for d, p in doorways]
    filled = [planes.door, *(p.polygon for p in pieces)]
    ends = list(wall_ends(planes.tall, nibs=True))
    found = gap_fillings(planes.tall, filled, config.gap_m, ends=ends)
    wide = gap_fillings(planes.tall, [*filled, *found], config.entrance_m, ends=ends)
    wide = [gap for gap in wide if box_around_polygon(gap).width > config.gap_m]
    closed = unite([p.polygon for p in pieces] + found) if wide else EMPTY
    gates = [gap for gap in wide if not _is_closed(gap, closed)]
    real = [gap for gap in found if not _runs_along(gap, pieces) and not _lies_in_room(gap, level)]
    cracks: list[Polygon] = []
    if not level.sills:  # R19
        standing = unite([*filled, *found])
        cracks = crack_fillings(standing)
        cracks += contact_fillings(unite([*filled, *found, *cracks]) if cracks else standing)
    candidates = [*pieces, *(ClosingCandidate(gap, "gap") for gap in [*real, *cracks])]
    candidates += [ClosingCandidate(gap, "gate") for gap in gates]
    candidates += _gates_of_railings(level, planes, candidates, config)
    return candidates + _wide_gates(level, planes, candidates, ends, config)


def _before_doorways(doorways: Sequence[Doorway]) -> BaseGeometry:
    """Return the floor within ``BESIDE_M`` of both faces of each doorway, as wide as it (R18)."""
    boxes = boxes_around_polygons([each.polygon for each in doorways])
    return unite([box_polygon(b, depth=b.thickness + 2 * BESIDE_M) for b in boxes if b.thickness < MOSTLY * b.width])


def _gates_of_railings(
    level: Level, planes: Planes, pieces: list[ClosingCandidate], config: LayoutConfig
) -> list[ClosingCandidate]:
    """Return the gaps of a low front under a roof (R17)."""
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
    pieces: list[ClosingCandidate],
    ends: list[WallEnd],
    config: LayoutConfig,
) -> list[ClosingCandidate]:
    """Return the wide openings of walls that alone leave a place of the house open (R24)."""
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
) -> list[ClosingCandidate]:
    """Return, as gates, the gaps that enclose a place of the house outside what is ``known`` to be enclosed."""
    new = [
        place
        for place in enclosed_pieces(unite([ground, *grow_to_overlap(gaps)]))[1]
        if place.area >= config.area_m2 and not place.representative_point().intersects(known) and is_of_house(place)
    ]
    around = shapely.buffer(unite(new), BESIDE_M)
    return [ClosingCandidate(gap, "gate") for gap in gaps if gap.intersects(around)]


def _has_ways(place: Polygon, pieces: list[ClosingCandidate], rooms: BaseGeometry, main_m2: float) -> bool:
    """Return whether ``GROUP`` ways lead from rooms into a place, or two into one of more than ``main_m2`` (R24)."""
    near = [shapely.buffer(piece.polygon, BESIDE_M) for piece in pieces if not _is_crack(piece)]
    ways = sum(bool(each.intersects(place) and each.intersects(rooms)) for each in near)
    return ways >= GROUP or (ways > 1 and place.area > main_m2)


def _is_covered(room: Polygon, level: Level) -> bool:
    return bool(intersect(room, part_under_cover(room, level)).area > MOST * room.area)


def _leads_into(piece: ClosingCandidate, place: Polygon, rooms: BaseGeometry) -> bool:
    """Return whether a door or a lintel stands between a place and a room."""
    near = shapely.buffer(piece.polygon, BESIDE_M)
    return piece.kind in {"door", "opening", "lintel"} and bool(near.intersects(place) and near.intersects(rooms))


def _is_closed(gap: Polygon, closed: BaseGeometry) -> bool:
    """Return whether a door, a lintel or a narrower gap stands in a wide gap."""
    return bool(intersect(gap, closed).area > SPECK * gap.area)


def _runs_along(gap: Polygon, pieces: list[ClosingCandidate]) -> bool:
    """Return whether a door or lintel beside a gap already closes it (a gap between a frame and a curtain; R1)."""
    return box_around_polygon(gap).width > PASSABLE_M and any(
        intersect(gap, buffer_mitred(piece.polygon, BESIDE_M)).area > LARGELY * gap.area for piece in pieces
    )


def _lies_in_room(gap: Polygon, level: Level) -> bool:
    """Return whether one room of the source continues through a gap and goes on beyond both of its faces (R1).

    A floor that reaches under a wall ends there.
    """
    box = box_around_polygon(gap)
    if box.thickness < MOSTLY * box.width:
        gap = box_polygon(box, depth=box.thickness + 2 * BESIDE_M)
    return any(
        intersect(gap, room.polygon).area > NEARLY_ALL * gap.area for room in level.rooms if room.polygon is not None
    )


def _is_beam_in_room(strip: ClosingCandidate, walls: BaseGeometry, level: Level) -> bool:
    """Return whether a lintel hangs in one room of the source, nearly from one side of it to the other (R21)."""
    if strip.kind != "lintel" or strip.portal is None or not _lies_in_room(strip.polygon, level):
        return False
    portal = strip.portal
    rooms = [each.polygon for each in level.rooms if each.polygon is not None]
    most = MOST * shapely.area(rooms).sum()
    for room in rooms:
        if room.area < most and room.contains(shapely.points(portal.centre)):
            reach = portal.along * room.length
            line = shapely.linestrings([portal.centre - reach, portal.centre + reach])
            pieces = shapely.get_parts(shapely.intersection(line, room))
            chord = min(pieces, key=shapely.points(portal.centre).distance)
            return bool(shapely.intersection(chord, walls).length < SOME * chord.length)
    return False


def _is_floored(level: Level, planes: Planes, rooms: list[Polygon]) -> bool:
    """Return whether the source draws a floor under most of what the walls span, or of what they enclose (a wing)."""
    if level.floor is None or planes.door.is_empty:
        return False
    if level.floor.area > MOST * shapely.convex_hull(planes.door).area:
        return True
    enclosed = unite(rooms)
    return bool(intersect(enclosed, level.floor).area > MOST * enclosed.area)


def _reject_characters(planes: Planes, rooms: list[Polygon]) -> None:
    """R7."""
    strokes = [p for p in polygons_of(planes.door) if p.length > 2 * AROUND_M]
    if len(strokes) < GROUP or planes.doorways or not (planes.lintels.is_empty and planes.sills.is_empty):
        return
    if len(rooms) > GROUP * len(strokes):  # no character has so many counters: these are the wings of a building
        return
    spanned = shapely.convex_hull(unite(strokes)).area
    inside = sum(room.area for room in rooms)
    if inside < 0.5 * spanned and _are_side_by_side(strokes, spanned):
        raise Rejection(
            "layout",
            Reason.CHARACTERS,
            f"{len(strokes)} strokes of wall stand apart and enclose {inside:.1f} of {spanned:.1f} m2, without a door",
            "if it is a house after all, keep it in overrides.toml",
        )


def _are_side_by_side(strokes: list[Polygon], spanned: float) -> bool:
    """Return whether each stroke is small compared with the whole, and all lie apart, as letters do (R7)."""
    hulls = shapely.convex_hull(np.array(strokes, dtype=np.object_))
    each = shapely.area(hulls)
    return bool(each.max() < SOME * spanned and unite(hulls).area > MOSTLY * each.sum())


def _keep_separating(
    door: BaseGeometry,
    shallow_headers: BaseGeometry,
    strips: list[ClosingCandidate],
    rest: list[ClosingCandidate],
    config: LayoutConfig,
) -> tuple[list[ClosingCandidate], BaseGeometry, list[Polygon]]:
    """Drop strips until each remaining one separates two spaces, then drop what is not needed to keep the spaces apart.

    Returns what is left, and the closed plane with its spaces.
    """
    pruned = not rest
    while True:
        plane, rooms = enclosed_pieces(close_plane(door, strips + rest))
        strips = assign_sides(strips, rooms, plane)
        useless = {
            k for k, strip in enumerate(strips) if _parts_nothing(strip, strips, rooms, (door, shallow_headers), config)
        }  # R5
        if not useless:
            useless = _around_no_room(strips, rooms, config.walled)  # R6
        if not useless:
            useless = _around_a_slot(strips, rooms)
        if not useless:
            useless = _widest_gap_of_a_niche(strips, rooms, config.area_m2)
        if useless:
            strips, pruned = [strip for k, strip in enumerate(strips) if k not in useless], not rest
        elif pruned:
            return strips + rest, plane, rooms
        else:  # strips that stood against what is dropped here may part nothing now
            rest, pruned = minimal_separators(door, strips, rest, plane, rooms), True


def _parts_nothing(
    candidate: ClosingCandidate,
    strips: Sequence[ClosingCandidate],
    rooms: list[Polygon],
    planes: tuple[BaseGeometry, BaseGeometry],
    config: LayoutConfig,
) -> bool:
    """R5: ``planes`` are the walls of the door plane and the shallow headers."""
    door, shallow_headers = planes
    portal = candidate.portal
    if portal is None or portal.sides[0] == portal.sides[1]:
        return portal is not None
    if OUTSIDE in portal.sides or candidate.kind in KNOWN:
        return False
    if candidate.kind == "gate":  # R1, R13
        return True
    if candidate.kind == "gap" and _is_in_colonnade(portal, strips):
        return True
    is_lintel = candidate.kind == "lintel"
    if is_lintel and portal.width > config.header_m:
        shallow = intersect(candidate.polygon, shallow_headers)
        if shallow.area > MOST * candidate.polygon.area:
            return True
    is_beam = portal.width > config.beam_m and not portal.has_jamb(door)
    return is_beam or (is_lintel and _stands_on_pillars(portal, strips, rooms, config))


def _stands_on_pillars(
    portal: Portal, strips: Sequence[ClosingCandidate], rooms: list[Polygon], config: LayoutConfig
) -> bool:
    """Return whether a lintel is part of a beam over one bay or several, as broad as the rooms at both sides (R5)."""
    bays = [c.portal for c in strips if c.kind == "lintel" and c.portal is not None]
    rows = [_row_of_bays(portal, [bay for bay in bays if side in bay.sides], config.header_m) for side in portal.sides]
    sides = zip(rows, portal.sides, (-1.0, 1.0), strict=True)
    return all(row.width > config.beam_m and _is_as_broad(row, portal, way, rooms[side]) for row, side, way in sides)


def _is_in_colonnade(portal: Portal, strips: Sequence[ClosingCandidate]) -> bool:
    """Return whether a gap stands in a row of ``GROUP`` gaps or more between the same two spaces (R5)."""
    gaps = [c.portal for c in strips if c.kind == "gap" and c.portal is not None]
    gaps = [gap for gap in gaps if set(gap.sides) == set(portal.sides)]
    row = _row_of_bays(portal, gaps, 0.0) if len(gaps) >= GROUP else portal
    line = shapely.linestrings(row.segment)
    return bool(sum(shapely.dwithin(line, shapely.points(gap.centre), portal.depth) for gap in gaps) >= GROUP)


def _row_of_bays(portal: Portal, bays: Sequence[Portal], least_m: float) -> Portal:
    """Return the opening that a bay, wider than ``least_m``, makes with those in line beside it, pillars and all (R5).

    Between two bays stands a pillar: at most ``THICK_WALL_M`` of wall.
    """
    if portal.width <= least_m:
        return portal
    start, end = portal.width / -2, portal.width / 2
    spans = []
    for bay in bays:
        away = bay.centre - portal.centre
        in_line = abs(float(bay.along @ portal.along)) > PARALLEL and abs(float(away @ portal.across)) < portal.depth
        if in_line and bay.width > least_m:
            middle = float(away @ portal.along)
            spans.append((middle - bay.width / 2, middle + bay.width / 2))
    for low, high in sorted(spans, key=lambda span: abs(span[0] + span[1])):  # the nearest first
        if low - end < THICK_WALL_M and start - high < THICK_WALL_M:
            start, end = min(start, low), max(end, high)
    return portal.part_between(start, end)


def _is_as_broad(row: Portal, bay: Portal, way: float, room: Polygon) -> bool:
    """Return whether a row takes ``WHOLE_BREADTH`` of the room right behind one of its bays (R5).

    The room lies on the side ``way`` (-1 or 1) of the row.
    """
    out = way * row.across * row.depth / 2
    ahead, aside = way * row.across * AROUND_M, row.along * 2 * row.width
    face = row.centre + out
    window = Polygon([face - aside, face + aside, face + aside + ahead, face - aside + ahead])
    near = shapely.points(bay.centre + out + ahead / 10)
    seen = [piece for piece in polygons_of(intersect(room, window)) if shapely.dwithin(piece, near, BESIDE_M)]
    return bool(row.width >= WHOLE_BREADTH * sum(piece.area for piece in seen) / AROUND_M)


def _around_no_room(candidates: list[ClosingCandidate], rooms: list[Polygon], walled: float) -> set[int]:
    """Return the strips around the first space that hardly touches a wall (R6)."""
    for index, room in enumerate(rooms):
        around = {
            k
            for k, c in enumerate(candidates)
            if c.portal is not None and index in c.portal.sides and OUTSIDE not in c.portal.sides
        }
        open_width = sum(b.width for k in around if (b := candidates[k].portal) is not None)
        if open_width > (1 - walled) * room.length:
            return around
    return set()


def _around_a_slot(candidates: list[ClosingCandidate], rooms: list[Polygon]) -> set[int]:
    """Return the strips between the first space too narrow to stand in and the room to which it opens most (R6).

    What opens to rooms along less than ``LARGELY`` of its length lies under the eaves, and is opened to the outside.
    """
    for index in np.flatnonzero(are_too_narrow(rooms, PASSABLE_M)).tolist():
        ways: dict[int, set[int]] = {}
        for k, candidate in enumerate(candidates):
            if candidate.portal is not None and index in candidate.portal.sides:
                (other,) = set(candidate.portal.sides) - {index} or {OUTSIDE}
                ways.setdefault(other, set()).add(k)
        outer = ways.pop(OUTSIDE, set())
        inner = sum(b.width for strips in ways.values() for k in strips if (b := candidates[k].portal) is not None)
        if outer and inner < LARGELY * rooms[index].length / 2:
            return outer
        if ways:
            return max(ways.values(), key=lambda strips: sum(candidates[k].polygon.length for k in strips))
    return set()


def _widest_gap_of_a_niche(candidates: list[ClosingCandidate], rooms: list[Polygon], least_m2: float) -> set[int]:
    """Return the widest gap of the first room below ``least_m2`` that one can leave only through gaps."""
    for index, room in enumerate(rooms):
        ways = [k for k, c in enumerate(candidates) if c.portal is not None and index in c.portal.sides]
        if room.area >= least_m2 or not ways or any(candidates[k].kind not in {"gap", "gate"} for k in ways):
            continue
        portal = candidates[widest := max(ways, key=lambda k: candidates[k].polygon.length)].portal
        if portal is not None and not _is_closet(room, portal):
            return {widest}
    return set()


def _is_closet(room: Polygon, portal: Portal) -> bool:
    """Return whether a gap leads into a small room that is wider than the gap, as a closet is (R6)."""
    breadth = np.ptp(dot_product(shapely.get_coordinates(room.exterior), portal.along))
    return bool(room.area >= CLOSET_M2 and portal.width < MOSTLY * breadth)


def _railings(
    level: Level, planes: Planes, ground: BaseGeometry, rooms: list[Polygon], config: LayoutConfig
) -> list[ClosingCandidate]:
    """Return the railings, between h_d and head height, that enclose floor which nothing else encloses (R2)."""
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
    return [ClosingCandidate(p, "rail") for p in polygons_of(planes.rails) if p.intersects(near)]


def _edges(level: Level, ground: BaseGeometry, rooms: list[Polygon], config: LayoutConfig) -> list[ClosingCandidate]:
    """Return the edges of the source's rooms (R11) or of its floor (R3) where they lie open."""
    named = [room.polygon for room in level.rooms if room.polygon is not None]
    around = bands_around_rooms(named, ground, rooms, config.area_m2)
    edges = [ClosingCandidate(p, "room_edge") for p in around]
    if level.floor is None or (edges and unite(named).area > MOST * level.floor.area):
        return edges
    if edges:
        ground = unite([ground, *around])
    bands = bands_at_floor_edge(level.floor, ground, config.area_m2, joined=not level.sills)
    return [*edges, *(ClosingCandidate(p, "floor_edge") for p in bands)]
