"""Cut doorways through walls until a robot's disc can reach every part that is kept (Algorithm 1, lines 10 to 20).

R1  m points are sampled uniformly where the robot's disc can stand, and one more in every piece of that space.
R2  Pairs are taken by increasing distance. A pair in one piece has a path (labelling is exact), so only pairs in two
    pieces are looked at; planning every pair by A* gives the same result, which a test shows.
R3  If there is no path, a wall on the line between the two points is cut: the thinnest that takes a straight cut of
    ``cut_width_m`` at right angles to it, with free floor on both sides. The cut may slide along the wall for that. The
    pair is kept only for the pictures, which plan its path by A*.
R4  A corner of a room that the disc fits in but cannot get to, smaller than a cell, is filled.
R5  If no pair gives a clean cut through a wall, the cut may go through what is as good as wall, up to ``BLOCK_M`` deep:
    filled cells (a chimney, a block of cupboards), and joints of ``PARTITION_M`` between the walls of a row. No cut
    leads through the open, neither around the house nor through a court in it.
R6  A place with some evidence of a door (below) is cut before any bare wall, if that joins two parts. The cut carries
    the evidence for its place.
R7  A part that no cut joins is left out, the smallest first, with a note: a part that a robot cannot reach is no reason
    to reject a house.
R8  If nothing inside a storey shows a door (no lintel, no leaf), the places of its passages are unknown. They are cut,
    and each cut and a note say so. Closed cells (``room_doubt.closed_cells``) are left out there once cuts have joined
    all other parts; if those cannot be joined through one wall, the way may lead through a cell.
R9  In other storeys, a part is left out before any bare wall is cut, if neither a passage nor evidence of a door leads
    into it, from inside or outside, and all of it lies in spaces that are likely no rooms
    (``room_doubt.unlikely_rooms``): a shaft, the back of a box, a slit between walls, the space under the eaves.
    ``closed`` has its rooms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import ConnectivityConfig
from pipeline.geometry.areas import (
    EMPTY,
    clip_to_box,
    dot_product,
    enclosed_pieces,
    intersect,
    polygons_of,
    shares_inside,
    shares_of_places,
    subtract,
    unite,
)
from pipeline.geometry.meshes import box_around_polygon
from pipeline.geometry.openings import strips_before, strips_of
from pipeline.geometry.rooms_and_passages import erode_floor, nearest_piece, sample_points, walkable_floor
from pipeline.geometry.wall_sections import close_cracks
from pipeline.rejection import Reason, Rejection
from pipeline.tolerances import (
    ALMOST_ALL,
    AROUND_M,
    BESIDE_M,
    BLOCK_M,
    CM_M,
    DOORWAY_M,
    HAND_M,
    LARGELY,
    MOST,
    NEARLY_ALL,
    PARTITION_M,
    PASSABLE_M,
    PLACE_M,
    SPECK,
    STONE_WALL_M,
    TINY_M2,
)
from pipeline.values import Evidence, JoinedPoints, Opening, Spaces

MAX_PAIRS = 300
NO_EVIDENCE = "no evidence: the nearest wall"
NO_WALL = "no evidence: the nearest way, through more than wall"
UNKNOWN = "unknown: the source shows no door inside this storey"
_Cut: TypeAlias = tuple[npt.NDArray[np.float64], Opening, str]
"""The pair (2, 2) of points that a cut is made for, the cut, and what speaks for its place."""


def connect_rooms(
    spaces: Spaces,
    config: ConnectivityConfig,
    least_m2: float,
    rng: np.random.Generator,
    evidence: Evidence | None = None,
    *,
    unlikely: BaseGeometry = EMPTY,
    cells: BaseGeometry = EMPTY,
) -> Spaces:
    """Join all pieces of the space in which the disc can stand; raise Rejection if it can stand nowhere.

    ``least_m2`` is the least area of a cell: a smaller pocket is filled (R4). ``evidence`` shows where doors may be,
    ``unlikely`` is the area of the spaces that are likely no rooms (R9), ``cells`` the area of closed cells (R8).
    """
    pieces = _standing(walkable_floor(spaces), spaces, config.robot_radius_m)
    if len(pieces) == 1:
        return spaces
    spaces = _without_pockets(spaces, pieces, config.robot_radius_m, least_m2)
    points: npt.NDArray[np.float64] | None = None
    notes = {"cuts": 0, "left_out": 0, "doors_unknown": 0}
    unknown = evidence is not None and _shows_no_door(evidence, spaces)
    massive = _massive(spaces, least_m2)
    for _ in range(2 * len(pieces) + 8):
        floor = walkable_floor(spaces)
        pieces = _standing(floor, spaces, config.robot_radius_m)
        if len(pieces) == 1:
            break
        if points is None:
            points = sample_points(pieces, config.samples, rng)  # R1
        found = _at_evidence(evidence, spaces, pieces, floor, config) if evidence else None
        if found is None:
            closed = _closed_parts(spaces, pieces, cells if unknown else unlikely)  # R8, R9
            others = [k for k in range(len(pieces)) if k not in closed]
            if closed and (len(others) == 1 or not unknown):
                spaces = _leave_closed_space_out(spaces, pieces, config.robot_radius_m, closed)
                points = None
                continue
            found = _next_cut(points, pieces, floor, (spaces.walls, massive), config, first=others)
        if found is None:  # R7
            spaces = _without_part(spaces, pieces, config.robot_radius_m)
            points = None
            notes["left_out"] += 1
            continue
        pair, cut, why = found
        joined = JoinedPoints(pair, config.robot_radius_m)
        why, notes["doors_unknown"] = (UNKNOWN, 1) if unknown else (why, 0)
        spaces = replace(_with_cut(spaces, cut, why), joined=(*spaces.joined, joined))
        notes["cuts"] += 1
    return replace(spaces, notes={**spaces.notes, **{name: count for name, count in notes.items() if count}})


def _shows_no_door(evidence: Evidence, spaces: Spaces) -> bool:
    """Return whether the evidence shows no door except at the entrances (R8)."""
    if any(passage.kind == "door" for passage in spaces.passages):
        return False
    seen = [*(doorway.polygon for doorway in evidence.doorways), *evidence.leaves, *polygons_of(evidence.lintels)]
    outer = unite([p.strip(deeper_m=PLACE_M, wider_m=PLACE_M) for p in spaces.passages if p.leads_outside])
    return all(shape.within(outer) for shape in seen)


def _standing(floor: BaseGeometry, spaces: Spaces, radius_m: float) -> list[Polygon]:
    """Return where the disc can stand; raise Rejection if it can stand nowhere, as may be after filling a pocket."""
    pieces = erode_floor(floor, radius_m)
    if not pieces:
        raise Rejection(
            "connectivity",
            Reason.NO_ROOM_FITS,
            f"a robot of radius {radius_m} m can stand nowhere in {len(spaces.rooms)} rooms",
            "give a smaller robot_radius_m, or check the units",
        )
    return pieces


def _closed_parts(spaces: Spaces, pieces: list[Polygon], doubted: BaseGeometry) -> dict[int, set[int]]:
    """Return the pieces whose rooms all lie in a doubted area and have no entrance, with these rooms (R8, R9).

    The smallest is the first; the largest piece of all is never among them.
    """
    if doubted.is_empty:
        return {}
    inside = set(np.flatnonzero(shares_inside(list(spaces.rooms), doubted) > MOST).tolist())
    entered = {side for passage in spaces.passages if passage.leads_outside for side in passage.sides}
    reached = [set(shapely.STRtree(spaces.rooms).query(piece, predicate="intersects").tolist()) for piece in pieces]
    found = {}
    for number in range(len(pieces) - 1, 0, -1):
        elsewhere = set().union(*reached[:number], *reached[number + 1 :])
        if reached[number] <= inside - entered - elsewhere:
            found[number] = reached[number]
    return found


def _leave_closed_space_out(
    spaces: Spaces, pieces: list[Polygon], radius_m: float, closed: dict[int, set[int]]
) -> Spaces:
    """Leave out the first of the closed parts (R8, R9)."""
    number, rooms = next(iter(closed.items()))
    left = _without_part(spaces, [*pieces[:number], *pieces[number + 1 :], pieces[number]], radius_m)
    gone = [room for k, room in enumerate(spaces.rooms) if k in rooms]
    notes = {**left.notes, "closed_spaces": int(left.notes.get("closed_spaces", 0)) + len(gone)}
    return replace(left, closed=(*left.closed, *gone), notes=notes)


def _without_part(spaces: Spaces, pieces: list[Polygon], radius_m: float) -> Spaces:
    """Leave out the last piece, and the rooms that only this piece reaches (R7)."""
    part = shapely.buffer(pieces[-1], radius_m + 0.01)
    others = shapely.buffer(unite(pieces[:-1]), radius_m + 0.01)
    kept, rooms = [], list(spaces.rooms)
    for k, room in enumerate(spaces.rooms):
        if not intersect(room, part).area:
            kept.append(k)
        elif intersect(room, others).area > intersect(room, part).area:
            rest = polygons_of(subtract(room, subtract(part, others)))
            rooms[k] = max(rest, key=lambda piece: intersect(piece, others).area)
            kept.append(k)
    return replace(spaces, rooms=tuple(rooms)).keeping(kept)


def _without_pockets(spaces: Spaces, pieces: list[Polygon], radius_m: float, least_m2: float) -> Spaces:
    """Fill the pockets of rooms that have a larger piece elsewhere (R4)."""
    rooms = list(spaces.rooms)
    where = shapely.STRtree(rooms)
    home = [int(where.nearest(p.representative_point())) for p in pieces]
    # a piece that spans many rooms has one home room, but may be the largest piece in each of them
    largest = {room: max(pieces, key=lambda piece: intersect(piece, rooms[room]).area) for room in set(home)}
    filled = 0
    for piece, room in zip(pieces, home, strict=True):
        pocket = shapely.convex_hull(shapely.buffer(piece, radius_m + 0.01))
        if piece is not largest[room] and intersect(pocket, rooms[room]).area < least_m2:
            reached = shapely.buffer(largest[room], radius_m)
            rest = polygons_of(subtract(rooms[room], subtract(pocket, reached)))
            rooms[room] = max(rest, key=lambda part: intersect(part, largest[room]).area)
            filled += 1
    return replace(spaces, rooms=tuple(rooms), notes={**spaces.notes, "filled_pockets": filled}) if filled else spaces


def _at_evidence(
    evidence: Evidence, spaces: Spaces, pieces: list[Polygon], floor: BaseGeometry, config: ConnectivityConfig
) -> _Cut | None:
    """Return a cut at a place that shows evidence of a door, or None if there is no such place (R6)."""
    rules = CutRules(config.cut_width_m, STONE_WALL_M, slide_m=PLACE_M)
    doorways = (each.polygon for each in evidence.doorways)
    for place, why in find_door_hints(doorways, evidence.leaves, evidence.lintels, spaces.passages):
        for line, cut in cut_walls_along_lines(place[None], pieces, floor, spaces.walls, rules):
            if _joins_pieces(cut, pieces, floor, config.robot_radius_m):
                return line, cut, why
    return None


def _next_cut(
    points: npt.NDArray[np.float64],
    pieces: list[Polygon],
    floor: BaseGeometry,
    through: tuple[BaseGeometry, BaseGeometry],
    config: ConnectivityConfig,
    *,
    first: list[int],
) -> _Cut | None:
    """Return the next cut to make, or None if no clean cut is possible (R3, R5).

    It goes ``through`` walls, else through what is as good as wall. A cut through a wall between two of the pieces
    ``first`` comes before all others.
    """
    owner = nearest_piece(points, pieces)
    lines = _pairs_apart(points, owner)
    walls, massive = through
    wall, block = (CutRules(config.cut_width_m, deepest_m) for deepest_m in (STONE_WALL_M, BLOCK_M))
    attempts = [(lines, pieces, walls, wall, NO_EVIDENCE), (lines, pieces, massive, block, NO_WALL)]  # R3, R5
    if len(first) < len(pieces):  # R8
        among = _pairs_apart(points[np.isin(owner, first)], owner[np.isin(owner, first)])
        attempts.insert(0, (among, [pieces[k] for k in first], walls, wall, NO_EVIDENCE))
    for between, joined, what, rules, why in attempts:
        for pair, cut in cut_walls_along_lines(between, joined, floor, what, rules):
            if _joins_pieces(cut, joined, floor, config.robot_radius_m):
                return pair, cut, why
    return None


def _massive(spaces: Spaces, least_m2: float) -> BaseGeometry:
    """Return the walls with what is as good as wall: closed cells below ``least_m2``, and joints (R5)."""
    walls = close_cracks(spaces.walls, PARTITION_M)
    return unite([walls, *(cell for cell in enclosed_pieces(walls)[1] if cell.area < least_m2)])


def _pairs_apart(points: npt.NDArray[np.float64], piece: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return the lines (n, 2, 2) between points in different pieces, the shortest first (R2)."""
    i, j = np.triu_indices(len(points), 1)
    apart = piece[i] != piece[j]
    i, j = i[apart], j[apart]
    order = np.argsort(np.hypot(*(points[i] - points[j]).T), kind="stable")[:MAX_PAIRS]
    return np.stack([points[i[order]], points[j[order]]], axis=1)


