"""Read a RoomPlan capture of a home by a phone (JSON or USDZ): yield its levels with rooms, openings and furniture.

A USDZ file in which RoomPlan's walls are missing is read as a mesh.

Frame: y is up and right-handed in the file, so that x = X and y = -Z show the home from above as it is; z = Y.

R1  Walls are what lies between and around the floors (``around``), and the surfaces called walls that stand on these.
    Where no floor was found, what the surfaces enclose is one; where they enclose nothing, they are the walls.
R2  A door is a door, and an opening has no door. What two rooms share is one. Both go through all wall there.
R3  A floor is a room. Sections name it; where a floor holds several, they name the rooms that walls make of it.
R4  What stands STOREYS_APART_M over the walls' lowest feet is a level of its own.
R5  Where no surface was seen along a floor's edge, farther than BESIDE_M from all others, the room is open there.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
import shapely.ops
from shapely import Polygon

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.geometry.areas import buffer_mitred, drop_thin_parts, enclosed_pieces, polygons_of
from pipeline.geometry.prisms import make_prisms
from pipeline.geometry.wall_sections import close_cracks
from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.drawn_storeys import (
    Hole,
    Wall,
    deepen_to_wall_faces,
    group_storey_heights,
    merge_parallel_holes,
    passage_openings,
    unite_rooms,
    wall_mesh,
    walls_around_floors,
)
from pipeline.sources.files import check_file, input_from_file, level_id
from pipeline.sources.roles import labels_for
from pipeline.sources.roomplan_scan import Floor, LabelledSection, Scan, UprightBox, parse_scan
from pipeline.sources.tolerances import (
    DRAWN_SHEET_M,
    FILE_GRID_M,
    LARGEST_BYTES,
    NARROWEST_DOOR_M,
    ROOMPLAN_WALL_M,
    STOREYS_APART_M,
    TINY,
)
from pipeline.tolerances import BESIDE_M, HAND_M, STUB_M
from pipeline.values import Input, Level, Opening, SourceObject, SourceRoom

UNKNOWN = frozenset({"", "unidentified", "other"})


def find(path: str, **options: str) -> Iterator[Input]:
    """List one scan."""
    yield input_from_file(path, "roomplan", options)


def read(item: Input) -> Iterator[Level]:
    """Yield the scan's levels, lowest first; raise Rejection if it cannot be read or holds no wall.

    Raises
    ------
    MissingDependencyError
        For a USDZ file where usd-core is not installed.
    """
    path = Path(item.path)
    name = dict(item.options).get("file", path.name)
    scan = _scan(path)
    if not scan.walls and path.suffix.lower() == ".usdz":  # a model of somebody who scanned nothing
        yield from mesh_file.read(replace(item, reader="mesh_file", options=(("file", name),)))
        return
    if not scan.walls:
        raise Rejection("source", Reason.EMPTY, f"{name}: expected walls, found none", "scan the room again")
    provenance = {"source": "roomplan", "file": name, "sha256": sha256_of(path)}
    heights = _heights(scan)
    for number, height in enumerate(heights):
        above = heights[number + 1] if number + 1 < len(heights) else np.inf
        made = _level(_part(scan, height - STOREYS_APART_M / 2, above - STOREYS_APART_M / 2), height, provenance)
        yield replace(made, id=level_id(item.id, number, len(heights)), frame=replace(made.frame, level=number))


def _scan(path: Path) -> Scan:
    check_file(path)
    with path.open("rb") as stream:
        packed = stream.read(2) == b"PK"
    if packed:
        from pipeline.sources.roomplan_scan import load_usdz

        return load_usdz(path)
    if path.stat().st_size > LARGEST_BYTES:
        detail = f"{path.name} has {path.stat().st_size >> 20} MB"
        raise Rejection("source", Reason.TOO_LARGE, detail, "expected the JSON of one scan")
    return parse_scan(path.read_bytes(), path.name)


def _heights(scan: Scan) -> list[float]:
    """Return the floors' heights, lowest first."""
    feet = [wall.low_m for wall in scan.walls if wall.high_m - wall.low_m > 1.0]
    return group_storey_heights(feet or [wall.low_m for wall in scan.walls])


def _part(scan: Scan, low: float, high: float) -> Scan:
    """Return what begins between two heights."""

    def here(things: Sequence[UprightBox]) -> tuple[UprightBox, ...]:
        return tuple(thing for thing in things if low <= thing.low_m < high)

    return Scan(
        here(scan.walls),
        here(scan.doors),
        here(scan.openings),
        tuple(thing for thing in scan.objects if low <= thing.low_m < high),
        tuple(floor for floor in scan.floors if low <= floor.height_m < high),
        tuple(section for section in scan.sections if low <= section.height_m < high),
        here(scan.windows),
    )


