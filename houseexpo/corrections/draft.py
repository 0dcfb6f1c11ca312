"""Hold a plan as mutable rooms and doors, find the room or door at a place, and make a plan of them again.

Coordinates are those of the original plan, metres.

R1  A room or door that was not changed keeps its ring, to the last digit; only its id may change. Of a ring that
    crosses itself, as rounding may leave it, the largest part counts.
R2  Changed rooms and doors are rounded to the grid together with their neighbours, so that neighbours share edges.
R3  The plan starts at the same margin as before; its frame maps to the same place in the source.
R4  A plan has one outline. If no passage joins some rooms to the others, a slit of the grid's width through the
    thinnest wall joins their outlines. It does not count as a passage, and no robot fits through.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import navigability
from houseexpo.corrections.vocabulary import Correction
from houseexpo.inference.snapping import snap_polygons, tile_on_grid
from houseexpo.inference.windows import place_windows
from houseexpo.plan import Door, Room
from houseexpo.plan.model import PlanData, shift_plan
from houseexpo.plan.parts import Box, DoorKind, PlanObject
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import (
    COMMON_DOOR_M,
    GRID_M,
    MIN_DOOR_M,
    ROUNDED_M2,
    SAME_M2,
    SMALLEST_ROOM_M2,
    SMALLEST_SAID_ROOM_M2,
)

Vector = npt.NDArray[np.float64]


@dataclass(eq=False)
class DraftRoom:
    """A room; ``before`` is the plan's room, None if the room is new or its shape has changed.

    ``said`` is the correction that makes it a room, ``named`` the correction that names it; "" without a correction.
    """

    shape: Polygon
    label: str = UNLABELLED
    words: tuple[str, ...] = ()
    confidence: float | None = None
    before: Room | None = None
    said: str = ""
    named: str = ""

    def change(self, shape: Polygon) -> None:
        """Give the room another shape."""
        self.shape, self.before = shape, None


@dataclass(eq=False)
class DraftDoor:
    """A passage; ``ends`` (2, 2) are its jambs, metres, ``rooms`` the rooms on its sides, the second None for outside.

    ``before`` is the plan's door, None if the passage is new. ``said`` is the correction that states it, or "".
    """

    kind: DoorKind
    shape: Polygon
    ends: Vector
    rooms: tuple[DraftRoom, DraftRoom | None]
    confidence: float | None = None
    before: Door | None = None
    said: str = ""

    @property
    def width(self) -> float:
        """The distance from jamb to jamb, metres."""
        return math.dist(*self.ends)

    @property
    def along(self) -> Vector:
        """The unit vector from jamb to jamb."""
        return np.asarray((self.ends[1] - self.ends[0]) / max(self.width, GRID_M))


@dataclass(frozen=True, eq=False)
class CorrectedArea:
    """An area that a correction concerns; ``said`` is the correction."""

    shape: BaseGeometry
    said: str


@dataclass(frozen=True, eq=False)
class Space:
    """A space between walls that the plan lacks; ``reachable`` is False if only the lack of a way left it out."""

    shape: Polygon
    reachable: bool = True


class Draft:
    """The rooms and doors of a plan while they are corrected."""

    def __init__(
        self,
        plan: PlanData,
        spaces: Iterable[Space] = (),
        standing: Iterable[Polygon] = (),
        walls: Iterable[Polygon] | None = None,
        lines: Iterable[LineString] = (),
    ) -> None:
        self.plan = plan
        own = {
            room.id: DraftRoom(largest_valid_part(room.polygon), room.label, room.source_labels, room.confidence, room)
            for room in plan.rooms
        }
        self.rooms = list(own.values())
        self.doors = [
            DraftDoor(
                door.kind,
                largest_valid_part(door.polygon),
                np.array(door.segment),
                (own[door.rooms[0] or 0], None if door.rooms[1] is None else own[door.rooms[1]]),
                door.confidence,
                door,
            )
            for door in plan.doors
        ]
        self.windows = list(plan.windows)
        self.spaces = list(spaces)
        self.standing = list(standing)
        """The shapes that enclose spaces in the source: its walls, and whatever may close their gaps."""
        self.source_walls = None if walls is None else list(walls)
        """The walls that the source shows, or None if they are not known."""
        self.lines = list(lines)
        """The straight lines of the source, if it is a drawing, without those that a person says are no walls."""
        self.no_walls: set[str] = set()
        """The corrections that say so of a line of the drawing."""
        self.walls: list[CorrectedArea] = []
        """The walls that a person has drawn."""
        self.taken_out: list[CorrectedArea] = []
        """The rooms that a person has removed."""
        self.joined: list[CorrectedArea] = []
        """The areas between rooms that a person has merged."""
        self.beside: list[str] = []
        """Sentences on what the latest word has changed beside what it states."""
        self.denied: list[BaseGeometry] = []
        """The areas of passages that a person has removed."""

    def state(self) -> list[tuple[Any, dict[str, Any]]]:
        """Return a snapshot of the draft, for ``restore``."""
        own = {name: list(value) if isinstance(value, list) else value for name, value in vars(self).items()}
        return [(self, own), *((part, dict(vars(part))) for part in (*self.rooms, *self.doors))]

    @staticmethod
    def restore(state: Iterable[tuple[Any, dict[str, Any]]]) -> None:
        """Set a draft back to a snapshot of ``state``, after a word is refused."""
        for part, values in state:
            vars(part).update(values)

    @property
    def inner_doors(self) -> list[DraftDoor]:
        """The passages between rooms."""
        return [door for door in self.doors if door.rooms[1] is not None]

    def room_at(self, place: Sequence[float] | Vector) -> DraftRoom | None:
        """Return the room that contains a point (x, y), also where furniture stands, or None."""
        point = shapely.Point(*place)
        found = next((room for room in self.rooms if room.shape.covers(point)), None)
        if found is None and any(thing.polygon.covers(point) for thing in self.plan.objects):
            around = [room for room in self.rooms if Polygon(room.shape.exterior).covers(point)]
            found = min(around, key=lambda room: Polygon(room.shape.exterior).area, default=None)
        return found

    def door_at(self, place: Sequence[float] | Vector, within_m: float) -> DraftDoor | None:
        """Return the nearest passage within a distance of a point, or None."""
        point = shapely.Point(*place)
        near = min(self.doors, key=lambda door: door.shape.distance(point), default=None)
        return near if near is not None and near.shape.distance(point) <= within_m else None

    def distance_to_rooms(self, place: Sequence[float] | Vector) -> float:
        """Return how far a point is from the nearest room, metres."""
        return min((float(room.shape.distance(shapely.Point(*place))) for room in self.rooms), default=math.inf)

    def name(self, room: DraftRoom) -> str:
        """Return the name of a room in messages."""
        what = "room" if room.label == UNLABELLED else room.label.lower().replace("_", " ")
        return f"the {what} of {room.shape.area:.1f} m2"

    def names(self, rooms: Sequence[DraftRoom]) -> str:
        """Return the names of up to three rooms in messages."""
        return " and ".join(self.name(room) for room in rooms[:3])

    def remove_room(self, room: DraftRoom, *, open_outside: bool = False) -> None:
        """Remove a room with its passages; doors to rooms that stay become entrances where ``open_outside``."""
        self.rooms.remove(room)
        kept = []
        for door in self.doors:
            if not any(side is room for side in door.rooms):
                kept.append(door)
                continue
            other = next((side for side in door.rooms if side is not None and side is not room), None)
            if open_outside and other is not None and door.kind in {"door", "opening"}:
                kept.append(replace(door, kind="entrance", rooms=(other, None)))
        self.doors = kept

    def replace_room(self, room: DraftRoom, parts: Sequence[Polygon]) -> list[DraftRoom]:
        """Replace a room by parts, sorted by area. The largest keeps the name; a passage goes to the nearest part.

        A passage before several parts becomes one passage for each.
        """
        ordered = sorted(parts, key=lambda part: -part.area)
        made = [DraftRoom(part, confidence=room.confidence) for part in ordered]
        made[0].label, made[0].words = room.label, room.words
        made[0].said, made[0].named = room.said, room.named
        place = self.rooms.index(room)
        self.rooms[place : place + 1] = made
        for door in self.doors:
            if any(side is room for side in door.rooms):
                nearest = min(made, key=lambda part: (part.shape.distance(door.shape), -part.shape.area))
                one, other = (nearest if side is room else side for side in door.rooms)
                assert one is not None  # noqa: S101  # the first side of a door is a room
                door.rooms = (one, other)
        self.divide_passages(made)
        return made

    def divide_passages(self, rooms: Sequence[DraftRoom]) -> None:
        """Make of each passage before several of some rooms one passage for each of these."""
        divided = [(door, _divide_passage(door, rooms)) for door in self.doors]
        self.doors = [each for _, parts in divided for each in parts]
        counts = {2: "two", 3: "three"}
        self.beside += [
            f"the {door.kind} of {door.width:.2f} m is {counts.get(len(parts), len(parts))} now, of "
            + " and ".join(f"{part.width:.2f} m" for part in parts)
            for door, parts in divided
            if len(parts) > 1
        ]

    @property
    def is_surer(self) -> bool:
        """Whether a person's words have changed the confidence of a room or passage that keeps its shape."""
        parts: list[DraftRoom | DraftDoor] = [*self.rooms, *self.doors]
        return any(part.before is not None and part.confidence != part.before.confidence for part in parts)

    def pieces(self) -> list[list[DraftRoom]]:
        """Return the rooms that can be reached from each other, the largest group by area first."""
        number = {id(room): k for k, room in enumerate(self.rooms)}
        group = list(range(len(self.rooms)))

        def root(k: int) -> int:
            while group[k] != k:
                k = group[k]
            return k

        for door in self.inner_doors:
            group[root(number[id(door.rooms[0])])] = root(number[id(door.rooms[1])])
        shapes = np.array([room.shape for room in self.rooms], dtype=object)  # also of a plan without rooms
        for a, b in shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=GRID_M / 2).T.tolist():
            if a < b and root(a) != root(b) and _share_edge(shapes[a], shapes[b]):
                group[root(a)] = root(b)
        found: dict[int, list[DraftRoom]] = {}
        for k, room in enumerate(self.rooms):
            found.setdefault(root(k), []).append(room)
        return sorted(found.values(), key=lambda rooms: -sum(room.shape.area for room in rooms))

    def made(self, *, measure: bool) -> Any:
        """Return the plan of these rooms and doors (R1 to R3), with its navigability if ``measure``."""
        self._tile()
        numbers = {id(room): k for k, room in enumerate(self.rooms)}
        rooms = tuple(_room(k, room) for k, room in enumerate(self.rooms))
        doors = tuple(_door(k, door, numbers) for k, door in enumerate(self.doors))
        floor = [*(room.shape for room in self.rooms), *(door.shape for door in self.inner_doors)]
        outline = _in_one(shapely.union_all(floor, grid_size=GRID_M))
        (verts, holes), *_ = snap_polygons([outline])
        objects = tuple(self._objects(rooms))
        plan = replace(
            self.plan,
            verts=verts,
            holes=holes,
            rooms=rooms,
            doors=doors,
            room_num=max(self.plan.room_num + len(rooms) - len(self.plan.rooms), 1),
            room_category=self._boxes(rooms),
            objects=objects,
            windows=place_windows(self.windows, rooms, objects),
            provenance=self._provenance(doors),
        )
        x, y = np.round(self.plan.verts.min(axis=0) - verts.min(axis=0), 2).tolist()
        plan = _on_grid(shift_plan(plan, x, y)) if x or y else plan
        return replace(plan, navigability=navigability(plan)) if measure and self.plan.navigability else plan

    def _tile(self) -> None:
        """Round changed rooms and doors to the grid together with their neighbours, so that neighbours share edges."""
        changed = [room.shape for room in self.rooms if room.before is None]
        changed += [door.shape for door in self.doors if door.before is None or door.shape is not door.before.polygon]
        gone = [room.polygon for room in self.plan.rooms if all(room is not each.before for each in self.rooms)]
        if not changed:
            return
        area = shapely.buffer(shapely.union_all([*changed, *gone]), GRID_M, quad_segs=1)
        rooms = [room for room in self.rooms if room.shape.intersects(area)]
        doors = [door for door in self.doors if door.shape.intersects(area)]
        inner = [door for door in doors if door.rooms[1] is not None]
        tiled_rooms, tiled_doors = tile_on_grid([room.shape for room in rooms], [door.shape for door in inner])
        outside = [door for door in doors if door.rooms[1] is None]
        for room, shape in zip(rooms, tiled_rooms, strict=True):
            if not shape.is_empty and (room.before is None or not _is_same(room.shape, shape)):
                room.change(shape)
        for door, shape in zip(inner, tiled_doors, strict=True):
            if not shape.is_empty and (door.before is None or not _is_same(door.shape, shape)):
                door.shape = shape
        for door in outside:
            if door.before is None:
                rounded = _largest(shapely.set_precision(door.shape, GRID_M))
                door.shape = rounded if rounded.area > 0 else door.shape
        self.rooms = [room for room in self.rooms if room.shape.area > ROUNDED_M2]
        self.doors = [door for door in self.doors if door.shape.area > 0]

    def _boxes(self, rooms: Sequence[Room]) -> Mapping[str, tuple[Box, ...]]:
        """Return the boxes by label. Boxes of the plan's rooms follow the rooms; boxes of the source stay."""
        before = {(room.label, _box(room)) for room in self.plan.rooms}
        own = {(label, box) for label, boxes in self.plan.room_category.items() for box in boxes} & before
        if not own:
            return self.plan.room_category
        found = {
            label: [box for box in boxes if (label, box) not in own] for label, boxes in self.plan.room_category.items()
        }
        for room in rooms:
            if room.label != UNLABELLED:
                found.setdefault(room.label, []).append(_box(room))
        return {label: tuple(sorted(boxes)) for label, boxes in sorted(found.items()) if boxes}

    def _objects(self, rooms: Sequence[Room]) -> list[PlanObject]:
        """Return the furniture of the remaining rooms, each piece with its room of now; a stairwell is in none."""
        found: list[PlanObject] = []
        filled = [Polygon(room.ring) for room in rooms]
        lost = [room.polygon for room in self.plan.rooms]
        for thing in self.plan.objects:
            middle = thing.polygon.centroid
            home = next((room.id for room, shape in zip(rooms, filled, strict=True) if shape.covers(middle)), None)
            was_inside = thing.room is not None and bool(lost)
            if home is None and was_inside and all(shape.distance(middle) > 1.0 for shape in filled):
                continue
            found.append(replace(thing, id=len(found), room=None if thing.is_stairwell else home))
        return found

    def _provenance(self, doors: Sequence[Door]) -> Mapping[str, Any] | None:
        """Return the provenance with the remaining cuts, under the new ids of their doors."""
        told = dict(self.plan.provenance or {})
        if "cuts" in told:
            now = {id(draft.before): door.id for draft, door in zip(self.doors, doors, strict=True) if draft.before}
            number = {door.id: now.get(id(door)) for door in self.plan.doors}
            kept = [{**cut, "door": number.get(cut["door"])} for cut in told["cuts"]]
            told["cuts"] = [cut for cut in kept if cut["door"] is not None and doors[cut["door"]].kind == "cut"]
            if not told["cuts"]:
                del told["cuts"]
        return told or self.plan.provenance


