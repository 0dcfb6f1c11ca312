"""IFC files: storeys become levels; spaces give rooms, names and labels; openings tell doors from mere gaps.

**Height of a floor**: where people stand on a storey.

H1  A storey's elevation stands unless its walls' feet lie off it (elevations that an exporter left at 0): then those.
H2  Doors' sills, the floors of spaces and the tops of slabs vote; where more of them agree on another height near the
    elevation than on the elevation, that is the floor: a screed that nobody drew, doors that start a step above it.

**Storeys**: which are levels, and which belong together.

S1  A storey is a level where it has a room, or where walls of 1.8 m stand on its floor and it holds a wall itself: the
    roof, the foundation and a mere reference height have neither. One without is passed over, not rejected.
S2  Where the file names rooms or doors, a storey with neither is a roof with its parapets, or a void, unless it holds
    a floor slab of its own and walls of 1.8 m around it. In a file without doors, it is also a level if its own walls
    are 2.2 m high and enclose half the area or more that the walls of a storey with rooms do: somebody drew the rooms
    of one storey, and not yet those of the next.
S3  Storeys less than 0.9 m apart are one level with steps; so are those less than 1.8 m apart unless both have rooms
    (a crawl space under a floor). The one with rooms, then with more walls, gives the height.
S4  A level ends where the next of the same building starts that is at least head height above it.

**Levels**: what stands on each, its rooms, its openings, its furniture.

L1  A wall belongs to each level of its building through whose height it runs, whichever storey contains it.
L2  A beam with its underside between head height and 3 m is a lintel; higher ones hang over a room or carry a roof.
L3  A loose part (IfcBuildingElementProxy, a plate or member by itself) is wall where it stands like one: upright, from
    the floor to head height, thin.
L4  A door's leaf belongs to the level that its door is entered from; a thing to the level whose storey holds it, else
    to the one on whose floor it stands.
L5  A hole in a wall that is no way through it is wall too (``ifc_spaces``).
L6  One looks down onto a lower level where one of its slabs lies and no slab is within reach under this level's floor.
L7  A building with spaces and no wall at all, a study of its rooms, gets walls between and around the spaces, if these
    leave room for walls. Spaces that touch each other are zones, of which nobody knows where walls stand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.geometry.areas import buffer_mitred, fill_enclosed, union_of
from pipeline.geometry.cutting import merge_meshes
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import prism, walls_around
from pipeline.sources.files import base_id, level_id, list_files
from pipeline.sources.ifc_model import Building, Part, Storey, load_building
from pipeline.sources.ifc_spaces import (
    StandingWalls,
    closed_holes,
    footprint,
    is_room,
    level_of_door,
    merge_parts,
    openings_of,
    rooms_of,
    shadow,
)
from pipeline.sources.storeys.levels import Shift, near_shift
from pipeline.sources.storeys.surfaces import Surfaces, WallProfile, cut_at_height
from pipeline.sources.tolerances import (
    AGREE_M,
    CLEAR_M,
    COMMON_STOREY_M,
    HIGHEST_LINTEL_M,
    IFC_WALL_M,
    KNEE_M,
    MARGIN_M,
    OFF_FLOOR_M,
    ROUGH_M,
    RUNS_THROUGH_M,
    SLAB_M2,
    SLAB_VOTES,
    SPACE_CRACK_M,
    SPACES_TOUCH,
    SPLIT_LEVEL_M,
    STOREY_ENCLOSED,
    STOREY_WALLED,
    STOREY_WALLS_M,
    UPRIGHT_M,
    WALL_FOOT_M,
)
from pipeline.values import Input, Level, Mesh, SourceObject, SourceOpening, SourceRoom


@dataclass(frozen=True)
class _Vote:
    height: float
    weight: float


def floor_height(building: Building, storey: Storey) -> float:
    """Height of the storey's floor in project axes, metres."""
    given = _floor_of_walls(building.walls, storey)
    votes = [_Vote(given, 1.0)]
    votes += [_Vote(float(hole.mesh.vertices[:, 2].min()), 1.0) for hole in building.holes if hole.has_door]
    votes += [_Vote(space.bottom, 1.0) for space in building.spaces if space.storey == storey.key and is_room(space)]
    near = [vote for vote in votes if abs(vote.height - given) <= OFF_FLOOR_M]
    near += [_slab(slab) for slab in building.slabs if abs(slab.top - given) <= OFF_FLOOR_M]
    best = max(near, key=lambda vote: (_support(near, vote.height), -abs(vote.height - given)))
    if _support(near, best.height) <= _support(near, given):
        return given
    agreeing = [vote.height for vote in near if abs(vote.height - best.height) <= AGREE_M]
    return float(np.median(agreeing))  # H2


