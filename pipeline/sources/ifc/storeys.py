"""Decide which storeys of an IFC file are levels, and at which height (metres) people stand on them.

**Elements without a storey**: files that hold no storey, or whose walls and spaces are contained in none, name their
parts all the same.

N1  A wall or a space without a storey is in the highest storey of its building on whose floor it stands: it starts at
    most 0.6 m under the floor (walls start under the slab) and less than 1.8 m over it. A slab is in the one at whose
    floor its top lies.
N2  Rooms, and walls of 1.8 m, that stand on no storey's floor get storeys: one at the floor of each room that lies more
    than 0.6 m from the others, then one at the foot of each wall that stands on none of these.
N4  A wall or a space that cannot be in the storey that contains it counts as one without a storey where it stands on
    the floor of another: what ends at the elevation of its storey or lower; and, where one storey contains all walls of
    a file that names rooms or doors, what starts at the elevation of a higher one or above.
N5  Where one storey contains all walls of a file, those that stand on a slab 1.8 m or more over its floor count as ones
    without a storey, and so do that slab and the spaces on it: several storeys were drawn in one.
N3  An element without a building belongs to the building of the file, if there is one only.

**Height of a floor**: where people stand on a storey.

H1  A storey's elevation stands unless its walls' feet lie off it (elevations that an exporter left at 0): then those,
    each as much as its wall is long. What else stands there counts only where the storey has no wall: windows and
    plates start at their sill, and some columns are piles under the floor, or stand on another one. An elevation that a
    person says stands.
H2  Doors' sills, the floors of spaces and the tops of slabs vote; where more of them agree on another height near the
    elevation than on the elevation, that is the floor: a screed that nobody drew, doors that start a step above it.

**Storeys**: which are levels, and which belong together.

S1  A storey is a level where it has a room, or where walls of 1.8 m stand on its floor and it holds a wall itself: the
    roof, the foundation and a mere reference height have neither. One without is passed over, not rejected. A storey
    that a person says is a level wherever walls stand.
S2  Where the file names rooms or doors, a storey with neither is a roof with its parapets, or a void, unless it holds
    a floor slab of its own and walls of 1.8 m around it. In a file without doors, it is also a level if its own walls
    are 2.2 m high and enclose half the area or more that the walls of a storey with rooms do: somebody drew the rooms
    of one storey, and not yet those of the next.
S3  Storeys less than 0.9 m apart are one level with steps; so are those less than 1.8 m apart unless both have rooms
    (a crawl space under a floor). The one with rooms, then with more walls, gives the height.
S4  A level ends where the next of the same building starts that is at least head height above it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.geometry.areas import buffer_mitred, fill_enclosed, unite
from pipeline.sources.ifc.model import Building, ElementBody, Storey
from pipeline.sources.ifc.rooms_and_openings import is_room, largest_footprint, merge_parts
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.sources.tolerances import (
    COMMON_STOREY_M,
    COVER_MARGIN_M,
    OFF_FLOOR_M,
    SPLIT_LEVEL_M,
    STOREY_WALLS_M,
    USUAL_ROOM_M2,
)
from pipeline.tolerances import HAND_M, HEAD_M, MM_M, MOST, MOSTLY
from pipeline.values import Mesh


def assign_to_storeys(building: Building) -> Building:
    """Return the building in which each wall, slab and space that stands on a floor is in a storey."""
    building = _without_false_storeys(building)
    loose = [part for part in (*building.walls, *building.spaces) if part.storey is None]
    if not loose:
        return building
    floors = {storey: floor_height(building, storey) for storey in building.storeys}
    only = next(iter(building.buildings)) if len(building.buildings) == 1 else None
    for home in dict.fromkeys(_home(part, only) for part in loose):
        here = [part for part in loose if _home(part, only) == home]
        for height in _floors_of([part for part in here if _storey_under(part, floors, only) is None]):
            made = Storey(-1 - len(floors), f"at {height:.2f} m", height, home)
            floors[made] = height

    def to_storey_under(part: ElementBody) -> ElementBody:
        if part.storey is not None:
            return part
        under = _storey_under(part, floors, only)
        return part if under is None else replace(part, storey=under.key)

    def to_storey_at(slab: ElementBody) -> ElementBody:
        if slab.storey is not None:
            return slab
        tops = [each for each in _of_home(slab, floors, only) if abs(slab.top - floors[each]) <= OFF_FLOOR_M]
        nearest = min(tops, key=lambda each: abs(slab.top - floors[each]), default=None)
        return slab if nearest is None else replace(slab, storey=nearest.key)

    return replace(
        building,
        storeys=tuple(sorted(floors, key=lambda storey: (storey.elevation_m, storey.key))),
        walls=tuple(map(to_storey_under, building.walls)),
        slabs=tuple(map(to_storey_at, building.slabs)),
        spaces=tuple(map(to_storey_under, building.spaces)),
    )


def _without_false_storeys(building: Building) -> Building:
    """N4, N5."""
    storeys = {storey.key: storey for storey in building.storeys}
    named = bool(building.spaces) or any(hole.has_door for hole in building.holes)
    alone = len({part.storey for part in building.walls}) == 1
    in_one = named and alone
    feet = np.array([part.bottom for part in building.walls if alone and part.top - part.bottom >= HEAD_M])
    upper = [slab.top for slab in building.slabs if (np.abs(feet - slab.top) <= OFF_FLOOR_M).any()]

    def correct(part: ElementBody) -> ElementBody:
        storey = None if part.storey is None else storeys.get(part.storey)
        if storey is None:
            return part
        others = [each for each in building.storeys if each.building == storey.building]
        others = [each for each in others if _stands_on(part.bottom, each.elevation_m)]
        lies_under = part.top <= storey.elevation_m + COVER_MARGIN_M
        higher = [each for each in others if each.elevation_m >= storey.elevation_m + HEAD_M]
        lies_over = in_one and any(part.bottom >= each.elevation_m - COVER_MARGIN_M for each in higher)
        drawn_in_one = any(
            abs(part.bottom - top) <= OFF_FLOOR_M and top >= storey.elevation_m + HEAD_M for top in upper
        )
        if (others and (lies_under or lies_over)) or drawn_in_one:
            return replace(part, storey=None, building=storey.building)
        return part

    parts = (building.walls, building.spaces, building.slabs if upper else ())
    walls, spaces, slabs = (tuple(map(correct, each)) for each in parts)
    return replace(building, walls=walls, spaces=spaces, slabs=slabs or building.slabs)


def is_made_storey(storey: Storey) -> bool:
    """Return whether the storey is not the file's, but was made for what stands on no storey of the file."""
    return storey.key < 0


