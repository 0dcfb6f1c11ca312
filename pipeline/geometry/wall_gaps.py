"""Find openings where walls end: gaps of full height, cracks, mouths of rooms, and ways between drawn rooms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    OUTSIDE,
    OutlineCorners,
    buffer_mitred,
    dot_product,
    drop_thin_parts,
    enclosed_pieces,
    intersect,
    polygons_of,
    subtract,
    trace_outlines,
    unite,
)
from pipeline.geometry.openings import GAPS, Opening, area_outside, grow_to_overlap
from pipeline.tolerances import (
    BESIDE_M,
    BLOCK_M,
    CM_M,
    CRACK_M,
    HAIR_M,
    HALL_M,
    HAND_M,
    LAP_M,
    MM_M,
    MOST,
    NEARLY_ALL,
    PARALLEL,
    PARTITION_M,
    ROOMY_M2,
    SHEET_M,
    SHOULDERS_M,
    SINGLE_DOOR_M,
    SLIVER_M,
    SOME,
    STAND_M,
    THICK_WALL_M,
    THIN_WALL_M,
    UNNAMED_WAY_M,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# Gaps of full height: where a wall ends and goes on, or meets another, after a step of free floor.
#
# Such a gap shows in no difference of two planes, so it is found from the ends of walls. An end is a short edge of the
# wall's outline between two right angles; the gap lies between the end and the wall that it points at.
#
# R1  If the end points at the end of another wall, the gap is a hole in one wall. The two walls may be slightly out of
#     line, as in drawings by hand.
# R2  If the end points at a crossing wall, the gap is at most as wide as a door with one leaf. Otherwise every wall
#     that juts into a corridor would part the corridor in two.
# R3  A nib, too short to be told from a pilaster, counts as an end if another end or nib faces it in line.
# R4  If one sheet of a wall ends a little before the other (``STAND_M``), the wall ends with the longer sheet.
# ---------------------------------------------------------------------------------------------------------------------

SQUARE_TURN = np.sin(np.deg2rad(25.0))


@dataclass(frozen=True, eq=False)
class WallEnd:
    """The short edge ``a`` to ``b`` (2,) at the end of a wall, and the unit vector ``out`` that points on from it.

    ``is_nib`` is True if it juts out too little to be surely the end of a wall (R3).
    """

    a: npt.NDArray[np.float64]
    b: npt.NDArray[np.float64]
    out: npt.NDArray[np.float64]
    is_nib: bool = False

    @property
    def centre(self) -> npt.NDArray[np.float64]:
        """The middle of the edge."""
        return np.asarray((self.a + self.b) / 2)

    def faces(self, other: WallEnd) -> bool:
        """Return whether two ends face each other in one line, as the ends at a hole in one wall do."""
        aside = np.array([-self.out[1], self.out[0]])
        width, other_width = (np.hypot(*(end.b - end.a)) for end in (self, other))
        beside = abs(dot_product(other.centre - self.centre, aside))
        return bool(dot_product(other.out, self.out) < -PARALLEL and max(abs(width - other_width), beside) < STAND_M)

    def width_of(self, gap: Polygon) -> float:
        """Return the width of a gap before the end, metres: its extent in the direction ``out``."""
        return float(np.ptp(dot_product(shapely.get_coordinates(gap), self.out)))


def wall_ends(walls: BaseGeometry, thickest_m: float = THICK_WALL_M, *, nibs: bool = False) -> Iterator[WallEnd]:
    """Yield every free end of a straight wall up to ``thickest_m``; with ``nibs`` also the nibs (R3)."""
    parts = polygons_of(walls)
    if parts:
        yield from (end for end in _ends_of(trace_outlines(parts, LAP_M), thickest_m) if nibs or not end.is_nib)


def _ends_of(walls: OutlineCorners, thickest_m: float) -> Iterator[WallEnd]:
    """Yield all that looks like an end, ring by ring."""
    points, after, before = walls.points, walls.after, walls.before
    edge = points[after] - points
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    came = unit[before]
    turn = came[:, 0] * unit[:, 1] - came[:, 1] * unit[:, 0]
    square = turn > np.cos(np.arcsin(SQUARE_TURN))  # a left turn of about 90 degrees: convex, the wall on the left
    end = square & square[after] & (length <= thickest_m) & (np.minimum(length[before], length[after]) >= SLIVER_M)
    long = np.maximum(length[before], length[after]) >= 2 * length
    juts = (turn[before] < 0) | (turn[after[after]] < 0)  # from a wall; a pillar stands free
    for k in np.flatnonzero(end & (long | juts)):
        out = np.array([unit[k, 1], -unit[k, 0]])
        yield WallEnd(points[k], points[after[k]], out, is_nib=not long[k])
    step, far = after, after[after]  # R4
    last = after[far]
    jog = (turn[step] * turn[far] < 0) & (
        np.minimum(np.abs(turn[step]), np.abs(turn[far])) > np.cos(np.arcsin(SQUARE_TURN))
    )
    jog &= square & square[last] & (length[step] < STAND_M) & ((unit * unit[far]).sum(axis=1) > PARALLEL)
    breadth = length + length[far]
    jog &= (breadth <= thickest_m) & (np.maximum(length[before], length[last]) >= 2 * breadth)
    jog &= np.minimum(length[before], length[last]) >= SLIVER_M
    for k in np.flatnonzero(jog):
        out = np.array([unit[k, 1], -unit[k, 0]])
        a, b = points[k], points[last[k]]
        beyond = float(dot_product(b - a, out))
        yield WallEnd(a + max(beyond, 0.0) * out, b + max(-beyond, 0.0) * out, out)


def gap_beyond_wall_end(end: WallEnd, walls: BaseGeometry, reach_m: float) -> Polygon | None:
    """Return the rectangle from a wall's end to the wall it points at, or None without a wall within ``reach_m``.

    That wall may end right there, so that part of the end's breadth points past it; a wall farther on does not count.
    """
    aside = np.array([-end.out[1], end.out[0]]) * 0.01
    inner = (end.a + aside, end.b - aside) if dot_product(end.b - end.a, aside) > 0 else (end.a - aside, end.b + aside)
    points = np.array([*inner, (end.a + end.b) / 2])  # the other wall may stand a little aside
    rays = shapely.linestrings(np.stack([points + 1e-3 * end.out, points + reach_m * end.out], axis=1))
    parts = shapely.get_parts(walls)  # most of them lie far away, which is seen at once
    hits, pair = shapely.get_coordinates(shapely.intersection(rays[:, None], parts).ravel(), return_index=True)
    if not len(hits):
        return None
    ray = pair // len(parts)
    away = dot_product(hits - points[ray], end.out)
    far = [float(away[ray == k].min()) for k in np.unique(ray)]
    met = max(each for each in far if each < min(far) + THICK_WALL_M)
    step = end.out * (met + 0.01)  # a little into the wall that it meets, so that they touch
    back = end.out * -0.005
    return Polygon([end.a + back, end.b + back, end.b + step, end.a + step])


def gap_fillings(
    tall: BaseGeometry, standing: Sequence[BaseGeometry], reach_m: float, *, ends: list[WallEnd] | None = None
) -> list[Polygon]:
    """Fillings of all gaps of full height up to ``reach_m`` metres, shortest first.

    Parameters
    ----------
    tall
        Walls that stand from the floor to above head height; a gap lies between two of them.
    standing
        All that closes the plane; a gap that it already fills is left out.
    ends
        The ``wall_ends`` with their nibs, if they are known already.
    """
    ends = list(wall_ends(tall, nibs=True)) if ends is None else ends
    if not ends:
        return []
    before = shapely.points([end.centre + CM_M * end.out for end in ends])
    taken = set(shapely.STRtree(standing).query(before, predicate="intersects")[0].tolist())
    found: list[Polygon] = []
    for k, end in enumerate(ends):
        if k in taken:
            continue
        gap = gap_beyond_wall_end(end, tall, reach_m)
        facing = _between_ends(gap or _strip_before_end(end, reach_m), end, ends, reach_m)
        if facing is not None:  # R1
            found.append(facing)
        elif gap is not None and end.width_of(gap) <= SINGLE_DOOR_M[1] and not end.is_nib:  # R2
            found.append(gap)
    found.sort(key=lambda g: (round(g.length, 6), g.bounds))
    return [found[k] for k in each_place_once(found)]


def each_place_once(found: Sequence[Polygon]) -> list[int]:
    """Return the indices of ``found`` without repetitions: shapes that lie mostly in an earlier one are dropped.

    A gap between two ends is found from both.
    """
    kept: list[int] = []
    for k, gap in enumerate(found):
        if not any(intersect(gap, found[j]).area > MOST * min(gap.area, found[j].area) for j in kept):
            kept.append(k)
    return kept


def _strip_before_end(end: WallEnd, reach_m: float) -> Polygon:
    """Return the strip before a wall's end, as broad as the end and ``reach_m`` long."""
    return Polygon([end.a, end.b, end.b + reach_m * end.out, end.a + reach_m * end.out])


