"""Close the openings of the door plane so that walls enclose spaces, as Algorithm 1 assumes, or reject the level.

``stages.closings`` finds what may close, ``stages.separation`` chooses what parts spaces, and ``stages.habitable``
decides which spaces are rooms, and which part of them is floor.

R1  Where the source names no walls, a single room that is most of what it draws may be a whole storey (an artist's
    mesh, whose floor is called "Room"). The layout is first found without that room, and stands if its rooms fill
    ``LARGELY`` of it. Otherwise the room closes at its edge, and mouths part it (``stages.separation``, R5).
R2  Where a scan ends and nothing stands (``Evidence.open_edge``), the house is closed as by its walls, and what closes
    it there is the edge of its floor.
R3  Walls that spell characters are rejected: their strokes stand apart from each other, have no door, and enclose
    little of what they span. Characters have no floor of their own and no furniture. Each takes a small part of what
    all of them span, has its place to itself, and encloses no more than three spaces. What the source itself calls
    walls is never taken for characters.
R4  If R1 to R3 leave no room, and walls surround one place nearly all round, its open front is closed. Otherwise an
    open house (on posts, with two walls) is closed along the edge of its floor, or of its roof if it has no floor
    (``stages.closings.bands_around_open_house``). Such a plan is doubtful (``quality_grounds``, R17).
R5  A level whose rooms have less than ``area_m2`` in all after these steps is rejected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    EMPTY,
    WALL,
    Floats,
    Shapes,
    areas_inside,
    enclosed_pieces,
    intersect,
    intersect_pairs,
    locate_points,
    polygons_of,
    unite,
)
from pipeline.geometry.meshes import boxes_around_polygons, footprint
from pipeline.geometry.openings import Opening, assign_sides, close_plane, strips_of, turn_left
from pipeline.geometry.prisms import Prisms, WallsWithOpenings
from pipeline.geometry.wall_sections import close_cracks
from pipeline.rejection import Reason, Rejection
from pipeline.stages.closings import bands_around_open_house, bands_at_open_fronts, boundaries, find_closing_candidates
from pipeline.stages.habitable import clip_rooms_to_floor, filled_spaces, keep_habitable_spaces, part_under_cover
from pipeline.stages.separation import Division, part_spaces
from pipeline.tolerances import AROUND_M, CRACK_M, FOOT_M, LAP_M, LARGELY, MOST, MOSTLY, SOME
from pipeline.values import Evidence, Layout, Level, Planes


def close_openings(
    level: Level, evidence: Evidence, planes: Planes, config: LayoutConfig, *, all_closed: bool = False
) -> Layout:
    """Close the walls of the door plane; raise Rejection if nothing worth a plan is enclosed.

    With ``all_closed``, each space that walls close all round is a room, as in the paper.
    """
    storey = _storey_drawn_as_room(level)
    if storey is not None:  # R1
        others = tuple(room for room in level.rooms if room.polygon is not storey)
        try:
            found = _close(replace(level, rooms=others), evidence, planes, config, None, all_closed=all_closed)
        except Rejection:
            pass
        else:
            if intersect(storey, unite(found.rooms)).area > LARGELY * storey.area:
                return found
    return _close(level, evidence, planes, config, storey, all_closed=all_closed)


def _storey_drawn_as_room(level: Level) -> Polygon | None:
    """Return the room that is most of what a source draws that names no walls, or None (R1)."""
    rooms = [] if level.only_walls else [room.polygon for room in level.rooms if room.polygon is not None]
    largest = max(rooms, key=lambda room: room.area, default=None)
    return largest if largest is not None and largest.area > MOST * sum(room.area for room in rooms) else None


def _close(
    level: Level,
    evidence: Evidence,
    planes: Planes,
    config: LayoutConfig,
    storey: Polygon | None,
    *,
    all_closed: bool,
) -> Layout:
    """Return the layout; ``storey`` is the one room of the level that may be a whole storey (R1)."""
    walls, ends = planes.door, [Opening.closing(p, "floor_edge") for p in polygons_of(evidence.open_edge)]
    if ends:  # R2
        planes = replace(
            planes,
            door=unite([planes.door, evidence.open_edge]),
            tall=unite([planes.tall, evidence.open_edge]),
        )
    pieces = find_closing_candidates(level, planes, config)
    whole = enclosed_pieces(close_plane(planes.door, pieces))
    is_named = level.only_walls and "layers" not in level.guesses
    is_shown = is_named or _is_floored(level, planes, whole[1]) or level.n_objects > 0
    if config.characters and (level.sills or not is_shown):
        _reject_characters(planes, whole[1])

    def within(fixed: list[Opening]) -> Layout:
        """Return the layout in which all of ``fixed`` closes, whether or not it separates anything."""
        standing = close_plane(planes.door, fixed) if fixed else planes.door
        ground, spaces = enclosed_pieces(close_plane(standing, pieces)) if fixed else whole
        whole_plane = Division(pieces, ground, spaces)
        found = part_spaces(level, evidence, planes, whole_plane, config, standing=standing, storey=storey)
        rooms, ground = found.spaces, found.ground
        candidates = assign_sides(found.openings + fixed, rooms, ground)
        filled = filled_spaces(rooms, candidates, evidence, level)  # a lintel at the edge of one is no way outside
        candidates = [c for c in candidates if not c.is_strip or not filled.intersection(c.sides)] + ends
        kept = keep_habitable_spaces(rooms, candidates, planes, evidence, level, filled=filled, all_closed=all_closed)
        of_rooms = clip_rooms_to_floor(kept, level)
        sides = tuple(assign_sides(candidates, of_rooms, ground))
        return Layout(walls, ground, sides, tuple(of_rooms), tuple(rooms), tuple(candidates))

    found = max(map(within, boundaries(level, planes, pieces, whole, config)), key=_area)
    if not found.rooms and (fronts := bands_at_open_fronts(planes.tall, config.area_m2)):  # R4
        found = within(fronts)
    if not found.rooms and (open_edges := _edges_of_open_house(level, planes, config)):
        found = within(open_edges)
    area = _area(found)
    if area < config.area_m2:  # R5
        raise Rejection(
            "layout",
            Reason.NOT_ENCLOSED,
            f"the walls enclose {area:.2f} m², expected at least {config.area_m2:g} m²; "
            + _what_stands(planes, whole[1]),
            "walls must close at some height up to the ceiling, or the house needs a floor slab" + _guesses(level),
        )
    return found


def _edges_of_open_house(level: Level, planes: Planes, config: LayoutConfig) -> list[Opening]:
    """Return the bands that close an open house along its floor or its roof (R4)."""
    if level.sills or isinstance(level.walls, Prisms) or level.walls.is_cloud or planes.tall.is_empty:
        return []
    roof = part_under_cover(shapely.box(*planes.tall.bounds), level)
    floor = level.floor if level.floor is not None else roof
    return bands_around_open_house(floor, roof, planes.tall, config.area_m2)


def _guesses(level: Level) -> str:
    """Say which parts of the size were guessed, for the message on a mesh without rooms: another size may give some."""
    if level.provenance.get("source") != "mesh" or not level.guesses:
        return ""
    size = f"a unit of {level.provenance['units']}, {level.provenance['up']} up"
    return f"; {size} is a guess ({', '.join(level.guesses)}): if it is wrong, say --units, --scale or --up"


def _what_stands(planes: Planes, spaces: list[Polygon]) -> str:
    """Say which walls there are, and what they close, for the message on a house without rooms (R5)."""
    parts = polygons_of(planes.door)
    if not parts:
        return "nothing stands up to the height of doors"
    x1, y1, x2, y2 = shapely.total_bounds(parts)
    pieces = "one piece" if len(parts) == 1 else f"{len(parts)} pieces"
    found = f"walls stand in {pieces} on {x2 - x1:.1f} x {y2 - y1:.1f} m"
    if not spaces:
        return f"{found}, and close no place all round"
    return f"{found}; the largest of {len(spaces)} closed places has {spaces[0].area:.1f} m²"


def _area(layout: Layout) -> float:
    return float(sum(room.area for room in layout.rooms))


def _is_floored(level: Level, planes: Planes, rooms: list[Polygon]) -> bool:
    """Return whether the source draws a floor under most of the area that the walls span, or that they enclose."""
    if level.floor is None or planes.door.is_empty:
        return False
    if level.floor.area > MOST * shapely.convex_hull(planes.door).area:
        return True
    enclosed = unite(rooms)
    return bool(intersect(enclosed, level.floor).area > MOST * enclosed.area)


def _reject_characters(planes: Planes, rooms: list[Polygon]) -> None:
    """Raise Rejection if the walls spell characters: strokes apart from each other that enclose hardly anything."""
    strokes = [p for p in polygons_of(planes.door) if p.length > 2 * AROUND_M]
    # fewer than three strokes are no word
    if len(strokes) < 3 or planes.doorways or not (planes.lintels.is_empty and planes.sills.is_empty):
        return
    if len(rooms) > 3 * len(strokes):  # no character encloses so many spaces: these are wings of a building
        return
    spanned = shapely.convex_hull(unite(strokes)).area
    inside = sum(room.area for room in rooms)
    if inside < 0.5 * spanned and _are_side_by_side(strokes, spanned):
        raise Rejection(
            "layout",
            Reason.CHARACTERS,
            f"{len(strokes)} strokes of wall stand apart and enclose {inside:.1f} of {spanned:.1f} m², without a door",
            "if it is a house after all, keep it in overrides.toml",
        )


def _are_side_by_side(strokes: list[Polygon], spanned: float) -> bool:
    """Return whether each stroke is small compared with the whole, and all lie apart, as letters do (R3)."""
    hulls = shapely.convex_hull(np.array(strokes, dtype=np.object_))
    each = shapely.area(hulls)
    return bool(each.max() < SOME * spanned and unite(hulls).area > MOSTLY * each.sum())


# ---------------------------------------------------------------------------------------------------------------------
# The layout as it is drawn, where the walls and openings of a drawing close each of its rooms by themselves.
#
# Such a storey needs no search: the source says what stands and what hangs, the rooms have outlines, and the openings
# are holes in the walls. The stages ``evidence``, ``planes`` and ``layout`` would find just what is drawn. If one of
# D1 to D3 does not hold, the storey goes through these stages.
#
# D1  Each body of the walls stands from the floor to the ceiling, or lies in an opening, under or over its hole. No
#     wall stands in an opening. Storeys of ``sources.drawn_storeys`` are like this.
# D2  Each space that the walls and openings together enclose matches one drawn room: each is the larger part of the
#     other. The rest of the rooms lies in walls and openings (the floor of a doorway). If this fails, it is tried once
#     more with the cracks between walls closed.
# D3  An opening is a strip from jamb to jamb; each of its faces looks into one space, or outside, all along. Openings
#     do not meet.
# D4  A space with the outline of its drawn room gets the drawn outline: openings that lap over their walls would shift
#     its edge.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class DrawnLayout:
    """What the stages ``evidence``, ``planes`` and ``layout`` would find in a storey that is drawn whole."""

    evidence: Evidence
    planes: Planes
    layout: Layout


def read_drawn_layout(level: Level, config: LayoutConfig) -> DrawnLayout | None:
    """Return the layout of a storey that is drawn whole, or None if something in it has to be searched for."""
    if not (isinstance(level.walls, Prisms) and level.openings) or level.floor is None:
        return None
    if level.leaves:
        return None
    openings = np.array([each.polygon for each in level.openings], np.object_)
    grown = shapely.buffer(openings, LAP_M, join_style="mitre")
    standing = _standing_bodies(level, level.walls, grown)
    walls = unite(standing)
    if not standing or _are_shut_or_meet(openings, walls):
        return None
    found = _close_as_drawn(level, walls, openings, grown) or _close_as_drawn(
        level, close_cracks(walls), openings, grown
    )
    if found is None or shapely.area(found.rooms).sum() < config.area_m2:
        return None
    furniture = unite([footprint(each.mesh) for each in level.furniture]) if level.furniture else EMPTY
    doorways, door = level.openings, found.door
    return DrawnLayout(
        Evidence(door, door, EMPTY, EMPTY, furniture, doorways, floor=level.floor),
        Planes(door, EMPTY, EMPTY, EMPTY, door, {}, doorways),
        found,
    )


def _close_as_drawn(level: Level, walls: BaseGeometry, openings: Shapes, grown: Shapes) -> Layout | None:
    """Return the layout of walls and openings, or None if they are not all that closes the rooms."""
    ground, spaces = enclosed_pieces(unite([walls, *grown]))
    strips = _strips(openings, spaces, ground) if spaces else None
    if strips is None or not _are_rooms(level, spaces, ground):
        return None
    laps = strips_of(strips, deeper_m=LAP_M, wider_m=LAP_M)
    ways = tuple(
        replace(strip, polygon=lap, closed_by=each.closed_by, said_by=each.said_by)
        for each, lap, strip in zip(level.openings, laps, strips, strict=True)
    )
    return Layout(walls, ground, ways, tuple(spaces), tuple(spaces), ways)


def _standing_bodies(level: Level, walls: Prisms, openings: Shapes) -> list[BaseGeometry]:
    """Return the bodies that stand from floor to ceiling; nothing if other bodies lie outside the openings (D1)."""
    enough_m = level.ceiling_m - CRACK_M
    if isinstance(walls, WallsWithOpenings) and walls.openings == tuple(each.polygon for each in level.openings):
        return [walls.standing] if walls.top_m > enough_m and not walls.standing.is_empty else []
    whole = [body.bottom_m < FOOT_M and body.top_m > enough_m for body in walls.bodies]
    standing = [body.area for body, is_whole in zip(walls.bodies, whole, strict=True) if is_whole]
    rest = [body.area for body, is_whole in zip(walls.bodies, whole, strict=True) if not is_whole]
    pieces = shapely.get_parts(rest)
    covered = shapely.STRtree(openings).query(pieces, predicate="covered_by")[0]
    return standing if len(np.unique(covered)) == len(pieces) else []


def _are_shut_or_meet(openings: Shapes, walls: BaseGeometry) -> bool:
    """Return whether a wall stands in one of the openings (D1), or two of them meet (D3)."""
    one, other = shapely.STRtree(openings).query(openings, predicate="intersects")
    shapely.prepare(walls)
    return bool((one != other).any() or shapely.intersects(walls, openings).any())


def _are_rooms(level: Level, spaces: list[Polygon], ground: BaseGeometry) -> bool:
    """Return whether each of the spaces is a drawn room (D2). In ``spaces``, drawn rooms replace their spaces (D4)."""
    places = np.array(spaces, np.object_)
    rooms = np.array([room.polygon for room in level.rooms if room.polygon is not None], np.object_)
    space, room = shapely.STRtree(rooms).query(places, predicate="intersects")
    edges, outlines = shapely.boundary(places)[space], shapely.boundary(rooms)[room]
    most = shapely.hausdorff_distance(edges, outlines) < 2 * LAP_M  # D4
    for k, j in zip(space[most].tolist(), room[most].tolist(), strict=True):
        spaces[k] = rooms[j]
    differ = np.flatnonzero(~most)
    one, other = places[space[differ]], rooms[room[differ]]
    shared = shapely.area(intersect_pairs(one, other))
    most[differ] = (shared > MOST * shapely.area(one)) & (shared > MOST * shapely.area(other))
    is_drawn = np.bincount(space[most], minlength=len(spaces))
    if (is_drawn != 1).any() or len(np.unique(room[most])) < most.sum():
        return False
    rest = np.delete(rooms, room[most])
    return bool((areas_inside(rest, ground) > MOST * shapely.area(rest)).all())


def _strips(openings: Shapes, spaces: list[Polygon], ground: BaseGeometry) -> list[Opening] | None:
    """Return the strip of each opening (D3), or None if an opening is not a strip.

    The way leads across an opening's longer side, or along it where the wall is deeper than the way is wide.
    """
    boxes = boxes_around_polygons(list(openings))
    centre, along = np.array([box.centre for box in boxes]), np.array([box.along for box in boxes])
    sizes = np.array([(box.width, box.thickness) for box in boxes])
    ways = np.stack([along, turn_left(along)], axis=1)  # the wall runs along the longer side, or along the shorter one
    widths, depths = sizes, sizes[:, ::-1]
    looks = _before_faces(centre, ways, widths, depths)
    seen = locate_points(looks.reshape(-1, 2), spaces, ground).reshape(looks.shape[:-1])
    clear = ((seen == seen[..., :1]) & (seen != WALL)).all(axis=(2, 3))
    if not clear.any(axis=1).all():
        return None
    found = []
    for k, way in enumerate(np.where(clear[:, 0], 0, 1).tolist()):
        one, other = seen[k, way, :, 0].tolist()
        found.append(Opening(centre[k], ways[k, way], float(widths[k, way]), float(depths[k, way]), (one, other)))
    return found


def _before_faces(centre: Floats, ways: Floats, widths: Floats, depths: Floats) -> Floats:
    """Three places (n, 2, 2, 3, 2) before each of the two faces of strips that run one of two ways (n, 2, 2).

    They are the middle of a face, and a crack from its ends. ``centre``, ``widths`` and ``depths`` are (n, 2).
    """
    ends = widths / 2 - CRACK_M
    steps = np.stack([-ends, np.zeros_like(ends), ends], axis=2)
    places = centre[:, None, None] + ways[:, :, None] * steps[..., None]
    off = np.stack([-ways[..., 1], ways[..., 0]], axis=2) * (depths / 2 + CRACK_M)[..., None]
    return np.stack([places - off[:, :, None], places + off[:, :, None]], axis=2)
