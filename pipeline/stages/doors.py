"""Decide whether each strip between rooms is a door, an opening, an entrance or no passage; return rooms and passages.

R1  A strip of L between two rooms is a passage if a robot may fit (``narrowest_m``); a narrower strip stays wall.
R2  A passage is a ``door`` where a door is known, under a lintel, over a sill or with a leaf beside it, and an
    ``opening`` in a gap of full height, also beside a leaf where the source names its doors. Where it names its
    openings (IFC), a lintel over none of these is a beam. But if it is no wider than a door and its wall goes on in
    line at both ends (a hole), it is an ``opening``.
R3  Under a beam, under a lintel wider than ``widest_m`` (posts within ``post_m`` do not divide it), and under a lintel
    wider than ``jambless_m`` that ends in the air (the trim of a stairwell), two rooms meet without a door: each gets
    half of the strip. A door that the source names stays a door, and an opening that is drawn, or named by its
    threshold, an ``opening``, however wide. A single gap of full height between walls is an ``opening``, however wide.
R4  A strip between a room and the outside is an ``entrance``; it stays closed. A railing or a boundary is not an
    entrance. In an upper storey, a strip without a known door that leads from a floor into the air is not an entrance
    but a window that reaches the floor.
R5  The windows of a storey hang from one height. A lintel to the outside without a leaf is a window that reaches the
    floor if three windows and such lintels, itself included, hang at its height, if doors inside hang from another
    height, and if there is another way out. A bay between a row of posts, and an opening onto a floor (a terrace), is
    not a window.
R6  Between two rooms, a straight gap closed only by a guess (ends of walls, edge of floor) is an ``opening``, however
    wide: nothing stands there. In a house of several rooms, the open end of a corridor, broad enough for a person and
    no wider than a door, is an ``entrance``, except where a scan ends, where the source names its openings, at a void
    within the house, and where it leads into the air (R4).
R7  Known doors side by side without a post between them are the leaves of one door, if that is no wider than a door.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import DoorKind
from pipeline.config import DoorsConfig
from pipeline.geometry.areas import (
    OUTSIDE,
    Shapes,
    drop_thin_parts,
    fill_enclosed,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.groups import Groups
from pipeline.geometry.mesh_slicing import MeshSlicer
from pipeline.geometry.meshes import boxes_around_polygons
from pipeline.geometry.openings import (
    ENDS,
    GAPS,
    KNOWN,
    Opening,
    assign_sides,
    distance_in_row,
    hull_of_row,
    strips_before,
    strips_of,
)
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.scan_columns import is_scan
from pipeline.tolerances import (
    BESIDE_M,
    CM_M,
    HAND_M,
    HEAD_M,
    LAP_M,
    LARGELY,
    MOST,
    NEARLY_ALL,
    SHOULDERS_M,
    SLIVER_M,
    STAND_M,
    UNNAMED_WAY_M,
)
from pipeline.values import Layout, Level, Planes, Spaces

PASSABLE = KNOWN | GAPS | {"lintel", "sill"}


def find_doors(level: Level, planes: Planes, layout: Layout, config: DoorsConfig) -> Spaces:
    """Return the rooms of a layout and the passages between them."""
    rooms = list(layout.rooms)
    leaves = shapely.STRtree(planes.leaves)
    passages: list[Opening] = []
    open_pairs: set[tuple[int, int]] = set()
    strips = [c for c in layout.candidates if c.is_strip and c.closed_by in PASSABLE]
    spans, bays = _rows(strips, config.post_m)
    at_named = _lie_at_named_ways(strips, planes, with_holes=isinstance(level.walls, Prisms) or level.unnamed_gaps)
    for strip, span, count, is_at_named in zip(strips, spans, bays, at_named, strict=True):
        if strip.sides[0] == strip.sides[1]:  # a space that it parted off was not a room
            continue
        kind = _kind(strip, level, planes, leaves)
        bare = strip.closed_by == "lintel" and strip.width > config.jambless_m and not strip.ends_at_walls(planes.door)
        wide = span > config.widest_m and not (strip.closed_by in KNOWN and is_at_named)
        is_gap = strip.closed_by in GAPS and count == 1 and strip.width >= config.narrowest_m
        if not strip.leads_outside and not is_gap and (wide or kind is None or bare):  # R3
            rooms[strip.sides[0]], rooms[strip.sides[1]] = _share_strip(strip, rooms)
            open_pairs.add((min(strip.sides), max(strip.sides)))
        elif strip.leads_outside and strip.closed_by not in KNOWN and _leads_into_the_air(strip, rooms, level):  # R4
            continue
        elif strip.width >= config.narrowest_m:  # R1
            passages.append(replace(strip, kind="entrance" if strip.leads_outside else kind or "opening"))
    tall = _windows_to_the_floor(passages, level, planes, leaves, config.post_m)  # R5
    passages = _with_all_leaves([passage for k, passage in enumerate(passages) if k not in tall], config.widest_m)
    if not level.sills:  # all passages of SUNCG have sills
        passages += _openings_at_guessed_edges(level, layout, config)
    given = {c.closed_by for c in layout.candidates} & (ENDS | {"room_edge"})
    notes: dict[str, int | str] = {"boundary": min(given)} if given else {}
    return Spaces(layout.ground, tuple(rooms), tuple(passages), tuple(sorted(open_pairs)), notes=notes)


def _lie_at_named_ways(openings: Sequence[Opening], planes: Planes, *, with_holes: bool) -> list[bool]:
    """Return for each opening (n,) whether the source names a doorway there, with a door unless ``with_holes`` (R3)."""
    ways = [each for each in planes.doorways if each.said_by == "named" and (with_holes or each.has_door)]
    named = shapely.STRtree([each.polygon for each in ways])
    found = np.zeros(len(openings), np.bool_)
    found[named.query(strips_of(openings), predicate="intersects")[0]] = True
    return found.tolist()


def _leads_into_the_air(opening: Opening, rooms: list[Polygon], level: Level) -> bool:
    """Return whether neither a floor nor a stair's void lies before an opening of an upper storey (R4)."""
    if level.sills or level.below is None or level.floor is None:
        return False
    inner = opening.sides[0] if opening.sides[1] == OUTSIDE else opening.sides[1]
    if intersect(rooms[inner], level.floor).area < MOST * rooms[inner].area:
        return False
    (before,) = _places_before([opening])
    return bool(intersect(before, unite([level.floor, level.below])).is_empty)


