"""Convert a plan to JSON of the published format, five keys and one ring; holes are joined by slits or left out."""

from __future__ import annotations

from typing import Literal

import shapely

from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports.encoding import Files
from houseexpo.exports.orientation import Orientation, orient_plan
from houseexpo.exports.polygons import join_holes_by_slits
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.plan.json_codec import encode


def published_json(
    plan: FloorPlan, *, holes: Literal["slit", "drop"] = "slit", orientation: Orientation = "plan"
) -> Files:
    """Write ``<id>.json`` with only the published keys, in the plan's own axes unless ``orientation`` is "world".

    A plan without holes keeps every value of ``verts``. The format cannot represent holes, so that readers would not
    see pillars and free-standing walls. ``holes`` chooses what to do:

    - "slit": each hole is joined to the outline by a wall of 1 cm (``houseexpo.exports.polygons``);
    - "drop": pillars and free-standing walls are left out.

    Raises
    ------
    PlanError
        The outline and the holes cannot be joined to one ring.
    """
    if holes not in {"slit", "drop"}:
        raise ConfigError(f"holes: expected 'slit' or 'drop', found {holes!r}")
    turned = orient_plan(plan, orientation)
    verts = _one_ring(turned) if turned.holes and holes == "slit" else turned.verts
    bare = FloorPlan(turned.id, verts, turned.room_num, turned.room_category)
    return {f"{plan.id}.json": encode(bare) + b"\n"}


def _one_ring(plan: FloorPlan) -> Ring:
    """Return the outline of the free space (n, 2), joined with its holes by slits, clockwise, not closed."""
    space = plan.free_space
    if space.geom_type != "Polygon":
        pieces = len(shapely.get_parts(space))
        raise PlanError(f"expected one piece of free space, found {pieces}; drop the holes instead", "holes", plan.id)
    try:
        joined = join_holes_by_slits(space, [door.polygon for door in plan.doors])
    except PlanError as error:
        raise error.within(plan=plan.id) from None
    ring: Ring = shapely.get_coordinates(shapely.orient_polygons(joined, exterior_cw=True))[:-1]
    return ring
