"""Read IFC files: yield storeys as levels, with walls, rooms from spaces, openings with or without doors, furniture.

**Levels**: what stands on each, its rooms, its openings, its furniture.

L1  A wall belongs to each level of its building through whose height it runs, whichever storey contains it. One that
    starts in the slab over a level and is as high as a wall above it stands on the next.
L2  A beam with its underside between head height and 3 m is a lintel; higher ones hang over a room or carry a roof.
    In a file without a door or a hole in any wall, no beam is a lintel if several hang over the rooms of the level:
    they carry a floor on posts (a timber frame), and nobody drew the walls and doors between the posts.
L3  A loose part (IfcBuildingElementProxy, a plate or member by itself) is wall if it is thin and stands upright from
    the floor to head height. If the walls of the file make no level (a garden wall, one wall of a house of proxies),
    all loose parts are walls. If these make no level either, the beams are walls too (a house of logs).
L4  A door's leaf belongs to the level that its door is entered from; a thing to the level whose storey holds it, else
    to the one on whose floor it stands.
L5  A hole in a wall that is not a way through it is wall too (``rooms_and_openings``).
L6  A lower level shows below where one of its slabs lies and no slab is within reach under this level's floor. A stair,
    a landing or a ramp that stands between the two leads up to this level.
L7  A building with spaces and no wall at all (a study of its rooms) gets walls between and around the spaces, if these
    leave room for walls. Spaces that touch each other are zones, which do not tell where walls stand.
L8  The area under a slab, a roof or a plate above head height is under cover.
L10 The external spaces on a level are outdoors, except a space that covers a room, such as a box around the building.
L11 If no space of a file is head high, its spaces are the floors of rooms (flat areas, thin plates), without those too
    small for a room.
L12 If a file has rooms, but no wall high enough for a room, so that no level has a wall, somebody drew a plan without
    heights, or a maze for a robot. The walls are raised to a storey's height, spaces that begin above them are lowered,
    and spaces end where the walls do. That is a guess.
L13 A window that is called a door (a French window) is a window where its sill is higher than a knee over the level.
L9  A sheet that stands on the floor of a room of the file and ends below its ceiling (a screen of a shower) is not a
    wall of it. A sheet that hangs above the floor (a partition of toilets, with its doors) is a wall.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.geometry.areas import buffer_mitred, shares_inside, unite
from pipeline.geometry.meshes import box_around, merge_meshes
from pipeline.geometry.prisms import make_prisms
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import walls_around_floors
from pipeline.sources.files import id_from_file_name, level_id, list_files_of_format
from pipeline.sources.ifc.model import Body, Building, ElementBody, Storey, WallHole, load_building
from pipeline.sources.ifc.rooms_and_openings import (
    WallFootprints,
    door_level_height,
    find_rooms,
    find_windows,
    is_room,
    largest_footprint,
    openings_of_level,
    project_to_plan,
    standing_area,
)
from pipeline.sources.ifc.storeys import LevelStorey, assign_to_storeys, find_level_storeys, is_made_storey
from pipeline.sources.storeys.levels import Shift, shift_to_origin
from pipeline.sources.storeys.scale import said_size
from pipeline.sources.storeys.surfaces import Surfaces, WallProfile
from pipeline.sources.tolerances import (
    COMMON_STOREY_M,
    COVER_MARGIN_M,
    HIGHEST_BUILDING_M,
    HIGHEST_LINTEL_M,
    NAMED_DOOR_M,
    OFF_FLOOR_M,
    SLABS_M,
    STOREY_M,
)
from pipeline.tolerances import (
    BESIDE_M,
    CRACK_M,
    FOOT_M,
    HAND_M,
    HEAD_M,
    KNEE_M,
    MM_M,
    MOST,
    PATCH_M2,
    SHEET_M,
    SOME,
    THICK_WALL_M,
)
from pipeline.values import Input, Level, Mesh, Opening, SourceObject, SourceRoom


@dataclass(frozen=True, eq=False)
class IfcLevelParts:
    """One level in project axes, metres; ``ceiling_m`` counts from ``floor_z``."""

    name: str
    floor_z: float
    ceiling_m: float
    walls: Mesh
    floor: Polygon | MultiPolygon | None
    below: Polygon | MultiPolygon | None
    stairs: Polygon | MultiPolygon | None
    cover: Polygon | MultiPolygon | None
    outdoors: Polygon | MultiPolygon | None
    rooms: tuple[SourceRoom, ...]
    openings: tuple[Opening, ...]
    windows: tuple[Opening, ...]
    leaves: tuple[ElementBody, ...]
    furniture: tuple[ElementBody, ...]
    named_openings: bool
    guesses: tuple[str, ...]


def find_ifc_levels(building: Building) -> list[IfcLevelParts]:
    """Return the levels from the lowest to the highest; empty where no storey has walls or rooms."""
    building = _with_high_spaces(building)
    as_drawn, guesses = building, tuple[str, ...]()
    building, found = _building_with_levels(as_drawn)
    has_walls = any(level.own_walls_m for level in found)
    if not has_walls and (raised := _with_high_walls(as_drawn)) is not as_drawn:  # L12
        building, found = _building_with_levels(raised)
        guesses = ("heights",)
    of_building = {storey.key: storey.building for storey in building.storeys}
    floors = [each.floor_z for each in found]
    levels = [_level(building, each, floors, of_building) for each in found]
    return [replace(level, guesses=(*level.guesses, *guesses)) for level in levels]


def _with_high_spaces(building: Building) -> Building:
    """L11."""
    if any(space.top - space.bottom >= HEAD_M for space in building.spaces):
        return building
    floors = [(space, largest_footprint(space.mesh)) for space in building.spaces]
    spaces = tuple(
        replace(space, mesh=make_prisms(floor, space.bottom, space.bottom + COMMON_STOREY_M[0]))
        for space, floor in floors
        if floor.area >= PATCH_M2  # a smaller named area is no room
    )
    return replace(building, spaces=spaces)


def _with_high_walls(building: Building) -> Building:
    """L12."""
    low = [part for part in building.walls if part.top > part.bottom]
    if len(low) < 3 or not building.spaces or any(part.top - part.bottom >= HEAD_M for part in low):
        return building
    foot, top = min(part.bottom for part in low), max(part.top for part in low)
    spaces = (_move_parts(space, foot - space.bottom) if space.bottom > top else space for space in building.spaces)
    return replace(building, walls=tuple(map(_raise_wall, low)), spaces=tuple(map(_lower_space, spaces)))


def _move_parts(part: ElementBody, up: float) -> ElementBody:
    return replace(part, mesh=Mesh(part.mesh.vertices + np.array((0.0, 0.0, up)), part.mesh.faces))


def _lower_space(space: ElementBody) -> ElementBody:
    """Return a space no higher than a storey: its ceiling is that of the raised walls."""
    points = space.mesh.vertices.copy()
    points[:, 2] = np.minimum(points[:, 2], space.bottom + COMMON_STOREY_M[0])
    return replace(space, mesh=Mesh(points, space.mesh.faces))


def _raise_wall(wall: ElementBody) -> ElementBody:
    """Return a wall as high as a storey, on its own foot."""
    points = wall.mesh.vertices.copy()
    points[:, 2] = wall.bottom + (points[:, 2] - wall.bottom) * (COMMON_STOREY_M[0] / (wall.top - wall.bottom))
    return replace(wall, mesh=Mesh(points, wall.mesh.faces))


def _building_with_levels(building: Building) -> tuple[Building, list[LevelStorey]]:
    """Return the building with its parts in storeys and walls by L3 and L7, and the storeys that are levels."""
    sorted_in = assign_to_storeys(building)
    if not sorted_in.walls:
        sorted_in = replace(sorted_in, walls=tuple(_walls_of_spaces(sorted_in)))
    found = find_level_storeys(sorted_in)
    if not found and building.loose:
        return _building_with_levels(replace(building, walls=building.walls + building.loose, loose=()))
    if not found and building.beams:
        return _building_with_levels(replace(building, walls=building.walls + building.beams, beams=()))
    return sorted_in, found


def _walls_of_spaces(building: Building) -> Iterator[ElementBody]:
    """L7: walls around the rooms of each storey, as high as its highest room."""
    rooms = [space for space in building.spaces if is_room(space)]
    for key in dict.fromkeys(space.storey for space in rooms):
        here = [space for space in rooms if space.storey == key]
        floors = [largest_footprint(space.mesh) for space in here]
        if _spaces_touch(floors):
            continue
        bottom, top = min(space.bottom for space in here), max(space.top for space in here)
        for wall in walls_around_floors(floors, top - bottom):
            mesh = make_prisms(wall.shape, bottom, top)
            yield ElementBody(mesh=mesh, storey=key, kind="IfcWall")


def _spaces_touch(floors: Sequence[Polygon]) -> bool:
    """L7: whether most of the spaces' edges lie against other spaces."""
    lengths = shapely.length(floors)
    # IFC spaces that are closer touch
    whole = shapely.union_all(buffer_mitred(np.array(floors, dtype=np.object_), CRACK_M / 2))
    hidden = lengths.sum() - shapely.length(whole)
    # spaces touch that have so much of their edges along others: no wall is drawn between them
    return bool(hidden > SOME * lengths.sum())


