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
    are_too_narrow,
    dot_product,
    enclosed_pieces,
    intersect,
    polygons_of,
)
from pipeline.geometry.closing_candidates import (
    assign_sides,
    close_plane,
    minimal_separators,
)
from pipeline.geometry.portals import Portal
from pipeline.stages.closings import KNOWN, lies_in_room
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    GROUP,
    LARGELY,
    MOST,
    MOSTLY,
    PARALLEL,
    PASSABLE_M,
    SOME,
    THICK_WALL_M,
)
from pipeline.values import ClosingCandidate, Level

CLOSET_M2 = 0.9
WHOLE_BREADTH = 0.85


def keep_separating(
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
    candidate: ClosingCandidate,
    strips: Sequence[ClosingCandidate],
    rooms: list[Polygon],
    planes: tuple[BaseGeometry, BaseGeometry],
    config: LayoutConfig,
) -> bool:
    """R1: ``planes`` are the walls of the door plane and the shallow headers."""
    door, shallow_headers = planes
    portal = candidate.portal
    if portal is None or portal.sides[0] == portal.sides[1]:
        return portal is not None
    if OUTSIDE in portal.sides or candidate.kind in KNOWN:
        return False
    if candidate.kind == "gate":  # R1
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
    """Return whether a lintel is part of a beam over one bay or several, as broad as the rooms at both sides (R1)."""
    bays = [c.portal for c in strips if c.kind == "lintel" and c.portal is not None]
    rows = [_row_of_bays(portal, [bay for bay in bays if side in bay.sides], config.header_m) for side in portal.sides]
    sides = zip(rows, portal.sides, (-1.0, 1.0), strict=True)
    return all(row.width > config.beam_m and _is_as_broad(row, portal, way, rooms[side]) for row, side, way in sides)


def _is_in_colonnade(portal: Portal, strips: Sequence[ClosingCandidate]) -> bool:
    """Return whether a gap stands in a row of ``GROUP`` gaps or more between the same two spaces (R1)."""
    gaps = [c.portal for c in strips if c.kind == "gap" and c.portal is not None]
    gaps = [gap for gap in gaps if set(gap.sides) == set(portal.sides)]
    row = _row_of_bays(portal, gaps, 0.0) if len(gaps) >= GROUP else portal
    line = shapely.linestrings(row.segment)
    return bool(sum(shapely.dwithin(line, shapely.points(gap.centre), portal.depth) for gap in gaps) >= GROUP)


def _row_of_bays(portal: Portal, bays: Sequence[Portal], least_m: float) -> Portal:
    """Return the opening that a bay, wider than ``least_m``, makes with those in line beside it, pillars and all (R1).

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


def _around_no_room(candidates: list[ClosingCandidate], rooms: list[Polygon], walled: float) -> set[int]:
    """Return the strips around the first space that hardly touches a wall (R2)."""
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
    """Return the strips between the first space too narrow to stand in and the room to which it opens most (R2).

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
    """Return whether a gap leads into a small room that is wider than the gap, as a closet is (R2)."""
    breadth = np.ptp(dot_product(shapely.get_coordinates(room.exterior), portal.along))
    return bool(room.area >= CLOSET_M2 and portal.width < MOSTLY * breadth)


def is_beam_in_room(strip: ClosingCandidate, walls: BaseGeometry, level: Level) -> bool:
    """Return whether a lintel hangs in one room of the source, nearly from one side of it to the other (R3)."""
    if strip.kind != "lintel" or strip.portal is None or not lies_in_room(strip.polygon, level):
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