def _between_ends(gap: Polygon, end: WallEnd, ends: list[WallEnd], reach_m: float) -> Polygon | None:
    """Return the gap from a wall's end to an end that faces it, or None if another wall comes between (R1, R3)."""
    near = shapely.buffer(gap, HAND_M, cap_style="square", join_style="mitre")
    found = []
    for other in ends:
        if dot_product(other.out, end.out) >= -PARALLEL:
            continue
        if not shapely.intersects(near, shapely.linestrings([other.a, other.b])):
            continue
        away = dot_product(other.centre - end.centre, end.out)
        if not 0 < away <= reach_m + CM_M:
            continue
        sure = end.faces(other) or not (end.is_nib or other.is_nib)  # R3
        if sure and (strip := _strip(end, other)) is not None:
            found.append(strip)
    return min(found, key=lambda strip: strip.length, default=None)


def _strip(end: WallEnd, other: WallEnd) -> Polygon | None:
    """Return the filling between two ends: their overlap, or all between them; None if they are too far aside (R1)."""
    aside = np.array([-end.out[1], end.out[0]])
    (a, b), (c, d) = (np.sort([dot_product(side, aside) for side in (each.a, each.b)]) for each in (end, other))
    low, high = max(a, c), min(b, d)
    if low - high > HAND_M:
        return None
    if high - low < SOME * min(b - a, d - c):
        low, high = min(a, c), max(b, d)
    start = min(dot_product(end.a, end.out), dot_product(end.b, end.out)) - 0.005
    stop = max(dot_product(other.a, end.out), dot_product(other.b, end.out)) + 0.01
    corners = [(start, low), (stop, low), (stop, high), (start, high)]
    return Polygon([step * end.out + side * aside for step, side in corners])


