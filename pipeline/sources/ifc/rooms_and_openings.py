"""Find the rooms and openings of an IFC level as plan polygons, from the bodies of its spaces, doors and holes.

**Rooms**, from IfcSpaces.

R1  A room is where its space stands on the floor.
R2  A space less than head high, or named as lying outside, is not a room. A space without a storey belongs to the level
    on whose floor it stands.
R3  Of two spaces with one footprint the first stays, with the words of both.
R4  A space that others fill (a flat, a storey's gross area) is not a room. A space within another is cut out of it.
R5  Spaces that stand together, apart from every wall of the level, are not rooms if the level's other spaces stand at
    its walls (a schedule of rooms beside the house).

**Direction of the wall** at a hole.

D1  The wall runs along the side of the body at both of whose ends something stands, if nothing stands at an end of the
    other side: a body may be deeper than it is wide. Otherwise it runs along the longer side.

**Openings**: each is a rectangle along its wall, through the whole wall.

H1  An opening's body may be shallower or much deeper than the wall: its rectangle runs through all that stands there as
    one wall (leaves of a cavity wall, linings), and no farther.
H2  A hole without a door is not an opening if it does not reach through its wall (a niche), starts above the knee or
    ends below the head (a hatch), or is narrow (a duct).
H3  A door belongs to the highest level from which it can be reached, a step or half a storey up, whichever storey holds
    it. A door that lies flat (a hatch in a floor) belongs to no level.
H4  Holes that overlap (one in each leaf of a wall) are one opening, with a door if one of them has a door. Doors that
    stand jamb to jamb in one line (the leaves of a double door, each an element of its own) are one opening too.
H5  A hole that a window fills, or that starts above the knee and is not a niche, is wall in a plan. A window that
    starts below the knee is wall from the floor to the top of its wall, or its frame would be taken for a door's. A
    body deeper than any wall, such as a corner window's, closes only the part of its own wall inside it.
H6  If a door's hole lies right before its wall, at most its own depth away (an exporter flipped the wall without its
    holes), it goes through that wall. So does a door without a hole that stands at the face of a wall.
H7  A door without a hole that stands free but for one end, in the middle of a wall, was written a quarter turn
    wrong: it goes through that wall there. On which side of its end it was meant to lie is not known.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.sources.ifc.model import ElementBody, WallHole
from pipeline.sources.roles import is_attic_space, labels_for
from pipeline.sources.tolerances import LOWEST_HEAD_M, STOREYS_APART_M, TINY, WAIST_M
from pipeline.tolerances import (
    ALMOST_ALL,
    FOOT_M,
    HAND_M,
    HEAD_M,
    KNEE_M,
    LAP_M,
    MM_M,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PASSABLE_M,
    SOME,
    SPECK_M2,
    STAND_M,
    THICK_WALL_M,
)
from pipeline.values import Mesh, Opening, SourceRoom


def merge_parts(parts: Iterable[ElementBody]) -> Mesh:
    """Put the parts' triangles into one mesh."""
    meshes = [part.mesh for part in parts]
    if not meshes:
        return Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), faces)


def extrude_rectangle(rectangle: Polygon, low: float, high: float) -> Mesh:
    """A plan rectangle from one height to another as a closed body."""
    ring = shapely.get_coordinates(shapely.orient_polygons(rectangle))[:4]
    points = np.concatenate([np.column_stack([ring, np.full(4, z)]) for z in (low, high)])
    sides = [face for k in range(4) for face in ((k, (k + 1) % 4, k + 4), ((k + 1) % 4, (k + 1) % 4 + 4, k + 4))]
    return Mesh(points, np.array([(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), *sides], np.int64))


def project_to_plan(mesh: Mesh) -> BaseGeometry:
    """Plan shadow of a body, all pieces."""
    return _union(mesh.vertices[mesh.faces])


def largest_footprint(mesh: Mesh) -> Polygon:
    """Plan shadow of a body, its largest piece; empty where it has none."""
    return _largest(project_to_plan(mesh))


