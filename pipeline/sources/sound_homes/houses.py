"""Lay out houses of several storeys: rows of rooms along a corridor, which lies at the same place on every storey.

The corridor's walls and those of the stair go through all storeys and bear the floors. ::

      ground   |     living       | dining |       above   | bedroom | bedroom  | bedroom |
               | --- hall ------- |        |               |   | --- landing ------- |    |
               | wc | entry | ST  | kitchen|               | bath | store | ST | bedroom   |

F1  The stair is a column of the south row, and the same on every storey (``stairs``, S1). Where it begins at its far
    end, the entry lies beside it.
F2  On the ground the living room has the north row, with the dining room beside it; the kitchen ends the corridor.
    The toilet lies in a column with a store, or between kitchen and corridor.
F3  Upstairs bedrooms have the north row. What the stair leaves of the south row holds a bath, bedrooms, a store.
F4  A bath lies over a bath, a toilet or a kitchen: pipes go straight down.
F5  The corridor ends at a wall, at a store, or in a room that takes its end.
F6  In some houses that stand free the living room takes the whole depth at the end of the corridor instead; kitchen and
    dining room have the north row. The living room may come forward before the storey above.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from houseexpo.tolerances import SAME_M
from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.layout import CONTACT_M, PORCH_WIDTH_M, Column, Rooms, put_column
from pipeline.sources.sound_homes.limits import LIMITS, MOST_RATIO, distance_from_wishes
from pipeline.sources.sound_homes.openings import shared_stretches
from pipeline.sources.sound_homes.programme import AREAS, draw_area
from pipeline.sources.sound_homes.stairs import LANDING_M, Stair, StairKind, draw_stair_size
from pipeline.sources.sound_homes.values import ENTRYWAY, HALL, STAIRS, Cell, Join, Layout, Programme, Side

WET: Final = frozenset({"Bathroom", "Toilet", "Kitchen"})
_LENGTH_M: Final = {"row house": (5.6, 7.6), "house": (6.8, 10.5), "villa": (9.0, 13.5)}
_LIVING: Final = {"row house": 1.05, "house": 1.1, "villa": 1.3}
"""How much larger than in a flat a living room is."""
_KITCHEN: Final = {"row house": 1.0, "house": 1.2, "villa": 1.5}
_DINING: Final = {"row house": 0.15, "house": 0.45, "villa": 0.8}
_OFFICE: Final = {"row house": 0.0, "house": 0.3, "villa": 0.75}
_GARAGE: Final = {"row house": 0.0, "house": 0.3, "villa": 0.6}
_WC_IN_KITCHEN: Final = {"row house": 0.6, "house": 0.15, "villa": 0.0}
_FROM_WEST: Final = 0.35
"""How often the front door of a house that stands free is at the corridor's end, and there is no entry."""
_DEEP: Final = 0.4
_LIVING_M: Final = 3.6
_FORWARD_M: Final = (0.9, 2.0)
_TWO_ROOMS_M: Final = 4.9
"""The length of the north row from which on it holds a dining room beside the kitchen (F6)."""
_NORTH_M: Final = (3.3, 5.2)
_CORRIDOR_M: Final = (1.05, 1.25)
_ENTRY_M: Final = (1.35, 1.65)
_PORCH_M: Final = (0.5, 1.2)
_SPARE_M: Final = (0.0, 0.6)
"""What a kitchen gets beyond what it asks for."""
_KITCHEN_M: Final = 2.1
_DINING_M: Final = 2.4
_OFFICE_M: Final = 2.3
_GARAGE_M: Final = (5.4, 6.0)
_SHOWER_M: Final = (1.6, 1.8)
_WC_M: Final = (1.15, 1.4)
_WC_DEPTH_M: Final = 1.5
_BATH_M: Final = (1.65, 2.3)
_BATH_DEPTH_M: Final = 2.6
_WARDROBE_FROM_M: Final = 3.5
"""In a deeper row than this, a bath of the depth above leaves a wardrobe of the bedroom beside it at the outer wall."""
_UPPER: Final = {"Bathroom": 1.3}
"""How much larger than in a flat a bath upstairs is."""
_WAYS: Final = (
    *("Storage", "Bathroom", "Bedroom", "Bathroom Bedroom", "Bathroom Bedroom", "Bathroom Storage"),
    *("Storage Bathroom", "Bathroom Storage Bedroom", "Bathroom Bedroom Bedroom", "Bedroom Bedroom"),
)
"""What may lie between the stair and an outer wall, from the stair outwards, each as likely where it fits."""
_TWO_BATHS_M: Final = 9.0
"""The length of a house from which on a storey may have two baths."""
_BED_M: Final = (2.7, 4.4)
_BEDS_M: Final = (2.8, 5.0)
"""The clear widths of bedrooms in the south and in the north."""
_STORE_WIDTH_M: Final = 1.0
_END_M: Final = (1.4, 2.2)
"""The least and the largest length of a store at the end of a corridor."""
_STORE_M2: Final = 5.0
_OVER_M2: Final = 0.3
"""F4: the least area over a wet room."""
_SLEEP: Final = frozenset({"Bedroom", "Child_Room", "Office"})


