"""Lay out the rooms of a programme: a corridor first, then rows of rooms along it, and the day rooms at its end.

The method is a corridor-first subdivision with random restarts (``home`` judges the tries). ::

      north row    | bedroom | bedroom | bedroom |  living   |
      corridor     | ------------ hall --------- |  room     |
      south row    | bath | wc | entry | bedroom |  kitchen  |

L1  The corridor runs along x. Rows of rooms lie north and south of it; a studio has none in the south.
L2  The living room ends the corridor in the east. It takes the whole depth of the home (``whole``), or that of the
    north row and the corridor (``beside``), or that of the north row alone (``behind``); then kitchen and dining room
    lie south of it. Where a dining room lies at the corridor's end (``behind``) one goes through it to the living room.
L3  A south row without light holds what needs none: bath, toilet, store, entry; it is shallow then.
L4  In the west a bedroom ends the corridor, and its own bath or a longer bedroom lies across from it; or the front
    door; or a store. A door may part the entry from the corridor, or a vestibule from the entry.
L5  Rows are stretched to one length; one that is much shorter leaves a recess in flats, and where the house
    stands free.
L6  Wet rooms lie side by side; the kitchen lies next to the living room or the dining room.
L7  A garage stands before the house beside the entry, which comes forward as far as its door needs.
L8  A house that stands free may have a patio between the bedrooms and the day rooms, open to the north.
L9  A bedroom may lie off the living room, in the corner beside kitchen and dining room. One that lies at the corridor
    has its door there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.limits import LIMITS, distance_from_wishes
from pipeline.sources.sound_homes.openings import shared_stretches
from pipeline.sources.sound_homes.values import ENTRYWAY, HALL, OUTDOORS, Cell, Join, Layout, Programme, Side, pick

_FREE: Final = frozenset({"bungalow"})
_SLEEP: Final = frozenset({"Bedroom", "Child_Room", "Office"})
_BEDS: Final = _SLEEP - {"Office"}
_STORES: Final = frozenset({"Storage", "Wardrobe"})
_FLATS: Final = frozenset({"flat", "shared flat"})
"""In a block, the entry may lie back behind a part of the common stairs."""
_LEAST_M: Final = {
    "Toilet": 1.0,
    "Storage": 1.0,
    "Bathroom": 1.48,
    "Wardrobe": 1.3,
    "Kitchen": 1.77,
    "Dining_Room": 2.5,
    "Office": 2.5,
    "Living_Room": 3.3,
}
"""The least width of a room in a row, metres; of a bedroom it is ``_BED_M``."""
_BED_M: Final = 2.75
_FIXED: Final = frozenset({"Toilet", "Storage", "Bathroom"})
_ENTRY_M: Final = (1.2, 1.4)
_VESTIBULE_M: Final = (1.4, 1.75)
_SMALL_VESTIBULES: Final = 0.6
"""The depth of a small vestibule, before a part of the hall, and how often one that does not lie back is so small."""
_NORTH_M: Final = {"studio": (2.6, 3.3), "whole": (3.5, 4.7), "beside": (3.5, 4.7), "behind": (3.4, 4.12)}
"""The depth of the north row, by where the day rooms lie."""
_PATIO_M: Final = (2.8, 4.2)
_PATIOS: Final = 0.4
_STRETCH: Final = 0.5
"""By how much of their width columns may be stretched so that two rows are as long (L5)."""
_ALIKE: Final = 0.12
"""Logarithm of the ratio of the lengths of rows that are alike before they are stretched."""
_FORMS: Final = 100
"""So many forms are drawn of one home at most."""
_FIRST_FORMS: Final = 20
"""So many are drawn of a home whose rooms keep their limits in none of them."""
_OFF_LIVING: Final = 0.95
"""How often a try has a bedroom off the living room where the programme asks for one; the others fit more often."""
_SPARE_M: Final = 0.2
"""What a living room above the day rooms is deeper than its aspect asks for: their walls make it longer."""
_RECESS_M: Final = (1.6, 4.5)
_EAT_IN_M2: Final = 9.5
"""Where people can eat in the kitchen, it may be the way to the living room (L2)."""
CONTACT_M: Final = 1.1
"""What a door and its jambs take of a wall between two rooms, metres."""
_PORCH_M: Final = (0.6, 1.9)
PORCH_WIDTH_M: Final = 1.05
"""What is free between the outer walls beside a front door that lies back."""
_LEAST_ENTRY_M: Final = 1.2
"""The least depth of an entry that lies back."""
_WC_M: Final = (1.0, 1.25)
_WC_AT_HALL_M: Final = (1.2, 1.35)
_WC_DEPTH_M: Final = (1.5, 1.6)
"""The clear widths of a toilet; beside a vestibule it is wide enough for a door to the corridor. And its depth."""
_DEEPEST_STORE_M: Final = 2.2
"""The largest depth of a store at the corridor's end, metres (L4)."""
_LEAST_STORE_M2: Final = 1.05
"""The area of a cupboard there; on the grid of 1 cm it stays above the least of a store."""
_CUPBOARDS: Final = 0.45
"""How often it is a cupboard."""
_SMALL_STORE_M2: Final = 1.8
"""A store that asks for less takes the place of a wardrobe behind the toilet."""


