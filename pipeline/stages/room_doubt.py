"""Estimate how doubtful it is that a layout's rooms are rooms of the house, not terraces, courts, voids or shafts.

A space is what walls and closing candidates enclose. ``stages.habitable`` decides by rules which of them are rooms.
The model ``space`` of ``weights.toml`` looks at the same things, each as a feature of 0 to 1, and gives the probability
that a space is a room. It is fitted on spaces of real houses that people have marked
(``python -m research.weights_fit``). Qualities and confidences rest on it.

F1  Floor: ``floorless``, the share of a space without one, where the source draws floors; ``over_void``, the share
    that lies over the floor of a lower level; ``low``, the share that a roof leaves too low to stand in.
F2  Sky: ``open_sky``, the share with nothing above it, where the other spaces lie under a ceiling or a roof;
    ``upper_sky``, the same where a level lies below; ``roofed``, the contrary of the first.
F3  Edge: the shares of a space's edge that are not wall or known door (``wallless``), that are no lintel either
    (``open_edge``), and that are railings (``railed``, ``railed_outside`` at the outside of the house), walls that end
    below the ceiling (``low_walls``), the edge of the floor slab (``slab_edge``), other guesses (``guessed_edge``),
    lintels and gaps wider than a door to the outside (``wide_outside``, ``very_wide_outside``) or to another space
    (``wide_inside``), and the outside of the house (``border``).
F4  Ways: ``shut``, if nothing leads into it (``shut_among_entered``: where something leads into the others;
    ``shut_and_tiny``); ``only_outside``, if nothing leads to another space; ``known_inside`` and ``known_outside``, if
    a door is known there.
F5  Shape: ``narrow``, ``tiny``; ``largest``, its share of all spaces from a half on; ``alone``.
F6  What stands in it: ``filled``, the share that furniture takes; ``seen_from_outside``, how far faces look away from
    it that elsewhere look into a space.
F7  Names: ``named``, the share that a room of the source covers; ``nameless``, if the source draws rooms, but not here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    Shapes,
    drop_thin_parts,
    fill_enclosed,
    intersect,
    shares_inside,
    subtract,
    unite,
)
from pipeline.geometry.mesh_slicing import lengths_of_faces
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.room_shapes import SMALLEST_ROOM_M2
from pipeline.stages.logistic import LogisticModel, load_models
from pipeline.tolerances import (
    CRACK_M,
    DOORWAY_M,
    HARDLY,
    HEAD_M,
    MM_M,
    MOST,
    PASSABLE_M,
    PATCH_M2,
    SHOULDERS_M,
    SINGLE_DOOR_M,
    SLIVER_M,
    SOME,
    SPECK,
    STUB_M,
    TINY_M2,
    WALL_M,
)
from pipeline.values import Evidence, Layout, Level

Floats = npt.NDArray[np.float64]
Features = dict[str, Floats]


def doubt_spaces(level: Level, evidence: Evidence, layout: Layout, space: LogisticModel | None = None) -> Floats:
    """Return for each of the ``spaces`` of a layout (n,) how doubtful it is that it is a room of the house, 0 to 1.

    The doubt is how far the space's probability lies below that of a space without special features, in two digits. It
    is 0 in drawings, and in sources that mark each door: a person has drawn the spaces as rooms. ``space`` is the
    model, by default that of ``weights.toml``.
    """
    if not is_doubted(level, layout):
        return np.zeros(len(layout.spaces))
    return (space or load_models()["space"]).doubt(space_features(level, evidence, layout))


def unlikely_rooms(level: Level, evidence: Evidence, layout: Layout, doubts: Floats) -> BaseGeometry:
    """Return the area of the spaces that are likely no rooms if nothing shows a way into them either.

    These are the spaces with a doubt above ``SOME`` (tiny ones: above ``HARDLY``), without those that a room of the
    source covers and those with a floor and furniture. In a drawing with doors and without rooms, they are the closed
    cells (``closed_cells``): somebody drew all doors that the plan should have.
    """
    if isinstance(level.walls, Prisms) and not level.sills and any(each.has_door for each in level.openings):
        return EMPTY if _draws_rooms(level) else _without_ways(evidence, layout)
    if not (doubts > HARDLY).any():
        return EMPTY
    spaces = list(layout.spaces)
    named = shares_inside(spaces, unite(room.polygon for room in level.rooms if room.polygon is not None)) > MOST
    lived_in = (shares_inside(spaces, evidence.floor) > MOST) & (shares_inside(spaces, evidence.furniture) > SPECK)
    enough = np.where(_tininess(shapely.area(spaces)) > 0, HARDLY, SOME)
    chosen = (doubts > enough) & ~named & ~lived_in
    return unite(space for space, is_unlikely in zip(spaces, chosen, strict=True) if is_unlikely)


def closed_cells(level: Level, evidence: Evidence, layout: Layout) -> BaseGeometry:
    """Return the area of the spaces that are no rooms if the storey shows no door, as nothing leads into them.

    A drawing with ways as gaps has all its ways. So where other spaces have ways between them, a space without a way, a
    window or furniture is a block of walls, unless such spaces take ``SOME`` of the storey. The area is empty if the
    source names its walls or its rooms, or if the evidence is a scan.
    """
    is_named = level.only_walls or _draws_rooms(level)
    if is_named or evidence.scanned or not is_doubted(level, layout):
        return EMPTY
    return _without_ways(evidence, layout)


def _draws_rooms(level: Level) -> bool:
    return any(room.polygon is not None for room in level.rooms)


def _without_ways(evidence: Evidence, layout: Layout) -> BaseGeometry:
    """Return the area of the closed cells among the spaces (``closed_cells``)."""
    if len(layout.spaces) < 2:
        return EMPTY
    spaces = np.array(layout.spaces, np.object_)
    ways = [c.sides for c in layout.ways if c.is_strip and c.width >= PASSABLE_M]
    ways = [sides for sides in ways if sides[0] != sides[1]]
    entered = {side for sides in ways for side in sides}
    windows = _band(drop_thin_parts(subtract(evidence.walls, evidence.tall), SLIVER_M))
    used = (shares_inside(spaces, evidence.furniture) > SPECK) | shapely.intersects(spaces, windows)
    closed = np.array([k not in entered for k in range(len(spaces))]) & ~used
    area = shapely.area(spaces)
    if not any(OUTSIDE not in sides for sides in ways) or area[closed].sum() > SOME * area.sum():
        return EMPTY
    return unite(spaces[closed])


def is_doubted(level: Level, layout: Layout) -> bool:
    """Return whether the spaces of a level are doubted at all."""
    return not (level.sills or isinstance(level.walls, Prisms) or not layout.spaces)


def of_rooms(layout: Layout, of_spaces: Floats, rooms: Sequence[Polygon]) -> Floats:
    """Return for each room of a plan (m,) the value in ``of_spaces`` (n,) of the space that holds it."""
    if not of_spaces.any() or not rooms:
        return np.zeros(len(rooms))
    places = [room.representative_point() for room in rooms]
    return np.asarray(of_spaces[shapely.STRtree(layout.spaces).nearest(places)])


def space_features(level: Level, evidence: Evidence, layout: Layout) -> Features:
    """Return the features by name, one value (n,) for each of the spaces (n) of a layout."""
    spaces = list(layout.spaces)
    area = shapely.area(spaces)
    share = area / area.sum()
    named = shares_inside(spaces, unite(room.polygon for room in level.rooms if room.polygon is not None))
    return {
        **_floor_and_sky(spaces, area, level, evidence),
        **_edges(spaces, evidence, layout),
        **_ways(spaces, area, layout),
        "narrow": _ramp(2 * SHOULDERS_M - _widths(spaces), STUB_M),
        "tiny": _tininess(area),
        "largest": _ramp(share - MOST, MOST) * (len(spaces) > 1),
        "alone": np.full(len(spaces), float(len(spaces) == 1)),
        "filled": shares_inside(spaces, evidence.furniture) * (not level.furniture),
        "seen_from_outside": _looked_away_from(spaces, evidence, layout, level),
        "named": named,
        "nameless": (1.0 - named) * float((named * share).sum() > MOST),
        "scanned": np.full(len(spaces), float(evidence.scanned)),
    }


def _floor_and_sky(spaces: list[Polygon], area: Floats, level: Level, evidence: Evidence) -> Features:
    """F1, F2."""
    floored = shares_inside(spaces, evidence.floor)
    knows_floor = (floored * area).sum() > MOST * area.sum()
    under = _under_cover(spaces, level)
    found = {
        "floorless": (1.0 - floored) * knows_floor,
        "over_void": shares_inside(spaces, level.below) * (1.0 - floored),
        "low": shares_inside(spaces, evidence.low_headroom),
    }
    if under is None:
        return found
    roofed = _of_others(under, area)
    found["open_sky"] = (1.0 - under) * roofed
    found["roofed"] = under * (roofed if len(spaces) > 1 else 1.0)
    found["upper_sky"] = (1.0 - under) * float(level.below is not None)
    return found


def _edges(spaces: list[Polygon], evidence: Evidence, layout: Layout) -> Features:
    """F3, but for wide openings."""

    def candidates(*kinds: str) -> list[BaseGeometry]:
        return [c.polygon for c in layout.ways if c.closed_by in kinds]

    rings = shapely.get_exterior_ring(np.array(spaces, np.object_))
    length = shapely.length(rings)
    rest = _outside_of(rings, layout.door)
    wallless = _outside_of(rest, unite(candidates("door", "opening")))
    open_edge = _outside_of(wallless, unite(candidates("lintel")))
    house = fill_enclosed(unite([layout.door, evidence.rails, *spaces]))
    rim = shapely.buffer(house.boundary, WALL_M, quad_segs=2)
    rails = _band(evidence.rails)
    return {
        "wallless": shapely.length(wallless) / length,
        "open_edge": shapely.length(open_edge) / length,
        "railed": _in_band(spaces, rails),
        "railed_outside": _in_band(spaces, intersect(rails, rim)),
        "low_walls": _in_band(spaces, _band(evidence.partial_height)),
        "slab_edge": _in_band(spaces, _band(unite(candidates("floor_edge")))),
        "guessed_edge": _in_band(spaces, _band(unite(candidates("wall_ends", "rail")))),
        "border": _in_band(spaces, rim),
    }


def _ways(spaces: list[Polygon], area: Floats, layout: Layout) -> Features:
    """F3 of wide openings, F4."""
    n, length = len(spaces), shapely.length(spaces)
    count, known, wide = (np.zeros((2, n)) for _ in range(3))  # inside, outside
    for c in layout.ways:
        if not c.is_strip or c.sides[0] == c.sides[1]:
            continue
        for side, other in (c.sides, c.sides[::-1]):
            if side != OUTSIDE:
                where = int(other == OUTSIDE)
                count[where, side] += 1
                known[where, side] += c.closed_by == "door"
                wide[where, side] += c.width * (c.closed_by != "door" and c.width > SINGLE_DOOR_M[1])
    shut = count.sum(axis=0) == 0
    return {
        "shut": shut.astype(float),
        "shut_among_entered": shut * _of_others(1.0 - shut, area),
        "shut_and_tiny": shut * _tininess(area),
        "only_outside": ((count[0] == 0) & ~shut).astype(float),
        "known_inside": np.minimum(known[0], 2.0) / 2,
        "known_outside": np.minimum(known[1], 1.0),
        "wide_inside": np.minimum(wide[0] / length, 1.0),
        "wide_outside": np.minimum(wide[1] / length, 1.0),
        "very_wide_outside": (wide[1] > DOORWAY_M[1]).astype(float),
    }


def _of_others(shares: Floats, area: Floats) -> Floats:
    """Return for each space (n,) the mean of the other spaces' shares, weighted by area."""
    rest = np.maximum(area.sum() - area, MM_M)
    return np.asarray(((shares * area).sum() - shares * area) / rest)


