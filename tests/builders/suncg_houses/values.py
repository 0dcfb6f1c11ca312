"""Hold a test house during its generation, from wanted rooms (Spec) to storeys; metres, plan axes (X, Z) of SUNCG's.

While rooms are laid out, lengths are centimetres, and so is ``Spec.side``.

Where the walls lie: the cells of a storey share their borders, and a border is the centre line of the wall on it. Each
cell brings a pair of slabs for each of its edges, 0.05 m on either side of the line; where two rooms meet, the two
pairs coincide (or nearly so: some are shifted or skewed). A wall is therefore 0.10 m thick or a little more, and a
room's inner polygon is its cell less all slabs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import shapely

Point: TypeAlias = tuple[float, float]
Use: TypeAlias = Literal["room", "corridor", "shaft", "garage"]
Part: TypeAlias = tuple[float, float]
"""A part of an edge: from, to, in metres along it."""

SLAB_M = 0.05
WINDOW_LOW_M, WINDOW_HEAD_M = 0.87, 2.23


@dataclass(frozen=True)
class RoomSpec:
    """A room that is wanted: SUNCG's words for it, net area in m2, and the narrowest it may be, in cm."""

    words: tuple[str, ...]
    area: float
    side: int


@dataclass(frozen=True, eq=False)
class Cell:
    """A space up to the centre lines of its walls. A shaft has no door; a garage stands apart."""

    polygon: shapely.Polygon
    words: tuple[str, ...]
    use: Use = "room"


@dataclass(frozen=True)
class Opening:
    """A hole through a wall, centred on its centre line, ``direction`` along it; ``cells`` (i, None) leads outside."""

    kind: Literal["door", "entrance", "window"]
    centre: Point
    direction: Point
    width: float
    cells: tuple[int, int | None]


@dataclass(frozen=True)
class Wall:
    """A pair of slabs: from ``start`` along ``direction`` (unit), its cell on the left.

    ``ends`` reach past start and end to close corners; ``shift`` moves the pair to the left, ``skew`` (radians) turns
    it about its middle; ``missing`` are the parts that are not built (an open front).
    """

    cell: int
    start: Point
    direction: Point
    length: float
    ends: tuple[float, float] = (0.0, 0.0)
    shift: float = 0.0
    skew: float = 0.0
    missing: tuple[Part, ...] = ()


@dataclass(frozen=True)
class PlacedItem:
    """A piece of furniture or a door leaf: model, where it stands (plan), how it is turned (radians), its cell."""

    model: str
    centre: Point
    angle: float
    cell: int | None


@dataclass(frozen=True, eq=False)
class Storey:
    """One level of a house."""

    cells: tuple[Cell, ...] = ()
    walls: tuple[Wall, ...] = ()
    openings: tuple[Opening, ...] = ()
    items: tuple[PlacedItem, ...] = ()
    has_floor: bool = True
    difficulties: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class House:
    """A scene: its storeys from the ground up."""

    id: str
    storeys: tuple[Storey, ...]
    storey_height: float = 2.8
