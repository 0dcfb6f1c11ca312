"""Take the layout of a drawing as it is drawn, where its walls and openings close each of its rooms by itself.

Such a storey leaves nothing to weigh: what stands and what hangs is said, the rooms have outlines, and the openings are
holes in the walls. Then the stages ``evidence``, ``planes`` and ``layout`` would find what is drawn, after a search for
everything else. Any other storey goes through them.

R1  Each body of the walls stands from the floor to the ceiling, or lies in an opening, under or over its hole; no wall
    stands in an opening. So it is in a storey of ``sources.drawn_storeys``.
R2  Each space that the walls and openings together enclose has one room: each is the larger part of the other. What of
    the rooms is left lies in walls and openings (the floor of a doorway). Where a room lies open, or a space has two
    rooms, something has to be searched for. Cracks between walls are closed where that is so without.
R3  An opening is a strip from jamb to jamb, each face of which looks into one space, or outside, all along. Openings
    that meet are not drawn apart.
R4  A space that has the outline of its drawn room is that room: it does not begin where openings lap over their walls.
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
    intersect_pairs,
    locate_points,
    unite,
)
from pipeline.geometry.meshes import boxes_around_polygons, footprint
from pipeline.geometry.openings import Opening, strips_of, turn_left
from pipeline.geometry.prisms import Prisms, WallsWithOpenings
from pipeline.geometry.wall_sections import close_cracks
from pipeline.tolerances import CRACK_M, FOOT_M, LAP_M, MOST, TWICE
from pipeline.values import Evidence, Layout, Level, Planes


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
    found = _close(level, walls, openings, grown) or _close(level, close_cracks(walls), openings, grown)
    if found is None or shapely.area(found.rooms).sum() < config.area_m2:
        return None
    furniture = unite([footprint(each.mesh) for each in level.furniture]) if level.furniture else EMPTY
    doorways, door = level.openings, found.door
    return DrawnLayout(
        Evidence(door, door, EMPTY, EMPTY, furniture, doorways, floor=level.floor),
        Planes(door, EMPTY, EMPTY, EMPTY, door, {}, doorways),
        found,
    )


def _close(level: Level, walls: BaseGeometry, openings: Shapes, grown: Shapes) -> Layout | None:
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
    """Return the bodies that stand from floor to ceiling, or none if others lie outside the openings (R1)."""
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
    """Return whether a wall stands in one of the openings (R1), or two of them meet (R3)."""
    one, other = shapely.STRtree(openings).query(openings, predicate="intersects")
    shapely.prepare(walls)
    return bool((one != other).any() or shapely.intersects(walls, openings).any())


def _are_rooms(level: Level, spaces: list[Polygon], ground: BaseGeometry) -> bool:
    """Return whether each of the spaces is a drawn room (R2). Spaces give way to the rooms that they are (R4)."""
    places = np.array(spaces, np.object_)
    rooms = np.array([room.polygon for room in level.rooms if room.polygon is not None], np.object_)
    space, room = shapely.STRtree(rooms).query(places, predicate="intersects")
    edges, outlines = shapely.boundary(places)[space], shapely.boundary(rooms)[room]
    most = shapely.hausdorff_distance(edges, outlines) < TWICE * LAP_M  # R4
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
    """Return the strip of each opening (R3), or None if one of them is none.

    One walks through an opening across its longer side, or along it through a wall that is deeper than the way is wide.
    """
    boxes = boxes_around_polygons(list(openings))
    centre, along = np.array([box.centre for box in boxes]), np.array([box.along for box in boxes])
    sizes = np.array([(box.width, box.thickness) for box in boxes])
    ways = np.stack([along, turn_left(along)], axis=1)  # along the wall, if it is drawn along the longer side, or not
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
