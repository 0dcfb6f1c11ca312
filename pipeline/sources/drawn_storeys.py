"""Build a storey's wall mesh, floor and passages from plan polygons of walls, holes and rooms, for readers of drawings.

The level frame: metres, x right, y up in the plan, z above the floor. What is drawn is cut by the stages like any mesh.

R1  A hole that starts at the knee or lower and ends above a person's head is a passage, unless the source says that it
    is a window. The others are windows, through which nobody goes: the wall stands there as if they were not.
R2  A passage takes its part out of every wall that it crosses; what is under it (a sill) and over it (a lintel) stays.
R3  Walls of the same two heights are united first, so that a wall drawn once for each of its two rooms stands once.
R4  A drawn room without walls or other rooms around it is open air: a terrace, a garden.
R5  If rooms are drawn as areas, the space between them and the walls is wall where it is narrower than THICK_WALL_M;
    wider space is a room that nobody drew. But if a wall ends between two rooms and leaves a way without a door or
    window, this is a passage (``geometry.wall_gaps``).
R6  If rooms are drawn between the walls, and not over them, a wall that reaches into a room, deeper than HAND_M, ends
    at the room's edge. A wall with a hole stays whole: drawings differ in how far a room goes into a door.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import Shapes, buffer_mitred, clip_to_box, drop_thin_parts, polygons_of
from pipeline.geometry.meshes import Mesh
from pipeline.geometry.prisms import Prism, Prisms, WallsWithOpenings
from pipeline.geometry.wall_gaps import find_doorless_openings
from pipeline.sources.tolerances import DEEPEST_WALL_M, FILE_GRID_M, LINE_WALL_M, LOWEST_HEAD_M, STOREYS_APART_M, TINY
from pipeline.tolerances import (
    BESIDE_M,
    CRACK_M,
    HAND_M,
    HARDLY,
    KNEE_M,
    MM_M,
    MOSTLY,
    SAME,
    SPECK_M2,
    THICK_WALL_M,
    THIRD,
    WALL_M,
)
from pipeline.values import Opening, SourceRoom


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall's shape in plan, and the heights between which it stands."""

    shape: Polygon
    bottom_m: float
    top_m: float


@dataclass(frozen=True, eq=False)
class Hole:
    """A hole through walls: its shape in plan covers the walls' thickness; open between two heights.

    ``across`` is the unit direction of the way through it; (0, 0) if not needed. ``is_window`` is True if the source
    says that it is not a way.
    """

    shape: Polygon
    bottom_m: float
    top_m: float
    has_door: bool = False
    across: tuple[float, float] = (0.0, 0.0)
    is_window: bool = False

    @property
    def is_passage(self) -> bool:
        """Whether one can walk through: it starts at the knee or lower and ends above a person's head."""
        return not self.is_window and self.bottom_m <= KNEE_M and self.top_m >= LOWEST_HEAD_M


def wall_prisms(walls: Iterable[Wall], holes: Sequence[Hole], *, filled_to_m: float | None = None) -> Prisms:
    """Return the walls with their holes as upright bodies.

    ``filled_to_m`` is the height up to which a wall stands in a passage for which the drawing leaves a gap in the wall.
    """
    given, passages = list(walls), [hole for hole in holes if hole.is_passage]
    fillings = [] if filled_to_m is None else [Wall(hole.shape, 0.0, filled_to_m) for hole in passages]
    drawn, filled = _courses(given), _courses([*given, *fillings])
    (bottom, top), *others = drawn or [(0.0, 0.0)]
    crossed = all(hole.bottom_m < top and hole.top_m > bottom for hole in passages)
    if bottom != 0.0 or others or drawn.keys() != filled.keys() or not crossed:
        return Prisms(_bodies(filled, passages))
    shapes = drawn[bottom, top]
    whole = shapes[0] if len(shapes) == 1 else shapely.union_all(shapes, grid_size=FILE_GRID_M)
    # a hole reaches beyond the faces of its wall, which rounding may have moved; stages close 2 mm
    grown = shapely.buffer([hole.shape for hole in passages], MM_M, join_style="mitre")
    standing = shapely.difference(whole, shapely.union_all(grown))  # all fillings lie in passages
    return WallsWithOpenings(standing, (hole.shape for hole in passages), top, partial(_bodies, filled, passages))


Courses = dict[tuple[float, float], list[Polygon]]
"""Shapes of walls by the two heights between which they stand."""


def _courses(walls: Iterable[Wall]) -> Courses:
    courses: Courses = {}
    for wall in walls:
        courses.setdefault((round(wall.bottom_m, 4), round(wall.top_m, 4)), []).append(wall.shape)
    return courses


