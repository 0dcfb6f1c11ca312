"""Change the rooms of a draft: draw and remove walls and rooms, name rooms (rules in ``apply``)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final, NoReturn

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections.draft import (
    AlreadySoError,
    ContradictionError,
    CorrectedArea,
    Draft,
    DraftDoor,
    DraftRoom,
    NoEffectError,
    PartsNothingError,
    Placed,
    Said,
    Space,
    Vector,
    is_room_sized,
    may_be_room,
    split_pieces,
)
from houseexpo.corrections.merging import merge_rooms
from houseexpo.corrections.openings import (
    ALONG,
    MEETS_M,
    SAID_WALL_M,
    SNAP_M,
    STEP_M,
    WALL_REACH_M,
    Strip,
    bare_part,
    depth_of_entrances,
    dot,
    drawn_walls,
    faces_beside,
    strip_of,
    turn_square,
)
from houseexpo.corrections.passages import (
    WIDEST_DOOR_M,
    clear_part,
    describe_narrowing,
    far_from_rooms,
    fit_to_wall,
    free_part,
    in_its_wall,
    make_entrance,
    opened_wall,
    refit_passage,
    space_behind,
    with_article,
)
from houseexpo.plan.parts import DoorKind
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import GRID_M, MIN_DOOR_M, ROUNDED_M2, SAME_M2, TILE_M2

FARTHEST_ROOM_M: Final = 5.0
"""A room drawn farther than this from the others is refused, metres: probably a digit is wrong."""
OF_NO_ROOM: Final = 0.2
"""Confidence of an entrance that was the door of what is no room: reviewers took most of them out."""
_SAME: Final = 0.2
"""A drawn room is the outline of a room of the plan if they share all but this part of both."""


def place_wall(draft: Draft, placed: Placed) -> Said:
    """Place a wall (R4)."""
    strip = strip_of(*placed.points, depth_m=SAID_WALL_M)
    shut = _passages_shut_by(draft, strip)
    crossed = [room for room in draft.rooms if room.shape.intersects(shapely.LineString(strip.ends))]
    if not crossed and shut:
        drawn = shapely.union_all([strip.polygon(), *(door.shape for door in shut)])
        draft.walls.append(CorrectedArea(drawn, str(placed.correction)))
        return Said(wall_text(placed), _shut_passages(draft, shut, strip.polygon()))
    if not crossed:
        _place_outside_rooms(draft, strip, placed)
    strip = turn_square(strip, crossed[0].shape)
    starts, ends = strip.ends
    edge = shapely.union_all([room.shape.boundary for room in crossed])
    reach = []
    for end, way in ((starts, -strip.along), (ends, strip.along)):  # a free end snaps to the wall in front of it
        ray = shapely.LineString([end - way * MEETS_M, end + way * SNAP_M])
        hit = shapely.intersection(ray, edge)
        reach.append(0.0 if hit.is_empty else float(shapely.Point(end).distance(hit)) + SAID_WALL_M)
    low, high = -strip.length / 2 - reach[0], strip.length / 2 + reach[1]
    whole = Strip(strip.centre + strip.along * (low + high) / 2, strip.along, high - low, SAID_WALL_M)
    area, also = whole.polygon(), list[str]()
    line = shapely.LineString(strip.ends)
    crossed = [room for room in crossed if shapely.intersection(room.shape, line).length > SAID_WALL_M]
    wanted = [room for room in crossed if shapely.intersection(room.shape, area).area >= ROUNDED_M2]
    for room in wanted:
        also += _wall_in(draft, room, area, whole.length)
    draft.walls.append(CorrectedArea(area, str(placed.correction)))
    also += _shut_passages(draft, shut, area)
    if not wanted and not shut:
        raise AlreadySoError("no floor is there: it lies in a wall already")
    return Said(wall_text(placed), also)


def _wall_in(draft: Draft, room: DraftRoom, area: Polygon, length_m: float) -> list[str]:
    """Take a wall's area out of a room, which it may part; return sentences on what else changes."""
    also, left = list[str](), shapely.difference(room.shape, area)
    if slits := _slits_behind(left, area, length_m):
        left = shapely.difference(left, shapely.union_all(slits))
        also.append(f"the floor behind it, less than {SNAP_M:g} m deep, is wall")
    kept = _parts_of(left)
    if not kept:
        raise NoEffectError(f"it would take all of {draft.name(room)}; if that is no room, say no_room")
    drawn = shapely.union_all([area, *(wall.shape for wall in draft.walls)])
    closed = shapely.difference(left, shapely.union_all(_gaps_beside(left, drawn)))
    if len(closed_parts := _parts_of(closed)) > len(kept):
        kept = closed_parts
    draft.spaces += _closets(left, kept)
    lost = list(_cut_off(left, kept))
    if (lost_m2 := sum(part.area for part in lost)) > TILE_M2:
        also.append(f"{lost_m2:.1f} m2 that it cuts off are in no room now")
    also += [
        f"the {door.kind} of {door.width:.2f} m there has no room at one side now; if it is no way, say no_door"
        for door in draft.doors
        if any(side is room for side in door.rooms)
        and any(part.distance(door.shape) <= MEETS_M for part in lost)
        and all(part.distance(door.shape) > MEETS_M for part in kept)
    ]
    if len(kept) > 1:
        made = draft.replace_room(room, kept)
        also.append("it parts a room into " + " and ".join(draft.name(each) for each in made))
    else:
        made = [room]
        room.change(kept[0])
    for each in made:
        each.confidence = None if each.confidence is None else 1.0
    return also


