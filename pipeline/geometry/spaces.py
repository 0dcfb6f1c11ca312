"""Hold a house as rooms and passages, fit passages to rooms, cut out floor voids, find where a robot can stand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import networkx as nx
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import erode
from houseexpo.plan import DoorKind
from pipeline.geometry.areas import (
    OUTSIDE,
    areas,
    buffer_mitred,
    differences,
    dot,
    drop_thinner,
    overlap,
    polygons_of,
    subtract,
    union_of,
)
from pipeline.geometry.portals import Portal, Vector, strips_of
from pipeline.geometry.walls import close_cracks
from pipeline.tolerances import (
    CM_M,
    CRACK_M,
    HARDLY,
    MM_M,
    MOST,
    PATCH_M2,
    SHOULDERS_M,
    STAND_M,
    STUB_M,
    THIN_WALL_M,
    TINY_M2,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# A house as rooms and the ways between them.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Passage:
    """A way through a wall; the ``sides`` of its portal are indices into the rooms of the same value, or OUTSIDE.

    ``closed_by`` is the kind of the closing candidate that stands in its place, "" for a cut, of which ``why`` says
    what speaks for its place. ``confidence`` is the probability that a passage is there, None if nobody has rated it.
    """

    portal: Portal
    kind: DoorKind
    why: str = ""
    closed_by: str = ""
    confidence: float | None = None

    @property
    def leads_outside(self) -> bool:
        """Whether one side is the outside; such a passage stays closed in the outline."""
        return OUTSIDE in self.portal.sides


@dataclass(frozen=True, eq=False)
class JoinedPair:
    """Two points (2, 2), metres, that a cut connected, and the radius of the disc that can go from one to the other."""

    points: npt.NDArray[np.float64]
    radius_m: float


@dataclass(frozen=True, eq=False)
class Spaces:
    """From stage ``doors`` on: a house as rooms and ways between them.

    ``walls`` is the closed plane. ``joins`` are pairs of rooms that meet without a wall and without a door (under a
    beam too wide for one). ``outlines`` are the outer contours, one a free-standing part of the house. ``joined`` are
    the pairs of points that cuts were made for. ``notes`` counts what the rules did, by rule.
    """

    walls: BaseGeometry
    rooms: tuple[Polygon, ...]
    passages: tuple[Passage, ...]
    joins: tuple[tuple[int, int], ...] = ()
    outlines: tuple[Polygon, ...] = ()
    joined: tuple[JoinedPair, ...] = ()
    notes: Mapping[str, int | str] = field(default_factory=dict)

    def keeping(self, keep: Sequence[int], **notes: int | str) -> Spaces:
        """Return only these rooms, in this order, and the passages whose rooms are all kept or outside."""
        new = {old: k for k, old in enumerate(keep)} | {OUTSIDE: OUTSIDE}
        passages = []
        for p in self.passages:
            a, b = p.portal.sides
            if a in new and b in new:
                passages.append(replace(p, portal=replace(p.portal, sides=(new[a], new[b]))))
        return replace(
            self,
            rooms=tuple(self.rooms[k] for k in keep),
            passages=tuple(passages),
            joins=tuple((new[a], new[b]) for a, b in self.joins if a in new and b in new),
            notes={**self.notes, **notes},
        )


# ---------------------------------------------------------------------------------------------------------------------
# Rooms that can be reached from each other.
# ---------------------------------------------------------------------------------------------------------------------


def connected_rooms(spaces: Spaces) -> list[list[int]]:
    """Groups of room indices joined by passages or joins, each sorted, in the order of their first room."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(spaces.rooms)))
    graph.add_edges_from(p.portal.sides for p in spaces.passages if not p.leads_outside)
    graph.add_edges_from(spaces.joins)
    return sorted(sorted(part) for part in nx.connected_components(graph))


# ---------------------------------------------------------------------------------------------------------------------
# Passages fitted between the faces of the two spaces that each joins.
# ---------------------------------------------------------------------------------------------------------------------


