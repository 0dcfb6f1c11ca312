"""Define ``PlanData``: the contents of a plan's file as frozen values, checked on construction, and its free space.

Higher layers compute things from them. ``houseexpo.floorplan.FloorPlan`` adds the methods that users call; nothing here
depends on them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from houseexpo.errors import PlanError
from houseexpo.plan import checks
from houseexpo.plan.parts import Box, Door, Frame, FrozenValue, NavigabilityByRadius, PlanObject, Quality, Ring, Room
from houseexpo.plan.repair import Repair, describe_repair, even_odd_polygons
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

_T = TypeVar("_T")
_Plan = TypeVar("_Plan", bound="PlanData")


@dataclass(frozen=True, eq=False)
class PlanData(FrozenValue):
    """The contents of a plan's file; ``FloorPlan`` describes them."""

    id: str
    verts: Ring
    room_num: int
    room_category: Mapping[str, tuple[Box, ...]]
    holes: tuple[Ring, ...] = ()
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    frame: Frame | None = None
    navigability: NavigabilityByRadius = field(default_factory=NavigabilityByRadius, repr=False)
    provenance: Mapping[str, Any] | None = field(default=None, repr=False)
    quality: Quality | None = field(default=None, repr=False)
    objects: tuple[PlanObject, ...] = ()
    windows: tuple[Door, ...] = ()

    def __post_init__(self) -> None:
        checks.check_plan_id(self.id)
        try:
            self._check()
        except PlanError as error:
            raise error.within(plan=self.id) from None

    def _check(self) -> None:
        self._set("verts", checks.check_ring(self.verts, "verts"))
        self._set("room_num", checks.check_count(self.room_num, "room_num"))
        self._set("room_category", checks.check_boxes(self.room_category, "room_category"))
        self._set("holes", checks.check_rings(self.holes, "holes"))
        self._set("rooms", tuple(self.rooms))
        self._set("doors", tuple(self.doors))
        self._set("objects", tuple(self.objects))
        self._set("windows", tuple(self.windows))
        self._set("navigability", NavigabilityByRadius(self.navigability))
        checks.check_unique((room.id for room in self.rooms), "rooms")
        checks.check_unique((door.id for door in self.doors), "doors")
        checks.check_unique((thing.id for thing in self.objects), "objects")
        checks.check_unique((window.id for window in self.windows), "windows")
        known = {room.id for room in self.rooms}
        for key, holes in (("doors", self.doors), ("windows", self.windows)):
            for i, hole in enumerate(holes):
                if (hole.kind == "window") != (key == "windows"):
                    raise PlanError(f"expected a window in windows only, found {hole.kind!r}", f"{key}[{i}].kind")
                if not known.issuperset(room for room in hole.rooms if room is not None):
                    found = f"expected ids of rooms {sorted(known)}, found {list(hole.rooms)}"
                    raise PlanError(found, f"{key}[{i}].rooms")
        for i, thing in enumerate(self.objects):
            if thing.room is not None and thing.room not in known:
                raise PlanError(f"expected null or one of {sorted(known)}, found {thing.room}", f"objects[{i}].room")

    @cached_property
    def bbox(self) -> Box:
        """The bounds of ``verts``: (x_min, y_min, x_max, y_max), metres."""
        (x1, y1), (x2, y2) = self.verts.min(axis=0).tolist(), self.verts.max(axis=0).tolist()
        return x1, y1, x2, y2

    @cached_property
    def outline(self) -> Polygon | MultiPolygon:
        """The area that ``verts`` encloses, as valid polygons in metres.

        A ring that touches or crosses itself is repaired by the even-odd rule (``houseexpo.plan.repair``);
        ``self.repair`` says what changed.

        Raises
        ------
        PlanError
            The ring encloses no area.
        """
        return self._with_id_in_errors(even_odd_polygons, ())

    @cached_property
    def free_space(self) -> Polygon | MultiPolygon:
        """The outline without the holes, metres, repaired in the same way as ``outline``."""
        return self._with_id_in_errors(even_odd_polygons, self.holes) if self.holes else self.outline

    @property
    def furniture(self) -> tuple[PlanObject, ...]:
        """The objects that are no stairwells."""
        return tuple(thing for thing in self.objects if not thing.is_stairwell)

    @property
    def stairwells(self) -> tuple[PlanObject, ...]:
        """The openings in the floor over stairs from below (``PlanObject.is_stairwell``)."""
        return tuple(thing for thing in self.objects if thing.is_stairwell)

    @cached_property
    def floor(self) -> Polygon | MultiPolygon:
        """The whole area inside the walls, metres: the free space, the footprints of furniture in rooms, stairwells."""
        things = [thing.polygon for thing in self.objects if thing.room is not None or thing.is_stairwell]
        if not things:
            return self.free_space
        import shapely

        return shapely.union_all([self.free_space, *things])

    @cached_property
    def repair(self) -> Repair | None:
        """The faults of the rings and what their repair changed; None if the rings are valid."""
        return self._with_id_in_errors(describe_repair, self.holes)

    def _with_id_in_errors(self, how: Callable[[Ring, Sequence[Ring]], _T], holes: tuple[Ring, ...]) -> _T:
        try:
            return how(self.verts, holes)
        except PlanError as error:
            raise error.within(plan=self.id) from None

    @property
    def area(self) -> float:
        """Area of the free space, square metres."""
        return float(self.free_space.area)

    def room(self, room_id: int) -> Room:
        """Return the room with this id.

        Raises
        ------
        PlanError
            The plan has no such room.
        """
        for room in self.rooms:
            if room.id == room_id:
                return room
        raise PlanError(f"expected one of {[r.id for r in self.rooms]}, found {room_id!r}", "rooms", self.id)

    @property
    def _bounds(self) -> Box:
        """Bounds of all rings; in a correct plan these are the bounds of ``verts``."""
        points = np.concatenate([self.verts, *self.holes]) if self.holes else self.verts
        (x1, y1), (x2, y2) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return x1, y1, x2, y2

    def __repr__(self) -> str:
        x1, y1, x2, y2 = self.bbox
        parts = [f"{self.area:.1f} m²", f"{x2 - x1:.1f} x {y2 - y1:.1f} m", f"{len(self.verts)} vertices"]
        parts += [f"{count_noun(self.room_num, 'room')} in the source"]
        for name in ("hole", "room", "door", "window", "object"):
            number = len(getattr(self, f"{name}s"))
            parts += [f"{number} {name}{'s' if number > 1 else ''}"] if number else []
        parts += [f"quality {self.quality.score:.2f}"] if self.quality is not None else []
        return f"{type(self).__name__}({self.id!r}, {', '.join(parts)})"


