"""A doorway cut through a wall: straight, at right angles to it, where the line between two points meets it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bridges import Bridge
from pipeline.geometry.overlay import overlap

Vector = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float64]
SLIDE_M = 0.1
FARTHEST_SLIDE_M = 2.0
APPROACH_M = 0.45
"""So much free floor is asked for before and behind a cut."""
ALIKE_M = 0.5


@dataclass(frozen=True, eq=False)
class CutRules:
    """What a cut may go through: ``deepest_m`` at most, and whether only wall or also the gap between two houses."""

    width_m: float
    deepest_m: float
    only_walls: bool


def cuts_on_lines(
    lines: Floats, floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Iterator[tuple[Floats, Bridge]]:
    """Cuts near the lines (n, 2, 2) from point to point, each with its line (2, 2), in the order of the lines.

    The thinnest wall of each line comes first. Lines that meet a wall at about the same place (``ALIKE_M``) stand for
    each other.
    """
    tried: set[tuple[int, ...]] = set()
    for line, crossed in zip(lines, shapely.difference(shapely.linestrings(lines), floor), strict=True):
        walls_met = [p for p in shapely.get_parts(crossed) if p.length > 1e-6]
        for wall in sorted(walls_met, key=lambda p: (p.length, p.bounds)):
            start, end = shapely.get_coordinates(wall)[[0, -1]]
            place = tuple(np.round(np.concatenate([start, end]) / ALIKE_M).astype(int).tolist())
            if place in tried:
                continue
            tried.add(place)
            cut = _straight_cut(start, end, floor, walls, rules)
            if cut is not None:
                yield line, cut


def _straight_cut(
    start: Vector, end: Vector, floor: BaseGeometry, walls: BaseGeometry, rules: CutRules
) -> Bridge | None:
    along = _face_direction(start, floor)
    if along is None:
        return None
    across = np.array([-along[1], along[0]])
    if across @ (end - start) < 0:
        along, across = -along, -across
    near = shapely.intersection(floor, shapely.buffer(shapely.points(start), rules.deepest_m + FARTHEST_SLIDE_M + 1.0))
    steps = np.arange(0.0, FARTHEST_SLIDE_M, SLIDE_M)
    for slide in sorted({*steps, *-steps}, key=lambda s: (abs(s), s)):
        foot = start + slide * along
        depth = _depth(foot, across, near, rules.deepest_m)
        if depth is None:
            continue
        cut = Bridge(foot + across * depth / 2, along, rules.width_m, depth, (0, 0))
        if _is_clean(cut, near, walls, rules):
            return cut
    return None


def _face_direction(point: Vector, floor: BaseGeometry) -> Vector | None:
    """Unit direction of the edge of the floor that a point lies on."""
    best, direction = 0.01, None
    for ring in shapely.get_parts(shapely.get_parts(floor.boundary)):
        points = shapely.get_coordinates(ring)
        a, d = points[:-1], np.diff(points, axis=0)
        length2 = np.maximum((d**2).sum(axis=1), 1e-12)
        t = np.clip(((point - a) * d).sum(axis=1) / length2, 0.0, 1.0)
        distance = np.hypot(*(a + t[:, None] * d - point).T)
        k = int(np.argmin(distance))
        if distance[k] < best:
            best, direction = float(distance[k]), d[k] / np.sqrt(length2[k])
    return direction


def _depth(foot: Vector, across: Vector, floor: BaseGeometry, deepest_m: float) -> float | None:
    """How far it is through the wall from a point on its face, or None where there is no other side in reach."""
    ray = shapely.linestrings([foot + 1e-3 * across, foot + deepest_m * across])
    beyond = shapely.intersection(ray, floor)
    if beyond.is_empty:
        return None
    depth = float(np.min((shapely.get_coordinates(beyond) - foot) @ across))
    return depth if depth > 0.01 else None


def _is_clean(cut: Bridge, floor: BaseGeometry, walls: BaseGeometry, rules: CutRules) -> bool:
    """The strip is wall throughout, and the floor before and behind it is free."""
    strip = cut.strip()
    shift = cut.across * (cut.depth + APPROACH_M) / 2
    for side in (-1.0, 1.0):
        before = replace(cut, centre=cut.centre + side * shift, depth=APPROACH_M).strip()
        if overlap(before, floor).area < 0.97 * before.area:
            return False
    if overlap(strip, floor).area > 0.02 * strip.area:
        return False
    return not rules.only_walls or overlap(strip, walls).area >= 0.9 * strip.area
