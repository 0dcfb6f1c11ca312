"""Turn final rooms, passages and furniture into a FloorPlan on the 1 cm grid, in which neighbours share vertices.

All boundaries of rooms and doors are noded together on the grid (snap rounding), so that neighbours share their
vertices; the faces between them are given back to the rooms and doors they came from.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from houseexpo.floorplan import FloorPlan
from houseexpo.inference.snapping import Points, snap_polygons, tile_on_grid
from houseexpo.inference.windows import place_windows
from houseexpo.plan import Box, Door, Frame, PlanObject, Room
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import GRID_M
from pipeline.geometry.areas import OUTSIDE, polygons_of, unite
from pipeline.geometry.openings import openings_as_arrays, turn_left
from pipeline.geometry.rooms_and_passages import polygons_between_rooms
from pipeline.tolerances import AROUND_M, HAND_M, STAND_M
from pipeline.values import FloorObstacle, Level, NamedRoom, Opening, Spaces


def vectorise(
    level: Level,
    spaces: Spaces,
    named: tuple[NamedRoom, ...],
    provenance: Mapping[str, Any],
    obstacles: tuple[FloorObstacle, ...] = (),
) -> FloorPlan:
    """Return the plan of docs/format.md; if the free space falls into parts on the grid, only the largest part."""
    tiles = _in_one_piece(spaces, named)
    outline = tiles.outline
    shift = HAND_M - np.array(outline.bounds[:2])
    (verts, holes), *rings = snap_polygons([outline, *tiles.rooms, *tiles.doors], shift)
    rooms = [_room(k, *shape, name) for k, (shape, name) in enumerate(zip(rings, tiles.named, strict=False))]
    doors = [
        _door(k, p, segment, ring, beside)
        for k, (p, segment, (ring, _), beside) in enumerate(
            zip(tiles.passages, _segments(tiles, shift), rings[len(rooms) :], _rooms_beside(tiles), strict=True)
        )
    ]
    objects = tuple(_objects(obstacles, tiles.rooms, shift))
    return FloorPlan(
        id=level.id,
        verts=verts,
        holes=holes,
        room_num=level.room_count if level.room_count is not None else len(rooms),
        room_category=_boxes(level, tiles.named, tiles.rooms, shift),
        rooms=tuple(rooms),
        doors=tuple(doors),
        objects=objects,
        windows=place_windows(_windows(level, shift), rooms, objects),
        frame=shifted_frame(level.frame, shift),
        provenance={**provenance, **_cuts(tiles.passages), **_closed_spaces(spaces.closed, shift)},
    )


def _cuts(passages: list[Opening]) -> dict[str, list[dict[str, int | str]]]:
    """Return for each cut, by the id of its door, the evidence for its place."""
    cuts: list[dict[str, int | str]] = [{"door": k, "why": p.why} for k, p in enumerate(passages) if p.kind == "cut"]
    return {"cuts": cuts} if cuts else {}


def _closed_spaces(spaces: tuple[Polygon, ...], shift: Points) -> dict[str, list[dict[str, Any]]]:
    """Return a place in each closed space that was left out, in the plan's axes, and its area."""
    places = [np.round(np.array(space.representative_point().coords[0]) + shift, 2).tolist() for space in spaces]
    told = [{"place": place, "area": round(space.area, 2)} for place, space in zip(places, spaces, strict=True)]
    return {"closed_spaces": told} if told else {}


@dataclass(frozen=True, eq=False)
class _Tiles:
    """Rooms and doors on the grid. ``outline`` is their union; entrances lie beside it."""

    outline: Polygon
    named: tuple[NamedRoom, ...]
    rooms: list[Polygon]
    passages: list[Opening]
    doors: list[Polygon]


def _in_one_piece(spaces: Spaces, named: tuple[NamedRoom, ...]) -> _Tiles:
    """Return rooms and doors on the grid; if they form several parts, those of the largest part.

    A room or a door that vanishes on the grid, narrower than a centimetre, is left out, and so are the ways into it.
    """
    strips = polygons_between_rooms(spaces.passages, spaces.rooms)
    inner = [p for p in spaces.passages if not p.leads_outside]
    openings = [strip for strip, p in zip(strips, spaces.passages, strict=True) if not p.leads_outside]
    room_shapes, door_shapes = tile_on_grid([r.polygon for r in named], openings)
    outline = polygons_of(unite([*room_shapes, *door_shapes]))[0]
    rooms, doors = _inside(outline, room_shapes), _inside(outline, door_shapes)
    passages, shapes = [inner[k] for k in doors], [door_shapes[k] for k in doors]
    for passage, strip in zip(spaces.passages, strips, strict=True):
        if passage.leads_outside and strip.distance(outline) < STAND_M:
            passages.append(passage)
            shapes.append(strip)
    tiles = _Tiles(outline, tuple(named[k] for k in rooms), [room_shapes[k] for k in rooms], passages, shapes)
    return _without_dead_ends(tiles) if any(shape.is_empty for shape in room_shapes) else tiles


