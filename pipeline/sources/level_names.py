"""What a mesh file names, given to the levels it stands on: leaves, furniture, rooms, openings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon

from pipeline.sources.named_scene import NamedBody, NamedScene
from pipeline.sources.room_names import labels_for
from pipeline.values import Mesh, SourceObject, SourceOpening, SourceRoom

BELOW_M = 0.3  # what begins this far under a floor stands on it
OPENING_FOOT_M = 0.4
OPENING_HEIGHT_M = 1.7
SMALLEST_ROOM_M2 = 0.5
SAME = 0.9  # of two rooms' common area


@dataclass(frozen=True, eq=False)
class LevelNames:
    """One level's share, in the level frame; ``room_count`` is None if the source has no spaces."""

    leaves: tuple[SourceObject, ...] = ()
    furniture: tuple[SourceObject, ...] = ()
    rooms: tuple[SourceRoom, ...] = ()
    room_count: int | None = None
    openings: tuple[SourceOpening, ...] = ()


def share_out(named: NamedScene, floors_z: Sequence[float]) -> list[LevelNames]:
    """Give each level what stands between its floor and the next one's."""
    ends = [-np.inf, *(z - BELOW_M for z in floors_z[1:]), np.inf]
    return [_share(named, z, low, high) for z, (low, high) in zip(floors_z, pairwise(ends), strict=True)]


def _share(named: NamedScene, z: float, low: float, high: float) -> LevelNames:
    def here(mesh: Mesh) -> bool:
        middle = (mesh.vertices[:, 2].min() + mesh.vertices[:, 2].max()) / 2
        return bool(low <= middle < high)

    leaves = tuple(_lowered(each, z) for each in named.leaves if here(each.mesh))
    spaces = [room for body in named.spaces if here(body.mesh) for room in _rooms(body)]
    floors = [room for body in named.floors if body.words and here(body.mesh) for room in _rooms(body)]
    return LevelNames(
        leaves,
        tuple(_lowered(each, z) for each in named.furniture if here(each.mesh)),
        tuple(_distinct(spaces or floors)),
        len(_distinct(spaces)) or None,
        tuple(_opening(mesh, leaves) for mesh in named.openings if here(mesh) and _is_walked(mesh, z)),
    )


def _lowered(thing: SourceObject, z: float) -> SourceObject:
    return SourceObject(thing.words, Mesh(thing.mesh.vertices - (0.0, 0.0, z), thing.mesh.faces))


def _rooms(body: NamedBody) -> list[SourceRoom]:
    """Rooms of a body, one for each part of its plan."""
    corners = body.mesh.vertices[body.mesh.faces][:, :, :2]
    triangles = shapely.polygons(corners)
    area = shapely.union_all(triangles[shapely.area(triangles) > 1e-8], grid_size=0.001)
    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and part.area >= SMALLEST_ROOM_M2]
    return [SourceRoom(body.words, labels_for(body.words), part) for part in parts]


def _distinct(rooms: list[SourceRoom]) -> list[SourceRoom]:
    """Rooms without those that cover an earlier one: a floor may have an upper and an under side of its own."""
    kept: list[SourceRoom] = []
    for room in rooms:
        if not any(_share_of_both(room.polygon, other.polygon) > SAME for other in kept):
            kept.append(room)
    return kept


def _share_of_both(one: Polygon | None, other: Polygon | None) -> float:
    if one is None or other is None or not one.intersects(other):
        return 0.0
    shared = float(one.intersection(other).area)
    return shared / float(one.area + other.area - shared)


def _is_walked(mesh: Mesh, z: float) -> bool:
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    return bool(low - z <= OPENING_FOOT_M and high - low >= OPENING_HEIGHT_M)


def _opening(mesh: Mesh, leaves: Sequence[SourceObject]) -> SourceOpening:
    hull = _hull(mesh)
    return SourceOpening(hull, any(hull.intersects(_hull(leaf.mesh)) for leaf in leaves))


def _hull(mesh: Mesh) -> Polygon:
    """Plan hull, given a millimetre of width where the mesh is a sheet."""
    return shapely.multipoints(mesh.vertices[:, :2]).convex_hull.buffer(0.001, join_style="mitre")
