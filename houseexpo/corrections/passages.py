"""Place and remove passages in a draft: ``door``, ``opening``, ``entrance``, ``no_door`` (rules in ``apply``)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections.draft import (
    AlreadySoError,
    ContradictionError,
    Draft,
    DraftDoor,
    DraftRoom,
    NoEffectError,
    PartsNothingError,
    Placed,
    Said,
    Vector,
    is_room_sized,
    may_be_room,
    split_pieces,
)
from houseexpo.corrections.openings import (
    ALONG,
    MEETS_M,
    ONWARD_M,
    SAID_WALL_M,
    SNAP_M,
    STEP_M,
    WALL_REACH_M,
    Faces,
    Strip,
    depth_of_entrances,
    dot,
    extend_to_walls,
    faces_beside,
    strip_of,
    turn_square,
    walls_beside,
)
from houseexpo.corrections.vocabulary import Word
from houseexpo.plan.parts import Door, DoorKind
from houseexpo.tolerances import GRID_M, MIN_DOOR_M, ROUNDED_M2, SMALLEST_SAID_ROOM_M2

WIDEST_DOOR_M: Final = 2.5
"""A wider passage is an opening, metres: ``pipeline.config.DoorsConfig.widest_m``."""
_PAST_FACE_M: Final = 0.01
"""How far a line that was drawn on a wall's face is moved into the wall, metres: the thinnest walls are 2 cm thick."""
_BESIDE_M: Final = 0.03
"""A line at most this far from the common edge of two rooms lies on that edge, metres."""


def place_passage(draft: Draft, placed: Placed) -> Said:
    """Place a door, an opening or an entrance (R3, R4)."""
    strip = strip_of(*placed.points)
    there = _passage_there(draft, strip)
    if there is not None and (abs(there.width - strip.length) <= 2 * STEP_M or _ends_match(there, strip)):
        if there.said:
            raise ContradictionError(there.said, "stands in its place, and")
        return _confirm(there, placed)
    if there is not None:
        draft.doors.remove(there)
    said = _new_passage(draft, strip, placed)
    if there is not None:
        said.also.append(f"{there.said or f'the {there.kind} of {there.width:.2f} m there'} gave way")
    return said


def _ends_match(door: DraftDoor, strip: Strip) -> bool:
    apart = min(
        max(math.dist(a, b) for a, b in zip(door.ends, ends, strict=True)) for ends in (strip.ends, strip.ends[::-1])
    )
    return apart <= SNAP_M


def _passage_there(draft: Draft, strip: Strip) -> DraftDoor | None:
    """Return the passage that covers most of a line, or most of which the line covers, or None."""
    best, most = None, 0.0
    for door in draft.doors:
        way, centre = door.along, door.ends.mean(axis=0)
        aside = abs(dot(centre - strip.centre, np.array([-way[1], way[0]])))
        depth = door.shape.area / max(door.width, STEP_M)
        if abs(dot(way, strip.along)) < ALONG or aside > depth / 2 + SNAP_M:
            continue
        at = dot(centre - strip.centre, strip.along)
        shared = min(strip.length / 2, at + door.width / 2) - max(-strip.length / 2, at - door.width / 2)
        if shared > min(strip.length, door.width) / 2 and shared > most:
            best, most = door, shared
    return best


def _confirm(door: DraftDoor, placed: Placed) -> Said:
    """Give an existing passage the kind that a person states; if it is rated, it gets confidence 1."""
    word = placed.correction.word
    inner = door.rooms[1] is not None
    if word == "entrance" and inner:
        raise NoEffectError(f"the {door.kind} there joins two rooms; to have none behind it, say no_room of that room")
    is_so = not inner or door.kind == word  # a wide door of the plan stays one
    kind = door.kind if is_so else _kind(word, door.width)
    was, door.kind = door.kind, kind
    door.said = str(placed.correction)
    door.confidence = 1.0 if door.confidence is not None or was == "cut" else None
    if was == kind:
        raise AlreadySoError(f"the plan has this {kind} already, {door.width:.2f} m wide")
    return Said(f"the {was} there is {with_article(kind)} now")