def crack_fillings(walls: BaseGeometry) -> list[Polygon]:
    """Return fillings of the cracks between walls that nearly meet, mostly in a corner.

    A disc with the radius ``HAND_M`` cannot enter a crack, and a crack is no longer than a wall is thick, unlike a slit
    between two walls. A crack is open on two sides, the corner of a room on one side only. So walls grown by ``HAND_M``
    close cracks: they join two walls, or part a space in two. Most houses have no cracks.
    """
    grown = shapely.buffer(walls, HAND_M, quad_segs=4)
    if not _joins_or_parts(grown, walls):
        return []
    whole = shapely.buffer(grown, -HAND_M, quad_segs=4)
    pieces = polygons_of(drop_thin_parts(subtract(whole, walls), LAP_M))
    small = [p for p in pieces if max(p.bounds[2] - p.bounds[0], p.bounds[3] - p.bounds[1]) <= WALL_M]
    if not small:
        return []
    along = shapely.buffer(walls, MM_M, quad_segs=1)
    parts = np.array(polygons_of(along), dtype=np.object_)
    of_piece, of_part = shapely.STRtree(parts).query(small, predicate="intersects")
    near = [shapely.multipolygons(parts[of_part[of_piece == k]]) for k in range(len(small))]
    bare = shapely.difference([piece.exterior for piece in small], near)
    sides = [len(shapely.get_parts(shapely.line_merge(edge))) for edge in bare]
    return grow_to_overlap([piece for piece, count in zip(small, sides, strict=True) if count > 1])


