"""Which candidates are doors, and the rooms that they part."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.inference.necks import Neck
from houseexpo.inference.rays import Floats
from houseexpo.inference.tiling import faces_between

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

SMALLEST_M2: Final = 0.8
OPEN_ALONE: Final = 0.65
OPEN_ROW: Final = 0.6

_OVER_M: Final = 0.02  # lines go on into the walls, past what straightening took off
_APART_M: Final = 0.02
_BESIDE_M: Final = 0.03
_COMMON_M: Final = 1.2
_IN_LINE_M: Final = 0.3
_SPECK_M2: Final = 0.01
_JAGS_M2: Final = 0.02


@dataclass(frozen=True, eq=False)
class Doorway:
    """A door: its neck, its freed area, and the two rooms (indices) before the neck's fronts."""

    neck: Neck
    polygon: Polygon
    rooms: tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Link:
    """A neck among the faces: its own face, and the one before each front."""

    neck: Neck
    face: int
    sides: tuple[int, int]


def divide(space: Polygon | MultiPolygon, candidates: list[Neck]) -> tuple[list[Polygon], list[Doorway]]:
    """Rooms and doors that tile a free space (metres); ``candidates`` come the likeliest first.

    R1  Of candidates that meet, the likeliest counts.
    R2  A door joins two rooms: one that leaves its room in one piece is none.
    R3  Passages that together open 0.6 of the wall between two rooms are no doors; nor is a wide one alone that opens
        0.65 of it, unless a wall ends on either side.
    R4  A room has 0.8 m2 at least; a smaller space belongs to what lies behind its least likely door.
    """
    chosen = _non_overlapping(candidates)
    while True:
        faces = _faces(space, chosen)
        links = _links(faces, chosen)
        if len(links) == len(chosen):
            break
        chosen = [link.neck for link in links]  # the others part nothing
    links, rooms = _settled(faces, links)
    room_of = {face: k for k, room in enumerate(rooms) for face in room}
    doors = [Doorway(k.neck, faces[k.face], (room_of[k.sides[0]], room_of[k.sides[1]])) for k in links]
    return [_whole(faces[room]) for room in rooms], doors


def _non_overlapping(candidates: list[Neck]) -> list[Neck]:
    """R1."""
    import shapely

    if not candidates:
        return []
    hulls = shapely.convex_hull(shapely.multipoints([neck.fronts.reshape(4, 2) for neck in candidates]))
    one, other = shapely.STRtree(hulls).query(hulls, predicate="dwithin", distance=_APART_M)
    later = other[one < other], one[one < other]
    taken = np.ones(len(candidates), dtype=bool)
    for worse, better in sorted(zip(*(k.tolist() for k in later), strict=True)):
        taken[worse] &= not taken[better]
    return [candidates[k] for k in np.flatnonzero(taken)]


def _faces(space: Polygon | MultiPolygon, necks: list[Neck]) -> npt.NDArray[np.object_]:
    """The free space, parted along all fronts of the necks."""
    import shapely

    fronts = np.array([neck.fronts for neck in necks]).reshape(-1, 2, 2)
    on = fronts[:, 1] - fronts[:, 0]
    on *= _OVER_M / np.hypot(*on.T)[:, None]
    lines = shapely.linestrings(fronts + np.stack([-on, on], axis=1))
    faces = faces_between([space.boundary, *lines])
    shapely.prepare(space)
    inside = shapely.contains(space, shapely.point_on_surface(faces)) & (shapely.area(faces) > _SPECK_M2)
    return np.asarray(faces[inside])


def _links(faces: npt.NDArray[np.object_], necks: list[Neck]) -> list[_Link]:
    """The necks that have a face of their own between two others."""
    import shapely

    if not necks:
        return []
    looks = np.stack([_looks(neck) for neck in necks])
    place = np.full(looks.shape[:2], -1)
    point, face = shapely.STRtree(faces).query(shapely.points(looks).ravel(), predicate="within")
    place.flat[point] = face
    found = []
    own: set[int] = set()
    fills = _fills(faces[place[:, 0]], necks)
    for neck, (middle, one, other), fits in zip(necks, place.tolist(), fills.tolist(), strict=True):
        if fits and min(middle, one, other) >= 0 and middle not in (one, other) and middle not in own:
            found.append(_Link(neck, middle, (one, other)))
            own.add(middle)
    return [link for link in found if own.isdisjoint(link.sides)]