def _level(
    building: Building, standing: LevelStorey, floors: Sequence[float], of_building: dict[int, int | None]
) -> IfcLevelParts:
    floor = standing.floor_z
    building = _with_french_windows(building, standing)
    parts = [*building.walls, *(part for part in building.loose if _is_wall(part, floor))]
    here = [part for part in parts if _runs_through(part, floor, standing.above)]  # L1
    here = [part for part in here if part.storey is None or of_building.get(part.storey) in standing.buildings]
    spaces = [space for space in building.spaces if _is_on(space, standing, floors)]
    screens = _screens(here, spaces)  # L9
    here = [part for part in here if all(part is not screen for screen in screens)]
    standing_walls = WallFootprints([part.mesh for part in here])
    panes, windows = find_windows(building.windows, building.holes, standing_walls, floor, standing.above)  # L5
    rooms = find_rooms(spaces, standing_walls)
    beams = [part.mesh for part in building.beams if floor + HEAD_M <= part.bottom < floor + HIGHEST_LINTEL_M]
    if not (building.named_openings or building.holes) and _carry_floor(beams, rooms):
        beams = []
    walls = merge_meshes([*(part.mesh for part in here), *beams, *panes])
    surfaces = Surfaces.of(walls)
    # skirtings end below the height from which walls are measured
    top = WallProfile.of(surfaces, surfaces.walls()).end_above(floor + HEAD_M, floor + FOOT_M)
    return IfcLevelParts(
        name=standing.storey.name,
        floor_z=floor,
        ceiling_m=max(min(top, standing.above - COVER_MARGIN_M) - floor, HEAD_M),
        walls=walls,
        floor=_floor(building, standing),
        below=_below(building, floor, floors),
        stairs=_stairs(building, floor, floors),
        cover=_cover(building, floor),
        outdoors=_outdoors([each for each in building.outdoors if _is_on(each, standing, floors)], rooms),
        rooms=rooms,
        openings=openings_of_level(building.holes, standing_walls, floor, floors),
        windows=tuple(windows),
        leaves=tuple(leaf for leaf in building.leaves if door_level_height(leaf.bottom, floors) == floor),
        furniture=(*(thing for thing in building.furniture if _is_on(thing, standing, floors)), *screens),
        named_openings=building.named_openings,
        guesses=("levels",) if is_made_storey(standing.storey) else (),
    )


