"""Ask about lines that may part a room: openings at corners, walls that the source shows, walls that end in it.

R1  A narrow place of a room (``narrow_places``) may be an opening between two rooms, as may a door or a gap that the
    source shows in it, and the lines that extend the edges of a corner that juts into the room to the opposite wall. A
    line is asked about if it parts off a space that could be a room. Lines between two corners come first: these are
    the jambs of a doorway, or the ends of the walls beside a mouth.
R2  If the source shows something in a room that is higher than a person and that would part it, it may be a wall.
    Pieces in a row are one wall.
R3  Walls that end in a room may part it, with openings in the gaps between them (``wall_ends``), or in one of two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.ops import split

from houseexpo.corrections.draft import Vector
from houseexpo.corrections.openings import ALONG, ONWARD_M, dot
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Room
from houseexpo.service.review.narrow_places import is_one_doorway, narrow_places, parts_beside
from houseexpo.service.review.question import (
    CUT,
    PASSAGE_M,
    WIDEST_WALL_M,
    Answer,
    Further,
    Question,
    key_of,
    point_in,
)
from houseexpo.service.review.sources import OF_EDGE_M, SourceView
from houseexpo.service.review.wall_ends import JAGS_M, parts_between_gaps, rings_with_corners
from houseexpo.tolerances import COMMON_OPENING_M, GRID_M, MIN_DOOR_M, SMALLEST_ROOM_M2

_CORNER: Final = 0.4
"""Doubt of an opening at a corner that juts into a room: of 19 groups of them, 7 part a room that is several."""
_LINES: Final = {
    "of several": (CUT, 12),
    "doorway": (_CORNER, 6),
    "mouth": (0.3, 6),
    "wide": (_CORNER / 2, 3),
}
"""Lines from corners, in this order: the doubt of each kind, and the most that are asked about, but for doorways per
``_HOUSE_M2``. Those of a room that a person says is several come first. Doorways and mouths, which are wider, lie
between two corners."""
_HOUSE_M2: Final = 1000.0
"""In a larger plan, m2, halls have rows of rooms with open fronts."""
_COMPACT: Final = 0.6
"""The least share of a square's area (``_Parting``): a rectangle of four times its width has 0.64, a cross 0.56."""
_ONWARD: Final = 3.0
"""A place wider than an opening goes on from a wall that is longer than a third of it: before a pier a room is one."""
_PART_M2: Final = 4.0
"""A smaller part of a room between walls that end in it is not asked about, m2: in maps, most are furniture's."""
_SEEN_WALL: Final = 0.4
"""Doubt of a wall that the source shows and the plan lacks: some are cupboards."""
_SHORTEST_WALL_M: Final = 0.5
"""What is seen of such a wall away from the walls beside it, metres."""
_MOST_WALLS_ASKED: Final = 6


def corner_questions(
    plan: FloorPlan,
    places: Sequence[LineString] = (),
    several: Set[str] = frozenset(),
) -> Iterator[Question]:
    """R1. ``places`` are where the source shows a door or a gap in a room; the others are as in ``questions``."""
    found: dict[str, list[tuple[bool, float, float, LineString]]] = {kind: [] for kind in _LINES}
    for room in plan.rooms:
        is_several = not several.isdisjoint(_keys_of(plan, room))
        doors = [door for door in plan.doors if room.id in door.rooms]
        at_doors = _before([door.polygon for door in doors])
        at_narrow = _before([door.polygon for door in doors if door.width < COMMON_OPENING_M])
        shown = [place for place in places if room.polygon.covers(place.centroid)]
        parts = parts_between_gaps(room.polygon.wkb)[1:]
        gaps = [part.gaps[0] for part in parts if len(part.gaps) == 1]
        is_several &= len(gaps) == len(parts)  # else R3 says where it parts
        parting = [_Parting(ray, True, *_part_off(room.polygon, longer(ray, ONWARD_M))) for ray in shown]
        parting += [_Parting(gap, True, *_part_off(room.polygon, gap)) for gap in gaps if gap.length >= MIN_DOOR_M]
        for line, is_faced, area, compact in (*parting, *_parting_lines(room.polygon.wkb)):
            if area < SMALLEST_ROOM_M2 * 2 or shapely.intersection(line, at_doors).length > line.length / 2:
                continue
            if not is_faced and at_narrow.intersects(line):  # beside a doorway another one may lie
                continue
            is_wide = line.length > PASSAGE_M[1]
            is_likely = is_several or is_faced or (is_wide and compact >= _COMPACT)
            if not is_likely or (is_wide and not is_several and line.length**2 > area * (1 + is_faced)):
                continue
            kind = ("mouth" if is_wide else "doorway") if is_faced else "wide"
            found["of several" if is_several else kind].append(
                (not is_faced, line.length / math.sqrt(area) / compact, area, line)
            )
    chosen: list[LineString] = []
    for kind, (doubt, most) in _LINES.items():
        upto = len(chosen) + most * (1 if kind == "doorway" else math.ceil(plan.area / _HOUSE_M2))
        for _, _, area, line in sorted(found[kind], key=lambda each: each[:2]):
            if len(chosen) < upto and not any(_is_at(line, other) for other in chosen):
                chosen.append(line)
                yield _line_question(plan, line, doubt, area)