def _fills(faces: npt.NDArray[np.object_], necks: list[Neck]) -> npt.NDArray[np.bool_]:
    """Whether each face is about as large as its neck: something else may run through it."""
    import shapely

    area = shapely.area(shapely.convex_hull(shapely.multipoints([neck.fronts.reshape(4, 2) for neck in necks])))
    found = shapely.area(faces)
    return np.asarray((found > 0.5 * area - _JAGS_M2) & (found < 2.0 * area + _JAGS_M2))


def _looks(neck: Neck) -> Floats:
    """The middle of a neck and a point before each of its fronts, (3, 2)."""
    return np.vstack([neck.middle[None], neck.fronts.mean(axis=1) - _BESIDE_M * neck.into])


def _settled(faces: npt.NDArray[np.object_], links: list[_Link]) -> tuple[list[_Link], list[list[int]]]:
    """R2 to R4 until nothing changes; links come the likeliest first. Also the faces of each room."""
    import shapely

    area = shapely.area(faces)
    kept = list(links)
    while True:
        rooms = _rooms(len(faces), links, kept)
        room_of = {face: k for k, room in enumerate(rooms) for face in room}
        sides = [(room_of[link.sides[0]], room_of[link.sides[1]]) for link in kept]
        drop = {k for k, (one, other) in enumerate(sides) if one == other} or _open(kept, sides)
        if not drop:
            size = [float(area[room].sum()) for room in rooms]
            beside_small = [k for k, pair in enumerate(sides) if min(size[room] for room in pair) < SMALLEST_M2]
            drop = set(beside_small[-1:])  # R4
        if not drop:
            return kept, rooms
        kept = [link for k, link in enumerate(kept) if k not in drop]


def _rooms(faces: int, links: list[_Link], kept: list[_Link]) -> list[list[int]]:
    """The faces of each room: what no door parts, with the faces of candidates that are no doors."""
    import networkx as nx

    doors = {link.face for link in kept}
    joined = nx.Graph()
    joined.add_nodes_from(face for face in range(faces) if face not in doors)
    joined.add_edges_from((link.face, side) for link in links if link.face not in doors for side in link.sides)
    return [sorted(room) for room in nx.connected_components(joined)]


def _open(links: list[_Link], sides: list[tuple[int, int]]) -> set[int]:
    """R3."""
    wide: set[int] = set()
    for row in _in_rows([link.neck for link in links], sides):
        necks = [links[k].neck for k in row]
        width = sum(neck.width for neck in necks)
        share = width / min(neck.room for neck in necks)
        alone = len(necks) == 1
        most = OPEN_ALONE if alone else OPEN_ROW
        if width > _COMMON_M and share > most and not (alone and necks[0].whole == 2):
            wide.update(row)
    return wide


def _in_rows(necks: list[Neck], sides: list[tuple[int, int]]) -> list[list[int]]:
    """Necks (indices) between the same two rooms that stand side by side in one wall."""
    import networkx as nx

    rows = nx.Graph()
    rows.add_nodes_from(range(len(necks)))
    for i, k in combinations(range(len(necks)), 2):
        if set(sides[i]) == set(sides[k]):
            to = necks[k].middle - necks[i].middle
            aside = abs(float(to @ necks[i].into[0]))
            if aside <= _IN_LINE_M and float(np.hypot(*to)) <= (necks[i].room + necks[k].room) / 2:
                rows.add_edge(i, k)
    return [sorted(row) for row in nx.connected_components(rows)]


def _whole(faces: npt.NDArray[np.object_]) -> Polygon:
    """Faces that share edges as one polygon."""
    import shapely

    return faces[0] if len(faces) == 1 else shapely.union_all(faces)