@dataclass(frozen=True)
class Frame:
    """What all storeys share: the lengths of the rows and their depths up to centre lines, metres, and the stair."""

    length_m: float
    south_m: float
    corridor_m: float
    north_m: float
    wall_m: float
    stair: Stair

    @property
    def corridor_top_m(self) -> float:
        """Where the corridor meets the north row."""
        return self.south_m + self.corridor_m


def lay_out_ground(programme: Programme, rng: np.random.Generator) -> tuple[Frame, Layout] | None:
    """Return one try of a ground floor, and what it decides for the storeys above; None if it does not fit."""
    ground = _Ground(programme, rng)
    least, most = _LENGTH_M[programme.kind]
    return ground.lay_out() if least <= ground.starts[-1] <= most else None


class _Ground:
    """A ground floor: the columns of its south row, and where they start in the west, ``starts``."""

    def __init__(self, programme: Programme, rng: np.random.Generator) -> None:
        self.programme, self.kind, self.wall_m, self.rng = programme, programme.kind, programme.inner_m, rng
        self.rooms = Rooms(["Hallway"], [0.0])
        turns: list[StairKind] = ["half", "half", "quarter", "straight"]
        self.turn: StairKind = "half" if programme.storeys > 2 else turns[int(rng.integers(len(turns)))]
        wide, deep = draw_stair_size(self.turn, rng)
        self.south_m, self.corridor_m = deep + self.wall_m, float(rng.uniform(*_CORRIDOR_M)) + self.wall_m
        self.full_m = self.south_m + self.corridor_m
        self.from_west = self.kind != "row house" and self.turn == "half" and rng.random() < _FROM_WEST
        self.stair = Column([self.rooms.add(STAIRS, 0.0)], [1.0], wide + self.wall_m)
        if self.turn == "straight":
            foot = (LANDING_M + self.wall_m) / self.south_m
            self.stair = Column([*self.stair.rooms, HALL], [1 - foot, foot], wide + self.wall_m)
        is_apart = self.turn == "half" and not self.from_west and programme.vestibule
        self.hall = self.rooms.add(ENTRYWAY, 0.0) if is_apart else HALL
        self.porch_m = float(rng.uniform(*_PORCH_M)) if self.turn == "half" and rng.random() < 0.6 else 0.0
        wide = PORCH_WIDTH_M + 2 * programme.outer_m if self.porch_m else float(rng.uniform(*_ENTRY_M)) + self.wall_m
        self.entry = Column([self.hall], [1.0], wide)
        self.kitchen = self.add("Kitchen", _KITCHEN[self.kind])
        in_kitchen = not self.from_west and rng.random() < _WC_IN_KITCHEN[self.kind]
        self.office = None if self.from_west or rng.random() > _OFFICE[self.kind] else self.add("Office")
        self.is_deep = self.kind != "row house" and self.rng.random() < _DEEP
        last = self.deep_living() if self.is_deep else self.last(in_kitchen=in_kitchen)
        in_kitchen = self.kitchen in last.rooms and len(last.rooms) > 1
        self.row = [*self.study(), *self.middle(in_kitchen=in_kitchen), last]
        self.starts: list[float] = np.cumsum([0.0, *(column.width_m for column in self.row)]).tolist()

    def add(self, label: str, size: float = 1.0) -> int:
        return self.rooms.add(label, min(draw_area(label, self.rng) * size, AREAS[label].most_m2))

    def width(self, room: int, depth_m: float, least_m: float) -> float:
        return max(self.rooms.areas[room] / depth_m, least_m) + self.wall_m

    def study(self) -> list[Column]:
        if self.office is None:
            return []
        deep = self.full_m - self.wall_m
        least = max(_OFFICE_M, deep / LIMITS["Office"].aspect)
        return [Column([self.office], [1.0], self.width(self.office, deep, least))]

    def middle(self, *, in_kitchen: bool) -> list[Column]:
        """Return stair, entry and what is wet between the west wall and the kitchen (F1, F2)."""
        if in_kitchen:
            return [self.stair, self.entry]
        if self.from_west:
            wet = Column([self.add("Bathroom")], [1.0], float(self.rng.uniform(*_SHOWER_M)) + self.wall_m)
            return [wet, self.stair] if self.rng.random() < 0.5 else [self.stair, wet]
        share = (_WC_DEPTH_M + self.wall_m) / self.south_m
        found = [self.add("Toilet"), self.add("Storage")]
        wet = Column(found, [share, 1 - share], float(self.rng.uniform(*_WC_M)) + self.wall_m)
        return [wet, self.entry, self.stair] if self.rng.random() < 0.5 else [self.stair, self.entry, wet]

    def last(self, *, in_kitchen: bool) -> Column:
        """Return the kitchen's column, which ends the corridor (F2), with a toilet if that is not too large."""
        spare = float(self.rng.uniform(*_SPARE_M))
        if in_kitchen:
            share = (_WC_DEPTH_M + self.wall_m) / self.full_m
            wide = self.width(self.kitchen, (1 - share) * self.full_m - self.wall_m, _KITCHEN_M) + spare
            toilet_m2 = draw_area("Toilet", self.rng)
            if (wide - self.wall_m) * _WC_DEPTH_M <= MOST_RATIO * toilet_m2:
                return Column([self.rooms.add("Toilet", toilet_m2), self.kitchen], [share, 1 - share], wide)
        return Column([self.kitchen], [1.0], self.width(self.kitchen, self.full_m - self.wall_m, _KITCHEN_M) + spare)

    def deep_living(self) -> Column:
        """Return the column of a living room that takes the whole depth of the house (F6), without the north row."""
        living = self.add("Living_Room", _LIVING[self.kind])
        return Column([living], [1.0], self.width(living, self.full_m + _NORTH_M[0], _LIVING_M))

    def lay_out(self) -> tuple[Frame, Layout] | None:
        if self.is_deep:
            return self.lay_out_deep()
        living, length = self.add("Living_Room", _LIVING[self.kind]), self.starts[-1]
        asked, clear = self.rooms.areas[living], length - self.wall_m
        too_long = clear > LIMITS["Living_Room"].aspect * min(max(asked / clear, _NORTH_M[0]), _NORTH_M[1])
        dining = self.add("Dining_Room") if too_long or self.rng.random() < _DINING[self.kind] else None
        asked += 0.0 if dining is None else self.rooms.areas[dining]
        north = min(max(asked / clear, _NORTH_M[0]), _NORTH_M[1]) + self.wall_m
        frame = self.frame(north)
        cells: list[Cell] = []
        entrance = self.put_row(cells)
        top = self.full_m
        split = length if dining is None else length - self.width(dining, north - self.wall_m, _DINING_M)
        forward = float(self.rng.uniform(*_FORWARD_M)) if self.kind != "row house" and self.rng.random() < 0.3 else 0.0
        cells.append(Cell((0.0, top, split, top + north + forward), living))
        if dining is not None:
            cells.append(Cell((split, top, length, top + north), dining))
        return self.with_joins(frame, tuple(cells), entrance, living, dining)

    def with_joins(
        self, frame: Frame, cells: tuple[Cell, ...], entrance: tuple[int, Side], living: int, dining: int | None
    ) -> tuple[Frame, Layout] | None:
        """Return the layout of these cells, or None if a room breaks a limit."""
        labels, areas = tuple(self.rooms.labels), tuple(self.rooms.areas)
        if distance_from_wishes(labels, areas, cells, self.programme) is None:
            return None
        joins = tuple(self.joins(cells, living, dining))
        return frame, Layout(labels, areas, cells, joins, entrance, stair_up=frame.stair)

    def frame(self, north_m: float) -> Frame:
        """Return what the storeys above keep; ``north_m`` is the depth of the north row."""
        place = self.row.index(self.stair)
        foot: Literal["west", "north", "east"] = "north"
        if self.turn != "half":
            foot = "east" if self.row[place + 1] is self.entry else "west"
        stair = Stair(self.turn, (self.starts[place], 0.0, self.starts[place + 1], self.south_m), foot)
        return Frame(self.starts[-1], self.south_m, self.corridor_m, north_m, self.wall_m, stair)

    def lay_out_deep(self) -> tuple[Frame, Layout] | None:
        """Return a ground floor whose kitchen and dining room lie in the north row, beside the living room (F6)."""
        (living,) = self.row[-1].rooms
        end, length, wall = self.starts[-2], self.starts[-1], self.wall_m
        dining = None if end < _TWO_ROOMS_M else self.add("Dining_Room")
        found = [self.kitchen, *([] if dining is None else [dining])]
        asked = [self.rooms.areas[room] for room in found]
        north = min(max(sum(asked) / (end - len(found) * wall), _NORTH_M[0]), _NORTH_M[1]) + wall
        frame = self.frame(north)
        cells: list[Cell] = []
        entrance = self.put_row(cells)
        place = next(k for k, cell in enumerate(cells) if cell.room == living)
        forward = float(self.rng.uniform(*_FORWARD_M)) if self.rng.random() < 0.3 else 0.0
        cells[place] = Cell((end, 0.0, length, self.full_m + north + forward), living)
        split = end * asked[0] / sum(asked) if len(found) > 1 else end
        for room, (x1, x2) in zip(found, ((0.0, split), (split, end)), strict=False):
            cells.append(Cell((x1, self.full_m, x2, self.full_m + north), room))
        return self.with_joins(frame, tuple(cells), entrance, living, dining)

    def put_row(self, cells: list[Cell]) -> tuple[int, Side]:
        """Add the cells of the south row and the corridor; return where the front door is."""
        entrance: tuple[int, Side] = (-1, "west")
        for k, column in enumerate(self.row):
            if column is self.entry:
                entrance = (len(cells), "south")
            ends = k == len(self.row) - 1 or self.office in column.rooms
            low = self.porch_m if column is self.entry else 0.0
            rect = (self.starts[k], low, self.starts[k + 1], self.full_m if ends else self.south_m)
            put_column(cells, column, rect, up=False)
        west = 0.0 if self.from_west else self.starts[1] if self.office is not None else self.west_end(cells)
        if self.from_west:
            entrance = (len(cells), "west")
        cells.append(Cell((west, self.south_m, self.starts[-2], self.full_m), HALL))
        return entrance

    def west_end(self, cells: list[Cell]) -> float:
        """Return where the corridor begins in the west; what is left there is a store (F5), or a garage lies there."""
        wide, top = self.starts[1], self.full_m
        is_stair = self.row[0] is self.stair
        if not is_stair and self.rng.random() < _GARAGE[self.kind]:
            garage = self.add("Garage")
            deep = float(self.rng.uniform(*_GARAGE_M))
            west = -self.width(garage, deep, 0.0)
            cells.append(Cell((west, top - deep - self.wall_m, 0.0, top), garage))
            return 0.0
        needed = is_stair and self.turn == "half"
        if needed or wide - self.wall_m < _END_M[0] or self.rooms.has_store() or self.rng.random() < 0.4:
            return 0.0
        cells.append(Cell((0.0, self.south_m, wide, top), self.add("Storage")))
        return wide

    def joins(self, cells: tuple[Cell, ...], living: int, dining: int | None) -> Iterator[Join]:
        def adjoin(one: int, other: int) -> bool:
            walls = shared_stretches(cells, one, other)
            return any(wall.high - wall.low >= CONTACT_M + self.wall_m for wall in walls)

        is_open = bool(self.rng.random() < 0.6)
        beside = living if dining is None else dining
        if dining is not None:
            yield Join(living, dining, wide=True)
        joined = adjoin(beside, self.kitchen) and (is_open or dining is not None or self.rng.random() < 0.3)
        if joined:
            yield Join(beside, self.kitchen, wide=is_open)
        if not joined or (adjoin(HALL, self.kitchen) and self.rng.random() < 0.6):
            yield Join(HALL, self.kitchen)
        if self.is_deep:
            yield Join(HALL, living)
        joined_above = {HALL, self.kitchen, dining, *([living] if self.is_deep else [])}
        for room in sorted({cell.room for cell in cells} - joined_above):
            if self.rooms.labels[room] != STAIRS:
                yield Join(HALL if room == self.hall or adjoin(HALL, room) else self.hall, room)