def _joins_or_parts(grown: BaseGeometry, walls: BaseGeometry) -> bool:
    """Return whether growing the walls joins parts that stand apart, or parts a space or the outside."""
    parts, left = polygons_of(walls), polygons_of(grown)
    if len(parts) != len(left):
        return True
    spaces = [Polygon(ring) for part in parts for ring in part.interiors]
    places = [ring.coords[0] for part in left for ring in part.interiors]
    if not places:
        return False
    place, space = shapely.STRtree(spaces).query(shapely.points(places), predicate="intersects")
    return not len(place) == len(places) == len(set(space.tolist()))


def contact_fillings(walls: BaseGeometry) -> list[Polygon]:
    """Fillings of the places where walls touch in a point, or less than ``MM_M`` apart, and that part two spaces.

    Walls that are cells of a map touch corner to corner; rounding decides whether they do.
    """
    narrow = shapely.buffer(walls, MM_M / 2, quad_segs=1)
    if not _joins_or_parts(narrow, walls):
        return []
    free = enclosed_pieces(walls)[1]
    spaces = [*enclosed_pieces(narrow)[1], area_outside(narrow)]
    inside = [shapely.points(space.representative_point().coords[0]) for space in spaces]
    homes = [next((k for k, piece in enumerate(free) if piece.contains(point)), OUTSIDE) for point in inside]
    parted = [(a, b) for a, b in combinations(range(len(spaces)), 2) if homes[a] == homes[b]]
    meet = [shapely.intersection(*shapely.buffer([spaces[a], spaces[b]], MM_M)) for a, b in parted]
    places = shapely.centroid(shapely.get_parts(meet))
    places = places[~shapely.contains(buffer_mitred(walls, -HAIR_M), places)]  # there the wall is thin, and no more
    return polygons_of(unite(shapely.buffer(places, CRACK_M / 2, cap_style="square")))


# ---------------------------------------------------------------------------------------------------------------------
# The mouths of a room: narrow places, where a person sees one room end and the next begin.
#
# R1  A mouth lies between the end of a wall, or of a block between two rooms, and the wall that the end points at. That
#     wall may also end a partition's breadth beside the point.
# R2  Right behind a mouth, on both sides, the room is at least twice as broad as the mouth is wide. This excludes the
#     end of a corridor, where one side is as broad as the mouth. A mouth between blocks that is not twice as wide
#     as deep needs room behind it for a disc ``WIDER`` times as wide as the mouth. This excludes a corridor between
#     bends and crossings. A hole in one wall, with a jamb on either side, may take ``NARROW_IN_WALL`` of the breadth.
#     A mouth at a block deeper than ``BLOCK_M`` is no deeper than wide; otherwise it is a corridor.
# R3  Both parts are as large as a room. Of several mouths, the narrowest compared with its two sides comes first.
# R4  The end of a corridor, up to ``UNNAMED_WAY_M`` wide, at a corner beyond which a room is twice as broad, is a mouth
#     if the corridor is a hall. A hall has two ends or more and another way into it; no other way inside leads into the
#     rooms behind its ends. Such a room holds a disc as in R2, or else it is a bend. A gap as wide as the hall is broad
#     counts as an end that is closed already. A corridor between rooms with other ways belongs to them, as in an open
#     plan.
# ---------------------------------------------------------------------------------------------------------------------

NARROW_IN_WALL = 0.65
WIDER = 1.5
"""The disc in a crossing of four corridors of one width is 1.41 times as wide as they are."""
LOOK_M = (0.5, 2.0)
"""How far behind a mouth its breadth is measured: as far as the mouth is wide, within these limits."""
HALL_M2 = 1.5
"""The least hall: what a person needs to turn between doors."""


