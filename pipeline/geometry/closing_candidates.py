"""Find pieces that may close the door plane's openings or a room's mouths, and keep those that part two spaces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    OUTSIDE,
    WALL,
    OutlineCorners,
    Shapes,
    are_too_narrow,
    buffer_mitred,
    dot_product,
    drop_lines_and_points,
    drop_thin_parts,
    drop_thin_parts_of_each,
    enclosed_pieces,
    fill_enclosed,
    intersect,
    intersect_pairs,
    locate_points,
    polygons_of,
    subtract,
    trace_outlines,
    unite,
)
from pipeline.geometry.groups import Groups
from pipeline.geometry.openings import GAPS, Opening, find_strips, strips_of
from pipeline.tolerances import (
    AROUND_M,
    CM_M,
    CRACK_M,
    HAIR_M,
    HAND_M,
    LAP_M,
    MM_M,
    MOST,
    PARALLEL,
    SINGLE_DOOR_M,
    SLIVER_M,
    SOME,
    STAND_M,
    THICK_WALL_M,
    TWICE,
    WALL_M,
)

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
    """Take each piece apart into its openings and the rest of it, in the ``plane`` that all of them close.

    A lintel that goes over into a cornice, or two lintels that meet in a corner, come as one piece; each strip has to
    be judged for itself, and what hangs over one room only is freed.
    """
    found: list[Opening] = []
    rest: list[Opening] = []
    for piece, strips in zip(pieces, find_strips([p.polygon for p in pieces], rooms, plane, door), strict=True):
        laps = list(strips_of(strips, deeper_m=LAP_M, wider_m=LAP_M))
        found += [replace(s, polygon=lap, closed_by=piece.closed_by) for lap, s in zip(laps, strips, strict=True)]
        if piece.closed_by != "gate":  # of which nothing closes by itself
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
    """A rest where beams cross: what goes on in line with an opening, and what leads away from it."""
    if not piece.polygon.intersects(in_line):
        return [piece]
    parts = polygons_of(intersect(piece.polygon, in_line)) + polygons_of(subtract(piece.polygon, in_line))
    return [Opening.closing(p, piece.closed_by) for p in parts]


def minimal_separators(
    door: BaseGeometry,
    kept: list[Opening],
    pieces: list[Opening],
    plane: BaseGeometry,
    rooms: list[Polygon],
) -> list[Opening]:
    """Return those of ``pieces`` without which, beside ``kept``, spaces would run into each other.

    ``plane`` is the door plane with all of these in it, and ``rooms`` are what it encloses. The last piece is taken
    away first. Without it, all spaces and all pieces already taken away that it touches become one: it may go as long
    as that holds no two spaces, the outside being one of them.
    """
    spaces = [*rooms, area_outside(plane)]
    others = unite(candidate.polygon for candidate in kept)
    bare = [subtract(subtract(piece.polygon, door), others) for piece in pieces]
    shapes = [drop_lines_and_points(shape) for shape in drop_thin_parts_of_each(bare, 4 * HAIR_M)]
    grown = shapely.buffer(shapes, MM_M, join_style="mitre")
    n = len(pieces)
    meets: list[set[int]] = [set() for _ in pieces]  # pieces, and after them the spaces
    for k, space in _touching(grown, spaces):
        meets[k].add(n + space)
    for k, other in _touching(grown, shapes):
        meets[k].add(other)
        meets[other].add(k)
    groups, left = Groups(n + len(spaces)), set[int]()
    for k in range(n - 1, -1, -1):
        touched = [each for each in meets[k] if each >= n or (each > k and each not in left)]
        held = {groups.of(space) for space in range(n, n + len(spaces))} & {groups.of(each) for each in touched}
        if len(held) > 1:
            left.add(k)
            continue
        for each in touched:
            groups.join(k, each)
    return [pieces[k] for k in sorted(left)]


def close_plane(door: BaseGeometry, candidates: Iterable[Opening]) -> BaseGeometry:
    """Return the door plane with these pieces in it."""
    return unite([door, *(c.polygon for c in candidates)])


def area_outside(plane: BaseGeometry, wide_m: float = 1.0) -> BaseGeometry:
    """Return the air around a house, a metre of it or as wide as asked."""
    house = fill_enclosed(plane)
    return subtract(shapely.box(*shapely.bounds(house)).buffer(wide_m), house)


def _touching(grown: Shapes, others: Sequence[BaseGeometry]) -> list[tuple[int, int]]:
    """Return which of the grown pieces lie over which of the others for more than a point: pairs of indices."""
    tree = shapely.STRtree(others)
    pairs = tree.query(grown, predicate="intersects")
    shared = shapely.area(intersect_pairs(grown[pairs[0]], tree.geometries[pairs[1]]))
    return [(int(k), int(other)) for k, other in pairs.T[shared > MM_M * HAIR_M]]


def assign_sides(candidates: list[Opening], rooms: list[Polygon], plane: BaseGeometry) -> list[Opening]:
    """The same pieces, the sides of their openings looked up in ``rooms``: seen from three places along each face."""
    looks = [_before_faces(candidate) for candidate in candidates if candidate.is_strip]
    faces = locate_points(np.array(looks).reshape(-1, 2), rooms, plane).reshape(-1, 2, 3)
    found, k = [], 0
    for candidate in candidates:
        if not candidate.is_strip:
            found.append(candidate)
            continue
        sides = (_most_seen(faces[k, 0]), _most_seen(faces[k, 1]))
        blind = (faces[k] == WALL).all(axis=1)
        if candidate.closed_by in GAPS and blind.any():  # between a curtain and the next, before a wall: leads nowhere
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


# ---------------------------------------------------------------------------------------------------------------------
# Gaps of full height: where a wall ends and goes on, or meets another, after a step of free floor.
#
# Two planes never differ in such a gap, so it is found from the walls' ends: an end is a short edge of the wall's
# outline between two right angles; the gap is what lies between it and the wall that it points at.
#
# R1  Where that is the end of another wall, the gap is a hole in one wall. The two walls may stand a little aside of
#     each other, as those drawn by hand do.
# R2  Where it is a wall that crosses, the gap is as wide as a door with one leaf at most, or every wall that juts into
#     a corridor would part it in two.
# R3  A nib, too short to be told from a pilaster, is the end of a wall where another end or nib faces it in line.
# R4  A wall of two sheets, of which one ends a little before the other (``STAND_M``), ends where the longer one does.
# ---------------------------------------------------------------------------------------------------------------------

SQUARE_TURN = np.sin(np.deg2rad(25.0))


@dataclass(frozen=True, eq=False)
class WallEnd:
    """The short edge ``a`` to ``b`` (2,) at the end of a wall, and the unit vector ``out`` that points on from it.

    ``is_nib`` is True where it juts from a wall by less than a wall does that ends.
    """

    a: npt.NDArray[np.float64]
    b: npt.NDArray[np.float64]
    out: npt.NDArray[np.float64]
    is_nib: bool = False

    @property
    def centre(self) -> npt.NDArray[np.float64]:
        """The middle of the edge."""
        return np.asarray((self.a + self.b) / 2)

    def faces(self, other: WallEnd) -> bool:
        """Return whether two ends look at each other in one line, as those of one wall do."""
        aside = np.array([-self.out[1], self.out[0]])
        width, other_width = (np.hypot(*(end.b - end.a)) for end in (self, other))
        beside = abs(dot_product(other.centre - self.centre, aside))
        return bool(dot_product(other.out, self.out) < -PARALLEL and max(abs(width - other_width), beside) < STAND_M)

    def width_of(self, gap: Polygon) -> float:
        """Return how wide a gap before the end is, in metres: as far as it goes on from the end."""
        return float(np.ptp(dot_product(shapely.get_coordinates(gap), self.out)))


def wall_ends(walls: BaseGeometry, thickest_m: float = THICK_WALL_M, *, nibs: bool = False) -> Iterator[WallEnd]:
    """Every free end of a straight wall up to ``thickest_m``.

    With ``nibs`` also those that only what they face tells from pilasters.
    """
    parts = polygons_of(walls)
    if parts:
        yield from (end for end in _ends_of(trace_outlines(parts, LAP_M), thickest_m) if nibs or not end.is_nib)


def _ends_of(walls: OutlineCorners, thickest_m: float) -> Iterator[WallEnd]:
    """Yield all that looks like an end, ring by ring."""
    points, after, before = walls.points, walls.after, walls.before
    edge = points[after] - points
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    came = unit[before]
    turn = came[:, 0] * unit[:, 1] - came[:, 1] * unit[:, 0]
    square = turn > np.cos(np.arcsin(SQUARE_TURN))  # a left turn of about 90 degrees: convex, the wall on the left
    end = square & square[after] & (length <= thickest_m) & (np.minimum(length[before], length[after]) >= SLIVER_M)
    long = np.maximum(length[before], length[after]) >= TWICE * length
    juts = (turn[before] < 0) | (turn[after[after]] < 0)  # from a wall; a pillar stands free
    for k in np.flatnonzero(end & (long | juts)):
        out = np.array([unit[k, 1], -unit[k, 0]])
        yield WallEnd(points[k], points[after[k]], out, is_nib=not long[k])
    step, far = after, after[after]  # R4
    last = after[far]
    jog = (turn[step] * turn[far] < 0) & (
        np.minimum(np.abs(turn[step]), np.abs(turn[far])) > np.cos(np.arcsin(SQUARE_TURN))
    )
    jog &= square & square[last] & (length[step] < STAND_M) & ((unit * unit[far]).sum(axis=1) > PARALLEL)
    breadth = length + length[far]
    jog &= (breadth <= thickest_m) & (np.maximum(length[before], length[last]) >= TWICE * breadth)
    jog &= np.minimum(length[before], length[last]) >= SLIVER_M
    for k in np.flatnonzero(jog):
        out = np.array([unit[k, 1], -unit[k, 0]])
        a, b = points[k], points[last[k]]
        beyond = float(dot_product(b - a, out))
        yield WallEnd(a + max(beyond, 0.0) * out, b + max(-beyond, 0.0) * out, out)


def gap_beyond_wall_end(end: WallEnd, walls: BaseGeometry, reach_m: float) -> Polygon | None:
    """Return the rectangle from a wall's end to the wall it points at, or None if none stands within ``reach_m``.

    Where that wall ends right there, some of the end's breadth may point past it: what stands beyond is another wall.
    """
    aside = np.array([-end.out[1], end.out[0]]) * 0.01
    inner = (end.a + aside, end.b - aside) if dot_product(end.b - end.a, aside) > 0 else (end.a - aside, end.b + aside)
    points = np.array([*inner, (end.a + end.b) / 2])  # the other wall may stand a little aside
    rays = shapely.linestrings(np.stack([points + 1e-3 * end.out, points + reach_m * end.out], axis=1))
    parts = shapely.get_parts(walls)  # most of them lie far away, which is seen at once
    hits, pair = shapely.get_coordinates(shapely.intersection(rays[:, None], parts).ravel(), return_index=True)
    if not len(hits):
        return None
    ray = pair // len(parts)
    away = dot_product(hits - points[ray], end.out)
    far = [float(away[ray == k].min()) for k in np.unique(ray)]
    met = max(each for each in far if each < min(far) + THICK_WALL_M)
    step = end.out * (met + 0.01)  # a little into the wall that it meets, so that they touch
    back = end.out * -0.005
    return Polygon([end.a + back, end.b + back, end.b + step, end.a + step])


def gap_fillings(
    tall: BaseGeometry, standing: Sequence[BaseGeometry], reach_m: float, *, ends: list[WallEnd] | None = None
) -> list[Polygon]:
    """Fillings of all gaps of full height up to ``reach_m`` metres, shortest first.

    Parameters
    ----------
    tall
        Walls that stand from the floor to above head height; a gap lies between two of them.
    standing
        All that closes the plane; a gap that it fills already is none.
    ends
        The ``wall_ends`` with their nibs, if they are known already.
    """
    ends = list(wall_ends(tall, nibs=True)) if ends is None else ends
    if not ends:
        return []
    before = shapely.points([end.centre + CM_M * end.out for end in ends])
    taken = set(shapely.STRtree(standing).query(before, predicate="intersects")[0].tolist())
    found: list[Polygon] = []
    for k, end in enumerate(ends):
        if k in taken:
            continue
        gap = gap_beyond_wall_end(end, tall, reach_m)
        facing = _between_ends(gap or _strip_before_end(end, reach_m), end, ends, reach_m)
        if facing is not None:  # R1
            found.append(facing)
        elif gap is not None and end.width_of(gap) <= SINGLE_DOOR_M[1] and not end.is_nib:  # R2
            found.append(gap)
    found.sort(key=lambda g: (round(g.length, 6), g.bounds))
    return [found[k] for k in each_place_once(found)]


def each_place_once(found: Sequence[Polygon]) -> list[int]:
    """A gap between two ends is found from both; the first stands for what lies mostly in it. Return those kept."""
    kept: list[int] = []
    for k, gap in enumerate(found):
        if not any(intersect(gap, found[j]).area > MOST * min(gap.area, found[j].area) for j in kept):
            kept.append(k)
    return kept


def _strip_before_end(end: WallEnd, reach_m: float) -> Polygon:
    """Return the strip before a wall's end where nothing stands in its line."""
    return Polygon([end.a, end.b, end.b + reach_m * end.out, end.a + reach_m * end.out])