def _bodies(courses: Courses, passages: Sequence[Hole]) -> list[Prism]:
    """Return the walls as prisms: a passage takes its part out of each, but for its sill and its lintel."""
    parts = []
    for (bottom, top), shapes in sorted(courses.items()):
        whole = shapely.union_all(shapes, grid_size=FILE_GRID_M)  # R3
        across = [hole for hole in passages if hole.bottom_m < top and hole.top_m > bottom]
        grown = shapely.buffer([hole.shape for hole in across], MM_M, join_style="mitre")
        parts.append(Prism(shapely.difference(whole, shapely.union_all(grown)), bottom, top))
        for hole, shape in zip(across, _walls_in(whole, grown), strict=True):
            parts += [Prism(shape, bottom, hole.bottom_m), Prism(shape, hole.top_m, top)]
    return parts


def _walls_in(walls: BaseGeometry, places: Shapes) -> list[BaseGeometry]:
    """Return the part of the walls in each place (n,); quick where most of the walls are far from each place."""
    pieces = shapely.get_parts(walls)
    place, piece = shapely.STRtree(pieces).query(places, predicate="intersects")
    shared = shapely.intersection(pieces[piece], places[place])
    found = [shared[place == k] for k in range(len(places))]
    return [each[0] if len(each) == 1 else shapely.union_all(each) for each in found]


def wall_mesh(walls: Iterable[Wall], holes: Sequence[Hole]) -> Mesh:
    """Return the walls with their holes as triangles."""
    made = wall_prisms(walls, holes)
    return Mesh(made.vertices, made.faces)


def passage_openings(holes: Iterable[Hole]) -> tuple[Opening, ...]:
    """Return the passages among the holes, as the stages want them."""
    return tuple(Opening.named(hole.shape, hole.has_door) for hole in holes if hole.is_passage)


def openings_of_windows(holes: Iterable[Hole]) -> tuple[Opening, ...]:
    """Return the windows among the holes (R1), for the plan."""
    windows = [hole for hole in holes if (hole.is_window or hole.bottom_m > KNEE_M) and hole.shape.area > SAME]
    return tuple(Opening.window(each.shape, (each.bottom_m, each.top_m), np.array(each.across)) for each in windows)


def unite_rooms(shapes: Iterable[Polygon]) -> Polygon | MultiPolygon | None:
    """Return the area that rooms cover together, or None without rooms."""
    area = shapely.union_all(list(shapes), grid_size=FILE_GRID_M)
    return area if isinstance(area, Polygon | MultiPolygon) and not area.is_empty else None


def drop_outdoor_rooms(rooms: Sequence[SourceRoom], walls: Sequence[Wall]) -> tuple[SourceRoom, ...]:
    """Return the rooms but those whose edge is open for more than HARDLY of its length."""
    shapes = [room.polygon for room in rooms if room.polygon is not None]
    # a wall or room so near is beside it
    near = shapely.buffer(shapely.union_all([wall.shape for wall in walls]), BESIDE_M)
    kept = []
    for room in rooms:
        if room.polygon is not None:
            others = shapely.union_all([shape for shape in shapes if shape is not room.polygon])
            edge = shapely.difference(room.polygon.exterior, shapely.union(near, shapely.buffer(others, BESIDE_M)))
            # a room is open air where more of its edge has neither walls nor rooms beside it
            if edge.length > HARDLY * room.polygon.exterior.length:
                continue
        kept.append(room)
    return tuple(kept)


def subtract_rooms_from_walls(rooms: Sequence[SourceRoom], walls: Sequence[Wall], holes: Sequence[Hole]) -> list[Wall]:
    """Return the walls without their parts in rooms; unchanged if rooms are drawn over the walls."""
    shapes = [room.polygon for room in rooms if room.polygon is not None]
    area, standing_ = shapely.union_all(shapes), shapely.union_all([wall.shape for wall in walls])
    if shapely.intersection(area, standing_).area > THIRD * standing_.area:
        return list(walls)
    # a wall that reaches deeper into a room ends at the room's edge
    deep = shapely.union_all([shapely.buffer(shape, -HAND_M, join_style="mitre") for shape in shapes])
    found = []
    for wall in walls:
        has_hole = any(hole.shape.intersects(wall.shape) for hole in holes)
        inner = shapely.intersection(wall.shape, deep).area
        # a wall with a smaller area in plan is a corner
        whole = has_hole or inner < 0.5 * wall.shape.area or wall.shape.area < SPECK_M2
        parts = [wall.shape] if whole else polygons_of(shapely.difference(wall.shape, area))
        found += [replace(wall, shape=part) for part in parts]
    return found


