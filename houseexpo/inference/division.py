"""Choose the doors among candidates (openings), and divide a free space into the rooms that these doors separate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from houseexpo.inference.openings import Floats, OpeningCandidate
from houseexpo.inference.snapping import enclosed_faces
from houseexpo.tolerances import (
    APART_M,
    BEFORE_DOOR_M,
    COMMON_OPENING_M,
    IN_LINE_M,
    JAGS_M2,
    OPEN_ALONE,
    OPEN_ROW,
    OVERLAP_M,
    ROUNDED_M2,
    SMALLEST_ROOM_M2,
)

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon


@dataclass(frozen=True, eq=False)
class FoundDoor:
    """A door: its opening, the area of its passage, and the indices of the two rooms in front of the opening."""

    opening: OpeningCandidate
    polygon: Polygon
    rooms: tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Link:
    """An opening among the faces: its own face, and the face in front of each front."""

    opening: OpeningCandidate
    face: int
    sides: tuple[int, int]


def divide_into_rooms(
    space: Polygon | MultiPolygon, candidates: list[OpeningCandidate]
) -> tuple[list[Polygon], list[FoundDoor]]:
    """Return rooms and doors that cover a free space (metres); ``candidates`` are sorted, the most likely first.

    R1  Of candidates that overlap, the most likely one counts.
    R2  A door connects two rooms; a candidate that does not split its room is not a door.
    R3  Passages that together open 0.6 of the wall between two rooms are not doors. Neither is a single passage that
        opens 0.65 of the wall, unless a wall ends on both of its sides.
    R4  A room has at least 0.8 m2. A smaller space is merged with the space behind its least likely door.
    """
    chosen = _non_overlapping(candidates)
    while True:
        faces = _faces(space, chosen)
        links = _links(faces, chosen)
        if len(links) == len(chosen):
            break
        chosen = [link.opening for link in links]  # the others separate nothing
    links, rooms = _drop_until_stable(faces, links)
    room_of = {face: k for k, room in enumerate(rooms) for face in room}
    doors = [FoundDoor(k.opening, faces[k.face], (room_of[k.sides[0]], room_of[k.sides[1]])) for k in links]
    return [_union_of_faces(faces[room]) for room in rooms], doors


def _non_overlapping(candidates: list[OpeningCandidate]) -> list[OpeningCandidate]:
    """Return the candidates without those that overlap a more likely one."""
    import shapely

    if not candidates:
        return []
    hulls = shapely.convex_hull(shapely.multipoints([opening.fronts.reshape(4, 2) for opening in candidates]))
    one, other = shapely.STRtree(hulls).query(hulls, predicate="dwithin", distance=APART_M)
    later = other[one < other], one[one < other]
    taken = np.ones(len(candidates), dtype=bool)
    for worse, better in sorted(zip(*(k.tolist() for k in later), strict=True)):
        taken[worse] &= not taken[better]
    return [candidates[k] for k in np.flatnonzero(taken)]


def _faces(space: Polygon | MultiPolygon, openings: list[OpeningCandidate]) -> npt.NDArray[np.object_]:
    """Return the faces of the free space when it is cut along all fronts of the openings."""
    import shapely

    fronts = np.array([opening.fronts for opening in openings]).reshape(-1, 2, 2)
    on = fronts[:, 1] - fronts[:, 0]
    on *= OVERLAP_M / np.hypot(*on.T)[:, None]
    lines = shapely.linestrings(fronts + np.stack([-on, on], axis=1))
    faces = enclosed_faces([space.boundary, *lines])
    shapely.prepare(space)
    inside = shapely.contains(space, shapely.point_on_surface(faces)) & (shapely.area(faces) > ROUNDED_M2)
    return np.asarray(faces[inside])


def _links(faces: npt.NDArray[np.object_], openings: list[OpeningCandidate]) -> list[_Link]:
    """Return the openings that have a face of their own between two other faces."""
    import shapely

    if not openings:
        return []
    looks = np.stack([_points_in_front(opening) for opening in openings])
    place = np.full(looks.shape[:2], -1)
    point, face = shapely.STRtree(faces).query(shapely.points(looks).ravel(), predicate="within")
    place.flat[point] = face
    found = []
    own: set[int] = set()
    fills = _faces_filled_by_openings(faces[place[:, 0]], openings)
    for opening, (middle, one, other), fits in zip(openings, place.tolist(), fills.tolist(), strict=True):
        if fits and min(middle, one, other) >= 0 and middle not in (one, other) and middle not in own:
            found.append(_Link(opening, middle, (one, other)))
            own.add(middle)
    return [link for link in found if own.isdisjoint(link.sides)]


def _faces_filled_by_openings(
    faces: npt.NDArray[np.object_], openings: list[OpeningCandidate]
) -> npt.NDArray[np.bool_]:
    """Return whether each face is about as large as its opening, that is, whether nothing else runs through it."""
    import shapely

    area = shapely.area(
        shapely.convex_hull(shapely.multipoints([opening.fronts.reshape(4, 2) for opening in openings]))
    )
    found = shapely.area(faces)
    return np.asarray((found > 0.5 * area - JAGS_M2) & (found < 2.0 * area + JAGS_M2))


def _points_in_front(opening: OpeningCandidate) -> Floats:
    """Return the middle of an opening and a point in front of each of its fronts, (3, 2)."""
    return np.vstack([opening.middle[None], opening.fronts.mean(axis=1) - BEFORE_DOOR_M * opening.into])


def _drop_until_stable(faces: npt.NDArray[np.object_], links: list[_Link]) -> tuple[list[_Link], list[list[int]]]:
    """Apply R2 to R4 until nothing changes; links are sorted, the most likely first. Also return each room's faces."""
    import shapely

    area = shapely.area(faces)
    kept = list(links)
    while True:
        rooms = _rooms(len(faces), links, kept)
        room_of = {face: k for k, room in enumerate(rooms) for face in room}
        sides = [(room_of[link.sides[0]], room_of[link.sides[1]]) for link in kept]
        drop = {k for k, (one, other) in enumerate(sides) if one == other} or _open_links(kept, sides)
        if not drop:
            size = [float(area[room].sum()) for room in rooms]
            beside_small = [k for k, pair in enumerate(sides) if min(size[room] for room in pair) < SMALLEST_ROOM_M2]
            drop = set(beside_small[-1:])  # R4
        if not drop:
            return kept, rooms
        kept = [link for k, link in enumerate(kept) if k not in drop]