def _between_ends(gap: Polygon, end: WallEnd, ends: list[WallEnd], reach_m: float) -> Polygon | None:
    """The gap from a wall's end to that of one that comes the other way, or None if another wall crosses (R1, R3)."""
    near = shapely.buffer(gap, HAND_M, cap_style="square", join_style="mitre")
    found = []
    for other in ends:
        if dot_product(other.out, end.out) >= -PARALLEL:
            continue
        if not shapely.intersects(near, shapely.linestrings([other.a, other.b])):
            continue
        away = dot_product(other.centre - end.centre, end.out)
        if not 0 < away <= reach_m + CM_M:
            continue
        sure = end.faces(other) or not (end.is_nib or other.is_nib)  # R3
        if sure and (strip := _strip(end, other)) is not None:
            found.append(strip)
    return min(found, key=lambda strip: strip.length, default=None)


def _strip(end: WallEnd, other: WallEnd) -> Polygon | None:
    """The filling between two ends: where they overlap, or all that lies between them; None if they are apart (R1)."""
    aside = np.array([-end.out[1], end.out[0]])
    (a, b), (c, d) = (np.sort([dot_product(side, aside) for side in (each.a, each.b)]) for each in (end, other))
    low, high = max(a, c), min(b, d)
    if low - high > HAND_M:
        return None
    if high - low < SOME * min(b - a, d - c):
        low, high = min(a, c), max(b, d)
    start = min(dot_product(end.a, end.out), dot_product(end.b, end.out)) - 0.005
    stop = max(dot_product(other.a, end.out), dot_product(other.b, end.out)) + 0.01
    corners = [(start, low), (stop, low), (stop, high), (start, high)]
    return Polygon([step * end.out + side * aside for step, side in corners])