def _floor_of_walls(walls: Sequence[Part], storey: Storey) -> float:
    """H1."""
    feet = [part.bottom for part in walls if part.storey == storey.key and part.top - part.bottom >= CLEAR_M]
    middle = float(np.median(feet)) if feet else storey.elevation_m
    return middle if abs(middle - storey.elevation_m) > OFF_FLOOR_M else storey.elevation_m


def _slab(slab: Part) -> _Vote:
    return _Vote(slab.top, min(footprint(slab.mesh).area / SLAB_M2, SLAB_VOTES))


def _support(votes: Sequence[_Vote], height: float) -> float:
    return sum(vote.weight for vote in votes if abs(vote.height - height) <= AGREE_M)


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
    doors = any(hole.has_door for hole in building.holes)
    like_m2 = np.inf if doors else STOREY_ENCLOSED * _most_enclosed(building, rooms)
    standing = (_standing(building, storey, rooms, bool(rooms) or doors, like_m2) for storey in building.storeys)
    candidates = [found for found in standing if found]
    kept: list[Standing] = []
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
    building: Building, storey: Storey, rooms: Sequence[Part], named: bool, like_m2: float
) -> Standing | None:
    """S1, S2; walls that enclose more than ``like_m2`` are drawn like those of a storey with rooms."""
    own = [part for part in building.walls if part.storey == storey.key]
    floor = floor_height(building, storey)
    has_rooms = any(_is_in(space, storey, floor) for space in rooms)
    entered = any(_is_entered(hole.mesh, floor) for hole in building.holes if hole.has_door)
    lacking = named and not has_rooms and not entered
    like = lacking and like_m2 < np.inf and _enclosed_area(_high(own, floor)) > like_m2
    if lacking and not like and not _is_walled(building, storey, own, floor):
        return None
    if not has_rooms and (not own or _wall_length(building.walls, floor) < STOREY_WALLS_M):
        return None
    if not any(part.bottom < floor + CLEAR_M and part.top > floor + MARGIN_M for part in building.walls):
        return None
    keys, buildings = frozenset({storey.key}), frozenset({storey.building})
    return Standing(storey, floor, keys, buildings, has_rooms, _wall_length(own, floor))


def _is_walled(building: Building, storey: Storey, own: Sequence[Part], floor: float) -> bool:
    """S2: whether walls of the storey stand around most of a slab that it holds at its floor."""
    slabs = [part for part in building.slabs if part.storey == storey.key and abs(part.top - floor) < OFF_FLOOR_M]
    around = sum(footprint(part.mesh).length for part in slabs)
    return bool(around > 0 and _wall_length(own, floor) > STOREY_WALLED * around)


def _high(walls: Iterable[Part], floor: float) -> list[Part]:
    """S2: the walls that stand on a floor and are high enough for rooms."""
    return [part for part in walls if part.bottom < floor + CLEAR_M and part.top > floor + COMMON_STOREY_M[0]]


def _most_enclosed(building: Building, rooms: Sequence[Part]) -> float:
    """S2: square metres within the walls of a storey with rooms, of the largest one; infinite where there is none."""
    storeys = {space.storey for space in rooms}
    return max(
        (_enclosed_area(part for part in building.walls if part.storey == key) for key in storeys), default=np.inf
    )


def _enclosed_area(walls: Iterable[Part]) -> float:
    return float(fill_enclosed(union_of(buffer_mitred(footprint(part.mesh), ROUGH_M) for part in walls)).area)


