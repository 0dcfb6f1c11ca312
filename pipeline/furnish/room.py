"""Place furniture in one room: choose pieces from what is wanted; return where each stands (boxes in whole cm).

1. Pieces stand in the room, 5 cm or more from each other, at a wall or 5 cm or more from it.
2. Before a piece its ``front`` is free of others; a piece that belongs to it (a chair to a desk) may stand there.
3. Nothing stands before a door, as wide as the door and as deep as a person needs.
4. A robot of 0.2 m still gets from everywhere to everywhere in the room, and where ways of 0.6 m led from door to door,
   they do still.
5. Pieces cover no more than a part of the room.
6. No tall piece, such as a wardrobe, stands before a window, unless it ends below the sill; a desk or a sofa may.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from houseexpo.plan import Door, Room
from pipeline.furnish.catalogue import FurnitureKind, FurnitureWish

CM_PER_M: Final = 100.0
GAP_CM: Final = 5
ROBOT_CM: Final = 20
WAY_CM: Final = 30
COVERED: Final = 0.4
"""The largest part of a room that furniture covers."""

_DOOR_CM: Final = 80  # free before a door, from its wall
_SMALL_DOOR_CM: Final = 45
_WINDOW_CM: Final = 30  # what stands nearer to a window than this stands before it
_TALL_CM: Final = 130  # a higher piece takes the light; a plant does not
_SMALL_M2: Final = 5.0
_SPECK_CM2: Final = 1000.0
_PLACES_TRIED: Final = 12


class _FreeFloor(NamedTuple):
    """What is left of a room: its floor, and where a robot's and a person's middle can stand (doors included)."""

    room: Polygon
    robot: Polygon | MultiPolygon
    way: Polygon | MultiPolygon

    def minus(self, box: npt.NDArray[np.int64]) -> _FreeFloor:
        """Return what is left without a box."""
        margins = (0, ROBOT_CM, WAY_CM)
        boxes = (shapely.box(*enlarge_boxes(box, margin).tolist()) for margin in margins)
        return _FreeFloor(*(shapely.difference(shape, taken) for shape, taken in zip(self, boxes, strict=True)))


class RoomFurnisher:
    """A room that is being furnished; all in centimetres."""

    def __init__(
        self,
        room: Room,
        doors: Sequence[Door],
        wants: Sequence[FurnitureWish],
        rng: np.random.Generator,
        windows: Sequence[Door] = (),
    ) -> None:
        shape = shapely.orient_polygons(round_to_cm(room.polygon))
        self._room, self._edge, self._rng = shape, shape.boundary, rng
        self._area_m2, self._wants = room.area, wants
        rings = (shape.exterior, *shape.interiors)
        self._walls = axis_parallel_walls(
            [np.round(shapely.get_coordinates(ring)[:-1]).astype(np.int64) for ring in rings]
        )
        self._bounds: Boxes = np.round(np.array(shape.bounds)).astype(np.int64)
        reach = _SMALL_DOOR_CM if self._area_m2 < _SMALL_M2 else _DOOR_CM
        self._doors = shapely.union_all([_before(door, reach) for door in doors])
        self._windows = [((window.sill or 0) * CM_PER_M, _before(window, _WINDOW_CM)) for window in windows]
        inner = [round_to_cm(door.polygon) for door in doors if door.kind != "entrance"]
        floor = shapely.union_all([shape, *inner])
        self._entries = shapely.points([_entry(door, shape) for door in doors]) if doors else np.array([])
        # corners count for a little more than a disc needs; what a piece takes is its box, grown
        ways = [shapely.buffer(floor, -radius, join_style="mitre") for radius in (ROBOT_CM, WAY_CM)]
        self._left = _FreeFloor(shape, *ways)
        self._places = len(_places(self._left.robot))
        self._joined = self._entries_are_connected(self._left)
        self.standing: list[PlacedPiece] = []
        shapely.prepare(self._room)
        shapely.prepare([self._doors, *(place for _, place in self._windows)])

    def furnish(self) -> list[PlacedPiece]:
        """Place the furniture that is wanted and that fits."""
        if not self._places:
            return []
        for want in self._wants:
            for _ in range(want.most):
                if self._area_m2 >= want.area and self._rng.random() < want.chance:
                    self._place(want.piece)
        return self.standing

    def _place(self, piece: FurnitureKind) -> None:
        """Put a piece up in the best place that it may take, a smaller one where it does not fit."""
        liked = int(self._rng.integers(len(piece.widths)))
        for width in dict.fromkeys((piece.widths[liked], piece.widths[0])):
            places = find_places(piece, width, Surroundings(self._walls, self._bounds, self.standing), self._rng)
            if not len(places.boxes):
                continue
            allowed = np.flatnonzero(self._free_places(piece, places.boxes, places.facings))
            clear = (k for k in allowed.tolist() if self._flush_or_clear(places.boxes[k]))
            for k in islice(clear, _PLACES_TRIED):
                left = self._left.minus(places.boxes[k])
                if self._keeps_ways(left):
                    self._left = left
                    self.standing.append(PlacedPiece(piece, places.boxes[k], int(places.facings[k])))
                    return

    def _free_places(self, piece: FurnitureKind, boxes: Boxes, facings: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Return whether each place is free and has its front free (R1 to R3, R5, R6)."""
        zones = (
            enlarge_boxes(boxes, piece.front)
            if piece.place == "middle"
            else boxes_with_fronts(boxes, facings, piece.front)
        )
        taken = np.array([each.box for each in self.standing], dtype=np.int64).reshape(-1, 4)
        others = [each for each in self.standing if each.piece.label != piece.by]
        kept = np.array([_zone(each) for each in others], dtype=np.int64).reshape(-1, 4)
        good = (
            are_disjoint(enlarge_boxes(boxes, GAP_CM), taken) & are_disjoint(zones, taken) & are_disjoint(boxes, kept)
        )
        covered = float(np.prod(taken[:, 2:] - taken[:, :2], axis=1).sum())
        good &= covered + np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) <= COVERED * self._room.area
        near = np.flatnonzero(good)
        good[near] = shapely.covers(self._room, shapely.box(*zones[near].T))  # a zone holds its box
        near = np.flatnonzero(good)
        inner = shapely.box(*enlarge_boxes(boxes[near], -1).T)
        shut = [self._doors, *(place for sill, place in self._windows if piece.height > max(sill, _TALL_CM))]
        good[near] = ~np.any([shapely.intersects(each, inner) for each in shut], axis=0)
        return np.asarray(good)

    def _flush_or_clear(self, box: npt.NDArray[np.int64]) -> bool:
        """Return whether each side of a box lies at a wall, or 5 cm or more from any (R1)."""
        x1, y1, x2, y2 = box.tolist()
        for side, beyond in (
            (((x1, y1), (x1, y2)), (x1 - GAP_CM, y1, x1, y2)),
            (((x2, y1), (x2, y2)), (x2, y1, x2 + GAP_CM, y2)),
            (((x1, y1), (x2, y1)), (x1, y1 - GAP_CM, x2, y1)),
            (((x1, y2), (x2, y2)), (x1, y2, x2, y2 + GAP_CM)),
        ):
            is_clear = self._room.covers(shapely.box(*beyond))
            if not is_clear and self._edge.intersection(shapely.LineString(side)).length < 1:
                return False
        return True

    def _keeps_ways(self, left: _FreeFloor) -> bool:
        """Return whether the robot still reaches all places and all doors, and the floor left is one plain polygon."""
        if not 0 < len(_places(left.robot)) <= self._places:
            return False
        return (not self._joined or self._entries_are_connected(left)) and has_simple_rings(left.room)

    def _entries_are_connected(self, left: _FreeFloor) -> bool:
        """Return whether one place, 0.6 m wide at its narrowest, holds the entries of all doors."""
        return any(shapely.covers(part, self._entries).all() for part in _places(left.way))


