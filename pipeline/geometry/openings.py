"""Hold an opening; find the straight strips through a piece of wall from one space to another; join those in a row."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import DoorKind
from pipeline.geometry.areas import (
    EMPTY,
    OUTSIDE,
    WALL,
    Shapes,
    are_too_narrow,
    buffer_mitred,
    clip_to_box,
    dot_product,
    drop_lines_and_points,
    drop_thin_parts,
    fill_enclosed,
    intersect,
    intersect_pairs,
    locate_points,
    polygons_of,
    subtract,
    trace_outlines,
    unite,
)
from pipeline.geometry.meshes import Box
from pipeline.tolerances import (
    AROUND_M,
    CRACK_M,
    HAIR_M,
    LAP_M,
    NEARLY_ALL,
    PARALLEL,
    PLACE_M,
    SHEET_M,
    STAND_M,
    STONE_WALL_M,
    THIN_WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# An opening: the straight strip through a wall that joins two spaces, and rows of such strips.
# ---------------------------------------------------------------------------------------------------------------------

Vector = npt.NDArray[np.float64]

NOWHERE: Final = np.full(2, np.nan)
NO_WAY: Final = np.zeros(2)

ClosedBy: TypeAlias = Literal[
    "", "opening", "door", "lintel", "sill", "gap", "gate", "mouth", "rail", "room_edge", "floor_edge", "wall_ends"
]
"""What closes an opening in P_g. ``door`` and ``opening``: known ones. ``gate``: a wide gap, which closes to the
outside only. ``mouth``: a narrow place that makes two rooms of one. "" for a cut."""
GAPS: Final = frozenset({"gap", "gate", "mouth"})
KNOWN: Final = frozenset({"door", "opening"})
"""Openings that the source names, or that a leaf shows."""
ENDS: Final = frozenset({"floor_edge", "wall_ends"})
EDGES: Final = ENDS | {"rail", "room_edge"}
"""What closes an open house."""


@dataclass(frozen=True, eq=False)
class Opening:
    """A place where two spaces may meet: what all finders yield, what the stages weigh, and what parts or joins rooms.

    It is a straight strip through a wall: ``centre`` (2,), unit ``along`` the wall and ``across`` it, its width from
    jamb to jamb and its depth from face to face (m). ``sides`` are the indices of the two spaces that it joins,
    ``across`` pointing from the first to the second; OUTSIDE may be one.

    ``polygon`` is its plan area: all that closes it in the closed plane P_g, or the known place of a door from jamb to
    jamb. If only the polygon is known, the width is 0 (``closing``): the opening may close something, as a corner
    between two lintels does, but is not a way.

    ``closed_by`` says what stands or hangs there, and ``said_by`` who says so: the source names it ("named"), a "leaf"
    stands in it, or a "recess" under a lintel shows it; "" where the walls show it. ``kind`` is its kind in the plan,
    "opening" until stage ``doors`` has decided. ``why`` is the evidence for the place of a cut. ``confidence`` is the
    probability that a passage is there, None before stage ``confidence``. ``sill_m`` and ``head_m`` are the heights of
    a window above the floor, None where they are not known.
    """

    centre: Vector
    along: Vector
    width: float
    depth: float
    sides: tuple[int, int]
    kind: DoorKind = "opening"
    polygon: Polygon = EMPTY
    closed_by: ClosedBy = ""
    said_by: Literal["", "named", "leaf", "recess"] = ""
    why: str = ""
    confidence: float | None = None
    sill_m: float | None = None
    head_m: float | None = None

    @classmethod
    def window(cls, polygon: Polygon, heights_m: tuple[float | None, float | None], across: Vector = NO_WAY) -> Opening:
        """Return a window that the source names, by its plan area in the wall and the heights of its sill and head.

        ``across`` (2,) is the direction through the wall, of any length; if it is 0, a window is wider than deep.
        """
        corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))[:4]
        sides = np.diff(corners[:3], axis=0)
        lengths = np.hypot(*sides.T)
        through = np.abs(sides @ across) / np.maximum(lengths, HAIR_M) if np.any(across) else -lengths
        deep = int(np.argmax(through))
        width, depth = float(lengths[1 - deep]), float(lengths[deep])
        along, sides_of = sides[1 - deep] / max(width, HAIR_M), (OUTSIDE, OUTSIDE)
        sill, head = heights_m
        middle = corners.mean(axis=0)
        return cls(middle, along, width, depth, sides_of, "window", polygon, said_by="named", sill_m=sill, head_m=head)

    @classmethod
    def closing(
        cls, polygon: Polygon, closed_by: ClosedBy, said_by: Literal["", "named", "leaf", "recess"] = ""
    ) -> Opening:
        """Return an opening of which only the plan area is known."""
        return cls(NOWHERE, NOWHERE, 0.0, 0.0, (OUTSIDE, OUTSIDE), "opening", polygon, closed_by, said_by)

    @classmethod
    def named(cls, polygon: Polygon, has_door: bool) -> Opening:
        """Return an opening that the source names, with or without a door."""
        return cls.closing(polygon, "door" if has_door else "opening", "named")

    @classmethod
    def in_box(cls, box: Box, sides: tuple[int, int], kind: DoorKind, closed_by: ClosedBy) -> Opening:
        """Return an opening with the plan of a box, whose longer side lies along the wall."""
        return cls(box.centre, box.along, box.width, box.thickness, sides, kind, closed_by=closed_by)

    @property
    def has_door(self) -> bool:
        """Whether a door is known to be in it."""
        return self.closed_by == "door"

    @property
    def is_strip(self) -> bool:
        """Whether it is known as a strip through a wall, which somebody may pass."""
        return self.width > 0.0

    @property
    def leads_outside(self) -> bool:
        """Whether one side is the outside; such a passage stays closed in the outline."""
        return OUTSIDE in self.sides

    @cached_property
    def across(self) -> Vector:
        """Unit normal of the wall, to the left of ``along``."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def segment(self) -> Vector:
        """(2, 2) from jamb to jamb on the wall's centre line."""
        half = self.along * self.width / 2
        return np.stack([self.centre - half, self.centre + half])

    def corners(self, *, deeper_m: float = 0.0, wider_m: float = 0.0) -> Vector:
        """(4, 2) corners of the strip's rectangle, ``deeper_m`` and ``wider_m`` larger on each side."""
        half = self.across * (self.depth / 2 + deeper_m)
        long = self.along * (self.width / 2 + wider_m)
        a, b = self.centre - long, self.centre + long
        return np.array([a - half, b - half, b + half, a + half])

    def strip(self, *, deeper_m: float = 0.0, wider_m: float = 0.0) -> Polygon:
        """``corners`` as an area."""
        return shapely.polygons(self.corners(deeper_m=deeper_m, wider_m=wider_m))

    def has_jamb(self, door_plane: BaseGeometry) -> bool:
        """Return whether a wall goes on in line at one end or both; a beam ends at walls that cross its line."""
        return any(self._jambs(door_plane))

    def has_two_jambs(self, door_plane: BaseGeometry) -> bool:
        """Return whether a wall goes on in line at both ends: the opening is a hole in one wall."""
        return all(self._jambs(door_plane))

    def _jambs(self, door_plane: BaseGeometry) -> Iterator[bool]:
        """Yield for each end whether a wall goes on there in line, with no wall beside it."""
        shapely.prepare(door_plane)
        for end, on in zip(self.segment, (-self.along, self.along), strict=True):
            beside = self.across * (self.depth / 2 + THIN_WALL_M)
            stub = end + THIN_WALL_M / 2 * on
            wall, left, right = shapely.intersects(door_plane, shapely.points([stub, stub + beside, stub - beside]))
            yield bool(wall and not left and not right)

    def ends_at_walls(self, door_plane: BaseGeometry) -> bool:
        """Return whether a wall stands at both ends, be it in line or crossing; a trim ends in the air."""
        return bool(end_at_walls([self], door_plane)[0])

    def part_between(self, start: float, end: float) -> Opening:
        """Return the part between two distances (metres) along the wall from the centre."""
        return replace(self, centre=self.centre + self.along * (start + end) / 2, width=end - start)