def _passages_shut_by(draft: Draft, strip: Strip) -> list[DraftDoor]:
    """Return the passages that a wall shuts: it lies in or just before each, along it, and covers most of its width."""
    area = strip.polygon()
    return [
        door
        for door in draft.doors
        if _covered_share(door, [strip]) > door.width / 2 or area.intersection(door.shape).area > door.shape.area / 2
    ]


def _covered_share(door: DraftDoor, walls: Sequence[Strip]) -> float:
    """Return how much of a passage's width is covered by walls that lie in or just before it, along it, metres."""
    way = strip_of(*door.ends, depth_m=door.shape.area / max(door.width, STEP_M) + 2 * SNAP_M)
    before, spans = way.polygon(longer_m=MEETS_M), []
    for wall in walls:
        part = shapely.intersection(shapely.LineString(wall.ends), before)
        if abs(dot(way.along, wall.along)) > ALONG and part.length > 0:
            at = (shapely.get_coordinates(part) - way.centre) @ way.along
            spans.append(shapely.LineString([(at.min(), 0.0), (at.max(), 0.0)]))
    return float(shapely.union_all(spans).length)


def shut_together(draft: Draft, walls: Sequence[Placed]) -> dict[int, list[str]]:
    """Shut passages that only several walls cover; return sentences by the number of the wall (R4)."""
    said: dict[int, list[str]] = {}
    strips = [strip_of(*each.points, depth_m=SAID_WALL_M) for each in walls]
    for door in [door for door in draft.doors if not door.said]:
        over = [k for k, strip in enumerate(strips) if _covered_share(door, [strip]) > 0]
        if len(over) < 2 or _covered_share(door, [strips[k] for k in over]) <= door.width / 2:
            continue
        area = shapely.union_all([strips[k].polygon() for k in over])
        sentences = _shut_passages(draft, [door], area)
        draft.walls.append(CorrectedArea(shapely.union(area, door.shape), str(walls[over[0]].correction)))
        for k in over:
            said.setdefault(k, []).extend(sentences)
    return said


def wall_text(placed: Placed) -> str:
    """Return the sentence about a wall that a person has drawn."""
    return f"a wall of {math.dist(*placed.points):.2f} m stands there"