Day: TypeAlias = Literal["whole", "beside", "behind"]
"""Where the day rooms lie (L2)."""
_DAYS: Final[dict[str, dict[Day, float]]] = {
    "dining": {"behind": 0.95, "beside": 0.05},
    "eat-in": {"whole": 0.9, "beside": 0.1},
    "small": {"whole": 0.55, "beside": 0.45},
}
"""The shares of these with a dining room, a kitchen to eat in, or neither; a kitchen alone is too short for a living
room behind it."""


@dataclass
class Column:
    """A piece of a row: rooms from the corridor outwards, each with its share of the depth; a width, metres.

    It may be stretched, or become narrower by its slack (L5).
    """

    rooms: list[int]
    shares: list[float]
    width_m: float
    stretches: bool = True
    slack_m: float = 0.0


@dataclass
class Rooms:
    """The programme's rooms by their use; numbers count from 1, the hall is 0."""

    labels: list[str]
    areas: list[float]
    behind: dict[int, int] = field(default_factory=dict)

    def of(self, label: str) -> list[int]:
        """Return the rooms of a label that no other room alone leads to."""
        if label not in self.labels:
            return []
        return [k for k, each in enumerate(self.labels) if each == label and k not in self.behind]

    def has_store(self) -> bool:
        """Return whether there is a store or a wardrobe; a storey needs one."""
        return not _STORES.isdisjoint(self.labels)

    def add(self, label: str, area_m2: float) -> int:
        """Add a room; return its number."""
        self.labels.append(label)
        self.areas.append(area_m2)
        return len(self.labels) - 1


def _rooms(programme: Programme) -> Rooms:
    wishes = [each for each in programme.rooms if each.label not in OUTDOORS]
    behind = {k: each.behind + 1 for k, each in enumerate(wishes, 1) if each.behind is not None}
    return Rooms(["Hallway", *(each.label for each in wishes)], [0.0, *(each.area_m2 for each in wishes)], behind)


def draw_days(programme: Programme, rng: np.random.Generator) -> list[Day]:
    """Return where the day rooms may lie, first what the home is to have (L2)."""
    if programme.kind == "studio":
        return ["whole"]
    rooms = _rooms(programme)
    eats = "eat-in" if rooms.areas[rooms.of("Kitchen")[0]] > _EAT_IN_M2 else "small"
    shares = _DAYS["dining" if rooms.of("Dining_Room") else eats]
    days = list(shares)
    return [days[k] for k in rng.choice(len(days), len(days), replace=False, p=list(shares.values())).tolist()]


def lay_out_rooms(programme: Programme, day: Day, rng: np.random.Generator) -> Iterator[Layout]:
    """Yield layouts whose rooms keep their limits; there are none where none of the first forms has one."""
    found = 0
    for tried in range(_FORMS):
        if tried == _FIRST_FORMS and not found:
            return
        layout = _lay_out_form(programme, day, rng)
        if layout is not None:
            found += 1
            yield layout