def _home(part: ElementBody, only: int | None) -> int | None:
    """N3."""
    return only if part.building is None else part.building


def _of_home(part: ElementBody, floors: dict[Storey, float], only: int | None) -> list[Storey]:
    """Return the storeys of the building that a part is in."""
    home = _home(part, only)
    return [storey for storey in floors if home is None or storey.building in {home, None}]


def _storey_under(part: ElementBody, floors: dict[Storey, float], only: int | None) -> Storey | None:
    """N1."""
    under = [each for each in _of_home(part, floors, only) if _stands_on(part.bottom, floors[each])]
    return max(under, key=lambda each: floors[each], default=None)


def _floors_of(parts: Sequence[ElementBody]) -> list[float]:
    """N2."""
    found: list[float] = []
    for floor in sorted(part.bottom for part in parts if part.kind == "IfcSpace" and is_room(part)):
        if all(abs(floor - other) > OFF_FLOOR_M for other in found):
            found.append(floor)
    for foot in sorted(part.bottom for part in parts if part.kind != "IfcSpace" and part.top - part.bottom >= HEAD_M):
        if not any(_stands_on(foot, floor) for floor in found):
            found.append(foot)
    return found


def _stands_on(height: float, floor: float) -> bool:
    """N1: whether what starts at a height stands on a floor, or on what lies under it or on it."""
    return -OFF_FLOOR_M <= height - floor < HEAD_M