def _joins_pieces(cut: Opening, pieces: list[Polygon], floor: BaseGeometry, radius_m: float) -> bool:
    """Return whether the disc can pass from one piece to another through the cut. Only floor near the cut counts."""
    strip = cut.strip(deeper_m=0.01)
    x1, y1, x2, y2 = strip.bounds
    reach = AROUND_M + radius_m
    near = clip_to_box(floor, x1 - reach, y1 - reach, x2 + reach, y2 + reach)
    parts = erode_floor(unite([near, strip]), radius_m)
    return any((shapely.area(shapely.intersection(part, pieces)) > TINY_M2).sum() > 1 for part in parts)


def _with_cut(spaces: Spaces, cut: Opening, why: str = "") -> Spaces:
    ends = [cut.centre + side * cut.across * (cut.depth / 2 + 0.02) for side in (-1.0, 1.0)]
    rooms = shapely.STRtree(spaces.rooms).nearest(shapely.points(ends))
    sides = (int(rooms[0]), int(rooms[1]))
    if sides[0] == sides[1]:  # a pinch inside one room is widened: no door
        wider = polygons_of(unite([spaces.rooms[sides[0]], cut.strip(deeper_m=0.01)]))[0]
        return replace(spaces, rooms=(*spaces.rooms[: sides[0]], wider, *spaces.rooms[sides[0] + 1 :]))
    return replace(spaces, passages=(*spaces.passages, replace(cut, sides=sides, kind="cut", why=why)))