def fill_between_rooms(
    rooms: Sequence[SourceRoom], walls: Sequence[Wall], holes: Sequence[Hole]
) -> tuple[list[Wall], list[Hole]]:
    """Return what is left between the rooms and the walls, and the holes, those of passages going on through it.

    The passages that the slits themselves are stand behind the holes, without doors.
    """
    shapes = [room.polygon for room in rooms if room.polygon is not None]
    if not shapes or not walls:
        return [], list(holes)
    taken = shapely.union_all([*shapes, *(wall.shape for wall in walls)], grid_size=FILE_GRID_M)
    whole = shapely.union_all([Polygon(part.exterior) for part in polygons_of(taken)])
    free = polygons_of(shapely.difference(whole, taken))
    slits = shapely.union_all([part for part in free if drop_thin_parts(part, THICK_WALL_M).is_empty])
    deeper = [_through(hole, slits) if hole.is_passage else hole for hole in holes]
    top = float(np.median([wall.top_m for wall in walls]))
    standing_ = shapely.union_all([wall.shape for wall in walls])
    ways = [
        Hole(opening.strip(deeper_m=CRACK_M), 0.0, top, across=(float(opening.across[0]), float(opening.across[1])))
        for opening in find_doorless_openings(shapes, slits, standing_)
    ]
    ways = [way for way in ways if not any(way.shape.intersects(hole.shape) for hole in holes)]
    return [Wall(part, 0.0, top) for part in polygons_of(slits)], [*deeper, *ways]


def _through(hole: Hole, slits: BaseGeometry) -> Hole:
    """Let a hole go on through what is left between its wall and the rooms."""
    step = np.array(hole.across) * THICK_WALL_M
    lane = shapely.convex_hull(shapely.union_all([translate(hole.shape, *step), translate(hole.shape, *-step)]))
    beside = shapely.buffer(hole.shape, MM_M)
    parts = [part for part in polygons_of(shapely.intersection(slits, lane)) if part.intersects(beside)]
    shape = shapely.convex_hull(shapely.union_all([hole.shape, *parts]))
    return replace(hole, shape=shape) if isinstance(shape, Polygon) else hole


def group_storey_heights(heights: Iterable[float]) -> list[float]:
    """Return the heights of storeys, lowest first: floors closer than STOREYS_APART_M are one, at their median."""
    groups: list[list[float]] = []
    for height in sorted(heights):
        if groups and height - groups[-1][0] < STOREYS_APART_M:
            groups[-1].append(height)
        else:
            groups.append([height])
    return [float(np.median(group)) for group in groups]


def polygon_from_ring(ring: Iterable[Sequence[float]]) -> Polygon | None:
    """Return the polygon of a ring (n, 2), its largest part where it crosses itself, or None if it has no area."""
    points = np.asarray([tuple(point) for point in ring], np.float64)
    if len(points) < 3 or not np.isfinite(points).all():
        return None
    parts = shapely.get_parts(shapely.make_valid(Polygon(points)))
    polygons = [part for part in parts if isinstance(part, Polygon)]
    largest = max(polygons, key=lambda part: part.area, default=Polygon())
    return largest if largest.area > SAME else None  # a leftover of a Boolean operation


# Walls of which a source shows the surfaces only: their bodies are what lies between and around the rooms' floors.
#
# R1  Rooms whose floors meet have no wall between them; cracks of rounding are none either.
# R2  What is narrower than THICK_WALL_M between floors is wall, and so is whatever they enclose (a shaft, a pillar).
# R3  Around all of it goes an outer wall of LINE_WALL_M.
# R4  A door's hole goes on to the floors on both sides of it. One that each of its rooms has for itself is one.


def walls_around_floors(floors: Sequence[Polygon], top_m: float) -> list[Wall]:
    """Return the walls of a storey, from its floor to ``top_m``."""
    floor = shapely.union_all(floors, grid_size=FILE_GRID_M)
    whole = buffer_mitred(buffer_mitred(floor, CRACK_M / 2), -CRACK_M / 2)  # R1
    closed = buffer_mitred(buffer_mitred(whole, THICK_WALL_M / 2), -THICK_WALL_M / 2)  # R2
    filled = shapely.union_all([Polygon(part.exterior) for part in polygons_of(shapely.union(closed, whole))])
    solid = shapely.difference(buffer_mitred(filled, LINE_WALL_M), whole)  # R3
    return [Wall(part, 0.0, top_m) for part in polygons_of(solid)]