def with_article(kind: str) -> str:
    """Return a kind of passage with its article."""
    return f"an {kind}" if kind[0] in "aeio" else f"a {kind}"


def _kind(word: Word, width_m: float) -> DoorKind:
    return "opening" if word == "opening" or width_m > WIDEST_DOOR_M else "door"


def _new_passage(draft: Draft, strip: Strip, placed: Placed) -> Said:
    word, text = placed.correction.word, str(placed.correction)
    for line in (strip, *_onto_edges(draft, strip)) if word != "entrance" else ():
        if (sides := _meeting_at(draft, line)) is not None:
            return _on_common_edge(draft, line, sides, placed)
    strip = in_its_wall(draft, strip)
    room = draft.room_at(strip.centre)
    if room is not None:
        return _on_floor(draft, strip, room, placed)
    shapes = [each.shape for each in draft.rooms]
    faces = faces_beside(strip, shapes)
    one, other = (draft.rooms[k] if k >= 0 else None for k in faces.shapes)
    said = Said("")
    if (one is None) != (other is None) and word != "entrance":
        behind = space_behind(draft, strip, 0 if one is None else 1, faces)
        if behind is not None:
            draft.rooms.append(behind)
            said.also.append(f"a space of {behind.shape.area:.1f} m2 behind it, which nothing led into, is a room now")
            one, other = (behind, other) if one is None else (one, behind)
            faces = faces_beside(strip, [each.shape for each in draft.rooms])
    if one is None and other is None:
        raise NoEffectError(far_from_rooms(draft, strip))
    if word == "entrance" and one is not None and one is other:  # the room goes on around what lies between its faces
        along, across = sum(faces.clear) / 2, (faces.far[1] - faces.far[0]) / 2
        if one.shape.distance(shapely.Point(strip.centre + along * strip.along + across * strip.across)) < MEETS_M:
            raise NoEffectError(f"only an end of it lies at {draft.name(one)}; draw all of it in an outer wall")
        one, other = (one, None) if faces.far[0] <= faces.far[1] else (None, one)
    if one is not None and other is not None:
        if word == "entrance":
            raise NoEffectError(
                f"it lies between {draft.name(one)} and {draft.name(other)}; say door, or no_room of one"
            )
        if one is other:
            with suppress(NoEffectError):  # a line on the floor, and a post in it
                return _over_post(draft, strip, one, placed)
            return opened_wall(draft, strip, one, faces)
        return _between(draft, strip, rooms=(one, other), faces=faces, word=word, text=text, said=said)
    return make_entrance(draft, strip, rooms=(one, other), faces=faces, text=text, said=said)


def _meeting_at(draft: Draft, strip: Strip) -> tuple[DraftRoom, DraftRoom] | None:
    """Return the two rooms that meet along a line without a wall, or None."""
    one, other = (draft.room_at(strip.before(side, 2 * _BESIDE_M)) for side in (-1, 1))
    if one is None or other is None or one is other:
        return None
    middle = shapely.Point(strip.centre)
    is_edge = all(room.shape.distance(middle) < _BESIDE_M for room in (one, other))
    return (one, other) if is_edge and one.shape.distance(other.shape) < MEETS_M else None


def _onto_edges(draft: Draft, strip: Strip) -> Iterator[Strip]:
    """Yield a line moved onto the edges of rooms that it runs along within ``SNAP_M``, the nearest first."""
    for start, way, _ in walls_beside(strip, draft.rooms, SNAP_M):
        turned = replace(strip, along=way)
        yield replace(turned, centre=strip.centre + turned.across * dot(start - strip.centre, turned.across))