def _with_french_windows(building: Building, standing: LevelStorey) -> Building:
    """L13: return the building as one level sees it."""
    low, high = standing.floor_z + KNEE_M, standing.above
    gone = [hole for hole in building.holes if hole.is_window and low <= hole.bottom < high]
    return replace(
        building,
        holes=tuple(hole for hole in building.holes if all(hole is not each for each in gone)),
        windows=(*building.windows, *(replace(hole, has_door=False, is_window=False) for hole in gone)),
        leaves=tuple(leaf for leaf in building.leaves if not any(_stands_in(leaf, hole) for hole in gone)),
    )


def _stands_in(leaf: ElementBody, hole: WallHole) -> bool:
    """Return whether a leaf's middle lies in the box around a hole."""
    low, high = hole.mesh.vertices.min(axis=0), hole.mesh.vertices.max(axis=0)
    middle = (leaf.mesh.vertices.min(axis=0) + leaf.mesh.vertices.max(axis=0)) / 2
    return bool((low <= middle).all() and (middle <= high).all())


def _runs_through(part: ElementBody, floor: float, above: float) -> bool:
    """L1."""
    stands_above = part.bottom >= above - OFF_FLOOR_M and part.top >= above + HEAD_M
    # a part that reaches so far into a storey stands in it
    return part.bottom < above - HAND_M and part.top > floor + HAND_M and not stands_above