class _Mouth(NamedTuple):
    """A mouth, whose polygon is its filling, and how much of the breadth behind it the mouth may take (R2)."""

    opening: Opening
    share: float

    def in_row(self, other: _Mouth) -> bool:
        """Return whether two mouths lie in one wall."""
        along, off = self.opening.along, other.opening.centre - self.opening.centre
        aside = abs(along[0] * off[1] - along[1] * off[0])
        return bool(aside < BESIDE_M and abs(dot_product(along, other.opening.along)) > PARALLEL)


def find_mouths(rooms: Sequence[Polygon], walls: BaseGeometry, ways: Sequence[Opening] = ()) -> list[list[Opening]]:
    """Return the mouths that part ``rooms`` into more rooms.

    One list holds the mouths of one wall that part a room only together, or the mouths of one hall.

    Parameters
    ----------
    walls
        All that closes the rooms.
    ways
        The doorways, openings and gaps among it.
    """
    ends = list(wall_ends(walls, HALL_M, nibs=True)) if rooms else []
    every = [mouth for end in ends if (mouth := _mouth_at(end, ends, walls)) is not None]
    every = [mouth for mouth in every if mouth.opening.width > CRACK_M]
    every.sort(key=lambda each: (round(each.opening.width, 6), each.opening.polygon.bounds))
    every = [every[k] for k in each_place_once([mouth.opening.polygon for mouth in every])]
    corridors = _ends_of_corridors(walls) if ways else []
    found: list[list[Opening]] = []
    waiting = list(rooms)
    while waiting:
        room = waiting.pop()
        if hall := _hall_ends(room, corridors, ways):
            found.append(hall)
            waiting += polygons_of(subtract(room, unite(end.polygon for end in hall)))
            continue
        near = [mouth for mouth in every if shapely.contains(room, shapely.points(mouth.opening.centre))]
        rows = [[other for other in near if mouth.in_row(other)] for mouth in near]
        tries = [(parts, row) for row in [*([mouth] for mouth in near), *rows] if (parts := _part_at_mouths(room, row))]
        if tries:
            (_, sides), row = min(
                tries, key=lambda each: (round(each[0][0], 6), len(each[1]), each[1][0].opening.polygon.bounds)
            )
            found.append([mouth.opening for mouth in row])
            waiting += sides
    return found


def _mouth_at(end: WallEnd, ends: Sequence[WallEnd], walls: BaseGeometry) -> _Mouth | None:
    strip = gap_beyond_wall_end(end, walls, HALL_M)
    straight = np.inf if strip is None else end.width_of(strip) - 0.015
    depth, left = float(np.hypot(*(end.b - end.a))), np.array([-end.out[1], end.out[0]])
    low, high = -min(depth, PARTITION_M) / 2, min(depth, PARTITION_M) / 2
    width, centre = straight, end.centre
    for way in (-1, 1):
        past = _distance_beside(end, way * (depth / 2 + THIN_WALL_M) * left, walls)
        if past < min(width, straight - THICK_WALL_M):
            width, side = past, way * (depth / 2 + THIN_WALL_M)
            low, high = min(-depth / 2, side), max(depth / 2, side)
            centre = end.centre + (low + high) / 2 * left
    if not np.isfinite(width) or depth > max(BLOCK_M, width + PARTITION_M):
        return None
    near, far = end.centre - 0.005 * end.out, end.centre + (width + 0.01) * end.out
    filling = Polygon([near + low * left, near + high * left, far + high * left, far + low * left])
    met = end.centre + end.out * width
    in_wall = any(end.faces(other) and np.hypot(*(other.centre - met)) < BESIDE_M for other in ends)
    deep = depth if width == straight else high - low
    wide = min(width, _distance_beside(end, np.zeros(2), walls))  # some of the end's breadth may point past the wall
    middle = centre + end.out * width / 2
    opening = Opening(middle, end.out, wide, deep, (OUTSIDE, OUTSIDE), polygon=filling, closed_by="mouth")
    return _Mouth(opening, NARROW_IN_WALL if in_wall else MOST)


