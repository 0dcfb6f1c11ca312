"""Lay out atrium bungalows: rooms on the four sides of a courtyard, which is a terrace open to the sky.

::

      north | bedroom |   bedroom   | bath | living |        bedroom |    living room     | dining  |
            |---------+-- c ---------------+        |       ---------+-- c ---------------|         |
            | bath    | o |                |  room  |        bath    | o |                |---------|
            |---------| r |   courtyard    |--------|       ---------| r |   courtyard    | kitchen |
            | bedroom | r |                | dining |        bedroom | r |                |---------|
            |         |---+--- corridor ---+--------|                |---+--- corridor ---+         |
            |---------|                    |        |       ---------|                    | office  |
            | bedroom | entry | wc | office| kitchen|        bedroom | entry | wc | office|         |

C1  Two corridors lie along the courtyard, in the west and in the south, where the entry is.
C2  The west side has bedrooms and a bath; those at its ends reach along the corridor by what a door takes.
C3  The day rooms take the east, the living room in the north or in the south of it, and a bedroom with its own bath
    has the north; or the living room has the north, and dining room and kitchen the east.
C4  The south row says how wide the courtyard is.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.layout import CONTACT_M, Column, Rooms, put_column
from pipeline.sources.sound_homes.limits import LIMITS, distance_from_wishes
from pipeline.sources.sound_homes.programme import draw_area
from pipeline.sources.sound_homes.values import HALL, Cell, Join, Layout, Programme, Side, pick

_COURT_M: Final = (3.3, 6.0)
"""The least and the largest clear length and width of the courtyard, metres; codes ask for some 3 m before windows."""
_WEST_M: Final = (3.0, 3.8)
_SOUTH_M: Final = (2.7, 3.2)
_NORTH_M: Final = (3.2, 3.9)
_EAST_M: Final = (3.8, 4.8)
_NORTH_LIVING_M: Final = (4.0, 4.8)
_NARROW_EAST_M: Final = (2.9, 3.6)
"""The clear depths of the four sides; of the north and the east also where the living room has the north (C3)."""
_BATH_M: Final = (1.7, 2.3)
_COURT_BED_M: Final = 2.7
_WC_M: Final = (1.15, 1.3)
_WC_DEPTH_M: Final = (1.5, 1.65)
_ENTRY_M: Final = (1.4, 1.7)
_DINING_M: Final = (2.5, 3.2)
_KITCHEN_M: Final = (2.2, 3.0)
_LIVING_AT_NORTH: Final = 0.55
_SLEEP: Final = ("Child_Room", "Bedroom", "Office")


def lay_out_courtyard(programme: Programme, rng: np.random.Generator) -> Layout | None:
    """Return one try of a home round a courtyard, or None if the rooms do not fit."""
    return _Sides(programme, rng).lay_out()


class _Sides:
    """The sides of a home round a courtyard: where their walls lie in x and y, metres, and their rooms."""

    def __init__(self, programme: Programme, rng: np.random.Generator) -> None:
        self.programme, self.rng, self.wall_m = programme, rng, programme.inner_m
        self.rooms = Rooms(["Hallway"], [0.0])
        self.cells: list[Cell] = []
        self.joins: list[Join] = []
        self.at_north = rng.random() < _LIVING_AT_NORTH

    def draw(self, least_most: tuple[float, float]) -> float:
        """Return a length between centre lines of walls from a range of clear lengths."""
        return float(self.rng.uniform(*least_most)) + self.wall_m

    def add(self, label: str, size: float = 1.0) -> int:
        return self.rooms.add(label, draw_area(label, self.rng) * size)

    def put(self, room: int, rect: Rect, *, off: int = HALL) -> None:
        """Add a room that one reaches from the room ``off``."""
        self.cells.append(Cell(rect, room))
        self.joins.append(Join(off, room))

    def lay_out(self) -> Layout | None:
        """Return the layout, or None if the courtyard is too small or too large, or if a room breaks a limit."""
        hall, wall = self.programme.hall_m + self.wall_m, self.wall_m
        west, south = self.draw(_WEST_M), self.draw(_SOUTH_M)
        north = self.draw(_NORTH_LIVING_M if self.at_north else _NORTH_M)
        row, entry = self.south_row(south)
        thick = 2 * self.programme.outer_m - wall
        x2, x3 = west + hall, west + sum(column.width_m for column in row)
        if not _COURT_M[0] <= x3 - x2 - thick <= _COURT_M[1]:  # C4
            return None
        y2 = south + hall
        y3 = y2 + float(self.rng.uniform(*_COURT_M)) + thick
        top, y = y3 + north, 0.0
        for room, deep in self.west_side(west, (south, y3, top)):
            self.put(room, (0.0, y, west, y + deep))
            y += deep
        x, entrance = west, -1
        for column in row:
            if column is entry:
                entrance = len(self.cells)
            put_column(self.cells, column, (x, 0.0, x + column.width_m, south), up=False)
            self.joins += [Join(HALL, room) for room in column.rooms if room != HALL]
            x += column.width_m
        self.cells += [Cell((west, south, x3, y2), HALL), Cell((west, y2, x2, y3), HALL)]  # C1
        if self.at_north:
            living = self.north_living((west, y3, x3, top), y2)
        else:
            living = self.east_living((west, y3, x3, top), y2)
        labels, areas, cells = tuple(self.rooms.labels), tuple(self.rooms.areas), tuple(self.cells)
        if distance_from_wishes(labels, areas, cells, self.programme) is None:
            return None
        way: tuple[int, Side] = (entrance, "south")
        return Layout(labels, areas, cells, tuple(self.joins), way, court=(x2, y2, x3, y3), day_room=living)

    def south_row(self, south_m: float) -> tuple[list[Column], Column]:
        """Return the columns of the south row, west to east, and the entry among them: toilet, store, a room."""
        entry = Column([HALL], [1.0], self.draw(_ENTRY_M))
        share = self.draw(_WC_DEPTH_M) / south_m
        wet = Column([self.add("Toilet"), self.rooms.add("Storage", 0.0)], [share, 1 - share], self.draw(_WC_M))
        room = self.add(pick(_SLEEP, self.rng))
        wide = max(self.rooms.areas[room] / (south_m - self.wall_m), _COURT_BED_M) + self.wall_m
        row = [wet, entry] if self.rng.random() < 0.5 else [entry, wet]
        row.insert(int(self.rng.choice([0, 2])), Column([room], [1.0], wide))
        return row, entry

    def west_side(self, west_m: float, lines: tuple[float, float, float]) -> list[tuple[int, float]]:
        """Return the rooms of the west side from the south to the north, with their depths (C2).

        The corridor lies between the first two of the ``lines``; the last is the outer wall in the north.
        """
        low, high, top = lines
        beds = [self.add(pick(("Child_Room", "Bedroom"), self.rng)), self.add("Bedroom")]
        bath = self.draw(_BATH_M)
        asked = [self.rooms.areas[room] / (west_m - self.wall_m) + self.wall_m for room in beds]
        door = CONTACT_M + self.wall_m
        depths = [max(deep, least + door) for deep, least in zip(asked, (low, top - high), strict=True)]
        spare = top - bath - sum(depths)
        found = [(self.rooms.add("Bathroom", 0.0), bath)]
        if spare >= _COURT_BED_M + self.wall_m:
            found.insert(int(self.rng.integers(2)), (self.add("Child_Room"), spare))
        else:
            depths = [deep + spare / 2 for deep in depths]
        return [(beds[0], depths[0]), *found, (beds[1], depths[1])]

    def east_living(self, north: Rect, y2: float) -> int:
        """Put the day rooms into the east, a bedroom with its bath into the north (C3)."""
        x1, y3, x3, top = north
        own = max(self.draw(_BATH_M), x3 - x1 - LIMITS["Bedroom"].aspect * (top - y3 - self.wall_m))
        master, bath = self.add("Bedroom", 1.1), self.rooms.add("Bathroom", 0.0)
        self.put(master, (x1, y3, x3 - own, top))
        self.put(bath, (x3 - own, y3, x3, top), off=master)
        end = x3 + self.draw(_EAST_M)
        living, dining, kitchen = self.add("Living_Room", 1.1), self.add("Dining_Room"), self.add("Kitchen", 1.4)
        if self.rng.random() < 0.5:
            low = y2 - self.programme.hall_m - self.wall_m
            high = max(low + self.draw(_DINING_M), y2)
            order, lines = (kitchen, dining, living), (0.0, low, high, top)
            self.joins += [Join(HALL, dining)]
        else:
            high = top - self.draw(_KITCHEN_M)
            order, lines = (living, dining, kitchen), (0.0, high - self.draw(_DINING_M), high, top)
            self.joins += [Join(HALL, living)]
        self.cells += [Cell((x3, lines[k], end, lines[k + 1]), room) for k, room in enumerate(order)]
        self.joins += [Join(living, dining, wide=True), Join(dining, kitchen, wide=True)]
        return living

    def north_living(self, north: Rect, y2: float) -> int:
        """Put the living room into the north, kitchen and dining room into the east (C3)."""
        _, _, x3, top = north
        end = x3 + self.draw(_NARROW_EAST_M)
        living, dining, kitchen = self.add("Living_Room", 1.2), self.add("Dining_Room", 1.2), self.add("Kitchen", 1.4)
        room = self.add(pick(("Child_Room", "Bedroom"), self.rng))
        asked = np.array([self.rooms.areas[each] for each in (room, kitchen, dining)])
        low, high = (top * np.cumsum(asked)[:2] / asked.sum()).tolist()
        low = max(low, y2)
        self.put(living, north)
        self.put(room, (x3, 0.0, end, low))
        self.cells += [Cell((x3, low, end, high), kitchen), Cell((x3, high, end, top), dining)]
        self.joins += [Join(living, dining, wide=True), Join(dining, kitchen, wide=True)]
        return living