def _under_cover(spaces: list[Polygon], level: Level) -> Floats | None:
    """Return the share of each space (n,) under something above head height; None if the source has no faces (F2)."""
    points = [_places(space) for space in spaces]
    owner = np.repeat(np.arange(len(spaces)), [len(each) for each in points])
    count = np.maximum(np.bincount(owner, minlength=len(spaces)), 1)
    every = np.concatenate(points) if points else np.zeros((0, 2))
    if level.cover is not None:
        hit = shapely.contains_xy(level.cover, *every.T)
    else:
        if isinstance(level.walls, Prisms) or level.walls.is_cloud:
            return None
        corners = level.walls.vertices[level.walls.faces]
        corners = corners[corners[:, :, 2].max(axis=1) > HEAD_M]
        low, high = every.min(axis=0), every.max(axis=0)
        flat = corners[:, :, :2]
        near = (flat.min(axis=1) < high).all(axis=1) & (flat.max(axis=1) > low).all(axis=1)
        a, b, c = (flat[near][:, k] for k in range(3))
        double = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        corners = corners[near][double > 2 * TINY_M2]
        tree = shapely.STRtree(shapely.points(every))
        hit = np.zeros(len(every), np.bool_)
        if len(corners):
            face, place = tree.query(shapely.polygons(corners[:, :, :2]), predicate="intersects")
            hit[place[_height_at(corners[face], every[place]) > HEAD_M]] = True
    return np.bincount(owner, hit, minlength=len(spaces)) / count