def _line_question(plan: FloorPlan, line: LineString, doubt: float, area: float) -> Question:
    """Return the question whether a line that parts off an area, m2, parts two rooms."""
    ends, is_wide = _ends_of(line), line.length > PASSAGE_M[1]
    at = _middle_of(ends)
    says = (
        f"A part of {area:.1f} m² is open to the rest here, for {line.length:.2f} m. Is it a room of its own?"
        if is_wide
        else f"The room is narrower here, {line.length:.2f} m. Is there an opening between two rooms?"
    )
    answers = Answer("An opening", "opening", ends), Answer("One room"), Answer("A wall", "wall", ends)
    return Question(key_of(plan, "corner of a mouth" if is_wide else "corner", at), at, says, answers, doubt, area)


def _is_same(line: LineString, other: LineString) -> bool:
    """Return whether the middles of two lines are near."""
    return bool(shapely.distance(line.centroid, other.centroid) < min(line.length, other.length) / 2)


def _is_at(line: LineString, other: LineString) -> bool:
    """Return whether two lines are guesses at one place: their middles are near, or they meet and are not in line."""
    if _is_same(line, other):
        return True
    ways = [np.diff(shapely.get_coordinates(each), axis=0)[0] / each.length for each in (line, other)]
    return bool(line.distance(other) < PASSAGE_M[0] / 2 and abs(dot(*ways)) < ALONG)


def _before(doors: Sequence[Polygon]) -> shapely.Geometry:
    """Return the area just before and beside some doors."""
    return shapely.buffer(shapely.union_all(doors), PASSAGE_M[0] / 2)


class _Parting(NamedTuple):
    """A line that parts a room: whether walls end at both of its ends, and the area of what it parts off, m2.

    ``compact`` is the share of this area in that of a square with the same perimeter: a corridor has little.
    """

    line: LineString
    is_faced: bool
    area: float
    compact: float


def _part_off(room: Polygon, line: LineString) -> tuple[float, float]:
    """Return the area of the second largest part into which a line parts a room, m2, and ``compact``."""
    parts = parts_beside(room, line)
    return (parts[1].area, 16 * parts[1].area / parts[1].length ** 2) if len(parts) == 2 else (0.0, 0.0)


@lru_cache(maxsize=256)
def _parting_lines(room: bytes) -> list[_Parting]:
    """Return the narrow places of a room (WKB), and the lines from its corners; an answer changes few rooms."""
    shape = shapely.from_wkb(room)
    longest = max(PASSAGE_M[1], math.sqrt(shape.area / 2))
    faced, rays = corner_lines(shape)
    along_edge, doorways = shapely.buffer(shape.boundary, JAGS_M), list[LineString]()
    for line in faced:
        if not any(is_one_doorway(along_edge, line, other) for other in doorways):
            doorways.append(line)
    found = [
        _Parting(line, is_faced, *_part_off(shape, line))
        for is_faced, lines in ((True, doorways), (False, rays))
        for line in lines
        if PASSAGE_M[0] <= line.length <= longest
    ]
    narrow = [_Parting(line, True, *_part_off(shape, longer(line, ONWARD_M))) for line in narrow_places(shape)]
    known = [each.line for each in found if each.is_faced and each.area >= 2 * SMALLEST_ROOM_M2]
    return [*found, *(each for each in narrow if not any(_is_same(each.line, line) for line in known))]


