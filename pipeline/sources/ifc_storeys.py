"""Which storeys of a building are levels, and which belong together.

R1  A storey is a level where it has a room, or where walls of 1.8 m stand on its floor and it holds a wall itself: the
    roof, the foundation and a mere reference height have neither. One without is passed over, not rejected.
R2  Where the file names rooms or doors, a storey with neither is a roof with its parapets, or a void, unless it holds
    a floor slab of its own and walls of 1.8 m around it.
R3  Storeys less than 0.9 m apart are one level with steps; so are those less than 1.8 m apart unless both have rooms
    (a crawl space under a floor). The one with rooms, then with more walls, gives the height.
R4  A level ends where the next of the same building starts that is at least head height above it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.sources.ifc_file import Building, Part, Storey
from pipeline.sources.ifc_height import OFF_M, TALL_M, floor_height
from pipeline.sources.ifc_rooms import is_room
from pipeline.sources.ifc_shapes import footprint, united
from pipeline.sources.surfaces import Surfaces, cut
from pipeline.values import Mesh

APART_M = 0.9
SHORTEST_WALLS_M = 4.0
MARGIN_M = 0.05
WALLED = 0.8


@dataclass(frozen=True)
class Standing:
    """A storey that is a level: the height of its floor, and of the next; the storeys whose elements it takes.

    ``buildings`` are the step ids of the buildings that it lies in; ``above`` is infinite under no other level.
    """

    storey: Storey
    floor_z: float
    keys: frozenset[int]
    buildings: frozenset[int | None]
    has_rooms: bool
    own_walls_m: float
    above: float = np.inf


def standing_storeys(building: Building) -> list[Standing]:
    """Return the storeys that are levels from the lowest to the highest."""
    rooms = [space for space in building.spaces if is_room(space)]
    named = bool(rooms) or any(hole.has_door for hole in building.holes)
    candidates = [found for storey in building.storeys if (found := _standing(building, storey, rooms, named))]
    kept: list[Standing] = []
    for candidate in sorted(candidates, key=lambda each: (not each.has_rooms, -each.own_walls_m, each.floor_z)):
        near = next((i for i, other in enumerate(kept) if _are_one(other, candidate)), None)
        if near is None:
            kept.append(candidate)
        else:  # R3
            keys, buildings = kept[near].keys | candidate.keys, kept[near].buildings | candidate.buildings
            kept[near] = replace(kept[near], keys=keys, buildings=buildings)
    kept.sort(key=lambda each: each.floor_z)
    return [replace(each, above=_above(each, kept)) for each in kept]


def _standing(building: Building, storey: Storey, rooms: Sequence[Part], named: bool) -> Standing | None:
    """R1, R2."""
    own = [part for part in building.walls if part.storey == storey.key]
    floor = floor_height(building, storey)
    has_rooms = any(_is_in(space, storey, floor) for space in rooms)
    entered = any(_is_entered(hole.mesh, floor) for hole in building.holes if hole.has_door)
    if named and not has_rooms and not entered and not _is_walled(building, storey, own, floor):
        return None
    if not has_rooms and (not own or _wall_length(building.walls, floor) < SHORTEST_WALLS_M):
        return None
    if not any(part.bottom < floor + TALL_M and part.top > floor + MARGIN_M for part in building.walls):
        return None
    keys, buildings = frozenset({storey.key}), frozenset({storey.building})
    return Standing(storey, floor, keys, buildings, has_rooms, _wall_length(own, floor))


def _is_walled(building: Building, storey: Storey, own: Sequence[Part], floor: float) -> bool:
    """R2: whether walls of the storey stand around most of a slab that it holds at its floor."""
    slabs = [part for part in building.slabs if part.storey == storey.key and abs(part.top - floor) < OFF_M]
    around = sum(footprint(part.mesh).length for part in slabs)
    return bool(around > 0 and _wall_length(own, floor) > WALLED * around)


def _is_in(space: Part, storey: Storey, floor: float) -> bool:
    return space.storey == storey.key or (space.storey is None and abs(space.bottom - floor) < OFF_M)


def _is_entered(mesh: Mesh, floor: float) -> bool:
    return abs(float(mesh.vertices[:, 2].min()) - floor) < OFF_M


def _are_one(one: Standing, other: Standing) -> bool:
    """R3."""
    return abs(one.floor_z - other.floor_z) < (APART_M if one.has_rooms and other.has_rooms else TALL_M)


def _above(one: Standing, levels: Sequence[Standing]) -> float:
    """R4."""
    higher = (other.floor_z for other in levels if other.buildings & one.buildings)
    return min((height for height in higher if height >= one.floor_z + TALL_M), default=np.inf)


def _wall_length(parts: Iterable[Part], floor: float) -> float:
    """Length in plan of the walls that reach 1.8 m over a floor; half of it, since a wall has two faces."""
    surfaces = Surfaces.of(united(parts))
    segments = cut(surfaces, surfaces.walls(), floor + TALL_M - MARGIN_M)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()) / 2