def _divide_passage(door: DraftDoor, rooms: Sequence[DraftRoom]) -> list[DraftDoor]:
    """Return a passage as one for each of the rooms at one of its sides.

    If there is only one of them, or the passage is as narrow as one door, it stays whole, and leads into the room at
    most of its width.
    """
    sides = [k for k in (0, 1) if any(door.rooms[k] is room for room in rooms)]
    if len(sides) != 1:
        return [door]
    (side,) = sides
    middle, behind = door.ends.mean(axis=0), door.shape.buffer(GRID_M, join_style="mitre")
    found: list[DraftDoor] = []
    for room in rooms:
        at = (shapely.get_coordinates(shapely.intersection(behind, room.shape)) - middle) @ door.along
        at = np.clip(at, -door.width / 2, door.width / 2)
        if len(at) and np.ptp(at) > MIN_DOOR_M - GRID_M:
            ends = middle + np.array([[at.min()], [at.max()]]) * door.along
            beside = shapely.LineString(ends).buffer(door.shape.length, cap_style="flat")
            pieces = split_pieces(shapely.intersection(door.shape, beside))
            one, other = (room if k == side else each for k, each in enumerate(door.rooms))
            assert one is not None  # noqa: S101  # the first side of a door is a room
            found += [replace(door, ends=ends, rooms=(one, other), before=None, shape=piece) for piece in pieces[:1]]
    if len(found) > 1 and door.width < COMMON_DOOR_M:
        return [replace(door, rooms=max(found, key=lambda part: part.width).rooms)]
    return found if len(found) > 1 else [door]


