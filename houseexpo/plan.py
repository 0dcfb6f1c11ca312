"""The floor plan: frozen values, checked when made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from houseexpo import checks
from houseexpo.categories import LABELS, UNLABELLED
from houseexpo.errors import PlanError
from houseexpo.repair import even_odd
from houseexpo.value import Value

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Ring: TypeAlias = npt.NDArray[np.float64]
"""(n, 2) vertices in metres, unclosed (the first is not repeated)."""

DoorKind: TypeAlias = Literal["door", "opening", "entrance", "cut"]
Box: TypeAlias = tuple[float, float, float, float]

DOOR_KINDS: tuple[DoorKind, ...] = get_args(DoorKind)


@dataclass(frozen=True)
class Frame:
    """Where a plan stands in its source: ``matrix`` takes plan metres (x, y, 1) to the source's plan axes in metres.

    The plan axes are (X, Y) of a z-up source, (X, Z) of a y-up one; ``floor`` is the level's height in the source.
    ``houseexpo.frame`` applies it.
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
    """What a disc robot of one radius can reach (FORMAT.md section 2); ``houseexpo.graph`` measures it."""

    components: int
    largest_share: float
    narrowest: float

    def __post_init__(self) -> None:
        checks.count(self.components, "components")
        checks.number(self.largest_share, "largest_share")
        checks.number(self.narrowest, "narrowest")