def _carry_floor(beams: Sequence[Mesh], rooms: Sequence[SourceRoom]) -> bool:
    """L2."""
    inner = unite(buffer_mitred(room.polygon, -HAND_M) for room in rooms if room.polygon is not None)
    return int((shares_inside([largest_footprint(beam) for beam in beams], inner) > MOST).sum()) >= 3


def _is_wall(part: ElementBody, floor: float) -> bool:
    """L3."""
    if part.bottom > floor + KNEE_M or part.top < floor + HEAD_M:
        return False
    points = part.mesh.vertices
    middle = (part.bottom + part.top) / 2
    foot, head = points[points[:, 2] < middle, :2], points[points[:, 2] >= middle, :2]
    leans = np.abs([*(foot.min(axis=0) - head.min(axis=0)), *(foot.max(axis=0) - head.max(axis=0))]).max()
    corners = np.asarray(shapely.oriented_envelope(largest_footprint(part.mesh)).boundary.coords)
    sides = np.hypot(*np.diff(corners[:3], axis=0).T)
    # the head of an upright part stands over its foot
    # an unspecified part that is upright and as thin is a wall
    return bool(leans < BESIDE_M and len(sides) > 1 and sides.min() < THICK_WALL_M)


def _screens(parts: Sequence[ElementBody], spaces: Sequence[ElementBody]) -> list[ElementBody]:
    """L9."""
    rooms = [(space, standing_area(space.mesh)) for space in spaces if is_room(space)]
    return [
        part
        for part in parts
        if any(_is_low(part, space) and _lies_in(part.mesh, room) for space, room in rooms)
        and box_around(part.mesh.vertices).thickness <= SHEET_M
    ]


def _is_low(part: ElementBody, space: ElementBody) -> bool:
    """Return whether a part stands on the floor of a space and ends below its ceiling."""
    return bool(part.bottom <= space.bottom + FOOT_M and part.top <= space.top - HAND_M)


def _lies_in(mesh: Mesh, room: Polygon) -> bool:
    return bool(shapely.covers(shapely.buffer(room, SHEET_M), shapely.multipoints(mesh.vertices[:, :2])))


def _is_on(part: ElementBody, standing: LevelStorey, floors: Sequence[float]) -> bool:
    """L4; the same holds for rooms."""
    if part.storey is not None:
        return part.storey in standing.keys
    return max((floor for floor in floors if floor <= part.bottom + KNEE_M), default=None) == standing.floor_z


def _floor(building: Building, standing: LevelStorey) -> Polygon | MultiPolygon | None:
    """Slabs whose top lies at the floor, whichever storey contains them."""
    tops = [part for part in building.slabs if abs(part.top - standing.floor_z) < OFF_FLOOR_M]
    return _area(shapely.union_all([largest_footprint(part.mesh) for part in tops], grid_size=MM_M))