def _on_common_edge(draft: Draft, strip: Strip, rooms: tuple[DraftRoom, DraftRoom], placed: Placed) -> Said:
    """Make a passage on the part of the edge that two rooms share, as deep as a wall that a person draws."""
    one, other = rooms
    low, high = _shared_part(strip, one.shape, other.shape)
    if high - low < MIN_DOOR_M - 1e-9:
        raise NoEffectError(
            f"only {high - low:.2f} m of it lies on their common edge, a door has {MIN_DOOR_M} m or more"
        )
    centre = strip.centre + strip.along * (low + high) / 2
    whole = Strip(centre, strip.along, high - low, SAID_WALL_M)
    said = Said("", _give_way(draft, whole.polygon()))
    area = split_pieces(shapely.intersection(whole.polygon(), shapely.union(one.shape, other.shape)))[0]
    for room in rooms:
        room.change(split_pieces(shapely.difference(room.shape, area))[0])
    kind = _kind(placed.correction.word, whole.length)
    draft.doors.append(DraftDoor(kind, area, whole.ends, rooms, 1.0, said=str(placed.correction)))
    joined = f"{draft.name(one)} and {draft.name(other)}, which meet there"
    said.text = f"{with_article(kind)} of {whole.length:.2f} m joins {joined}"
    said.also += describe_narrowing(strip, whole)
    return said


def _shared_part(strip: Strip, one: Polygon, other: Polygon) -> tuple[float, float]:
    """Return the part of a line with one room on its right and the other on its left: its ends, metres from its middle.

    It is the part around the middle; its length is 0 if there is none.
    """
    low, high = -strip.length / 2, strip.length / 2
    for side, room in ((-1, one), (1, other)):
        beside = shapely.LineString(strip.ends + side * strip.across * 2 * _BESIDE_M)
        spans = [
            ((shapely.get_coordinates(part) - strip.centre) @ strip.along).tolist()
            for part in shapely.get_parts(shapely.intersection(beside, room))
            if part.length > 0
        ]
        found = next(((min(span), max(span)) for span in spans if min(span) <= 0 <= max(span)), (0.0, 0.0))
        low, high = max(low, found[0]), min(high, found[1])
    return low, high


def _over_post(draft: Draft, strip: Strip, room: DraftRoom, placed: Placed) -> Said:
    """Part a room along a line that crosses a post; most of the line is floor."""
    floor = shapely.intersection(shapely.LineString(strip.ends), room.shape).length
    if floor < strip.length / 2:
        raise NoEffectError("it lies in a wall")
    return _on_floor(draft, strip, room, placed)


def far_from_rooms(draft: Draft, strip: Strip) -> str:
    """Return a sentence about the distance of a line from the nearest room, for a line with no room beside it."""
    far = draft.distance_to_rooms(strip.centre)
    if far > WALL_REACH_M:
        return f"it lies {far:,.1f} m from the nearest room; draw it in a wall of the house"
    return f"no room looks at it from either side within {WALL_REACH_M} m; draw it along the wall"


def in_its_wall(draft: Draft, strip: Strip) -> Strip:
    """Return a line moved into the wall beside it (openings R1), or unchanged if there is no such wall."""
    room = draft.room_at(strip.centre)
    reach = WALL_REACH_M / 2 if room is None else SNAP_M
    edges = list(walls_beside(strip, draft.rooms, reach))
    lines = [] if room is not None else [replace(strip, along=way) for _, way, _ in edges]
    lines += [line for edge in edges if edge[2] <= SNAP_M for line in _into_wall(draft, strip, edge)]
    shapes = [each.shape for each in draft.rooms]
    parting = (line for line in lines if len({*faces_beside(line, shapes).shapes}) > 1)
    return next(parting, lines[0] if lines else strip)


def _into_wall(draft: Draft, strip: Strip, edge: tuple[Vector, Vector, float]) -> Iterator[Strip]:
    """Yield a line turned parallel to the wall behind an edge of a room and moved into that wall."""
    start, way, _ = edge
    turned = replace(strip, along=way)
    off = dot(start - strip.centre, turned.across)
    for side in (math.copysign(1.0, off), -math.copysign(1.0, off)):  # the wall is more likely on the farther side
        line = replace(turned, centre=strip.centre + turned.across * (off + side * _PAST_FACE_M))
        if draft.room_at(line.centre) is None:
            yield line


def space_behind(draft: Draft, strip: Strip, side: int, faces: Faces) -> DraftRoom | None:
    """Return a room made of the space on one side of a line that nothing led into (R3), or None."""
    lost = [space for space in draft.spaces if not space.reachable]
    free = [free_part(draft, space.shape) for space in lost]
    shapes = [shape for shape in free if shape is not None and may_be_room(shape)]
    found = faces_beside(strip, shapes).shapes[side]
    return DraftRoom(shapes[found], confidence=None) if found >= 0 and faces.shapes[1 - side] >= 0 else None