@dataclass(frozen=True, eq=False)
class Room(Value):
    """A room: refined free space with the doors closed.

    ``label`` is one of the 25 or "Unlabelled"; ``source_labels`` keeps the source's own words.
    """

    id: int
    label: str
    polygon: Ring
    holes: tuple[Ring, ...] = ()
    source_labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        checks.count(self.id, "id")
        checks.one_of(self.label, (*LABELS, UNLABELLED), "label")
        self._set("polygon", checks.ring(self.polygon, "polygon"))
        self._set("holes", checks.rings(self.holes, "holes"))
        self._set("source_labels", tuple(self.source_labels))

    @cached_property
    def shape(self) -> Polygon:
        """The room as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.polygon, self.holes)

    @property
    def area(self) -> float:
        """Square metres."""
        return float(self.shape.area)

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
    polygon: Ring
    rooms: tuple[int | None, int | None]

    def __post_init__(self) -> None:
        checks.count(self.id, "id")
        checks.one_of(self.kind, DOOR_KINDS, "kind")
        if len(self.segment) != 2:
            raise PlanError(f"expected the two ends of the opening, found {len(self.segment)}", "segment")
        self._set("segment", tuple(checks.numbers(end, 2, f"segment[{i}]") for i, end in enumerate(self.segment)))
        self._set("width", checks.number(self.width, "width"))
        self._set("polygon", checks.ring(self.polygon, "polygon"))
        self._set("rooms", tuple(self.rooms))
        inside = sum(isinstance(room, int) for room in self.rooms)
        if len(self.rooms) != 2 or self.rooms[0] is None or inside != (1 if self.kind == "entrance" else 2):
            expected = "[room, null]" if self.kind == "entrance" else "two room ids"
            raise PlanError(f"expected {expected} for kind {self.kind!r}, found {list(self.rooms)}", "rooms")

    @cached_property
    def shape(self) -> Polygon:
        """The freed area as a shapely polygon, metres."""
        from shapely import Polygon

        return Polygon(self.polygon)

    def __repr__(self) -> str:
        return f"Door({self.id}, {self.kind!r}, {self.width:.2f} m, rooms {self.rooms[0]} and {self.rooms[1]})"


@dataclass(frozen=True, eq=False)
class FloorPlan(Value):
    """One floor plan of the data set (FORMAT.md), published or ours.

    ``verts`` stays as published; shapes and finiteness are checked when a plan is made (PlanError), simple geometry is
    not: 1,285 published rings touch or cross themselves. ``outline`` and ``free_space`` are valid in any case.

    Examples
    --------
    >>> plan = FloorPlan("square", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
    >>> plan
    FloorPlan('square', 16.0 m2, 4.0 x 4.0 m, 4 vertices, room_num 1)
    >>> plan.bbox
    (0.1, 0.1, 4.1, 4.1)
    """

    id: str
    verts: Ring
    room_num: int
    room_category: Mapping[str, tuple[Box, ...]]
    holes: tuple[Ring, ...] = ()
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    frame: Frame | None = None
    navigability: Mapping[str, Navigability] | None = None
    provenance: Mapping[str, Any] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        checks.plan_id(self.id)
        try:
            self._check()
        except PlanError as error:
            raise error.within(plan=self.id) from None

    def _check(self) -> None:
        self._set("verts", checks.ring(self.verts, "verts"))
        self._set("room_num", checks.count(self.room_num, "room_num"))
        self._set("room_category", _boxes(self.room_category))
        self._set("holes", checks.rings(self.holes, "holes"))
        self._set("rooms", tuple(self.rooms))
        self._set("doors", tuple(self.doors))
        checks.unique((room.id for room in self.rooms), "rooms")
        checks.unique((door.id for door in self.doors), "doors")
        known = {room.id for room in self.rooms}
        for i, door in enumerate(self.doors):
            if not known.issuperset(room for room in door.rooms if room is not None):
                raise PlanError(f"expected ids of rooms {sorted(known)}, found {list(door.rooms)}", f"doors[{i}].rooms")

    @property
    def bbox(self) -> Box:
        """(x_min, y_min, x_max, y_max) of ``verts``, metres."""
        low, high = self.verts.min(axis=0), self.verts.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    @cached_property
    def outline(self) -> Polygon | MultiPolygon:
        """What ``verts`` encloses, metres; a ring that touches or crosses itself is repaired by the even-odd rule."""
        return even_odd(self.verts, ())

    @cached_property
    def free_space(self) -> Polygon | MultiPolygon:
        """The outline less the holes, metres, repaired as ``outline`` is."""
        return even_odd(self.verts, self.holes) if self.holes else self.outline

    @property
    def area(self) -> float:
        """Free space, square metres."""
        return float(self.free_space.area)

    def room(self, room_id: int) -> Room:
        """Return the room of this id; PlanError where there is none."""
        for room in self.rooms:
            if room.id == room_id:
                return room
        raise PlanError(f"expected one of {[r.id for r in self.rooms]}, found {room_id!r}", "rooms", self.id)

    def moved(self, dx: float, dy: float) -> FloorPlan:
        """Return the plan shifted by (dx, dy) metres; its frame still leads to the same place in the source."""
        by = np.array([dx, dy])
        frame = self.frame
        if frame is not None:
            (a, b, tx), (c, d, ty) = frame.matrix
            frame = replace(frame, matrix=((a, b, tx - a * dx - b * dy), (c, d, ty - c * dx - d * dy)))
        boxes = {
            label: tuple((x1 + dx, y1 + dy, x2 + dx, y2 + dy) for x1, y1, x2, y2 in found)
            for label, found in self.room_category.items()
        }
        return replace(
            self,
            verts=self.verts + by,
            room_category=boxes,
            holes=tuple(hole + by for hole in self.holes),
            rooms=tuple(replace(r, polygon=r.polygon + by, holes=tuple(h + by for h in r.holes)) for r in self.rooms),
            doors=tuple(
                replace(d, polygon=d.polygon + by, segment=tuple((x + dx, y + dy) for x, y in d.segment))  # type: ignore[arg-type]
                for d in self.doors
            ),
            frame=frame,
        )

    def centred(self) -> FloorPlan:
        """Return the plan with its origin at the centroid of the free space, as the paper's text has it."""
        centre = self.free_space.centroid
        return self.moved(-centre.x, -centre.y)

    def _repr_svg_(self) -> str:
        """Show the plan in a notebook."""
        from houseexpo.drawing import svg

        return svg(self, size=480)

    def __repr__(self) -> str:
        x1, y1, x2, y2 = self.bbox
        parts = [f"{self.area:.1f} m2", f"{x2 - x1:.1f} x {y2 - y1:.1f} m", f"{len(self.verts)} vertices"]
        parts += [f"room_num {self.room_num}"]
        parts += [f"{len(found)} {name}" for name in ("holes", "rooms", "doors") if (found := getattr(self, name))]
        return f"FloorPlan({self.id!r}, {', '.join(parts)})"


def _boxes(category: Mapping[str, Iterable[Any]]) -> dict[str, tuple[Box, ...]]:
    """Label -> boxes (x1, y1, x2, y2), all finite; the order of the labels is kept."""
    checked: dict[str, tuple[Box, ...]] = {}
    for label, boxes in category.items():
        key = f"room_category.{label}"
        checked[label] = tuple(checks.numbers(box, 4, f"{key}[{i}]") for i, box in enumerate(boxes))  # type: ignore[misc]
    return checked