def strips_of(openings: Sequence[Opening], *, deeper_m: float | Vector = 0.0, wider_m: float = 0.0) -> Shapes:
    """Return the ``strip`` of each opening (n,); ``deeper_m`` may differ between openings (n, 1)."""
    centre, along, sizes = openings_as_arrays(openings)
    return _rectangles(centre, along, sizes[:, :1] + wider_m, sizes[:, 1:] + deeper_m)


def openings_as_arrays(openings: Sequence[Opening]) -> tuple[Vector, Vector, Vector]:
    """Return the centres, the directions, and half the widths and depths of openings, (n, 2) each."""
    each = [(opening.centre, opening.along, (opening.width / 2, opening.depth / 2)) for opening in openings]
    centre, along, sizes = np.array(each, np.float64).reshape(-1, 3, 2).transpose(1, 0, 2)
    return centre, along, sizes


def turn_left(along: Vector) -> Vector:
    """Return directions (n, 2) turned by a right angle, as ``Opening.across`` is."""
    return np.stack([-along[:, 1], along[:, 0]], axis=1)


def _rectangles(centre: Vector, along: Vector, half_width: Vector, half_depth: Vector) -> Shapes:
    """Return rectangles (n,) from centres and directions (n, 2) and half widths and depths (n, 1), metres."""
    long, half = along * half_width, turn_left(along) * half_depth
    a, b = centre - long, centre + long
    return np.atleast_1d(shapely.polygons(np.stack([a - half, b - half, b + half, a + half], axis=1)))