def corner_lines(room: Polygon) -> tuple[list[LineString], list[LineString]]:
    """Return the lines between two corners that jut into a room, and those from such a corner to the next wall.

    All extend an edge of the corner, those between two corners an edge of both, within ``OF_EDGE_M``, also over posts.
    """
    starts, ways, lengths = _extended_edges(room)
    posts = [post for ring in room.interiors if (post := Polygon(ring)).area < WIDEST_WALL_M**2]
    near = shapely.buffer(shapely.union_all([room, *posts]), OF_EDGE_M / 3)
    apart = starts[None] - starts[:, None]
    ahead = (apart * ways[:, None]).sum(axis=2)
    aside = np.abs(apart[..., 0] * ways[:, None, 1] - apart[..., 1] * ways[:, None, 0])
    leads = (ahead >= PASSAGE_M[0]) & (aside <= OF_EDGE_M)
    pairs = np.argwhere(np.triu(leads & leads.T & (ways @ ways.T < -ALONG)))
    lines = shapely.linestrings(starts[pairs[np.argsort((aside + aside.T)[tuple(pairs.T)], kind="stable")]])
    shapely.prepare(near)
    faced: list[LineString] = []
    inside_room = lines[shapely.covers(near, lines)].tolist()
    for line in inside_room:  # of those between the ends of two walls, the one along them
        if all(shapely.distance(line.centroid, other.centroid) > OF_EDGE_M for other in faced):
            faced.append(line)
    x1, y1, x2, y2 = room.bounds
    first = starts + ways * GRID_M
    inside = shapely.intersection(shapely.linestrings(np.stack([first, starts + ways * (x2 - x1 + y2 - y1)], 1)), room)
    rays = []
    for start, from_, line, edge_m in zip(starts, shapely.points(first), inside, lengths, strict=True):
        part = min(shapely.get_parts(line), key=lambda part: part.distance(from_), default=None)
        if (
            part is not None
            and GRID_M < part.length < max(PASSAGE_M[1], _ONWARD * edge_m)
            and part.distance(from_) < GRID_M
        ):
            rays.append(LineString([start, max(part.coords, key=lambda at: math.dist(at, start))]))
    return faced, rays


def _extended_edges(room: Polygon) -> tuple[Vector, Vector, Vector]:
    """Return the corners (n, 2) that jut into a room, the unit vectors that extend their edges, and the edges' lengths.

    Each corner comes twice, with both of its edges.
    """
    starts, ways = [np.empty((0, 2))], [np.empty((0, 2))]
    for points, edges, juts in rings_with_corners(room):
        along = np.stack([np.roll(edges, 1, axis=0)[juts], -edges[juts]], axis=1).reshape(-1, 2)
        starts.append(np.repeat(points[juts], 2, axis=0))
        ways.append(along)
    extended = np.concatenate(ways)
    lengths = np.hypot(*extended.T)
    return np.concatenate(starts), extended / np.maximum(lengths, GRID_M)[:, None], lengths


def seen_wall_questions(
    plan: FloorPlan, source: SourceView, shift: tuple[float, float], closed: Sequence[tuple[float, float]]
) -> Iterator[Question]:
    """R2."""
    shut = shapely.multipoints(closed) if closed else None
    found: list[tuple[float, list[LineString]]] = []
    lines = (
        shapely.linestrings(np.add(source.level.seen, np.subtract(shift, source.origin))) if source.level.seen else []
    )
    tree = shapely.STRtree(lines)
    for room in plan.rooms:
        inside = shapely.buffer(room.polygon, -OF_EDGE_M)
        near = [lines[k] for k in sorted(tree.query(room.polygon, predicate="intersects").tolist())]
        parts = [
            part
            for part in shapely.get_parts(shapely.intersection(near, room.polygon)).tolist()
            if isinstance(part, LineString) and shapely.intersection(part, inside).length >= _SHORTEST_WALL_M
        ]
        for row in in_rows(parts):
            if shut is not None and any(shut.distance(line) < OF_EDGE_M for line in row):
                continue
            whole = LineString([row[0].coords[0], row[-1].coords[-1]])
            if (area := parted_m2(room.polygon, longer(whole, PASSAGE_M[1]))) >= SMALLEST_ROOM_M2 * 2:
                found.append((area, row))
    for area, row in sorted(found, key=lambda each: (-each[0], each[1][0].bounds))[:_MOST_WALLS_ASKED]:
        pieces = [_ends_of(line) for line in row]
        ends = pieces[0][0], pieces[-1][-1]
        at = _middle_of(ends)
        long, what = sum(line.length for line in row), "it one" if len(row) == 1 else f"it a wall of {len(row)} pieces"
        shown = (
            f"map shows an obstacle of {long:.2f} m"
            if source.is_map
            else f"source shows {long:.2f} m of something higher than a person"
        )
        says = f"The {shown}, the plan no wall. Is {what}?"
        wall = Answer("A wall", "wall", pieces[0], more=tuple(pieces[1:]))
        yield Question(
            key_of(plan, "wall", at), at, says, (wall, Answer("No wall"), Answer("An opening", "opening", ends)),
            _SEEN_WALL, area,
        )  # fmt: skip