def standing_area(mesh: Mesh) -> Polygon:
    """Return where a body stands on its floor: its flat lowest faces, its shadow where it has none; the largest piece.

    A room whose walls lean outwards is smaller on its floor than its shadow.
    """
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    # the floor of a space may have a step
    low = triangles[:, :, 2].max(axis=1) < mesh.vertices[:, 2].min() + FOOT_M
    # within 26 degrees
    flat = low & (np.abs(normals[:, 2]) > NEARLY_ALL * np.maximum(lengths, TINY))
    whole, floor = largest_footprint(mesh), _largest(_union(triangles[flat]))
    # flat faces that cover less of a space's shadow are no floor
    return floor if floor.area >= SOME * whole.area else whole


def _union(triangles: npt.NDArray[np.float64]) -> BaseGeometry:
    """Unite plan shadows of triangles (k, 3, 3); rounding before, not after, since slivers that vanish leave cracks."""
    shapes = shapely.polygons(np.round(triangles[:, :, :2], 6))
    whole = shapely.union_all(shapes[shapely.area(shapes) > TINY])
    if isinstance(whole, Polygon):
        return whole
    # the parts of one body that are closer than twice this are one
    return whole.buffer(MM_M, join_style="mitre").buffer(-MM_M, join_style="mitre")


def _largest(shape: BaseGeometry) -> Polygon:
    pieces = [piece for piece in shapely.get_parts(shape) if isinstance(piece, Polygon)]
    return max(pieces, key=lambda piece: piece.area, default=Polygon())


def are_same_area(one: Polygon, other: Polygon, iou: float) -> bool:
    """Return whether the intersection of two areas over their union is more than ``iou``."""
    shared = one.intersection(other).area
    return bool(shared > iou * (one.area + other.area - shared))


@dataclass(frozen=True, eq=False)
class _Found:
    words: tuple[str, ...]
    shape: Polygon


def is_room(space: ElementBody) -> bool:
    """Return whether a space is head high and not named as lying outside."""
    return space.top - space.bottom >= HEAD_M and not is_attic_space(space.words)


def find_rooms(spaces: Sequence[ElementBody], walls: WallFootprints) -> tuple[SourceRoom, ...]:
    """Return the rooms of a level in the order of the file, in project axes."""
    found = [_Found(space.words, standing_area(space.mesh)) for space in spaces if is_room(space)]
    found = _without_overlaps(_without_groups(_without_doubles([each for each in found if not each.shape.is_empty])))
    found = _at_walls(found, walls)
    return tuple(SourceRoom(each.words, labels_for(each.words), each.shape) for each in found)


def _at_walls(found: list[_Found], walls: WallFootprints) -> list[_Found]:
    """Return the rooms that stand at walls; all of them if no room does."""
    shapes = [each.shape.buffer(THICK_WALL_M / 2, join_style="mitre") for each in found]
    groups = [group for group in shapely.get_parts(shapely.union_all(shapes)) if walls.reach(group)]
    kept = [each for each in found if any(each.shape.intersects(group) for group in groups)]
    return kept or found


def _without_doubles(found: list[_Found]) -> list[_Found]:
    """Keep the first of two spaces with one footprint, with the words of both."""
    kept: list[_Found] = []
    for each in found:
        # two spaces that share nearly all are one
        at = next((k for k, other in enumerate(kept) if are_same_area(each.shape, other.shape, NEARLY_ALL)), None)
        if at is None:
            kept.append(each)
        else:
            kept[at] = replace(kept[at], words=tuple(dict.fromkeys((*kept[at].words, *each.words))))
    return kept


def _without_groups(found: list[_Found]) -> list[_Found]:
    """Leave groups out: two rooms or more that lie in a space fill it (R4)."""
    kept = []
    for each in found:
        inner = [o.shape for o in found if o is not each and _is_within(o.shape, each.shape)]
        covered = shapely.union_all(inner).intersection(each.shape).area if len(inner) > 1 else 0.0
        if covered < MOSTLY * each.shape.area:  # else it only groups others
            kept.append(each)
    return kept


