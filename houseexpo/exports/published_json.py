"""Convert a plan to JSON of the published format, five keys and one ring; holes are joined by slits or left out."""

from __future__ import annotations

from typing import Literal

import shapely

from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports.encoding import Files
from houseexpo.exports.placement import ExportFrame, Orientation, orient_plan, pose_in_export
from houseexpo.exports.polygons import join_holes_by_slits
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.plan.checks import LARGEST_COORDINATE_M
from houseexpo.plan.json_codec import encode


def published_json(
    plan: FloorPlan,
    *,
    holes: Literal["slit", "drop"] = "slit",
    orientation: Orientation = "plan",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.json`` with only the published keys, not mirrored back unless ``orientation`` is "world".

    A plan without holes keeps every value of ``verts``. The format cannot represent holes, so that readers would not
    see pillars and free-standing walls. ``holes`` chooses what to do:

    - "slit": each hole is joined to the outline by a wall of 1 cm (``houseexpo.exports.polygons``);
    - "drop": pillars and free-standing walls are left out.

    Raises
    ------
    PlanError
        The outline and the holes cannot be joined to one ring, or the source's origin is too far for the format.
    """
    if holes not in {"slit", "drop"}:
        raise ConfigError(f"holes: expected 'slit' or 'drop', found {holes!r}")
    turned, pose = orient_plan(plan, orientation), pose_in_export(plan, orientation, frame)
    ring = _one_ring(turned) if turned.holes and holes == "slit" else turned.verts
    boxes = {
        label: [pose.shape(shapely.box(*box)).bounds for box in found] for label, found in turned.room_category.items()
    }
    verts = pose.points(ring)
    if abs(verts).max() > LARGEST_COORDINATE_M:
        found = f"{abs(verts).max():,.0f} m from its origin"
        raise PlanError(
            f"expected a place that the format can have in the source, found {found}; use the plan's frame",
            "frame",
            plan.id,
        )
    bare = FloorPlan(turned.id, verts, turned.room_num, boxes)
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