def _without_dead_ends(tiles: _Tiles) -> _Tiles:
    """Leave out the doors that have one room on both sides, because that on the other side has vanished."""
    kept = [k for k, (one, other) in enumerate(_rooms_beside(tiles)) if one != other]
    return replace(tiles, passages=[tiles.passages[k] for k in kept], doors=[tiles.doors[k] for k in kept])


def _inside(outline: Polygon, shapes: list[Polygon]) -> list[int]:
    """Return the indices of the shapes that are part of the outline."""
    return np.flatnonzero(shapely.intersects(outline, shapely.point_on_surface(shapes))).tolist()


def _objects(obstacles: tuple[FloorObstacle, ...], rooms: list[Polygon], shift: Points) -> Iterator[PlanObject]:
    """Yield the furniture, each piece with the room in which it stands: the nearest one to its middle."""
    tree = shapely.STRtree(rooms)
    found = 0
    for obstacle in obstacles:
        shape = polygons_of(shapely.set_precision(obstacle.polygon, GRID_M))
        if not shape:
            continue
        filled = Polygon(shape[0].exterior)
        near = tree.query_nearest(filled.centroid, max_distance=AROUND_M)
        room = int(near[0]) if obstacle.in_room and len(near) else None
        yield PlanObject(found, obstacle.word, room, snap_polygons([filled], shift)[0][0], round(obstacle.height_m, 2))
        found += 1


def _room(k: int, ring: Points, holes: tuple[Points, ...], name: NamedRoom) -> Room:
    return Room(
        id=k,
        label=name.labels[0] if name.labels else UNLABELLED,
        ring=ring,
        holes=holes,
        source_labels=name.words,
        confidence=name.confidence,
    )


def _rooms_beside(tiles: _Tiles) -> list[tuple[int, int | None]]:
    """Return the rooms at the two faces of each passage; the outside comes last, as None."""
    centre, along, sizes = openings_as_arrays(tiles.passages)
    off = turn_left(along) * (sizes[:, 1:] + STAND_M)
    looks = np.stack([centre - off, centre + off], axis=1)
    nearest = shapely.STRtree(tiles.rooms).nearest(shapely.points(looks.reshape(-1, 2)))
    found: list[tuple[int, int | None]] = []
    for opening, (first, second) in zip(tiles.passages, nearest.reshape(-1, 2).tolist(), strict=True):
        if OUTSIDE in opening.sides:
            found.append((second if opening.sides[0] == OUTSIDE else first, None))
        else:
            found.append((first, second))
    return found


def _segments(tiles: _Tiles, shift: Points) -> list[list[list[float]]]:
    """Return for each passage its ends on the centre line of the wall, in the plan's axes."""
    centre, along, sizes = openings_as_arrays(tiles.passages)
    half = along * sizes[:, :1]
    return np.round(np.stack([centre - half, centre + half], axis=1) + shift, 2).tolist()  # type: ignore[no-any-return]


def _door(k: int, passage: Opening, segment: list[list[float]], ring: Points, rooms: tuple[int, int | None]) -> Door:
    (ax, ay), (bx, by) = segment
    return Door(
        id=k,
        kind=passage.kind,
        segment=((ax, ay), (bx, by)),
        width=round(math.hypot(bx - ax, by - ay), 2),
        ring=ring,
        rooms=rooms,
        confidence=passage.confidence,
    )


def _windows(level: Level, shift: Points) -> Iterator[Door]:
    """Yield the windows of the source as they are drawn, in the plan's axes, but those that end below their sill."""
    for window in level.windows:
        (ax, ay), (bx, by) = (window.segment + shift).tolist()
        sill = None if window.sill_m is None else max(round(window.sill_m, 2), 0.0)
        head = None if window.head_m is None else round(window.head_m, 2)
        ring = window.corners() + shift
        if (sill or 0.0) < (math.inf if head is None else head):
            yield Door(0, "window", ((ax, ay), (bx, by)), window.width, ring, (0, None), None, sill, head)


def _boxes(
    level: Level, named: tuple[NamedRoom, ...], shapes: list[Polygon], shift: Points
) -> dict[str, tuple[Box, ...]]:
    """Return boxes by label: the source's own if it has any, else those of the rooms; none without an extent."""
    boxes: dict[str, list[Box]] = {}
    own = [(label, room.box) for room in level.rooms if room.box is not None for label in room.labels]
    found = own or [(label, s.bounds) for name, s in zip(named, shapes, strict=True) for label in name.labels]
    for label, box in found:
        low, high = np.round(np.array(box[:2]) + shift, 2), np.round(np.array(box[2:]) + shift, 2)
        if (low < high).all():
            boxes.setdefault(label, []).append((float(low[0]), float(low[1]), float(high[0]), float(high[1])))
    return {label: tuple(sorted(found)) for label, found in sorted(boxes.items())}


def shifted_frame(frame: Frame, shift: Points) -> Frame:
    """Return the frame from plan metres to the source: first back by the shift, then by the level's matrix."""
    (a, b, tx), (c, d, ty) = frame.matrix
    x, y = -float(shift[0]), -float(shift[1])
    matrix = ((a, b, round(a * x + b * y + tx, 6)), (c, d, round(c * x + d * y + ty, 6)))
    return Frame(matrix, frame.up, frame.floor, frame.level)