def _below(building: Building, floor: float, floors: Sequence[float]) -> Polygon | MultiPolygon | None:
    """L6."""
    lower = [each for each in floors if each < floor - HEAD_M]
    tops = [part for part in building.slabs if any(abs(part.top - each) < OFF_FLOOR_M for each in lower)]
    near = [part for part in building.slabs if part.top > floor - SLABS_M[0] and part.bottom < floor + SLABS_M[1]]
    shown, hidden = (shapely.union_all([project_to_plan(part.mesh) for part in parts]) for parts in (tops, near))
    return _area(shapely.difference(shown, hidden, grid_size=MM_M))


def _stairs(building: Building, floor: float, floors: Sequence[float]) -> Polygon | MultiPolygon | None:
    """L6."""
    below = max((each for each in floors if each < floor - HEAD_M), default=np.inf)
    found = [part for part in building.stairs if below - OFF_FLOOR_M <= part.bottom < floor - KNEE_M]
    return _area(unite(project_to_plan(part.mesh) for part in found))


def _cover(building: Building, floor: float) -> Polygon | MultiPolygon | None:
    """L8."""
    plates = (part for part in (*building.walls, *building.loose) if part.kind == "IfcPlate")
    parts = (*building.slabs, *building.roofs, *plates)
    over = [project_to_plan(part.mesh) for part in parts if part.bottom >= floor + HEAD_M]
    return _area(shapely.union_all(over, grid_size=MM_M))


def _outdoors(spaces: Sequence[ElementBody], rooms: Sequence[SourceRoom]) -> Polygon | MultiPolygon | None:
    """L10."""
    drawn = [room.polygon for room in rooms if room.polygon is not None]
    floors = (standing_area(space.mesh) for space in spaces)
    return _area(unite(floor for floor in floors if not (shares_inside(drawn, floor) > MOST).any()))


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
    for file, name in list_files_of_format(path, SUFFIXES):
        yield Input(id_from_file_name(name), "ifc", str(file), options=(("file", name),))


def read(item: Input) -> Iterator[Level]:
    """Yield the storeys of one IFC file that are levels, from the lowest to the highest.

    Raises
    ------
    Rejection
        Where the file cannot be read, or no storey has walls.
    """
    path, options = Path(item.path), dict(item.options)
    dropped = json.loads(options.get("drop_nodes", "[]"))
    building = load_building(path, dropped)
    units, scale = said_size(options)
    factor = scale * (find_unit_factor(building) if units is None else units / building.unit_m)
    unit_m = building.unit_m * factor
    building = scale_building(building, factor) if factor != 1.0 else building
    if floors := json.loads(options.get("floors", "[]")):
        building = _on_floors(building, floors)
    found = [
        each
        for each in find_ifc_levels(building)
        if not floors or any(abs(each.floor_z - floor) <= OFF_FLOOR_M for floor in floors)
    ]
    if not found:
        names = ", ".join(list(dict.fromkeys(storey.name for storey in building.storeys))[:8])
        storeys = f"none of its storeys ({names}) has" if names else "there is no IfcBuildingStorey, and no floor has"
        detail = f"{path.name}: {storeys} enough walls of 1.8 m on it; {_walls_found(building)}"
        raise Rejection("source", Reason.NO_LEVEL, detail, _advice(building))
    shift = shift_to_origin(np.concatenate([level.walls.vertices for level in found]))
    digest = sha256_of(path)
    name = options.get("file", path.name)
    for number, level in enumerate(found):
        provenance = {
            "source": "ifc",
            "file": name,
            "sha256": digest,
            "schema": building.schema,
            "storey": level.name,
            "units": "m" if factor == 1.0 else f"the file's, times {factor:g}",
            "up": "z",
        }
        guesses = level.guesses if factor == 1.0 or units is not None else (*level.guesses, "units")
        made = _in_own_frame(
            replace(level, guesses=guesses), shift, level_id(item.id, number, len(found)), number, provenance
        )
        yield replace(made, unit_m=unit_m)


