"""Put doors and windows into the walls of a layout, and a balcony before the living room.

O1  A door stands near a corner, so that it opens against a wall; its width is that of the room that it leads into.
O2  A wide way between day rooms has no leaf and takes the wall but for its ends, or 1.8 to 3.2 m of a long one.
O3  Every room has a window in each outer wall with light that is long enough, on both sides of a door in it; living
    rooms have wide ones. The glass of a habitable room has 1/8 of its floor, as building codes ask, where walls allow.
O4  The first balcony or terrace lies before the living room, often before a bedroom beside it too; any further one
    before bedrooms.
O5  Living room, dining room and hall have glazed doors to a courtyard.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

import numpy as np

from houseexpo.tolerances import SAME_M
from pipeline.sources.homes.level import DOOR_HEAD_M
from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.values import (
    HALL,
    LIT,
    SIDES,
    STAIRS,
    Cell,
    Doorway,
    Join,
    Layout,
    Side,
    Window,
    pick,
)
from pipeline.tolerances import RUN_M

DOORS_M: Final = {
    "Toilet": (0.70, 0.80),
    "Storage": (0.70, 0.80),
    "Wardrobe": (0.70, 0.80),
    "Bathroom": (0.80,),
    "Living_Room": (0.90, 1.00, 1.20),
    "Garage": (0.90,),
}
"""Clear widths of doors by the room that they lead into, metres."""
_DOOR_M: Final = (0.80, 0.90)
FRONT_M: Final = (0.90, 1.00, 1.10)
_JAMB_M: Final = 0.25
_LEAST_JAMB_M: Final = 0.15
"""At the end of a corridor."""
_WIDE_M: Final = (1.8, 3.2)


class _Glazing(NamedTuple):
    """The least and the largest width of a window, its part of the wall, the height of its sill, metres."""

    least_m: float
    most_m: float
    part: float
    sill_m: float


WINDOWS: Final = {
    "Living_Room": _Glazing(1.2, 3.2, 0.6, 0.6),
    "Kitchen": _Glazing(0.8, 1.6, 0.5, 1.05),
    "Dining_Room": _Glazing(1.2, 2.6, 0.6, 0.6),
    "Bathroom": _Glazing(0.5, 0.9, 0.4, 1.2),
    "Toilet": _Glazing(0.4, 0.6, 0.4, 1.2),
    "Storage": _Glazing(0.4, 0.6, 0.4, 1.2),
    "Wardrobe": _Glazing(0.4, 0.6, 0.4, 1.2),
    "Garage": _Glazing(0.6, 1.0, 0.3, 1.2),
    "Hallway": _Glazing(0.5, 1.0, 0.5, 0.9),
    STAIRS: _Glazing(0.5, 1.0, 0.5, 1.2),
}
_WINDOW: Final = _Glazing(1.0, 2.0, 0.5, 0.9)
_BALCONY_BEDS: Final = frozenset({"Bedroom", "Child_Room"})
_SHARED: Final = 0.85
"""How often a balcony goes on before a bedroom, where one lies beside the living room."""
_SHALLOWEST_M: Final = 1.1
_DEEPEST_M: Final = {"Balcony": 2.5, "Terrace": 3.2}
"""The least and the largest depths of rooms outside, metres; a deeper balcony darkens the storey below."""
_BALCONY_WIDTH_M: Final = 1.8
"""The least width of a balcony, metres; smaller ones are deeper."""
_SHARED_M2: Final = 6.0
"""From this area on a balcony goes on before a bedroom."""
_BALCONY_ASPECT: Final = 6.0
_COURT_DOOR_M: Final = 1.0
"""The least width of a glazed door to a courtyard, metres."""
_APART_M: Final = 0.4
"""What is free between two balconies, metres."""
WINDOW_HEAD_M: Final = DOOR_HEAD_M
_GLASS: Final = 0.13
"""The least part of the floor that the windows of a habitable room have: 1/8, and what rounding takes (O3)."""


class Stretch(NamedTuple):
    """A stretch of a cell's side: the side, where it lies across, and from where to where."""

    side: Side
    at: float
    low: float
    high: float


def outer_stretches(cells: tuple[Cell, ...]) -> list[tuple[int, Stretch]]:
    """Return the stretches of the sides of each cell, by its place, at which no other cell lies."""
    return [(place, stretch) for place in range(len(cells)) for stretch in _free_stretches(cells, place)]