def _height_at(triangles: Floats, points: Floats) -> Floats:
    """Return the heights (n,) at which triangles (n, 3, 3) lie over points (n, 2)."""
    a, b, c = (triangles[:, k] for k in range(3))
    v0, v1, v2 = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], points - a[:, :2]
    whole = v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0]
    s = (v2[:, 0] * v1[:, 1] - v2[:, 1] * v1[:, 0]) / whole
    t = (v0[:, 0] * v2[:, 1] - v0[:, 1] * v2[:, 0]) / whole
    return np.asarray(a[:, 2] + s * (b[:, 2] - a[:, 2]) + t * (c[:, 2] - a[:, 2]))


def _places(space: Polygon, looks: int = 8) -> Floats:
    """Return places (n, 2) in a space, so many along its longer side; its representative point if none lies in it."""
    x1, y1, x2, y2 = space.bounds
    step = max(x2 - x1, y2 - y1) / looks
    x, y = (np.arange(low + step / 2, high, step) for low, high in ((x1, x2), (y1, y2)))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid[shapely.contains_xy(space, *grid.T)]
    return grid if len(grid) else np.asarray(space.representative_point().coords)[:, :2]


def _looked_away_from(spaces: list[Polygon], evidence: Evidence, layout: Layout, level: Level) -> Floats:
    """Return the share of faces at each space's edge that look away, times the share of others' that look in (F6)."""
    height = evidence.heights.get("breast")
    if isinstance(level.walls, Prisms) or not isinstance(height, float) or len(spaces) < 2:
        return np.zeros(len(spaces))
    into, away = lengths_of_faces(level.walls, height, spaces, layout.door)
    total_in, total = into.sum() - into, (into + away).sum() - into - away
    usual = total_in / np.maximum(total, MM_M)
    return np.asarray(away / np.maximum(into + away, MM_M) * usual)