def _lay_out_form(programme: Programme, day: Day, rng: np.random.Generator) -> Layout | None:
    """Return one try of a layout, or None if the rooms do not fit together or break a limit."""
    rooms = _rooms(programme)
    form = _draw_form(programme, rooms, day, rng)
    rows = _share_out(rooms, form, rng)
    start = _fit(rows, form)
    placed = None if start is None else _place(rooms, rows, form, start, rng)
    if placed is None:
        return None
    cells, entrance = tuple(placed[0]), placed[1]
    if distance_from_wishes(rooms.labels, rooms.areas, cells, programme) is None:
        return None
    return Layout(tuple(rooms.labels), tuple(rooms.areas), cells, tuple(_joins(rooms, cells, form)), entrance)


class _Form(NamedTuple):
    """What a try chooses first; depths reach to centre lines of walls, metres.

    ``bump_m`` is how far the living room comes forward in the north and in the south. ``patio_m`` is the width of a
    patio in the north row (L8). ``through`` says that one goes to the living room through the kitchen or the dining
    room where that is possible. ``off_living`` is the bedroom that lies off the living room (L9).
    """

    north_m: float
    corridor_m: float
    south_m: float
    wall_m: float
    day: Day
    kitchen: Literal["north", "south", "day"]
    service: bool
    entry: bool
    entry_m: float
    ends_in_bedroom: bool
    recess: bool
    porch: bool
    vestibule: bool
    open: bool
    through: bool
    off_living: int | None
    bump_m: tuple[float, float]
    patio_m: float

    @property
    def day_south_m(self) -> float:
        """The depth of the rooms south of the living room."""
        return {"whole": 0.0, "beside": self.south_m, "behind": self.south_m + self.corridor_m}[self.day]

    @property
    def height_m(self) -> float:
        return self.north_m + self.corridor_m + self.south_m


def _draw_form(programme: Programme, rooms: Rooms, day: Day, rng: np.random.Generator) -> _Form:
    kind, light, wall = programme.kind, programme.light, programme.inner_m
    studio, free = kind == "studio", kind in _FREE
    lit = "south" in light
    eats_south = day == "beside" and bool(rooms.of("Dining_Room"))
    service = not lit or (not eats_south and day != "behind" and bool(rng.random() < 0.5))  # L3
    north = float(rng.uniform(*_NORTH_M["studio" if studio else day])) + wall
    south = 0.0 if studio else float(rng.uniform(1.8, 2.4) if service else rng.uniform(2.6, 3.3)) + wall
    off_living = _bedroom_off_living(programme, rooms, day, rng)
    if day == "behind":
        below = [*rooms.of("Dining_Room"), *rooms.of("Kitchen"), *([] if off_living is None else [off_living])]
        north = _depth_of_living(rooms, below, south + programme.hall_m) + wall
    ends_in_bedroom = bool(rooms.behind) or (not studio and kind != "practice" and rng.random() < 0.75)
    entry = not studio and (
        ends_in_bedroom or bool(rooms.of("Garage") or (rooms.of("Toilet") and not service) or rng.random() < 0.5)
    )
    kitchen: Literal["north", "south", "day"] = "day"
    if day == "whole":
        kitchen = "north" if studio or not lit or rng.random() < 0.3 else "south"
    may_lie_back = (free and not service) or (kind in _FLATS and (service or not _small_stores(rooms)))
    porch = may_lie_back and bool(rng.random() < 0.9)
    bumps = (0.0, 0.0, 0.9, 1.4) if free else (0.0,)
    return _Form(
        north_m=north,
        corridor_m=programme.hall_m + wall,
        south_m=south,
        wall_m=wall,
        day=day,
        kitchen=kitchen,
        service=service,
        entry=entry,
        entry_m=PORCH_WIDTH_M + 2 * programme.outer_m if porch else float(rng.uniform(*_ENTRY_M)) + wall,
        ends_in_bedroom=ends_in_bedroom,
        recess=(free or kind in _FLATS) and bool(rng.random() < 0.5),
        porch=porch,
        vestibule=programme.vestibule,
        open=kind != "practice" and (studio or bool(rng.random() < 0.8)),
        through=day == "behind" or bool(rng.random() < 0.9),
        off_living=off_living,
        bump_m=(pick(bumps, rng), 0.0 if rooms.of("Garage") else pick(bumps, rng)),
        patio_m=float(rng.uniform(*_PATIO_M)) if free and rng.random() < _PATIOS else 0.0,
    )