def _shut_passages(draft: Draft, shut: Sequence[DraftDoor], wall: Polygon) -> list[str]:
    """Remove the passages that a wall shuts; return a sentence about each."""
    if said := next((door.said for door in shut if door.said), ""):
        raise ContradictionError(said)
    draft.doors = [door for door in draft.doors if all(door is not each for each in shut)]
    draft.denied += [shapely.union(door.shape, wall) for door in shut if door.rooms[1] is not None]
    return [f"the {door.kind} of {door.width:.2f} m there is shut" for door in shut]


def _place_outside_rooms(draft: Draft, strip: Strip, placed: Placed) -> NoReturn:
    """Place a wall that crosses no room; raise the reason why it changes no room."""
    far, line = draft.distance_to_rooms(strip.centre), shapely.LineString(strip.ends)
    stands = shapely.intersection(line, shapely.union_all(draft.standing)).length > line.length / 2
    if draft.standing and not stands:
        raise PartsNothingError(f"it lies {far:,.1f} m from the nearest room, and closes no space")
    if far > WALL_REACH_M:
        raise NoEffectError(
            f"it lies {far:,.1f} m from the nearest room; to add the room that it bounds, draw its outline with "
            "room_outline"
        )
    draft.walls.append(CorrectedArea(strip.polygon(), str(placed.correction)))
    raise AlreadySoError("no floor is there: it lies in a wall already")


def close_spaces(draft: Draft, walls: Sequence[Placed]) -> dict[int, Said]:
    """Make rooms of the spaces outside rooms that walls enclose; return the effects by the number of the wall (R4)."""
    if not walls:
        return {}
    floor = [room.shape for room in draft.rooms] + [door.shape for door in draft.inner_doors]
    standing = shapely.union_all([*draft.standing, *floor, *(wall.shape for wall in draft.walls)])
    drawn = drawn_walls([shapely.LineString(each.points) for each in walls], standing)
    closed = shapely.union_all(spaces_enclosed_by(standing))
    bounds: dict[int, list[DraftRoom]] = {}
    also: dict[int, list[str]] = {}
    for space in spaces_enclosed_by(shapely.union_all([standing, *drawn])):
        is_new = shapely.intersection(space, closed).area < space.area / 2
        if not is_new or not is_room_sized(space) or space.buffer(-SNAP_M).is_empty:
            continue
        room = DraftRoom(space, confidence=1.0)
        draft.rooms.append(room)
        led = _lead_in(draft, room)
        for number, wall in enumerate(drawn):
            if wall.distance(space) < MEETS_M:
                bounds.setdefault(number, []).append(room)
                also.setdefault(number, []).extend(led)
    done: dict[int, Said] = {}
    for number, made in bounds.items():
        what = "a space" if len(made) == 1 else f"{len(made)} spaces"
        text = f"a wall of {math.dist(*walls[number].points):.2f} m closes {what}, {_names(draft, made)} now"
        done[number] = Said(text, also[number])
        draft.walls.append(CorrectedArea(drawn[number], str(walls[number].correction)))
    return done


def spaces_enclosed_by(barrier: BaseGeometry) -> list[Polygon]:
    """Return the spaces that a barrier encloses on all sides, the largest first."""
    if barrier.is_empty:
        return []
    x1, y1, x2, y2 = barrier.bounds
    around = shapely.box(x1 - SNAP_M, y1 - SNAP_M, x2 + SNAP_M, y2 + SNAP_M)
    free = split_pieces(shapely.difference(around, barrier))
    return [part for part in free if not part.intersects(around.exterior)]


def _parts_of(left: BaseGeometry) -> list[Polygon]:
    """Return the parts of a room that are large enough to be rooms, or else the largest part."""
    parts = split_pieces(left)
    return [part for part in parts if is_room_sized(part)] or parts[:1]


def _cut_off(left: BaseGeometry, kept: Sequence[Polygon]) -> Iterator[Polygon]:
    """Yield the parts of a room that a wall cut off and that are in no room now."""
    for part in split_pieces(left):
        if not any(part.intersects(other) for other in kept):
            yield part