def round_to_cm(shape: Polygon) -> Polygon:
    """Return a shape of metres in whole centimetres."""
    return shapely.transform(shape, lambda points: np.round(points * CM_PER_M))


def has_simple_rings(shape: Polygon) -> bool:
    """Return whether a shape is one polygon whose rings touch neither themselves nor each other."""
    if shape.geom_type != "Polygon" or shape.is_empty or not shape.is_valid:
        return False
    points = [point for ring in (shape.exterior, *shape.interiors) for point in ring.coords[:-1]]
    return len(set(points)) == len(points)


def _before(opening: Door, reach: int) -> Polygon:
    """Return the floor before a door or window on both sides, as deep as ``reach`` from the faces of its wall."""
    (ax, ay), (bx, by) = round_to_cm(shapely.LineString(opening.segment)).coords
    along = np.array([bx - ax, by - ay])
    extra = along / max(float(np.hypot(*along)), 1.0) * GAP_CM
    line = shapely.LineString([np.array([ax, ay]) - extra, np.array([bx, by]) + extra])
    wall = opening.polygon.area / max(opening.width, 0.1) * CM_PER_M
    return shapely.buffer(line, reach + wall / 2, cap_style="flat")


def _zone(standing: PlacedPiece) -> npt.NDArray[np.int64]:
    box = standing.box[None]
    if standing.piece.place == "middle":
        return np.asarray(enlarge_boxes(box, standing.piece.front)[0])
    return np.asarray(boxes_with_fronts(box, np.array([standing.facing]), standing.piece.front)[0])