def _bedroom_off_living(programme: Programme, rooms: Rooms, day: Day, rng: np.random.Generator) -> int | None:
    """Return the bedroom that lies off the living room (L9), if any."""
    beds = [room for label in sorted(_BEDS) for room in rooms.of(label) if room not in rooms.behind.values()]
    others = len(beds) > 1
    lit = programme.light & {"south", "east"}
    if day == "whole" or not (programme.off_living and beds and others and lit) or rng.random() >= _OFF_LIVING:
        return None
    return pick(beds, rng)


def _depth_of_living(rooms: Rooms, below: list[int], day_m: float) -> float:
    """Return the depth of a living room that is as long as the rooms ``below``, of the clear depth ``day_m``, m."""
    (living,) = rooms.of("Living_Room")
    length = sum(max(rooms.areas[room] / day_m, _LEAST_M.get(rooms.labels[room], _BED_M)) for room in below)
    least, most = _NORTH_M["behind"]
    return min(max(rooms.areas[living] / length, least, length / LIMITS["Living_Room"].aspect + _SPARE_M), most)


@dataclass
class _Rows:
    """The columns of the rows, west to east; ``day`` are those south of the living room, which is a column too."""

    north: list[Column]
    south: list[Column]
    day: list[Column]
    living: Column


@cache
def _two_rows(number: int) -> list[tuple[bool, ...]]:
    """Return all ways to put so many rooms into two rows: whether each lies in the south."""
    return [way[::-1] for way in product((False, True), repeat=number)]


def _share_out(rooms: Rooms, form: _Form, rng: np.random.Generator) -> _Rows:
    """Share the rooms out among the rows; rooms to sleep and work in go where there is place (L5)."""

    def column(room: int, depth_m: float) -> Column:
        label, deep = rooms.labels[room], depth_m - form.wall_m
        least = max(_LEAST_M.get(label, _BED_M), deep / LIMITS[label].aspect)
        width = max(rooms.areas[room] / deep, least)
        is_fixed = label in _FIXED
        return Column([room], [1.0], width + form.wall_m, not is_fixed, 0.0 if is_fixed else width - least)

    kitchen = rooms.of("Kitchen")[0]
    below = [*rooms.of("Dining_Room"), kitchen] if form.kitchen == "day" else []
    if form.day == "beside" and rng.random() < 0.3:
        below.reverse()
    below += [] if form.off_living is None else [form.off_living]
    rows = _Rows(
        [],
        [],
        [column(room, form.day_south_m) for room in below],
        column(rooms.of("Living_Room")[0], form.height_m - form.day_south_m),
    )
    if not form.south_m:
        inside = [*rooms.of("Bathroom"), *rooms.of("Storage"), kitchen]
        rows.north = [column(room, form.north_m) for room in inside]
        return rows
    wet = _wet_columns(rooms, form, column, rng)
    entry = _entry_columns(rooms, form, rng)
    groups = [[*entry, *wet[::-1]] if rng.random() < 0.5 else [*wet, *entry]]
    masters = sorted(set(rooms.behind.values()))
    end_m = form.north_m + (form.corridor_m if form.ends_in_bedroom else 0.0)
    rows.north = [column(room, form.north_m if k else end_m) for k, room in enumerate(masters)]
    own = [column(room, form.south_m) for room in sorted(rooms.behind)]
    ends = [kitchen] if form.kitchen == "north" else []
    last = [column(room, form.north_m) for room in ends]
    if form.patio_m:
        last.insert(0, Column([], [], form.patio_m, False))
    east = [column(kitchen, form.south_m)] if form.kitchen == "south" else []

    def length(columns: Iterable[Column]) -> float:
        return sum(each.width_m for each in columns)

    one = length([*rows.north, *last]) + (rows.living.width_m if form.day == "beside" else 0.0)
    other = length([*own, *groups[0], *east]) + (length(rows.day) if form.day == "beside" else 0.0)
    sleep = [room for label in sorted(_SLEEP) for room in rooms.of(label) if room not in {*masters, form.off_living}]
    sleep = rng.permutation(sleep).tolist()
    places = [(column(room, form.north_m), column(room, form.south_m)) for room in sleep]
    ways = [(False,) * len(sleep)] if form.service else _two_rows(len(sleep))
    widths = [(up.width_m, down.width_m) for up, down in places]
    for (up, down), low in zip(places, _draw_way(ways, widths, (one, other), rng), strict=True):
        if low:
            groups.append([down])
        else:
            rows.north.append(up)
    if rows.north and not masters:
        rows.north[0] = column(rows.north[0].rooms[0], end_m)
    rows.north += last
    order = rng.permutation(len(groups)).tolist()
    if form.ends_in_bedroom and not own:  # a room below that bedroom reaches beyond it to the corridor
        order.sort(key=lambda k: -groups[k][0].width_m if k else 0.0)
    rows.south = [*own, *(each for k in order for each in groups[k]), *east]
    return rows