def split_pieces(shape: shapely.Geometry) -> list[Polygon]:
    """Return the polygons of a shape that are larger than rounding leaves, the largest first."""
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon) and part.area > ROUNDED_M2]
    return sorted(parts, key=lambda part: (-part.area, part.bounds))


def is_room_sized(shape: Polygon) -> bool:
    """Return whether a shape is large enough for a room that no person has stated."""
    return bool(shape.area >= SMALLEST_ROOM_M2)


def may_be_room(shape: Polygon) -> bool:
    """Return whether a shape is large enough for a room that a person states."""
    return bool(shape.area >= SMALLEST_SAID_ROOM_M2)


def largest_valid_part(shape: Polygon) -> Polygon:
    """Return a polygon, or its largest part if its ring crosses itself."""
    return shape if shape.is_valid else _largest(shapely.make_valid(shape))


def _largest(shape: shapely.Geometry) -> Polygon:
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)]
    return max(parts, key=lambda part: part.area, default=Polygon())


def _in_one(floor: BaseGeometry) -> Polygon:
    """Return a floor in one piece (R4)."""
    parts = split_pieces(floor)
    joined, *rest = map(_core, parts)
    ways = []
    while rest:
        nearest = rest.pop(int(np.argmin(shapely.distance(joined, rest))))
        ways.append(shapely.shortest_line(joined, nearest))
        joined = shapely.union(joined, nearest)
    whole = parts
    for cells in _SLIT if ways else ():  # all at once: rounding for one slit could close another
        slits = [way.buffer(cells * GRID_M, cap_style="flat") for way in ways]
        whole = split_pieces(shapely.union_all([*parts, *slits], grid_size=GRID_M))
        if len(whole) == 1:
            break
    return whole[0]