def _places(shape: Polygon | MultiPolygon) -> list[Polygon]:
    """Return the parts of where a disc's centre can stand, specks left out."""
    return [part for part in shapely.get_parts(shape) if part.area >= _SPECK_CM2]


def _entry(door: Door, room: Polygon) -> npt.NDArray[np.float64]:
    """Return the point before a door's middle, on the room's side, where a person stands."""
    a, b = np.array(door.segment) * CM_PER_M
    across = np.array([a[1] - b[1], b[0] - a[0]]) / max(float(np.hypot(*(b - a))), 1.0)
    wall = door.polygon.area / max(door.width, 0.1) * CM_PER_M / 2
    sides = [(a + b) / 2 + sign * across * (wall + WAY_CM + 2) for sign in (1, -1)]
    return min(sides, key=lambda point: room.distance(shapely.Point(point)))


# Places for a piece: boxes along the axes, (n, 4) as x1, y1, x2, y2 in centimetres, with the way each one faces.
#
# A box faces +x, +y, -x or -y (0 to 3): its back is on the other side, its ``front`` must stay free.


Boxes = npt.NDArray[np.int64]
FACINGS: Final = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
STEP_CM: Final = 10


class PiecePlaces(NamedTuple):
    """Places for one piece, the one liked best first: boxes (n, 4), facings (n,), widths (n,)."""

    boxes: Boxes
    facings: npt.NDArray[np.int64]


class WallEdge(NamedTuple):
    """A wall along an axis: where it lies, its extent along it, and the way that what stands at it faces."""

    at: int
    low: int
    high: int
    facing: int


def axis_parallel_walls(rings: list[npt.NDArray[np.int64]]) -> list[WallEdge]:
    """Return the edges along the axes of rings (n, 2) that have the room on their left, unclosed."""
    found = []
    for ring in rings:
        for (x1, y1), (x2, y2) in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist(), strict=True):
            if y1 == y2 and x1 != x2:  # left of +x is +y
                found.append(WallEdge(y1, min(x1, x2), max(x1, x2), 1 if x2 > x1 else 3))
            elif x1 == x2 and y1 != y2:  # left of +y is -x
                found.append(WallEdge(x1, min(y1, y2), max(y1, y2), 2 if y2 > y1 else 0))
    return found