def free_part(draft: Draft, shape: Polygon, parted: Sequence[DraftRoom] = ()) -> Polygon | None:
    """Return the largest part of a space that no room and no passage covers but ``parted`` and those between them."""

    def is_parted(side: DraftRoom | None) -> bool:
        return any(side is room for room in parted)

    rooms = [room.shape for room in draft.rooms if not is_parted(room)]
    doors = [door.shape for door in draft.inner_doors if not all(map(is_parted, door.rooms))]
    taken = shapely.union_all([*rooms, *doors])
    parts = split_pieces(shapely.difference(shape, taken))
    return parts[0] if parts else None


def _between(
    draft: Draft,
    strip: Strip,
    *,
    rooms: tuple[DraftRoom, DraftRoom],
    faces: Faces,
    word: Word,
    text: str,
    said: Said,
) -> Said:
    """Join two rooms through the wall between them."""
    fitted = fit_to_wall(strip, faces)
    depth = faces.far[0] + faces.far[1]
    if depth < 0.01:
        raise NoEffectError("the two rooms meet there without a wall; draw the wall first")
    area = clear_part(fitted.polygon(deeper_m=STEP_M), (room.shape for room in draft.rooms), fitted.centre)
    said.also += _give_way(draft, area)
    kind = _kind(word, fitted.length)
    draft.doors.append(DraftDoor(kind, area, fitted.ends, rooms, 1.0, said=text))
    said.text = f"{with_article(kind)} of {fitted.length:.2f} m joins {draft.name(rooms[0])} and {draft.name(rooms[1])}"
    said.also += describe_narrowing(strip, fitted)
    if word == "door" and kind == "opening":
        said.also.append(f"wider than any door ({WIDEST_DOOR_M} m), it is an opening")
    return said


def fit_to_wall(strip: Strip, faces: Faces) -> Strip:
    """Return the clear part of a line, with the depth of its wall (openings R2)."""
    low, high = faces.clear
    if high - low < MIN_DOOR_M - 1e-9:
        raise NoEffectError(
            f"only {max(high - low, 0.0):.2f} m of it lies in one clear wall, a door has {MIN_DOOR_M} m or more"
        )
    right, left = faces.far
    centre = strip.centre + strip.along * (low + high) / 2 + strip.across * (left - right) / 2
    return Strip(centre, strip.along, high - low, right + left)


def describe_narrowing(strip: Strip, fitted: Strip) -> Iterator[str]:
    """Yield a sentence about the clear length of a line if it is shorter than the line."""
    if strip.length - fitted.length > STEP_M:
        yield f"of the {strip.length:.2f} m that were drawn, {fitted.length:.2f} m are clear"


def clear_part(shape: Polygon, taken: Iterable[Polygon], centre: Vector) -> Polygon:
    """Return the part of a shape outside the ``taken`` areas that is nearest to a point."""
    parts = split_pieces(shapely.difference(shape, shapely.union_all(list(taken))))
    point = shapely.Point(centre)
    return min(parts, key=lambda part: part.distance(point), default=shape)


def _give_way(draft: Draft, area: Polygon) -> list[str]:
    """Remove the passages that a new passage overlaps; raise NoEffectError if a person has stated one of them."""
    over = [door for door in draft.doors if shapely.intersection(door.shape, area).area > ROUNDED_M2]
    if said := next((door.said for door in over if door.said), ""):
        raise ContradictionError(said, "overlaps it, and")
    draft.doors = [door for door in draft.doors if all(door is not each for each in over)]
    return [f"the {door.kind} of {door.width:.2f} m in its place gave way" for door in over]