def _core(shape: BaseGeometry) -> BaseGeometry:
    """Return a shape without its thin tips, so that a slit that ends there lies inside the shape."""
    core = shape.buffer(-_INTO_M, join_style="mitre")
    return shape if core.is_empty else core


_INTO_M: Final = 0.05
_SLIT: Final = tuple(0.5 * 2**k for k in range(6))
"""Half widths of the slits, in cells of the grid; wider slits are tried only if rounding closes a narrower one."""


def _share_edge(one: Polygon, other: Polygon) -> bool:
    return bool(shapely.intersection(one.buffer(GRID_M / 2), other).length > 0.1)


def _is_same(one: Polygon, other: Polygon) -> bool:
    return bool(shapely.symmetric_difference(one, other).area < SAME_M2)


def _box(room: Room) -> Box:
    x1, y1, x2, y2 = np.round(room.polygon.bounds, 2).tolist()
    return x1, y1, x2, y2


def _room(k: int, draft: DraftRoom) -> Room:
    if draft.before is not None:
        return replace(draft.before, id=k, label=draft.label, source_labels=draft.words, confidence=draft.confidence)
    (ring, holes), *_ = snap_polygons([draft.shape])
    return Room(k, draft.label, ring, holes, draft.words, draft.confidence)


def _door(k: int, draft: DraftDoor, numbers: Mapping[int, int]) -> Door:
    one, other = draft.rooms
    rooms = (numbers[id(one)], None if other is None else numbers[id(other)])
    if draft.before is not None and draft.shape is draft.before.polygon:
        return replace(draft.before, id=k, kind=draft.kind, rooms=rooms, confidence=draft.confidence)
    (ax, ay), (bx, by) = np.round(draft.ends, 2).tolist()
    ring = snap_polygons([draft.shape])[0][0]
    width = round(math.hypot(bx - ax, by - ay), 2)
    return Door(k, draft.kind, ((ax, ay), (bx, by)), width, ring, rooms, draft.confidence)


