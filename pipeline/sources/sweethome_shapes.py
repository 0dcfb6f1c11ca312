"""Walls and doors of a Sweet Home 3D home as plan shapes, metres, axes as in the file.

R1  A wall is a strip about its middle; a bent one a strip about its arc.
R2  Where two walls are joined, the corner between their ends is filled up to where their outer faces meet.
R3  A sloping wall goes up in steps of STEP_M.
R4  A door's hole goes through the whole of each wall that runs along it and in which its frame stands, however deep the
    frame is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.ops import substring

from pipeline.geometry.overlay import polygons_of
from pipeline.sources.drawn_storeys import Hole, Wall
from pipeline.sources.sweethome_home import DoorOrWindow, DrawnWall, Piece

STEP_M = 0.1
MAX_STEPS = 40
ARC_STEP_RAD = math.radians(7.5)
SHARPEST = 3.0  # a corner is filled up to so many times the walls' thickness
ALONG = math.cos(math.radians(20))
SHORTEST_M = 1e-3


@dataclass(frozen=True, eq=False)
class Strip:
    """A wall with its middle line (n, 2) and its shape."""

    wall: DrawnWall
    line: Any
    shape: Polygon


def strips(walls: Sequence[DrawnWall]) -> list[Strip]:
    """R1; walls without a length or a thickness are none."""
    found = []
    for wall in walls:
        line = _middle(wall)
        if math.dist(wall.start, wall.end) > SHORTEST_M and wall.thickness_m > SHORTEST_M:
            shape = LineString(line).buffer(wall.thickness_m / 2, cap_style="flat", join_style="mitre")
            found.append(Strip(wall, line, max(polygons_of(shape), key=lambda part: part.area)))
    return found


def bodies(found: Sequence[Strip]) -> list[Wall]:
    """Return the walls and the corners between them as pieces that stand on the floor."""
    by_key = {strip.wall.key: strip for strip in found if strip.wall.key}
    return [piece for strip in found for piece in (*_sloped(strip), *_corners(strip, by_key))]


def hole_of(door: DoorOrWindow, found: Sequence[Strip]) -> Hole | None:
    """R4, or None if it stands in no wall."""
    across, along = _axes(door.angle_rad)
    left = 1 - door.wall_left - door.wall_width if door.mirrored else door.wall_left
    u = (-0.5 + left) * door.width_m, (-0.5 + left + door.wall_width) * door.width_m
    v = (-0.5 + door.wall_distance) * door.depth_m
    frame = _quad(door.at, along, across, u, (v, v + door.wall_thickness * door.depth_m))
    cut = []
    for strip in found:
        runs = [direction for direction in _directions(strip.line) if abs(np.dot(direction, along)) > ALONG]
        if runs and shapely.intersection(frame, strip.shape).area > 0.2 * min(frame.area, _share(strip, frame)):
            reach = strip.wall.thickness_m + door.depth_m
            lane = _quad(door.at, along, across, u, (v - reach, v + door.wall_thickness * door.depth_m + reach))
            cut.append(shapely.intersection(lane, strip.shape))
    parts = [part for part in polygons_of(shapely.union_all(cut)) if part.distance(frame) < SHORTEST_M]
    if not parts:
        return None
    shape = shapely.convex_hull(shapely.union_all(parts))
    return Hole(
        shape, door.elevation_m, door.elevation_m + door.height_m, door.has_leaf, (float(across[0]), float(across[1]))
    )


def footprint(piece: Piece) -> Polygon:
    """Return a piece's box seen from above."""
    across, along = _axes(piece.angle_rad)
    half = piece.width_m / 2, piece.depth_m / 2
    return _quad(piece.at, along, across, (-half[0], half[0]), (-half[1], half[1]))


def _share(strip: Strip, frame: Polygon) -> float:
    """Area that a frame could have in a wall thinner than itself."""
    longest = max(frame.length / 2 - strip.wall.thickness_m, SHORTEST_M)
    return float(longest * strip.wall.thickness_m)


