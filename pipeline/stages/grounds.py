"""What speaks against a plan: named shares, each 0 where nothing does and 1 where all of it does.

R1  ``cut_share``: inner doors that are cuts, of all inner doors.
R2  ``cut_off_share``: rooms that only cuts lead into.
R3  ``guessed_wall_share``: length of the closers without evidence (gaps, floor edges, wall ends) to that of all walls.
R4  ``guesses``: things that the reader had to guess (levels, units, scale, axis), of ``MOST_GUESSES``.
R5  ``floorless_share``: area of the rooms without the source's floor under it; 0 where the source has no floor.
R6  ``odd_room_share``: rooms too small, too narrow, too large or too ragged for a room.
R7  ``unlike_spaces``: how far the rooms are from those that the source draws, or from as many as it counts.
R8  ``lone_room``: 1 where the plan is one room without an inner door: a shell looks like that.
R9  ``furnished_share``: area of furniture told apart by its shape, of what the rooms and it cover.
"""

from __future__ import annotations

import math
from typing import Final

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import overlap, subtract, united
from pipeline.geometry.regions import OUTSIDE
from pipeline.values import Evidence, Layout, Level, Spaces

MOST_GUESSES: Final = 2
GUESSED: Final = frozenset({"gap", "floor_edge", "wall_ends"})
SMALLEST_M2, LARGEST_M2 = 1.0, 200.0
NARROWEST_M: Final = 0.7
RAGGED: Final = 0.15  # 4 pi area / length of the edge squared; a square has 0.79, a corridor of 1 : 10 has 0.26


def weigh(level: Level, evidence: Evidence, layout: Layout, spaces: Spaces) -> dict[str, float]:
    """Return the grounds by name, each 0 to 1; ``spaces`` are the last, of which the plan is made."""
    inner = [p for p in spaces.passages if not p.leads_outside]
    cuts = [p for p in inner if p.kind == "cut"]
    rooms = united(spaces.rooms)
    return {
        "cut_share": _share(len(cuts), len(inner)),
        "cut_off_share": _cut_off(spaces),
        "guessed_wall_share": _guessed(layout),
        "guesses": _share(len(level.guesses), MOST_GUESSES),
        "floorless_share": 0.0 if level.floor is None else _share(subtract(rooms, level.floor).area, rooms.area),
        "odd_room_share": _share(sum(map(_is_odd, spaces.rooms)), len(spaces.rooms)),
        "unlike_spaces": _unlike(level, spaces.rooms),
        "lone_room": float(len(spaces.rooms) == 1 and not inner),
        "furnished_share": _share(overlap(evidence.furniture, rooms).area, rooms.area),
    }


def _share(part: float, whole: float) -> float:
    return min(part / whole, 1.0) if whole > 0 else 0.0


def _cut_off(spaces: Spaces) -> float:
    """R2."""
    by_evidence = {side for p in spaces.passages if p.kind != "cut" for side in p.bridge.sides}
    by_evidence |= {room for pair in spaces.joins for room in pair}
    by_cut = {side for p in spaces.passages if p.kind == "cut" for side in p.bridge.sides} - by_evidence - {OUTSIDE}
    return _share(len(by_cut), len(spaces.rooms))


def _guessed(layout: Layout) -> float:
    """R3: a closer is about as long as half of its edge."""
    guessed = sum(closer.polygon.length / 2 for closer in layout.closers if closer.kind in GUESSED)
    return _share(guessed, layout.ground.length / 2)


def _is_odd(room: Polygon) -> bool:
    """R6."""
    if not SMALLEST_M2 <= room.area <= LARGEST_M2:
        return True
    ragged = 4 * math.pi * room.area / room.length**2 < RAGGED
    return ragged or bool(room.buffer(-NARROWEST_M / 2).is_empty)


def _unlike(level: Level, rooms: tuple[Polygon, ...]) -> float:
    """R7."""
    drawn = [room.polygon for room in level.rooms if room.polygon is not None]
    if drawn:
        return 1.0 - sum(_best(space, rooms) for space in drawn) / len(drawn)
    if not level.room_count:
        return 0.0
    return _share(abs(len(rooms) - level.room_count), max(len(rooms), level.room_count))


def _best(space: BaseGeometry, rooms: tuple[Polygon, ...]) -> float:
    """Intersection over union with the room that fits best."""
    found = [rooms[k] for k in shapely.STRtree(rooms).query(space, predicate="intersects")]
    return max((space.intersection(r).area / space.union(r).area for r in found), default=0.0)
