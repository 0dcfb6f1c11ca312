"""Compute a plan's walls, lintels, floor and furniture as polygons with heights (metres), for exports in 3D.

``wall_openings`` and ``window_openings`` find the openings of doors and windows through the walls as drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, TypedDict

import numpy as np
import shapely

from houseexpo.analysis.walls import walls_around
from houseexpo.drawing.door_leaves import window_in_walls
from houseexpo.errors import ConfigError
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, orient_plan, pose_in_export
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, PlanObject
from houseexpo.tolerances import CRUMB_M2, ENTRANCE_REACH_M, ENTRANCE_TOUCH_M, STRAIGHTEN_AREA_M, TINY, WELD_M

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon
    from shapely.geometry.base import BaseGeometry


@dataclass(frozen=True, eq=False)
class WallOpening:
    """A door or window of the plan; ``shape`` is its opening in the drawn wall, ``segment`` the middle line of that."""

    door: Door
    shape: Polygon
    segment: tuple[tuple[float, float], tuple[float, float]]

    @property
    def has_leaf(self) -> bool:
        """Whether the opening has a door; a passage that the connectivity stage cut has no door."""
        return self.door.kind in {"door", "entrance"}


def wall_openings(plan: FloorPlan, wall_thickness: float) -> list[WallOpening]:
    """Return the doors of a plan whose outer walls are drawn ``wall_thickness`` metres thick."""
    return _through_walls(plan, plan.doors, wall_thickness)


def window_openings(plan: FloorPlan, wall_thickness: float) -> list[WallOpening]:
    """Return the windows of a plan whose outer walls are drawn ``wall_thickness`` metres thick."""
    return _through_walls(plan, plan.windows, wall_thickness)


def _through_walls(plan: FloorPlan, holes: Sequence[Door], wall_thickness: float) -> list[WallOpening]:
    found = []
    in_outline = {"entrance", "window"}  # these are no free space
    walls = shapely.union_all(plan.walls(wall_thickness)) if any(d.kind in in_outline for d in holes) else None
    for hole in holes:
        cut = hole.kind in in_outline
        shape = hole.polygon
        if walls is not None and hole.kind == "window":
            shape = window_in_walls(hole, walls, ENTRANCE_REACH_M) or shape
        elif walls is not None and cut:
            shape = _cut_in_wall(hole, walls)
        found.append(WallOpening(hole, shape, _middle(hole, shape) if cut else hole.segment))
    return found


def _cut_in_wall(door: Door, walls: shapely.Geometry) -> Polygon:
    """Return the opening of an entrance in an outer wall of the drawn thickness."""
    a, b = np.asarray(door.segment, np.float64)
    along = (b - a) / max(float(np.hypot(*(b - a))), TINY)
    across = np.array([-along[1], along[0]]) * ENTRANCE_REACH_M
    lane = shapely.Polygon([a - across, b - across, b + across, a + across])
    parts = shapely.get_parts(shapely.intersection(walls, lane))
    near = [p for p in parts if p.geom_type == "Polygon" and shapely.dwithin(p, door.polygon, ENTRANCE_TOUCH_M)]
    hull = shapely.convex_hull(shapely.union_all(near))
    return hull if hull.geom_type == "Polygon" else door.polygon


def _middle(door: Door, shape: Polygon) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the door's segment, moved to the middle of its shape."""
    a, b = np.asarray(door.segment, np.float64)
    along = (b - a) / max(float(np.hypot(*(b - a))), TINY)
    across = np.array([-along[1], along[0]])
    depths = (shapely.get_coordinates(shape) - a) @ across
    step = across * float(depths.min() + depths.max()) / 2
    return (float(a[0] + step[0]), float(a[1] + step[1])), (float(b[0] + step[0]), float(b[1] + step[1]))


WALL_HEIGHT_M: Final = 2.5
DOOR_HEIGHT_M: Final = 2.1
WALL_THICKNESS_M: Final = 0.1
WINDOW_SILL_M: Final = 0.9
"""The height of a window's sill, metres, if the plan does not state it; its head is then as high as that of doors."""

_UNDER_LINTELS: Final = frozenset({"door", "cut"})  # openings have the full height; entrances are closed