def _middle(wall: DrawnWall) -> Any:
    """Return the points (n, 2) of a wall's middle."""
    a, b = np.array(wall.start), np.array(wall.end)
    if abs(wall.arc_rad) < 1e-3 or abs(wall.arc_rad) > 2 * math.pi - 1e-3:
        return np.stack([a, b])
    centre = (a + b) / 2 - np.array([b[1] - a[1], a[0] - b[0]]) / (2 * math.tan(wall.arc_rad / 2))
    turns = np.linspace(0.0, wall.arc_rad, max(3, math.ceil(abs(wall.arc_rad) / ARC_STEP_RAD)) + 1)
    cos, sin = np.cos(turns), np.sin(turns)
    x, y = a - centre
    return centre + np.column_stack([x * cos - y * sin, x * sin + y * cos])


def _sloped(strip: Strip) -> Iterable[Wall]:
    """R3."""
    wall = strip.wall
    rise = wall.end_height_m - wall.height_m
    if abs(rise) < STEP_M:
        return [Wall(strip.shape, 0.0, max(wall.height_m, wall.end_height_m))]
    count = min(MAX_STEPS, math.ceil(abs(rise) / STEP_M))
    line = LineString(strip.line)
    found = []
    for k in range(count):
        part = substring(line, k / count, (k + 1) / count, normalized=True)
        shape = part.buffer(wall.thickness_m / 2, cap_style="flat", join_style="mitre")
        found.append(Wall(shape, 0.0, wall.height_m + rise * (k + 0.5) / count))
    return found


def _corners(strip: Strip, by_key: Mapping[str, Strip]) -> Iterable[Wall]:
    """R2."""
    for at_end, key in enumerate(strip.wall.joined):
        other = by_key.get(key)
        if other is None:
            continue
        line = strip.line[::-1] if at_end else strip.line
        near = line[0]
        other_line = other.line
        if np.hypot(*(other_line[-1] - near)) < np.hypot(*(other_line[0] - near)):
            other_line = other_line[::-1]
        halves = strip.wall.thickness_m / 2, other.wall.thickness_m / 2
        shape = _corner(near, line[1] - near, other_line[0], other_line[1] - other_line[0], halves)
        top = strip.wall.end_height_m if at_end else strip.wall.height_m
        if shape is not None:
            yield Wall(shape, 0.0, min(top, max(other.wall.height_m, other.wall.end_height_m)))


def _corner(a: Any, u: Any, b: Any, v: Any, halves: tuple[float, float]) -> Polygon | None:
    """Return what lies between the ends of two walls that leave from a and b in the directions u and v."""
    u, v = u / np.hypot(*u), v / np.hypot(*v)
    n, m = np.array([-u[1], u[0]]) * halves[0], np.array([-v[1], v[0]]) * halves[1]
    points = [a + n, a - n, b + m, b - m]
    turn = u[0] * v[1] - u[1] * v[0]
    if abs(turn) > 1e-3:
        for p, q in ((a + n, b - m), (a - n, b + m)):
            t = ((q - p)[0] * v[1] - (q - p)[1] * v[0]) / turn
            if abs(t) < SHARPEST * 2 * max(halves):
                points.append(p + t * u)
    hull = shapely.convex_hull(shapely.MultiPoint(np.array(points)))
    return hull if isinstance(hull, Polygon) and hull.area > SHORTEST_M**2 else None


def _directions(line: Any) -> Any:
    steps = np.diff(line, axis=0)
    return steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]


def _axes(angle: float) -> tuple[Any, Any]:
    """Return the directions of a piece's depth (from its back) and of its width."""
    return np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])


def _quad(at: Any, along: Any, across: Any, u: tuple[float, float], v: tuple[float, float]) -> Polygon:
    corners = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])]
    return Polygon([np.array(at) + s * along + t * across for s, t in corners])
