"""Hold a house as rooms and passages (``Spaces``): fit passages to the faces of rooms, find where a disc can stand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import erode
from pipeline.geometry.areas import OUTSIDE, Indices, drop_lines_and_points, polygons_of, subtract_pairs, unite
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.openings import Opening, strips_of
from pipeline.geometry.wall_sections import close_cracks
from pipeline.tolerances import CM_M, MM_M, THIN_WALL_M, TINY_M2

# ---------------------------------------------------------------------------------------------------------------------
# A house as rooms and the ways between them.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class JoinedPoints:
    """Two points (2, 2), metres, that a cut connected, and the radius of the disc that can go from one to the other."""

    points: npt.NDArray[np.float64]
    radius_m: float


@dataclass(frozen=True, eq=False)
class Spaces:
    """From stage ``doors`` on: a house as rooms and ways between them.

    ``walls`` is the closed plane. ``open_pairs`` are pairs of rooms that meet without a wall and a door (under a beam
    too wide for a door). ``outlines`` are the outer contours, one for each free-standing part of the house.
    ``joined`` are the pairs of points that cuts were made for. ``closed`` are spaces that were left out because nothing
    leads into them. ``notes`` counts what the rules did, by rule.
    """

    walls: BaseGeometry
    rooms: tuple[Polygon, ...]
    passages: tuple[Opening, ...]
    open_pairs: tuple[tuple[int, int], ...] = ()
    outlines: tuple[Polygon, ...] = ()
    joined: tuple[JoinedPoints, ...] = ()
    closed: tuple[Polygon, ...] = ()
    notes: Mapping[str, int | str] = field(default_factory=dict)

    def keeping(self, keep: Sequence[int], **notes: int | str) -> Spaces:
        """Return only these rooms, in this order, and the passages whose rooms are all kept or outside."""
        new = {old: k for k, old in enumerate(keep)} | {OUTSIDE: OUTSIDE}
        passages = []
        for p in self.passages:
            a, b = p.sides
            if a in new and b in new:
                passages.append(replace(p, sides=(new[a], new[b])))
        return replace(
            self,
            rooms=tuple(self.rooms[k] for k in keep),
            passages=tuple(passages),
            open_pairs=tuple((new[a], new[b]) for a, b in self.open_pairs if a in new and b in new),
            notes={**self.notes, **notes},
        )


# ---------------------------------------------------------------------------------------------------------------------
# Rooms that can be reached from each other.
# ---------------------------------------------------------------------------------------------------------------------


def rooms_inside(outlines: Sequence[Polygon], rooms: Sequence[Polygon]) -> tuple[Indices, Indices]:
    """Return pairs of indices, (n,) and (n,): an outline, and a room with a representative point in it."""
    found = shapely.STRtree(shapely.point_on_surface(np.array(rooms, np.object_))).query(outlines, predicate="contains")
    return found[0], found[1]


def connected_rooms(spaces: Spaces) -> list[list[int]]:
    """Groups of rooms (indices) that passages join or that meet, sorted, in the order of their first room."""
    inner = [p.sides for p in spaces.passages if not p.leads_outside]
    return connected_groups(len(spaces.rooms), [*inner, *spaces.open_pairs])


# ---------------------------------------------------------------------------------------------------------------------
# Passages fitted between the faces of the two spaces that each joins.
# ---------------------------------------------------------------------------------------------------------------------


def fit_to_rooms(openings: Sequence[Opening], rooms: Sequence[Polygon]) -> list[Opening]:
    """Return the openings with their faces moved to the rooms' faces; a face to the outside stays."""
    ends = [(i, k) for i, opening in enumerate(openings) for k in (0, 1) if opening.sides[k] != OUTSIDE]
    if not ends:
        return list(openings)
    of_opening, face = np.array(ends).T
    facing = np.array([rooms[openings[i].sides[k]] for i, k in ends], dtype=np.object_)
    centre, across = (np.array([(p.centre, p.across) for p in openings])[of_opening, k] for k in (0, 1))
    half = np.array([opening.depth for opening in openings])[of_opening] / 2
    away = np.where(face == 0, -1.0, 1.0)  # a ray from one face across to the other one, and ``THIN_WALL_M`` further
    rays = np.stack([centre + at[:, None] * across for at in (-away * half, away * (half + THIN_WALL_M))], axis=1)
    points, ray = shapely.get_coordinates(shapely.intersection(shapely.linestrings(rays), facing), return_index=True)
    at = away[ray] * ((points - centre[ray]) * across[ray]).sum(axis=1)
    nearest = np.full(len(ends), np.inf)
    np.minimum.at(nearest, ray, at)
    limits = [[-opening.depth / 2, opening.depth / 2] for opening in openings]
    for (i, k), way, found in zip(ends, away.tolist(), nearest.tolist(), strict=True):
        if found < math.inf:
            limits[i][k] = way * found
    return [_between_faces(opening, low, high) for opening, (low, high) in zip(openings, limits, strict=True)]


