"""A building's storeys as levels.

R1  A storey is a level where walls of 1.8 m stand on its floor and it holds a wall or a room itself: the roof, the
    foundation and a mere reference height have neither. One without is passed over, not rejected.
R2  Storeys less than 0.9 m apart are one level with steps; so are those less than 1.8 m apart unless both have rooms
    (a crawl space under a floor). The one with rooms, then with more walls, gives the height.
R3  A wall belongs to each level through whose height it runs, whichever storey contains it.
R4  A beam with its underside between head height and 3 m is a lintel; higher ones hang over a room or carry a roof.
R5  The floor's height is the storey's elevation; where that lies off its walls' feet (elevations that an exporter left
    at 0), the feet.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from pipeline.sources.ifc_file import Building, Part, Storey
from pipeline.sources.room_names import is_outside_the_count, labels_for
from pipeline.sources.surfaces import Surfaces, WallProfile, cut
from pipeline.values import Mesh, SourceOpening, SourceRoom

TALL_M = 1.8
APART_M = 0.9
OFF_M = 0.6  # an elevation farther than this from the walls' feet is not theirs
SHORTEST_WALLS_M = 4.0
MARGIN_M = 0.05
HIGHEST_LINTEL_M = 3.0
KNEE_M = 0.5  # an opening that starts higher is no passage


@dataclass(frozen=True, eq=False)
class IfcLevel:
    """One level in project axes, metres; ``ceiling_m`` counts from ``floor_z``."""

    name: str
    floor_z: float
    ceiling_m: float
    walls: Mesh
    floor: Polygon | MultiPolygon | None
    rooms: tuple[SourceRoom, ...]
    room_count: int | None
    openings: tuple[SourceOpening, ...]


@dataclass(frozen=True)
class _Standing:
    """A storey that may be a level: its floor height, and the storeys whose elements it takes."""

    storey: Storey
    floor_z: float
    keys: frozenset[int]
    has_rooms: bool
    own_walls_m: float


def storey_levels(building: Building) -> list[IfcLevel]:
    """Return the levels from the lowest to the highest; empty where no storey has walls."""
    candidates = [found for storey in building.storeys if (found := _standing(building, storey))]
    kept: list[_Standing] = []
    for candidate in sorted(candidates, key=lambda each: (not each.has_rooms, -each.own_walls_m, each.floor_z)):
        near = next((i for i, other in enumerate(kept) if _are_one(other, candidate)), None)
        if near is None:
            kept.append(candidate)
        else:  # R2
            kept[near] = replace(kept[near], keys=kept[near].keys | candidate.keys)
    kept.sort(key=lambda each: each.floor_z)
    above = [each.floor_z for each in kept[1:]] + [np.inf] * bool(kept)
    return [_level(building, each, height) for each, height in zip(kept, above, strict=True)]


def _standing(building: Building, storey: Storey) -> _Standing | None:
    """R1, R5."""
    own = [part for part in building.walls if part.storey == storey.key]
    rooms = [part for part in building.spaces if part.storey == storey.key]
    if not own and not rooms:
        return None
    tall = [part for part in own if np.ptp(part.mesh.vertices[:, 2]) >= TALL_M]
    floor = storey.elevation_m
    if tall:
        feet = float(np.median([part.mesh.vertices[:, 2].min() for part in tall]))
        floor = feet if abs(feet - floor) > OFF_M else floor
    if _wall_length(building.walls, floor) < SHORTEST_WALLS_M:
        return None
    return _Standing(storey, floor, frozenset({storey.key}), bool(rooms), _wall_length(own, floor))


def _are_one(one: _Standing, other: _Standing) -> bool:
    """R2."""
    return abs(one.floor_z - other.floor_z) < (APART_M if one.has_rooms and other.has_rooms else TALL_M)


def _wall_length(parts: Iterable[Part], floor: float) -> float:
    """Length in plan of the walls that reach 1.8 m over a floor; half of it, since a wall has two faces."""
    surfaces = Surfaces.of(_united(parts))
    segments = cut(surfaces, surfaces.walls(), floor + TALL_M - MARGIN_M)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()) / 2


def _united(parts: Iterable[Part]) -> Mesh:
    """Put the parts' triangles into one mesh."""
    meshes = [part.mesh for part in parts]
    if not meshes:
        return Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), faces)


def _level(building: Building, standing: _Standing, above: float) -> IfcLevel:
    floor = standing.floor_z
    standing_here = [part for part in building.walls if _runs_through(part, floor + 0.1, above - 0.1)]  # R3
    walls = _united([*standing_here, *(part for part in building.beams if _is_lintel(part, floor))])
    surfaces = Surfaces.of(walls)
    top = WallProfile.of(surfaces, surfaces.walls()).end_above(floor + TALL_M, floor + 0.3)
    rooms = tuple(_room(part) for part in building.spaces if part.storey in standing.keys)
    counted = [room for room in rooms if not is_outside_the_count(room.words)]
    return IfcLevel(
        name=standing.storey.name,
        floor_z=floor,
        ceiling_m=min(top, above - MARGIN_M) - floor,
        walls=walls,
        floor=_floor(building, standing),
        rooms=tuple(counted),
        room_count=len(counted) or None,
        openings=tuple(_openings(building, floor)),
    )


def _runs_through(part: Part, low: float, high: float) -> bool:
    heights = part.mesh.vertices[:, 2]
    return bool(heights.min() < high and heights.max() > low)


def _is_lintel(beam: Part, floor: float) -> bool:
    """R4."""
    underside = float(beam.mesh.vertices[:, 2].min())
    return floor + TALL_M <= underside < floor + HIGHEST_LINTEL_M


def footprint(mesh: Mesh) -> Polygon:
    """Return the plan shadow of a body, its largest piece."""
    triangles = shapely.polygons(mesh.vertices[mesh.faces][:, :, :2])
    shadow = shapely.union_all(triangles[shapely.area(triangles) > 1e-9], grid_size=1e-4)
    pieces = [piece for piece in shapely.get_parts(shadow) if isinstance(piece, Polygon)]
    return max(pieces, key=lambda piece: piece.area, default=Polygon())


def _room(part: Part) -> SourceRoom:
    shape = footprint(part.mesh)
    return SourceRoom(part.names, labels_for(part.names), None if shape.is_empty else shape)


def _floor(building: Building, standing: _Standing) -> Polygon | MultiPolygon | None:
    """Slabs whose top lies at the floor, whichever storey contains them."""
    tops = [part for part in building.slabs if abs(part.mesh.vertices[:, 2].max() - standing.floor_z) < OFF_M]
    shape = shapely.union_all([footprint(part.mesh) for part in tops], grid_size=1e-3)
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None


def _openings(building: Building, floor: float) -> Iterable[SourceOpening]:
    for part in building.openings:
        heights = part.mesh.vertices[:, 2]
        if heights.min() < floor + KNEE_M and heights.max() > floor + TALL_M - MARGIN_M:
            shape = footprint(part.mesh)
            if not shape.is_empty:
                yield SourceOpening(shape, part.has_door)
