"""Define the parts of a plan as frozen values: room, door, furniture, frame, quality and others.

They are checked on construction and compared by value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan import checks
from houseexpo.plan.room_labels import LABELS, UNLABELLED

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

Ring: TypeAlias = npt.NDArray[np.float64]
"""The vertices of a ring (n, 2), metres; the first one is not repeated at the end."""

DoorKind: TypeAlias = Literal["door", "opening", "entrance", "cut", "window"]
Box: TypeAlias = tuple[float, float, float, float]

DOOR_KINDS: tuple[DoorKind, ...] = get_args(DoorKind)

RADII_M: Final = (0.10, 0.15, 0.20, 0.25, 0.30, 0.35)
"""Radii of robots, metres, for which a plan's file records the navigability."""


SURE: Final = 0.8
"""A plan with a lower score is doubtful."""
UNSURE: Final = 0.5
"""A room or door whose confidence is below this is more likely wrong than right; pictures show it as unsure."""
_LONGEST_ROOM_NAME: Final = 60  # characters of a source's name of a room; a longer text is no name


def signed_area(ring: npt.NDArray[np.float64]) -> float:
    """Return the area in m2 of a ring (n, 2) by the shoelace formula, negative if it runs clockwise."""
    x, y = (ring - ring[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


class FrozenValue:
    """Base of a frozen dataclass made with ``eq=False``."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _same(self._values(), other._values())

    def __hash__(self) -> int:
        return hash((type(self), getattr(self, "id", None)))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._values()

    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]  # subclasses are dataclasses

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Frame:
    """The position of a plan in its source.

    ``matrix`` (2 x 3) maps a point (x, y, 1) of the plan, metres, to the source's plan axes, metres. These axes are
    (X, Y) if the source's vertical axis, ``up``, is "z", and (X, Z) if it is "y". ``floor`` is the height of the
    level's floor in the source, metres, and ``level`` the number of the level. ``houseexpo.grids.frame`` applies the
    matrix.
    """

    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    up: Literal["y", "z"]
    floor: float
    level: int

    def __post_init__(self) -> None:
        if len(self.matrix) != 2:
            raise PlanError(f"expected 2 rows of 3 numbers, found {len(self.matrix)}", "matrix")
        (a, b, _), (c, d, _) = matrix = tuple(
            checks.check_numbers(r, 3, f"matrix[{i}]") for i, r in enumerate(self.matrix)
        )
        if a * d == b * c:
            raise PlanError("expected a matrix that can be inverted, found determinant 0", "matrix")
        object.__setattr__(self, "matrix", matrix)
        checks.check_word(self.up, ("y", "z"), "up")
        object.__setattr__(self, "floor", checks.to_finite_float(self.floor, "floor"))
        checks.to_finite_float(self.level, "level")


@dataclass(frozen=True)
class Navigability:
    """The areas that a disc robot of one radius can reach, in figures (docs/format.md, "Our keys").

    ``components`` is the number of separate areas, ``largest_share`` the largest one's share of their total area, 0 to
    1, and ``narrowest`` the width of its narrowest passage, metres. ``houseexpo.navigability`` measures them.
    """

    components: int
    largest_share: float
    narrowest: float

    def __post_init__(self) -> None:
        checks.check_count(self.components, "components")
        checks.to_finite_float(self.largest_share, "largest_share")
        checks.to_finite_float(self.narrowest, "narrowest")


class NavigabilityByRadius(Mapping[str, Navigability]):
    """The navigability that a plan's file records, by robot radius in metres with two decimals (``"0.20"``).

    It is empty, and false, if the file records no navigability. It is equal to any mapping with the same items.
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
        """Return the navigability for a radius in metres; a ``FloorPlan`` measures it if it is not recorded.

        Raises
        ------
        PlanError
            The radius is negative or not finite, or it is not recorded and there is no plan to measure.
        """
        if not 0 <= radius_m < math.inf:
            raise PlanError(f"expected a radius of 0 m or more, found {radius_m!r}", "navigability")
        key = f"{radius_m:.2f}"
        if key in self._known and float(key) == radius_m:
            return self._known[key]
        return self._missing_radius(radius_m)

    def _missing_radius(self, radius_m: float) -> Navigability:
        found = f"{radius_m:.2f}"
        raise PlanError(f"expected one of {sorted(self._known)}, found {found!r}; no plan is bound", "navigability")

    def __reduce__(self) -> tuple[Any, ...]:
        return NavigabilityByRadius, (self._known,)  # the plan that contains it binds it again

    def __repr__(self) -> str:
        return f"NavigabilityByRadius({self._known!r})"


@dataclass(frozen=True, eq=False)
class Room(FrozenValue):
    """A room: an area of the free space, bounded by walls and closed doors.

    ``label`` is one of the 25 published labels or "Unlabelled"; ``source_labels`` are the source's own words. ``ring``
    (n, 2) and ``holes`` are in metres. ``confidence`` is the probability, 0 to 1, that the outline is right; it is None
    in plans that the pipeline has not rated.
    """

    id: int
    label: str
    ring: Ring
    holes: tuple[Ring, ...] = ()
    source_labels: tuple[str, ...] = ()
    confidence: float | None = None

    def __post_init__(self) -> None:
        checks.check_count(self.id, "id")
        checks.check_word(self.label, (*LABELS, UNLABELLED), "label")
        self._set("ring", checks.check_ring(self.ring, "polygon"))
        self._set("holes", checks.check_rings(self.holes, "holes"))
        self._set("source_labels", tuple(self.source_labels))
        if self.confidence is not None:
            self._set("confidence", checks.check_share(self.confidence, "confidence"))

    def with_furniture(self, objects: Iterable[PlanObject]) -> BaseGeometry:
        """Return the area of the room, metres, with that of its furniture, which is cut out of it."""
        import shapely

        own = [thing.polygon for thing in objects if thing.room == self.id]
        return shapely.union_all([self.polygon, *own]) if own else self.polygon

    @property
    def name(self) -> str:
        """The label in words; without a label, the source's own words in one line; without those, ""."""
        if self.label != UNLABELLED:
            return self.label.replace("_", " ")
        words = [word for word in self.source_labels if any(letter.isalpha() for letter in word)]  # numbers say less
        said = " / ".join(words or self.source_labels[:1])[:_LONGEST_ROOM_NAME].replace("_", " ")
        return " ".join("".join(letter if letter.isprintable() else " " for letter in said).split()).capitalize()

    @cached_property
    def polygon(self) -> Polygon:
        """The room as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring, self.holes)

    @property
    def is_unsure(self) -> bool:
        """Whether the outline is rated, and more likely wrong than right."""
        return self.confidence is not None and self.confidence < UNSURE

    @property
    def area(self) -> float:
        """Area of the room, square metres."""
        return float(self.polygon.area)

    def __repr__(self) -> str:
        return f"Room({self.id}, {self.label!r}, {self.area:.2f} m²)"


@dataclass(frozen=True, eq=False)
class Door(FrozenValue):
    """A hole in a wall: a passage between two rooms, a closed door to the outside (kind "entrance"), or a window.

    ``segment`` runs from jamb to jamb on the wall's centre line and is ``width`` metres long. ``ring`` (n, 2), metres,
    bounds the hole between the two faces of the wall. ``rooms`` are the ids of the rooms on both sides; ``rooms[1]`` is
    None for the outside, which an entrance leads to and a window may look at. ``confidence`` is the probability, 0 to
    1, that there is a passage; it is None in plans that the pipeline has not rated. ``sill`` and ``head`` are the
    heights between which a window is open, metres above the floor, None where they are not known.
    """

    id: int
    kind: DoorKind
    segment: tuple[tuple[float, float], tuple[float, float]]
    width: float
    ring: Ring
    rooms: tuple[int | None, int | None]
    confidence: float | None = None
    sill: float | None = None
    head: float | None = None

    def __post_init__(self) -> None:
        checks.check_count(self.id, "id")
        checks.check_word(self.kind, DOOR_KINDS, "kind")
        if len(self.segment) != 2:
            raise PlanError(f"expected the two ends of the opening, found {len(self.segment)}", "segment")
        self._set("segment", tuple(checks.check_numbers(end, 2, f"segment[{i}]") for i, end in enumerate(self.segment)))
        self._set("width", checks.to_finite_float(self.width, "width"))
        self._set("ring", checks.check_ring(self.ring, "polygon"))
        self._set("rooms", tuple(self.rooms))
        if self.confidence is not None:
            self._set("confidence", checks.check_share(self.confidence, "confidence"))
        heights = {name: getattr(self, name) for name in ("sill", "head") if getattr(self, name) is not None}
        for name, height in heights.items():
            self._set(name, checks.to_finite_float(height, name))
        if heights and (self.kind != "window" or not 0 <= heights.get("sill", 0) < heights.get("head", math.inf)):
            raise PlanError(f"expected metres of a window, 0 <= sill < head, found {heights}", "sill")
        inside = sum(isinstance(room, int) for room in self.rooms)
        expected = {"entrance": "[room, null]", "window": "a room id, and another or null"}
        counts = {"entrance": (1,), "window": (1, 2)}
        if len(self.rooms) != 2 or self.rooms[0] is None or inside not in counts.get(self.kind, (2,)):
            said = expected.get(self.kind, "two room ids")
            raise PlanError(f"expected {said} for kind {self.kind!r}, found {list(self.rooms)}", "rooms")

    @cached_property
    def polygon(self) -> Polygon:
        """The hole between the faces of the wall as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring)

    @property
    def is_unsure(self) -> bool:
        """Whether the passage is rated, and more likely absent than there."""
        return self.confidence is not None and self.confidence < UNSURE

    def __repr__(self) -> str:
        return f"Door({self.id}, {self.kind!r}, {self.width:.2f} m, rooms {self.rooms[0]} and {self.rooms[1]})"


@dataclass(frozen=True, eq=False)
class PlanObject(FrozenValue):
    """A piece of furniture: its footprint, its height above the floor in metres, and the id of its room.

    ``label`` is the source's own word, or "object" without such a word. ``room`` is None if the object's centre lies in
    no room. The footprint, ``ring`` (n, 2) in metres, is also an obstacle: it is a hole of the plan's outline, or a
    notch in the outline if it touches a wall. The opening in the floor over a stair from below is one, too
    (``is_stairwell``).
    """

    id: int
    label: str
    room: int | None
    ring: Ring
    height: float

    def __post_init__(self) -> None:
        checks.check_count(self.id, "id")
        checks.check_text(self.label, "label")
        if self.room is not None:
            checks.check_count(self.room, "room")
        self._set("ring", checks.check_ring(self.ring, "polygon"))
        self._set("height", checks.to_finite_float(self.height, "height"))
        if self.height < 0:
            raise PlanError(f"expected metres, 0 or more, found {self.height}", "height")

    @cached_property
    def polygon(self) -> Polygon:
        """The footprint as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.ring)

    @property
    def is_stairwell(self) -> bool:
        """Whether it is the opening in the floor over a stair from below, which is in no room."""
        return self.room is None and self.label == "stairs"

    def __repr__(self) -> str:
        return f"PlanObject({self.id}, {self.label!r}, {self.height:.2f} m high, room {self.room})"


@dataclass(frozen=True, eq=False)
class Quality(FrozenValue):
    """The confidence in a plan: a ``score`` from 0 to 1, and the ``grounds`` that it is based on.

    A ground is a named number, such as the share of doors that are cuts. Grounds are sorted by name, so that equal
    grounds are written as equal bytes.

    Examples
    --------
    >>> Quality(0.93, {"cut_share": 0.0, "guessed_wall_share": 0.1}).is_doubtful
    False
    """

    score: float
    grounds: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._set("score", checks.check_share(self.score, "score"))
        for name in self.grounds:
            checks.check_text(name, "grounds")
        grounds = {name: checks.to_finite_float(self.grounds[name], f"grounds.{name}") for name in sorted(self.grounds)}
        self._set("grounds", grounds)

    @property
    def is_doubtful(self) -> bool:
        """Whether the score is below ``SURE``."""
        return self.score < SURE


def _same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, comparing arrays, also inside tuples, by value."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)