def make_entrance(
    draft: Draft,
    strip: Strip,
    *,
    rooms: tuple[DraftRoom | None, DraftRoom | None],
    faces: Faces,
    text: str,
    said: Said,
) -> Said:
    """Make an entrance in an outer wall (R4)."""
    room, fitted, area = _through_outer_wall(draft, strip, rooms, faces)
    said.also += _give_way(draft, area)
    draft.doors.append(DraftDoor("entrance", area, fitted.ends, (room, None), 1.0, said=text))
    said.text = f"an entrance of {fitted.length:.2f} m leads into {draft.name(room)}"
    said.also += describe_narrowing(strip, fitted)
    return said


def _through_outer_wall(
    draft: Draft, strip: Strip, rooms: tuple[DraftRoom | None, DraftRoom | None], faces: Faces
) -> tuple[DraftRoom, Strip, Polygon]:
    """Return the room at one side of a line in an outer wall, the clear part of the line, and its area in the wall."""
    side = 0 if rooms[0] is not None else 1
    room = rooms[side]
    assert room is not None  # noqa: S101  # the caller checks it
    depth = max(depth_of_entrances(draft), faces.far[side])
    low, high = faces.clear
    if high - low < MIN_DOOR_M - 1e-9:
        raise NoEffectError(
            f"only {max(high - low, 0.0):.2f} m of it lies in one clear wall, a door has {MIN_DOOR_M} m or more"
        )
    away = 1 if side == 0 else -1
    face = strip.centre + strip.along * (low + high) / 2 - away * strip.across * faces.far[side]
    fitted = Strip(face + away * strip.across * depth / 2, strip.along, high - low, depth)
    area = clear_part(fitted.polygon(deeper_m=STEP_M), (each.shape for each in draft.rooms), fitted.centre)
    area = clear_part(shapely.intersection(area, fitted.polygon(deeper_m=0.0)), [room.shape], fitted.centre)
    return room, fitted, area


def refit_passage(draft: Draft, door: DraftDoor) -> Iterator[str]:
    """Fit a passage to its rooms, whose edges have moved, or remove it; yield a sentence on what becomes of it."""
    shapes = [room.shape for room in draft.rooms]
    off = [float(side.shape.distance(door.shape)) for side in door.rooms if side is not None]
    over = shapely.intersection(door.shape, shapely.union_all(shapes)).area
    if max(off) < MEETS_M and over < ROUNDED_M2 and door.rooms[0] is not door.rooms[1]:
        return
    with suppress(NoEffectError):
        strip = in_its_wall(draft, strip_of(*door.ends))
        faces = faces_beside(strip, shapes)
        one, other = (draft.rooms[k] if k >= 0 else None for k in faces.shapes)
        if one is not other and {id(one), id(other)} == set(map(id, door.rooms)):
            if one is None or other is None:
                _, fitted, area = _through_outer_wall(draft, strip, (one, other), faces)
            else:
                fitted = fit_to_wall(strip, faces)
                area = clear_part(fitted.polygon(deeper_m=STEP_M), shapes, fitted.centre)
            if door.width - fitted.length > STEP_M:
                yield f"the {door.kind} of {door.width:.2f} m is {fitted.length:.2f} m wide now"
            door.shape, door.ends, door.before = area, fitted.ends, None
            return
    draft.doors = [each for each in draft.doors if each is not door]
    yield f"the {door.kind} of {door.width:.2f} m is gone"


def opened_wall(draft: Draft, strip: Strip, room: DraftRoom, faces: Faces) -> Said:
    """Open a wall that stands in one room."""
    fitted = fit_to_wall(strip, faces)
    area = clear_part(fitted.polygon(deeper_m=STEP_M), [room.shape], fitted.centre)
    parts = split_pieces(shapely.union_all([room.shape, area.buffer(1e-6)]))
    room.change(parts[0])
    room.confidence = None if room.confidence is None else 1.0
    return Said(
        f"the wall that stands in {draft.name(room)} is open for {fitted.length:.2f} m: both sides are one room"
    )


