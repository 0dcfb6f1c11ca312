"""Rings on the 1 cm grid: valid, simple, tiled by rooms and doors (FORMAT.md section 2).

All boundaries of rooms and doors are noded together on the grid (snap rounding), so that neighbours share their
vertices; the faces between them are given back to the rooms and doors they came from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from houseexpo.categories import UNLABELLED
from houseexpo.plan import Box, Door, FloorPlan, Frame, Room
from houseexpo.tiling import GRID_M, Points, faces_between, rings_of
from pipeline.geometry.fitting import opening_polygon
from pipeline.geometry.overlay import polygons_of, united
from pipeline.rejection import Reason, Rejection
from pipeline.values import Level, NamedRoom, Passage, Spaces

MARGIN_M = 0.1
"""``min(verts)`` of every plan, as published."""


def vectorise(level: Level, spaces: Spaces, named: tuple[NamedRoom, ...], provenance: Mapping[str, Any]) -> FloorPlan:
    """The plan of FORMAT.md; raises Rejection where the free space is not in one piece."""
    inner = [p for p in spaces.passages if not p.leads_outside]
    openings = [opening_polygon(p.bridge, list(spaces.rooms)) for p in inner]
    room_shapes, door_shapes = _tiled([r.polygon for r in named], openings)
    outline = polygons_of(united([*room_shapes, *door_shapes]))
    if len(outline) != 1:
        raise Rejection(
            "vectorise",
            Reason.UNREACHABLE,
            f"the free space falls into {len(outline)} parts",
            "look at it with inspect",
        )
    shift = MARGIN_M - np.array(outline[0].bounds[:2])
    verts, holes = rings_of(outline[0], shift)
    rooms = [_room(k, shape, name, shift) for k, (shape, name) in enumerate(zip(room_shapes, named, strict=True))]
    doors = [
        _door(k, p, shape, _beside(p, room_shapes), shift)
        for k, (p, shape) in enumerate(zip(inner, door_shapes, strict=True))
    ]
    for p in spaces.passages:
        if p.leads_outside:
            strip = opening_polygon(p.bridge, list(spaces.rooms))
            doors.append(_door(len(doors), p, strip, _beside(p, room_shapes), shift))
    return FloorPlan(
        id=level.id,
        verts=verts,
        holes=holes,
        room_num=level.room_count if level.room_count is not None else len(rooms),
        room_category=_boxes(level, named, room_shapes, shift),
        rooms=tuple(rooms),
        doors=tuple(doors),
        frame=_frame(level.frame, shift),
        provenance=provenance,
    )


def _tiled(rooms: list[Polygon], doors: list[Polygon]) -> tuple[list[Polygon], list[Polygon]]:
    """Rooms and doors on the grid, with shared vertices."""
    shapes = [*doors, *rooms]
    faces = faces_between(shapely.boundary(shapes))
    inside = shapely.point_on_surface(faces)
    tree = shapely.STRtree(shapes)
    face, shape = tree.query(inside, predicate="within")
    owner = np.full(len(faces), -1)
    owner[face[::-1]] = shape[::-1]  # a door before a room, the first room before the next
    tiled = [_whole(faces[owner == k], shapes[k]) for k in range(len(shapes))]
    return tiled[len(doors) :], tiled[: len(doors)]


def _whole(faces: npt.NDArray[np.object_], shape: Polygon) -> Polygon:
    """The faces of one shape in one piece; a shape that the grid swallowed comes back as it rounds."""
    found = polygons_of(united(faces)) if len(faces) else polygons_of(shapely.set_precision(shape, GRID_M))
    return found[0] if found else shape


def _room(k: int, shape: Polygon, name: NamedRoom, shift: Points) -> Room:
    polygon, holes = rings_of(shape, shift)
    return Room(
        id=k,
        label=name.labels[0] if name.labels else UNLABELLED,
        polygon=polygon,
        holes=holes,
        source_labels=name.words,
    )


def _beside(passage: Passage, rooms: list[Polygon]) -> tuple[int, int | None]:
    """The rooms at the two faces of a passage; the outside comes last, as None."""
    b = passage.bridge
    tree = shapely.STRtree(rooms)
    found = []
    for side, sign in zip(b.sides, (-1.0, 1.0), strict=True):
        if side >= 0:
            look = b.centre + sign * b.across * (b.depth / 2 + 0.03)
            found.append(int(tree.nearest(shapely.points(look))))
    return (found[0], found[1]) if len(found) == 2 else (found[0], None)


def _door(k: int, passage: Passage, shape: Polygon, rooms: tuple[int, int | None], shift: Points) -> Door:
    a, b = np.round(passage.bridge.segment + shift, 2)
    return Door(
        id=k,
        kind=passage.kind,
        segment=((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))),
        width=round(float(np.hypot(*(b - a))), 2),
        polygon=rings_of(shape, shift)[0],
        rooms=rooms,
    )


def _boxes(
    level: Level, named: tuple[NamedRoom, ...], shapes: list[Polygon], shift: Points
) -> dict[str, tuple[Box, ...]]:
    """Boxes by label: the source's own where it has them, else those of the rooms."""
    boxes: dict[str, list[Box]] = {}
    own = [(label, room.box) for room in level.rooms if room.box is not None for label in room.labels]
    found = own or [(label, s.bounds) for name, s in zip(named, shapes, strict=True) for label in name.labels]
    for label, box in found:
        low, high = np.round(np.array(box[:2]) + shift, 2), np.round(np.array(box[2:]) + shift, 2)
        boxes.setdefault(label, []).append((float(low[0]), float(low[1]), float(high[0]), float(high[1])))
    return {label: tuple(sorted(found)) for label, found in sorted(boxes.items())}


def _frame(frame: Frame, shift: Points) -> Frame:
    """Plan metres to source: first back by the shift, then the level's own matrix."""
    (a, b, tx), (c, d, ty) = frame.matrix
    x, y = -float(shift[0]), -float(shift[1])
    matrix = ((a, b, round(a * x + b * y + tx, 6)), (c, d, round(c * x + d * y + ty, 6)))
    return Frame(matrix, frame.up, frame.floor, frame.level)