class BodyOptions(TypedDict, total=False):
    """The options of all exports in 3D: those of ``plan_bodies``."""

    wall_thickness: float
    wall_height: float
    door_height: float
    orientation: Orientation
    frame: ExportFrame | None


@dataclass(frozen=True, eq=False)
class WindowBody:
    """A window: the part of the wall that it takes, and the heights of its sill and head, metres.

    Its glass is as thick as the wall, so that nothing gets through and a mesh is read back as the same plan.
    """

    window: Door
    shape: BaseGeometry
    segment: tuple[tuple[float, float], tuple[float, float]]
    sill: float
    head: float


@dataclass(frozen=True, eq=False)
class PlanBodies:
    """The bodies of a plan: polygons in metres, x right and y up in the export's world, and heights above the floor.

    ``space`` is the floor, with walls straightened by at most 0.01 m and open over the stairs from below. ``free`` is
    ``space`` without ``furniture``.
    ``walls`` are around and in the floor and leave doors open. They have no cavities: a courtyard without a door is
    filled, since it is not free. ``lintels`` are the areas of doors, from ``door_height`` to ``wall_height``.
    ``windows`` lie in the walls, which ``standing`` are without them. ``pose`` is
    the pose of all of them in the export's frame.
    """

    plan: FloorPlan
    space: Polygon | MultiPolygon
    free: Polygon | MultiPolygon
    walls: tuple[Polygon, ...]
    lintels: tuple[Polygon, ...]
    wall_thickness: float
    wall_height: float
    door_height: float
    furniture: tuple[PlanObject, ...]
    pose: Pose
    windows: tuple[WindowBody, ...] = ()

    @property
    def wells(self) -> tuple[Polygon, ...]:
        """The openings in the floor over the stairs from below."""
        return tuple(thing.polygon for thing in self.plan.stairwells)

    @property
    def named_wells(self) -> Iterator[tuple[str, Polygon]]:
        """The openings over stairs with the names of their bodies, by which a build of the file knows them."""
        return ((f"furniture_stairwell_{thing.id}", thing.polygon) for thing in self.plan.stairwells)

    @cached_property
    def standing(self) -> tuple[Polygon, ...]:
        """The walls without the windows, which have wall below and above them."""
        if not self.windows:
            return self.walls
        open_ = shapely.union_all([each.shape for each in self.windows])
        return tuple(_polygons(shapely.difference(shapely.union_all(self.walls), open_, grid_size=WELD_M)))

    @property
    def window_parts(self) -> Iterator[tuple[str, Literal["wall", "glass"], BaseGeometry, float, float]]:
        """The wall below and above each window, and its glass: name, kind, shape, heights of foot and top, metres."""
        for each in self.windows:
            number = each.window.id
            if each.sill > 0:
                yield f"wall_under_window_{number}", "wall", each.shape, 0.0, each.sill
            if each.head < self.wall_height:
                yield f"window_lintel_{number}", "wall", each.shape, each.head, self.wall_height
            yield f"window_{number}", "glass", each.shape, each.sill, each.head

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The bounds of the walls: (x_min, y_min, x_max, y_max), metres."""
        import shapely

        x1, y1, x2, y2 = shapely.total_bounds(self.walls).tolist()
        return x1, y1, x2, y2


def plan_bodies(
    plan: FloorPlan,
    *,
    wall_thickness: float = WALL_THICKNESS_M,
    wall_height: float = WALL_HEIGHT_M,
    door_height: float = DOOR_HEIGHT_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> PlanBodies:
    """Return the bodies of a plan; raise ConfigError if a size is not possible.

    Parameters
    ----------
    plan
        The plan. A plan without doors, such as a published one, has the same walls and no lintels.
    wall_thickness
        Thickness of outer walls, metres; walls between rooms keep their own thickness.
    wall_height, door_height
        Heights above the floor, metres; if they are equal, doors have no lintels.
    orientation, frame
        See ``houseexpo.exports.placement``.
    """
    import shapely

    if not (math.isfinite(wall_height) and 0 < door_height <= wall_height):
        found = f"wall_height {wall_height!r} and door_height {door_height!r}"
        raise ConfigError(f"export: expected heights 0 < door_height <= wall_height in metres, found {found}")
    turned = orient_plan(plan, orientation)
    wells = shapely.union_all([thing.polygon for thing in turned.stairwells])
    space = shapely.set_precision(shapely.difference(turned.floor, wells).simplify(STRAIGHTEN_AREA_M), WELD_M)
    inside = shapely.union(space, wells)
    things = tuple(thing for thing in turned.objects if thing.room is not None)
    walls = shapely.set_precision(_without_hollows(inside, walls_around(inside, wall_thickness)), WELD_M)
    doors = [door.polygon for door in turned.doors if door.kind in _UNDER_LINTELS] if door_height < wall_height else []
    lintels = (_polygons(shapely.intersection(door, space)) for door in doors)
    windows = (_window_body(each, door_height, wall_height) for each in window_openings(turned, wall_thickness))
    return PlanBodies(
        plan=turned,
        space=space,
        free=shapely.difference(space, shapely.union_all([thing.polygon for thing in things])) if things else space,
        walls=tuple(_polygons(walls)),
        lintels=tuple(part for parts in lintels for part in parts),
        wall_thickness=wall_thickness,
        wall_height=wall_height,
        door_height=door_height,
        furniture=things,
        pose=pose_in_export(plan, orientation, frame),
        windows=tuple(window for window in windows if window is not None),
    )


def _window_body(each: WallOpening, door_height: float, wall_height: float) -> WindowBody | None:
    """Return a window in the walls; None if the walls end below its sill."""
    window = each.door
    sill = WINDOW_SILL_M if window.sill is None else window.sill
    head = min(door_height if window.head is None else window.head, wall_height)
    shape = shapely.set_precision(each.shape, WELD_M)
    return WindowBody(window, shape, each.segment, sill, head) if sill < head else None


def _without_hollows(space: Polygon | MultiPolygon, walls: tuple[Polygon, ...]) -> Polygon | MultiPolygon:
    """Return the walls as one shape, together with the cavities that they enclose."""
    import shapely

    house = shapely.union_all([space, *walls])
    whole = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(house)])
    return shapely.difference(whole, space)


def _polygons(shape: Polygon | MultiPolygon) -> list[Polygon]:
    import shapely

    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]


# Divide a plan's floor and walls into parts with the names that programs read: floors of rooms, doorways, entrances.
#
# N1  ``kitchen_floor_3`` is the floor of room 3. The room's label comes first, since programs take the last word as
#     the kind of a part: ``toilet_floor_4`` is a floor, but ``floor_4_toilet`` may be taken for a toilet.
# N2  ``door_threshold_2`` is the floor in door 2, from jamb to jamb; ``opening_threshold_2`` is the floor in an
#     opening; ``floor`` is the area under the walls.
# N3  ``entrance_door_5`` is the shut door of entrance 5: it fills the wall there, up to the height of doors.
# Together, the parts cover exactly the floor and the walls.


def room_floors(built: PlanBodies) -> dict[str, BaseGeometry]:
    """Return the floor of each room by its name (N1), metres; empty for a plan without rooms."""
    return {f"{room.label.lower()}_floor_{room.id}": room.polygon for room in built.plan.rooms}


def doorway_floors(built: PlanBodies) -> dict[str, BaseGeometry]:
    """Return the floor in each doorway, except entrances, which are shut, by its name (N2), metres."""
    kinds = {"opening": "opening", "cut": "opening", "door": "door"}
    return {f"{kinds[d.kind]}_threshold_{d.id}": d.polygon for d in built.plan.doors if d.kind in kinds}


def entrance_doors(built: PlanBodies) -> dict[str, BaseGeometry]:
    """Return the shut door of each entrance by its name (N3), metres."""
    if all(door.kind != "entrance" for door in built.plan.doors):
        return {}
    walls = shapely.union_all(built.walls)
    found = {}
    for each in wall_openings(built.plan, built.wall_thickness):
        if each.door.kind == "entrance":
            shape = shapely.intersection(walls, each.shape)
            if shape.area > CRUMB_M2:
                found[f"entrance_door_{each.door.id}"] = shape
    return found


def unnamed_floor(built: PlanBodies, parts: dict[str, BaseGeometry]) -> BaseGeometry:
    """Return the floor of the house without the named ``parts``, metres."""
    slab = shapely.union_all([built.space, *built.walls])
    return shapely.difference(slab, shapely.union_all(list(parts.values())))