def _without_overlaps(found: list[_Found]) -> list[_Found]:
    """Cut spaces out of those that they lie within (R4)."""
    kept = []
    for each in found:
        inner = [o.shape for o in found if o is not each and _is_within(o.shape, each.shape)]
        shape = each.shape.difference(shapely.union_all(inner)) if inner else each.shape
        pieces = [piece for piece in shapely.get_parts(shape) if isinstance(piece, Polygon)]
        if pieces:
            kept.append(replace(each, shape=max(pieces, key=lambda piece: piece.area)))
    return kept


def _is_within(small: Polygon, large: Polygon) -> bool:
    if small.area >= large.area:
        return False
    shared = small.intersection(large).area
    return bool(shared > SPECK_M2 and shared > ALMOST_ALL * small.area)


@dataclass(frozen=True)
class PlanDirection:
    """A unit direction in plan."""

    x: float
    y: float

    def quarter_turn(self) -> PlanDirection:
        """Return the direction a quarter turn to the left."""
        return PlanDirection(-self.y, self.x)

    def span(self, points: npt.NDArray[np.float64]) -> tuple[float, float]:
        """From where to where points (n, 2) reach along the axis."""
        places = points @ (self.x, self.y)
        return float(places.min()), float(places.max())

    def box(self, along: tuple[float, float], across: tuple[float, float]) -> Polygon:
        """Return the rectangle of these spans along the axis and across it."""
        u, v = np.array((self.x, self.y)), np.array((-self.y, self.x))
        return Polygon([u * a + v * c for a, c in zip((*along, *along[::-1]), np.repeat(across, 2), strict=True)])


def wall_direction(hole: WallHole, standing: BaseGeometry) -> PlanDirection:
    """Return the direction of the wall at a hole; ``standing`` is the plan shape of the walls about it."""
    points = hole.mesh.vertices[:, :2]
    one = _side(hole)
    sides = (one, one.quarter_turn())
    lengths = [float(np.ptp(side.span(points))) for side in sides]
    held = [_is_held(side, points, standing) for side in sides]  # D1
    if held[0] != held[1]:
        return sides[held.index(True)]
    return sides[lengths.index(max(lengths))]


def _is_held(side: PlanDirection, points: npt.NDArray[np.float64], standing: BaseGeometry) -> bool:
    """D1: whether something stands right before and right behind a body along a direction."""
    (low, high), across = side.span(points), side.quarter_turn().span(points)
    strips = ((low - HAND_M, low), (high, high + HAND_M))
    return all(standing.intersection(side.box(strip, across)).area > TINY for strip in strips)


def _side(hole: WallHole) -> PlanDirection:
    """Return the direction of a side of the hole's body: its door's own if it has one, else the least rectangle's."""
    shape = shapely.oriented_envelope(largest_footprint(hole.mesh))
    if hole.along and (hole.host is None or not isinstance(shape, Polygon)):
        length = float(np.hypot(*hole.along))
        return PlanDirection(hole.along[0] / length, hole.along[1] / length)
    if not isinstance(shape, Polygon) or shape.is_empty:
        return PlanDirection(1.0, 0.0)
    corners = np.asarray(shape.exterior.coords)
    side = (corners[1] - corners[0]) / max(float(np.hypot(*(corners[1] - corners[0]))), TINY)
    return PlanDirection(float(side[0]), float(side[1]))


Span = tuple[float, float]


@dataclass(frozen=True)
class _Place:
    """Where a hole lies: the wall's direction, and the hole's spans along it and across it."""

    axis: PlanDirection
    along: Span
    across: Span