def _on_grid(plan: PlanData) -> PlanData:
    """Return a shifted plan with its coordinates on the grid again: adding leaves an error of the last digit."""

    def rounded(ring: Vector) -> Vector:
        return np.asarray(np.round(ring, 2))

    def hole(of: Door) -> Door:
        segment: Any = tuple(tuple(np.round(end, 2).tolist()) for end in of.segment)
        return replace(of, ring=rounded(of.ring), segment=segment)

    boxes = {
        label: tuple(tuple(np.round(box, 2).tolist()) for box in found) for label, found in plan.room_category.items()
    }
    return replace(
        plan,
        verts=rounded(plan.verts),
        holes=tuple(map(rounded, plan.holes)),
        rooms=tuple(replace(r, ring=rounded(r.ring), holes=tuple(map(rounded, r.holes))) for r in plan.rooms),
        doors=tuple(map(hole, plan.doors)),
        windows=tuple(map(hole, plan.windows)),
        objects=tuple(replace(thing, ring=rounded(thing.ring)) for thing in plan.objects),
        room_category=boxes,
        frame=None if plan.frame is None else _rounded_frame(plan),
    )


def _rounded_frame(plan: PlanData) -> Any:
    frame = plan.frame
    assert frame is not None  # noqa: S101  # the caller checks it
    (a, b, tx), (c, d, ty) = frame.matrix
    return replace(frame, matrix=((a, b, round(tx, 6)), (c, d, round(ty, 6))))


class NoEffectError(Exception):
    """A word has no effect; the text says why.

    ``against`` is the earlier word that it contradicts, as a text, or "".
    """

    against = ""


class PartsNothingError(NoEffectError):
    """A line parts no room by itself; it may part one together with other lines."""


class AlreadySoError(Exception):
    """The plan agrees with the word already."""


class ContradictionError(NoEffectError):
    """A word contradicts the earlier word ``said``, as a text; ``what`` describes the earlier word."""

    def __init__(self, said: str, what: str = "") -> None:
        super().__init__(f"{said}{f' {what}' if what else ''} is said too; take one of the two out")
        self.against = said


@dataclass(frozen=True, eq=False)
class Placed:
    """A correction, and its points (n, 2) in the plan's coordinates."""

    correction: Correction
    points: Vector


@dataclass
class Said:
    """The change that a word made, and further changes, as sentences."""

    text: str
    also: list[str] = field(default_factory=list)
