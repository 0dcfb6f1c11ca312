"""Compute the polygon of a doorway, from jamb to jamb and face to face of the wall, from a leaf or an opening.

A leaf, or an opening as a source draws it, tells where a door is, but not its exact depth and width: leaves are thinner
than the wall, frames and play leave a few centimetres at the sides, openings stick out of the wall.

R1  A wall that is a little skewed to what stands in it is cut through; where it is so much askew that its two ends lie
    in different lines, the doorway is turned to lie along the wall.
R2  Two walls of their own, one beside the other: the thinner one decides how deep the doorway is.
R3  A leaf may lie at a face of the wall, before the hole that it shuts, with no wall in its own line.
R4  Between two walls that cross its line, as at the front of a closet, a door is as deep as a partition: those walls
    are deeper than any wall between two rooms, and do not go on in line with it.
R5  A leaf that is named may lie in a wall in which nobody cut a hole, or at a face of it: it is cut out of all that
    wall. Whether it does not just stand open there, its caller knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import median

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import Shapes, clip_to_box, dot_product, intersect
from pipeline.geometry.meshes import Box
from pipeline.tolerances import (
    AROUND_M,
    BESIDE_M,
    CRACK_M,
    HAND_M,
    LAP_M,
    LOOKS,
    MOSTLY,
    RUN_M,
    SHEET_M,
    SKEW,
    SLIVER_M,
    STAND_M,
    STONE_WALL_M,
    THIN_WALL_M,
    WALL_M,
)

SAME_SLOPE = 0.04

Floats = npt.NDArray[np.float64]


def box_polygon(box: Box, *, width: float | None = None, depth: float | None = None) -> Polygon:
    """Return the plan of a box, or of one as wide and deep in its place."""
    a = box.along * (box.width if width is None else width) / 2
    d = box.across * (box.thickness if depth is None else depth) / 2
    c = box.centre
    return shapely.polygons(np.array([c - a - d, c + a - d, c + a + d, c - a + d]))


def strips_beside(boxes: Sequence[Box], widths_m: Sequence[float], *, off_m: float, depth_m: float) -> Shapes:
    """Return two strips (n, 2) of these widths (n,) beside each of some boxes, on its right and on its left.

    Each lies along the middle of a long side, begins ``off_m`` before it and is ``depth_m`` deep.
    """
    if not boxes:
        return np.zeros((0, 2), np.object_)
    centre, along = (np.array([getattr(box, name) for box in boxes])[:, None] for name in ("centre", "along"))
    thickness, width = np.array([box.thickness for box in boxes]), np.array(widths_m)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) * np.array([[-1.0], [1.0]])
    middle = centre + across * (thickness[:, None, None] / 2 + off_m + depth_m / 2)
    long, deep = along * width[:, None, None] / 2, across * depth_m / 2
    corners = [middle - long - deep, middle + long - deep, middle + long + deep, middle - long + deep]
    return np.asarray(shapely.polygons(np.stack(corners, axis=2)))


def fit_into_wall(polygon: Polygon, walls: BaseGeometry) -> Polygon:
    """A doorway as its source draws it, drawn in to the faces of the wall that it lies in, where that is known."""
    found = doorway_around_leaf(box_around_polygon(polygon), walls)
    if found is None:
        return polygon
    drawn = box_polygon(found)
    kept = intersect(drawn, polygon).area > 0.5 * min(drawn.area, polygon.area)
    return drawn if kept else polygon  # between two walls the one beside it may look nearer


def box_around_polygon(polygon: Polygon) -> Box:
    """Return the smallest rectangle around a plan polygon, as a box without height."""
    return boxes_around_polygons([polygon])[0]


def boxes_around_polygons(polygons: Sequence[Polygon]) -> list[Box]:
    """Return ``box_around_polygon`` of each."""
    around = shapely.minimum_rotated_rectangle(np.array(polygons, np.object_))
    corners = shapely.get_coordinates(around).reshape(-1, 5, 2)[:, :4]
    edges = corners[:, 1:3] - corners[:, :2]
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    longer = (lengths[:, 1] > lengths[:, 0]).astype(np.int64)
    rows = np.arange(len(corners))
    wide, thick = lengths[rows, longer], lengths[rows, 1 - longer]
    along = edges[rows, longer] / np.maximum(wide, 1e-9)[:, None]
    found = zip(corners.mean(axis=1), along, wide.tolist(), thick.tolist(), strict=True)
    return [Box(centre, axis, width, thickness, 0.0, 0.0) for centre, axis, width, thickness in found]


def doorway_around_leaf(box: Box, walls: BaseGeometry) -> Box | None:
    """Return the doorway in which a leaf stands closed, as a box as deep as the wall, or None if it stands in none.

    Either walls meet both of its ends within ``BESIDE_M``, or it stands in a wall that runs on through it.
    """
    reach = box.width / 2 + BESIDE_M + AROUND_M
    (x, y) = box.centre
    near = clip_to_box(walls, x - reach, y - reach, x + reach, y + reach)
    if near.is_empty:
        return None
    ends = _jambs(box, near) or _jambs_behind(box, near)
    if ends is None:
        return None
    at = np.array([-1.0, 1.0]) * (np.array(ends) + SLIVER_M)
    faces = [face for face in _faces(box, at, near) if face is not None]
    if not faces:
        return None
    if all(f[1] - f[0] > WALL_M for f in faces) and _are_crossing(box, ends, near):  # R4
        faces = [(-depth / 2, depth / 2) for depth in [max(box.thickness, HAND_M)]]
    low, high = min(f[0] for f in faces), max(f[1] for f in faces)
    if high - low > SHEET_M + min(f[1] - f[0] for f in faces):
        turned = _doorway_across(box, ends, faces, near)  # R1
        if turned is not None:
            return turned
        low, high = min(faces, key=lambda f: f[1] - f[0])  # R2
    if high < -box.thickness / 2 - SLIVER_M or low > box.thickness / 2 + SLIVER_M:
        return None
    centre = box.centre + (ends[1] - ends[0]) / 2 * box.along + (low + high) / 2 * box.across
    return Box(centre, box.along, ends[0] + ends[1], high - low, box.low, box.high)


def _are_crossing(box: Box, ends: list[float], walls: BaseGeometry) -> bool:
    """R4: return whether no wall as deep as its jambs goes on in line with a leaf, on either side."""
    low, high = ends
    beyond = np.array([-low - RUN_M, -low - 2 * RUN_M, high + RUN_M, high + 2 * RUN_M])
    return not any(face is not None and face[1] - face[0] > WALL_M for face in _faces(box, beyond, walls))


def _doorway_across(box: Box, ends: list[float], faces: list[tuple[float, float]], walls: BaseGeometry) -> Box | None:
    """R1: the doorway in the wall of which ``faces`` lie at both ``ends`` of a leaf, or None if these are two walls."""
    if len(faces) < 2 or abs(np.ptp(faces[0]) - np.ptp(faces[1])) > STAND_M:
        return None
    at = [-ends[0] - SLIVER_M, ends[1] + SLIVER_M]
    slope = float(np.mean(faces[1]) - np.mean(faces[0])) / (at[1] - at[0])
    middle = (ends[1] - ends[0]) / 2
    aside = float(np.mean(faces[0])) + slope * (middle - at[0])
    if abs(slope) > SKEW or abs(aside) > box.thickness / 2 + SLIVER_M:
        return None
    for end, face in zip(at, faces, strict=True):
        (farther,) = _faces(box, np.array([end + np.sign(end) * THIN_WALL_M]), walls)
        goes_on = None if farther is None else np.sign(end) * (np.mean(farther) - np.mean(face)) / THIN_WALL_M
        if goes_on is not None and abs(goes_on - slope) > SAME_SLOPE:
            return None
    longer = float(np.hypot(1.0, slope))
    centre = box.centre + middle * box.along + aside * box.across
    along = (box.along + slope * box.across) / longer
    depth = float(np.ptp(faces, axis=1).mean()) / longer + 2 * LAP_M  # or a hair of the wall would be left
    return Box(centre, along, sum(ends) * longer, depth, box.low, box.high)


def doorway_in_uncut_wall(box: Box, walls: BaseGeometry) -> Box | None:
    """R5: return the doorway, as deep as the wall that runs on behind all of a leaf or through it, or None."""
    reach = box.width / 2 + AROUND_M
    x, y = box.centre
    near = clip_to_box(walls, x - reach, y - reach, x + reach, y + reach)
    half = box.width / 2 - SLIVER_M
    faces = [face for face in _faces(box, np.linspace(-half, half, LOOKS), near) if face is not None]
    if len(faces) < LOOKS or (np.ptp(faces, axis=0) > SHEET_M).any():
        return None
    low, high = np.median(faces, axis=0).tolist()
    if low > box.thickness / 2 + STAND_M or high < -box.thickness / 2 - STAND_M:
        return None
    return replace(box, centre=box.centre + (low + high) / 2 * box.across, thickness=high - low)


def _jambs(box: Box, walls: BaseGeometry) -> list[float] | None:
    """Return how far from the box's centre the wall begins at its two ends, or None if none does within reach.

    At each end, the middle and two places aside of it are looked at.
    """
    half = box.width / 2
    aside_m = 0.3 * min(box.thickness, HAND_M)
    starts = np.tile(box.centre + np.array([[0.0], [-aside_m], [aside_m]]) * box.across, (2, 1))
    on = np.repeat([-box.along, box.along], 3, axis=0)
    along = np.stack([starts + (half - SLIVER_M) * on, starts + (half / 2) * on])
    goes_on = shapely.intersects_xy(walls, along[..., 0], along[..., 1]).all(axis=0)  # it stands in a wall that runs on
    rays = shapely.linestrings(np.stack([starts + half / 2 * on, starts + (half + BESIDE_M) * on], axis=1))
    hits, ray = shapely.get_coordinates(shapely.intersection(rays, walls), return_index=True)
    away = np.full(6, np.inf)
    np.minimum.at(away, ray, dot_product(hits - starts[ray], on[ray]))
    away[goes_on] = half
    ends = [away[end][np.isfinite(away[end])].tolist() for end in (slice(3), slice(3, 6))]
    if all(len(found) >= 2 or (found and box.thickness < SLIVER_M) for found in ends):
        return [median(found) for found in ends]
    return None


def _jambs_behind(box: Box, walls: BaseGeometry) -> list[float] | None:
    """R3: return how far the two ends of the wall are from the centre of a leaf that lies before a hole, or None."""
    if box.thickness > HAND_M:
        return None
    for sign in (-1.0, 1.0):
        line = replace(box, centre=box.centre + sign * (box.thickness / 2 + CRACK_M) * box.across, thickness=0.0)
        if not walls.intersects(box_polygon(line, width=MOSTLY * box.width, depth=CRACK_M)):
            ends = _jambs(line, walls)
            if ends is not None:
                return ends
    return None


def _faces(box: Box, at: Floats, walls: BaseGeometry) -> list[tuple[float, float] | None]:
    """Return where the wall's two faces lie across the box, at each of some distances (n,) along it.

    None where no wall stands, or where it is too thick.
    """
    points = box.centre + at[:, None] * box.along
    reach = STONE_WALL_M * box.across
    lines = shapely.linestrings(np.stack([points - reach, points + reach], axis=1))
    parts, line = shapely.get_parts(shapely.intersection(lines, walls), return_index=True)
    corners, part = shapely.get_coordinates(parts, return_index=True)
    across = dot_product(corners - points[line[part]], box.across)
    low, high = np.full(len(parts), np.inf), np.full(len(parts), -np.inf)
    np.minimum.at(low, part, across)
    np.maximum.at(high, part, across)
    best: list[tuple[float, float] | None] = [None] * len(at)
    for k, one, other in zip(line.tolist(), low.tolist(), high.tolist(), strict=True):
        known = best[k]
        if other - one > 1e-3 and (known is None or abs(one + other) < abs(known[0] + known[1])):
            best[k] = (one, other)
    return [None if found is None or found[1] - found[0] > STONE_WALL_M else found for found in best]