class WallFootprints:
    """The walls' plan shadows, made where a hole asks for them."""

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        self._meshes = meshes
        corners = [(*mesh.vertices.min(axis=0), *mesh.vertices.max(axis=0)) for mesh in meshes]
        self._boxes = np.array(corners, np.float64).reshape(-1, 6)
        self._shadows: dict[int, BaseGeometry] = {}

    def near(self, mesh: Mesh) -> BaseGeometry:
        """Return what stands about a body, as one plan shape."""
        # the wall may go on so far beyond a hole
        low, high = mesh.vertices.min(axis=0) - THICK_WALL_M, mesh.vertices.max(axis=0) + THICK_WALL_M
        touching = (self._boxes[:, :3] <= high).all(axis=1) & (self._boxes[:, 3:] >= low).all(axis=1)
        return shapely.union_all([self._shadow(int(k)) for k in np.flatnonzero(touching)])

    def reach(self, shape: BaseGeometry) -> bool:
        """Return whether any of the walls reaches a plan shape."""
        x1, y1, x2, y2 = shape.bounds
        touching = (self._boxes[:, :2] <= (x2, y2)).all(axis=1) & (self._boxes[:, 3:5] >= (x1, y1)).all(axis=1)
        return any(shape.intersects(self._shadow(int(k))) for k in np.flatnonzero(touching))

    def _shadow(self, k: int) -> BaseGeometry:
        if k not in self._shadows:
            self._shadows[k] = project_to_plan(self._meshes[k])
        return self._shadows[k]


def openings_of_level(
    holes: Sequence[WallHole], walls: WallFootprints, floor: float, floors: Sequence[float]
) -> tuple[Opening, ...]:
    """Return the openings of the level at ``floor`` (one of ``floors``), in project axes."""
    here = [hole for hole in holes if _is_of(hole, floor, floors)]
    # through a narrower hole without a door go pipes
    return tuple(_merge_openings([found for hole in here if (found := _opening(hole, walls, PASSABLE_M)) is not None]))


def find_windows(
    windows: Sequence[WallHole], holes: Sequence[WallHole], walls: WallFootprints, low: float, high: float
) -> tuple[list[Mesh], list[Opening]]:
    """H5: for each such hole of a storey, from its floor at ``low`` up to ``high``, a body as deep as the wall.

    The second list are those that windows fill, and that lie in this storey for the most part or as high as a knee,
    with heights above the floor.
    """
    unfilled = [hole for hole in holes if not hole.has_door and hole.bottom >= low + KNEE_M]
    panes: list[Mesh] = []
    found: list[Opening] = []
    for k, hole in enumerate((*windows, *unfilled)):
        if hole.bottom < high and hole.top > low + KNEE_M:
            shapes, across = _in_wall(hole), np.zeros(2)
            # an opening is at least this deep, however thin its wall is
            if not shapes and (opening := _opening(hole, walls, HAND_M, skin_m=0.0)):
                shapes = [opening.polygon]
                across = np.diff(shapely.get_coordinates(opening.polygon)[1:3], axis=0)[0]
            panes += [extrude_rectangle(shape, *_closed_span(hole, low, high)) for shape in shapes]
            sill, head = max(hole.bottom, low), min(hole.top, high)
            if k < len(windows) and head - sill >= min(KNEE_M, MOST * (hole.top - hole.bottom)):
                found += [Opening.window(shape, (sill - low, head - low), across) for shape in shapes]
    return panes, found


def _in_wall(hole: WallHole) -> list[Polygon]:
    """H5: return the part of a hole's body in its wall, for a body deeper than any wall; empty without a wall there."""
    body = largest_footprint(hole.mesh)
    shorter = min(_sides(body))
    if hole.host is None or shorter <= THICK_WALL_M:
        return []
    found = []
    for piece in shapely.get_parts(body.intersection(project_to_plan(hole.host))):
        thin, long = sorted(_sides(piece))
        if TINY < thin <= THICK_WALL_M and long >= MOST * shorter:
            found.append(shapely.oriented_envelope(piece))
    return found