def in_rows(lines: Sequence[LineString]) -> list[list[LineString]]:
    """Return lines by rows: those of one row go on with each other, from the first to the last, after gaps."""
    rows: list[list[LineString]] = []
    for line in sorted(lines, key=lambda each: (-each.length, each.bounds)):
        for row in rows:
            a, d = np.array(row[0].coords[0]), np.array(row[-1].coords[-1])
            way = (d - a) / math.dist(a, d)
            at = (np.array(line.coords)[[0, -1]] - a) @ way
            aside = np.abs((np.array(line.coords)[[0, -1]] - a) @ np.array([-way[1], way[0]]))
            low, high = at.min(), at.max()
            if aside.max() > OF_EDGE_M or not (-PASSAGE_M[1] <= high and low <= math.dist(a, d) + PASSAGE_M[1]):
                continue
            onward = line if at[1] >= at[0] else shapely.reverse(line)
            if high <= 0:
                row.insert(0, onward)
            elif low >= math.dist(a, d):
                row.append(onward)
            else:
                continue
            break
        else:
            rows.append([line])
    return rows


def part_questions(plan: FloorPlan, several: Set[str] = frozenset()) -> Iterator[Question]:
    """R3: the parts with several gaps. ``several`` is as in ``questions``."""
    for room in plan.rooms:
        is_several = not several.isdisjoint(_keys_of(plan, room))
        least_m2, doubt = (2 * SMALLEST_ROOM_M2, CUT) if is_several else (_PART_M2, _CORNER)
        for part in parts_between_gaps(room.polygon.wkb)[1:]:
            if part.area < least_m2 or len(part.gaps) == 1:
                continue
            ways = [_ends_of(gap) for gap in part.gaps if gap.length >= MIN_DOOR_M]
            slits = [_ends_of(longer(gap, MIN_DOOR_M / 2)) for gap in part.gaps if gap.length < MIN_DOOR_M]
            if not ways:
                continue
            widths = " and ".join(f"{math.dist(*each):.2f}" for each in ways)
            where = "a gap" if len(ways) == 1 else f"{len(ways)} gaps"
            says = f"Walls part off {part.area:.1f} m² here, with {where} of {widths} m. Is it a room of its own?"
            one_way = _open_at_one(ways) if len(ways) == 2 and not slits else ()
            shut = tuple(Further("wall", slit) for slit in slits)
            room_there = Answer("A room", "opening", ways[0], more=tuple(ways[1:]), then=shut)
            answers = room_there, Answer("One room"), *one_way
            at = round(part.point.x, 3), round(part.point.y, 3)
            yield Question(key_of(plan, "corner of a part", at), at, says, answers, doubt, part.area, part.area**0.5)


def _ends_of(line: LineString) -> tuple[tuple[float, float], ...]:
    """Return the ends of a line to a millimetre."""
    (ax, ay), (bx, by) = shapely.get_coordinates(line)[[0, -1]].round(3).tolist()
    return (ax, ay), (bx, by)


def _middle_of(ends: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the middle between two ends, to a millimetre."""
    (ax, ay), (bx, by) = ends
    return round((ax + bx) / 2, 3), round((ay + by) / 2, 3)


def _keys_of(plan: FloorPlan, room: Room) -> list[str]:
    """Return the keys of the questions whose answer may be that a room is several."""
    return [key_of(plan, kind, point_in(room)) for kind in ("room", "seen")]


def _open_at_one(ends: Sequence[tuple[tuple[float, float], ...]]) -> Iterator[Answer]:
    """Yield the answers that one of two gaps is wall."""
    for way, shut in (ends, ends[::-1]):
        title = f"A room, open for {math.dist(*way):.2f} m only"
        yield Answer(title, "wall", shut, then=(Further("opening", way),))


def parted_m2(room: Polygon, line: shapely.Geometry) -> float:
    """Return the area of the second largest part into which a line parts a room, 0 if it does not."""
    return float(sorted([0.0, *(part.area for part in split(room, line).geoms)])[-2])


def longer(ray: LineString, by_m: float) -> LineString:
    """Return a line longer by so much at both ends, so that it parts the room."""
    a, b = np.array(ray.coords)
    way = (b - a) / ray.length * by_m
    return LineString([a - way, b + way])