def _places_before(openings: Sequence[Opening]) -> Shapes:
    """Return the floor (n,) right outside each of some openings to the outside."""
    sides = [1 if opening.sides[1] == OUTSIDE else -1 for opening in openings]
    return strips_before(openings, sides, SHOULDERS_M, off_m=HAND_M)


def _with_all_leaves(passages: list[Opening], widest_m: float) -> list[Opening]:
    """Return the passages, with the leaves of a door joined to one passage (R7)."""
    found: list[Opening] = []
    for passage in passages:
        for k, other in enumerate(found):
            if not (passage.has_door and other.has_door):
                continue
            apart = distance_in_row(other, passage)
            if apart is not None and apart <= STAND_M:
                whole = hull_of_row(other, passage)
                if whole.width <= widest_m:
                    found[k] = whole
                    break
        else:
            found.append(passage)
    return found


def _openings_at_guessed_edges(level: Level, layout: Layout, config: DoorsConfig) -> list[Opening]:
    """Return the openings and entrances where only a guess closes a gap (R6)."""
    bands = [c for c in layout.candidates if c.closed_by in ENDS and not c.is_strip and c.polygon.area > 0]
    boxes = boxes_around_polygons([c.polygon for c in bands]) if bands else []
    straight = [
        Opening.in_box(box, (OUTSIDE, OUTSIDE), "opening", band.closed_by)
        for band, box in zip(bands, boxes, strict=True)
        if band.polygon.area > NEARLY_ALL * box.width * box.thickness and box.width >= config.narrowest_m
    ]
    placed = assign_sides(straight, list(layout.rooms), layout.ground)
    parting = [c for c in placed if c.sides[0] != c.sides[1]]
    found = [c for c in parting if not c.leads_outside]
    outer = [c for c in parting if c.leads_outside and SHOULDERS_M <= c.width <= config.widest_m]
    if not outer or len(layout.rooms) < 2 or level.named_openings or _is_scanned(level):
        return found
    house = fill_enclosed(layout.ground)
    walls = shapely.buffer(layout.ground, BESIDE_M, quad_segs=2)
    before = shapely.intersects(house, shapely.centroid(_places_before(outer)))
    rooms = list(layout.rooms)
    return found + [
        replace(way, kind="entrance")
        for way, is_inside in zip(outer, before, strict=True)
        if not is_inside and _ends_corridor(way, walls) and not _leads_into_the_air(way, rooms, level)
    ]


def _ends_corridor(opening: Opening, walls: BaseGeometry) -> bool:
    """Return whether walls go on into the house from both ends of an opening, for as far as it is wide (R6)."""
    inward = opening.width * (opening.across if opening.sides[0] == OUTSIDE else -opening.across)
    sides = shapely.linestrings([[end, end + inward] for end in opening.segment])
    return bool((shapely.length(shapely.intersection(sides, walls)) > LARGELY * opening.width).all())