def deepen_to_wall_faces(hole: Hole, walls: Sequence[Wall]) -> Hole | None:
    """Return a hole as deep as the walls that it goes through, or None if it is in no wall."""
    step = DEEPEST_WALL_M * np.array(hole.across)
    corners = shapely.get_coordinates(hole.shape)
    lane = shapely.convex_hull(shapely.multipoints(np.concatenate([corners + step, corners - step])))
    x1, y1, x2, y2 = lane.bounds
    around = x1 - DEEPEST_WALL_M, y1 - DEEPEST_WALL_M, x2 + DEEPEST_WALL_M, y2 + DEEPEST_WALL_M
    near = [clip_to_box(wall.shape, *around) for wall in walls if wall.shape.intersects(lane)]
    standing: BaseGeometry = near[0] if len(near) == 1 else shapely.union_all(near)
    within = shapely.intersection(standing, lane, grid_size=FILE_GRID_M)  # not the face that it runs along
    parts = polygons_of(within)
    beside = shapely.dwithin(parts, hole.shape, CRACK_M) if parts else []
    kept = [_without_crossing_wall(part, hole) for part, is_near in zip(parts, beside, strict=True) if is_near]
    shape = shapely.convex_hull(kept[0] if len(kept) == 1 else shapely.union_all(kept))
    return replace(hole, shape=shape) if isinstance(shape, Polygon) else None


def _without_crossing_wall(part: Polygon, hole: Hole) -> BaseGeometry:
    """Return what of a wall lies across a hole, without one that crosses it and laps over an end of the hole.

    Such a wall takes little of the hole's breadth and goes on beyond the lane, where the hole's own wall ends. If the
    hole's own wall is as thin, it is what lies about the hole and goes on along it.
    """
    if not _is_deep(part, hole):
        return part
    own = drop_thin_parts(part, HAND_M)  # an opening is at least this deep, however thin its wall is
    if own.is_empty:
        about = shapely.intersection(part, shapely.buffer(hole.shape, HAND_M / 2, join_style="mitre"))
        along = HAND_M * np.array([-hole.across[1], hole.across[0]])
        lasting = shapely.intersection(translate(about, *along), translate(about, *-along))
        kept = shapely.union(translate(lasting, *along), translate(lasting, *-along))
        return about if kept.is_empty else shapely.intersection(about, kept)
    return part if _is_deep(own, hole) else own


def _is_deep(part: BaseGeometry, hole: Hole) -> bool:
    """Return whether a wall goes on to an end of the lane through a hole."""
    across = np.array(hole.across)
    deep, ends = shapely.get_coordinates(part) @ across, shapely.get_coordinates(hole.shape) @ across
    far = DEEPEST_WALL_M - MM_M
    return bool(len(deep) and (deep.min() < ends.min() - far or deep.max() > ends.max() + far))


def merge_parallel_holes(holes: Sequence[Hole]) -> list[Hole]:
    """Holes that lie beside each other, along most of their length, as one; a hole is wider than deep."""
    if not holes:
        return []
    shapes = [hole.shape for hole in holes]
    near = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=WALL_M).T.tolist()
    same = {(i, k) for i, k in near if k < i and _is_one(shapes[k], shapes[i])}
    groups: list[list[int]] = []
    for i in range(len(shapes)):
        group = next((group for group in groups if any((i, k) in same for k in group)), None)
        if group is None:
            groups.append([i])
        else:
            group.append(i)
    found = [[holes[i] for i in group] for group in groups]
    return [one if not others and any(one.across) else _unite_holes([one, *others]) for one, *others in found]


def _is_one(one: Polygon, other: Polygon) -> bool:
    shared = shapely.intersection(shapely.buffer(one, WALL_M), other).area
    back = shapely.intersection(shapely.buffer(other, WALL_M), one).area
    # two doors are one of which most lies near the other
    return bool(shared > MOSTLY * other.area and back > MOSTLY * one.area)


def _unite_holes(parts: Sequence[Hole]) -> Hole:
    box = shapely.minimum_rotated_rectangle(shapely.union_all([part.shape for part in parts]))
    sides = np.diff(shapely.get_coordinates(box)[:3], axis=0)
    lengths = np.hypot(*sides.T)
    x, y = sides[int(np.argmin(lengths))] / max(float(lengths.min()), TINY)
    low, high = min(part.bottom_m for part in parts), max(part.top_m for part in parts)
    return Hole(box, low, high, any(part.has_door for part in parts), (float(x), float(y)))
