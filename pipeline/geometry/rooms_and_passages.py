"""Hold a house as rooms and passages (``Spaces``), fit passages to the faces of rooms, and find connected rooms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import DoorKind
from pipeline.geometry.areas import (
    OUTSIDE,
    Indices,
    drop_lines_and_points,
    polygons_of,
    subtract_pairs,
)
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.portals import Portal, portal_strips
from pipeline.tolerances import (
    THIN_WALL_M,
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
class JoinedPoints:
    """Two points (2, 2), metres, that a cut connected, and the radius of the disc that can go from one to the other."""

    points: npt.NDArray[np.float64]
    radius_m: float


@dataclass(frozen=True, eq=False)
class Spaces:
    """From stage ``doors`` on: a house as rooms and ways between them.

    ``walls`` is the closed plane. ``joins`` are pairs of rooms that meet without a wall and without a door (under a
    beam too wide for one). ``outlines`` are the outer contours, one a free-standing part of the house. ``joined`` are
    the pairs of points that cuts were made for. ``closed`` are spaces that nothing leads into, and which were left out
    as no rooms. ``notes`` counts what the rules did, by rule.
    """

    walls: BaseGeometry
    rooms: tuple[Polygon, ...]
    passages: tuple[Passage, ...]
    joins: tuple[tuple[int, int], ...] = ()
    outlines: tuple[Polygon, ...] = ()
    joined: tuple[JoinedPoints, ...] = ()
    closed: tuple[Polygon, ...] = ()
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


def rooms_inside(outlines: Sequence[Polygon], rooms: Sequence[Polygon]) -> tuple[Indices, Indices]:
    """Return the pairs (n,) and (n,) of an outline and a room that lies in it, by a point of the room."""
    found = shapely.STRtree(shapely.point_on_surface(np.array(rooms, np.object_))).query(outlines, predicate="contains")
    return found[0], found[1]


def connected_rooms(spaces: Spaces) -> list[list[int]]:
    """Groups of room indices joined by passages or joins, each sorted, in the order of their first room."""
    inner = [p.portal.sides for p in spaces.passages if not p.leads_outside]
    return connected_groups(len(spaces.rooms), [*inner, *spaces.joins])


# ---------------------------------------------------------------------------------------------------------------------
# Passages fitted between the faces of the two spaces that each joins.
# ---------------------------------------------------------------------------------------------------------------------


def fit_portals_to_rooms(portals: Sequence[Portal], rooms: Sequence[Polygon]) -> list[Portal]:
    """Return the portals with their faces where the rooms' are now; on the outside, where they were."""
    ends = [(i, k) for i, portal in enumerate(portals) for k in (0, 1) if portal.sides[k] != OUTSIDE]
    if not ends:
        return list(portals)
    of_portal, face = np.array(ends).T
    facing = np.array([rooms[portals[i].sides[k]] for i, k in ends], dtype=np.object_)
    centre, across = (np.array([(p.centre, p.across) for p in portals])[of_portal, k] for k in (0, 1))
    half = np.array([portal.depth for portal in portals])[of_portal] / 2
    away = np.where(face == 0, -1.0, 1.0)  # a ray from one face across to the other one, and ``THIN_WALL_M`` further
    rays = np.stack([centre + at[:, None] * across for at in (-away * half, away * (half + THIN_WALL_M))], axis=1)
    points, ray = shapely.get_coordinates(shapely.intersection(shapely.linestrings(rays), facing), return_index=True)
    at = away[ray] * ((points - centre[ray]) * across[ray]).sum(axis=1)
    nearest = np.full(len(ends), np.inf)
    np.minimum.at(nearest, ray, at)
    limits = [[-portal.depth / 2, portal.depth / 2] for portal in portals]
    for (i, k), way, found in zip(ends, away.tolist(), nearest.tolist(), strict=True):
        if found < math.inf:
            limits[i][k] = way * found
    return [_between_faces(portal, low, high) for portal, (low, high) in zip(portals, limits, strict=True)]


def _between_faces(portal: Portal, low: float, high: float) -> Portal:
    """The portal with its faces at two distances (metres) across the wall from its centre, if it has a depth then."""
    if high - low < 1e-3:
        return portal
    return replace(portal, centre=portal.centre + portal.across * (low + high) / 2, depth=high - low)


def portal_polygons(portals: Sequence[Portal], rooms: Sequence[Polygon]) -> list[Polygon]:
    """The area between the two faces of each portal, corner to corner, also where they are not quite parallel."""
    entrance = np.array([OUTSIDE in portal.sides for portal in portals], np.bool_)
    strips = portal_strips(portals, deeper_m=np.where(entrance, 0.0, THIN_WALL_M)[:, None])
    rest = strips.copy()
    for k in (0, 1):
        inner = [i for i, portal in enumerate(portals) if portal.sides[k] != OUTSIDE]
        rest[inner] = subtract_pairs(rest[inner], np.array([rooms[portals[i].sides[k]] for i in inner], np.object_))
    return [
        _holding(portal, polygons_of(drop_lines_and_points(r)) or [s])
        for portal, r, s in zip(portals, rest, strips, strict=True)
    ]


def _holding(portal: Portal, pieces: list[Polygon]) -> Polygon:
    """Return the piece that holds a portal's centre, else the largest."""
    if len(pieces) == 1:
        return pieces[0]
    centre = shapely.points(portal.centre)
    return next((piece for piece in pieces if piece.distance(centre) < 1e-6), pieces[0])