def _distance_beside(end: WallEnd, aside: npt.NDArray[np.float64], walls: BaseGeometry) -> float:
    """Return the distance, m, from a wall's end, shifted by ``aside`` (2,), to the first wall in its line, or inf."""
    start = end.centre + aside
    ray = shapely.linestrings([start + 1e-3 * end.out, start + HALL_M * end.out])
    hit = shapely.get_coordinates(shapely.intersection(ray, walls))
    return float(np.min(dot_product(hit - start, end.out), initial=np.inf))


def _part_at_mouths(room: Polygon, row: Sequence[_Mouth]) -> tuple[float, list[Polygon]] | None:
    """Return the mouths' width as a share of the breadth behind them, and the two parts; None by R2 or R3."""
    mouths = [mouth.opening for mouth in row]
    parts = [p for p in polygons_of(subtract(room, unite(m.polygon for m in mouths))) if p.area >= ROOMY_M2]
    if len(parts) < 2:
        return None
    narrowest, between = 0.0, set()
    for mouth in mouths:
        sides = [_room_behind_mouth(mouth, way, parts) for way in (1, -1)]
        if sides[0] is None or sides[1] is None or sides[0][0] == sides[1][0]:
            return None
        between.add(frozenset(k for k, _ in (sides[0], sides[1])))
        narrowest = max(narrowest, sum(m.width for m in mouths) / min(sides[0][1], sides[1][1]))
    if len(between) > 1 or narrowest > min(mouth.share for mouth in row):
        return None
    return narrowest, [parts[k] for k in sorted(next(iter(between)))]


def _room_behind_mouth(mouth: Opening, way: int, parts: Sequence[Polygon]) -> tuple[int, float] | None:
    """Return which part of a room lies behind a mouth on one side, and how broad it is there, in metres."""
    aside = mouth.across * way
    face = mouth.centre + aside * (mouth.depth / 2 + 1e-2)
    at = shapely.points(face)
    k = next((k for k, part in enumerate(parts) if shapely.contains(part, at)), None)
    if k is None:
        return None
    look = float(np.clip(mouth.width, *LOOK_M))
    far = HALL_M / MOST * mouth.along
    window = Polygon([face - far, face + far, face + far + aside * look, face - far + aside * look])
    seen = [piece for piece in polygons_of(intersect(parts[k], window)) if shapely.dwithin(piece, at, 0.05)]
    between_blocks = mouth.depth > THICK_WALL_M and mouth.width < 2 * mouth.depth
    if between_blocks and not _holds_wider_disc(parts[k], mouth, at):
        return None
    return k, sum(piece.area for piece in seen) / look


def _holds_wider_disc(part: Polygon, mouth: Opening, at: shapely.Point) -> bool:
    """Return whether a part holds, near a point, a disc ``WIDER`` times as wide as a mouth; no corridor does (R2)."""
    wide = WIDER * mouth.width
    return bool(shapely.dwithin(shapely.buffer(part, -wide / 2), at, 2 * wide))


class _HallEnd(NamedTuple):
    """The end of a corridor in a room, the part of the room before it, and its share of the breadth behind it."""

    opening: Opening
    before: Polygon
    share: float

    def faces(self, other: _HallEnd) -> bool:
        """Return whether each of two ends lies before the other: the area between them lies before both."""
        ours, theirs = (shapely.points(each.opening.centre) for each in (self, other))
        return bool(self.before.contains(theirs) and other.before.contains(ours))


def _hall_ends(room: Polygon, corridors: Sequence[Opening], ways: Sequence[Opening]) -> list[Opening]:
    """Return the ends of a hall in a room, or nothing; ``ways`` are all other ways of the storey."""
    inside = [strip for strip in corridors if shapely.contains(room, shapely.points(strip.centre))]
    inner = unite(way.polygon for way in ways if not (way.is_strip and way.leads_outside))
    ends = [end for strip in inside if (end := _hall_end(strip, room, inner)) is not None]
    ends.sort(key=lambda end: (round(end.share, 6), end.opening.polygon.bounds))
    for first in ends:
        hall, around = first.before, [first]
        for end in ends:
            if all(end.faces(other) for other in around):
                between = max(polygons_of(intersect(hall, end.before)), key=lambda piece: piece.area, default=None)
                if between is not None and between.area >= HALL_M2:
                    hall = between
                    around.append(end)
        into = [way for way in ways if shapely.dwithin(hall, way.polygon, CRACK_M)]
        closed = sum(_is_breadth_of(hall, way) for way in into)
        if hall.area >= HALL_M2 and len(around) + closed > 1 and len(into) > closed:
            return [end.opening for end in around]
    return []


