"""Compute a plan's walls, lintels, floor and furniture as polygons with heights (metres), for exports in 3D."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from houseexpo.analysis.walls import walls_around
from houseexpo.errors import ConfigError
from houseexpo.exports.placement import Orientation, orient_plan
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject
from houseexpo.tolerances import STRAIGHTEN_AREA_M, WELD_M

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

WALL_HEIGHT_M: Final = 2.5
DOOR_HEIGHT_M: Final = 2.1
WALL_THICKNESS_M: Final = 0.1

_UNDER_LINTELS: Final = frozenset({"door", "cut"})  # openings are gaps of full height, entrances are closed


@dataclass(frozen=True, eq=False)
class PlanBodies:
    """The bodies of a plan: polygons in metres, x right and y up in the export's world, and heights above the floor.

    ``space`` is the floor, with walls straightened by at most 0.01 m, and ``free`` is ``space`` without ``furniture``.
    ``walls`` are around and in the floor and leave doors open. They have no cavities: a courtyard without a door is
    filled, since it is not free. ``lintels`` are the areas of doors, from ``door_height`` to ``wall_height``.
    """

    plan: FloorPlan
    space: Polygon | MultiPolygon
    free: Polygon | MultiPolygon
    walls: tuple[Polygon, ...]
    lintels: tuple[Polygon, ...]
    wall_height: float
    door_height: float
    furniture: tuple[PlanObject, ...]

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
) -> PlanBodies:
    """Return the bodies of a plan; raise ConfigError if a size is not possible.

    Parameters
    ----------
    plan
        The plan. Without doors (a published one), it has no lintels, but the same walls.
    wall_thickness
        Thickness of outer walls, metres; walls between rooms keep their own thickness.
    wall_height, door_height
        Metres above the floor; if they are equal, doors have no lintels.
    orientation
        See ``houseexpo.exports.placement``.
    """
    import shapely

    if not (math.isfinite(wall_height) and 0 < door_height <= wall_height):
        found = f"wall_height {wall_height!r} and door_height {door_height!r}"
        raise ConfigError(f"export: expected heights 0 < door_height <= wall_height in metres, found {found}")
    turned = orient_plan(plan, orientation)
    space = shapely.set_precision(turned.floor.simplify(STRAIGHTEN_AREA_M), WELD_M)
    things = tuple(thing for thing in turned.objects if thing.room is not None)
    walls = shapely.set_precision(_without_hollows(space, walls_around(space, wall_thickness)), WELD_M)
    doors = [door.polygon for door in turned.doors if door.kind in _UNDER_LINTELS] if door_height < wall_height else []
    lintels = (_polygons(shapely.intersection(door, space)) for door in doors)
    return PlanBodies(
        plan=turned,
        space=space,
        free=shapely.difference(space, shapely.union_all([thing.polygon for thing in things])) if things else space,
        walls=tuple(_polygons(walls)),
        lintels=tuple(part for parts in lintels for part in parts),
        wall_height=wall_height,
        door_height=door_height,
        furniture=things,
    )


def _without_hollows(space: Polygon | MultiPolygon, walls: tuple[Polygon, ...]) -> Polygon | MultiPolygon:
    """Return the walls as one shape, together with the cavities that they enclose."""
    import shapely

    house = shapely.union_all([space, *walls])
    whole = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(house)])
    return shapely.difference(whole, space)


def _polygons(shape: Polygon | MultiPolygon) -> list[Polygon]:
    import shapely

    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