def _is_scanned(level: Level) -> bool:
    return not isinstance(level.walls, Prisms) and (level.walls.is_cloud or is_scan(level.walls))


def _windows_to_the_floor(
    passages: list[Opening], level: Level, planes: Planes, leaves: shapely.STRtree, post_m: float
) -> set[int]:
    """Return the indices of the passages that are windows (R5)."""
    outer = [k for k, each in enumerate(passages) if each.leads_outside and each.width >= SHOULDERS_M]
    lintels = [k for k, each in enumerate(passages) if each.leads_outside and each.closed_by == "lintel"]
    inside = [k for k, each in enumerate(passages) if not each.leads_outside]
    if level.sills or level.walls.is_cloud or not lintels or not inside or len(outer) < 2:
        return set()
    windows = polygons_of(drop_thin_parts(subtract(planes.door, planes.tall), SLIVER_M))
    middles = shapely.get_coordinates(shapely.point_on_surface(windows)) if windows else np.empty((0, 2))
    places = np.concatenate([[each.centre for each in passages], middles])
    heads = MeshSlicer(level.walls).caps.lowest_over(places, HEAD_M)
    of_doors, of_others = heads[inside], np.delete(heads, inside)
    if not np.isfinite(of_doors).any():
        return set()
    openings = [passages[k] for k in lintels]
    on_floor = shapely.intersects(_places_before(openings), unite([] if level.floor is None else [level.floor]))
    beside_leaf = set(leaves.query(strips_of(openings), predicate="dwithin", distance=BESIDE_M)[0].tolist())
    _, bays = _rows(passages, post_m)
    measured = {k for k in lintels if np.isfinite(heads[k])}
    found = set()
    for i, k in enumerate(lintels):
        if k not in measured or bays[k] >= 3 or on_floor[i] or i in beside_leaf:
            continue
        as_windows = np.count_nonzero(np.abs(of_others - heads[k]) <= CM_M) >= 3
        if as_windows and not (np.abs(of_doors - heads[k]) <= CM_M).any():
            found.add(k)
    return found if any(k not in found and (k in measured or k not in lintels) for k in outer) else set()


def _rows(openings: list[Opening], post_m: float) -> tuple[list[float], list[int]]:
    """Return for each opening the width of the row in which it stands, with the posts, and how many stand in it."""
    near, between = list[tuple[float, int, int]](), dict[frozenset[int], list[int]]()
    for k, opening in enumerate(openings):
        between.setdefault(frozenset(opening.sides), []).append(k)
    for i, j in (pair for group in between.values() for pair in combinations(group, 2)):
        apart = distance_in_row(openings[i], openings[j])
        if apart is not None and apart <= post_m:
            near.append((max(apart, 0.0), i, j))
    span, count = [opening.width for opening in openings], [1] * len(openings)
    rows = Groups(len(openings))
    posts = [(apart, i) for apart, i, j in sorted(near) if rows.join(i, j)]  # of all pairs, the neighbours
    for row in rows.lists():
        wide = sum(apart for apart, i in posts if i in row) + sum(openings[k].width for k in row)
        for k in row:
            span[k], count[k] = wide, len(row)
    return span, count


def _kind(strip: Opening, level: Level, planes: Planes, leaves: shapely.STRtree) -> DoorKind | None:
    """Return the kind of a passage (R2), or None if the source names its openings and has none here."""
    if strip.closed_by in KNOWN:
        return "door" if strip.has_door else "opening"
    if strip.closed_by in GAPS:
        if level.names_doors:  # a leaf beside it is that of the next door
            return "opening"
        beside = leaves.query(strip.strip(), predicate="dwithin", distance=BESIDE_M)
        return "door" if len(beside) else "opening"
    if level.named_openings:
        return "opening" if strip.width <= UNNAMED_WAY_M and strip.has_two_jambs(planes.door) else None
    return "door"


def _share_strip(opening: Opening, rooms: list[Polygon]) -> tuple[Polygon, Polygon]:
    """Return the two rooms beside a wide opening, each with its half of the strip (R3).

    A candidate laps over its strip, so that the rooms begin behind that; the halves go on into them.
    """
    half = replace(opening, depth=opening.depth / 2 + 2 * LAP_M)
    aside = opening.across * (opening.depth / 4 + LAP_M)
    near = replace(half, centre=opening.centre - aside).strip()
    far = replace(half, centre=opening.centre + aside).strip()
    first = polygons_of(unite([rooms[opening.sides[0]], near]))[0]
    second = polygons_of(subtract(unite([rooms[opening.sides[1]], far]), first))
    if not second:  # a sliver that the half of the other covers
        return rooms[opening.sides[0]], rooms[opening.sides[1]]
    return first, second[0]
