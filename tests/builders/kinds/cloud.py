"""Kinds ``cloud0``, ``cloud5``, ``cloud20``: the inner surfaces of a home as points, with noise of 0, 5 or 20 mm. Kind
``cloud_furnished``: those of a furnished home, with the errors of a real survey. Kind ``cloud_doubled``: the same with
walls that were seen twice, and glass.

R1  Seen are floors, ceilings, the rooms' sides and the reveals of the doors; nothing is seen through a window.
R2  Furniture hides the wall behind it, and a share of each surface is missing in patches.
R3  With noise, a tenth of the points lies anywhere.
R4  The furnished home is seen with its furniture, open leaves and window niches (``scan``), with noise of 5 mm. Each
    room has its own drift, so that a wall between two rooms is too thin or too thick by centimetres. Some homes have no
    ceiling, some rooms lack a corner, and a mirror shows a part of its room behind the wall.
R5  In a third of the rooms one side was seen again, 5 to 15 cm off, when the sensor came back. Half of the windows are
    clear: of their panes hardly a point is left, and through them the ground outside is seen.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely
import trimesh
from numpy.random import Generator

from tests.builders.formats.clouds import write_ply
from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.scan import seen
from tests.builders.kinds.values import Member, Storey

DENSITY = 1500.0
MISSING = 0.1
PATCH_M = 0.25
EDGE_M = 5.0
NOISE_M = 0.005
DRIFT_M, DRIFT_DEG = 0.02, 0.15
"""R4: one standard deviation of a room's shift along each axis, and of its turn."""
WILD = 0.02
NEAR_M = 0.03
DOUBLED, AGAIN_M = 0.33, (0.05, 0.15)
CLEAR, PANE, OUTSIDE_M, RAYS = 0.5, 0.1, 3.0, 300
"""R5: shares of rooms, windows and points, how far one sees outside, and how many points a window gives there."""
MIRROR_M = (0.6, 1.8)
DEEP_M = 3.0
"""R4: a mirror's width and upper edge, and how deep the room is that it shows."""
Points = npt.NDArray[np.float64]


def make_0(rng: Generator, folder: Path, name: str) -> Member:
    """Write a cloud without noise."""
    return make(rng, folder, name, 0.0)


def make_5(rng: Generator, folder: Path, name: str) -> Member:
    """Write a cloud with noise of 5 mm."""
    return make(rng, folder, name, 0.005)


def make_20(rng: Generator, folder: Path, name: str) -> Member:
    """Write a cloud with noise of 20 mm."""
    return make(rng, folder, name, 0.02)


def make(rng: Generator, folder: Path, name: str, noise_m: float) -> Member:
    """Write one home as points."""
    storey = random_home(rng, Style(outer_m=(0.2, 0.4), inner_m=(0.1, 0.2), windows=0.6))
    points = _less_patches(_seen(storey, rng), rng)
    points += rng.normal(0.0, noise_m, points.shape) if noise_m else 0.0
    if noise_m:  # R3
        low, high = points.min(axis=0) - 0.2, points.max(axis=0) + 0.2
        wild = rng.random(len(points)) < 0.1
        points[wild] = low + rng.random((int(wild.sum()), 3)) * (high - low)
    placing = random_placing(rng, "z", turned=0.3, far=0.05)
    path = write_ply(folder / f"{name}.ply", placing.in_file(points))
    return Member(path, (truth_of(storey, placing, "scan", name),), f"{len(points)} points", "z", 1.0)


def make_furnished(rng: Generator, folder: Path, name: str) -> Member:
    """Write one furnished home as points, with drift, missing parts and a mirror (R4)."""
    return _furnished(rng, folder, name, doubled=False)


def make_doubled(rng: Generator, folder: Path, name: str) -> Member:
    """Write one furnished home as points, with walls that were seen twice, and glass (R5)."""
    return _furnished(rng, folder, name, doubled=True)