def end_at_walls(openings: Sequence[Opening], door_plane: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Return for each opening (n,) whether a wall stands at both ends, be it in line or crossing."""
    shapely.prepare(door_plane)
    centre, along, sizes = openings_as_arrays(openings)
    half = along * sizes[:, :1]
    ends = np.stack([centre - half - along * STAND_M, centre + half + along * STAND_M], axis=1)
    return np.asarray(shapely.intersects_xy(door_plane, ends[:, :, 0], ends[:, :, 1]).all(axis=1), np.bool_)


def strips_before(openings: Sequence[Opening], sides: Sequence[int], depth_m: float, *, off_m: float = 0.0) -> Shapes:
    """Return the floor before one face of each opening (n,), on its side -1 or 1, as deep as ``depth_m``.

    It begins ``off_m`` from the face.
    """
    centre, along, sizes = openings_as_arrays(openings)
    away = np.array(sides, np.float64)[:, None] * turn_left(along) * (sizes[:, 1:] + off_m + depth_m / 2)
    return _rectangles(centre + away, along, sizes[:, :1], np.full((len(openings), 1), depth_m / 2))


def join_in_rows(found: list[Opening], door_plane: BaseGeometry) -> list[Opening]:
    """Join neighbours in a row between the same spaces into one opening: a beam with posts is one passage, not ten.

    Two openings are neighbours if they are parallel, each lies in the other's depth, and nothing stands between their
    ends. The result is as deep as the deepest of them, but those twice as deep as the widest do not count.
    """
    rest = sorted(found, key=lambda b: -b.width)
    result: list[Opening] = []
    while rest:
        whole = rest.pop(0)
        while (k := next((k for k, b in enumerate(rest) if _neighbours(whole, b, door_plane)), None)) is not None:
            whole = hull_of_row(whole, rest.pop(k))
        result.append(whole)
    return result


def _offsets(whole: Opening, other: Opening) -> tuple[float, float, float]:
    """Where ``other`` starts and ends along ``whole`` from its centre, and how far aside its centre line lies."""
    half = abs(dot_product(other.along, whole.along)) * other.width / 2
    to = other.centre - whole.centre
    return (
        float(dot_product(to, whole.along) - half),
        float(dot_product(to, whole.along) + half),
        float(dot_product(to, whole.across)),
    )


def _neighbours(whole: Opening, other: Opening, door_plane: BaseGeometry) -> bool:
    apart = distance_in_row(whole, other)
    if apart is None or apart > PLACE_M:
        return False
    if apart <= 0:
        return True
    start, end, _ = _offsets(whole, other)
    half = whole.width / 2
    between = whole.part_between(half, start) if start > half else whole.part_between(end, -half)
    return bool(shapely.intersection(between.strip(), door_plane).area < 0.1 * between.strip().area)


def distance_in_row(whole: Opening, other: Opening) -> float | None:
    """Metres between the near ends of two openings between the same spaces, or None if they are not in one row."""
    if set(whole.sides) != set(other.sides) or abs(dot_product(whole.along, other.along)) < PARALLEL:
        return None
    start, end, aside = _offsets(whole, other)
    if abs(aside) > (whole.depth + other.depth) / 2:
        return None
    return max(start - whole.width / 2, -whole.width / 2 - end)


def hull_of_row(whole: Opening, other: Opening) -> Opening:
    """Return the strip from the far end of one opening to that of another in its row, as deep as the deeper of the two.

    If ``other`` is twice as deep as ``whole`` or more, the depth stays.
    """
    start, end, aside = _offsets(whole, other)
    near, far = -whole.depth / 2, whole.depth / 2
    if other.depth < 2 * whole.depth:
        near, far = min(near, aside - other.depth / 2), max(far, aside + other.depth / 2)
    wider = whole.part_between(min(start, -whole.width / 2), max(end, whole.width / 2))
    return replace(wider, centre=wider.centre + wider.across * (near + far) / 2, depth=far - near)


def free_intervals(opening: Opening, standing: BaseGeometry) -> list[tuple[float, float]]:
    """Stretches (start, end) along the strip, metres from its centre, free of what is ``standing`` in it."""
    blocked = shapely.get_parts(standing)
    taken: list[tuple[float, float]] = []
    for part in blocked:
        points = shapely.get_coordinates(part) - opening.centre
        across, along = dot_product(points, opening.across), dot_product(points, opening.along)
        if len(points) and np.ptp(across) > STAND_M:
            taken.append((float(along.min()), float(along.max())))
    free, at, half = [], -opening.width / 2, opening.width / 2
    for start, end in [*sorted(taken), (half, half)]:
        if start - at > STAND_M:
            free.append((at, start))
        at = max(at, end)
    return free


# ---------------------------------------------------------------------------------------------------------------------
# Where a piece of wall separates two spaces: straight strips from one's face to the other's.
#
# A lintel, a sill or the filling of a gap is a piece of wall that stands in one plane and not in the other. Each
# stretch of its outline faces a room, the outside, or more wall. Two stretches that face each other across the piece
# and look into different spaces bound an opening: the strip between them, without the parts where something stands in
# the door plane.
# ---------------------------------------------------------------------------------------------------------------------

EDGE_STEP_M = 0.08


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A straight part of the piece's outline, ``a`` to ``b`` with the piece on its left, facing one space."""

    a: Vector
    b: Vector
    faces: int


def find_strips(
    pieces: Sequence[Polygon], rooms: list[Polygon], walls: BaseGeometry, door_plane: BaseGeometry
) -> list[list[Opening]]:
    """For each of the pieces all strips through it that join two different spaces.

    Parameters
    ----------
    pieces
        Wall that does not stand in the door plane.
    rooms
        The closed spaces; an opening's ``sides`` are indices into them, or OUTSIDE.
    walls
        All walls of the closed plane, the pieces included.
    door_plane
        What stands in the door plane; a strip is cut off where it does.
    """
    facing = [
        (k, whole)
        for k, stretches in enumerate(_stretches(pieces, rooms, walls))
        for first, second in combinations(stretches, 2)
        if (whole := _strip_across(first, second)) is not None
    ]
    if not facing:
        return [[] for _ in pieces]
    of_piece = np.array([k for k, _ in facing])
    near = _pieces_near(pieces, door_plane)
    strips = strips_of([whole for _, whole in facing])
    filled = shapely.area(intersect_pairs(strips, np.array(pieces, dtype=np.object_)[of_piece]))
    standing = intersect_pairs(strips, near[of_piece])
    real = filled + shapely.area(standing) >= NEARLY_ALL * shapely.area(strips)
    found: list[list[Opening]] = [[] for _ in pieces]
    for j in np.flatnonzero(real).tolist():
        k, whole = facing[j]
        free = free_intervals(whole, drop_lines_and_points(standing[j]))
        if not free:  # a film that rounding left before a doorway
            free = free_intervals(whole, drop_thin_parts(drop_lines_and_points(standing[j]), HAIR_M))
        found[k] += [whole.part_between(s, e) for s, e in free]
    return [join_in_rows(each, plane) for each, plane in zip(found, near, strict=True)]


def _pieces_near(pieces: Sequence[Polygon], door_plane: BaseGeometry) -> Shapes:
    """For each piece what stands near it."""
    found = np.empty(len(pieces), np.object_)
    for k, (x1, y1, x2, y2) in enumerate(shapely.bounds(pieces)):
        found[k] = clip_to_box(door_plane, x1 - AROUND_M, y1 - AROUND_M, x2 + AROUND_M, y2 + AROUND_M)
    return found


def _stretches(pieces: Sequence[Polygon], rooms: list[Polygon], walls: BaseGeometry) -> list[list[_Stretch]]:
    """Return the stretches of each outline: it is sampled in steps, and neighbours that face the same space join."""
    found: list[list[_Stretch]] = [[] for _ in pieces]
    if not pieces:
        return found
    outline = trace_outlines(pieces, 2 * LAP_M)
    start = outline.points
    edge = start[outline.after] - start
    steps = np.maximum(1, np.ceil(np.hypot(*edge.T) / EDGE_STEP_M)).astype(np.int64)
    edges = np.repeat(np.arange(len(edge)), steps)
    step = np.arange(len(edges)) - np.repeat(np.cumsum(steps) - steps, steps)
    each = 1.0 / steps[edges]
    until = np.where(step + 1 == steps[edges], 1.0, (step + 1) * each)
    a = start[edges] + (step * each)[:, None] * edge[edges]
    b = start[edges] + until[:, None] * edge[edges]
    along = b - a
    length = np.hypot(*along.T)
    outwards = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.where(length > 0, length, 1.0)[:, None]
    faces = locate_points((a + b) / 2 + CRACK_M * outwards, rooms, walls)
    change = np.flatnonzero((np.diff(edges) != 0) | (np.diff(faces) != 0)) + 1
    first, last = np.concatenate([[0], change]), np.concatenate([change, [len(a)]]) - 1
    long = np.hypot(*(b[last] - a[first]).T) > SHEET_M
    for i, j in zip(first[long & (faces[first] != WALL)], last[long & (faces[first] != WALL)], strict=True):
        found[outline.area[edges[i]]].append(_Stretch(a[i], b[j], int(faces[i])))
    return found


def _strip_across(first: _Stretch, second: _Stretch) -> Opening | None:
    """Return the strip from one stretch to the other, or None if they see one space or do not face each other."""
    if first.faces == second.faces:
        return None
    d1, d2 = first.b - first.a, second.b - second.a
    u1, u2 = d1 / math.hypot(*d1), d2 / math.hypot(*d2)
    if dot_product(u1, u2) > -PARALLEL:
        return None
    along = u1 - u2  # the two run in opposite directions
    along /= math.hypot(*along)
    across = np.array([-along[1], along[0]])  # into the piece, seen from the first stretch
    depth = float(dot_product((second.a + second.b) / 2 - (first.a + first.b) / 2, across))
    low = max(dot_product(first.a, along), dot_product(second.b, along))
    high = min(dot_product(first.b, along), dot_product(second.a, along))
    if not 0 < depth <= STONE_WALL_M or high - low < SHEET_M:
        return None
    middle = dot_product((first.a + first.b) / 2 + (second.a + second.b) / 2, across) / 2
    centre = along * (low + high) / 2 + across * middle
    return Opening(centre, along, float(high - low), depth, (first.faces, second.faces))


# ---------------------------------------------------------------------------------------------------------------------
# Pieces that close the door plane, as the straight strips they consist of.
# ---------------------------------------------------------------------------------------------------------------------

SHARES = np.array([[-0.3], [0.0], [0.3]])
"""Where along a face is looked, from its middle, in widths of the opening."""


def grow_to_overlap(pieces: list[Polygon]) -> list[Polygon]:
    """Return the pieces of one plane, grown a little, so that they meet the walls of the other."""
    return list(buffer_mitred(np.array(pieces, dtype=np.object_), LAP_M))


def split_into_strips(
    door: BaseGeometry, pieces: list[Opening], plane: BaseGeometry, rooms: list[Polygon]
) -> tuple[list[Opening], list[Opening]]:
    """Split each piece into its openings and the rest, in the ``plane`` that all of them close.

    A lintel and its cornice, or two lintels that meet in a corner, come as one piece. Each strip of it is judged for
    itself, and what hangs over one room only is removed from the plane.
    """
    found: list[Opening] = []
    rest: list[Opening] = []
    for piece, strips in zip(pieces, find_strips([p.polygon for p in pieces], rooms, plane, door), strict=True):
        laps = list(strips_of(strips, deeper_m=LAP_M, wider_m=LAP_M))
        found += [replace(s, polygon=lap, closed_by=piece.closed_by) for lap, s in zip(laps, strips, strict=True)]
        if piece.closed_by != "gate":  # the rest of a gate closes nothing by itself
            rest += [Opening.closing(p, piece.closed_by) for p in _without_strips(piece.polygon, laps)]
    if not rest:
        return found, []
    in_line = unite(strips_of(found, deeper_m=LAP_M, wider_m=AROUND_M))
    return found, [part for piece in rest for part in _divide_at_crossing(piece, in_line)]


def _without_strips(piece: Polygon, strips: list[Polygon]) -> list[Polygon]:
    left: BaseGeometry = piece
    for strip in strips:
        left = subtract(left, strip)
    # a hair wider: along an oblique cut, rounding would leave a crack between strip and rest
    rest = [part for part in polygons_of(left) if part.area > HAIR_M * HAIR_M]
    if not rest:
        return []
    slim = are_too_narrow(rest, LAP_M)  # what rounding leaves beside an oblique strip closes nothing
    return [polygons_of(buffer_mitred(p, HAIR_M))[0] for p, is_slim in zip(rest, slim, strict=True) if not is_slim]


def _divide_at_crossing(piece: Opening, in_line: BaseGeometry) -> list[Opening]:
    """Split a rest where beams cross: the part that goes on in line with an opening, and the parts beside that."""
    if not piece.polygon.intersects(in_line):
        return [piece]
    parts = polygons_of(intersect(piece.polygon, in_line)) + polygons_of(subtract(piece.polygon, in_line))
    return [Opening.closing(p, piece.closed_by) for p in parts]


def close_plane(door: BaseGeometry, candidates: Iterable[Opening]) -> BaseGeometry:
    """Return the door plane with these pieces in it."""
    return unite([door, *(c.polygon for c in candidates)])


def area_outside(plane: BaseGeometry) -> BaseGeometry:
    """Return the area outside a house, up to ``AROUND_M`` around its bounding box."""
    house = fill_enclosed(plane)
    return subtract(shapely.box(*shapely.bounds(house)).buffer(AROUND_M), house)


def assign_sides(candidates: list[Opening], rooms: list[Polygon], plane: BaseGeometry) -> list[Opening]:
    """Return the pieces with the ``sides`` of their openings in ``rooms``, looked up from three places at each face."""
    looks = [_before_faces(candidate) for candidate in candidates if candidate.is_strip]
    faces = locate_points(np.array(looks).reshape(-1, 2), rooms, plane).reshape(-1, 2, 3)
    found, k = [], 0
    for candidate in candidates:
        if not candidate.is_strip:
            found.append(candidate)
            continue
        sides = (_most_seen(faces[k, 0]), _most_seen(faces[k, 1]))
        blind = (faces[k] == WALL).all(axis=1)
        if candidate.closed_by in GAPS and blind.any():  # a gap before a wall (between two curtains) leads nowhere
            sides = (sides[int(blind[0])],) * 2
        found.append(candidate if sides == candidate.sides else replace(candidate, sides=sides))
        k += 1
    return found


def _before_faces(opening: Opening) -> npt.NDArray[np.float64]:
    """Three places (2, 3, 2) before each of the two faces of an opening."""
    off = opening.across * (opening.depth / 2 + 2 * CRACK_M)
    along = opening.centre + opening.along * opening.width * SHARES
    return np.array([along - off, along + off])


def _most_seen(faces: npt.NDArray[np.int64]) -> int:
    """Return the space seen most often; walls count only where nothing else is seen, and then as the outside."""
    seen = [face for face in faces.tolist() if face != WALL]
    return max(sorted(set(seen)), key=seen.count, default=OUTSIDE)