def _closets(left: BaseGeometry, kept: Sequence[Polygon]) -> Iterator[Space]:
    """Yield spaces that a wall cut off and that become rooms only if a person says so, by a door or a point in them."""
    return (Space(part, reachable=False) for part in _cut_off(left, kept) if may_be_room(part))


def _gaps_beside(left: BaseGeometry, walls: BaseGeometry) -> list[BaseGeometry]:
    """Return the parts of a room narrower than ``SNAP_M`` beside drawn walls: the walls were meant to close them."""
    wide = left.buffer(-SNAP_M / 2, join_style="mitre").buffer(SNAP_M / 2 + MEETS_M, join_style="mitre")
    beside = walls.buffer(MEETS_M)
    return [part for part in shapely.get_parts(shapely.difference(left, wide)).tolist() if part.intersects(beside)]


def _slits_behind(left: BaseGeometry, wall: Polygon, length_m: float) -> list[Polygon]:
    """Return the parts of a room thinner than ``SNAP_M`` along a drawn wall: the wall was meant as the room's edge."""
    wide = left.buffer(-SNAP_M / 2, join_style="mitre").buffer(SNAP_M / 2 + MEETS_M, join_style="mitre")
    beside = wall.buffer(MEETS_M)
    thin = split_pieces(shapely.difference(left, wide))
    return [each for each in thin if shapely.intersection(each.boundary, beside).length > length_m / 2]


def remove_wall(draft: Draft, placed: Placed) -> Said:
    """Remove a wall along a line, so that the rooms on both sides become one (R5)."""
    line = strip_of(*placed.points)
    drawn = in_its_wall(draft, line)
    if over := next((wall for wall in draft.walls if wall.shape.intersects(shapely.LineString(drawn.ends))), None):
        raise ContradictionError(over.said)
    if (there := draft.room_at(drawn.centre)) is not None:
        return _open_along(draft, line, there)
    shapes, is_line = [room.shape for room in draft.rooms], str(placed.correction) in draft.no_walls
    drawn = _bare(draft, drawn) if is_line else drawn
    faces = faces_beside(drawn, shapes)
    if is_line and min(faces.shapes) >= 0:  # in all the depth of the wall
        drawn = _bare(draft, fit_to_wall(drawn, faces))
        faces = faces_beside(drawn, shapes)
    found = [draft.rooms[k] for k in faces.shapes if k >= 0]
    if not found:
        raise NoEffectError(far_from_rooms(draft, drawn))
    if len(found) == 1:
        behind = space_behind(draft, drawn, 0 if faces.shapes[0] < 0 else 1, faces)
        if behind is None and is_line:
            raise NoEffectError(
                f"only {draft.name(found[0])} lies beside it; if it is open to the outside, say entrance; if a room "
                "lies behind it, say room or room_outline"
            )
        if behind is None:
            sides = (found[0], None) if faces.shapes[0] >= 0 else (None, found[0])
            return make_entrance(draft, drawn, rooms=sides, faces=faces, text=str(placed.correction), said=Said(""))
        draft.rooms.append(behind)
        found.append(behind)
        faces = faces_beside(drawn, [room.shape for room in draft.rooms])
    if found[0] is found[1]:
        return opened_wall(draft, drawn, found[0], faces) if is_line else _open_along(draft, line, found[0])
    fitted = fit_to_wall(drawn, faces)
    gap = clear_part(fitted.polygon(deeper_m=STEP_M), (room.shape for room in draft.rooms), fitted.centre)
    names, also = _names(draft, found), merge_rooms(draft, found, str(placed.correction), gap=gap)
    (merged,) = (room for room in draft.rooms if room.said == str(placed.correction))
    more_m, kept_m = (0.0, 0.0) if is_line else _take_walls_out(draft, line, merged)
    also += describe_narrowing(drawn, fitted) if is_line else _what_stays(kept_m)
    return Said(f"{fitted.length + more_m:.2f} m of wall are gone: {names} are one room now", also)


