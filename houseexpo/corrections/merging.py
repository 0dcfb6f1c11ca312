"""Merge rooms that a person says are one, with the passages and walls between them (rules in ``apply``, R5).

M1  Passages between the rooms become floor. If the rooms still lie apart, so does the wall between them, the thinnest
    first: a thicker wall stays where a thinner one joins them.
M2  A wall that a person has drawn stays. If the rooms cannot meet around it, the two words contradict each other.
M3  If the source's walls are known, what the plan has as wall between the rooms, and the source does not show, becomes
    floor: the program had closed the space there. The source's walls stay as stubs in the room.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections.draft import ContradictionError, CorrectedArea, Draft, DraftRoom, NoEffectError, split_pieces
from houseexpo.corrections.openings import MEETS_M, SAID_WALL_M, STEP_M, WALL_REACH_M
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import GRID_M, TILE_M2

_REACHES_M: Final = (WALL_REACH_M / 16, WALL_REACH_M / 8, WALL_REACH_M / 4)
"""Half thicknesses of the walls to remove between rooms that become one, the thinnest first, metres."""
_OVERLAP_M: Final = 1e-6
"""Pieces are joined with this overlap, metres, so that rounding leaves no hairline."""


def merge_rooms(draft: Draft, rooms: Sequence[DraftRoom], text: str, *, gap: Polygon | None = None) -> list[str]:
    """Replace rooms by one room, with the passages and the walls between them, and return sentences on other changes.

    ``text`` is the correction. ``gap`` is the only part of the walls that it removes, if it says which.
    """
    inner = [door for door in draft.inner_doors if all(any(side is room for room in rooms) for side in door.rooms)]
    if said := next((door.said for door in inner if door.said), ""):
        raise ContradictionError(said, "parts them, and")
    whole = shapely.union_all([*(room.shape for room in rooms), *(door.shape for door in inner)])
    whole = whole if gap is None else shapely.union(whole, gap)
    others = [room.shape for room in draft.rooms if all(room is not each for each in rooms)]
    others += [door.shape for door in draft.doors if all(door is not each for each in inner)]
    parts = split_pieces(whole)
    filled = len(parts) > 1
    if filled:
        parts = _join_parts(draft, parts, shapely.union_all(others))
    whole = parts[0]
    shapes = [room.shape for room in rooms]
    unseen = [] if gap is not None else _invented_walls(draft, whole, shapes, shapely.union_all(others))
    if (unseen_m2 := sum(part.area for part in unseen)) > TILE_M2:
        whole = split_pieces(shapely.union_all([whole, *(part.buffer(_OVERLAP_M) for part in unseen)]))[0]
    first = max(rooms, key=lambda room: (room.label != UNLABELLED, room.shape.area))
    words = tuple(dict.fromkeys(word for room in rooms for word in room.words))
    made = DraftRoom(whole, first.label, words, None if first.confidence is None else 1.0, said=text)
    inside = -SAID_WALL_M / 2 - GRID_M  # the seam keeps clear of the merged room's own edge
    seam = shapely.difference(whole.buffer(inside), shapely.union_all([shape.buffer(inside) for shape in shapes]))
    draft.joined.append(CorrectedArea(seam, text))
    place = draft.rooms.index(rooms[0])
    draft.rooms[place] = made
    draft.rooms = [room for room in draft.rooms if all(room is not each for each in rooms)]
    draft.doors = [door for door in draft.doors if all(door is not each for each in inner)]
    for door in draft.doors:
        one_side, other_side = (made if any(side is room for room in rooms) else side for side in door.rooms)
        assert one_side is not None  # noqa: S101  # the first side of a door is a room
        door.rooms = (one_side, other_side)
    also = [f"the {door.kind} of {door.width:.2f} m between them is part of it" for door in inner]
    if filled:
        also.append("the wall between them is gone")
    if unseen_m2 > TILE_M2:
        also.append(f"{unseen_m2:.1f} m2 of wall between them that the source does not show are floor")
    return also


def _join_parts(draft: Draft, parts: list[Polygon], others: BaseGeometry) -> list[Polygon]:
    """Return the parts of a room with the walls between them as floor, in one piece; raise NoEffectError if too far."""
    drawn, said = shapely.union_all([wall.shape for wall in draft.walls]), ""
    for reach in _REACHES_M:
        if len(parts) == 1:
            break
        filling = shapely.difference(_closing(parts, reach), others)
        said = next(
            (wall.said for wall in draft.walls if _pieces_between(wall.shape.intersection(filling), parts)), said
        )
        between = [piece.buffer(_OVERLAP_M) for piece in _pieces_between(shapely.difference(filling, drawn), parts)]
        parts = split_pieces(shapely.union_all([*parts, *between]))
    if len(parts) > 1 and said:
        raise ContradictionError(said, "parts them, and")
    if len(parts) > 1:
        raise NoEffectError(
            f"more than {WALL_REACH_M / 2:g} m of wall stand between them; draw a door or an opening there"
        )
    return parts


def _invented_walls(draft: Draft, whole: Polygon, parts: Sequence[Polygon], others: BaseGeometry) -> list[Polygon]:
    """Return what is wall between the parts of a room, and is none in the source (M3)."""
    if draft.source_walls is None:
        return []
    drawn = [wall.shape for wall in draft.walls]
    between = shapely.difference(_closing([whole], _REACHES_M[-1]), shapely.union_all([others, *drawn]))
    between = shapely.union_all(_pieces_between(between, parts))
    walls = shapely.union_all([wall for wall in draft.source_walls if wall.intersects(between)])
    far = shapely.union_all(split_pieces(shapely.difference(between, shapely.buffer(walls, STEP_M, quad_segs=2))))
    open_ = shapely.union_all(split_pieces(shapely.difference(between, walls)))
    return _pieces_between(shapely.intersection(open_, shapely.buffer(far, STEP_M, quad_segs=2)), parts)


def _closing(parts: Sequence[Polygon], reach_m: float) -> BaseGeometry:
    """Return what lies between parts, or in notches of one, and is at most twice ``reach_m`` wide."""
    whole = shapely.union_all(list(parts))
    closed = whole.buffer(reach_m, join_style="mitre").buffer(-reach_m, join_style="mitre")
    return shapely.union_all(split_pieces(shapely.difference(closed, whole)))


def _pieces_between(filling: BaseGeometry, parts: Iterable[Polygon]) -> list[Polygon]:
    """Return the pieces of a filling that touch several parts."""
    shapes = list(parts)
    return [piece for piece in split_pieces(filling) if sum(piece.distance(shape) < MEETS_M for shape in shapes) > 1]
