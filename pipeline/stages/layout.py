"""Close the openings of the door plane so that walls enclose spaces, as Algorithm 1 assumes, or reject the level.

What may close says ``stages.closings``, and which of it parts spaces ``stages.separation``; which of the spaces are
rooms, and what of them is floor, says ``stages.habitable``.

R1  Where the source names no walls, a room that is most of what it draws may be a whole storey under the name of one
    (an artist's mesh, whose floor is called "Room"): the layout is found without it, and stands if it takes
    ``LARGELY`` of it. Otherwise that room closes at its edge, and parts at mouths (R6).
R2  Where a scan ends and nothing stands (``Evidence.open_edge``), the house is closed as by its walls, and what closes
    it there is the edge of its floor.
R3  Walls that spell characters are no layout: strokes that stand apart from each other without a door in any of them,
    and that enclose little of what they span. Characters have no floor of their own and no furniture; each takes a
    small part of what all of them span, has its place to itself, and encloses no more than ``GROUP`` spaces. What the
    source itself calls walls is no character.
R4  A slit between two walls, too narrow for anybody, parts the rooms at its ends.
R5  Where two rooms that the source draws meet between the ends of a wall (``geometry.wall_gaps``), and that
    parts them, there is an opening.
R6  Where a room is narrow between two broad parts of it, these are rooms of their own, unless the source says that
    they are one room, or names openings, and none there (``geometry.wall_gaps``). In a world that
    robots drive through, a gap is a way though doors have names (``Level.unnamed_gaps``). A door of such a world that
    parts nothing by itself, beside a mouth, closes with it, and so does a lintel where no openings have names. So does
    a gap in another wall: of two ways into a side room, one may be wide, and neither parts it alone.
R7  A door that the source names parts two rooms. Where both of its faces look into one, because its wall goes on under
    a beam or ends before another wall, what closes that line closes: lintels and gaps up to ``entrance_m``.
R8  Where all that leaves no room, and walls surround one place nearly all round, what they leave open is its front.
    Else an open house (on posts, with two walls) is closed along the edge of its floor, or of its roof where it has no
    floor (``open_boundaries.bands_around_open_house``). It is doubtful (``quality_grounds``, R17).
R9  What encloses less than ``area_m2`` after all this is no layout.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    OUTSIDE,
    buffer_mitred,
    dot_product,
    enclosed_pieces,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.meshes import box_around_polygon, box_polygon
from pipeline.geometry.open_boundaries import bands_around_open_house, bands_at_open_fronts
from pipeline.geometry.openings import EDGES, KNOWN, assign_sides, close_plane, grow_to_overlap, split_into_strips
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.wall_gaps import find_doorless_openings, find_mouths
from pipeline.rejection import Reason, Rejection
from pipeline.stages.closings import boundaries, find_closing_candidates, hall_closings, is_crack, lies_in_room
from pipeline.stages.habitable import (
    clip_rooms_to_floor,
    filled_spaces,
    keep_habitable_spaces,
    part_under_cover,
)
from pipeline.stages.separation import is_beam_in_room, keep_separating
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    DOORWAY_M,
    GROUP,
    HAIR_M,
    HAND_M,
    LAP_M,
    LARGELY,
    MOST,
    MOSTLY,
    PARALLEL,
    SOME,
    THICK_WALL_M,
)
from pipeline.values import Evidence, Layout, Level, Opening, Planes

SLIT_M = 0.25


def close_openings(
    level: Level, evidence: Evidence, planes: Planes, config: LayoutConfig, *, all_closed: bool = False
) -> Layout:
    """Close the walls of the door plane; raise Rejection if nothing worth a plan is enclosed.

    With ``all_closed``, each space that walls close all round is a room, as in the paper.
    """
    storey = _storey_drawn_as_room(level)
    if storey is not None:  # R1
        others = tuple(room for room in level.rooms if room.polygon is not storey)
        try:
            found = _close(replace(level, rooms=others), evidence, planes, config, None, all_closed=all_closed)
        except Rejection:
            pass
        else:
            if intersect(storey, unite(found.rooms)).area > LARGELY * storey.area:
                return found
    return _close(level, evidence, planes, config, storey, all_closed=all_closed)


def _storey_drawn_as_room(level: Level) -> Polygon | None:
    """Return the room that is most of what a source draws that names no walls, or None (R1)."""
    rooms = [] if level.only_walls else [room.polygon for room in level.rooms if room.polygon is not None]
    largest = max(rooms, key=lambda room: room.area, default=None)
    return largest if largest is not None and largest.area > MOST * sum(room.area for room in rooms) else None


def _close(
    level: Level,
    evidence: Evidence,
    planes: Planes,
    config: LayoutConfig,
    storey: Polygon | None,
    *,
    all_closed: bool,
) -> Layout:
    """Return the layout; ``storey`` is the one room of the level that may be a whole storey (R1)."""
    walls, ends = planes.door, [Opening.closing(p, "floor_edge") for p in polygons_of(evidence.open_edge)]
    if ends:  # R2
        planes = replace(
            planes,
            door=unite([planes.door, evidence.open_edge]),
            tall=unite([planes.tall, evidence.open_edge]),
        )
    drawn = replace(level, rooms=tuple(room for room in level.rooms if room.polygon is not storey)) if storey else level
    pieces = find_closing_candidates(level, planes, config)
    whole = enclosed_pieces(close_plane(planes.door, pieces))
    is_named = level.only_walls and "layers" not in level.guesses
    is_shown = is_named or _is_floored(level, planes, whole[1]) or level.n_objects > 0
    if config.characters and (level.sills or not is_shown):
        _reject_characters(planes, whole[1])

    def within(fixed: list[Opening]) -> Layout:
        """Return the layout in which all of ``fixed`` closes, whether or not it separates anything."""
        standing = close_plane(planes.door, fixed) if fixed else planes.door
        ground, rooms = enclosed_pieces(close_plane(standing, pieces)) if fixed else whole
        strips, rest = split_into_strips(standing, pieces, ground, rooms)
        strips = [strip for strip in strips if not is_beam_in_room(strip, standing, level)]
        strips, ground, rooms = keep_separating(standing, evidence.shallow_headers, strips, rest, config)
        if not level.sills and (
            slits := [slit for room in rooms for slit in _impassable_slits(room, config.area_m2)]
        ):  # R4
            ground, rooms = enclosed_pieces(unite([ground, *slits]))
        ways, ground, rooms = _at_doorless_openings(level, planes.door, ground, rooms)  # R5
        strips = strips + ways
        gapless = level.sills or (bool(level.openings) and not level.unnamed_gaps)
        if not gapless:  # R6
            doorways = _without_effect(pieces, KNOWN if level.unnamed_gaps else {"lintel"}, strips, ground)
            strips, ground, rooms = _part_at_mouths(drawn, doorways, (strips, ground, rooms))
            if gaps := _without_effect(pieces, {"gap"}, strips, ground):
                strips, ground, rooms = _part_at_mouths(drawn, gaps, (strips, ground, rooms))
        strips, ground, rooms = _in_line_with_idle_doors(planes.doorways, pieces, (strips, ground, rooms), config)  # R7
        candidates = assign_sides(strips + fixed, rooms, ground)
        filled = filled_spaces(rooms, candidates, evidence, level)  # what hangs over their edges is no way outside
        candidates = [c for c in candidates if not c.is_strip or not filled.intersection(c.sides)] + ends
        kept = keep_habitable_spaces(rooms, candidates, planes, evidence, level, filled=filled, all_closed=all_closed)
        of_rooms = clip_rooms_to_floor(kept, level)
        sides = tuple(assign_sides(candidates, of_rooms, ground))
        return Layout(walls, ground, sides, tuple(of_rooms), tuple(rooms), tuple(candidates))

    found = max(map(within, boundaries(level, planes, pieces, whole, config)), key=_area)
    if not found.rooms and (
        fronts := [Opening.closing(p, "wall_ends") for p in bands_at_open_fronts(planes.tall, config.area_m2)]
    ):  # R8
        found = within(fronts)
    if not found.rooms and (
        open_edges := [Opening.closing(p, "floor_edge") for p in _edges_of_open_house(level, planes, config)]
    ):
        found = within(open_edges)
    if not level.sills and (
        openings := [Opening.closing(p, "wall_ends") for p in hall_closings(found, config.area_m2)]
    ):
        edges = [c for c in found.candidates if c.closed_by in EDGES and c not in ends]
        found = within([*edges, *openings])
    area = _area(found)
    if area < config.area_m2:  # R9
        raise Rejection(
            "layout",
            Reason.NOT_ENCLOSED,
            f"the walls enclose {area:.2f} m², expected at least {config.area_m2:g} m²; "
            + _what_stands(planes, whole[1]),
            "walls must close at some height up to the ceiling, or the house needs a floor slab" + _guesses(level),
        )
    return found


def _edges_of_open_house(level: Level, planes: Planes, config: LayoutConfig) -> list[Polygon]:
    """Return the bands that close an open house along its floor or its roof (R8)."""
    if level.sills or isinstance(level.walls, Prisms) or level.walls.is_cloud or planes.tall.is_empty:
        return []
    roof = part_under_cover(shapely.box(*planes.tall.bounds), level)
    floor = level.floor if level.floor is not None else roof
    return bands_around_open_house(floor, roof, planes.tall, config.area_m2)


def _guesses(level: Level) -> str:
    """Say what of the size was guessed, for the advice on a mesh without rooms: another size may give some."""
    if level.provenance.get("source") != "mesh" or not level.guesses:
        return ""
    size = f"a unit of {level.provenance['units']}, {level.provenance['up']} up"
    return f"; {size} is a guess ({', '.join(level.guesses)}): if it is wrong, say --units, --scale or --up"


def _what_stands(planes: Planes, spaces: list[Polygon]) -> str:
    """Say which walls there are, and what they close, for the message on a house without rooms (R9)."""
    parts = polygons_of(planes.door)
    if not parts:
        return "nothing stands up to the height of doors"
    x1, y1, x2, y2 = shapely.total_bounds(parts)
    pieces = "one piece" if len(parts) == 1 else f"{len(parts)} pieces"
    found = f"walls stand in {pieces} on {x2 - x1:.1f} x {y2 - y1:.1f} m"
    if not spaces:
        return f"{found}, and close no place all round"
    return f"{found}; the largest of {len(spaces)} closed places has {spaces[0].area:.1f} m²"


def _without_effect(
    pieces: Sequence[Opening],
    kinds: Collection[str],
    strips: Sequence[Opening],
    ground: BaseGeometry,
) -> list[Opening]:
    """Return what parted nothing of some kinds: doors and openings, lintels over doorways of others, gaps (R6).

    A wide opening beside a doorway may leave nothing that the doorway parts by itself. A lintel or a gap that would
    part spaces was dropped for another reason, and is not returned.
    """
    taken = unite([strip.polygon for strip in strips])
    found = [piece for piece in pieces if piece.closed_by in kinds]
    found = [piece for piece in found if intersect(piece.polygon, taken).area < MOST * piece.polygon.area]
    found = [piece for piece in found if piece.closed_by != "lintel" or _is_over_doorway(piece.polygon)]
    if all(piece.closed_by in KNOWN for piece in found):
        return found
    closed, parts = enclosed_pieces(close_plane(ground, found))
    return [piece for piece in found if not _parts_spaces(piece, ground, closed, parts)]


def _part_at_mouths(
    level: Level,
    beside: Sequence[Opening],
    found: tuple[list[Opening], BaseGeometry, list[Polygon]],
) -> tuple[list[Opening], BaseGeometry, list[Polygon]]:
    """Return the strips, the closed plane and its spaces with the mouths, and what parts only ``beside`` them (R6).

    A gap in line with a mouth is one of its row (``find_mouths``), and does not close beside it.
    """
    strips, ground, rooms = found
    for row in find_mouths(*_closed_by(ground, beside, rooms)):
        if any(lies_in_room(mouth.polygon, level) for mouth in row):
            continue
        others = [
            piece
            for piece in beside
            if piece.closed_by != "gap" or not any(_width_in_line(mouth.polygon, piece.polygon) for mouth in row)
        ]
        closed, parts = enclosed_pieces(close_plane(ground, row + others))
        needed = [piece for piece in others if is_crack(piece) or _parts_spaces(piece, ground, closed, parts)]
        if len(needed) < len(others):
            closed, parts = enclosed_pieces(close_plane(ground, row + needed))
        ways = split_into_strips(ground, row + needed, closed, parts)[0]
        if any(way.closed_by == "mouth" for way in ways):
            strips, ground, rooms = strips + ways, closed, parts
    return strips, ground, rooms


def _in_line_with_idle_doors(
    doorways: Sequence[Opening],
    pieces: Sequence[Opening],
    found: tuple[list[Opening], BaseGeometry, list[Polygon]],
    config: LayoutConfig,
) -> tuple[list[Opening], BaseGeometry, list[Polygon]]:
    """Return the strips, the closed plane and its spaces with those of named doors that parted nothing (R7)."""
    strips, ground, rooms = found
    named = unite([each.polygon for each in doorways if each.said_by == "named" and each.has_door])
    if named.is_empty:
        return found
    taken = unite([strip.polygon for strip in strips])
    idle = [
        each
        for each in pieces
        if each.closed_by in {"door", "lintel", "gate"}
        and intersect(each.polygon, taken).area < MOST * each.polygon.area
    ]
    for door in [each for each in idle if each.closed_by == "door" and each.polygon.intersects(named)]:
        in_line = [
            replace(each, polygon=box_polygon(box_around_polygon(each.polygon), width=width + 2 * BESIDE_M))
            for each in idle
            if each.closed_by != "door" and (width := _width_in_line(door.polygon, each.polygon))
        ]
        if not in_line or _parting(door, in_line, ground, config) is None:
            continue
        for each in list(in_line):
            fewer = [other for other in in_line if other is not each]
            in_line = fewer if _parting(door, fewer, ground, config) is not None else in_line
        closed, parts = _parting(door, in_line, ground, config) or (ground, rooms)
        ways = split_into_strips(ground, [door, *in_line], closed, parts)[0]
        strips, ground, rooms = strips + ways, closed, parts
    return strips, ground, rooms


def _parting(
    door: Opening, beside: Sequence[Opening], ground: BaseGeometry, config: LayoutConfig
) -> tuple[BaseGeometry, list[Polygon]] | None:
    """Return the plane and its spaces where a door, closed with others, parts two that are rooms, else None (R7)."""
    closed, parts = enclosed_pieces(close_plane(ground, [door, *beside]))
    ways = split_into_strips(ground, [door], closed, parts)[0]
    sides = [way.sides for way in ways if way.is_strip]
    are_rooms = (
        one != other and OUTSIDE not in {one, other} and min(parts[one].area, parts[other].area) >= config.area_m2
        for one, other in sides
    )
    return (closed, parts) if any(are_rooms) else None


def _width_in_line(door: Polygon, other: Polygon) -> float:
    """Return the width of a piece that is as thin as a wall and in line with a door, else 0 (R7)."""
    box, there = box_around_polygon(door), box_around_polygon(other)
    aside = abs(float(dot_product(there.centre - box.centre, box.across)))
    runs = abs(float(dot_product(box.along, there.along))) > PARALLEL
    in_line = runs and there.thickness <= THICK_WALL_M and aside <= (box.thickness + there.thickness) / 2
    return there.width if in_line else 0.0


def _is_over_doorway(lintel: Polygon) -> bool:
    """Return whether a lintel is as wide as a doorway, and no deeper than a wall."""
    box = box_around_polygon(lintel)
    return DOORWAY_M[0] <= box.width <= DOORWAY_M[1] and box.thickness <= THICK_WALL_M


def _parts_spaces(piece: Opening, ground: BaseGeometry, closed: BaseGeometry, parts: list[Polygon]) -> bool:
    """Return whether a piece leads from one space of the closed plane to another (R6)."""
    ways = split_into_strips(ground, [piece], closed, parts)[0]
    return any(way.is_strip and way.sides[0] != way.sides[1] for way in ways)


def _closed_by(
    ground: BaseGeometry, pieces: Sequence[Opening], rooms: list[Polygon]
) -> tuple[list[Polygon], BaseGeometry]:
    """Return the spaces and the plane that more pieces close."""
    if not pieces:
        return rooms, ground
    closed, parts = enclosed_pieces(close_plane(ground, pieces))
    return parts, closed


def _at_doorless_openings(
    level: Level, walls: BaseGeometry, ground: BaseGeometry, rooms: list[Polygon]
) -> tuple[list[Opening], BaseGeometry, list[Polygon]]:
    """Return the openings without a door between named rooms, and the closed plane with its spaces (R5)."""
    named = [] if level.sills else [room.polygon for room in level.rooms if room.polygon is not None]
    if len(named) < 2:
        return [], ground, rooms
    met = shapely.STRtree(rooms).query(named, predicate="intersects")[1]
    if len(np.unique(met)) == len(met):  # no space holds two rooms
        return [], ground, rooms
    found = find_doorless_openings(named, unite(rooms), walls)
    depths = [max(HAND_M - opening.depth, 0.0) / 2 for opening in found]
    strips = [opening.strip(deeper_m=depth, wider_m=LAP_M) for opening, depth in zip(found, depths, strict=True)]
    while strips:
        pieces = [Opening.closing(strip, "opening") for strip in strips]
        closed, parts = enclosed_pieces(close_plane(ground, pieces))
        held = [any(intersect(room, part).area > MOST * room.area for room in named) for part in parts]
        ways = split_into_strips(ground, pieces, closed, parts)[0]
        parting = [way.polygon for way in ways if _parts_two(way, held)]
        kept = [strip for strip in strips if intersect(strip, unite(parting)).area > MOST * strip.area]
        if len(kept) == len(strips):
            return ways, closed, parts
        strips = kept
    return [], ground, rooms


def _parts_two(way: Opening, held: Sequence[bool]) -> bool:
    """Return whether a way leads from one space to another, each of which holds a room (R5)."""
    if not way.is_strip or OUTSIDE in way.sides or way.sides[0] == way.sides[1]:
        return False
    return all(held[side] for side in way.sides)


def _area(layout: Layout) -> float:
    return float(sum(room.area for room in layout.rooms))


def _impassable_slits(room: Polygon, least_m2: float) -> list[Polygon]:
    """Return the slits that join parts of a room of ``least_m2`` or more (R4)."""
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


def _is_floored(level: Level, planes: Planes, rooms: list[Polygon]) -> bool:
    """Return whether the source draws a floor under most of what the walls span, or of what they enclose (a wing)."""
    if level.floor is None or planes.door.is_empty:
        return False
    if level.floor.area > MOST * shapely.convex_hull(planes.door).area:
        return True
    enclosed = unite(rooms)
    return bool(intersect(enclosed, level.floor).area > MOST * enclosed.area)


def _reject_characters(planes: Planes, rooms: list[Polygon]) -> None:
    """R3."""
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
            f"{len(strokes)} strokes of wall stand apart and enclose {inside:.1f} of {spanned:.1f} m², without a door",
            "if it is a house after all, keep it in overrides.toml",
        )


def _are_side_by_side(strokes: list[Polygon], spanned: float) -> bool:
    """Return whether each stroke is small compared with the whole, and all lie apart, as letters do (R3)."""
    hulls = shapely.convex_hull(np.array(strokes, dtype=np.object_))
    each = shapely.area(hulls)
    return bool(each.max() < SOME * spanned and unite(hulls).area > MOSTLY * each.sum())