def shift_plan(plan: _Plan, dx: float, dy: float) -> _Plan:
    """Return the plan shifted by (dx, dy) metres; its frame still maps to the same place in the source."""
    by = np.array([dx, dy])
    boxes = {
        label: tuple((x1 + dx, y1 + dy, x2 + dx, y2 + dy) for x1, y1, x2, y2 in found)
        for label, found in plan.room_category.items()
    }
    return replace(
        plan,
        verts=plan.verts + by,
        room_category=boxes,
        holes=tuple(hole + by for hole in plan.holes),
        rooms=tuple(replace(r, ring=r.ring + by, holes=tuple(h + by for h in r.holes)) for r in plan.rooms),
        doors=tuple(_shift_hole(door, by) for door in plan.doors),
        windows=tuple(_shift_hole(window, by) for window in plan.windows),
        objects=tuple(replace(thing, ring=thing.ring + by) for thing in plan.objects),
        frame=None if plan.frame is None else _move_frame(plan.frame, dx, dy),
    )


def _shift_hole(hole: Door, by: Ring) -> Door:
    one, other = ((x, y) for x, y in (np.asarray(hole.segment) + by).tolist())
    return replace(hole, ring=hole.ring + by, segment=(one, other))


def _move_frame(frame: Frame, dx: float, dy: float) -> Frame:
    (a, b, tx), (c, d, ty) = frame.matrix
    return replace(frame, matrix=((a, b, tx - a * dx - b * dy), (c, d, ty - c * dx - d * dy)))