def _free_stretches(cells: tuple[Cell, ...], place: int) -> Iterator[Stretch]:
    rect = cells[place].rect
    for k, side in enumerate(SIDES):
        across = k % 2
        at, low, high = rect[k], rect[1 - across], rect[3 - across]
        free = [(low, high)]
        for other, cell in enumerate(cells):
            if other == place or abs(cell.rect[(k + 2) % 4] - at) > SAME_M:
                continue
            one, two = cell.rect[1 - across], cell.rect[3 - across]
            free = [
                part for a, b in free for part in ((a, min(b, one)), (max(a, two), b)) if part[1] - part[0] > SAME_M
            ]
        yield from (Stretch(side, at, a, b) for a, b in free)


def shared_stretches(cells: tuple[Cell, ...], one: int, other: int) -> Iterator[Stretch]:
    """Yield the walls between two rooms, as stretches of the sides of the first room's cells."""
    besides = [cell for cell in cells if cell.room == other]
    for cell in cells:
        if cell.room != one:
            continue
        x1, y1, x2, y2 = cell.rect
        for beside in besides:
            a1, b1, a2, b2 = beside.rect
            if max(x1, a1) > min(x2, a2) + 1e-6 or max(y1, b1) > min(y2, b2) + 1e-6:
                continue
            for k, side in enumerate(SIDES):
                across = k % 2
                if abs(cell.rect[k] - beside.rect[(k + 2) % 4]) < 1e-6:
                    low = max(cell.rect[1 - across], beside.rect[1 - across])
                    high = min(cell.rect[3 - across], beside.rect[3 - across])
                    if high - low > 1e-6:
                        yield Stretch(side, cell.rect[k], low, high)


def rect_in_wall(stretch: Stretch, low: float, high: float, inner_m: float, outer_m: float = 0.0) -> Rect:
    """Return the part of a wall from ``low`` to ``high``; an outer wall lies outwards from its inner face."""
    half = inner_m / 2
    outward = -1.0 if stretch.side in {"west", "south"} else 1.0
    faces = (stretch.at - outward * half, stretch.at + outward * (outer_m - half if outer_m else half))
    a, b = round(min(faces), 4), round(max(faces), 4)
    low, high = round(low, 2), round(high, 2)
    return (a, low, b, high) if stretch.side in {"west", "east"} else (low, a, high, b)


def place_doors(layout: Layout, inner_m: float, rng: np.random.Generator) -> list[Doorway] | None:
    """Return the doors that a layout asks for (O1, O2), or None where a wall is too short for one."""
    doors = []
    for join in layout.joins:
        walls = sorted(shared_stretches(layout.cells, join.one, join.other), key=lambda each: each.low - each.high)
        found = _door_in(walls[0], join, layout.labels[join.other], inner_m, rng) if walls else None
        if found is None and not join.wide:
            return None
        if found is not None:
            doors.append(Doorway(found, (join.one, join.other), is_open=join.wide))
    return doors


def _door_in(wall: Stretch, join: Join, label: str, inner_m: float, rng: np.random.Generator) -> Rect | None:
    low, high = wall.low + inner_m / 2, wall.high - inner_m / 2
    if join.wide:
        width = min(float(rng.uniform(*_WIDE_M)), high - low - 2 * _JAMB_M)
        if width < 0.9:
            return None
        start = (low + high - width) / 2
    else:
        widths = DOORS_M.get(label, _DOOR_M)
        width = pick(widths, rng)
        if high - low < width + 2 * _JAMB_M:
            width = min(*widths, 0.8)
        free = high - low - width
        if free < 2 * _LEAST_JAMB_M:
            return None
        jamb = min(_JAMB_M, free / 2)
        start = low + jamb if rng.random() < 0.5 else high - jamb - width
    return rect_in_wall(wall, start, start + width, inner_m)


def place_front_door(
    layout: Layout, outside: list[tuple[int, Stretch]], inner_m: float, outer_m: float, rng: np.random.Generator
) -> list[Doorway] | None:
    """Return the front door, in the middle of the outer wall at the entrance; None if that is too short."""
    if layout.entrance is None:
        return []
    place, side = layout.entrance
    walls = [each for at, each in outside if at == place and each.side == side]
    wall = max(walls, key=lambda each: each.high - each.low, default=None)
    if wall is None or wall.high - wall.low < FRONT_M[0] + inner_m + 2 * _LEAST_JAMB_M:
        return None
    width = min(pick(FRONT_M, rng), wall.high - wall.low - inner_m - 2 * _LEAST_JAMB_M)
    middle = (wall.low + wall.high) / 2
    return [
        Doorway(
            rect_in_wall(wall, middle - width / 2, middle + width / 2, inner_m, outer_m),
            (layout.cells[place].room, None),
        )
    ]


