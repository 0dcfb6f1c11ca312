"""The parts of a floor plan: frozen values, checked when made."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan import checks
from houseexpo.plan.categories import LABELS, UNLABELLED
from houseexpo.plan.value import Value

if TYPE_CHECKING:
    from shapely import Polygon

Ring: TypeAlias = npt.NDArray[np.float64]
"""(n, 2) vertices in metres, unclosed (the first is not repeated)."""

DoorKind: TypeAlias = Literal["door", "opening", "entrance", "cut"]
Box: TypeAlias = tuple[float, float, float, float]

DOOR_KINDS: tuple[DoorKind, ...] = get_args(DoorKind)

RADII_M: Final = (0.10, 0.15, 0.20, 0.25, 0.30, 0.35)
"""Radii of robots for which a plan's file records what they reach."""


@dataclass(frozen=True)
class Frame:
    """Where a plan stands in its source: ``matrix`` takes plan metres (x, y, 1) to the source's plan axes in metres.

    The plan axes are (X, Y) of a z-up source, (X, Z) of a y-up one; ``floor`` is the level's height in the source.
    ``houseexpo.grids.frame`` applies it.
    """

    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    up: Literal["y", "z"]
    floor: float
    level: int

    def __post_init__(self) -> None:
        if len(self.matrix) != 2:
            raise PlanError(f"expected 2 rows of 3 numbers, found {len(self.matrix)}", "matrix")
        (a, b, _), (c, d, _) = matrix = tuple(checks.numbers(r, 3, f"matrix[{i}]") for i, r in enumerate(self.matrix))
        if a * d == b * c:
            raise PlanError("expected a matrix that can be inverted, found determinant 0", "matrix")
        object.__setattr__(self, "matrix", matrix)
        checks.one_of(self.up, ("y", "z"), "up")
        object.__setattr__(self, "floor", checks.number(self.floor, "floor"))
        checks.number(self.level, "level")


@dataclass(frozen=True)
class Navigability:
    """What a disc robot of one radius can reach (docs/format.md, "Our keys"); ``analysis.navigability`` measures it."""

    components: int
    largest_share: float
    narrowest: float

    def __post_init__(self) -> None:
        checks.count(self.components, "components")
        checks.number(self.largest_share, "largest_share")
        checks.number(self.narrowest, "narrowest")


class Reach(Mapping[str, Navigability]):
    """What a plan's file records for some robot radii, by their two decimals; empty, and false, where it says nothing.

    Equal to any mapping with the same items.
    """

    __slots__ = ("_known",)

    def __init__(self, known: Mapping[str, Navigability] | None = None) -> None:
        self._known: dict[str, Navigability] = dict(known or {})

    def __getitem__(self, radius: str) -> Navigability:
        return self._known[radius]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def __call__(self, radius_m: float) -> Navigability:
        """Return what a disc of this radius, metres, reaches: as recorded; that of a ``FloorPlan`` measures others."""
        if not 0 <= radius_m < math.inf:
            raise PlanError(f"expected a radius of 0 m or more, found {radius_m!r}", "navigability")
        key = f"{radius_m:.2f}"
        if key in self._known and float(key) == radius_m:
            return self._known[key]
        return self._unknown(radius_m)

    def _unknown(self, radius_m: float) -> Navigability:
        found = f"{radius_m:.2f}"
        raise PlanError(f"expected one of {sorted(self._known)}, found {found!r}; no plan is bound", "navigability")

    def __reduce__(self) -> tuple[Any, ...]:
        return Reach, (self._known,)  # the plan that holds it binds it again

    def __repr__(self) -> str:
        return f"Reach({self._known!r})"


@dataclass(frozen=True, eq=False)
class Room(Value):
    """A room: refined free space with the doors closed.

    ``label`` is one of the 25 or "Unlabelled"; ``source_labels`` keeps the source's own words.
    """

    id: int
    label: str
    ring: Ring
    holes: tuple[Ring, ...] = ()
    source_labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        checks.count(self.id, "id")
        checks.one_of(self.label, (*LABELS, UNLABELLED), "label")
        self._set("ring", checks.ring(self.ring, "polygon"))
        self._set("holes", checks.rings(self.holes, "holes"))
        self._set("source_labels", tuple(self.source_labels))

    @cached_property
    def polygon(self) -> Polygon:
        """The room as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring, self.holes)

    @property
    def area(self) -> float:
        """Square metres."""
        return float(self.polygon.area)

    def __repr__(self) -> str:
        return f"Room({self.id}, {self.label!r}, {self.area:.2f} m2)"


@dataclass(frozen=True, eq=False)
class Door(Value):
    """A passage between two rooms, or a closed one to the outside (kind "entrance", ``rooms[1]`` is None).

    ``segment`` runs from jamb to jamb on the wall's centre line; ``polygon`` is the freed area between its two faces.
    """

    id: int
    kind: DoorKind
    segment: tuple[tuple[float, float], tuple[float, float]]
    width: float
    ring: Ring
    rooms: tuple[int | None, int | None]

    def __post_init__(self) -> None:
        checks.count(self.id, "id")
        checks.one_of(self.kind, DOOR_KINDS, "kind")
        if len(self.segment) != 2:
            raise PlanError(f"expected the two ends of the opening, found {len(self.segment)}", "segment")
        self._set("segment", tuple(checks.numbers(end, 2, f"segment[{i}]") for i, end in enumerate(self.segment)))
        self._set("width", checks.number(self.width, "width"))
        self._set("ring", checks.ring(self.ring, "polygon"))
        self._set("rooms", tuple(self.rooms))
        inside = sum(isinstance(room, int) for room in self.rooms)
        if len(self.rooms) != 2 or self.rooms[0] is None or inside != (1 if self.kind == "entrance" else 2):
            expected = "[room, null]" if self.kind == "entrance" else "two room ids"
            raise PlanError(f"expected {expected} for kind {self.kind!r}, found {list(self.rooms)}", "rooms")

    @cached_property
    def polygon(self) -> Polygon:
        """The freed area as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring)

    def __repr__(self) -> str:
        return f"Door({self.id}, {self.kind!r}, {self.width:.2f} m, rooms {self.rooms[0]} and {self.rooms[1]})"


@dataclass(frozen=True, eq=False)
class PlanObject(Value):
    """A piece of furniture: its footprint, metres, its height above the floor, and the room that it stands in.

    ``label`` is the source's own word, or "object" where it has none. ``room`` is None where its middle lies in no
    room. The footprint is an obstacle too: a hole of the plan's outline, or cut out of it where it touches a wall.
    """

    id: int
    label: str
    room: int | None
    ring: Ring
    height: float

    def __post_init__(self) -> None:
        checks.count(self.id, "id")
        checks.text(self.label, "label")
        if self.room is not None:
            checks.count(self.room, "room")
        self._set("ring", checks.ring(self.ring, "polygon"))
        self._set("height", checks.number(self.height, "height"))
        if self.height < 0:
            raise PlanError(f"expected metres, 0 or more, found {self.height}", "height")

    @cached_property
    def polygon(self) -> Polygon:
        """The footprint as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring)

    def __repr__(self) -> str:
        return f"PlanObject({self.id}, {self.label!r}, {self.height:.2f} m high, room {self.room})"
