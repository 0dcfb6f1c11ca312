"""Ask about lines that may part a room: openings at corners, walls that the source shows, walls that stand free.

R1  If a corner juts into a room, the lines that extend its two edges to the opposite wall may be openings between two
    rooms, as may a door or a gap that the source shows in a room. A line is asked about if it parts off a space that
    could be a room, and is as narrow as an opening, or narrower than this space is wide. Lines between two corners
    come first: these are the jambs of a doorway.
R2  If the source shows something in a room that is higher than a person and that would part it, it may be a wall.
    Pieces in a row are one wall.
R3  In a robot's map, a wall that stands free in a room may part it, with an opening at each of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.ops import split

from houseexpo.corrections.openings import ONWARD_M
from houseexpo.floorplan import FloorPlan
from houseexpo.service.review.question import CUT, FREE, PASSAGE_M, Answer, Question, key_of, point_in
from houseexpo.service.review.sources import OF_EDGE_M, SourceView
from houseexpo.tolerances import GRID_M, SMALLEST_ROOM_M2

_CORNER: Final = 0.4
"""Doubt of an opening at a corner that juts into a room: of 19 groups of them, 7 part a room that is several."""
_MOST_CORNERS: Final = 6
_MOST_OF_SEVERAL: Final = 12
"""Places asked about besides in rooms of which a person said that they are several."""
_MOST_WIDE: Final = 3
"""Places wider than an opening that are asked about too."""
_SEEN_WALL: Final = 0.4
"""Doubt of a wall that the source shows and the plan lacks: some are cupboards."""
_SHORTEST_WALL_M: Final = 0.5
"""What is seen of such a wall away from the walls beside it, metres."""
_MOST_WALLS_ASKED: Final = 6


def corner_questions(
    plan: FloorPlan, places: Sequence[LineString] = (), several: Set[str] = frozenset()
) -> Iterator[Question]:
    """R1. ``places`` are places in a room where the source shows a door or a gap; ``several``: as in ``questions``."""
    narrow: list[tuple[bool, float, float, LineString]] = []
    wide: list[tuple[bool, float, float, LineString]] = []
    known: list[tuple[bool, float, float, LineString]] = []
    for room in plan.rooms:
        is_several = not several.isdisjoint(key_of(plan, kind, point_in(room)) for kind in ("room", "seen"))
        doors = shapely.union_all([door.polygon for door in plan.doors if room.id in door.rooms])
        at_doors = shapely.buffer(doors, PASSAGE_M[0] / 2)
        shown = [place for place in places if room.polygon.covers(place.centroid)]
        parting = [(ray, parted_m2(room.polygon, longer(ray, ONWARD_M))) for ray in shown]
        rays = _parting_rays(room.polygon.wkb)
        jambs = {_ends(ray) for ray, _ in rays} & {_ends(shapely.reverse(ray)) for ray, _ in rays}
        for ray, area in (*parting, *rays):
            if ray.length < PASSAGE_M[0] or area < SMALLEST_ROOM_M2 * 2:
                continue
            at_door = shapely.intersection(ray, at_doors).length
            if at_door > (ray.length / 2 if _ends(ray) in jambs else 0):  # beside a doorway another door may lie
                continue
            is_bare = ray not in shown and _ends(ray) not in jambs
            if is_several:
                known.append((is_bare, ray.length, area, ray))
            elif ray.length <= PASSAGE_M[1]:
                narrow.append((is_bare, ray.length, area, ray))
            elif ray.length**2 <= area:
                wide.append((is_bare, ray.length / math.sqrt(area), area, ray))
    chosen: list[tuple[float, float, LineString]] = []
    most = _MOST_CORNERS
    for found, doubt, more in ((known, CUT, _MOST_OF_SEVERAL), (narrow, _CORNER, 0), (wide, _CORNER / 2, _MOST_WIDE)):
        most += min(more, len(found))
        for _, _, area, ray in sorted(found, key=lambda each: each[:2]):
            if all(ray.distance(other) > PASSAGE_M[0] / 2 for *_, other in chosen) and len(chosen) < most:
                chosen.append((doubt, area, ray))
    for doubt, area, ray in chosen:
        (ax, ay), (bx, by) = (tuple(round(v, 3) for v in end) for end in ray.coords)
        at = round((ax + bx) / 2, 3), round((ay + by) / 2, 3)
        says = f"The room is narrower here, {ray.length:.2f} m. Is there an opening between two rooms?"
        ends = (ax, ay), (bx, by)
        answers = Answer("An opening", "opening", ends), Answer("One room"), Answer("A wall", "wall", ends)
        yield Question(key_of(plan, "corner", at), at, says, answers, doubt, area)


@lru_cache(maxsize=256)
def _parting_rays(room: bytes) -> list[tuple[LineString, float]]:
    """Return the ``corner_rays`` of a room (WKB), and the area that each parts off, m2; an answer changes few rooms."""
    shape = shapely.from_wkb(room)
    longest = max(PASSAGE_M[1], math.sqrt(shape.area / 2))
    rays = [ray for ray in corner_rays(shape) if PASSAGE_M[0] <= ray.length <= longest]
    return [(ray, parted_m2(shape, longer(ray, GRID_M))) for ray in rays]


def _ends(ray: LineString) -> tuple[float, ...]:
    """Return the ends of a line to a centimetre."""
    return tuple((shapely.get_coordinates(ray).round(2) + 0.0).ravel().tolist())


def corner_rays(room: Polygon) -> list[LineString]:
    """Return the extensions of both edges of each corner that juts into a room, from the corner to the next wall."""
    found = []
    x1, y1, x2, y2 = room.bounds
    far = x2 - x1 + y2 - y1
    for ring in (shapely.orient_polygons(room).exterior, *shapely.orient_polygons(room).interiors):
        points = np.array(ring.coords[:-1])
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        for k in np.flatnonzero(turn < -GRID_M * GRID_M):  # orientation: the room lies to the left of its edges
            for along in (before[k], -after[k]):
                way = along / max(float(np.hypot(*along)), GRID_M)
                start = points[k] + way * GRID_M
                line = LineString([start, points[k] + way * far])
                inside = shapely.intersection(line, room)
                first = min(shapely.get_parts(inside), key=lambda part: part.distance(Point(start)), default=None)
                if first is not None and first.length > GRID_M and first.distance(Point(start)) < GRID_M:
                    end = max(first.coords, key=lambda at: float(np.hypot(*(np.array(at) - points[k]))))
                    found.append(LineString([points[k], end]))
    return found


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
        pieces = [tuple(map(tuple, shapely.get_coordinates(line)[[0, -1]].round(3).tolist())) for line in row]
        ends = pieces[0][0], pieces[-1][-1]
        at = round((ends[0][0] + ends[1][0]) / 2, 3), round((ends[0][1] + ends[1][1]) / 2, 3)
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


def free_wall_questions(plan: FloorPlan, source: SourceView, shift: tuple[float, float]) -> Iterator[Question]:
    """R3."""
    if not source.is_map:
        return
    moved = np.subtract(shift, source.origin)
    found: list[tuple[float, LineString, list[LineString], float]] = []
    for line in shapely.linestrings(np.add(source.level.seen, moved)) if source.level.seen else []:
        for room in plan.rooms:
            whole = Polygon(room.polygon.exterior)
            stands = [hole for ring in room.polygon.interiors if (hole := Polygon(ring)).intersects(line)]
            if not stands or shapely.intersection(line, whole).length < FREE * line.length:
                continue
            (reach,) = shapely.get_parts(shapely.union_all(stands).convex_hull)
            through = shapely.intersection(longer(line, whole.length), whole)
            across = [part for part in shapely.get_parts(through) if part.intersects(reach)]
            gaps = [part for each in across for part in shapely.get_parts(shapely.difference(each, reach))]
            gaps = [part for part in gaps if isinstance(part, LineString) and part.length > GRID_M]
            area = parted_m2(whole, longer(line, whole.length))
            if len(gaps) != 2 or min(gap.length for gap in gaps) < PASSAGE_M[0] or area < SMALLEST_ROOM_M2 * 2:
                continue
            if max(gap.length for gap in gaps) <= max(math.sqrt(area), PASSAGE_M[1]):
                found.append((line.length, line, gaps, area))
    for length, line, gaps, area in sorted(found, key=lambda each: (-each[0], each[1].bounds))[:_MOST_WALLS_ASKED]:
        ends = [tuple(map(tuple, shapely.get_coordinates(gap).round(3).tolist())) for gap in gaps]
        at = tuple(np.mean(line.coords, axis=0).round(3).tolist())
        says = f"A wall of {length:.2f} m stands free here. Does it part two rooms, with an opening at each end?"
        answers = Answer("Two rooms", "opening", ends[0], more=(ends[1],)), Answer("One room")
        yield Question(key_of(plan, "free", at), at, says, answers, _CORNER, area, area**0.5)


def parted_m2(room: Polygon, line: LineString) -> float:
    """Return the area of the second largest part into which a line parts a room, 0 if it does not."""
    return float(sorted([0.0, *(part.area for part in split(room, line).geoms)])[-2])


def longer(ray: LineString, by_m: float) -> LineString:
    """Return a line longer by so much at both ends, so that it parts the room."""
    a, b = np.array(ray.coords)
    way = (b - a) / ray.length * by_m
    return LineString([a - way, b + way])