def _draw_way(
    ways: list[tuple[bool, ...]],
    widths: list[tuple[float, float]],
    taken: tuple[float, float],
    rng: np.random.Generator,
) -> tuple[bool, ...]:
    """Return a way to put rooms of the given widths into two rows that makes the rows nearly as long as any way does.

    ``widths`` are those in the north and in the south, ``taken`` what other rooms take of the two rows.
    """

    def unlike(in_south: tuple[bool, ...]) -> float:
        north, south = taken
        for (up, down), low in zip(widths, in_south, strict=True):
            if low:
                south += down
            else:
                north += up
        return abs(math.log(max(north, 1.0) / max(south, 1.0)))

    unlikes = [unlike(way) for way in ways]
    most = max(_ALIKE, min(unlikes))
    return pick([way for way, value in zip(ways, unlikes, strict=True) if value <= most], rng)


def _entry_columns(rooms: Rooms, form: _Form, rng: np.random.Generator) -> list[Column]:
    """Return the column of the entry: a part of the hall, a vestibule, or a vestibule before a part of the hall."""
    if not form.entry:
        return []
    if not form.vestibule:
        return [Column([HALL], [1.0], form.entry_m, False)]
    room = rooms.add(ENTRYWAY, 0.0)
    if form.porch or rng.random() >= _SMALL_VESTIBULES:
        return [Column([room], [1.0], form.entry_m, False)]
    share = min((float(rng.uniform(*_VESTIBULE_M)) + form.wall_m) / form.south_m, 1.0)
    return [Column([HALL, room], [1 - share, share], form.entry_m, False)]


def _small_stores(rooms: Rooms) -> list[int]:
    return [room for room in rooms.of("Storage") if rooms.areas[room] < _SMALL_STORE_M2]


def _wet_columns(
    rooms: Rooms, form: _Form, column: Callable[[int, float], Column], rng: np.random.Generator
) -> list[Column]:
    """Return bath, toilet and store side by side (L6); in a deep row a wardrobe or small store lies behind a toilet."""
    columns = [column(room, form.south_m) for room in rooms.of("Bathroom")]
    toilets, stores = rooms.of("Toilet"), rooms.of("Storage")
    if toilets and form.entry and not form.service:
        wide = float(rng.uniform(*(_WC_AT_HALL_M if form.vestibule else _WC_M))) + form.wall_m
        small = _small_stores(rooms)
        if form.porch or (rooms.has_store() and not small):
            return [
                *columns,
                *(column(room, form.south_m) for room in stores),
                Column([toilets[0]], [1.0], wide, False),
            ]
        share = min(float(rng.uniform(*_WC_DEPTH_M)) / form.south_m, 0.75)
        stores = [room for room in stores if room not in small]
        closet = small[0] if small else rooms.add("Wardrobe", 0.0)
        columns += [column(room, form.south_m) for room in stores]
        return [
            *columns,
            Column([toilets[0], closet], [share, 1 - share], wide, False),
        ]
    return [*columns, *(column(room, form.south_m) for room in [*toilets, *stores])]


def _fit(rows: _Rows, form: _Form) -> float | None:
    """Stretch the rows to one length (L5); return where the south row starts, or None if they are too unlike."""
    beside, behind = form.day == "beside", form.day == "behind"
    north = [*rows.north, *([rows.living] if beside else [])]
    south = [*rows.south, *(rows.day if beside else [])]
    one, other = (sum(column.width_m for column in row) for row in (north, south))
    start = 0.0
    if form.south_m:
        if form.recess and _RECESS_M[0] < one - other < _RECESS_M[1]:
            start = one - other
        elif not _stretch(north, south):
            return None
    if behind and not _stretch([rows.living], rows.day):
        return None
    return start