# ---------------------------------------------------------------------------------------------------------------------
# A doorway cut through a wall: straight, at right angles to it, where the line between two points meets it.
# ---------------------------------------------------------------------------------------------------------------------

Vector = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CutRules:
    """The width of a cut, its greatest depth, and how far it may slide along the wall, metres.

    It slides to where the wall is thinnest if that is less than ``LARGELY`` of the wall's usual depth: a leaf or a
    niche is a better place than bare wall.
    """

    width_m: float
    deepest_m: float
    slide_m: float = BLOCK_M


def cut_walls_along_lines(
    lines: Floats, pieces: list[Polygon], floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Iterator[tuple[Floats, Opening]]:
    """Cuts near the lines (n, 2, 2) from point to point, each with its line (2, 2), in the order of the lines.

    A line may cross many rooms; only walls between two of the ``pieces`` in which a robot can stand are cut, the
    thinnest of each line first. Of lines that meet a wall at about the same place (``PLACE_M``), only the first counts.
    """
    tried: set[tuple[int, ...]] = set()
    tree = shapely.STRtree(pieces)
    for line, crossed in zip(lines, shapely.difference(shapely.linestrings(lines), floor), strict=True):
        walls_met = [p for p in shapely.get_parts(crossed) if p.length > 1e-6]
        for wall in sorted(walls_met, key=lambda p: (p.length, p.bounds)):
            start, end = shapely.get_coordinates(wall)[[0, -1]]
            place = tuple(np.round(np.concatenate([start, end]) / PLACE_M).astype(int).tolist())
            if place in tried:
                continue
            tried.add(place)
            if tree.nearest(shapely.points(start)) == tree.nearest(shapely.points(end)):
                continue
            cut = _straight_cut(start, end, floor, walls, rules)
            if cut is not None:
                yield line, cut


def _straight_cut(
    start: Vector, end: Vector, floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Opening | None:
    along = _face_direction(start, _clip_around(start, floor, AROUND_M))
    if along is None:
        return None
    across = np.array([-along[1], along[0]])
    if dot_product(across, end - start) < 0:
        along, across = -along, -across
    reach = rules.deepest_m + BLOCK_M + 1.0
    near = _clip_around(start, floor, reach)
    steps = np.arange(0.0, rules.slide_m, HAND_M)
    slides = np.array(sorted({*steps, *-steps}, key=lambda s: (abs(s), s)))
    feet = start + slides[:, None] * along
    depth = _depths(feet, across, near, rules.deepest_m)
    through = np.flatnonzero(depth > CM_M)
    cuts = [Opening(feet[k] + across * depth[k] / 2, along, rules.width_m, float(depth[k]), (0, 0)) for k in through]
    clean = _are_clean(cuts, near, _clip_around(start, walls, reach))
    if not clean.any():
        return None
    slim = clean & (depth[through] < LARGELY * np.median(depth[through]))
    return cuts[int(np.argmax(slim if slim.any() else clean))]


def _clip_around(point: Vector, shape: BaseGeometry, reach_m: float) -> BaseGeometry:
    """Return the part of a shape within the square of ``reach_m`` to each side of a point (storeys have many walls)."""
    x, y = point
    return clip_to_box(shape, x - reach_m, y - reach_m, x + reach_m, y + reach_m)


def _face_direction(point: Vector, floor: BaseGeometry) -> Vector | None:
    """Unit direction of the edge of the floor that a point lies on."""
    best, direction = 0.01, None
    for ring in shapely.get_parts(shapely.get_parts(floor.boundary)):
        points = shapely.get_coordinates(ring)
        a, d = points[:-1], np.diff(points, axis=0)
        length2 = np.maximum((d**2).sum(axis=1), 1e-12)
        t = np.clip(((point - a) * d).sum(axis=1) / length2, 0.0, 1.0)
        distance = np.hypot(*(a + t[:, None] * d - point).T)
        k = int(np.argmin(distance))
        if distance[k] < best:
            best, direction = float(distance[k]), d[k] / np.sqrt(length2[k])
    return direction


def _depths(feet: Floats, across: Vector, floor: BaseGeometry, deepest_m: float) -> Floats:
    """Return the wall's depth, metres, from points (n, 2) on its face, or 0 if no other side is in reach."""
    rays = shapely.linestrings(np.stack([feet + 1e-3 * across, feet + deepest_m * across], axis=1))
    points, ray = shapely.get_coordinates(shapely.intersection(rays, floor), return_index=True)
    depth = np.full(len(feet), np.inf)
    np.minimum.at(depth, ray, dot_product(points - feet[ray], across))
    return np.where(np.isfinite(depth), depth, 0.0)


def _are_clean(cuts: list[Opening], floor: BaseGeometry, walls: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Return which cuts have a strip that is wall throughout, with free floor before and behind it."""
    clean = np.ones(len(cuts), np.bool_)
    for side in (-1, 1):
        clean &= shares_of_places(strips_before(cuts, [side] * len(cuts), PASSABLE_M), floor) >= ALMOST_ALL
    strips = strips_of([c for c, free in zip(cuts, clean, strict=True) if free])
    clean[clean] = (shares_of_places(strips, floor) <= SPECK) & (shares_of_places(strips, walls) >= NEARLY_ALL)
    return clean


# ---------------------------------------------------------------------------------------------------------------------
# Where a wall is better cut than elsewhere: places with some evidence of a door, though not enough to be one.
#
# R1  The order is: known doorways that no passage uses, then leaves beside no passage, then lintels that close nothing.
#     Of each kind, the larger ones come first.
# R2  The way is square to the doorway, leaf or lintel. For a leaf, which may stand open, a way along it is tried too.
# ---------------------------------------------------------------------------------------------------------------------


def find_door_hints(
    doorways: Iterable[Polygon], leaves: Iterable[Polygon], lintels: BaseGeometry, passages: Sequence[Opening]
) -> Iterator[tuple[Floats, str]]:
    """Yield lines (2, 2) across possible doors, the likeliest first, and the evidence for each (R1, R2)."""
    ways = shapely.STRtree([p.strip() for p in passages])
    kinds: list[tuple[str, Iterable[Polygon], bool]] = [
        ("a doorway that nothing else leads through", doorways, False),
        ("the leaf of a door", leaves, True),
        ("a lintel", polygons_of(lintels), False),
    ]
    return chain.from_iterable(_of_kind(why, shapes, ways, leaf) for why, shapes, leaf in kinds)


def _of_kind(why: str, shapes: Iterable[Polygon], ways: shapely.STRtree, leaf: bool) -> Iterator[tuple[Floats, str]]:
    """Yield the evidence of one kind for doors: its jambs and what it is."""
    for shape in sorted(shapes, key=lambda p: (-p.area, p.bounds)):
        box = box_around_polygon(shape)
        if not DOORWAY_M[0] <= box.width <= DOORWAY_M[1] or len(ways.query(shape, "dwithin", BESIDE_M)):
            continue
        yield _line(box.centre, box.across, AROUND_M), why
        if leaf:
            yield _line(box.centre, box.along, box.width / 2 + AROUND_M), why


def _line(centre: Vector, way: Vector, reach_m: float) -> Floats:
    return np.stack([centre - reach_m * way, centre + reach_m * way])