def _open_along(draft: Draft, line: Strip, room: DraftRoom) -> Said:
    """Remove the walls that stand in a room along a line."""
    gone_m, kept_m = _take_walls_out(draft, line, room)
    if not gone_m and kept_m < STEP_M:
        raise AlreadySoError(f"no wall is there: it lies in {draft.name(room)}")
    if not gone_m:
        raise NoEffectError(f"{draft.name(room)} lies at one side of the wall there only, within {WALL_REACH_M} m")
    text = f"the wall that stands in {draft.name(room)} is open for {gone_m:.2f} m: both sides are one room"
    return Said(text, _what_stays(kept_m))


def _what_stays(kept_m: float) -> list[str]:
    return [f"{kept_m:.2f} m of the wall there have the room at one side only, and stay"] if kept_m > STEP_M else []


def _take_walls_out(draft: Draft, line: Strip, room: DraftRoom) -> tuple[float, float]:
    """Remove the walls in a room that stand within ``SNAP_M`` of a line, in all their depth, from end to end of it.

    Return along how much of the line walls are gone, and along how much walls stay that have the room at one side only,
    metres.
    """
    at = np.linspace(-line.length / 2, line.length / 2, math.ceil(line.length / STEP_M) + 1)
    others = [each.shape for each in draft.rooms if each is not room] + [door.shape for door in draft.doors]
    taken = shapely.union_all(others)
    gone, gone_m, kept_m = list[Polygon](), 0.0, 0.0
    for low, high in pairwise(at.tolist()):
        column = Strip(line.centre + line.along * (low + high) / 2, line.along, high - low, 2 * WALL_REACH_M)
        axis, whole = shapely.LineString(column.ends), column.polygon()
        far = shapely.MultiLineString([column.ends + side * WALL_REACH_M * column.across for side in (-1, 1)])
        walls = shapely.get_parts(shapely.difference(whole, room.shape)).tolist()
        near = [wall for wall in walls if wall.area > SAME_M2 and wall.distance(axis) < SNAP_M]
        free = [wall for wall in near if wall.distance(far) > MEETS_M]
        free = [wall for wall in free if shapely.intersection(wall, taken).area < SAME_M2]
        gone += [wall.buffer(GRID_M / 10) for wall in free]
        gone_m += column.length if free else 0.0
        kept_m += column.length if len(free) < len(near) else 0.0
    if gone:
        room.change(split_pieces(shapely.union_all([room.shape, *gone]))[0])
        room.confidence = None if room.confidence is None else 1.0
    return gone_m, kept_m


def _bare(draft: Draft, strip: Strip) -> Strip:
    """Return the part of a line of a drawing along which no other line of it runs."""
    low, high = bare_part(strip, draft.lines)
    if high - low < MIN_DOOR_M:
        raise AlreadySoError("the wall there is another line of the drawing")
    return Strip(strip.centre + strip.along * (low + high) / 2, strip.along, high - low, 0.0)


def _names(draft: Draft, rooms: Sequence[DraftRoom]) -> str:
    return " and ".join(draft.name(room) for room in rooms)