def _is_in(space: Part, storey: Storey, floor: float) -> bool:
    return space.storey == storey.key or (space.storey is None and abs(space.bottom - floor) < OFF_FLOOR_M)


def _is_entered(mesh: Mesh, floor: float) -> bool:
    return abs(float(mesh.vertices[:, 2].min()) - floor) < OFF_FLOOR_M


def _are_one(one: Standing, other: Standing) -> bool:
    """S3."""
    return abs(one.floor_z - other.floor_z) < (SPLIT_LEVEL_M if one.has_rooms and other.has_rooms else CLEAR_M)


def _above(one: Standing, levels: Sequence[Standing]) -> float:
    """S4."""
    higher = (other.floor_z for other in levels if other.buildings & one.buildings)
    return min((height for height in higher if height >= one.floor_z + CLEAR_M), default=np.inf)


def _wall_length(parts: Iterable[Part], floor: float) -> float:
    """Length in plan of the walls that reach 1.8 m over a floor; half of it, since a wall has two faces."""
    surfaces = Surfaces.of(merge_parts(parts))
    segments = cut_at_height(surfaces, surfaces.walls(), floor + CLEAR_M - MARGIN_M)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()) / 2


UNDER_M, OVER_M = 1.0, 0.3  # of a floor: slabs in between are steps of it, or its structure


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
    """L7: walls around the rooms of each storey, as high as its highest room."""
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
    """L7: whether most of the spaces' edges lie against other spaces."""
    lengths = shapely.length(floors)
    whole = shapely.union_all(buffer_mitred(np.array(floors, dtype=np.object_), SPACE_CRACK_M / 2))
    hidden = lengths.sum() - shapely.length(whole)
    return bool(hidden > SPACES_TOUCH * lengths.sum())


