"""Keep of the strips that may close the door plane those that part two spaces.

R1  A piece that parts nothing (a shelf, a wall cabinet) is dropped, and so is a beam: one that spans more than
    ``beam_m`` between walls that cross its line, or between pillars that leave nearly the whole breadth of the room
    open on both sides, or more than ``header_m`` and hangs down by a hand's breadth at most. Wide bays in a row with
    nothing but pillars between them are one opening. So are ``GROUP`` gaps or more in a row between the same two
    spaces, with posts between them (a colonnade). A wide gap (``gate``) closes to the outside only.
R2  A gap is dropped where it would part off less than a room, but for a closet that is wider than it. So are all strips
    around a space that has less than ``walled`` of its edge along walls (what hangs from a ceiling is no room), or that
    is too narrow to stand in.
R3  A lintel over one room of the source, which no wall but posts and nibs goes on from, is a beam and closes nothing. A
    room that is most of what the source draws may be the floor of a storey, and says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    OUTSIDE,
    Shapes,
    are_too_narrow,
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
from pipeline.geometry.openings import KNOWN, Opening, area_outside, assign_sides, close_plane
from pipeline.stages.closings import lies_in_room
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    GROUP,
    HAIR_M,
    LARGELY,
    MM_M,
    MOST,
    MOSTLY,
    PARALLEL,
    PASSABLE_M,
    SOME,
    THICK_WALL_M,
)
from pipeline.values import Level

CLOSET_M2 = 0.9
WHOLE_BREADTH = 0.85


def keep_separating(
    door: BaseGeometry,
    shallow_headers: BaseGeometry,
    strips: list[Opening],
    rest: list[Opening],
    config: LayoutConfig,
) -> tuple[list[Opening], BaseGeometry, list[Polygon]]:
    """Drop strips until each remaining one separates two spaces, then drop what is not needed to keep the spaces apart.

    Returns what is left, and the closed plane with its spaces.
    """
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
            return strips + rest, plane, rooms
        else:  # strips that stood against what is dropped here may part nothing now
            rest, pruned = minimal_separators(door, strips, rest, plane, rooms), True


def _parts_nothing(
    candidate: Opening,
    strips: Sequence[Opening],
    rooms: list[Polygon],
    planes: tuple[BaseGeometry, BaseGeometry],
    config: LayoutConfig,
) -> bool:
    """R1: ``planes`` are the walls of the door plane and the shallow headers."""
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
    """Return whether a gap stands in a row of ``GROUP`` gaps or more between the same two spaces (R1)."""
    gaps = [c for c in strips if c.closed_by == "gap"]
    gaps = [gap for gap in gaps if set(gap.sides) == set(opening.sides)]
    row = _row_of_bays(opening, gaps, 0.0) if len(gaps) >= GROUP else opening
    line = shapely.linestrings(row.segment)
    return bool(sum(shapely.dwithin(line, shapely.points(gap.centre), opening.depth) for gap in gaps) >= GROUP)


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
    """Return the strips around the first space that hardly touches a wall (R2)."""
    for index, room in enumerate(rooms):
        around = {k for k, c in enumerate(candidates) if c.is_strip and index in c.sides and not c.leads_outside}
        open_width = sum(candidates[k].width for k in around)
        if open_width > (1 - walled) * room.length:
            return around
    return set()


def _around_a_slot(candidates: list[Opening], rooms: list[Polygon]) -> set[int]:
    """Return the strips between the first space too narrow to stand in and the room to which it opens most (R2).

    What opens to rooms along less than ``LARGELY`` of its length lies under the eaves, and is opened to the outside.
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


def is_beam_in_room(strip: Opening, walls: BaseGeometry, level: Level) -> bool:
    """Return whether a lintel hangs in one room of the source, nearly from one side of it to the other (R3)."""
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
    """Return those of ``pieces`` without which, beside ``kept``, spaces would run into each other.

    ``plane`` is the door plane with all of these in it, and ``rooms`` are what it encloses. The last piece is taken
    away first. Without it, all spaces and all pieces already taken away that it touches become one: it may go as long
    as that holds no two spaces, the outside being one of them.
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
    """Return which of the grown pieces lie over which of the others for more than a point: pairs of indices."""
    tree = shapely.STRtree(others)
    pairs = tree.query(grown, predicate="intersects")
    shared = shapely.area(intersect_pairs(grown[pairs[0]], tree.geometries[pairs[1]]))
    return [(int(k), int(other)) for k, other in pairs.T[shared > MM_M * HAIR_M]]
