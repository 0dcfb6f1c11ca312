"""Stack the plans of one house, for exports of several storeys: their order, their elevations, and their poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.exports.placement import ExportFrame, Orientation, Pose, default_frame, orient_plan, pose_in_export
from houseexpo.exports.plan_bodies import DOOR_HEIGHT_M, WALL_HEIGHT_M, BodyOptions, PlanBodies, plan_bodies
from houseexpo.floorplan import FloorPlan
from houseexpo.tolerances import CRUMB_M2, SAME_M, WELD_M

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

STOREY_HEIGHT_M: Final = 3.0
"""The height from floor to floor, metres, if the plans do not state their elevations."""
FLOOR_M: Final = 0.05
RISER_M: Final = 0.18  # the uppermost step of a stair from below lies so far under the floor: a usual rise
"""Thickness of a storey's floor, metres; the floor lies under the storey's elevation."""


@dataclass(frozen=True)
class PlacedStorey:
    """An oriented plan and its pose in a building; in the plan's frame, the lowest storey lies at the origin."""

    plan: FloorPlan
    pose: Pose


def stack_storeys(
    plans: Sequence[FloorPlan], name: str, orientation: Orientation = "world", frame: ExportFrame | None = None
) -> list[PlacedStorey]:
    """Return the storeys of a building, lowest first.

    If the frames of the plans state different heights, the plans are stacked at these heights and placed as in their
    source; in the plan's frame, heights are above the lowest storey. Other plans are stacked in the given order, every
    STOREY_HEIGHT_M, each in its own axes.

    Raises
    ------
    ConfigError
        There is no plan, or the name of the building cannot be the name of a file.
    """
    if not plans:
        raise ConfigError(f"export: expected the plans of building {name!r}, found none")
    if not name or name.startswith(".") or any(letter in name for letter in "/\\:\0\n"):
        raise ConfigError(f"export: expected a name that a file can have for the building, found {name!r}")
    if frame is None:
        frame = "source" if all(default_frame(plan) == "source" for plan in plans) else "plan"
    floors = [plan.frame.floor for plan in plans if plan.frame is not None]
    if len(set(floors)) < len(plans):
        poses = [pose_in_export(plan, orientation, frame) for plan in plans]
        base = min(pose.z for pose in poses)
        return [
            PlacedStorey(plan, replace(pose, z=base + i * STOREY_HEIGHT_M))
            for i, (plan, pose) in enumerate(zip(plans, poses, strict=True))
        ]
    ordered = [plan for _, plan in sorted(zip(floors, plans, strict=True), key=lambda pair: pair[0])]
    if frame == "source":
        return [PlacedStorey(plan, pose_in_export(plan, orientation, frame)) for plan in ordered]
    matrices = [
        np.array(turned.frame.matrix)
        for turned in (orient_plan(plan, orientation) for plan in ordered)
        if turned.frame is not None
    ]
    axes = matrices[0][:, :2]
    is_one_source = all(np.abs(each[:, :2] - axes).max() < SAME_M for each in matrices)
    storeys = []
    for plan, each, floor in zip(ordered, matrices, sorted(floors), strict=True):
        x, y = np.linalg.solve(axes, each[:, 2] - matrices[0][:, 2]).round(4).tolist() if is_one_source else (0.0, 0.0)
        storeys.append(PlacedStorey(plan, Pose(x + 0.0, y + 0.0, round(floor - min(floors), 4))))
    return storeys


@dataclass(frozen=True, eq=False)
class StoreyBodies:
    """The bodies of a storey above its floor, and its roof: the part that no storey above covers; empty for the top."""

    storey: PlacedStorey
    built: PlanBodies
    roof: BaseGeometry

    @property
    def slab(self) -> BaseGeometry:
        """The area of the storey's floor and walls in its own axes, metres; it is open over the stairs from below."""
        import shapely

        return shapely.difference(_footprint(self.built), shapely.union_all(self.built.wells))


def storey_bodies(plans: Sequence[FloorPlan], name: str, options: BodyOptions) -> list[StoreyBodies]:
    """Return the bodies of each storey of a building, lowest first, stacked by ``stack_storeys``.

    The walls of a storey end under the floor of the storey above. The top storey has no roof, as a plan that is
    exported by itself has none.

    Raises
    ------
    ConfigError
        Two storeys are less than door_height and a floor apart, or for the reasons of ``stack_storeys`` and
        ``plan_bodies``.
    """
    import shapely

    storeys = stack_storeys(plans, name, options.get("orientation", "world"), options.get("frame"))
    wall_height, door_height = options.get("wall_height", WALL_HEIGHT_M), options.get("door_height", DOOR_HEIGHT_M)
    made = []
    for storey, above in zip(storeys, [*storeys[1:], None], strict=True):
        room = wall_height if above is None else round(above.pose.z - storey.pose.z - FLOOR_M, 4)
        if room < door_height:
            said = f"storeys {storey.plan.id} and {above.plan.id if above else ''} are {room + FLOOR_M:g} m apart"
            raise ConfigError(f"export: {said}, expected {door_height + FLOOR_M:g} m or more; give a lower door_height")
        built = plan_bodies(storey.plan, **options | {"wall_height": min(wall_height, room)})
        made.append(StoreyBodies(storey, built, shapely.Polygon()))
    for number, (low, high) in enumerate(pairwise(made)):
        roof = shapely.difference(low.slab, high.storey.pose.to(low.storey.pose).shape(_footprint(high.built)))
        parts = [part for part in shapely.get_parts(roof) if part.geom_type == "Polygon" and part.area > CRUMB_M2]
        made[number] = replace(low, roof=shapely.set_precision(shapely.union_all(parts), WELD_M))
    return made


def _footprint(built: PlanBodies) -> BaseGeometry:
    import shapely

    whole = shapely.union_all([built.space, *built.walls])
    return shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(whole)])