def add_room(draft: Draft, placed: Placed) -> Said:
    """Make a room of a space (R6)."""
    place = placed.points[0]
    if (there := draft.room_at(place)) is not None:
        there.confidence = None if there.confidence is None else 1.0
        there.said = there.said or str(placed.correction)
        raise AlreadySoError(f"{draft.name(there)} is there already")
    point = shapely.Point(place)
    free = [free_part(draft, space.shape) for space in draft.spaces if space.shape.covers(point)]
    shape = next((each for each in free if each is not None and each.covers(point) and may_be_room(each)), None)
    if shape is None:
        taken = [*(room.shape for room in draft.rooms), *(door.shape for door in draft.inner_doors)]
        closed = spaces_enclosed_by(shapely.union_all([*draft.standing, *taken, *(wall.shape for wall in draft.walls)]))
        shape = next((each for each in closed if each.covers(point) and may_be_room(each)), None)
    if shape is None:
        raise NoEffectError(
            f"no closed space between walls is known there; the nearest room is "
            f"{draft.distance_to_rooms(place):,.1f} m away; draw its corners with room_outline, "
            "and say one_room if it is part of a room"
        )
    room = DraftRoom(shape, confidence=1.0, said=str(placed.correction))
    draft.rooms.append(room)
    return Said(f"the space of {shape.area:.1f} m2 there is a room", _lead_in(draft, room))


def draw_room(draft: Draft, placed: Placed) -> Said:
    """Make a room of exactly the area between corners, without furniture; other rooms lose what it covers (R6)."""
    drawn = Polygon(placed.points)
    far = min((float(each.shape.distance(drawn)) for each in draft.rooms), default=math.inf)
    if far > FARTHEST_ROOM_M:
        raise NoEffectError(f"it lies {far:,.1f} m from the nearest room; draw it at the house")
    furniture = shapely.union_all([thing.polygon for thing in draft.plan.objects])
    shape, *_ = [*split_pieces(shapely.difference(drawn, furniture)), Polygon()]
    if not may_be_room(shape):
        raise NoEffectError("furniture takes all of it")
    same = (room for room in draft.rooms if _is_outline_of(room, shape))
    if (there := next(same, None)) is not None:
        there.confidence = None if there.confidence is None else 1.0
        there.said = there.said or str(placed.correction)
        raise AlreadySoError(f"{draft.name(there)} is there already")
    room = DraftRoom(shape, confidence=1.0)
    also = _take_from_others(draft, room)
    room.said = str(placed.correction)
    if drawn.area - shape.area > TILE_M2:
        also.insert(0, f"of the {drawn.area:.1f} m2 that were drawn, {shape.area:.1f} m2 are free")
    return Said(f"a room of {shape.area:.1f} m2 is there", [*also, *_lead_in(draft, room)])


def _is_outline_of(room: DraftRoom, shape: Polygon) -> bool:
    """Return whether a shape is a room's outline but for rounding."""
    return bool(shapely.hausdorff_distance(room.shape.boundary, shape.boundary) < 2 * GRID_M)


def _take_from_others(draft: Draft, made: DraftRoom) -> list[str]:
    """Add a room, and take its area with a wall around it from the rooms that it covers; return sentences."""
    shape, wall = made.shape, made.shape.buffer(SAID_WALL_M, join_style="mitre")
    covered = [room for room in draft.rooms if room.shape.distance(shape) < MEETS_M]
    shared = {id(room): float(shapely.intersection(room.shape, shape).area) for room in covered}
    covered.sort(key=lambda room: -shared[id(room)])
    rest = {id(room): _rest_beside(room.shape, wall) for room in covered}
    outlines = {id(room) for room in covered if shared[id(room)] > (1 - _SAME) * max(shape.area, room.shape.area)}
    rest |= {each: [] for each in outlines}
    _lead_to(draft, made, rest)
    also, parts = list[str](), [made]
    for room in covered:
        name, before_m2, kept = draft.name(room), room.shape.area, rest[id(room)]
        if made.label == UNLABELLED and shared[id(room)] > before_m2 / 2:
            made.label, made.words, made.named = room.label, room.words, room.named
            room.label, room.words, room.named = UNLABELLED, (), ""
        if not kept:
            cut_off = before_m2 - float(shapely.intersection(room.shape, wall).area)
            also.append(f"it replaces the outline of {name}" if id(room) in outlines else f"{name} is gone")
            also += [f"{cut_off:.1f} m2 of it are in no room now"] if cut_off > TILE_M2 else []
            place = draft.rooms.index(room)
            draft.rooms[place : place + 1] = [] if made in draft.rooms else [made]
            continue
        if len(kept) == 1:
            room.change(kept[0])
        left = [room] if len(kept) == 1 else draft.replace_room(room, kept)
        draft.divide_passages([made, *left])
        parts += left
        lost_m2 = before_m2 - sum(part.area for part in kept)
        if TILE_M2 < lost_m2 < _SAME * before_m2 and len(left) == 1:
            also.append(f"{name} loses {lost_m2:.1f} m2 to it")
        elif lost_m2 > TILE_M2:
            also.append(f"the rest of {name} is {_names(draft, left)} now; say no_room there if that is no room")
    if made not in draft.rooms:
        draft.rooms.append(made)
    for door in list(draft.doors):
        if any(side is part for part in parts for side in door.rooms) or door.shape.distance(shape) < MEETS_M:
            draft.beside += refit_passage(draft, door)
    return also