def _stretch(one: list[Column], other: list[Column]) -> bool:
    """Stretch and compress the columns of two rows, so that both are as long; return whether they are."""
    rows = one, other
    lengths = [sum(column.width_m for column in row) for row in rows]
    slacks = [sum(column.slack_m for column in row) for row in rows]
    frees = [sum(column.width_m for column in row if column.stretches) for row in rows]
    least = max(length - slack for length, slack in zip(lengths, slacks, strict=True))
    most = min(length + _STRETCH * free for length, free in zip(lengths, frees, strict=True))
    if least > most:
        return False
    goal = min(max(math.sqrt(lengths[0] * lengths[1]), least), most)
    for row, length, slack, free in zip(rows, lengths, slacks, frees, strict=True):
        for column in row:
            if goal < length:
                column.width_m += column.slack_m * (goal - length) / slack
            elif column.stretches and free:
                column.width_m *= 1 + (goal - length) / free
    return True


def _place(
    rooms: Rooms, rows: _Rows, form: _Form, start: float, rng: np.random.Generator
) -> tuple[list[Cell], tuple[int, Side]] | None:
    """Turn columns into cells, add the corridor, and say where the front door is."""
    low, high, top = form.south_m, form.south_m + form.corridor_m, form.height_m
    cells: list[Cell] = []
    x = west = 0.0
    if not rows.north or not rows.north[0].rooms:
        return None
    if form.ends_in_bedroom:  # L4
        west = _bedroom_end_m(rooms, rows, form, start)
        if rooms.behind and not west:
            return None
    for place, column in enumerate(rows.north):
        put_column(cells, column, (x, low if west and not place else high, x + column.width_m, top), up=True)
        x += column.width_m
    living = rows.living.rooms[0]
    day, end = x, x + rows.living.width_m
    north_bump, south_bump = form.bump_m
    bottom = form.day_south_m if form.day != "whole" else -south_bump
    cells.append(Cell((day, bottom, end, top + north_bump), living))
    entrance: tuple[int, Side] = (-1, "west")
    x = start
    forward = _forward_m(rooms, form, rng)
    for column in rows.south:
        is_entry = rooms.labels[column.rooms[0]] in {"Hallway", ENTRYWAY}
        lies_back = forward < 0 and not form.service and rooms.labels[column.rooms[0]] == "Toilet"
        bottom = -forward if is_entry or lies_back else 0.0
        put_column(cells, column, (x, bottom, x + column.width_m, low), up=False)
        if is_entry:
            entrance = (len(cells) - 1, "south")
            if rooms.of("Garage"):
                cells.append(_garage(rooms, (x, x + column.width_m), rng))
        x += column.width_m
    x = x if form.day == "beside" else day
    for column in rows.day:
        put_column(cells, column, (x, -south_bump, x + column.width_m, form.day_south_m), up=False)
        x += column.width_m
    if not west and form.entry and not rooms.has_store():
        west = _store_m(rows, form, start, rng)
        if west:
            cells.append(Cell((0.0, low, west, high), rooms.add("Storage", 0.0)))
    if not form.entry:
        entrance = (len(cells), "west")
    if day - west < form.corridor_m:
        return None
    cells.append(Cell((west, low, day, high), HALL))
    return cells, entrance


def _bedroom_end_m(rooms: Rooms, rows: _Rows, form: _Form, start: float) -> float:
    """Return where the corridor ends at a bedroom; 0 where that would part a room from the corridor (L4)."""
    west, x = rows.north[0].width_m, start
    if rooms.labels[rows.north[0].rooms[0]] not in _SLEEP:
        return 0.0
    for column in rows.south:
        end = x + column.width_m
        if column.rooms[0] not in rooms.behind and end - max(x, west) < min(CONTACT_M + form.wall_m, column.width_m):
            return 0.0
        x = end
    return west