def _is_breadth_of(hall: Polygon, way: Opening) -> bool:
    """Return whether a gap is as wide as the hall before it, so that it already closes an end of the hall (R4)."""
    if way.closed_by not in GAPS or not way.is_strip:
        return False
    before = [seen[1] for side in (1, -1) if (seen := _room_behind_mouth(way, side, [hall])) is not None]
    return bool(before) and way.width > NEARLY_ALL * before[0]


def _ends_of_corridors(walls: BaseGeometry) -> list[Opening]:
    """Return the strips across places up to ``UNNAMED_WAY_M`` wide beside a convex corner of the walls (R4).

    ``along`` runs from the corner to the wall that faces it, and ``across`` out of the corridor.
    """
    corners = trace_outlines(polygons_of(walls), LAP_M)
    points, edge = corners.points, corners.points[corners.after] - corners.points
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    came = unit[corners.before]
    square = came[:, 0] * unit[:, 1] - came[:, 1] * unit[:, 0] > np.cos(np.arcsin(SQUARE_TURN))
    after, before = (np.flatnonzero(square & (each >= HAND_M)) for each in (length, length[corners.before]))
    into = np.concatenate([unit[after], -came[before]])  # the corridor lies along the wall's edge
    right = np.concatenate([unit[after], came[before]]) @ [[0.0, -1.0], [1.0, 0.0]]
    start = points[np.concatenate([after, before])] + into * HAND_M / 2
    rays = shapely.linestrings(np.stack([start + MM_M * right, start + UNNAMED_WAY_M * right], axis=1))
    parts = shapely.get_parts(walls)
    ray, part = shapely.STRtree(parts).query(rays, predicate="intersects")
    hits, pair = shapely.get_coordinates(shapely.intersection(rays[ray], parts[part]), return_index=True)
    width = np.full(len(rays), np.inf)
    np.minimum.at(width, ray[pair], ((hits - start[ray[pair]]) * right[ray[pair]]).sum(axis=1))
    found = []
    for k in np.flatnonzero((width >= SHOULDERS_M) & np.isfinite(width)):
        middle = start[k] + right[k] * width[k] / 2
        out = right[k] if dot_product(np.array([-right[k, 1], right[k, 0]]), into[k]) < 0 else -right[k]
        strip = Opening(middle, out, float(width[k]), HAND_M, (OUTSIDE, OUTSIDE), closed_by="mouth")
        found.append(replace(strip, polygon=strip.strip(wider_m=CM_M)))
    return found


def _hall_end(strip: Opening, room: Polygon, inner: BaseGeometry) -> _HallEnd | None:
    """Return the end of a corridor if it parts a room and only the part behind it is twice as broad (R4).

    ``inner`` are all other ways between spaces.
    """
    parts = polygons_of(subtract(room, strip.polygon))
    behind, before = (_room_behind_mouth(strip, way, parts) for way in (1, -1))
    if behind is None or before is None or behind[0] == before[0]:
        return None
    far, share = parts[behind[0]], strip.width / behind[1]
    is_end = share <= MOST < strip.width / before[1]  # if both sides are broad, it is a mouth by R2
    is_end = is_end and far.area >= ROOMY_M2 and not shapely.dwithin(far, inner, CRACK_M)
    is_end = is_end and _holds_wider_disc(far, strip, shapely.points(strip.centre))
    return _HallEnd(strip, parts[before[0]], share) if is_end else None


