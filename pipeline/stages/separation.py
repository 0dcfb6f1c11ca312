"""Choose, from the strips that may close the door plane, those that part two spaces.

R1  A strip that parts nothing (a shelf, a wall cabinet) is dropped. Between two rooms, where no door is known, these
    are dropped too: a beam, which spans more than ``beam_m`` between walls that cross its line; a lintel of more than
    ``header_m`` that hangs down by a hand's breadth at most; a lintel of more than ``beam_m`` between pillars that
    leave nearly the whole breadth of both rooms open, where bays in a row count as one; the gaps of a colonnade
    (three or more in a row between the same two spaces); a wide gap (``gate``), which closes to the outside only.
R2  A gap that would part off less than a room is dropped, unless it leads into a closet wider than the gap. All strips
    around a space are dropped if less than ``walled`` of its edge lies along walls (what hangs from a ceiling is no
    room), or if it is too narrow to stand in.
R3  A slit between two walls that is too narrow to pass parts the rooms at its ends.
R4  Where two rooms that the source draws meet between the ends of a wall (``geometry.wall_gaps``), there is an opening
    if that parts them.
R5  A narrow place between two broad parts of a room is a mouth and makes two rooms of them (``geometry.wall_gaps``),
    unless the source draws them as one room, or names its openings and none there. In a world that robots drive
    through, a gap is a way although doors have names (``Level.unnamed_gaps``). Beside a mouth, such a world's door that
    parts nothing by itself closes together with the mouth. So does a lintel where no openings have names, and so does
    a gap in another wall: a side room may have two ways, neither of which parts it alone.
R6  A lintel over one room of the source, which no wall but posts and nibs goes on from, is a beam and closes nothing. A
    room that is most of what the source draws may be the floor of a storey, and says nothing.
R7  A door that the source names parts two rooms. Where both of its faces look into one, because its wall goes on under
    a beam or ends before another wall, what closes that line closes: lintels and gaps up to ``entrance_m``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    OUTSIDE,
    Shapes,
    are_too_narrow,
    buffer_mitred,
    dot_product,
    drop_lines_and_points,
    drop_thin_parts_of_each,
    enclosed_pieces,
    intersect,
    intersect_pairs,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.groups import Groups
from pipeline.geometry.meshes import box_around_polygon, box_polygon
from pipeline.geometry.openings import (
    KNOWN,
    Opening,
    area_outside,
    assign_sides,
    close_plane,
    grow_to_overlap,
    split_into_strips,
)
from pipeline.geometry.wall_gaps import find_doorless_openings, find_mouths
from pipeline.stages.closings import is_crack, lies_in_room
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    DOORWAY_M,
    HAIR_M,
    HAND_M,
    LAP_M,
    LARGELY,
    MM_M,
    MOST,
    MOSTLY,
    PARALLEL,
    PARTITION_M,
    PASSABLE_M,
    SOME,
    THICK_WALL_M,
)
from pipeline.values import Evidence, Level, Planes

CLOSET_M2 = 0.9
WHOLE_BREADTH = 0.85
WAYS = KNOWN | {"lintel", "gap", "mouth"}
"""What leads from one space to another, not over a sill or a railing."""


@dataclass(frozen=True, eq=False)
class Division:
    """The openings of a closed plane, all that closes it (``ground``, openings included), and the spaces enclosed."""

    openings: list[Opening]
    ground: BaseGeometry
    spaces: list[Polygon]

    def closed_by(self, pieces: Sequence[Opening]) -> Division:
        """Return the division with more pieces closed. Their strips are not added to its openings."""
        return Division(self.openings, *enclosed_pieces(close_plane(self.ground, pieces))) if pieces else self

    def idle(self, pieces: Iterable[Opening]) -> list[Opening]:
        """Return the pieces that lie mostly outside the openings."""
        taken = unite([opening.polygon for opening in self.openings])
        return [piece for piece in pieces if intersect(piece.polygon, taken).area < MOST * piece.polygon.area]

    def strips_of(self, pieces: Sequence[Opening], standing: BaseGeometry) -> list[Opening]:
        """Return the strips of pieces that close this division; ``standing`` is what stands without the pieces."""
        return split_into_strips(standing, list(pieces), self.ground, self.spaces)[0]


def part_spaces(
    level: Level,
    evidence: Evidence,
    planes: Planes,
    whole: Division,
    config: LayoutConfig,
    *,
    standing: BaseGeometry,
    storey: Polygon | None,
) -> Division:
    """Return the division by the openings that part two spaces, and by pieces that part spaces only beside these.

    Parameters
    ----------
    whole
        All that may close the plane, and the spaces that all of it encloses.
    standing
        What closes in any case: the walls, and the edges of an open house.
    storey
        The one room of the level that may be a whole storey; mouths may part it although it is drawn as one room (R5).
    """
    pieces = whole.openings
    strips, rest = split_into_strips(standing, pieces, whole.ground, whole.spaces)
    strips = [strip for strip in strips if not _is_beam_in_room(strip, standing, level)]
    found = keep_separating(standing, evidence.shallow_headers, strips, rest, config)
    if not level.sills and (
        slits := [slit for space in found.spaces for slit in _impassable_slits(space, config.area_m2)]
    ):  # R3
        found = Division(found.openings, *enclosed_pieces(unite([found.ground, *slits])))
    found = _at_doorless_openings(level, planes.door, found)  # R4
    if not level.sills and (level.unnamed_gaps or not level.openings):  # R5
        doorways = _without_effect(pieces, KNOWN if level.unnamed_gaps else {"lintel"}, found)
        drawn = replace(
            level, rooms=tuple(room for room in level.rooms if storey is None or room.polygon is not storey)
        )
        found = _part_at_mouths(drawn, doorways, found)
        if gaps := _without_effect(pieces, {"gap"}, found):
            found = _part_at_mouths(drawn, gaps, found)
    return _in_line_with_idle_doors(planes.doorways, pieces, found, config)  # R7


def keep_separating(
    door: BaseGeometry,
    shallow_headers: BaseGeometry,
    strips: list[Opening],
    rest: list[Opening],
    config: LayoutConfig,
) -> Division:
    """Drop strips until each remaining one separates two spaces, then what is not needed to keep the spaces apart."""
    pruned = not rest
    while True:
        plane, rooms = enclosed_pieces(close_plane(door, strips + rest))
        strips = assign_sides(strips, rooms, plane)
        useless = {
            k for k, strip in enumerate(strips) if _parts_nothing(strip, strips, rooms, (door, shallow_headers), config)
        }  # R1
        if not useless:
            useless = _around_no_room(strips, rooms, config.walled)  # R2
        if not useless:
            useless = _around_a_slot(strips, rooms)
        if not useless:
            useless = _widest_gap_of_a_niche(strips, rooms, config.area_m2)
        if useless:
            strips, pruned = [strip for k, strip in enumerate(strips) if k not in useless], not rest
        elif pruned:
            return Division(strips + rest, plane, rooms)
        else:  # strips that ended at a strip dropped here may part nothing now
            rest, pruned = minimal_separators(door, strips, rest, plane, rooms), True


def _parts_nothing(
    candidate: Opening,
    strips: Sequence[Opening],
    rooms: list[Polygon],
    planes: tuple[BaseGeometry, BaseGeometry],
    config: LayoutConfig,
) -> bool:
    """``planes`` are the walls of the door plane and the shallow headers."""
    door, shallow_headers = planes
    if not candidate.is_strip or candidate.sides[0] == candidate.sides[1]:
        return candidate.is_strip
    if candidate.leads_outside or candidate.closed_by in KNOWN:
        return False
    if candidate.closed_by == "gate":  # R1
        return True
    if candidate.closed_by == "gap" and _is_in_colonnade(candidate, strips):
        return True
    is_lintel = candidate.closed_by == "lintel"
    if is_lintel and candidate.width > config.header_m:
        shallow = intersect(candidate.polygon, shallow_headers)
        if shallow.area > MOST * candidate.polygon.area:
            return True
    is_beam = candidate.width > config.beam_m and not candidate.has_jamb(door)
    return is_beam or (is_lintel and _stands_on_pillars(candidate, strips, rooms, config))


def _stands_on_pillars(opening: Opening, strips: Sequence[Opening], rooms: list[Polygon], config: LayoutConfig) -> bool:
    """Return whether a lintel is part of a beam over one bay or several, as broad as the rooms at both sides (R1)."""
    bays = [c for c in strips if c.closed_by == "lintel"]
    rows = [
        _row_of_bays(opening, [bay for bay in bays if side in bay.sides], config.header_m) for side in opening.sides
    ]
    sides = zip(rows, opening.sides, (-1.0, 1.0), strict=True)
    return all(row.width > config.beam_m and _is_as_broad(row, opening, way, rooms[side]) for row, side, way in sides)


def _is_in_colonnade(opening: Opening, strips: Sequence[Opening]) -> bool:
    """Return whether a gap stands in a row of three gaps or more between the same two spaces (R1)."""
    gaps = [c for c in strips if c.closed_by == "gap"]
    gaps = [gap for gap in gaps if set(gap.sides) == set(opening.sides)]
    row = _row_of_bays(opening, gaps, 0.0) if len(gaps) >= 3 else opening
    line = shapely.linestrings(row.segment)
    return bool(sum(shapely.dwithin(line, shapely.points(gap.centre), opening.depth) for gap in gaps) >= 3)


def _row_of_bays(opening: Opening, bays: Sequence[Opening], least_m: float) -> Opening:
    """Return the opening that a bay, wider than ``least_m``, makes with those in line beside it, pillars and all (R1).

    Between two bays stands a pillar: at most ``THICK_WALL_M`` of wall.
    """
    if opening.width <= least_m:
        return opening
    start, end = opening.width / -2, opening.width / 2
    spans = []
    for bay in bays:
        away = bay.centre - opening.centre
        in_line = abs(float(bay.along @ opening.along)) > PARALLEL and abs(float(away @ opening.across)) < opening.depth
        if in_line and bay.width > least_m:
            middle = float(away @ opening.along)
            spans.append((middle - bay.width / 2, middle + bay.width / 2))
    for low, high in sorted(spans, key=lambda span: abs(span[0] + span[1])):  # the nearest first
        if low - end < THICK_WALL_M and start - high < THICK_WALL_M:
            start, end = min(start, low), max(end, high)
    return opening.part_between(start, end)


def _is_as_broad(row: Opening, bay: Opening, way: float, room: Polygon) -> bool:
    """Return whether a row takes ``WHOLE_BREADTH`` of the room right behind one of its bays (R1).

    The room lies on the side ``way`` (-1 or 1) of the row.
    """
    out = way * row.across * row.depth / 2
    ahead, aside = way * row.across * AROUND_M, row.along * 2 * row.width
    face = row.centre + out
    window = Polygon([face - aside, face + aside, face + aside + ahead, face - aside + ahead])
    near = shapely.points(bay.centre + out + ahead / 10)
    seen = [piece for piece in polygons_of(intersect(room, window)) if shapely.dwithin(piece, near, BESIDE_M)]
    return bool(row.width >= WHOLE_BREADTH * sum(piece.area for piece in seen) / AROUND_M)


def _around_no_room(candidates: list[Opening], rooms: list[Polygon], walled: float) -> set[int]:
    """Return the strips around the first space with too little wall along its edge (R2)."""
    for index, room in enumerate(rooms):
        around = {k for k, c in enumerate(candidates) if c.is_strip and index in c.sides and not c.leads_outside}
        open_width = sum(candidates[k].width for k in around)
        if open_width > (1 - walled) * room.length:
            return around
    return set()


def _around_a_slot(candidates: list[Opening], rooms: list[Polygon]) -> set[int]:
    """Return the strips between the first space too narrow to stand in and the room to which it opens most (R2).

    A space that opens to rooms along less than ``LARGELY`` of its length lies under the eaves; it is opened to the
    outside instead.
    """
    for index in np.flatnonzero(are_too_narrow(rooms, PASSABLE_M)).tolist():
        ways: dict[int, set[int]] = {}
        for k, candidate in enumerate(candidates):
            if candidate.is_strip and index in candidate.sides:
                (other,) = set(candidate.sides) - {index} or {OUTSIDE}
                ways.setdefault(other, set()).add(k)
        outer = ways.pop(OUTSIDE, set())
        inner = sum(candidates[k].width for strips in ways.values() for k in strips)
        if outer and inner < LARGELY * rooms[index].length / 2:
            return outer
        if ways:
            return max(ways.values(), key=lambda strips: sum(candidates[k].polygon.length for k in strips))
    return set()


def _widest_gap_of_a_niche(candidates: list[Opening], rooms: list[Polygon], least_m2: float) -> set[int]:
    """Return the widest gap of the first room below ``least_m2`` that one can leave only through gaps."""
    for index, room in enumerate(rooms):
        ways = [k for k, c in enumerate(candidates) if c.is_strip and index in c.sides]
        if room.area >= least_m2 or not ways or any(candidates[k].closed_by not in {"gap", "gate"} for k in ways):
            continue
        widest = max(ways, key=lambda k: candidates[k].polygon.length)
        if not _is_closet(room, candidates[widest]):
            return {widest}
    return set()


def _is_closet(room: Polygon, opening: Opening) -> bool:
    """Return whether a gap leads into a small room that is wider than the gap, as a closet is (R2)."""
    breadth = np.ptp(dot_product(shapely.get_coordinates(room.exterior), opening.along))
    return bool(room.area >= CLOSET_M2 and opening.width < MOSTLY * breadth)


def _is_beam_in_room(strip: Opening, walls: BaseGeometry, level: Level) -> bool:
    """Return whether a lintel hangs in one room of the source, nearly from one side of it to the other (R6)."""
    if strip.closed_by != "lintel" or not strip.is_strip or not lies_in_room(strip.polygon, level):
        return False
    rooms = [each.polygon for each in level.rooms if each.polygon is not None]
    most = MOST * shapely.area(rooms).sum()
    for room in rooms:
        if room.area < most and room.contains(shapely.points(strip.centre)):
            reach = strip.along * room.length
            line = shapely.linestrings([strip.centre - reach, strip.centre + reach])
            pieces = shapely.get_parts(shapely.intersection(line, room))
            chord = min(pieces, key=shapely.points(strip.centre).distance)
            return bool(shapely.intersection(chord, walls).length < SOME * chord.length)
    return False


def minimal_separators(
    door: BaseGeometry,
    kept: list[Opening],
    pieces: list[Opening],
    plane: BaseGeometry,
    rooms: list[Polygon],
) -> list[Opening]:
    """Return a minimal set of ``pieces`` that, together with ``kept``, holds all spaces apart.

    ``plane`` is the door plane with all of these in it, and ``rooms`` are the spaces that it encloses. Pieces are tried
    from the last to the first. Taking a piece away joins all spaces, and all pieces already taken away, that it
    touches. The piece goes if the result holds at most one space; the outside counts as a space.
    """
    spaces = [*rooms, area_outside(plane)]
    others = unite(candidate.polygon for candidate in kept)
    bare = [subtract(subtract(piece.polygon, door), others) for piece in pieces]
    shapes = [drop_lines_and_points(shape) for shape in drop_thin_parts_of_each(bare, 4 * HAIR_M)]
    grown = shapely.buffer(shapes, MM_M, join_style="mitre")
    n = len(pieces)
    meets: list[set[int]] = [set() for _ in pieces]  # pieces, and after them the spaces
    for k, space in _touching(grown, spaces):
        meets[k].add(n + space)
    for k, other in _touching(grown, shapes):
        meets[k].add(other)
        meets[other].add(k)
    groups, left = Groups(n + len(spaces)), set[int]()
    for k in range(n - 1, -1, -1):
        touched = [each for each in meets[k] if each >= n or (each > k and each not in left)]
        held = {groups.of(space) for space in range(n, n + len(spaces))} & {groups.of(each) for each in touched}
        if len(held) > 1:
            left.add(k)
            continue
        for each in touched:
            groups.join(k, each)
    return [pieces[k] for k in sorted(left)]


def _touching(grown: Shapes, others: Sequence[BaseGeometry]) -> list[tuple[int, int]]:
    """Return pairs of indices: which grown piece overlaps which of the others in more than a point."""
    tree = shapely.STRtree(others)
    pairs = tree.query(grown, predicate="intersects")
    shared = shapely.area(intersect_pairs(grown[pairs[0]], tree.geometries[pairs[1]]))
    return [(int(k), int(other)) for k, other in pairs.T[shared > MM_M * HAIR_M]]


def _without_effect(pieces: Sequence[Opening], kinds: Collection[str], division: Division) -> list[Opening]:
    """Return the pieces of some kinds that parted nothing: doors and openings, lintels over doorways, gaps (R5).

    A doorway may part nothing by itself because of a wide opening beside it. A lintel or a gap that would part spaces
    was dropped for another reason, and is not returned.
    """
    found = division.idle(piece for piece in pieces if piece.closed_by in kinds)
    found = [piece for piece in found if piece.closed_by != "lintel" or _is_over_doorway(piece.polygon)]
    if all(piece.closed_by in KNOWN for piece in found):
        return found
    closed = division.closed_by(found)
    return [piece for piece in found if not _parts_spaces(piece, division.ground, closed)]


def _part_at_mouths(level: Level, beside: Sequence[Opening], found: Division) -> Division:
    """Return the division with the mouths, and with the pieces of ``beside`` that part spaces only beside a mouth (R5).

    A gap in line with a mouth belongs to the mouth's row (``find_mouths``), so it does not count as beside it.
    """
    all_closed = found.closed_by(beside)
    ways = [way for way in found.openings if way.closed_by in WAYS]
    for row in find_mouths(all_closed.spaces, all_closed.ground, ways):
        if any(lies_in_room(mouth.polygon, level) for mouth in row):
            continue
        others = [
            piece
            for piece in beside
            if piece.closed_by != "gap" or not any(_width_in_line(mouth.polygon, piece.polygon) for mouth in row)
        ]
        closed = found.closed_by(row + others)
        needed = [piece for piece in others if is_crack(piece) or _parts_spaces(piece, found.ground, closed)]
        if len(needed) < len(others):
            closed = found.closed_by(row + needed)
        ways = closed.strips_of(row + needed, found.ground)
        if any(way.closed_by == "mouth" for way in ways):
            found = replace(closed, openings=found.openings + ways)
    return found


def _in_line_with_idle_doors(
    doorways: Sequence[Opening], pieces: Sequence[Opening], found: Division, config: LayoutConfig
) -> Division:
    """Return the division with those named doors that parted nothing, and what closes in line with them (R7)."""
    named = unite([each.polygon for each in doorways if each.said_by == "named" and each.has_door])
    if named.is_empty:
        return found
    idle = found.idle(each for each in pieces if each.closed_by in {"door", "lintel", "gate"})
    for door in [each for each in idle if each.has_door and each.polygon.intersects(named)]:
        in_line = [
            replace(each, polygon=box_polygon(box_around_polygon(each.polygon), width=width + 2 * BESIDE_M))
            for each in idle
            if not each.has_door and (width := _width_in_line(door.polygon, each.polygon))
        ]
        if not in_line or (closed := _parting(door, in_line, found, config)) is None:
            continue
        for each in list(in_line):
            fewer = [other for other in in_line if other is not each]
            if (less := _parting(door, fewer, found, config)) is not None:
                in_line, closed = fewer, less
        found = replace(closed, openings=found.openings + closed.strips_of([door, *in_line], found.ground))
    return found


def _parting(door: Opening, beside: Sequence[Opening], found: Division, config: LayoutConfig) -> Division | None:
    """Return the division where a door, closed with others, parts two spaces that are rooms, else None (R7)."""
    closed = found.closed_by([door, *beside])
    sides = [way.sides for way in closed.strips_of([door], found.ground) if way.is_strip]
    spaces = closed.spaces
    are_rooms = (
        one != other and OUTSIDE not in {one, other} and min(spaces[one].area, spaces[other].area) >= config.area_m2
        for one, other in sides
    )
    return closed if any(are_rooms) else None


def _width_in_line(door: Polygon, other: Polygon) -> float:
    """Return the width, metres, of a piece that is as thin as a wall and in line with another, else 0 (R5)."""
    box, there = box_around_polygon(door), box_around_polygon(other)
    aside = abs(float(dot_product(there.centre - box.centre, box.across)))
    runs = abs(float(dot_product(box.along, there.along))) > PARALLEL
    in_line = runs and there.thickness <= THICK_WALL_M and aside <= (box.thickness + there.thickness) / 2
    return there.width if in_line else 0.0


def _is_over_doorway(lintel: Polygon) -> bool:
    """Return whether a lintel is as wide as a doorway, and no deeper than a wall."""
    box = box_around_polygon(lintel)
    return DOORWAY_M[0] <= box.width <= DOORWAY_M[1] and box.thickness <= THICK_WALL_M


def _parts_spaces(piece: Opening, ground: BaseGeometry, closed: Division) -> bool:
    """Return whether a piece leads from one space of a closed division to another (R5)."""
    return any(way.is_strip and way.sides[0] != way.sides[1] for way in closed.strips_of([piece], ground))


def _at_doorless_openings(level: Level, walls: BaseGeometry, found: Division) -> Division:
    """Return the division with the openings without a door between named rooms (R4)."""
    named = [] if level.sills else [room.polygon for room in level.rooms if room.polygon is not None]
    if len(named) < 2:
        return found
    met = shapely.STRtree(found.spaces).query(named, predicate="intersects")[1]
    if len(np.unique(met)) == len(met):  # no space holds two rooms
        return found
    ways = find_doorless_openings(named, unite(found.spaces), walls)
    depths = [max(HAND_M - way.depth, 0.0) / 2 for way in ways]
    strips = [way.strip(deeper_m=depth, wider_m=LAP_M) for way, depth in zip(ways, depths, strict=True)]
    while strips:
        pieces = [Opening.closing(strip, "opening") for strip in strips]
        closed = found.closed_by(pieces)
        held = [any(intersect(room, part).area > MOST * room.area for room in named) for part in closed.spaces]
        ways = closed.strips_of(pieces, found.ground)
        parting = [way.polygon for way in ways if _parts_two(way, held)]
        kept = [strip for strip in strips if intersect(strip, unite(parting)).area > MOST * strip.area]
        if len(kept) == len(strips):
            return replace(closed, openings=found.openings + ways)
        strips = kept
    return found


def _parts_two(way: Opening, held: Sequence[bool]) -> bool:
    """Return whether a way leads from one space to another, each of which holds a room (R4)."""
    if not way.is_strip or way.leads_outside or way.sides[0] == way.sides[1]:
        return False
    return all(held[side] for side in way.sides)


def _impassable_slits(room: Polygon, least_m2: float) -> list[Polygon]:
    """Return the slits that join parts of a room of ``least_m2`` or more (R3)."""
    pieces = polygons_of(buffer_mitred(room, -PARTITION_M / 2))
    if len(pieces) < 2:
        return []
    parts = [intersect(buffer_mitred(piece, PARTITION_M / 2 + HAIR_M), room) for piece in pieces]
    large = [part for part in parts if part.area >= least_m2]
    if len(large) < 2:
        return []
    between = [intersect(one, other) for one, other in combinations(large, 2)]
    rest = polygons_of(subtract(room, unite(parts)))
    between += [slit for slit in rest if sum(slit.distance(part) < HAIR_M for part in large) > 1]
    return grow_to_overlap([slit for shape in between for slit in polygons_of(shape)])