def lay_out_upper(
    frame: Frame, below: Layout, programme: Programme, rng: np.random.Generator, *, ends: bool
) -> Layout | None:
    """Return one try of an upper storey over ``below``, the last if it ``ends`` the house; None if it does not fit."""
    return _Upper(frame, rng).lay_out(below, programme, ends=ends)


class _Upper:
    """An upper storey: its rooms, its cells, and which rooms take an end of the corridor, ``deeper``."""

    def __init__(self, frame: Frame, rng: np.random.Generator) -> None:
        self.frame, self.rng = frame, rng
        self.rooms = Rooms(["Hallway"], [0.0])
        self.void = self.rooms.add(STAIRS, 0.0)
        self.cells: list[Cell] = []
        self.deeper: set[int] = set()

    def add(self, label: str) -> int:
        return self.rooms.add(label, draw_area(label, self.rng) * _UPPER.get(label, 1.0))

    def lay_out(self, below: Layout, programme: Programme, *, ends: bool) -> Layout | None:
        frame, rooms, cells = self.frame, self.rooms, self.cells
        x1, _, x2, _ = frame.stair.rect
        widths, most = (x1, frame.length_m - x2), 1 + (frame.length_m > _TWO_BATHS_M)
        left = self.beside_stair(widths[0], 0 if widths[1] > SAME_M else 1, most)
        if left is None:
            return None
        number = len(rooms.of("Bathroom"))
        right = self.beside_stair(widths[1], max(1 - number, 0), most - number)
        if right is None:
            return None
        south, north = [*left[::-1], Column([self.void], [1.0], x2 - x1), *right], self.bedrooms()
        south_x, north_x = (np.cumsum([0.0, *(each.width_m for each in row)]).tolist() for row in (south, north))
        west = self.corridor_end((south[0], north[0]), (0.0, x1), (south_x[1], north_x[1]))
        east = self.corridor_end((south[-1], north[-1]), (frame.length_m, x2), (south_x[-2], north_x[-2]))
        if west is None or east is None:
            return None
        top = frame.corridor_top_m
        for k, column in enumerate(south):
            high = top if column.rooms[0] in self.deeper else frame.south_m
            put_column(cells, column, (south_x[k], 0.0, south_x[k + 1], high), up=False)
        for k, column in enumerate(north):
            low = frame.south_m if column.rooms[0] in self.deeper else top
            put_column(cells, column, (north_x[k], low, north_x[k + 1], top + frame.north_m), up=True)
        cells.append(Cell((west, frame.south_m, east, top), HALL))
        if not all(_is_over_pipes(cells, room, below) for room in rooms.of("Bathroom")):  # F4
            return None
        if distance_from_wishes(rooms.labels, rooms.areas, cells, programme) is None:
            return None
        inside = [room for room in range(1, len(rooms.labels)) if room != self.void]
        joins = tuple(Join(rooms.behind.get(room, HALL), room) for room in inside)
        stairs = None if ends else frame.stair, frame.stair
        return Layout(tuple(rooms.labels), tuple(rooms.areas), tuple(cells), joins, None, *stairs)

    def beside_stair(self, width_m: float, least: int, most: int) -> list[Column] | None:
        """Return the columns between the stair and an outer wall, from the stair outwards (F3); None if none fit.

        They have ``least`` to ``most`` baths.
        """
        if width_m < SAME_M:
            return []
        wall, deep = self.frame.wall_m, self.frame.south_m - self.frame.wall_m
        bath_m = min(max(draw_area("Bathroom", self.rng) / deep, _BATH_M[0]), _BATH_M[1])
        fixed = {"Bathroom": bath_m + wall, "Storage": _STORE_WIDTH_M + wall}
        limits = {
            "Bedroom": _BED_M,
            "Storage": (_STORE_WIDTH_M, _STORE_M2 / deep),
            "Bathroom": _BATH_M,
        }
        ways: list[tuple[list[str], dict[str, float]]] = []
        for way in _WAYS:
            names = way.split()
            last = next(name for name in limits if name in names)
            rest = width_m - sum(fixed[name] for name in names if name != last)
            each = rest / names.count(last)
            if "Storage" in names and self.rooms.has_store():
                continue
            if least <= names.count("Bathroom") <= most and limits[last][0] <= each - wall <= limits[last][1]:
                ways.append((names, {**fixed, last: each}))
        if not ways:
            return None
        names, widths = ways[int(self.rng.integers(len(ways)))]
        rooms = [self.add(self.sleeping() if name == "Bedroom" else name) for name in names]
        found = [Column([room], [1.0], widths[name]) for room, name in zip(rooms, names, strict=True)]
        is_alone = not self.rooms.has_store()
        if is_alone and names == ["Bathroom", "Bedroom"] and deep > _WARDROBE_FROM_M + wall and self.rng.random() < 0.8:
            share = (_BATH_DEPTH_M + wall) / self.frame.south_m
            wardrobe = self.rooms.add("Wardrobe", 2.5)
            self.rooms.behind[wardrobe] = rooms[1]
            found[0] = Column([rooms[0], wardrobe], [share, 1 - share], bath_m + wall)
        return found

    def sleeping(self) -> str:
        return str(self.rng.choice(["Child_Room", "Bedroom", "Office"], p=(0.55, 0.3, 0.15)))

    def bedrooms(self) -> list[Column]:
        """Return the bedrooms of the north row (F3), the first of them for the parents."""
        length, wall = self.frame.length_m, self.frame.wall_m
        fits = [n for n in range(1, 5) if _BEDS_M[0] + wall <= length / n <= _BEDS_M[1] + wall] or [1]
        number = fits[int(self.rng.integers(len(fits)))]
        parts = self.rng.uniform(0.85, 1.15, number)
        labels = ["Bedroom", *("Child_Room" if self.rng.random() < 0.6 else "Bedroom" for _ in range(number - 1))]
        return [
            Column([self.add(label)], [1.0], length * float(part / parts.sum()))
            for label, part in zip(labels, parts, strict=True)
        ]

    def corridor_end(
        self, columns: tuple[Column, Column], between: tuple[float, float], inner: tuple[float, float]
    ) -> float | None:
        """Return where the corridor ends (F5): ``between`` an outer wall and the stair, or at it.

        The last columns of the rows, south and north, end at ``inner``.
        """
        frame, rooms = self.frame, self.rooms
        outer, stair = between
        store = abs(outer - float(self.rng.uniform(*_END_M)) - frame.wall_m)
        takes = [len(column.rooms) == 1 and rooms.labels[column.rooms[0]] in _SLEEP for column in columns]
        ways = [("wall", outer), *([] if rooms.has_store() else [("store", store)])]
        ways += [(way, end) for way, end, may in zip(("south", "north"), inner, takes, strict=True) if may] * 2
        ways = [(way, end) for way, end in ways if abs(end - outer) <= abs(stair - outer) + SAME_M]
        way, end = ways[int(self.rng.integers(len(ways)))]
        if way == "store":
            ends = sorted((outer, end))
            self.cells.append(Cell((ends[0], frame.south_m, ends[1], frame.corridor_top_m), self.add("Storage")))
        elif way != "wall":
            taken = columns[way == "north"].rooms[0]
            if taken in self.deeper:
                return None
            self.deeper.add(taken)
        return end


def _is_over_pipes(cells: Sequence[Cell], room: int, below: Layout) -> bool:
    """Return whether a room lies over a wet one (F4)."""
    wet = [cell.rect for cell in below.cells if below.labels[cell.room] in WET]
    return any(_overlap_m2(cell.rect, each) >= _OVER_M2 for cell in cells if cell.room == room for each in wet)


def _overlap_m2(one: Rect, other: Rect) -> float:
    wide, high = (min(one[k + 2], other[k + 2]) - max(one[k], other[k]) for k in (0, 1))
    return max(wide, 0.0) * max(high, 0.0)
