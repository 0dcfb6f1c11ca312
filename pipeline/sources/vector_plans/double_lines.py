"""Make bodies of walls and windows that are drawn by their faces: two lines beside each other, open at their ends.

Lengths are in metres, lines are pairs of points.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon

from pipeline.geometry.areas import dot_product
from pipeline.sources.tolerances import CRACK_M, DEEPEST_WALL_M, PARALLEL, ROUGH_M, THICKEST_WALL_M
from pipeline.sources.vector_plans.drawing import Point

_AS_NEAR: Final = 2.5
"""A face of a wall is at most this many times as far off as the nearest line beside it: the leaf of a cavity wall is,
the line of a measure or of a canopy is not."""


def bodies_between_faces(lines: Sequence[tuple[Point, Point]]) -> list[Polygon]:
    """Return what lies between lines that are the two faces of one wall, over the length that they share.

    Faces are parallel, up to THICKEST_WALL_M apart and longer than they are apart, so that the jambs of a narrow door
    are none.
    """
    ends = np.asarray([(*a, *b) for a, b in lines], np.float64).reshape(-1, 4)
    start, along = ends[:, :2], ends[:, 2:] - ends[:, :2]
    length = np.hypot(*along.T)
    kept = length > ROUGH_M
    start, length, way = start[kept], length[kept], along[kept] / length[kept, None]
    if len(start) < 2:
        return []
    segments = shapely.linestrings(np.stack([start, start + way * length[:, None]], axis=1))
    one, other = shapely.STRtree(segments).query(segments, predicate="dwithin", distance=THICKEST_WALL_M)
    across = np.stack([-way[:, 1], way[:, 0]], axis=1)
    from_one = start[other] - start[one]
    first = dot_product(from_one, way[one])
    last = first + dot_product(way[other], way[one]) * length[other]
    low, high = np.maximum(np.minimum(first, last), 0.0), np.minimum(np.maximum(first, last), length[one])
    away = np.abs(dot_product(from_one, across[one]))
    is_face = (np.abs(dot_product(way[other], across[one])) < PARALLEL) & (away > ROUGH_M) & (away <= THICKEST_WALL_M)
    is_face &= high - low >= away
    one, other, low, high, away = one[is_face], other[is_face], low[is_face], high[is_face], away[is_face]
    nearest = _nearest_along(one, low, high, away)
    back = {(int(i), int(k)): near for i, k, near in zip(one, other, nearest, strict=True)}
    bodies = []
    for i, k, a, b, far, near in zip(one, other, low, high, away, nearest, strict=True):
        if i < k and far <= _AS_NEAR * min(near, back.get((int(k), int(i)), near)):
            side = np.sign(float((start[k] - start[i]) @ across[i])) * far * across[i]
            p, q = start[i] + way[i] * a, start[i] + way[i] * b
            bodies.append(Polygon([p, q, q + side, p + side]))
    return bodies


def windows_from_lines(lines: Sequence[tuple[Point, Point]]) -> tuple[list[Polygon], list[tuple[Point, Point]]]:
    """Return the bodies of windows, and the lines of those that are only lines.

    Lines that touch are one window, whose body is the smallest turned rectangle around it. One that is deeper than a
    wall (with sashes that stand open, or a bay) has no body, and its lines are left out.
    """
    segments = [LineString(line) for line in lines if line[0] != line[1]]
    if not segments:
        return [], []
    groups = shapely.get_parts(shapely.union_all(shapely.buffer(segments, CRACK_M / 2, cap_style="square")))
    tree = shapely.STRtree(segments)
    bodies: list[Polygon] = []
    frames: list[tuple[Point, Point]] = []
    for group in groups:
        parts = [segments[i] for i in tree.query(group, predicate="covers")]
        box = shapely.minimum_rotated_rectangle(shapely.union_all(parts))
        if isinstance(box, Polygon) and box.area > ROUGH_M * box.length:
            corners = shapely.get_coordinates(box)
            if np.hypot(*np.diff(corners[:3], axis=0).T).min() <= DEEPEST_WALL_M:
                bodies.append(box)
        else:
            frames += [(part.coords[0], part.coords[-1]) for part in parts]
    return bodies, frames


def _nearest_along(
    one: npt.NDArray[np.intp],
    low: npt.NDArray[np.float64],
    high: npt.NDArray[np.float64],
    away: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """Return, for each pair, how near the nearest line is that runs beside the first line along half of the pair."""
    found = away.copy()
    order = np.argsort(one, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(one[order])) + 1) if len(order) else ():
        shared = np.minimum(high[group], high[group][:, None]) - np.maximum(low[group], low[group][:, None])
        beside = shared >= 0.5 * (high[group] - low[group])[:, None]
        found[group] = np.where(beside, away[group][None, :], np.inf).min(axis=1)
    return found