def box_from_back(facing: int, back: int, start: int, width: int, depth: int) -> tuple[int, int, int, int]:
    """Return the box whose back lies at ``back`` and begins at ``start`` along it."""
    end = start + width
    far = back + depth * (1 if facing < 2 else -1)
    low, high = min(back, far), max(back, far)
    return (low, start, high, end) if facing % 2 == 0 else (start, low, end, high)


def back_and_span(box: npt.NDArray[np.int64], facing: int) -> tuple[int, int, int]:
    """Return where the back of a box lies, and from where to where it reaches along it."""
    x1, y1, x2, y2 = box.tolist()
    low, high, start, end = (x1, x2, y1, y2) if facing % 2 == 0 else (y1, y2, x1, x2)
    return (low if facing < 2 else high), start, end


def boxes_with_fronts(boxes: Boxes, facings: npt.NDArray[np.int64], reach: int) -> Boxes:
    """Return the boxes with what must stay free before them."""
    ahead = FACINGS[facings] * reach
    return np.asarray(boxes + np.column_stack([np.minimum(ahead, 0), np.maximum(ahead, 0)]))


def enlarge_boxes(boxes: Boxes, by: int) -> Boxes:
    """Return the boxes with a margin all round."""
    return np.asarray(boxes + np.array([-by, -by, by, by]))


def are_disjoint(boxes: Boxes, others: Boxes) -> npt.NDArray[np.bool_]:
    """Return whether each box (n, 4) shares no area with any of the others (m, 4)."""
    if not len(others):
        return np.ones(len(boxes), dtype=bool)
    a, b = boxes[:, None], others[None]
    crossing = (a[..., 0] < b[..., 2]) & (b[..., 0] < a[..., 2]) & (a[..., 1] < b[..., 3]) & (b[..., 1] < a[..., 3])
    return np.asarray(~crossing.any(axis=1))


# Where a piece could stand, by the kind of its place; whether it may is judged elsewhere (``room``).


_Found = tuple[tuple[int, int, int, int], int, float]
"""A box, the way it faces, and how little it is liked."""

_AROUND_CM = 55
"""A chair takes this much of a table's side."""


