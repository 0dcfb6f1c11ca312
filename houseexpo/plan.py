"""The floor plan: frozen values, checked when made; what is computed from them is asked for with its methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from houseexpo import checks
from houseexpo.errors import PlanError
from houseexpo.parts import DOOR_KINDS, Box, Door, DoorKind, Frame, Navigability, PlanObject, Reach, Ring, Room
from houseexpo.quality import Quality
from houseexpo.repair import Repair, even_odd, repair_of
from houseexpo.value import Value

if TYPE_CHECKING:
    import networkx as nx
    from shapely import MultiPolygon, Polygon

    from houseexpo.frame import GridFrame

__all__ = [
    "DOOR_KINDS",
    "Box",
    "Door",
    "DoorKind",
    "FloorPlan",
    "Frame",
    "Navigability",
    "PlanObject",
    "Quality",
    "Reach",
    "Ring",
    "Room",
]

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class FloorPlan(Value):
    """One floor plan of the data set (FORMAT.md), published or ours.

    ``verts`` stays as published; shapes and finiteness are checked when a plan is made (PlanError), simple geometry is
    not: 1,285 published rings touch or cross themselves. ``outline`` and ``free_space`` are valid in any case, and
    ``repair`` says what it took.

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
    navigability: Reach = field(default_factory=Reach, repr=False)
    provenance: Mapping[str, Any] | None = field(default=None, repr=False)
    quality: Quality | None = field(default=None, repr=False)
    objects: tuple[PlanObject, ...] = ()

    def __post_init__(self) -> None:
        checks.plan_id(self.id)
        try:
            self._check()
        except PlanError as error:
            raise error.within(plan=self.id) from None

    def _check(self) -> None:
        self._set("verts", checks.ring(self.verts, "verts"))
        self._set("room_num", checks.count(self.room_num, "room_num"))
        self._set("room_category", checks.boxes(self.room_category, "room_category"))
        self._set("holes", checks.rings(self.holes, "holes"))
        self._set("rooms", tuple(self.rooms))
        self._set("doors", tuple(self.doors))
        self._set("objects", tuple(self.objects))
        space = partial(even_odd, self.verts, self.holes)  # not a method of self: a cycle would outlive the plan
        self._set("navigability", Reach(self.navigability, space))
        checks.unique((room.id for room in self.rooms), "rooms")
        checks.unique((door.id for door in self.doors), "doors")
        checks.unique((thing.id for thing in self.objects), "objects")
        known = {room.id for room in self.rooms}
        for i, door in enumerate(self.doors):
            if not known.issuperset(room for room in door.rooms if room is not None):
                raise PlanError(f"expected ids of rooms {sorted(known)}, found {list(door.rooms)}", f"doors[{i}].rooms")
        for i, thing in enumerate(self.objects):
            if thing.room is not None and thing.room not in known:
                raise PlanError(f"expected null or one of {sorted(known)}, found {thing.room}", f"objects[{i}].room")

    @cached_property
    def bbox(self) -> Box:
        """(x_min, y_min, x_max, y_max) of ``verts``, metres."""
        (x1, y1), (x2, y2) = self.verts.min(axis=0).tolist(), self.verts.max(axis=0).tolist()
        return x1, y1, x2, y2

    @cached_property
    def outline(self) -> Polygon | MultiPolygon:
        """What ``verts`` encloses, metres; a ring that touches or crosses itself is repaired by the even-odd rule.

        PlanError where it encloses nothing; ``houseexpo.repair`` states the rule, ``repair`` what it changed.
        """
        return self._mended(even_odd, ())

    @cached_property
    def free_space(self) -> Polygon | MultiPolygon:
        """The outline less the holes, metres, repaired as ``outline`` is."""
        return self._mended(even_odd, self.holes) if self.holes else self.outline

    @cached_property
    def repair(self) -> Repair | None:
        """What was wrong with the rings and what mending them changed; None where they are valid."""
        return self._mended(repair_of, self.holes)

    def _mended(self, how: Callable[[Ring, Sequence[Ring]], _T], holes: tuple[Ring, ...]) -> _T:
        try:
            return how(self.verts, holes)
        except PlanError as error:
            raise error.within(plan=self.id) from None

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
        from houseexpo.moving import moved

        return moved(self, dx, dy)

    def centred(self) -> FloorPlan:
        """Return the plan with its origin at the centroid of the free space, as the paper's text has it."""
        centre = self.free_space.centroid
        return self.moved(-centre.x, -centre.y)

    @cached_property
    def divided(self) -> FloorPlan:
        """The plan with rooms and doors: itself, or where it records none, as published, what ``with_rooms`` finds."""
        if self.rooms:
            return self
        from houseexpo.inference import with_rooms

        return with_rooms(self)

    def walls(self, thickness: float = 0.1) -> tuple[Polygon, ...]:
        """Walls as polygons, metres: what lies within ``thickness`` of the free space and is not free, holes whole.

        Walls between rooms that are thinner than twice ``thickness`` come out as thick as they are; doors stay open.
        """
        from houseexpo.walls import walls_around

        return walls_around(self.free_space, thickness)

    def grid_frame(self, pixels_per_metre: float = 25.0) -> GridFrame:
        """Where the grids below stand: one cell of margin all round, row 0 at the lowest y, as published."""
        from houseexpo.frame import GridFrame

        return GridFrame.around(self._bounds, pixels_per_metre)

    def grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.uint8]:
        """Occupancy (rows, cols): 0 where the cell's centre is free, 1 where it is in a wall or outside.

        Examples
        --------
        >>> plan = FloorPlan("square", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
        >>> plan.grid(2).tolist()[:3]
        [[1, 1, 1, 1, 1, 1], [1, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 1]]
        """
        from houseexpo.raster import free_mask

        mask, _ = free_mask(self, frame=self.grid_frame(pixels_per_metre))
        return (~mask).view(np.uint8)

    def room_grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int32]:
        """Ids of rooms of ``divided`` (rows, cols), -1 where there is none; the grid is that of ``grid``."""
        from houseexpo.raster import room_mask

        return room_mask(self.divided, self.grid_frame(pixels_per_metre))

    def door_grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int32]:
        """Ids of doors of ``divided`` (rows, cols), -1 where there is none; the grid is that of ``grid``."""
        from houseexpo.raster import door_mask

        return door_mask(self.divided, self.grid_frame(pixels_per_metre))

    def distance_field(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.float32]:
        """Metres (rows, cols) from each free cell's centre to the nearest wall, 0 in walls; the grid is ``grid``'s."""
        from houseexpo.raster import clearance

        return clearance(self.grid(pixels_per_metre) == 0, pixels_per_metre)

    def graph(self, *, outside: bool = False) -> nx.MultiGraph[int | str]:
        """Rooms of ``divided`` as nodes, doors as edges, with walking distances; ``houseexpo.geodesic`` says which."""
        from houseexpo.geodesic import walking_graph

        return walking_graph(self.divided, outside=outside)

    def to_cell(self, points: npt.ArrayLike, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int64]:
        """Plan metres (..., 2) as (x, y) to cells (..., 2) of ``grid`` as (row, col); they may lie outside it."""
        return self.grid_frame(pixels_per_metre).cells_from_points(points)

    def to_world(self, cells: npt.ArrayLike, pixels_per_metre: float = 25.0) -> npt.NDArray[np.float64]:
        """Cells (..., 2) of ``grid`` as (row, col) to the plan metres (..., 2) of their centres as (x, y)."""
        return self.grid_frame(pixels_per_metre).points_from_cells(cells)

    @property
    def _bounds(self) -> Box:
        """Bounds of all rings: of a plan that is whole, those of ``verts``."""
        points = np.concatenate([self.verts, *self.holes]) if self.holes else self.verts
        (x1, y1), (x2, y2) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return x1, y1, x2, y2

    def _repr_svg_(self) -> str:
        """Show the plan in a notebook."""
        from houseexpo.drawing import svg

        return svg(self, size=480)

    def __repr__(self) -> str:
        x1, y1, x2, y2 = self.bbox
        parts = [f"{self.area:.1f} m2", f"{x2 - x1:.1f} x {y2 - y1:.1f} m", f"{len(self.verts)} vertices"]
        parts += [f"room_num {self.room_num}"]
        parts += [
            f"{len(found)} {name}" for name in ("holes", "rooms", "doors", "objects") if (found := getattr(self, name))
        ]
        parts += [f"quality {self.quality.score:.2f}"] if self.quality is not None else []
        return f"FloorPlan({self.id!r}, {', '.join(parts)})"
