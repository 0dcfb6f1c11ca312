"""Hold the parts of a sound home. Metres, x right, y up.

While a home is laid out, a cell reaches to the centre lines of its walls (``Cell.rect``). An outer wall counts as an
inner one there; it is thicker only outwards. A room consists of one cell or of several that join without a wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import shapely

from pipeline.sources.homes.values import Rect

Side: TypeAlias = Literal["west", "south", "east", "north"]
SIDES: Final[tuple[Side, ...]] = ("west", "south", "east", "north")
"""In the order of a rectangle's numbers."""

OUTDOORS: Final = frozenset({"Balcony", "Terrace"})

HALL: Final = 0
"""The number of the hall among the rooms of a layout."""


@dataclass(frozen=True)
class RoomWish:
    """A room that is asked for; ``behind`` is the place of the room in the programme that alone leads to it."""

    label: str
    area_m2: float
    behind: int | None = None


@dataclass(frozen=True)
class Programme:
    """What a household asks for: the kind of dwelling, its rooms, the sides with light, the thickness of its walls."""

    kind: str
    rooms: tuple[RoomWish, ...]
    light: frozenset[Side]
    inner_m: float
    outer_m: float


@dataclass(frozen=True)
class Cell:
    """A rectangle of a layout, up to the centre lines of its walls, and the number of its room."""

    rect: Rect
    room: int


@dataclass(frozen=True)
class Join:
    """A way that a layout wants between two rooms; a wide one has no leaf and as much of the wall as it may take."""

    one: int
    other: int
    wide: bool = False


@dataclass(frozen=True)
class Layout:
    """Rooms by label, the cells that they consist of, and the ways between them.

    ``entrance`` is the cell in whose outer wall, on the given side, the front door is.
    """

    labels: tuple[str, ...]
    cells: tuple[Cell, ...]
    joins: tuple[Join, ...]
    entrance: tuple[int, Side]


@dataclass(frozen=True)
class Doorway:
    """A doorway through a wall: the area that it frees, and the rooms on both sides; None is the outside."""

    rect: Rect
    rooms: tuple[int, int | None]


@dataclass(frozen=True)
class Window:
    """A window: the part of the wall that it takes, its room, and the heights of its sill and head."""

    rect: Rect
    room: int
    sill_m: float
    head_m: float


@dataclass(frozen=True, eq=False)
class SoundHome:
    """One storey: rooms as inner polygons with their labels, doors, front doors, windows, walls.

    ``balconies`` are the numbers of the rooms outside; their walls are parapets of ``inner_m``.
    """

    id: str
    kind: str
    labels: tuple[str, ...]
    rooms: tuple[shapely.Polygon, ...]
    doors: tuple[Doorway, ...]
    fronts: tuple[Doorway, ...]
    windows: tuple[Window, ...]
    balconies: tuple[int, ...]
    inner_m: float
    outer_m: float
