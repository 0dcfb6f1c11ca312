"""Change the rooms of a draft: ``wall``, ``room``, ``no_room``, ``one_room``, ``label`` (rules in ``apply``)."""

from __future__ import annotations

import shapely

from houseexpo.corrections.draft import Draft, DraftRoom, Vector, is_room_sized, split_pieces
from houseexpo.corrections.openings import (
    PARTITION_M,
    SNAP_M,
    WALL_REACH_M,
    Strip,
    squared,
    strip_of,
)
from houseexpo.corrections.passages import free_part, with_article
from houseexpo.corrections.saying import AlreadySoError, NoEffectError, Placed, Said
from houseexpo.tolerances import ROUNDED_M2


def place_wall(draft: Draft, placed: Placed) -> Said:
    """Place a wall (R4)."""
    strip = strip_of(*placed.points, depth_m=PARTITION_M)
    crossed = [room for room in draft.rooms if room.shape.intersects(shapely.LineString(strip.ends))]
    if not crossed:
        far = draft.distance_to_rooms(strip.centre)
        if far > WALL_REACH_M:
            raise NoEffectError(f"it lies {far:,.1f} m from the nearest room")
        raise AlreadySoError("no floor is there: it lies in a wall already")
    strip = squared(strip, crossed[0].shape)
    starts, ends = strip.ends
    edge = shapely.union_all([room.shape.boundary for room in crossed])
    reach = []
    for end, way in ((starts, -strip.along), (ends, strip.along)):  # a free end snaps to the wall before it
        ray = shapely.LineString([end, end + way * SNAP_M])
        hit = shapely.intersection(ray, edge)
        reach.append(0.0 if hit.is_empty else float(shapely.Point(end).distance(hit)) + PARTITION_M)
    low, high = -strip.length / 2 - reach[0], strip.length / 2 + reach[1]
    whole = Strip(strip.centre + strip.along * (low + high) / 2, strip.along, high - low, PARTITION_M)
    area, also, taken = whole.polygon(), list[str](), 0.0
    for room in crossed:
        lost = shapely.intersection(room.shape, area).area
        if lost < ROUNDED_M2:
            continue
        taken += lost
        parts = split_pieces(shapely.difference(room.shape, area))
        kept = [part for part in parts if is_room_sized(part)] or parts[:1]
        if len(kept) > 1:
            made = draft.replace_room(room, kept)
            also.append("it parts a room into " + " and ".join(draft.name(each) for each in made))
        else:
            made = [room]
            room.change(kept[0])
        for each in made:
            each.confidence = None if each.confidence is None else 1.0
    if not taken:
        raise AlreadySoError("no floor is there: it lies in a wall already")
    shut = [door for door in draft.doors if shapely.intersection(door.shape, area).area > door.shape.area / 2]
    draft.doors = [door for door in draft.doors if all(door is not each for each in shut)]
    also += [f"the {door.kind} of {door.width:.2f} m there is shut" for door in shut]
    return Said(f"a wall of {strip.length:.2f} m stands there", also)


def add_room(draft: Draft, placed: Placed) -> Said:
    """Make a room of a space (R6)."""
    place = placed.points[0]
    if (there := draft.room_at(place)) is not None:
        there.confidence = None if there.confidence is None else 1.0
        raise AlreadySoError(f"{draft.name(there)} is there already")
    point = shapely.Point(place)
    free = [free_part(draft, space.shape) for space in draft.spaces if space.shape.covers(point)]
    shape = next((each for each in free if each is not None and each.covers(point) and is_room_sized(each)), None)
    if shape is None:
        raise NoEffectError(
            f"no closed space between walls is known there; the nearest room is "
            f"{draft.distance_to_rooms(place):,.1f} m away"
        )
    room = DraftRoom(shape, confidence=1.0)
    draft.rooms.append(room)
    return Said(f"the space of {shape.area:.1f} m2 there is a room")