def _rooms(faces: int, links: list[_Link], kept: list[_Link]) -> list[list[int]]:
    """Return the faces of each room: faces that no door separates, including faces of candidates that are no doors."""
    import networkx as nx

    doors = {link.face for link in kept}
    joined = nx.Graph()
    joined.add_nodes_from(face for face in range(faces) if face not in doors)
    joined.add_edges_from((link.face, side) for link in links if link.face not in doors for side in link.sides)
    return [sorted(room) for room in nx.connected_components(joined)]


def _open_links(links: list[_Link], sides: list[tuple[int, int]]) -> set[int]:
    """Return the links between rooms whose wall is mostly open, so that no passage there is a door."""
    wide: set[int] = set()
    for row in _in_rows([link.opening for link in links], sides):
        openings = [links[k].opening for k in row]
        width = sum(opening.width for opening in openings)
        share = width / min(opening.room for opening in openings)
        alone = len(openings) == 1
        most = OPEN_ALONE if alone else OPEN_ROW
        if width > COMMON_OPENING_M and share > most and not (alone and openings[0].whole == 2):
            wide.update(row)
    return wide


def _in_rows(openings: list[OpeningCandidate], sides: list[tuple[int, int]]) -> list[list[int]]:
    """Return the indices of openings between the same two rooms, grouped if they are side by side in one wall."""
    import networkx as nx

    rows = nx.Graph()
    rows.add_nodes_from(range(len(openings)))
    for i, k in combinations(range(len(openings)), 2):
        if set(sides[i]) == set(sides[k]):
            to = openings[k].middle - openings[i].middle
            aside = abs(float(to @ openings[i].into[0]))
            if aside <= IN_LINE_M and float(np.hypot(*to)) <= (openings[i].room + openings[k].room) / 2:
                rows.add_edge(i, k)
    return [sorted(row) for row in nx.connected_components(rows)]


def _union_of_faces(faces: npt.NDArray[np.object_]) -> Polygon:
    """Return faces that share edges as one polygon."""
    import shapely

    return faces[0] if len(faces) == 1 else shapely.union_all(faces)