def _rest_beside(shape: Polygon, wall: Polygon) -> list[Polygon]:
    """Return what a wall leaves of a room: parts that are large enough to be rooms, without slits beside the wall."""
    left = shapely.difference(shape, wall)
    left = shapely.difference(left, shapely.union_all(_gaps_beside(left, wall)))
    return [part for part in split_pieces(left) if is_room_sized(part) and not part.buffer(-SNAP_M).is_empty]


def _lead_to(draft: Draft, made: DraftRoom, rest: Mapping[int, Sequence[Polygon]]) -> None:
    """Lead passages into a drawn room where it, not the rest of the room that it covers, has the floor before them."""

    def side_now(door: DraftDoor, side: DraftRoom) -> DraftRoom:
        before = shapely.intersection(side.shape, door.shape.buffer(STEP_M))

        def lies_before(part: Polygon) -> tuple[float, float]:
            return float(shapely.intersection(before, part).area), -float(part.distance(door.shape))

        parts = rest.get(id(side), [side.shape])
        return made if all(lies_before(made.shape) > lies_before(part) for part in parts) else side

    for door in draft.doors:
        one, other = door.rooms
        assert one is not None  # noqa: S101  # the first side of a door is a room
        door.rooms = side_now(door, one), None if other is None else side_now(door, other)


def _lead_in(draft: Draft, room: DraftRoom) -> list[str]:
    """Connect a new room to entrances of other rooms that lead to its place; return a sentence about each."""
    said = []
    for k, door in enumerate(draft.doors):
        beside = door.rooms[0]
        if door.rooms[1] is not None or door.said or beside is room:
            continue
        line = Strip(door.ends.mean(axis=0), door.along, door.width, 0.0)
        faces = faces_beside(line, [beside.shape, room.shape])
        if sorted(faces.shapes) != [0, 1] or faces.clear[1] - faces.clear[0] < (1 - _SAME) * door.width:
            continue
        strip = fit_to_wall(line, faces)
        area = clear_part(strip.polygon(deeper_m=STEP_M), (each.shape for each in draft.rooms), strip.centre)
        kind: DoorKind = "opening" if door.width > WIDEST_DOOR_M else "door"
        draft.doors[k] = DraftDoor(kind, area, strip.ends, (beside, room), door.confidence)
        said.append(f"the entrance of {door.width:.2f} m of {draft.name(beside)} leads into it")
    return said


def _room_there(draft: Draft, place: Vector) -> DraftRoom:
    room = draft.room_at(place)
    if room is not None:
        return room
    if (door := draft.door_at(place, 0.0)) is not None:
        raise NoEffectError(f"the point lies in {with_article(door.kind)}; choose one in a room")
    point = shapely.Point(place)
    if gone := next((each for each in draft.taken_out if each.shape.covers(point)), None):
        raise ContradictionError(gone.said, "takes the room there out, and")
    raise NoEffectError(f"no room is there; the nearest is {draft.distance_to_rooms(place):,.2f} m away")


