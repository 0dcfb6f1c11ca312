"""Give rooms the labels and words of the source's rooms, and divide a space in which the source draws several rooms.

R1  A space that holds several of the source's room polygons (IfcSpace) is divided: each point goes to the polygon that
    holds it, or to the nearest. No wall stands between the parts, so there is no door, unless the source names a door
    between two parts, in a wall that ends in the space.
R2  A source room with a polygon names the room that it overlaps most.
R3  A source room with a box only (SUNCG: the box of the room and its objects) names the room that fits it best, each
    room at most once in the first round; those left over then name the room they lie in, so one room may carry several.
    A box beside a room names nothing, even if it lies between the arms of an L.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from pipeline.geometry.areas import Floats, intersect, polygons_of, shared_areas, subtract, unite
from pipeline.geometry.meshes import boxes_around_polygons
from pipeline.geometry.openings import Opening, strips_of
from pipeline.tolerances import BESIDE_M, MOST, PATCH_M2, SOME
from pipeline.values import Level, NamedRoom, SourceRoom, Spaces


def name_rooms(level: Level, spaces: Spaces) -> tuple[NamedRoom, ...]:
    """Return the rooms with labels and words, in the order of ``spaces.rooms``; parts of a divided room follow."""
    drawn = [r for r in level.rooms if r.polygon is not None]
    boxed = [r for r in level.rooms if r.polygon is None and r.box is not None]
    polygons = tuple(r.polygon for r in drawn if r.polygon is not None)
    shared = shared_areas(spaces.rooms, polygons)
    divided = [_divide_by_source(room, polygons, areas) for room, areas in zip(spaces.rooms, shared, strict=True)]
    rooms = tuple(part for parts in divided for part in parts)
    named = [NamedRoom(room) for room in rooms]
    for source, shares in zip(drawn, shared_areas(rooms, polygons).T, strict=True):  # R2
        best = int(np.argmax(shares))
        if shares[best] > SOME * shapely.area(source.polygon):
            named[best] = _with_name(named[best], source)
    for source, k in _by_box(boxed, list(rooms)):  # R3
        named[k] = _with_name(named[k], source)
    return tuple(named)


def with_doors_between_parts(spaces: Spaces, named: Sequence[NamedRoom], doorways: Sequence[Opening]) -> Spaces:
    """Return the spaces with a passage for each door that the source names between two parts of one space (R1).

    ``named`` are the rooms with the parts of divided spaces, ``doorways`` where doors are known to be.
    """
    if len(named) == len(spaces.rooms):  # nothing is divided
        return spaces
    parts = shapely.STRtree([room.polygon for room in named])
    used = shapely.union_all(strips_of(spaces.passages))
    rooms, passages = list(spaces.rooms), list(spaces.passages)
    shapes = [each.polygon for each in doorways if each.said_by == "named" and each.has_door]
    free = [shape for shape in shapes if not shape.intersects(used)]
    for shape, box in zip(free, boxes_around_polygons(free), strict=True):
        space = next((k for k, room in enumerate(rooms) if intersect(room, shape).area > MOST * shape.area), None)
        if space is None:
            continue
        opening = Opening.in_box(box, (space, space), "door", "door")
        out = opening.across * (opening.depth / 2 + BESIDE_M)
        before = parts.nearest(shapely.points(np.stack([opening.centre - out, opening.centre + out]))).tolist()
        rest = polygons_of(subtract(rooms[space], opening.strip()))
        if before[0] != before[1] and len(rest) == 1:
            rooms[space] = rest[0]
            passages.append(opening)
    return replace(spaces, rooms=tuple(rooms), passages=tuple(passages))


def _with_name(room: NamedRoom, source: SourceRoom) -> NamedRoom:
    labels = room.labels + tuple(label for label in source.labels if label not in room.labels)
    return replace(room, labels=labels, words=room.words + source.words)


def _divide_by_source(room: Polygon, drawn: Sequence[Polygon], shared: Floats) -> list[Polygon]:
    """Return the parts of a space by the source's rooms, or the space itself if the source does not divide it (R1).

    ``shared`` (n,) are the areas, m2, that the space shares with the ``drawn`` rooms (n,).
    """
    inside = [p for p, area in zip(drawn, shared.tolist(), strict=True) if area > max(PATCH_M2, SOME * p.area)]
    if len(inside) < 2:
        return [room]
    cores: list[Polygon] = []
    taken = unite([])
    for polygon in sorted(inside, key=lambda p: (p.area, p.bounds)):
        core = subtract(intersect(polygon, room), taken)
        if core.area > PATCH_M2:
            cores.append(polygons_of(core)[0])
            taken = unite([taken, cores[-1]])
    parts = [[core] for core in cores]
    for scrap in polygons_of(subtract(room, taken)):
        touching = [shapely.intersection(scrap.buffer(1e-6), core).area for core in cores]
        parts[int(np.argmax(touching))].append(scrap)
    grown = [polygons_of(shapely.buffer(unite(p).buffer(1e-6), -1e-6, join_style="mitre")) for p in parts]
    return [g[0] for g in grown if g] or [room]


def _by_box(boxed: list[SourceRoom], rooms: list[Polygon]) -> list[tuple[SourceRoom, int]]:
    if not boxed or not rooms:
        return []
    from scipy.optimize import linear_sum_assignment  # a tenth of a second, of drawings for nothing

    boxes = np.array([s.box for s in boxed])
    bounds = shapely.bounds(rooms)
    low = np.maximum(boxes[:, None, :2], bounds[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], bounds[None, :, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    other = np.prod(bounds[:, 2:] - bounds[:, :2], axis=1)
    fit = shared / np.maximum(area[:, None] + other[None, :] - shared, 1e-9)
    pairs = [(int(i), int(k)) for i, k in zip(*linear_sum_assignment(-fit), strict=True) if fit[i, k] > SOME]
    done = {i for i, _ in pairs}
    for i in range(len(boxed)):
        if i in done:
            continue
        meets = shapely.area(shapely.intersection(rooms, shapely.box(*boxes[i]))) > 0.0
        inside = np.where(meets & (shared[i] > 0.5 * np.minimum(area[i], other)), fit[i], 0.0)
        if inside.max() > 0:
            pairs.append((i, int(np.argmax(inside))))
    return [(boxed[i], k) for i, k in sorted(pairs)]