def _sides(shape: BaseGeometry) -> tuple[float, float]:
    """Return the sides of the smallest rectangle around a shape, metres; 0 where it has no area."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(shape))[:3]
    if len(corners) < 3:
        return 0.0, 0.0
    one, other = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return float(one), float(other)


def _closed_span(hole: WallHole, low: float, high: float) -> Span:
    """H5: from where to where the body reaches that closes a hole."""
    if hole.bottom >= low + KNEE_M or hole.host is None:
        return hole.bottom, hole.top
    top = float(hole.host.vertices[:, 2].max())
    return min(hole.bottom, low), max(hole.top, min(top, high))


def door_level_height(sill: float, floors: Sequence[float]) -> float | None:
    """H3: the height of the level from which people enter a door that starts at ``sill``, or None."""
    # a door's sill lies lower over its floor than a storey
    below = [floor for floor in floors if floor <= sill + KNEE_M and sill - floor <= STOREYS_APART_M]
    return max(below, default=None)


def _is_of(hole: WallHole, floor: float, floors: Sequence[float]) -> bool:
    """H2, H3."""
    if hole.has_door:
        # lower doors are hatches
        return hole.top - hole.bottom >= WAIST_M and door_level_height(hole.bottom, floors) == floor
    return hole.bottom < floor + KNEE_M and hole.top > floor + LOWEST_HEAD_M


# walls of IFC are bodies: a cut must leave no film
def _opening(hole: WallHole, walls: WallFootprints, least_m: float, skin_m: float = LAP_M) -> Opening | None:
    """H1: return the opening; None for a niche, and for a hole without a door narrower than ``least_m`` (H2)."""
    standing = walls.near(hole.mesh)
    place = _turned_into_wall(hole, standing) or _place_along(wall_direction(hole, standing), hole)
    along, across = place.along, place.across
    # a body so much wider than its door has the leaf drawn open
    if hole.host is None and hole.width_m and along[1] - along[0] > hole.width_m + HAND_M:
        middle = (along[0] + along[1]) / 2
        along = middle - hole.width_m / 2, middle + hole.width_m / 2
    if along[1] - along[0] < (HAND_M if hole.has_door else least_m):
        return None
    place = replace(place, along=along)
    host = standing if hole.host is None else project_to_plan(hole.host)
    if not hole.has_door and _is_niche(place, host):
        if _over(place, host) or _stands_behind(place, host):
            return None
        depth = across  # it is as wide as the way, and what stands at its sides are the walls along this
    else:
        depth = _over(place, standing) or _beside(place, host) or _before(place, hole, host) or across
    thin = max((HAND_M - (depth[1] - depth[0])) / 2, skin_m)
    return Opening.named(place.axis.box(along, (depth[0] - thin, depth[1] + thin)), hole.has_door)


def _place_along(axis: PlanDirection, hole: WallHole) -> _Place:
    points = hole.mesh.vertices[:, :2]
    return _Place(axis, axis.span(points), axis.quarter_turn().span(points))


def _turned_into_wall(hole: WallHole, standing: BaseGeometry) -> _Place | None:
    """H7: return where a door lies in the wall in which it has one end, None if it stands in a wall, or in none."""
    if not hole.has_door or hole.host is not None:
        return None
    side = _side(hole)
    place = max((_place_along(each, hole) for each in (side, side.quarter_turn())), key=lambda each: np.ptp(each.along))
    (low, high), (near, far) = place.along, place.across
    half, middle, turned = (high - low) / 2, (near + far) / 2, place.axis.quarter_turn()
    if far - near > half:
        return None
    for end, rest in ((low, (high - half, high)), (high, (low, low + half))):
        if standing.intersection(place.axis.box(rest, (near - HAND_M, far + HAND_M))).area > TINY:
            continue
        # across the turned axis, the door's own runs backwards
        across = _Place(turned, (middle - half, middle + half), (-end - STAND_M, -end + STAND_M))
        depth = _over(across, standing)
        if depth is not None and depth[1] - depth[0] <= THICK_WALL_M:
            wall = turned.box(across.along, depth)
            if standing.intersection(wall).area > NEARLY_ALL * wall.area:
                return across
    return None


def _is_niche(place: _Place, wall: BaseGeometry) -> bool:
    """H2."""
    depth = _over(place, wall) or _beside(place, wall) or place.across
    # what is left of a wall behind a niche
    return depth[0] < place.across[0] - STAND_M or depth[1] > place.across[1] + STAND_M


def _stands_behind(place: _Place, wall: BaseGeometry) -> bool:
    """Tell whether the wall goes on right behind a hole, on one of its two sides."""
    (low, high), (near, far) = place.along, place.across
    tenth = (high - low) / 10
    sides = ((near - HAND_M, near), (far, far + HAND_M))
    return any(wall.intersection(place.axis.box((low + tenth, high - tenth), side)).area > TINY for side in sides)


def _over(place: _Place, standing: BaseGeometry) -> Span | None:
    """From where to where something stands over or under a hole; None under the open sky."""
    tenth = (place.along[1] - place.along[0]) / 10
    return _standing_at(place, (place.along[0] + tenth, place.along[1] - tenth), standing)


def _beside(place: _Place, standing: BaseGeometry) -> Span | None:
    """From where to where the wall stands on both sides of a hole: what meets it there on one side is another wall."""
    low, high = place.along
    strips = ((low - HAND_M, low - HAND_M / 4), (high + HAND_M / 4, high + HAND_M))
    found = [span for strip in strips if (span := _standing_at(place, strip, standing))]
    common = max((span[0] for span in found), default=0.0), min((span[1] for span in found), default=0.0)
    if common[0] < common[1]:
        return common
    return min(found, key=lambda span: span[1] - span[0], default=None)


def _before(place: _Place, hole: WallHole, host: BaseGeometry) -> Span | None:
    """H6."""
    near, far = place.across
    if not hole.has_door or far - near > THICK_WALL_M:
        return None
    return _over(replace(place, across=(2 * near - far, 2 * far - near)), host)


def _standing_at(place: _Place, strip: Span, standing: BaseGeometry) -> Span | None:
    """Spans of what stands in a strip across the wall that touch the hole, as one, with the leaves right behind."""
    across = place.across
    reach = across[0] - THICK_WALL_M, across[1] + THICK_WALL_M
    pieces = shapely.get_parts(standing.intersection(place.axis.box(strip, reach)))
    turned = place.axis.quarter_turn()
    spans = sorted(turned.span(shapely.get_coordinates(piece)) for piece in pieces if piece.area > 0)
    touching = [span for span in spans if span[0] < across[1] and span[1] > across[0]]
    if not touching:
        return None
    low, high = min(span[0] for span in touching), max(span[1] for span in touching)
    for span in spans:
        if span[0] <= high + HAND_M:
            high = max(high, span[1]) if span[1] > low else high
    for span in reversed(spans):
        if span[1] >= low - HAND_M and span[0] < high:
            low = min(low, span[0])
    return low, high


def _are_one_way(one: Opening, other: Opening) -> bool:
    """H4."""
    if are_same_area(one.polygon, other.polygon, MOST):  # two holes that share most are one
        return True
    if not (one.has_door and other.has_door) or one.polygon.distance(other.polygon) > MM_M:
        return False
    both = shapely.oriented_envelope(one.polygon.union(other.polygon))
    return bool(one.polygon.area + other.polygon.area > NEARLY_ALL * both.area)


def _merge_openings(found: list[Opening]) -> Iterator[Opening]:
    """H4."""
    kept: list[Opening] = []
    for each in found:
        at = next((k for k, other in enumerate(kept) if _are_one_way(each, other)), None)
        if at is None:
            kept.append(each)
        else:
            both = shapely.oriented_envelope(each.polygon.union(kept[at].polygon))
            kept[at] = Opening.named(both, each.has_door or kept[at].has_door)
    yield from kept