def _level(scan: Scan, height: float, provenance: dict[str, str]) -> Level:
    """Return a level, still without its own id and number."""
    top = float(np.median([wall.high_m for wall in scan.walls])) - height
    walls = _walls(scan, [floor.shape for floor in scan.floors] or _enclosed_spaces(scan.walls), top)
    found = [Hole(d.shape, d.low_m - height, d.high_m - height, has_door=True) for d in scan.doors]
    found += [Hole(o.shape, o.low_m - height, o.high_m - height) for o in scan.openings]
    found += [Hole(side, 0.0, top) for side in _open_sides(scan)]
    holes = [
        hole for each in merge_parallel_holes(found) if (hole := deepen_to_wall_faces(each, walls)) is not None
    ]  # R2
    rooms = _rooms(scan.floors, scan.sections)
    return Level(
        id="",
        walls=wall_mesh(walls, holes),
        ceiling_m=top,
        frame=Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "y", height, 0),
        floor=unite_rooms(floor.shape for floor in scan.floors),
        furniture=tuple(_object(thing, height) for thing in scan.objects),
        named_openings=True,
        only_walls=True,
        rooms=rooms,
        room_count=len(rooms) or None,
        openings=passage_openings(holes),
        windows=tuple(Opening.window(w.shape, (w.low_m - height, w.high_m - height)) for w in scan.windows),
        n_objects=len(scan.objects),
        provenance=provenance,
    )


def _walls(scan: Scan, floors: Sequence[Polygon], top: float) -> list[Wall]:
    """Return what lies between and around the floors, and the surfaces called walls that stand on these."""
    strips = shapely.union_all([_strip(wall.shape, ROOMPLAN_WALL_M, 0.0) for wall in scan.walls], grid_size=FILE_GRID_M)
    if not floors:
        return [Wall(part, 0.0, top) for part in polygons_of(strips)]
    # walls that reach farther into a scan's floor stand inside it
    inner = shapely.intersection(strips, buffer_mitred(close_cracks(shapely.union_all(floors)), -HAND_M))
    reached = shapely.union_all([buffer_mitred(part, HAND_M) for part in polygons_of(inner)])
    free_standing = polygons_of(shapely.intersection(reached, strips))
    return [*walls_around_floors(floors, top), *(Wall(part, 0.0, top) for part in free_standing)]


def _open_sides(scan: Scan) -> list[Polygon]:
    """Return strips along the stretches of the floors' edges where nothing was seen."""
    seen = shapely.union_all([thing.shape for thing in (*scan.walls, *scan.doors, *scan.openings)])
    near, found = shapely.buffer(seen, BESIDE_M), []  # a wall or room so near is beside it
    floor = close_cracks(shapely.union_all([each.shape for each in scan.floors], grid_size=FILE_GRID_M))
    for ring in shapely.get_parts(shapely.boundary(floor)):
        corners = shapely.get_coordinates(shapely.simplify(ring, DRAWN_SHEET_M))
        for start, end in itertools.pairwise(corners):
            side = shapely.LineString([start, end])
            for open_ in shapely.get_parts(shapely.difference(side, near)):
                if open_.length >= NARROWEST_DOOR_M:
                    ends = np.sort(
                        shapely.line_locate_point(side, shapely.points(shapely.get_coordinates(open_)[[0, -1]]))
                    )
                    wide = shapely.ops.substring(side, max(0.0, ends[0] - BESIDE_M), ends[1] + BESIDE_M)
                    found.append(wide.buffer(DRAWN_SHEET_M / 2, cap_style="flat"))
    return found


def _enclosed_spaces(walls: Sequence[UprightBox]) -> list[Polygon]:
    """Return what surfaces close all round, except the inside of walls between two of them."""
    strips = shapely.union_all(
        # surfaces of a scan end so far from the corner that they make
        [_strip(wall.shape, DRAWN_SHEET_M, HAND_M) for wall in walls],
        grid_size=FILE_GRID_M,
    )
    areas = [buffer_mitred(area, DRAWN_SHEET_M / 2) for area in enclosed_pieces(strips)[1]]
    # a narrower space between the walls of a RoomPlan scan is no room
    return [area for area in areas if not drop_thin_parts(area, STUB_M).is_empty]


def _strip(shape: Polygon, thick_m: float, longer_m: float) -> Polygon:
    """A wall's surface as a strip about its middle."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shape))
    sides = np.hypot(*np.diff(corners[:3], axis=0).T)
    k = int(np.argmin(sides))
    ends = np.array([corners[k] + corners[k + 1], corners[(k + 2) % 4] + corners[(k + 3) % 4]]) / 2
    along = (ends[1] - ends[0]) / max(float(sides.max()), TINY) * longer_m
    line = shapely.LineString([ends[0] - along, ends[1] + along])
    strip: Polygon = line.buffer(max(float(sides[k]), thick_m) / 2, cap_style="flat")
    return strip


def _rooms(floors: Sequence[Floor], sections: Sequence[LabelledSection]) -> tuple[SourceRoom, ...]:
    """Return each floor as a room, named by the section in it; several name the rooms that walls make of it."""
    rooms, free = [], list(sections)
    for floor in floors:
        inside = [s for s in sections if shapely.intersects_xy(floor.shape, *s.at)]
        if len(inside) > 1:
            continue
        words = tuple(s.label for s in inside if s.label.lower() not in UNKNOWN)
        rooms.append(SourceRoom(words, labels_for(words), floor.shape))
        free = [s for s in free if s not in inside]
    for section in free:
        if section.label.lower() not in UNKNOWN:
            x, y = section.at
            box = (x - HAND_M, y - HAND_M, x + HAND_M, y + HAND_M)
            rooms.append(SourceRoom((section.label,), labels_for((section.label,)), box=box))
    return tuple(rooms)


def _object(thing: UprightBox, height: float) -> SourceObject:
    return SourceObject((thing.word,), make_prisms(thing.shape, thing.low_m - height, thing.high_m - height))