def fit_to_rooms(portals: Sequence[Portal], rooms: Sequence[Polygon]) -> list[Portal]:
    """Return the portals with their faces where the rooms' are now; on the outside, where they were."""
    limits = [[-portal.depth / 2, portal.depth / 2] for portal in portals]
    ends = [(i, k) for i, portal in enumerate(portals) for k in (0, 1) if portal.sides[k] != OUTSIDE]
    facing = np.array([rooms[portals[i].sides[k]] for i, k in ends], dtype=np.object_)
    rays = shapely.linestrings(np.array([_ray(portals[i], k) for i, k in ends]).reshape(-1, 2, 2))
    for (i, k), hit in zip(ends, shapely.intersection(rays, facing), strict=True):
        if not hit.is_empty:
            at = dot(shapely.get_coordinates(hit) - portals[i].centre, portals[i].across)
            limits[i][k] = float(at.max() if k == 0 else at.min())
    return [_between_faces(portal, low, high) for portal, (low, high) in zip(portals, limits, strict=True)]


def _ray(portal: Portal, k: int) -> list[Vector]:
    """From one face of a portal across to its other one, number ``k``, and ``THIN_WALL_M`` further."""
    near, far = -portal.depth / 2, portal.depth / 2
    ends = (far, near - THIN_WALL_M) if k == 0 else (near, far + THIN_WALL_M)
    return [portal.centre + at * portal.across for at in ends]


def _between_faces(portal: Portal, low: float, high: float) -> Portal:
    """The portal with its faces at two distances (metres) across the wall from its centre, if it has a depth then."""
    if high - low < 1e-3:
        return portal
    return replace(portal, centre=portal.centre + portal.across * (low + high) / 2, depth=high - low)


def opening_polygons(portals: Sequence[Portal], rooms: Sequence[Polygon]) -> list[Polygon]:
    """The area between the two faces of each portal, corner to corner, also where they are not quite parallel."""
    entrance = np.array([OUTSIDE in portal.sides for portal in portals], np.bool_)
    strips = np.where(entrance, strips_of(portals), strips_of(portals, deeper_m=THIN_WALL_M))
    rest = strips.copy()
    for k in (0, 1):
        inner = [i for i, portal in enumerate(portals) if portal.sides[k] != OUTSIDE]
        rest[inner] = differences(rest[inner], np.array([rooms[portals[i].sides[k]] for i in inner], np.object_))
    return [_holding(portal, polygons_of(areas(r)) or [s]) for portal, r, s in zip(portals, rest, strips, strict=True)]


def _holding(portal: Portal, pieces: list[Polygon]) -> Polygon:
    """Return the piece that holds a portal's centre, else the largest."""
    centre = shapely.points(portal.centre)
    return next((piece for piece in pieces if len(pieces) > 1 and piece.distance(centre) < 1e-6), pieces[0])


# ---------------------------------------------------------------------------------------------------------------------
# Holes in a storey's floor through which one looks down onto the storey below: there is no free space over them.
#
# R1  A hole counts where the floor of a room is open, at least as wide as a stair, and half of it shows the storey
#     below (the upper steps of a flight hide the rest).
# R2  A room that the source names holds what it covers: many draw a stair's void as part of the hall around it.
# R3  What is left of a room beside the hole is a room if a person can stand on it; the upper half of a hall is none.
# ---------------------------------------------------------------------------------------------------------------------


def without_voids(room: Polygon, floor: BaseGeometry, below: BaseGeometry, named: BaseGeometry) -> list[Polygon]:
    """Return what of a room has a floor: itself, a smaller piece, several where a void parts it, or none.

    ``floor`` is where the source has floor faces, ``below`` where the storey below shows, ``named`` what the source's
    own rooms cover; plan areas in the level frame.
    """
    bare = drop_thinner(subtract(room, union_of([buffer_mitred(floor, CRACK_M), named])), SHOULDERS_M)  # R2
    voids = [hole for hole in polygons_of(bare) if overlap(hole, below).area > MOST * hole.area]  # R1
    if not voids:
        return [room]
    left = polygons_of(subtract(room, buffer_mitred(union_of(voids), CRACK_M)))
    return [part for part in left if part.area > PATCH_M2 and not drop_thinner(part, SHOULDERS_M).is_empty]  # R3