def crack_fillings(walls: BaseGeometry) -> list[Polygon]:
    """Fillings of the cracks between walls that nearly meet, in a corner for the most part: no hand goes through.

    A crack is what a disc with the radius of ``HAND_M`` cannot enter, and no longer than a wall is thick: a slit
    between two walls is another thing. It is open on two sides; the corner of a room is on one. So walls that are
    grown by ``HAND_M`` close a crack: they join two walls, or part a space in two. Most houses have none.
    """
    grown = shapely.buffer(walls, HAND_M, quad_segs=4)
    if not _joins_or_parts(grown, walls):
        return []
    whole = shapely.buffer(grown, -HAND_M, quad_segs=4)
    pieces = polygons_of(drop_thin_parts(subtract(whole, walls), LAP_M))
    small = [p for p in pieces if max(p.bounds[2] - p.bounds[0], p.bounds[3] - p.bounds[1]) <= WALL_M]
    if not small:
        return []
    along = shapely.buffer(walls, MM_M, quad_segs=1)
    parts = np.array(polygons_of(along), dtype=np.object_)
    of_piece, of_part = shapely.STRtree(parts).query(small, predicate="intersects")
    near = [shapely.multipolygons(parts[of_part[of_piece == k]]) for k in range(len(small))]
    bare = shapely.difference([piece.exterior for piece in small], near)
    sides = [len(shapely.get_parts(shapely.line_merge(edge))) for edge in bare]
    return grow_to_overlap([piece for piece, count in zip(small, sides, strict=True) if count > 1])