def _widths(spaces: list[Polygon]) -> Floats:
    """Return the diameters (n,) of the largest circles in the spaces, metres."""
    return 2.0 * np.asarray(shapely.length(shapely.maximum_inscribed_circle(np.array(spaces, np.object_), 0.05)))


def _outside_of(lines: Shapes, what: BaseGeometry) -> Shapes:
    """Return the parts of lines (n,) that do not run along the area ``what``."""
    return lines if what.is_empty else np.asarray(shapely.difference(lines, _band(what)))


def _band(what: BaseGeometry) -> BaseGeometry:
    """Return the band around the area ``what`` in which the edge of a space counts as running along it."""
    return EMPTY if what.is_empty else shapely.buffer(what, CRACK_M, quad_segs=2)


def _in_band(spaces: list[Polygon], band: BaseGeometry) -> Floats:
    """Return the share of each space's edge (n,) that lies in a band."""
    if band.is_empty:
        return np.zeros(len(spaces))
    rings = shapely.get_exterior_ring(np.array(spaces, np.object_))
    shapely.prepare(band)
    return np.asarray(shapely.length(shapely.intersection(rings, band)) / shapely.length(rings))


def _tininess(area: Floats) -> Floats:
    """Return 0 for areas (n,) twice as large as the smallest room, 1 for a patch."""
    enough = 2 * SMALLEST_ROOM_M2
    return _ramp(enough - area, enough - PATCH_M2)


def _ramp(more: Floats, whole: float) -> Floats:
    return np.clip(more / whole, 0.0, 1.0)