def _furnished(rng: Generator, folder: Path, name: str, *, doubled: bool) -> Member:
    style = Style(size=str(rng.choice(["small", "home"])), outer_m=(0.2, 0.4), inner_m=(0.1, 0.2), windows=0.6)
    storey = random_home(rng, style)
    surface = seen(storey, rng, EDGE_M, ceiling=bool(rng.random() < 0.7))
    count = int(DENSITY * surface.area)
    points = np.asarray(trimesh.sample.sample_surface(surface, count, seed=int(rng.integers(1 << 31)))[0])
    points = _less_patches(_less_corners(points, storey, rng), rng)
    points = np.concatenate([points, _in_a_mirror(points, storey, rng)])
    if doubled:
        points = _through_glass(np.concatenate([points, _seen_again(points, storey, rng)]), storey, rng)
    points = _drift(points, storey, rng) + rng.normal(0.0, NOISE_M, points.shape)
    low, high = points.min(axis=0) - 0.2, points.max(axis=0) + 0.2
    wild = rng.random(len(points)) < WILD
    points[wild] = low + rng.random((int(wild.sum()), 3)) * (high - low)
    placing = random_placing(rng, "z", turned=0.3, far=0.05)
    path = write_ply(folder / f"{name}.ply", placing.in_file(points))
    return Member(path, (truth_of(storey, placing, "scan", name),), f"{len(points)} points", "z", 1.0)


def _room_of_points(points: Points, storey: Storey) -> npt.NDArray[np.int64]:
    """Return the number of the room that each point lies in, or is nearest to."""
    at = shapely.points(points[:, 0], points[:, 1])
    return np.argmin([shapely.distance(room, at) for room in storey.rooms], axis=0)


def _less_corners(points: Points, storey: Storey, rng: Generator) -> Points:
    """R4: in a fifth of the rooms nothing is seen within half a metre of one corner."""
    of_room, gone = _room_of_points(points, storey), np.zeros(len(points), bool)
    for k, room in enumerate(storey.rooms):
        corner = shapely.get_coordinates(room)[int(rng.integers(4))]
        if rng.random() < 0.2:
            gone |= (of_room == k) & (np.hypot(*(points[:, :2] - corner).T) < 0.5)
    return points[~gone]


def _in_a_mirror(points: Points, storey: Storey, rng: Generator) -> Points:
    """R4: what a mirror on the longest side of a room shows, unless a door or a window is there."""
    room = storey.rooms[int(rng.integers(len(storey.rooms)))]
    ring = shapely.get_coordinates(shapely.Polygon(room).exterior)
    k = int(np.argmax(np.hypot(*np.diff(ring, axis=0).T)))
    along = (ring[k + 1] - ring[k]) / np.hypot(*(ring[k + 1] - ring[k]))
    inwards = np.array([-along[1], along[0]])
    middle = (ring[k] + ring[k + 1]) / 2
    if any(storey.gap(hole, 0.05).distance(shapely.Point(middle)) < MIRROR_M[0] for hole in storey.openings):
        return np.empty((0, 3))
    if not room.contains(shapely.Point(middle + 0.1 * inwards)):
        inwards = -inwards
    beside, deep = (points[:, :2] - middle) @ along, (points[:, :2] - middle) @ inwards
    shown = (np.abs(beside) < MIRROR_M[0] / 2 + deep / 2) & (deep > 0.1) & (deep < DEEP_M)
    shown &= (points[:, 2] < MIRROR_M[1]) & shapely.intersects_xy(room, points[:, 0], points[:, 1])
    found = points[shown & (rng.random(len(points)) < 0.5)].copy()
    found[:, :2] -= 2 * ((found[:, :2] - middle) @ inwards)[:, None] * inwards
    return found


def _seen_again(points: Points, storey: Storey, rng: Generator) -> Points:
    """R5: half of the points of a side, moved across it."""
    found = [np.empty((0, 3))]
    at = shapely.points(points[:, 0], points[:, 1])
    for room in storey.rooms:
        ring = shapely.get_coordinates(room.exterior)
        k, off = int(rng.integers(len(ring) - 1)), float(rng.choice([-1.0, 1.0]) * rng.uniform(*AGAIN_M))
        if rng.random() < DOUBLED:
            along = (ring[k + 1] - ring[k]) / np.hypot(*(ring[k + 1] - ring[k]))
            side = shapely.dwithin(shapely.LineString(ring[k : k + 2]), at, NEAR_M) & (rng.random(len(points)) < 0.5)
            found.append(points[side] + off * np.array([-along[1], along[0], 0.0]))
    return np.concatenate(found)