def place_windows(
    layout: Layout,
    lit: list[tuple[int, Stretch]],
    walls_m: tuple[float, float],
    taken: list[Rect],
    rng: np.random.Generator,
) -> list[Window]:
    """Return the windows (O3) in the outer walls with light, ``lit``, clear of the doors in them, ``taken``."""
    inner_m, outer_m = walls_m
    lengths: dict[int, float] = defaultdict(float)
    for place, wall in lit:
        lengths[place] += wall.high - wall.low
    found = []
    for place, wall in lit:
        x1, y1, x2, y2 = layout.cells[place].rect
        room = layout.cells[place].room
        glazing = WINDOWS.get(layout.labels[room], _WINDOW)
        low, high = wall.low + inner_m / 2 + RUN_M, wall.high - inner_m / 2 - RUN_M
        if high - low < glazing.least_m:
            continue
        width = min(max(glazing.part * (high - low) * float(rng.uniform(0.85, 1.15)), glazing.least_m), glazing.most_m)
        if layout.labels[room] in LIT:
            glass_m2 = _GLASS * (x2 - x1) * (y2 - y1) * (wall.high - wall.low) / lengths[place]
            width = max(width, glass_m2 / (WINDOW_HEAD_M - glazing.sill_m))
        gaps = [gap for gap in _gaps(wall, (low, high), walls_m, taken) if gap[1] - gap[0] >= glazing.least_m]
        free = sum(two - one for one, two in gaps)
        for one, two in gaps:
            part = min(max(width * (two - one) / free, glazing.least_m), two - one)
            start = (one + two - part) / 2
            rect = rect_in_wall(wall, start, start + part, inner_m, outer_m)
            found.append(Window(rect, room, glazing.sill_m, WINDOW_HEAD_M))
    return found


def _gaps(
    wall: Stretch, ends: tuple[float, float], walls_m: tuple[float, float], taken: list[Rect]
) -> list[tuple[float, float]]:
    """Return the parts of an outer wall between two ends that no door in it or in a wall beside it takes."""
    across = SIDES.index(wall.side) % 2
    near, far = rect_in_wall(wall, *ends, *walls_m)[across], rect_in_wall(wall, *ends, *walls_m)[across + 2]
    gaps = [ends]
    for door in taken:
        if door[across] < far + _LEAST_JAMB_M and door[across + 2] > near - _LEAST_JAMB_M:
            one, two = door[1 - across] - _LEAST_JAMB_M, door[3 - across] + _LEAST_JAMB_M
            gaps = [part for a, b in gaps for part in ((a, min(b, one)), (max(a, two), b)) if part[1] > part[0]]
    return gaps


def _is_near(one: Rect, other: Rect, apart_m: float) -> bool:
    """Return whether two rectangles are not farther apart than that."""
    x1, y1, x2, y2 = other
    if one[0] > x2 + apart_m or one[2] < x1 - apart_m or one[1] > y2 + apart_m or one[3] < y1 - apart_m:
        return False
    across, along = max(one[0] - x2, x1 - one[2]), max(one[1] - y2, y1 - one[3])
    return across <= 0 or along <= 0 or math.hypot(across, along) <= apart_m