def _room_there(draft: Draft, place: Vector) -> DraftRoom:
    room = draft.room_at(place)
    if room is not None:
        return room
    if (door := draft.door_at(place, 0.0)) is not None:
        raise NoEffectError(f"the point lies in {with_article(door.kind)}; choose one in a room")
    raise NoEffectError(f"no room is there; the nearest is {draft.distance_to_rooms(place):,.2f} m away")


def remove_room(draft: Draft, placed: Placed) -> Said:
    """Take a room out (R6)."""
    room = _room_there(draft, placed.points[0])
    if len(draft.rooms) == 1:
        raise NoEffectError("it is the only room of the plan; drop the plan if it is no house")
    before = {id(door) for door in draft.doors}
    gone = [door for door in draft.doors if any(side is room for side in door.rooms)]
    kinds = {id(door.shape): door.kind for door in gone}
    if said := next((door.said for door in gone if door.said and door.rooms[1] is None), ""):
        raise NoEffectError(f"{said} leads into it, and is said too; take one of the two out")
    text = f"{draft.name(room)} is no room"
    draft.remove_room(room, open_outside=True)
    outside = [door for door in draft.doors if id(door) not in before]
    also = [f"its {kinds[id(door.shape)]} of {door.width:.2f} m leads outside now" for door in outside]
    shut = len(gone) - len(also)
    if shut:
        also.append(f"{shut} of its passages {'are' if shut > 1 else 'is'} gone")
    return Said(text, also)


def join_rooms(draft: Draft, placed: Placed) -> Said:
    """Make several rooms one (R5)."""
    rooms = list({id(room): room for room in (_room_there(draft, place) for place in placed.points)}.values())
    if len(rooms) == 1:
        raise AlreadySoError("the points lie in one room already")
    inner = [door for door in draft.inner_doors if all(any(side is room for room in rooms) for side in door.rooms)]
    if said := next((door.said for door in inner if door.said), ""):
        raise NoEffectError(f"{said} parts them, and is said too; take one of the two out")
    whole = shapely.union_all([room.shape for room in rooms] + [door.shape for door in inner])
    others = [room.shape for room in draft.rooms if all(room is not each for each in rooms)]
    others += [door.shape for door in draft.doors if all(door is not each for each in inner)]
    parts = split_pieces(whole)
    filled = len(parts) > 1
    if filled:
        reach = WALL_REACH_M / 4
        closed = whole.buffer(reach, join_style="mitre").buffer(-reach, join_style="mitre")
        whole = shapely.union_all([whole, shapely.difference(closed, shapely.union_all(others))])
        parts = split_pieces(whole)
    if len(parts) > 1:
        raise NoEffectError(
            f"more than {WALL_REACH_M / 2:g} m of wall stand between them; draw a door or an opening there"
        )
    text = "one room are now " + " and ".join(draft.name(room) for room in rooms)
    first = max(rooms, key=lambda room: (room.label != "Unlabelled", room.shape.area))
    words = tuple(dict.fromkeys(word for room in rooms for word in room.words))
    made = DraftRoom(parts[0], first.label, words, None if first.confidence is None else 1.0)
    place = draft.rooms.index(rooms[0])
    draft.rooms[place] = made
    draft.rooms = [room for room in draft.rooms if all(room is not each for each in rooms)]
    draft.doors = [door for door in draft.doors if all(door is not each for each in inner)]
    for door in draft.doors:
        one, other = (made if any(side is room for room in rooms) else side for side in door.rooms)
        assert one is not None  # noqa: S101  # the first side of a door is a room
        door.rooms = (one, other)
    also = [f"the {door.kind} of {door.width:.2f} m between them is part of it" for door in inner]
    if filled:
        also.append("the wall between them is gone")
    return Said(text, also)


def name_room(draft: Draft, placed: Placed) -> Said:
    """Name a room (R6)."""
    room, label = _room_there(draft, placed.points[0]), placed.correction.value[2]
    if room.label == label:
        raise AlreadySoError(f"{draft.name(room)} has this label already")
    text = f"{draft.name(room)} is called {label} now"
    room.label, room.words = label, ()  # the source's words name it no more
    return Said(text)