def _on_floor(draft: Draft, strip: Strip, room: DraftRoom, placed: Placed) -> Said:
    """Part a room along a line with a passage in it (R3)."""
    whole, passage, onward = _line_on_floor(draft, strip, room, placed.correction.word)
    rest = shapely.difference(room.shape, whole.polygon(longer_m=STEP_M))
    parts = split_pieces(rest)
    sides = _sides_of(passage, parts)
    if sides[0] is sides[1]:
        parts = split_pieces(_with_slits_shut(rest))
        sides = _sides_of(passage, parts)
    if sides[0] is sides[1]:
        raise PartsNothingError(f"its line parts nothing: {draft.name(room)} goes on around it")
    if small := next((part for part in sides if not may_be_room(part)), None):
        least = f"a room has {SMALLEST_SAID_ROOM_M2} m2 or more"
        raise NoEffectError(f"it would part off {small.area:.1f} m2 only, {least}")
    made = draft.replace_room(room, [part for part in parts if is_room_sized(part) or any(part is s for s in sides)])
    one, other = (next(each for each in made if each.shape is side) for side in sides)
    door = _passage_on(passage, room.shape, (one, other), placed)
    draft.doors.append(door)
    for side in (one, other):
        draft.divide_passages([part for part in made if part is not side])  # walls that end in it part one side of it
    for part in made:
        part.confidence = 1.0 if part.confidence is not None else None
    width = f"{with_article(door.kind)} of {door.width:.2f} m"
    said = Said(f"{width} parts a room into {draft.name(one)} and {draft.name(other)}")
    said.also += describe_narrowing(strip, passage)
    if max(onward) > STEP_M:
        said.also.append(f"a wall of {max(onward[0], 0) + max(onward[1], 0):.2f} m closes its line")
    return said


def _with_slits_shut(floor: BaseGeometry) -> BaseGeometry:
    """Return a floor without the slits that join parts of it and are narrower than any door, as at a wall's end."""
    half = (MIN_DOOR_M - GRID_M) / 2
    core = shapely.buffer(floor, -half, join_style="mitre")
    wide = split_pieces(shapely.buffer(core, half, join_style="mitre"))
    narrow = shapely.get_parts(shapely.difference(floor, shapely.union_all(wide)))
    slits = [part for part in narrow if (shapely.distance(part, wide) < MEETS_M).sum() > 1]
    return shapely.difference(floor, shapely.union_all(slits))


def _line_on_floor(draft: Draft, strip: Strip, room: DraftRoom, word: Word) -> tuple[Strip, Strip, tuple[float, float]]:
    """Return the line from wall to wall, the passage in it, and how far the line goes beyond both ends, metres."""
    if word == "entrance":
        raise NoEffectError(
            f"it lies in {draft.name(room)}, away from its walls; draw it in an outer wall, or say room_outline of "
            "what lies behind it, and door"
        )
    strip = turn_square(strip, room.shape)
    found = extend_to_walls(strip, room.shape)
    if found is None:
        raise PartsNothingError(
            f"it lies in {draft.name(room)}, and its line meets no wall within {ONWARD_M:g} m of both ends; draw it in "
            "a wall, or draw the wall first"
        )
    whole, onward = found
    middle = whole.centre + strip.along * (max(onward[0], 0.0) - max(onward[1], 0.0)) / 2
    return whole, Strip(middle, strip.along, whole.length - sum(max(each, 0.0) for each in onward), whole.depth), onward


def _sides_of(passage: Strip, parts: Sequence[Polygon]) -> tuple[Polygon, Polygon]:
    """Return the parts of a room in front of both faces of a passage."""
    looks = [shapely.Point(passage.before(side, 0.02)) for side in (-1, 1)]
    one, other = (parts[int(np.argmin(shapely.distance(parts, look)))] for look in looks)
    return one, other


def _passage_on(passage: Strip, floor: Polygon, rooms: tuple[DraftRoom, DraftRoom], placed: Placed) -> DraftDoor:
    parts = split_pieces(shapely.intersection(passage.polygon(), floor))
    area = parts[0] if len(parts) == 1 else passage.polygon()  # over a post
    kind = _kind(placed.correction.word, passage.length)
    return DraftDoor(kind, area, passage.ends, rooms, 1.0, said=str(placed.correction))


