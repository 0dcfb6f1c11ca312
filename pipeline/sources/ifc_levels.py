"""A building's storeys as levels: what stands on each, its rooms, its openings, its things.

R1  A wall belongs to each level of its building through whose height it runs, whichever storey contains it.
R2  A beam with its underside between head height and 3 m is a lintel; higher ones hang over a room or carry a roof.
R3  A loose part (IfcBuildingElementProxy, a plate or member by itself) is wall where it stands like one: upright, from
    the floor to head height, thin.
R4  A door's leaf belongs to the level that its door is entered from; a thing to the level whose storey holds it, else
    to the one on whose floor it stands.
R5  A hole in a wall that is no way through it is wall too (``ifc_holes``).
R6  One looks down onto a lower level where one of its slabs lies and no slab is within reach under this level's floor.
R7  A building with spaces and no wall at all, a study of its rooms, gets walls between and around the spaces, if these
    leave room for walls. Spaces that touch each other are zones, of which nobody knows where walls stand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.cutting import merged
from pipeline.geometry.overlay import mitred
from pipeline.sources.drawn_storeys import prism
from pipeline.sources.ifc_file import Building, Part
from pipeline.sources.ifc_height import OFF_M, TALL_M
from pipeline.sources.ifc_holes import StandingWalls, closed_holes, level_of_door, openings_of
from pipeline.sources.ifc_rooms import is_room, rooms_of
from pipeline.sources.ifc_shapes import footprint, shadow
from pipeline.sources.ifc_storeys import MARGIN_M, Standing, standing_storeys
from pipeline.sources.room_walls import walls_around
from pipeline.sources.surfaces import Surfaces, WallProfile
from pipeline.values import Mesh, SourceOpening, SourceRoom

HIGHEST_LINTEL_M = 3.0
KNEE_M = 0.5
THIN_M = 0.5
UNDER_M, OVER_M = 1.0, 0.3  # of a floor: slabs in between are steps of it, or its structure
CRACK_M = 0.01
TOUCHING = 0.4
LEAN_M = 0.3  # an upright part's head stands over its foot but for this


@dataclass(frozen=True, eq=False)
class IfcLevel:
    """One level in project axes, metres; ``ceiling_m`` counts from ``floor_z``."""

    name: str
    floor_z: float
    ceiling_m: float
    walls: Mesh
    floor: Polygon | MultiPolygon | None
    below: Polygon | MultiPolygon | None
    rooms: tuple[SourceRoom, ...]
    openings: tuple[SourceOpening, ...]
    leaves: tuple[Part, ...]
    furniture: tuple[Part, ...]
    named_openings: bool


def storey_levels(building: Building) -> list[IfcLevel]:
    """Return the levels from the lowest to the highest; empty where no storey has walls or rooms."""
    if not building.walls:
        building = replace(building, walls=tuple(_walls_of_spaces(building)))
    found = standing_storeys(building)
    of_building = {storey.key: storey.building for storey in building.storeys}
    floors = [each.floor_z for each in found]
    return [_level(building, each, floors, of_building) for each in found]


def _walls_of_spaces(building: Building) -> Iterator[Part]:
    """R7: walls around the rooms of each storey, as high as its highest room."""
    rooms = [space for space in building.spaces if is_room(space)]
    for key in dict.fromkeys(space.storey for space in rooms):
        here = [space for space in rooms if space.storey == key]
        floors = [footprint(space.mesh) for space in here]
        if _touch(floors):
            continue
        bottom, top = min(space.bottom for space in here), max(space.top for space in here)
        for wall in walls_around(floors, top - bottom):
            mesh = prism(wall.shape, bottom, top)
            yield Part(mesh=mesh, storey=key, kind="IfcWall")


def _touch(floors: Sequence[Polygon]) -> bool:
    """R7: whether most of the spaces' edges lie against other spaces."""
    lengths = shapely.length(floors)
    whole = shapely.union_all(mitred(np.array(floors, dtype=np.object_), CRACK_M / 2))
    hidden = lengths.sum() - shapely.length(whole)
    return bool(hidden > TOUCHING * lengths.sum())


