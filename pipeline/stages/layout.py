"""Close the openings of the door plane so that walls enclose spaces, as Algorithm 1 assumes, or reject the level.

What may close says ``stages.closings``, and which of it parts spaces ``stages.separation``; which of the spaces are
rooms, and what of them is floor, says ``stages.habitable``.

R1  Where the source names no walls, a room that is most of what it draws may be a whole storey under the name of one
    (an artist's mesh, whose floor is called "Room"): the layout is found without it, and stands if it takes
    ``LARGELY`` of it. Otherwise that room closes at its edge, and parts at mouths (``stages.separation``, R5).
R2  Where a scan ends and nothing stands (``Evidence.open_edge``), the house is closed as by its walls, and what closes
    it there is the edge of its floor.
R3  Walls that spell characters are no layout: strokes that stand apart from each other without a door in any of them,
    and that enclose little of what they span. Characters have no floor of their own and no furniture; each takes a
    small part of what all of them span, has its place to itself, and encloses no more than ``GROUP`` spaces. What the
    source itself calls walls is no character.
R4  Where all that leaves no room, and walls surround one place nearly all round, what they leave open is its front.
    Else an open house (on posts, with two walls) is closed along the edge of its floor, or of its roof where it has no
    floor (``stages.closings.bands_around_open_house``). It is doubtful (``quality_grounds``, R17).
R5  What encloses less than ``area_m2`` after all this is no layout.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from pipeline.config import LayoutConfig
from pipeline.geometry.areas import (
    enclosed_pieces,
    intersect,
    polygons_of,
    unite,
)
from pipeline.geometry.openings import assign_sides, close_plane
from pipeline.geometry.prisms import Prisms
from pipeline.rejection import Reason, Rejection
from pipeline.stages.closings import bands_around_open_house, bands_at_open_fronts, boundaries, find_closing_candidates
from pipeline.stages.habitable import clip_rooms_to_floor, filled_spaces, keep_habitable_spaces, part_under_cover
from pipeline.stages.separation import Division, part_spaces
from pipeline.tolerances import (
    AROUND_M,
    GROUP,
    LARGELY,
    MOST,
    MOSTLY,
    SOME,
)
from pipeline.values import Evidence, Layout, Level, Opening, Planes


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
        found = part_spaces(level, planes, whole_plane, config, standing=standing, storey=storey)
        rooms, ground = found.spaces, found.ground
        candidates = assign_sides(found.openings + fixed, rooms, ground)
        filled = filled_spaces(rooms, candidates, evidence, level)  # what hangs over their edges is no way outside
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
    """Say what of the size was guessed, for the advice on a mesh without rooms: another size may give some."""
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
    """Return whether the source draws a floor under most of what the walls span, or of what they enclose (a wing)."""
    if level.floor is None or planes.door.is_empty:
        return False
    if level.floor.area > MOST * shapely.convex_hull(planes.door).area:
        return True
    enclosed = unite(rooms)
    return bool(intersect(enclosed, level.floor).area > MOST * enclosed.area)


def _reject_characters(planes: Planes, rooms: list[Polygon]) -> None:
    """R3."""
    strokes = [p for p in polygons_of(planes.door) if p.length > 2 * AROUND_M]
    if len(strokes) < GROUP or planes.doorways or not (planes.lintels.is_empty and planes.sills.is_empty):
        return
    if len(rooms) > GROUP * len(strokes):  # no character has so many counters: these are the wings of a building
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
