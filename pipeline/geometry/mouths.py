"""Find the mouths of a room: narrow places, where a person sees one room end and the next begin.

R1  A mouth lies between the end of a wall, or of a block between two rooms, and the wall that the end points at, or
    that ends a partition's breadth beside where it points.
R2  On both sides, right behind it, the room is at least twice as broad as the mouth is wide. So the
    end of a corridor is none: one side is as broad as the mouth. Behind a mouth between blocks that is not ``TWICE``
    as wide as deep, the room holds a disc ``WIDER`` times as wide as the mouth; so a corridor between bends and
    crossings is none. A hole in one wall, with a jamb on either side, may take ``NARROW_IN_WALL`` of the breadth.
    A block deeper than ``BLOCK_M`` makes a mouth that is no deeper than wide; what is deeper is a corridor.
R3  Both parts are as large as a room. Of several mouths, the one that is narrowest beside its two sides comes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    dot_product,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.closing_candidates import WallEnd, each_place_once, gap_beyond_wall_end, wall_ends
from pipeline.tolerances import (
    BESIDE_M,
    BLOCK_M,
    CRACK_M,
    HALL_M,
    MOST,
    PARALLEL,
    PARTITION_M,
    THICK_WALL_M,
    THIN_WALL_M,
    TWICE,
)

NARROW_IN_WALL = 0.65
WIDER = 1.5
"""The disc in a crossing of four corridors of one width is 1.41 times as wide as they are."""
LOOK_M = (0.5, 2.0)
"""How far behind a mouth its breadth is measured: as far as the mouth is wide, within these limits."""
MOUTH_ROOM_M2 = 4.0


@dataclass(frozen=True, eq=False)
class _Mouth:
    """A mouth and its filling: ``middle`` (2,) is the middle of its width and depth, ``along`` leads across it.

    ``share`` is how much of the breadth behind it the mouth may take.
    """

    filling: Polygon
    middle: npt.NDArray[np.float64]
    along: npt.NDArray[np.float64]
    width: float
    depth: float
    share: float

    def in_row(self, other: _Mouth) -> bool:
        """Return whether two mouths lie in one wall."""
        off = other.middle - self.middle
        aside = abs(self.along[0] * off[1] - self.along[1] * off[0])
        return bool(aside < BESIDE_M and abs(dot_product(self.along, other.along)) > PARALLEL)


def mouth_fillings(rooms: Sequence[Polygon], walls: BaseGeometry) -> list[list[Polygon]]:
    """Fillings of the mouths that part ``rooms`` into more rooms; ``walls`` is all that closes them.

    Mouths of one wall that part a room only together are in one list.
    """
    ends = list(wall_ends(walls, HALL_M, nibs=True)) if rooms else []
    every = [mouth for end in ends if (mouth := _mouth_at(end, ends, walls)) is not None and mouth.width > CRACK_M]
    every.sort(key=lambda each: (round(each.width, 6), each.filling.bounds))
    every = [every[k] for k in each_place_once([mouth.filling for mouth in every])]
    found: list[list[Polygon]] = []
    waiting = list(rooms)
    while waiting:
        room = waiting.pop()
        near = [mouth for mouth in every if shapely.contains(room, shapely.points(mouth.middle))]
        rows = [[other for other in near if mouth.in_row(other)] for mouth in near]
        tries = [(parts, row) for row in [*([mouth] for mouth in near), *rows] if (parts := _part_at_mouths(room, row))]
        if tries:
            (_, sides), row = min(
                tries, key=lambda each: (round(each[0][0], 6), len(each[1]), each[1][0].filling.bounds)
            )
            found.append([mouth.filling for mouth in row])
            waiting += sides
    return found


def _mouth_at(end: WallEnd, ends: Sequence[WallEnd], walls: BaseGeometry) -> _Mouth | None:
    strip = gap_beyond_wall_end(end, walls, HALL_M)
    straight = np.inf if strip is None else end.width_of(strip) - 0.015
    depth, left = float(np.hypot(*(end.b - end.a))), np.array([-end.out[1], end.out[0]])
    low, high = -min(depth, PARTITION_M) / 2, min(depth, PARTITION_M) / 2
    width, centre = straight, end.centre
    for way in (-1, 1):
        past = _distance_beside(end, way * (depth / 2 + THIN_WALL_M) * left, walls)
        if past < min(width, straight - THICK_WALL_M):
            width, side = past, way * (depth / 2 + THIN_WALL_M)
            low, high = min(-depth / 2, side), max(depth / 2, side)
            centre = end.centre + (low + high) / 2 * left
    if not np.isfinite(width) or depth > max(BLOCK_M, width + PARTITION_M):
        return None
    near, far = end.centre - 0.005 * end.out, end.centre + (width + 0.01) * end.out
    filling = Polygon([near + low * left, near + high * left, far + high * left, far + low * left])
    met = end.centre + end.out * width
    in_wall = any(end.faces(other) and np.hypot(*(other.centre - met)) < BESIDE_M for other in ends)
    deep = depth if width == straight else high - low
    wide = min(width, _distance_beside(end, np.zeros(2), walls))  # some of the end's breadth may point past the wall
    return _Mouth(filling, centre + end.out * width / 2, end.out, wide, deep, NARROW_IN_WALL if in_wall else MOST)


def _distance_beside(end: WallEnd, aside: npt.NDArray[np.float64], walls: BaseGeometry) -> float:
    """Return how far away the first wall stands so much aside of where a wall's end points; infinite if none does."""
    start = end.centre + aside
    ray = shapely.linestrings([start + 1e-3 * end.out, start + HALL_M * end.out])
    hit = shapely.get_coordinates(shapely.intersection(ray, walls))
    return float(np.min(dot_product(hit - start, end.out), initial=np.inf))