def _joins_or_parts(grown: BaseGeometry, walls: BaseGeometry) -> bool:
    """Return whether walls, grown, join some that stand apart, or leave two places of one space or of the outside."""
    parts, left = polygons_of(walls), polygons_of(grown)
    if len(parts) != len(left):
        return True
    spaces = [Polygon(ring) for part in parts for ring in part.interiors]
    places = [ring.coords[0] for part in left for ring in part.interiors]
    if not places:
        return False
    place, space = shapely.STRtree(spaces).query(shapely.points(places), predicate="intersects")
    return not len(place) == len(places) == len(set(space.tolist()))


def contact_fillings(walls: BaseGeometry) -> list[Polygon]:
    """Fillings of the places where walls touch in a point, or less than ``MM_M`` apart, and that part two spaces.

    Walls that are cells of a map touch corner to corner; rounding decides whether they do.
    """
    narrow = shapely.buffer(walls, MM_M / 2, quad_segs=1)
    if not _joins_or_parts(narrow, walls):
        return []
    free = enclosed_pieces(walls)[1]
    spaces = [*enclosed_pieces(narrow)[1], area_outside(narrow)]
    inside = [shapely.points(space.representative_point().coords[0]) for space in spaces]
    homes = [next((k for k, piece in enumerate(free) if piece.contains(point)), OUTSIDE) for point in inside]
    parted = [(a, b) for a, b in combinations(range(len(spaces)), 2) if homes[a] == homes[b]]
    meet = [shapely.intersection(*shapely.buffer([spaces[a], spaces[b]], MM_M)) for a, b in parted]
    places = shapely.centroid(shapely.get_parts(meet))
    places = places[~shapely.contains(buffer_mitred(walls, -HAIR_M), places)]  # there the wall is thin, and no more
    return polygons_of(unite(shapely.buffer(places, CRACK_M / 2, cap_style="square")))