# ---------------------------------------------------------------------------------------------------------------------
# What is odd about the shape of a room: its size, its width, and walls that end in the middle of it.
# ---------------------------------------------------------------------------------------------------------------------

SMALLEST_ROOM_M2, LARGEST_ROOM_M2 = 1.5, 200.0
NARROWEST_ROOM_M = 0.85

Bools = npt.NDArray[np.bool_]


def misshapen_rooms(rooms: list[Polygon]) -> Bools:
    """Return which rooms (n,) are too small, too large, too narrow or too ragged for a room."""
    area, length = shapely.area(rooms), shapely.length(rooms)
    sized = (area >= SMALLEST_ROOM_M2) & (area <= LARGEST_ROOM_M2)
    ragged = 4 * math.pi * area / length**2 < HARDLY
    return np.asarray(~sized | ragged | shapely.is_empty(buffer_mitred(np.array(rooms), -NARROWEST_ROOM_M / 2)))


def with_loose_ends(rooms: list[Polygon]) -> Bools:
    """Into which rooms (n,) a wall juts by more than ``STUB_M`` and ends: most walls go on to the next one."""
    whole = shapely.polygons(shapely.get_exterior_ring(np.array(rooms)))
    closed = buffer_mitred(buffer_mitred(whole, WALL_M / 2), -WALL_M / 2)
    juts, room = shapely.get_parts(shapely.difference(closed, whole), return_index=True)
    found = np.zeros(len(rooms), np.bool_)
    if len(juts):
        half = shapely.length(juts) / 2
        thickness = shapely.area(juts) / np.maximum(half, 1e-9)
        found[room[(thickness > STAND_M) & (half - thickness > STUB_M)]] = True
    return found


# ---------------------------------------------------------------------------------------------------------------------
# Where a disc robot can stand: free space drawn in by its radius, piece by piece.
# ---------------------------------------------------------------------------------------------------------------------


def walkable_floor(spaces: Spaces) -> BaseGeometry:
    """Return all rooms and the open passages between them, as one area."""
    strips = strips_of([p.portal for p in spaces.passages if not p.leads_outside], deeper_m=CM_M)
    floor = union_of([*spaces.rooms, *strips])
    return close_cracks(floor, MM_M) if spaces.joins else floor


def erode_floor(floor: BaseGeometry, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 10 cm2."""
    return sorted(erode(floor, radius_m, TINY_M2), key=lambda piece: (-piece.area, piece.bounds))


def sample(pieces: list[Polygon], count: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """``count`` points (n, 2) uniform over all pieces, and one more inside each."""
    low = np.min([p.bounds[:2] for p in pieces], axis=0)
    high = np.max([p.bounds[2:] for p in pieces], axis=0)
    whole = union_of(pieces)
    shapely.prepare(whole)
    found: list[npt.NDArray[np.float64]] = []
    while sum(len(f) for f in found) < count:
        trial = rng.uniform(low, high, (4 * count, 2))
        found.append(trial[shapely.contains_xy(whole, trial[:, 0], trial[:, 1])])
    inside = shapely.get_coordinates([p.representative_point() for p in pieces])
    return np.concatenate([inside, np.concatenate(found)[:count]])


def piece_of(points: npt.NDArray[np.float64], pieces: list[Polygon]) -> npt.NDArray[np.int64]:
    """For each point (n, 2) the index of the nearest piece."""
    return np.asarray(shapely.STRtree(pieces).nearest(shapely.points(points)), np.int64)