def _on_floors(building: Building, floors: Sequence[float]) -> Building:
    """Return the building with storeys at these heights only, metres; each part is in the highest one under it.

    What a person says of the floors counts for all buildings of the file.
    """
    only = next(iter(building.buildings)) if len(building.buildings) == 1 else None
    storeys = [Storey(k, f"at {height:.2f} m", height, only, is_said=True) for k, height in enumerate(floors)]

    def stands(part: ElementBody) -> ElementBody:
        foot = part.top if part.kind == "IfcSlab" else part.bottom
        under = [each for each in storeys if each.elevation_m <= foot + KNEE_M]
        return replace(part, storey=(under[-1] if under else storeys[0]).key)

    groups = {each.name: getattr(building, each.name) for each in fields(building)}
    parts = {
        name: tuple(map(stands, group))
        for name, group in groups.items()
        if isinstance(group, tuple) and group and isinstance(group[0], ElementBody)
    }
    changed: dict[str, Any] = {**parts, "storeys": tuple(storeys)}
    return replace(building, **changed)


def _walls_found(building: Building) -> str:
    """Say which walls there are, for the message on a building without levels."""
    if not building.walls:
        return "it has no wall with a body" + (f", but {len(building.spaces)} spaces" if building.spaces else "")
    highest = max(part.top - part.bottom for part in building.walls)
    low, high = min(part.bottom for part in building.walls), max(part.top for part in building.walls)
    walls = f"its {len(building.walls):,} walls stand" if len(building.walls) > 1 else "its only wall stands"
    return f"{walls} between the heights {low:.2f} and {high:.2f} m" + (
        f", and the highest is {highest:.2f} m high" if len(building.walls) > 1 else ""
    )


def _advice(building: Building) -> str:
    if building.walls:
        return "check the file's unit and the heights of its walls in a viewer, and export it again"
    return "export the walls too, or the building as a mesh"


def _in_own_frame(found: IfcLevelParts, shift: Shift, name: str, number: int, provenance: dict[str, str]) -> Level:
    """Move a level into its own frame: near the origin, the floor at z = 0."""
    x, y = shift[:2]

    def move(part: ElementBody) -> SourceObject:
        return SourceObject((*part.words, part.kind), Mesh(part.mesh.vertices - (x, y, found.floor_z), part.mesh.faces))

    return Level(
        id=name,
        walls=Mesh(found.walls.vertices - (x, y, found.floor_z), found.walls.faces),
        ceiling_m=found.ceiling_m,
        frame=Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", found.floor_z, number),
        floor=found.floor and translate(found.floor, -x, -y),
        below=found.below and translate(found.below, -x, -y),
        stairs=found.stairs and translate(found.stairs, -x, -y),
        cover=found.cover and translate(found.cover, -x, -y),
        outdoors=found.outdoors and translate(found.outdoors, -x, -y),
        leaves=tuple(move(leaf) for leaf in found.leaves),
        furniture=tuple(move(thing) for thing in found.furniture),
        rooms=tuple(
            SourceRoom(room.words, room.labels, room.polygon and translate(room.polygon, -x, -y))
            for room in found.rooms
        ),
        room_count=len(found.rooms) or None,
        named_openings=found.named_openings,
        only_walls=True,
        guesses=found.guesses,
        windows=tuple(
            Opening.window(translate(each.polygon, -x, -y), (each.sill_m, each.head_m), each.across)
            for each in found.windows
        ),
        openings=tuple(Opening.named(translate(each.polygon, -x, -y), each.has_door) for each in found.openings),
        n_objects=len(found.furniture),
        provenance=provenance,
    )


# Correct the unit of an IFC file whose walls would be higher than any building, or lower than a hand.
#
# Some exporters declare metres and write millimetres, or the other way round.
#
# U1  The file's unit stands while half of its walls (proxies, where it has none) are between a hand's breadth and
#     ``HIGHEST_BUILDING_M`` high, and half of its doors, if it names any, reach higher than a knee.
# U2  Else millimetres, centimetres or inches were meant, or metres where the file says these: what makes the walls as
#     high as storeys, and the doors as high as doors. Where none does, the file's unit stands.


FACTORS: Final = (0.001, 0.01, 0.0254, 10.0, 100.0, 1000.0)


def find_unit_factor(building: Building) -> float:
    """Return by how much the lengths of a building are to be multiplied, 1.0 where its unit stands (U1, U2)."""
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
