"""Lay out the rooms of a programme: a corridor first, then bands of rooms along it, and day rooms at its end.

The method is a corridor-first subdivision with random restarts (``home`` judges the tries). ::

      north band   | bedroom | bedroom | bedroom |  living   |
      corridor     | ------------ hall --------- |  room     |
      south band   | bath | wc | entry | kitchen |           |

L1  The corridor runs along x. Bands of rooms lie north and south of it; in a narrow house there is none in the south.
L2  The day rooms lie at its east end: a living room through the whole depth, or beside a kitchen and a dining room.
L3  A south band without light holds what needs none: bath, toilet, store, entry; it is shallow then.
L4  A bath or a wardrobe of a bedroom's own lies at the west end, across from the bedroom, which ends the corridor.
L5  Bands are stretched to one length; a band that is much shorter leaves a recess where the house stands free.
L6  Wet rooms lie side by side; the kitchen lies next to the day rooms, or is a part of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.values import HALL, Cell, Join, Layout, Programme, Side

_NARROW: Final = frozenset({"row house", "studio"})
_FREE: Final = frozenset({"bungalow", "villa"})
_SLEEP: Final = frozenset({"Bedroom", "Child_Room", "Office"})
_LEAST_M: Final = {"Toilet": 1.0, "Storage": 1.0, "Bathroom": 1.7, "Wardrobe": 1.3, "Kitchen": 2.2, "Office": 2.5}
"""The least width of a room in a band, metres; of a bedroom it is ``_BED_M``."""
_BED_M: Final = 2.85
_ENTRY_M: Final = (1.5, 2.0)
_DAY_M: Final = (3.5, 7.2)
"""The least and the largest width of the day rooms, metres."""
_STRETCH: Final = (0.86, 1.28)
"""How much a band may be stretched (L5)."""
_RECESS_M: Final = (1.6, 4.5)


@dataclass
class _Column:
    """A piece of a band: rooms from the corridor outwards, each with its share of the depth; a width, metres."""

    rooms: list[int]
    shares: list[float]
    width_m: float
    stretches: bool = True


@dataclass
class _Rooms:
    """The programme's rooms by their use; numbers count from 1, the hall is 0."""

    labels: list[str]
    areas: list[float]
    behind: dict[int, int]
    sleep: list[int] = field(default_factory=list)

    def of(self, label: str) -> list[int]:
        return [k for k, each in enumerate(self.labels) if each == label and k not in self.behind]

    def add(self, label: str, area_m2: float) -> int:
        self.labels.append(label)
        self.areas.append(area_m2)
        return len(self.labels) - 1


def _rooms(programme: Programme) -> _Rooms:
    wishes = [each for each in programme.rooms if each.label != "Balcony"]
    found = _Rooms(["Hallway", *(each.label for each in wishes)], [0.0, *(each.area_m2 for each in wishes)], {})
    found.behind = {k: each.behind + 1 for k, each in enumerate(wishes, 1) if each.behind is not None}
    found.sleep = [k for k, label in enumerate(found.labels) if label in _SLEEP]
    return found


def lay_out_rooms(programme: Programme, rng: np.random.Generator) -> Layout | None:
    """Return one try of a layout, or None if the rooms do not fit together."""
    return _Try(programme, rng).layout()


