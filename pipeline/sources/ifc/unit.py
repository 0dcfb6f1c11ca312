"""Correct the unit of an IFC file whose walls would be higher than any building, or lower than a hand.

Some exporters declare metres and write millimetres, or the other way round.

R1  The file's unit stands while half of its walls (proxies, where it has none) are between a hand's breadth and
    ``HIGHEST_BUILDING_M`` high, and half of its doors, if it names any, reach higher than a knee.
R2  Else millimetres, centimetres or inches were meant, or metres where the file says these: what makes the walls as
    high as storeys, and the doors as high as doors. Where none does, the file's unit stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, Final

import numpy as np

from pipeline.sources.ifc.model import Body, Building, Storey, WallHole
from pipeline.sources.tolerances import HIGHEST_BUILDING_M, KNEE_M, NAMED_DOOR_M, STOREY_M
from pipeline.tolerances import HAND_M
from pipeline.values import Mesh

FACTORS: Final = (0.001, 0.01, 0.0254, 10.0, 100.0, 1000.0)


def find_unit_factor(building: Building) -> float:
    """Return by how much the lengths of a building are to be multiplied, 1.0 where its unit stands (R1, R2)."""
    walls = [part for part in building.walls if part.kind.startswith("IfcWall")]
    walls = walls or [part for part in building.walls if part.kind == "IfcBuildingElementProxy"]
    height = _usual_height(walls)
    door = _usual_height([hole for hole in building.holes if hole.has_door])
    if height <= 0.0 or (HAND_M <= height <= HIGHEST_BUILDING_M and not 0.0 < door < KNEE_M):
        return 1.0
    fitting = (factor for factor in FACTORS if STOREY_M[0] <= height * factor <= STOREY_M[1])
    are_doors = (factor for factor in fitting if not door or NAMED_DOOR_M[0] <= door * factor <= NAMED_DOOR_M[1])
    return next(are_doors, 1.0)


def _usual_height(parts: Sequence[Body]) -> float:
    return float(np.median([part.top - part.bottom for part in parts])) if parts else 0.0


def scale_building(building: Building, factor: float) -> Building:
    """Return the building with all lengths multiplied."""

    def scale(value: Any) -> Any:
        if isinstance(value, Storey):
            return replace(value, elevation_m=value.elevation_m * factor)
        if not isinstance(value, Body):
            return value
        scaled = replace(value, mesh=_scale_mesh(value.mesh, factor))
        if not isinstance(scaled, WallHole):
            return scaled
        host = scaled.host and _scale_mesh(scaled.host, factor)
        return replace(scaled, host=host, width_m=scaled.width_m and scaled.width_m * factor)

    groups = {each.name: getattr(building, each.name) for each in fields(building)}
    lists: dict[str, Sequence[Any]] = {name: group for name, group in groups.items() if isinstance(group, tuple)}
    changed: dict[str, Any] = {name: tuple(map(scale, group)) for name, group in lists.items()}
    return replace(building, **changed)


def _scale_mesh(mesh: Mesh, factor: float) -> Mesh:
    return Mesh(mesh.vertices * factor, mesh.faces)