@dataclass(frozen=True, eq=False)
class PlacedPiece:
    """A piece that stands: its box (4,), the way it faces."""

    piece: FurnitureKind
    box: npt.NDArray[np.int64]
    facing: int


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A room as a piece finds it: its walls, its bounds (4,), and what stands there already."""

    walls: Sequence[WallEdge]
    bounds: Boxes
    standing: Sequence[PlacedPiece]


def find_places(piece: FurnitureKind, width: int, around: Surroundings, rng: np.random.Generator) -> PiecePlaces:
    """Return places for a piece of this width, the one liked best first; none where what it belongs to is missing."""
    anchors = [each for each in around.standing if each.piece.label == piece.by]
    if piece.place == "wall":
        found = _at_walls(piece, width, around.walls, rng)
    elif piece.place == "middle":
        found = _in_the_middle(piece, width, around.bounds, rng)
    elif piece.place == "opposite":
        found = _opposite(piece, width, around.walls, anchors, rng)
    elif piece.place == "beside":
        found = _beside(piece, width, anchors)
    elif piece.place == "before":
        found = _in_front(piece, width, anchors)
    else:
        found = _at_sides(piece, width, anchors, rng)
    ordered = sorted(found, key=lambda each: each[2])
    boxes = np.array([box for box, _, _ in ordered], dtype=np.int64).reshape(-1, 4)
    return PiecePlaces(boxes, np.array([facing for _, facing, _ in ordered], dtype=np.int64))


def _at_walls(
    piece: FurnitureKind, width: int, walls: Sequence[WallEdge], rng: np.random.Generator
) -> Iterator[_Found]:
    for wall in walls:
        room = wall.high - wall.low - width
        if room < 0:
            continue
        starts = sorted({*range(0, room + 1, STEP_CM), room})
        for start, chance in zip(starts, rng.random(len(starts)).tolist(), strict=True):
            if piece.likes == "corner":
                dislike = (0.0 if start in (0, room) else 1.0) + chance
            elif piece.likes == "centre":
                dislike = abs(start - room / 2) / 100 + chance
            else:
                dislike = chance
            yield box_from_back(wall.facing, wall.at, wall.low + start, width, piece.depth), wall.facing, dislike


def _in_the_middle(piece: FurnitureKind, width: int, bounds: Boxes, rng: np.random.Generator) -> Iterator[_Found]:
    x1, y1, x2, y2 = bounds.tolist()
    for facing in (0, 1):
        wide, tall = (piece.depth, width) if facing == 0 else (width, piece.depth)
        places = list(product(range(x1, x2 - wide + 1, 2 * STEP_CM), range(y1, y2 - tall + 1, 2 * STEP_CM)))
        for (x, y), chance in zip(places, rng.random(len(places)).tolist(), strict=True):
            off = abs(2 * x + wide - x1 - x2) / (x2 - x1) + abs(2 * y + tall - y1 - y2) / (y2 - y1)
            yield (x, y, x + wide, y + tall), facing, off + 0.5 * chance


def _opposite(
    piece: FurnitureKind,
    width: int,
    walls: Sequence[WallEdge],
    anchors: Sequence[PlacedPiece],
    rng: np.random.Generator,
) -> Iterator[_Found]:
    """At a wall that an anchor looks at, as near to its middle as can be; then at any other."""
    for box, facing, chance in _at_walls(piece, width, walls, rng):
        for anchor in anchors[:1]:
            _, start, end = back_and_span(anchor.box, anchor.facing)
            _, low, high = back_and_span(np.array(box), facing)
            faced = facing == (anchor.facing + 2) % 4
            yield box, facing, abs(start + end - low - high) / 200 + 0.1 * chance + (0.0 if faced else 5.0)


def _beside(piece: FurnitureKind, width: int, anchors: Sequence[PlacedPiece]) -> Iterator[_Found]:
    for anchor in anchors:
        back, start, end = back_and_span(anchor.box, anchor.facing)
        for begin, dislike in ((start - piece.gap - width, 0.0), (end + piece.gap, 0.5)):
            yield box_from_back(anchor.facing, back, begin, width, piece.depth), anchor.facing, dislike


def _in_front(piece: FurnitureKind, width: int, anchors: Sequence[PlacedPiece]) -> Iterator[_Found]:
    """In front of an anchor's middle, facing it."""
    for anchor in anchors:
        back, start, end = back_and_span(anchor.box, anchor.facing)
        ahead = 1 if anchor.facing < 2 else -1
        depth = abs(int(FACINGS[anchor.facing] @ (anchor.box[2:] - anchor.box[:2])))
        begin = (start + end - width) // 2
        near = back + ahead * (depth + piece.gap)
        yield box_from_back(anchor.facing, near, begin, width, piece.depth), (anchor.facing + 2) % 4, 0.0


def _at_sides(
    piece: FurnitureKind, width: int, anchors: Sequence[PlacedPiece], rng: np.random.Generator
) -> Iterator[_Found]:
    """On the sides of a table, looking at it."""
    for anchor in anchors:
        for facing in range(4):
            far, start, end = back_and_span(anchor.box, facing)
            count = max((end - start) // _AROUND_CM, 1)
            outward = -1 if facing < 2 else 1
            for k in range(count):
                middle = start + (2 * k + 1) * (end - start) // (2 * count)
                edge = far + outward * piece.gap
                box = box_from_back((facing + 2) % 4, edge, middle - width // 2, width, piece.depth)
                yield box, facing, float(rng.random())