@dataclass(frozen=True)
class _Vote:
    height: float
    weight: float


def floor_height(building: Building, storey: Storey) -> float:
    """Height of the storey's floor in project axes, metres."""
    given = storey.elevation_m if storey.is_said else _floor_of_walls(building.walls, storey)
    votes = [_Vote(given, 1.0)]
    votes += [_Vote(float(hole.mesh.vertices[:, 2].min()), 1.0) for hole in building.holes if hole.has_door]
    votes += [_Vote(space.bottom, 1.0) for space in building.spaces if space.storey == storey.key and is_room(space)]
    near = [vote for vote in votes if abs(vote.height - given) <= OFF_FLOOR_M]
    near += [
        _Vote(slab.top, min(largest_footprint(slab.mesh).area / USUAL_ROOM_M2, 3))  # three doors at most
        for slab in building.slabs
        if abs(slab.top - given) <= OFF_FLOOR_M
    ]
    best = max(near, key=lambda vote: (_support(near, vote.height), -abs(vote.height - given)))
    if _support(near, best.height) <= _support(near, given):
        return given
    # votes for a floor's height that are closer agree
    agreeing = [vote.height for vote in near if abs(vote.height - best.height) <= HAND_M]
    return float(np.median(agreeing))  # H2


def _floor_of_walls(walls: Sequence[ElementBody], storey: Storey) -> float:
    """H1."""
    own = [part for part in walls if part.storey == storey.key and part.top - part.bottom >= HEAD_M]
    own = [part for part in own if part.kind.startswith("IfcWall")] or own
    middle = _middle_foot(own) if own else storey.elevation_m
    return middle if abs(middle - storey.elevation_m) > OFF_FLOOR_M else storey.elevation_m


def _middle_foot(walls: Sequence[ElementBody]) -> float:
    """H1: the height at which half of the walls' length stands lower, half higher."""
    feet = np.array([wall.bottom for wall in walls])
    lengths = np.array([float(np.hypot(*np.ptp(wall.mesh.vertices[:, :2], axis=0))) for wall in walls])
    order = np.argsort(feet)
    return float(feet[order][np.searchsorted(np.cumsum(lengths[order]), lengths.sum() / 2)])


def _support(votes: Sequence[_Vote], height: float) -> float:
    return sum(vote.weight for vote in votes if abs(vote.height - height) <= HAND_M)


@dataclass(frozen=True)
class LevelStorey:
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


def find_level_storeys(building: Building) -> list[LevelStorey]:
    """Return the storeys that are levels from the lowest to the highest."""
    rooms = [space for space in building.spaces if is_room(space)]
    doors = any(hole.has_door for hole in building.holes)
    # a storey like one with rooms encloses more than half as much
    like_m2 = np.inf if doors else MOST * _most_enclosed(building, rooms)
    standing = (_standing(building, storey, rooms, bool(rooms) or doors, like_m2) for storey in building.storeys)
    candidates = [found for found in standing if found]
    kept: list[LevelStorey] = []
    for candidate in sorted(candidates, key=lambda each: (not each.has_rooms, -each.own_walls_m, each.floor_z)):
        near = next((i for i, other in enumerate(kept) if _are_one(other, candidate)), None)
        if near is None:
            kept.append(candidate)
        else:  # S3
            keys, buildings = kept[near].keys | candidate.keys, kept[near].buildings | candidate.buildings
            kept[near] = replace(kept[near], keys=keys, buildings=buildings)
    kept.sort(key=lambda each: each.floor_z)
    return [replace(each, above=_above(each, kept)) for each in kept]