def _part_at_mouths(room: Polygon, row: Sequence[_Mouth]) -> tuple[float, list[Polygon]] | None:
    """R2, R3: how narrow mouths are beside the room behind them, and the two parts; None if they do not part it so."""
    parts = [p for p in polygons_of(subtract(room, unite(m.filling for m in row))) if p.area >= MOUTH_ROOM_M2]
    if len(parts) < 2:
        return None
    narrowest, between = 0.0, set()
    for mouth in row:
        sides = [_room_behind_mouth(mouth, way, parts) for way in (1, -1)]
        if sides[0] is None or sides[1] is None or sides[0][0] == sides[1][0]:
            return None
        between.add(frozenset(k for k, _ in (sides[0], sides[1])))
        narrowest = max(narrowest, sum(m.width for m in row) / min(sides[0][1], sides[1][1]))
    if len(between) > 1 or narrowest > min(mouth.share for mouth in row):
        return None
    return narrowest, [parts[k] for k in sorted(next(iter(between)))]


def _room_behind_mouth(mouth: _Mouth, way: int, parts: Sequence[Polygon]) -> tuple[int, float] | None:
    """Return which part of a room lies behind a mouth on one side, and how broad it is there, in metres."""
    aside = np.array([-mouth.along[1], mouth.along[0]]) * way
    face = mouth.middle + aside * (mouth.depth / 2 + 1e-2)
    at = shapely.points(face)
    k = next((k for k, part in enumerate(parts) if shapely.contains(part, at)), None)
    if k is None:
        return None
    look = float(np.clip(mouth.width, *LOOK_M))
    far = HALL_M / MOST * mouth.along
    window = Polygon([face - far, face + far, face + far + aside * look, face - far + aside * look])
    seen = [piece for piece in polygons_of(intersect(parts[k], window)) if shapely.dwithin(piece, at, 0.05)]
    wide = WIDER * mouth.width
    between_blocks = mouth.depth > THICK_WALL_M and mouth.width < TWICE * mouth.depth
    if between_blocks and not shapely.dwithin(shapely.buffer(parts[k], -wide / 2), at, 2 * wide):
        return None
    return k, sum(piece.area for piece in seen) / look