def _through_glass(points: Points, storey: Storey, rng: Generator) -> Points:
    """R5: the points without those of clear panes, and with those of the ground before them."""
    house = shapely.union_all([*storey.rooms, storey.wall_area])
    for hole in storey.openings:
        if hole.kind == "window" and rng.random() < CLEAR:
            pane = shapely.intersects_xy(storey.gap(hole, NEAR_M), points[:, 0], points[:, 1])
            pane &= (points[:, 2] > hole.sill + NEAR_M) & (points[:, 2] < hole.head - NEAR_M)
            wall = storey.walls[hole.wall]
            away = rng.uniform(-OUTSIDE_M, OUTSIDE_M, RAYS)
            along = hole.centre + rng.uniform(-0.5, 0.5, RAYS) * (hole.width + np.abs(away))
            ground = np.array([wall.at(s, t) for s, t in zip(along, away, strict=True)])
            ground = ground[~shapely.intersects_xy(house, *ground.T)]
            seen_outside = np.column_stack([ground, rng.uniform(-0.3, 0.3, len(ground))])
            points = np.concatenate([points[~pane | (rng.random(len(points)) < PANE)], seen_outside])
    return points


def _drift(points: Points, storey: Storey, rng: Generator) -> Points:
    """R4: each room is a little off its place."""
    of_room, found = _room_of_points(points, storey), points.copy()
    for k, room in enumerate(storey.rooms):
        angle = np.deg2rad(rng.normal(0.0, DRIFT_DEG))
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        centre, here = np.array(room.centroid.coords[0]), of_room == k
        found[here, :2] = (points[here, :2] - centre) @ turn.T + centre + rng.normal(0.0, DRIFT_M, 2)
    return found


def _seen(storey: Storey, rng: Generator) -> Points:
    """R1."""
    doors = [hole for hole in storey.openings if hole.kind != "window"]
    windows = shapely.union_all([storey.gap(hole, 0.05) for hole in storey.openings if hole.kind == "window"])
    rooms = shapely.union_all([*storey.rooms, *(c.polygon.difference(storey.wall_area) for c in storey.cells)])
    head = min((hole.head for hole in doors), default=2.0)
    low = shapely.union_all([rooms, *(storey.gap(hole, 0.001) for hole in doors if hole.kind != "french")])
    found = [_sides(low, 0.0, head, rng), _sides(rooms, head, storey.height, rng)]
    found += [_level(rooms, z, rng) for z in (0.0, storey.height)]
    sides = np.concatenate(found)
    through = shapely.intersects_xy(windows, sides[:, 0], sides[:, 1]) & (sides[:, 2] > 0.9) & (sides[:, 2] < head)
    return sides[~through]


def _sides(area: shapely.Geometry, low: float, high: float, rng: Generator) -> Points:
    parts = [np.empty((0, 3))]
    for polygon in shapely.get_parts(area):
        for ring in (polygon.exterior, *polygon.interiors):
            for a, b in pairwise(shapely.get_coordinates(ring)):
                count = int(DENSITY * np.hypot(*(b - a)) * (high - low))
                u, v = rng.random((2, count))
                plan = a + u[:, None] * (b - a)
                parts.append(np.column_stack([plan, low + v * (high - low)]))
    return np.concatenate(parts)


def _level(area: shapely.Geometry, z: float, rng: Generator) -> Points:
    x1, y1, x2, y2 = area.bounds
    count = int(DENSITY * (x2 - x1) * (y2 - y1))
    xy = np.array([x1, y1]) + rng.random((count, 2)) * np.array([x2 - x1, y2 - y1])
    inside = xy[shapely.intersects_xy(area, xy[:, 0], xy[:, 1])]
    return np.column_stack([inside, np.full(len(inside), z)])


def _less_patches(points: Points, rng: Generator) -> Points:
    """R2: patches behind furniture, below 1 m, and anywhere."""
    cell = np.floor(points / PATCH_M).astype(np.int64)
    _, patch = np.unique(cell, axis=0, return_inverse=True)
    gone = rng.random(int(patch.max()) + 1) < MISSING
    low = points[:, 2] < 1.0
    column = np.unique(cell[:, :2] // 4, axis=0, return_inverse=True)[1]
    hidden = rng.random(int(column.max()) + 1) < 2 * MISSING
    return points[~(gone[patch.ravel()] | (low & hidden[column.ravel()] & (points[:, 2] > 0.05)))]