def _between_faces(opening: Opening, low: float, high: float) -> Opening:
    """Return the opening with its faces at two distances, metres, across the wall from its centre, if high > low."""
    if high - low < 1e-3:
        return opening
    return replace(opening, centre=opening.centre + opening.across * (low + high) / 2, depth=high - low)


def polygons_between_rooms(openings: Sequence[Opening], rooms: Sequence[Polygon]) -> list[Polygon]:
    """Return the area between the two faces of each opening, corner to corner, even if they are not quite parallel."""
    entrance = np.array([OUTSIDE in opening.sides for opening in openings], np.bool_)
    strips = strips_of(openings, deeper_m=np.where(entrance, 0.0, THIN_WALL_M)[:, None])
    rest = strips.copy()
    for k in (0, 1):
        inner = [i for i, opening in enumerate(openings) if opening.sides[k] != OUTSIDE]
        rest[inner] = subtract_pairs(rest[inner], np.array([rooms[openings[i].sides[k]] for i in inner], np.object_))
    return [
        _holding(opening, polygons_of(drop_lines_and_points(r)) or [s])
        for opening, r, s in zip(openings, rest, strips, strict=True)
    ]


def _holding(opening: Opening, pieces: list[Polygon]) -> Polygon:
    """Return the piece that holds an opening's centre, or the largest piece if none does."""
    if len(pieces) == 1:
        return pieces[0]
    centre = shapely.points(opening.centre)
    return next((piece for piece in pieces if piece.distance(centre) < 1e-6), pieces[0])


# ---------------------------------------------------------------------------------------------------------------------
# Where a disc robot can stand: free space drawn in by its radius, piece by piece.
# ---------------------------------------------------------------------------------------------------------------------


def walkable_floor(spaces: Spaces) -> BaseGeometry:
    """Return all rooms and the open passages between them, as one area."""
    strips = strips_of([p for p in spaces.passages if not p.leads_outside], deeper_m=CM_M)
    floor = unite([*spaces.rooms, *strips])
    return close_cracks(floor, MM_M) if spaces.open_pairs else floor


def erode_floor(floor: BaseGeometry, radius_m: float) -> list[Polygon]:
    """Return the areas in which the centre of a disc can be, the largest first, without those under 10 cm2."""
    return sorted(erode(floor, radius_m, TINY_M2), key=lambda piece: (-piece.area, piece.bounds))


def sample_points(pieces: list[Polygon], count: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """``count`` points (n, 2) uniform over all pieces, and one more inside each."""
    low = np.min([p.bounds[:2] for p in pieces], axis=0)
    high = np.max([p.bounds[2:] for p in pieces], axis=0)
    whole = unite(pieces)
    shapely.prepare(whole)
    found: list[npt.NDArray[np.float64]] = []
    while sum(len(f) for f in found) < count:
        trial = rng.uniform(low, high, (4 * count, 2))
        found.append(trial[shapely.contains_xy(whole, trial[:, 0], trial[:, 1])])
    inside = shapely.get_coordinates([p.representative_point() for p in pieces])
    return np.concatenate([inside, np.concatenate(found)[:count]])


def nearest_piece(points: npt.NDArray[np.float64], pieces: list[Polygon]) -> npt.NDArray[np.int64]:
    """For each point (n, 2) the index of the nearest piece."""
    return np.asarray(shapely.STRtree(pieces).nearest(shapely.points(points)), np.int64)