def put_column(cells: list[Cell], column: Column, rect: Rect, *, up: bool) -> None:
    """Add the cells of a column in a rectangle, from its corridor ``up`` or down."""
    x1, y1, x2, y2 = rect
    at = y1 if up else y2
    for room, share in zip(column.rooms, column.shares, strict=True):
        depth = share * (y2 - y1)
        after = at + depth if up else at - depth
        cells.append(Cell((x1, min(at, after), x2, max(at, after)), room))
        at = after


def _forward_m(rooms: Rooms, form: _Form, rng: np.random.Generator) -> float:
    """Return how far the entry comes forward beside a garage (L7), or lies back behind a porch (negative), m.

    In a deep row a toilet beside it lies back, too.
    """
    if rooms.of("Garage"):
        return CONTACT_M + 0.2
    if form.porch and rooms.of("Toilet") and not form.service:
        return min(float(rng.uniform(*_WC_DEPTH_M)) + form.wall_m - form.south_m, 0.0)
    most = min(_PORCH_M[1], form.south_m - form.wall_m - _LEAST_ENTRY_M)
    least = most if form.vestibule else min(_PORCH_M[0], most)
    return -float(rng.uniform(least, most)) if form.porch and most > 0 else 0.0


def _garage(rooms: Rooms, entry: tuple[float, float], rng: np.random.Generator) -> Cell:
    """Return the garage before the house, on one side of the entry (L7)."""
    room = rooms.of("Garage")[0]
    wide = float(rng.uniform(3.3, 3.8))
    x = entry[1] if rng.random() < 0.5 else entry[0] - wide
    return Cell((x, -rooms.areas[room] / wide, x + wide, 0.0), room)


def _store_m(rows: _Rows, form: _Form, start: float, rng: np.random.Generator) -> float:
    """Return how much of the corridor's west end a store or a cupboard takes; 0 if doors need all of it (L4)."""
    firsts = [at + row[0].width_m for at, row in ((0.0, rows.north), (start, rows.south)) if row]
    free = min(min(firsts) - CONTACT_M - form.wall_m, _DEEPEST_STORE_M + form.wall_m)
    least = _LEAST_STORE_M2 / (form.corridor_m - form.wall_m) + form.wall_m
    if free < least or rng.random() < _CUPBOARDS:
        return least if free >= least else 0.0
    return float(rng.uniform(least, free))


def _joins(rooms: Rooms, cells: tuple[Cell, ...], form: _Form) -> Iterator[Join]:
    """Yield the ways: between day rooms, from a bedroom to its own rooms, from the hall to all others."""
    living, kitchen = rooms.of("Living_Room")[0], rooms.of("Kitchen")[0]
    dining = rooms.of("Dining_Room")

    def adjoin(one: int, other: int) -> bool:
        walls = shared_stretches(cells, one, other)
        return any(wall.high - wall.low >= CONTACT_M + form.wall_m for wall in walls)

    yield from (Join(living, room, wide=True) for room in dining)
    yield from (Join(room, kitchen, wide=form.open) for room in dining if adjoin(room, kitchen))
    direct = not dining or not adjoin(dining[0], kitchen)
    if adjoin(living, kitchen) and (form.open or (direct and not adjoin(HALL, kitchen))):
        yield Join(living, kitchen, wide=form.open)
    through = [
        room
        for room in (*dining, kitchen)
        if adjoin(HALL, room) and (form.through or (room == kitchen and not form.open))
    ]
    yield from (Join(HALL, room) for room in through)
    wide, deep = next(
        (x2 - x1 - form.wall_m, y2 - y1 - form.wall_m) for (x1, y1, x2, y2), room in cells if room == kitchen
    )
    fit = {*dining, kitchen} if form.open and wide * deep > _EAT_IN_M2 else {*dining}
    by_kitchen = form.through and any(room in fit for room in through) and adjoin(through[0], living)
    if not by_kitchen:
        yield Join(HALL, living)
    for room in sorted({cell.room for cell in cells} - {HALL, living, kitchen, *dining}):
        off_living = room == form.off_living and adjoin(living, room) and not adjoin(HALL, room)
        entries = [entry for entry in rooms.of(ENTRYWAY) if not adjoin(HALL, room) and adjoin(entry, room)]
        yield Join(living if off_living else rooms.behind.get(room, entries[0] if entries else HALL), room)