def _standing(
    building: Building, storey: Storey, rooms: Sequence[ElementBody], named: bool, like_m2: float
) -> LevelStorey | None:
    """S1, S2; walls that enclose more than ``like_m2`` are drawn like those of a storey with rooms."""
    own = [part for part in building.walls if part.storey == storey.key]
    floor = floor_height(building, storey)
    has_rooms = any(_is_in(space, storey, floor) for space in rooms)
    entered = any(_is_entered(hole.mesh, floor) for hole in building.holes if hole.has_door)
    lacking = named and not has_rooms and not entered and not storey.is_said
    like = lacking and like_m2 < np.inf and _enclosed_area(_high(own, floor)) > like_m2
    if lacking and not like and not _is_walled(building, storey, own, floor):
        return None
    if not (has_rooms or storey.is_said) and (not own or _wall_length(building.walls, floor) < STOREY_WALLS_M):
        return None
    if not any(part.bottom < floor + HEAD_M and part.top > floor + COVER_MARGIN_M for part in building.walls):
        return None
    keys, buildings = frozenset({storey.key}), frozenset({storey.building})
    return LevelStorey(storey, floor, keys, buildings, has_rooms, _wall_length(own, floor))


def _is_walled(building: Building, storey: Storey, own: Sequence[ElementBody], floor: float) -> bool:
    """S2: whether walls of the storey stand around most of a slab that it holds at its floor."""
    slabs = [part for part in building.slabs if part.storey == storey.key and abs(part.top - floor) < OFF_FLOOR_M]
    around = unite(largest_footprint(part.mesh) for part in slabs).length  # of one floor, of however many pieces
    # a storey has walls along most of its slab's edge
    return bool(around > 0 and _wall_length(own, floor) > MOSTLY * around)


def _high(walls: Iterable[ElementBody], floor: float) -> list[ElementBody]:
    """S2: the walls that stand on a floor and are high enough for rooms."""
    return [part for part in walls if part.bottom < floor + HEAD_M and part.top > floor + COMMON_STOREY_M[0]]


def _most_enclosed(building: Building, rooms: Sequence[ElementBody]) -> float:
    """S2: square metres within the walls of a storey with rooms, of the largest one; infinite where there is none."""
    storeys = {space.storey for space in rooms}
    return max(
        (_enclosed_area(part for part in building.walls if part.storey == key) for key in storeys), default=np.inf
    )


def _enclosed_area(walls: Iterable[ElementBody]) -> float:
    return float(fill_enclosed(unite(buffer_mitred(largest_footprint(part.mesh), MM_M) for part in walls)).area)


def _is_in(space: ElementBody, storey: Storey, floor: float) -> bool:
    return space.storey == storey.key or (space.storey is None and abs(space.bottom - floor) < OFF_FLOOR_M)


def _is_entered(mesh: Mesh, floor: float) -> bool:
    return abs(float(mesh.vertices[:, 2].min()) - floor) < OFF_FLOOR_M


def _are_one(one: LevelStorey, other: LevelStorey) -> bool:
    """S3."""
    return abs(one.floor_z - other.floor_z) < (SPLIT_LEVEL_M if one.has_rooms and other.has_rooms else HEAD_M)


def _above(one: LevelStorey, levels: Sequence[LevelStorey]) -> float:
    """S4."""
    higher = (other.floor_z for other in levels if other.buildings & one.buildings)
    return min((height for height in higher if height >= one.floor_z + HEAD_M), default=np.inf)


def _wall_length(parts: Iterable[ElementBody], floor: float) -> float:
    """Length in plan of the walls that reach 1.8 m over a floor; half of it, since a wall has two faces."""
    surfaces = Surfaces.of(merge_parts(parts))
    segments = cut_at_height(surfaces, surfaces.walls(), floor + HEAD_M - COVER_MARGIN_M)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()) / 2