def _level(
    building: Building, standing: Standing, floors: Sequence[float], of_building: dict[int, int | None]
) -> IfcLevel:
    floor = standing.floor_z
    parts = [*building.walls, *(part for part in building.loose if _is_wall(part, floor))]
    here = [
        part for part in parts if _runs_through(part, floor + RUNS_THROUGH_M, standing.above - RUNS_THROUGH_M)
    ]  # L1
    here = [part for part in here if part.storey is None or of_building.get(part.storey) in standing.buildings]
    standing_walls = StandingWalls([part.mesh for part in here])
    panes = closed_holes(building.windows, building.holes, standing_walls, floor, standing.above)  # L5
    beams = [part.mesh for part in building.beams if _is_lintel(part, floor)]
    walls = merge_meshes(*(part.mesh for part in here), *beams, *panes)
    surfaces = Surfaces.of(walls)
    top = WallProfile.of(surfaces, surfaces.walls()).end_above(floor + CLEAR_M, floor + WALL_FOOT_M)
    return IfcLevel(
        name=standing.storey.name,
        floor_z=floor,
        ceiling_m=max(min(top, standing.above - MARGIN_M) - floor, CLEAR_M),
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
    """L2."""
    return floor + CLEAR_M <= beam.bottom < floor + HIGHEST_LINTEL_M


def _is_wall(part: Part, floor: float) -> bool:
    """L3."""
    if part.bottom > floor + KNEE_M or part.top < floor + CLEAR_M:
        return False
    points = part.mesh.vertices
    middle = (part.bottom + part.top) / 2
    foot, head = points[points[:, 2] < middle, :2], points[points[:, 2] >= middle, :2]
    leans = np.abs([*(foot.min(axis=0) - head.min(axis=0)), *(foot.max(axis=0) - head.max(axis=0))]).max()
    corners = np.asarray(shapely.oriented_envelope(footprint(part.mesh)).boundary.coords)
    sides = np.hypot(*np.diff(corners[:3], axis=0).T)
    return bool(leans < UPRIGHT_M and len(sides) > 1 and sides.min() < IFC_WALL_M)


def _is_on(part: Part, standing: Standing, floors: Sequence[float]) -> bool:
    """L4; the same holds for rooms."""
    if part.storey is not None:
        return part.storey in standing.keys
    return max((floor for floor in floors if floor <= part.bottom + KNEE_M), default=None) == standing.floor_z


def _floor(building: Building, standing: Standing) -> Polygon | MultiPolygon | None:
    """Slabs whose top lies at the floor, whichever storey contains them."""
    tops = [part for part in building.slabs if abs(part.top - standing.floor_z) < OFF_FLOOR_M]
    return _area(shapely.union_all([footprint(part.mesh) for part in tops], grid_size=ROUGH_M))


def _below(building: Building, floor: float, floors: Sequence[float]) -> Polygon | MultiPolygon | None:
    """L6."""
    lower = [each for each in floors if each < floor - CLEAR_M]
    tops = [part for part in building.slabs if any(abs(part.top - each) < OFF_FLOOR_M for each in lower)]
    near = [part for part in building.slabs if part.top > floor - UNDER_M and part.bottom < floor + OVER_M]
    shown, hidden = (shapely.union_all([shadow(part.mesh) for part in parts]) for parts in (tops, near))
    return _area(shapely.difference(shown, hidden, grid_size=ROUGH_M))


def _area(shape: BaseGeometry) -> Polygon | MultiPolygon | None:
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None


SUFFIXES = (".ifc",)


def find(path: str, **options: str) -> Iterator[Input]:
    """List the IFC files at or under a path; IFC says its units and axes itself, so there are no options.

    Raises
    ------
    ConfigError
        Where an option is given.
    Rejection
        MISSING_FILE where the path does not exist.
    """
    if options:
        raise ConfigError(f"IFC files take no option, {', '.join(sorted(options))} given")
    for file, name in list_files(path, SUFFIXES):
        yield Input(base_id(name), "ifc", str(file), options=(("file", name),))


def read(item: Input) -> Iterator[Level]:
    """Yield the storeys of one IFC file that are levels, from the lowest to the highest.

    Raises
    ------
    Rejection
        Where the file cannot be read, or no storey has walls.
    """
    path = Path(item.path)
    building = load_building(path)
    found = storey_levels(building)
    if not found:
        names = ", ".join(storey.name for storey in building.storeys[:8])
        detail = f"{path.name}: no wall of 1.8 m stands on any of its storeys ({names})"
        raise Rejection("source", Reason.NO_LEVEL, detail, "export the walls too, or the building as a mesh")
    shift = near_shift(np.concatenate([level.walls.vertices for level in found]))
    digest = sha256_of(path)
    name = dict(item.options).get("file", path.name)
    for number, level in enumerate(found):
        provenance = {
            "source": "ifc",
            "file": name,
            "sha256": digest,
            "schema": building.schema,
            "storey": level.name,
            "units": "m",
            "up": "z",
        }
        yield _in_own_frame(level, shift, level_id(item.id, number, len(found)), number, provenance)


def _in_own_frame(found: IfcLevel, shift: Shift, name: str, number: int, provenance: dict[str, str]) -> Level:
    """Move a level into its own frame: near the origin, the floor at z = 0."""
    x, y = shift[:2]

    def moved(part: Part) -> SourceObject:
        return SourceObject((*part.words, part.kind), Mesh(part.mesh.vertices - (x, y, found.floor_z), part.mesh.faces))

    return Level(
        id=name,
        walls=Mesh(found.walls.vertices - (x, y, found.floor_z), found.walls.faces),
        ceiling_m=found.ceiling_m,
        frame=Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", found.floor_z, number),
        floor=found.floor and translate(found.floor, -x, -y),
        below=found.below and translate(found.below, -x, -y),
        leaves=tuple(moved(leaf) for leaf in found.leaves),
        furniture=tuple(moved(thing) for thing in found.furniture),
        rooms=tuple(
            SourceRoom(room.words, room.labels, room.polygon and translate(room.polygon, -x, -y))
            for room in found.rooms
        ),
        room_count=len(found.rooms) or None,
        named_openings=found.named_openings,
        only_walls=True,
        openings=tuple(SourceOpening(translate(each.polygon, -x, -y), each.has_door) for each in found.openings),
        n_objects=len(found.furniture),
        provenance=provenance,
    )