def part_together(draft: Draft, waiting: Sequence[Placed]) -> dict[int, Said]:
    """Part rooms along several lines that only part them together; return the effects by the number of the line.

    A line that still parts nothing is left out, and the others are tried without it.
    """
    done: dict[int, Said] = {}
    strips = [in_its_wall(draft, strip_of(*placed.points)) for placed in waiting]
    for room in list(draft.rooms):
        lines: dict[int, tuple[Strip, Strip]] = {}
        for number, (strip, placed) in enumerate(zip(strips, waiting, strict=True)):
            if draft.room_at(strip.centre) is room:
                with suppress(NoEffectError):
                    whole, passage, _ = _line_on_floor(draft, strip, room, placed.correction.word)
                    lines[number] = whole, passage
        kept: list[Polygon] = []
        while len(lines) > 1:
            walls = shapely.union_all([whole.polygon(longer_m=STEP_M) for whole, _ in lines.values()])
            rest = shapely.difference(room.shape, walls)
            for floor in (rest, _with_slits_shut(rest)):
                kept = [part for part in split_pieces(floor) if may_be_room(part)]
                idle = [k for k, (_, passage) in lines.items() if len({*map(id, _sides_of(passage, kept))}) == 1]
                if not idle:
                    break
            if not idle:
                break
            lines = {k: line for k, line in lines.items() if k not in idle}
        if len(lines) < 2 or len(kept) < 2:  # two lines or more, two parts or more
            continue
        made = draft.replace_room(room, kept)
        for number, (_, passage) in lines.items():
            one, other = (next(each for each in made if each.shape is side) for side in _sides_of(passage, kept))
            placed = waiting[number]
            draft.doors.append(_passage_on(passage, room.shape, (one, other), placed))
            text = f"{with_article(draft.doors[-1].kind)} of {passage.length:.2f} m parts {draft.name(one)} and "
            done[number] = Said(f"{text}{draft.name(other)}, with the other lines")
        for part in made:
            part.confidence = 1.0 if part.confidence is not None else None
    return done


def remove_passage(draft: Draft, placed: Placed) -> Said:
    """Remove the passage at a point (R5)."""
    place = placed.points[0]
    point = shapely.Point(place)
    door = draft.door_at(place, SNAP_M) or _cut_in_wall_at(draft, place)
    if door is None:
        far = min((float(each.shape.distance(point)) for each in draft.doors), default=math.inf)
        raise NoEffectError(
            f"no passage is there; the nearest is {far:,.2f} m away" if draft.doors else "the plan has none"
        )
    if door.said:
        raise ContradictionError(door.said)
    draft.doors.remove(door)
    far = float(door.shape.distance(point))
    what = "a window" if placed.correction.word == "window" else "wall"
    if what == "a window" and far <= SNAP_M:
        one, other = ((x, y) for x, y in door.ends.tolist())
        ring = shapely.get_coordinates(door.shape.exterior)[:-1]
        draft.windows.append(Door(0, "window", (one, other), round(door.width, 2), ring, (0, None)))
    if door.rooms[1] is not None:  # an entrance says nothing of the ways inside
        draft.denied.append(door.shape)
    where = "there" if far <= SNAP_M else f"in the same wall, {far:.2f} m away,"
    return Said(f"the {door.kind} of {door.width:.2f} m {where} is {what}")


def _cut_in_wall_at(draft: Draft, place: Vector) -> DraftDoor | None:
    """Return the nearest cut through the wall in which a point lies, or None.

    The wall is the one between the same two rooms, along the line of the cut. A cut's place in its wall is arbitrary,
    and another build may have chosen another.
    """
    found = []
    for cut in (door for door in draft.doors if door.kind == "cut"):
        line = strip_of(*cut.ends)
        aside = dot(place - line.centre, line.across)
        if abs(aside) > cut.shape.area / max(cut.width, STEP_M) / 2 + SNAP_M:
            continue
        line = replace(line, centre=place - aside * line.across, length=MIN_DOOR_M)
        beside = faces_beside(line, [room.shape for room in draft.rooms]).shapes
        if {id(draft.rooms[k]) for k in beside if k >= 0} == set(map(id, cut.rooms)):
            found.append(cut)
    return min(found, key=lambda cut: cut.shape.distance(shapely.Point(place)), default=None)