class _Try:
    """One try: the choices, the bands, the day rooms."""

    def __init__(self, programme: Programme, rng: np.random.Generator) -> None:
        self._programme, self._rng, self._rooms = programme, rng, _rooms(programme)
        self._kind, light = programme.kind, programme.light
        wall = programme.inner_m
        self._narrow = self._kind in _NARROW
        self._free = self._kind in _FREE
        self._south_lit = "south" in light
        self._corridor_m = float(rng.uniform(1.25, 1.6)) + wall
        self._service = not self._south_lit or bool(rng.random() < 0.35)  # L3
        if self._kind == "studio":
            self._north_m, self._south_m = float(rng.uniform(1.9, 2.5)) + wall, 0.0
        elif self._narrow:
            self._north_m, self._south_m = float(rng.uniform(3.3, 4.1)) + wall, 0.0
        else:
            self._north_m = float(rng.uniform(3.4, 4.5)) + wall
            self._south_m = float(rng.uniform(1.8, 2.4) if self._service else rng.uniform(2.8, 3.7)) + wall
        self._height_m = self._south_m + self._corridor_m + self._north_m
        self._ends_in_bedroom = bool(self._rooms.behind) or (not self._narrow and rng.random() < 0.35)
        self._has_garage = bool(self._rooms.of("Garage"))
        self._entry = not self._narrow and (
            self._ends_in_bedroom
            or self._has_garage
            or (not self._service and bool(self._rooms.of("Toilet")))
            or rng.random() < (0.75 if self._free else 0.35)
        )
        self._joins: list[Join] = []
        self._cells: list[Cell] = []
        self._zones: list[tuple[int, str]] = []

    def layout(self) -> Layout | None:
        """Choose where the kitchen is, fill the bands, then the day rooms."""
        if self._has_garage and self._ends_in_bedroom:
            return None
        kitchen = self._place_kitchen()
        north, south = self._bands(kitchen)
        length = self._length(north, south)
        if length is None:
            return None
        day = self._day_rooms(kitchen, length)
        if day is None:
            return None
        start = self._stretch(north, length, 0.0)
        start_south = 0.0
        if south:
            start_south = length - self._south_total if self._recess else 0.0
            self._stretch(south, length - start_south, start_south)
        if start is None:
            return None
        entry_at = self._put_bands(north, south, start_south)
        if entry_at is None:
            return None
        self._add_joins()
        labels = tuple(self._rooms.labels)
        zones = tuple((label, self._cells[k].rect) for k, label in self._zones)
        return Layout(labels, tuple(self._cells), tuple(dict.fromkeys(self._joins)), zones, entry_at)

    def _place_kitchen(self) -> str:
        """Return where the kitchen is: in the living room, in a band, or beside the living room in the south."""
        rooms, rng = self._rooms, self._rng
        choices = ["open"] if self._kind != "practice" else []
        if not self._narrow:
            choices += ["north"] if rooms.of("Dining_Room") == [] else []
            if self._south_lit:
                choices += ["south", "south", "beside", "beside"] if not rooms.of("Dining_Room") else ["dining"] * 4
        return str(rng.choice(choices or ["north"]))

    def _bands(self, kitchen: str) -> tuple[list[_Column], list[_Column]]:
        """Share the rooms out among the bands, west to east."""
        rooms, rng = self._rooms, self._rng
        own = {room for room in rooms.behind if rooms.behind[room]}
        masters = sorted({rooms.behind[room] for room in own})
        sleep = [room for room in rooms.sleep if room not in masters]
        rng.shuffle(sleep)
        if self._narrow:
            return [*self._narrow_band(sleep)], []
        wet = self._wet_columns()
        south_groups: list[list[_Column]] = [wet]
        if self._entry:
            south_groups[0 if not self._service or rng.random() < 0.5 else len(south_groups) :] = []
            south_groups = [[*wet, self._entry_column()]] if rng.random() < 0.5 else [[self._entry_column(), *wet]]
        north = [*masters]
        south_sleep: list[int] = []
        wanted = sum(column.width_m for group in south_groups for column in group)
        wanted += sum(self._width(room, self._south_m) for room in own)
        wanted += self._width(rooms.of("Kitchen")[0], self._south_m) if kitchen in {"south", "dining"} else 0.0
        have = sum(self._width(room, self._north_m) for room in masters)
        have += self._width(rooms.of("Kitchen")[0], self._north_m) if kitchen == "north" else 0.0
        for room in sleep:  # L5
            if not self._service and have > wanted - 0.5 * self._width(room, self._north_m) and north:
                south_sleep.append(room)
                wanted += self._width(room, self._south_m)
            else:
                north.append(room)
                have += self._width(room, self._north_m)
        groups = [*south_groups, *([self._column(room, self._south_m)] for room in south_sleep)]
        order = rng.permutation(len(groups)).tolist()
        ordered = [column for k in order for column in groups[k]]
        west = [self._column(room, self._south_m) for room in sorted(own)]
        east = [self._column(rooms.of("Kitchen")[0], self._south_m)] if kitchen in {"south", "dining"} else []
        north_columns = [self._column(room, self._north_m) for room in north]
        north_columns += [self._column(rooms.of("Kitchen")[0], self._north_m)] if kitchen == "north" else []
        return north_columns, [*west, *ordered, *east]

    def _narrow_band(self, sleep: list[int]) -> list[_Column]:
        """A house between party walls: the bedroom in the front, wet rooms and stores inside."""
        rooms, depth = self._rooms, self._north_m
        front = [self._column(room, depth) for room in sleep[:1]]
        if self._kind == "studio":
            inside = [*rooms.of("Bathroom"), *rooms.of("Storage")]
            return [self._column(room, depth) for room in inside]
        bath = rooms.of("Bathroom")[0]
        rest = rooms.add("Wardrobe", 0.0)
        rooms.behind[rest] = sleep[0]
        share = float(np.clip(self._rng.uniform(1.9, 2.2) / depth, 0.45, 0.62))
        columns = [*front, _Column([bath, rest], [share, 1 - share], float(self._rng.uniform(2.1, 2.5)))]
        for label in ("Toilet", "Storage"):
            columns += [self._column(room, depth) for room in rooms.of(label)]
        return columns

    def _wet_columns(self) -> list[_Column]:
        """Bath, toilet and store side by side (L6); in a deep band the store lies behind the toilet, at the entry."""
        rooms = self._rooms
        columns = [self._column(room, self._south_m) for room in rooms.of("Bathroom")]
        toilets, stores = rooms.of("Toilet"), rooms.of("Storage")
        if toilets and not self._service:
            share = min(1.65 / self._south_m, 0.58)
            stores = stores or [rooms.add("Storage", 2.2)]
            pair = _Column([toilets[0], stores[0]], [share, 1 - share], float(self._rng.uniform(1.2, 1.45)), False)
            return [*columns, pair]
        return [*columns, *(self._column(room, self._south_m) for room in [*toilets, *stores])]

    def _entry_column(self) -> _Column:
        return _Column([HALL], [1.0], float(self._rng.uniform(*_ENTRY_M)), False)

    def _width(self, room: int, depth_m: float) -> float:
        wall = self._programme.inner_m
        label = self._rooms.labels[room]
        least = _LEAST_M.get(label, _BED_M)
        return max(self._rooms.areas[room] / (depth_m - wall), least) + wall

    def _column(self, room: int, depth_m: float) -> _Column:
        fixed = self._rooms.labels[room] in {"Toilet", "Storage"}
        return _Column([room], [1.0], self._width(room, depth_m), not fixed)

    def _length(self, north: list[_Column], south: list[_Column]) -> float | None:
        """Return the length of the bands, or None if they are too unlike (L5)."""
        one, other = (sum(column.width_m for column in band) for band in (north, south))
        self._recess, self._south_total = False, other
        if not south:
            return one
        if not north:
            return None
        short, long = sorted((one, other))
        if self._free and one - other > _RECESS_M[0] and one - other < _RECESS_M[1] and not self._ends_in_bedroom:
            self._recess = True
            return one
        if not _STRETCH[0] * long <= _STRETCH[1] * short:
            return None
        return float(np.clip((one + other) / 2, _STRETCH[0] * long, _STRETCH[1] * short))

    def _stretch(self, band: list[_Column], length_m: float, start: float) -> float | None:
        """Stretch the columns that may be, so that a band has the length; return its start."""
        fixed = sum(column.width_m for column in band if not column.stretches)
        free = sum(column.width_m for column in band if column.stretches)
        for column in band:
            if column.stretches:
                column.width_m *= (length_m - fixed) / free
            elif not free:
                column.width_m *= length_m / fixed
        return start

    def _day_rooms(self, kitchen: str, length: float) -> bool | None:
        """Lay the day rooms out at the east end (L2)."""
        rooms, rng, wall = self._rooms, self._rng, self._programme.inner_m
        living, cook = rooms.of("Living_Room")[0], rooms.of("Kitchen")[0]
        dining = rooms.of("Dining_Room")
        south, height = self._south_m, self._height_m
        area = rooms.areas[living]
        if kitchen == "open":
            area += 0.8 * sum(rooms.areas[room] for room in [cook, *dining])
        beside = kitchen in {"beside", "dining"}
        bottom = south if beside or (self._free and kitchen != "open" and rng.random() < 0.3) else 0.0
        top = height + (float(rng.choice([0.0, 0.0, 1.2, 1.8])) if self._free and rng.random() < 0.6 else 0.0)
        width = area / (top - bottom - wall) + wall
        if beside:
            other = dining[0] if kitchen == "dining" else cook
            width = max(width, 0.8 * rooms.areas[other] / south)
        if not _DAY_M[0] <= width <= _DAY_M[1] + (2.0 if self._narrow else 0.0):
            return None
        self._day = (length, bottom, length + width, top)
        if beside:
            low = -float(rng.choice([0.0, 0.9, 1.5])) if self._free else 0.0
            self._cells.append(Cell((length, low, length + width, south), other))
        self._cells.append(Cell(self._day, living))
        if kitchen == "open":
            self._open_plan([cook, *dining])
        return True

    def _open_plan(self, parts: list[int]) -> None:
        """Let the kitchen and the dining room be parts of the living room: zones that have a name and no wall."""
        labels = [self._rooms.labels[part] for part in parts]
        place = len(self._cells) - 1
        self._zones += [(place, label) for label in labels]

    def _put_bands(self, north: list[_Column], south: list[_Column], start: float) -> tuple[int, Side] | None:
        """Turn columns into cells, add the corridor, and return where the front door is."""
        low, high = self._south_m, self._south_m + self._corridor_m
        entry: tuple[int, Side] | None = None
        x = 0.0
        west = 0.0
        for place, column in enumerate(north):
            bottom = high
            if place == 0 and self._ends_in_bedroom and column.rooms[0] in self._rooms.sleep:  # L4
                bottom, west = low, column.width_m
            self._put(column, (x, bottom, x + column.width_m, self._height_m), up=True)
            x += column.width_m
        end = x
        if self._ends_in_bedroom and not west:
            return None
        self._cells.append(Cell((west, low, end, high), HALL))
        corridor = len(self._cells) - 1
        x = start
        for column in south:
            self._put(column, (x, 0.0, x + column.width_m, low), up=False)
            if column.rooms == [HALL]:
                entry = (len(self._cells) - 1, "south")
            x += column.width_m
        if self._has_garage:
            area = self._rooms.areas[self._rooms.of("Garage")[0]]
            wide = float(self._rng.uniform(3.3, 3.8))
            deep = area / wide
            bottom = min(max(high - deep + 0.4, 0.0), low - 0.2)
            self._cells.append(Cell((-wide, bottom, 0.0, bottom + deep), self._rooms.of("Garage")[0]))
            if bottom + deep < low + 1.1:
                return None
        if entry is None:
            entry = (corridor, "west") if not west and not self._has_garage else None
        return entry

    def _put(self, column: _Column, rect: Rect, *, up: bool) -> None:
        x1, y1, x2, y2 = rect
        at = y1 if up else y2
        for room, share in zip(column.rooms, column.shares, strict=True):
            depth = share * (y2 - y1)
            after = at + depth if up else at - depth
            self._cells.append(Cell((x1, min(at, after), x2, max(at, after)), room))
            at = after

    def _add_joins(self) -> None:
        """Say which rooms are to be joined: all to the hall, private ones to their bedroom, day rooms to each other."""
        rooms = self._rooms
        put = {cell.room for cell in self._cells}
        living = rooms.of("Living_Room")[0]
        day = [living, *(room for label in ("Kitchen", "Dining_Room") for room in rooms.of(label) if room in put)]
        self._joins += [Join(one, other, wide=True) for k, one in enumerate(day) for other in day[k + 1 :]]
        self._joins += [Join(HALL, living)]
        for room in sorted(put - {HALL, *day}):
            self._joins.append(Join(rooms.behind.get(room, HALL), room))
