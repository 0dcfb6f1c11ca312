"""Hold the parts of a sound home. Metres, x right, y up.

While a home is laid out, a cell reaches to the centre lines of its walls (``Cell.rect``). An outer wall counts as an
inner one there; it is thicker only outwards. A room consists of one cell or of several that join without a wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
import shapely

from pipeline.sources.homes.values import Rect
from pipeline.sources.sound_homes.stairs import Stair, Step

Side: TypeAlias = Literal["west", "south", "east", "north"]
SIDES: Final[tuple[Side, ...]] = ("west", "south", "east", "north")
"""In the order of a rectangle's numbers."""

Option = TypeVar("Option")

OUTDOORS: Final = frozenset({"Balcony", "Terrace"})
SLEEPING: Final = frozenset({"Bedroom", "Child_Room"})
LIT: Final = SLEEPING | {"Living_Room", "Dining_Room", "Kitchen", "Office"}
"""Habitable rooms, which need daylight."""

HALL: Final = 0
"""The number of the hall among the rooms of a layout."""
ENTRYWAY: Final = "Entryway"
STAIRS: Final = "Stairs"
"""What a layout calls the room of a stair; it is no label of a plan."""


def pick(options: Sequence[Option], rng: np.random.Generator) -> Option:
    """Return one of the options, each as likely; ``rng.choice`` draws the same in ten times as long."""
    return options[int(rng.integers(len(options)))]


@dataclass(frozen=True)
class RoomWish:
    """A room that is asked for; ``behind`` is the place of the room in the programme that alone leads to it."""

    label: str
    area_m2: float
    behind: int | None = None


@dataclass(frozen=True)
class Programme:
    """What a household asks for: the kind of dwelling, its rooms, the sides with light, the thickness of its walls.

    Of a house of several storeys, ``rooms`` holds what lies outside only, and of one with a ``courtyard`` nothing; the
    layout draws the others.
    ``vestibule`` says that a door parts the entry from the hall, if there is an entry. ``hall_m`` is the clear width of
    the corridor. ``off_living`` asks for a bedroom off the living room.
    """

    kind: str
    rooms: tuple[RoomWish, ...]
    light: frozenset[Side]
    inner_m: float
    outer_m: float
    storeys: int = 1
    vestibule: bool = False
    hall_m: float = 1.2
    off_living: bool = False
    courtyard: bool = False


class Cell(NamedTuple):
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
    """Rooms of a storey by label, the area that is asked for each (0 for none), their cells, the ways between them.

    ``entrance`` is the cell in whose outer wall, on the given side, the front door is; None on an upper storey.
    ``stair_up`` leads to the storey above. ``stair_down`` comes up here; the room called STAIRS is the opening in the
    floor over it. ``court`` is a courtyard that cells surround, up to the centre lines of their walls; from the room
    ``day_room`` and from the hall one steps into it.
    """

    labels: tuple[str, ...]
    areas_m2: tuple[float, ...]
    cells: tuple[Cell, ...]
    joins: tuple[Join, ...]
    entrance: tuple[int, Side] | None
    stair_up: Stair | None = None
    stair_down: Stair | None = None
    court: Rect | None = None
    day_room: int | None = None


@dataclass(frozen=True)
class Doorway:
    """A doorway through a wall: the area that it frees, and the rooms on both sides; None is the outside.

    An open one has no leaf.
    """

    rect: Rect
    rooms: tuple[int, int | None]
    is_open: bool = False


@dataclass(frozen=True)
class Window:
    """A window: the part of the wall that it takes, its room, and the heights of its sill and head."""

    rect: Rect
    room: int
    sill_m: float
    head_m: float


@dataclass(frozen=True, eq=False)
class Storey:
    """One storey: rooms as inner polygons with their labels, doors, front doors, windows.

    ``balconies`` are the numbers of the rooms outside; their walls are parapets. ``steps`` lead up from here.
    ``void`` is the opening in the floor over the stair from below, with the edge of it at which the landing is.
    """

    labels: tuple[str, ...]
    rooms: tuple[shapely.Polygon, ...]
    doors: tuple[Doorway, ...]
    fronts: tuple[Doorway, ...]
    windows: tuple[Window, ...]
    balconies: tuple[int, ...]
    steps: tuple[Step, ...] = ()
    void: Void | None = None


class Void(NamedTuple):
    """An opening in the floor, the railing along its edge at the landing, and the free end of that edge."""

    area: shapely.Polygon
    railing: shapely.Polygon
    landing: shapely.Polygon


@dataclass(frozen=True, eq=False)
class SoundHome:
    """A home: its storeys from the ground up, every ``stairs.STOREY_M``, and the thickness of its walls."""

    id: str
    kind: str
    storeys: tuple[Storey, ...]
    inner_m: float
    outer_m: float