def remove_room(draft: Draft, placed: Placed) -> Said:
    """Remove a room (R6)."""
    room = _room_there(draft, placed.points[0])
    if room.said:
        raise ContradictionError(room.said)
    if len(draft.rooms) == 1:
        raise NoEffectError(
            "it is the only room of the plan; draw the right one with room_outline, or drop the plan if it is no house"
        )
    before = {id(door) for door in draft.doors}
    gone = [door for door in draft.doors if any(side is room for side in door.rooms)]
    kinds = {id(door.shape): door.kind for door in gone}
    if said := next((door.said for door in gone if door.said and door.rooms[1] is None), ""):
        raise ContradictionError(said, "leads into it, and")
    is_outside = placed.correction.word == "outside"
    text = f"{draft.name(room)} {'lies outside' if is_outside else 'is no room'}"
    others = [each.shape for each in draft.rooms if each is not room]
    draft.remove_room(room, open_outside=is_outside or not is_enclosed(room.shape, others))
    draft.taken_out.append(CorrectedArea(room.shape, str(placed.correction)))
    outside = [door for door in draft.doors if id(door) not in before]
    for door in outside:
        if not (is_outside or door.said):
            door.confidence = OF_NO_ROOM
    also = [f"its {kinds[id(door.shape)]} of {door.width:.2f} m leads outside now" for door in outside]
    shut = len(gone) - len(also)
    if is_outside:
        also += _open_sides(draft, room.shape, str(placed.correction))
    if shut:
        also.append(f"{shut} of its passages {'are' if shut > 1 else 'is'} gone")
    return Said(text, also)


def is_enclosed(space: Polygon, rooms: Sequence[Polygon]) -> bool:
    """Return whether rooms and the walls between them surround a space."""
    closed = shapely.union_all(rooms).buffer(WALL_REACH_M / 4, join_style="mitre")
    return any(Polygon(part.exterior).covers(space) for part in split_pieces(closed))


def _open_sides(draft: Draft, outside: Polygon, text: str) -> Iterator[str]:
    """Make entrances where rooms meet the outside without a wall; yield a sentence about each."""
    for room in draft.rooms:
        shared = shapely.intersection(room.shape.boundary, outside.buffer(MEETS_M))
        for side in shapely.get_parts(shapely.line_merge(shared)):
            points = shapely.get_coordinates(shapely.simplify(side, GRID_M))
            for a, b in pairwise(points):
                if math.dist(a, b) < MIN_DOOR_M:
                    continue
                strip = strip_of(a, b, depth_m=depth_of_entrances(draft))
                away = 1 if outside.covers(shapely.Point(strip.before(1, 0.0))) else -1
                strip = replace(strip, centre=strip.centre + away * strip.across * strip.depth / 2)
                area = clear_part(strip.polygon(), [each.shape for each in draft.rooms], strip.centre)
                draft.doors.append(DraftDoor("entrance", area, strip.ends, (room, None), 1.0, said=text))
                yield f"{draft.name(room)} is open to it for {strip.length:.2f} m"


def join_rooms(draft: Draft, placed: Placed) -> Said:
    """Merge the rooms at several points (R5)."""
    rooms = list({id(room): room for room in (_room_there(draft, place) for place in placed.points)}.values())
    if len(rooms) == 1:
        raise AlreadySoError("the points lie in one room already")
    text = f"{_names(draft, rooms)} are one room now"
    return Said(text, merge_rooms(draft, rooms, str(placed.correction)))


def name_room(draft: Draft, placed: Placed) -> Said:
    """Name a room (R6)."""
    room, label = _room_there(draft, placed.points[0]), placed.correction.value[2]
    if room.named and room.label != label:
        raise ContradictionError(room.named)
    room.named = str(placed.correction)
    if room.label == label:
        raise AlreadySoError(f"{draft.name(room)} has this label already")
    text = f"{draft.name(room)} is called {label} now"
    room.label, room.words = label, ()  # the source's words no longer apply
    return Said(text)