def _level(
    building: Building, standing: Standing, floors: Sequence[float], of_building: dict[int, int | None]
) -> IfcLevel:
    floor = standing.floor_z
    parts = [*building.walls, *(part for part in building.loose if _is_wall(part, floor))]
    here = [part for part in parts if _runs_through(part, floor + 0.1, standing.above - 0.1)]  # R1
    here = [part for part in here if part.storey is None or of_building.get(part.storey) in standing.buildings]
    standing_walls = StandingWalls([part.mesh for part in here])
    panes = closed_holes(building.windows, building.holes, standing_walls, floor, standing.above)  # R5
    beams = [part.mesh for part in building.beams if _is_lintel(part, floor)]
    walls = merged(*(part.mesh for part in here), *beams, *panes)
    surfaces = Surfaces.of(walls)
    top = WallProfile.of(surfaces, surfaces.walls()).end_above(floor + TALL_M, floor + 0.3)
    return IfcLevel(
        name=standing.storey.name,
        floor_z=floor,
        ceiling_m=max(min(top, standing.above - MARGIN_M) - floor, TALL_M),
        walls=walls,
        floor=_floor(building, standing),
        below=_below(building, floor, floors),
        rooms=rooms_of([space for space in building.spaces if _is_on(space, standing, floors)]),
        openings=openings_of(building.holes, standing_walls, floor, floors),
        leaves=tuple(leaf for leaf in building.leaves if level_of_door(leaf.bottom, floors) == floor),
        furniture=tuple(thing for thing in building.furniture if _is_on(thing, standing, floors)),
        named_openings=building.named_openings,
    )


def _runs_through(part: Part, low: float, high: float) -> bool:
    return part.bottom < high and part.top > low


def _is_lintel(beam: Part, floor: float) -> bool:
    """R2."""
    return floor + TALL_M <= beam.bottom < floor + HIGHEST_LINTEL_M


def _is_wall(part: Part, floor: float) -> bool:
    """R3."""
    if part.bottom > floor + KNEE_M or part.top < floor + TALL_M:
        return False
    points = part.mesh.vertices
    middle = (part.bottom + part.top) / 2
    foot, head = points[points[:, 2] < middle, :2], points[points[:, 2] >= middle, :2]
    leans = np.abs([*(foot.min(axis=0) - head.min(axis=0)), *(foot.max(axis=0) - head.max(axis=0))]).max()
    corners = np.asarray(shapely.oriented_envelope(footprint(part.mesh)).boundary.coords)
    sides = np.hypot(*np.diff(corners[:3], axis=0).T)
    return bool(leans < LEAN_M and len(sides) > 1 and sides.min() < THIN_M)


def _is_on(part: Part, standing: Standing, floors: Sequence[float]) -> bool:
    """R4; the same holds for rooms."""
    if part.storey is not None:
        return part.storey in standing.keys
    return max((floor for floor in floors if floor <= part.bottom + KNEE_M), default=None) == standing.floor_z


def _floor(building: Building, standing: Standing) -> Polygon | MultiPolygon | None:
    """Slabs whose top lies at the floor, whichever storey contains them."""
    tops = [part for part in building.slabs if abs(part.top - standing.floor_z) < OFF_M]
    return _area(shapely.union_all([footprint(part.mesh) for part in tops], grid_size=1e-3))


def _below(building: Building, floor: float, floors: Sequence[float]) -> Polygon | MultiPolygon | None:
    """R6."""
    lower = [each for each in floors if each < floor - TALL_M]
    tops = [part for part in building.slabs if any(abs(part.top - each) < OFF_M for each in lower)]
    near = [part for part in building.slabs if part.top > floor - UNDER_M and part.bottom < floor + OVER_M]
    shown, hidden = (shapely.union_all([shadow(part.mesh) for part in parts]) for parts in (tops, near))
    return _area(shapely.difference(shown, hidden, grid_size=1e-3))


def _area(shape: BaseGeometry) -> Polygon | MultiPolygon | None:
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None