def place_outdoors(
    layout: Layout,
    lit: list[tuple[int, Stretch]],
    walls_m: tuple[float, float],
    area_m2: float,
    rng: np.random.Generator,
    *,
    others: Iterable[Rect] = (),
    label: str = "Terrace",
    beds: bool = False,
) -> tuple[Rect | None, list[Doorway]] | None:
    """Return the inner rectangle of a room outside (None for none: ``area_m2`` of 0) and the ways out (O4), or None.

    It lies before the living room, or before ``beds``, at an outer wall with light, ``lit``, and apart from ``others``.
    """
    inner_m, outer_m = walls_m
    deepest_m = _DEEPEST_M[label]
    before = _BALCONY_BEDS if beds else {"Living_Room"}
    walls = [(place, wall) for place, wall in lit if wall.high - wall.low > 2.4]
    taken = [(cell.rect, outer_m - inner_m / 2 - 0.01) for cell in layout.cells]
    taken += [(rect, _APART_M) for rect in others]
    for k in rng.permutation(len(walls)).tolist():
        place, wall = walls[k]
        room = layout.cells[place].room
        if layout.labels[room] not in before:
            continue
        beside = [
            (other, each)
            for other, each in walls
            if layout.labels[layout.cells[other].room] in _BALCONY_BEDS
            and (each.side, each.at) == (wall.side, wall.at)
            and (each.high == wall.low or each.low == wall.high)
            and layout.cells[other].room != room
        ]
        shared = beside[0] if area_m2 > _SHARED_M2 and beside and rng.random() < _SHARED else None
        ways = [_way_out(wall, room, walls_m, rng)]
        if not area_m2:
            return None, ways
        low, high = wall.low + inner_m / 2, wall.high - inner_m / 2
        wide = min(high - low, max(area_m2 / 1.6, _BALCONY_WIDTH_M))
        if shared is None:
            start = low if rng.random() < 0.5 else high - wide
            rect = _before(wall, (start, start + wide), area_m2, walls_m, deepest_m)
            ways = [
                _way_out(wall._replace(low=start - inner_m / 2, high=start + wide + inner_m / 2), room, walls_m, rng)
            ]
        else:
            other, each = shared
            ends = sorted((each.low, each.high, wall.low, wall.high))
            rect = _before(wall, (ends[0] + inner_m / 2, ends[-1] - inner_m / 2), area_m2, walls_m, deepest_m)
            ways.append(_way_out(each, layout.cells[other].room, walls_m, rng))
        if not any(_is_near(rect, each, apart_m) for each, apart_m in taken):
            return rect, ways
    return None


def place_courtyard(
    layout: Layout, outside: list[tuple[int, Stretch]], walls_m: tuple[float, float], rng: np.random.Generator
) -> tuple[Rect, list[Doorway]] | None:
    """Return a courtyard's inner rectangle and the ways out (O5), or None if the day room has too little wall there."""
    inner_m, outer_m = walls_m
    court = layout.court or (0.0, 0.0, 0.0, 0.0)
    ways = {}
    for place, wall in sorted(outside, key=lambda each: each[1].high - each[1].low):
        room, k = layout.cells[place].room, (SIDES.index(wall.side) + 2) % 4
        low, high = court[1 - k % 2], court[3 - k % 2]
        faces = wall.at == court[k] and low <= wall.low and wall.high <= high
        wide = wall.high - wall.low > _COURT_DOOR_M + inner_m + 2 * RUN_M
        if faces and wide and (room in {HALL, layout.day_room} or layout.labels[room] == "Dining_Room"):
            ways[room] = _way_out(wall, room, walls_m, rng)
    if layout.day_room not in ways:
        return None
    off = outer_m - inner_m / 2
    x1, y1, x2, y2 = (round(line + way * off, 4) for line, way in zip(court, (1, 1, -1, -1), strict=True))
    return (x1, y1, x2, y2), list(ways.values())


def _before(
    wall: Stretch, ends: tuple[float, float], area_m2: float, walls_m: tuple[float, float], deepest_m: float
) -> Rect:
    """Return the rectangle before an outer wall, from one end to the other."""
    inner_m, outer_m = walls_m
    low, high = (round(end, 2) for end in ends)
    deep = min(max(area_m2 / (high - low), _SHALLOWEST_M, (high - low) / _BALCONY_ASPECT), deepest_m)
    near = outer_m - inner_m / 2
    outward = -1.0 if wall.side in {"west", "south"} else 1.0
    a, b = sorted((round(wall.at + outward * near, 4), round(wall.at + outward * (near + deep), 2)))
    return (a, low, b, high) if wall.side in {"west", "east"} else (low, a, high, b)


def _way_out(wall: Stretch, room: int, walls_m: tuple[float, float], rng: np.random.Generator) -> Doorway:
    """Return a glazed door in an outer wall; it is wide where the wall is long."""
    length = wall.high - wall.low - walls_m[0]
    door = pick((0.9, 1.0) if length < 3.2 else (1.4, 1.6, 1.8), rng)
    start = wall.low + walls_m[0] / 2 + RUN_M
    return Doorway(rect_in_wall(wall, start, start + door, *walls_m), (room, None))