# ---------------------------------------------------------------------------------------------------------------------
# Openings without a door: where a wall between two rooms of the source stops and leaves a straight, passable gap.
#
# R1  An opening lies in the middle between two rooms, at most ``THICK_WALL_M`` apart, where nothing stands. It is
#     straight and wide enough to walk through.
# R2  Walls stand at both of its ends. At one end or both, a wall that parts the same two rooms goes on: somebody drew
#     the wall and left the way open. Two rooms without a wall between them have no opening: they are one space that the
#     source divides.
# ---------------------------------------------------------------------------------------------------------------------

Floats = npt.NDArray[np.float64]


def find_doorless_openings(rooms: Sequence[Polygon], free: BaseGeometry, walls: BaseGeometry) -> list[Opening]:
    """Return the openings between drawn rooms, in the order of the rooms, as deep as these are apart.

    Parameters
    ----------
    free
        The area where openings may lie: all that nothing closes.
    walls
        The area of the walls that stand.
    """
    if len(rooms) < 2 or free.is_empty or walls.is_empty:
        return []
    shapely.prepare(walls)
    pairs = shapely.STRtree(rooms).query(rooms, predicate="dwithin", distance=THICK_WALL_M).T.tolist()
    found = []
    for one, other in sorted((i, j) for i, j in pairs if i < j):
        apart = float(rooms[one].distance(rooms[other]))
        near = [buffer_mitred(rooms[k], apart / 2 + SHEET_M) for k in (one, other)]
        for piece in polygons_of(intersect(intersect(near[0], near[1]), free)):
            opening = _straight_gap(piece, apart)
            if opening is not None and _is_between(opening, (rooms[one], rooms[other]), walls):
                found.append(opening)
    return found


def _straight_gap(piece: Polygon, apart: float) -> Opening | None:
    """Return the gap between two ends of one wall as an opening, or None if it is no straight strip."""
    box = shapely.oriented_envelope(piece)
    if box.geom_type != "Polygon" or piece.area < NEARLY_ALL * box.area:
        return None
    corners = shapely.get_coordinates(box)[:4]
    sides = corners[1] - corners[0], corners[2] - corners[1]
    lengths = [float(np.hypot(*side)) for side in sides]
    k = int(lengths[1] > lengths[0])
    if lengths[k] < SHOULDERS_M or lengths[1 - k] > 2 * SHEET_M + STAND_M:
        return None
    middle = corners.mean(axis=0)
    return Opening(middle, sides[k] / lengths[k], lengths[k], apart, (OUTSIDE, OUTSIDE), closed_by="opening")


def _is_between(opening: Opening, rooms: tuple[Polygon, Polygon], walls: BaseGeometry) -> bool:
    """Return whether an opening runs from wall to wall, at one end a wall with one of the rooms on each side."""
    sides = list(zip(opening.segment, (-opening.along, opening.along), strict=True))
    if not all(shapely.dwithin(walls, shapely.points(end + STAND_M * out), SHEET_M) for end, out in sides):
        return False
    beside = (_rooms_beside(end + THIN_WALL_M * out, opening.across, rooms, walls) for end, out in sides)
    return any(found in ((0, 1), (1, 0)) for found in beside)


def _rooms_beside(
    at: Floats, across: Floats, rooms: tuple[Polygon, Polygon], walls: BaseGeometry
) -> tuple[int | None, ...]:
    """Return which of the rooms lie on the two sides of the wall at a point; nothing where no wall stands there."""
    line = shapely.linestrings([at - THICK_WALL_M * across, at + THICK_WALL_M * across])
    pieces = [piece for piece in shapely.get_parts(shapely.intersection(line, walls)) if piece.length > 0]
    wall = min(pieces, key=shapely.points(at).distance, default=None)
    if wall is None or wall.distance(shapely.points(at)) > SHEET_M:
        return ()
    places = shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(wall)))
    beside = at + (np.array([[places.min() - STAND_M], [places.max() + STAND_M]]) - THICK_WALL_M) * across
    return tuple(next((k for k in (0, 1) if shapely.intersects_xy(rooms[k], *point)), None) for point in beside)
