"""Decide whether a mesh has an interior: reject facades, city blocks, cars and terrain before planning.

R1  Walls stand: along enough of the outline the same wall is met at chest and head height; nearer to the floor other
    things stand too. On terrain and in a car it is not. A fence, which stands nowhere, around walls that do is no
    outline of theirs.
R2  A facade is one sheet, wound to be seen from outside, closed all round, with no wall inside it: nobody modelled an
    inside. A wall with two faces, a sheet that looks inwards (a room's scan), a gap to enter by or an inner wall
    speaks for rooms.
    So does furniture: what lies level between knee and head, as large as a table, more than a wall's thickness
    within. In a place as small as the cabin of a vehicle these are seats.
R3  Several such blocks that stand apart are a city, not a house; many are one whatever their walls, with nothing inside
    any and no gap to enter by.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from pipeline.geometry.areas import dot_product
from pipeline.rejection import Reason, Rejection
from pipeline.sources.storeys.surfaces import Bools, Cells, Floats, PlanGrid, Surfaces, cut_faces_at_height
from pipeline.sources.tolerances import (
    CABIN_M,
    CHEST_AND_HEAD_M,
    DEEPEST_WALL_M,
    FACES_FACING,
    GRID_CELL_M,
    INNER_M,
    INNER_PER_M2,
    INNER_SHARE,
    LARGEST_GRID,
    MANY_BLOCKS,
    MAX_SAMPLES,
    QUARTER,
    SAMPLE_M,
    SHED_M2,
    TABLE_M2,
    TINY,
)
from pipeline.tolerances import CRACK_M, EDGE_BAND_M, KNEE_M, LARGELY, MOST
from pipeline.values import Mesh

ADVICE = "take a model with rooms inside, or cut the part that has them out"


@dataclass(frozen=True)
class InteriorMeasures:
    """What was seen of one level: lengths in metres, shares from 0 to 1."""

    outline_m: float
    area_m2: float
    standing_m: float
    enclosed: float
    two_faced: float
    outward: float
    inner_m: float
    blocks: int
    furnished_m2: float = 0.0

    @property
    def fault(self) -> str:
        """Say why this is no interior, or "" if it may be one."""
        if self.standing_m < QUARTER * self.outline_m:  # share of the outline along which walls stand
            return (
                f"walls stand from chest to head height along {self.standing_m:.0f} m of an outline of "
                f"{self.outline_m:.0f} m: a car, a sculpture or terrain"
            )
        is_city = self.blocks >= MANY_BLOCKS
        # walls have an inside where most of the outline has a second face behind it
        # the outline of a facade is wound to be seen from outside
        # a facade encloses most of its outline's hull
        closed = self.enclosed >= MOST and self.outward >= LARGELY and (is_city or self.two_faced < MOST)
        if not closed or self.inner_m >= max(INNER_M, INNER_SHARE * self.outline_m, INNER_PER_M2 * self.area_m2):
            return ""
        if self.furnished_m2 >= TABLE_M2:
            return ""
        if self.blocks > 2:
            return f"{self.blocks} separate closed blocks with no wall inside any: a city"
        return (
            f"one closed sheet of {self.outline_m:.0f} m that is seen from outside, with no second face and "
            f"{self.inner_m:.1f} m of wall inside, too little for rooms: a facade"
        )


def check_interior(levels: Iterable[Mesh], name: str, *, is_sized: bool = True) -> None:
    """Raise Rejection NO_INTERIOR where no level of a house has an inside.

    Each level is its walls, with the floor at z = 0. Unless ``is_sized``, nobody knows the scale, and what lies at the
    height of furniture may be anything.
    """
    faults = []
    for walls in levels:
        measures = measure_interior(walls)
        fault = (measures if is_sized else replace(measures, furnished_m2=0.0)).fault
        if not fault:
            return
        faults.append(fault)
    if faults:
        raise Rejection("source", Reason.NO_INTERIOR, f"{name}: {faults[0]}", ADVICE)


def measure_interior(walls: Mesh) -> InteriorMeasures:
    """Look at one level's walls in plan."""
    surfaces = Surfaces.of(walls)
    # walls of scans lean, by less than half a right angle
    upright = np.abs(surfaces.normal[:, 2]) < FACES_FACING
    sections = [cut_faces_at_height(surfaces, upright, height) for height in CHEST_AND_HEAD_M]
    ends = np.concatenate([segments.reshape(-1, 2) for segments, _ in sections])
    if not len(sections[0][0]):
        return InteriorMeasures(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = max(GRID_CELL_M, float(np.sqrt(np.prod(high - low + 2.0) / LARGEST_GRID)))
    grid = PlanGrid.over(low, high, size_m=size)
    traces = [grid.trace(segments) for segments, _ in sections]
    # and wave between the two heights
    standing = traces[0] & grid.grow(traces[1], EDGE_BAND_M)
    wall = _without_fences(grid.grow(traces[0], grid.size_m), standing)
    outside = _outside(wall)
    covered = _hull(wall)
    inside = ((outside == 0) & (wall == 0)).astype(np.uint8)
    points, normals = _samples(*sections[0], surfaces)
    walled = grid.at(wall, points)
    points, normals = points[walled], normals[walled]
    outer = grid.at(grid.grow(outside, 2 * grid.size_m), points)
    looks_out = grid.at(outside, points + normals * 4 * grid.size_m)
    stands = grid.at(grid.grow(standing, grid.size_m), points)
    far = grid.grow(outside, DEEPEST_WALL_M + 2 * grid.size_m)
    outline = _length(grid, covered)
    return InteriorMeasures(
        outline,
        grid.area(covered),
        float(np.count_nonzero(stands & outer)) * SAMPLE_M,
        grid.area(inside) / max(grid.area(covered), TINY),
        _two_faced(points, normals, outer, np.where(looks_out[:, None], normals, -normals)),
        _share(looks_out[outer]),
        float(np.count_nonzero(stands & ~outer & ~grid.at(far, points))) * SAMPLE_M,
        _large_parts(grid, wall),
        _furnished_area(surfaces, grid, far) if (high - low).max() >= CABIN_M else 0.0,
    )


def _furnished_area(surfaces: Surfaces, grid: PlanGrid, edge: Cells) -> float:
    """Area in plan of what lies level between knee and head, without what lies over the cells of ``edge``."""
    level = surfaces.flats() & (surfaces.low[:, 2] > KNEE_M) & (surfaces.high[:, 2] < CHEST_AND_HEAD_M[1])
    return grid.area(grid.cover(surfaces.triangles(level)[:, :, :2]) & (edge == 0)) if level.any() else 0.0


def _samples(segments: Floats, faces: np.ndarray, surfaces: Surfaces) -> tuple[Floats, Floats]:
    """Points (k, 2) along segments, SAMPLE_M apart, with the plan direction that their faces look in."""
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    ends = np.cumsum(length)
    at = np.arange(SAMPLE_M / 2, ends[-1], SAMPLE_M)
    owner = np.minimum(np.searchsorted(ends, at), len(ends) - 1)
    share = ((at - ends[owner] + length[owner]) / np.maximum(length[owner], TINY)).clip(0.0, 1.0)[:, None]
    points = segments[owner, 0] * (1 - share) + segments[owner, 1] * share
    normals = surfaces.normal[faces[owner], :2]
    return points, normals / np.maximum(np.linalg.norm(normals, axis=1), TINY)[:, None]


def _without_fences(wall: Cells, standing: Cells) -> Cells:
    """Return the connected parts of which some stands, all of them where none does."""
    _, part = cv2.connectedComponents(wall)
    kept = np.unique(part[(standing > 0) & (wall > 0)])
    return np.isin(part, kept).astype(np.uint8) if len(kept) else wall


def _outside(wall: Cells) -> Cells:
    """Cells that can be reached from the margin without crossing a wall."""
    filled = wall.copy()
    cv2.floodFill(filled, np.zeros((wall.shape[0] + 2, wall.shape[1] + 2), np.uint8), (0, 0), 2)
    outside: Cells = (filled == 2).astype(np.uint8)
    return outside


def _hull(mask: Cells) -> Cells:
    """Return each connected part's convex hull."""
    out = np.zeros_like(mask)
    for contour in cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]:
        cv2.fillConvexPoly(out, cv2.convexHull(contour), 1)
    return out


def _length(grid: PlanGrid, mask: Cells) -> float:
    contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]
    return sum(cv2.arcLength(contour, closed=True) for contour in contours) * grid.size_m


def _two_faced(points: Floats, normals: Floats, outer: Bools, outward: Floats) -> float:
    """Share of the outline's points behind which a second face stands within a wall's thickness."""
    chosen = np.flatnonzero(outer)[:: max(1, int(outer.sum()) // MAX_SAMPLES)]
    if not len(chosen):
        return 0.0
    from scipy.spatial import KDTree

    near = KDTree(points).query_ball_point(points[chosen], DEEPEST_WALL_M)
    found = []
    for k, others in zip(chosen, near, strict=True):
        away = points[k] - points[others]
        deep = dot_product(away, outward[k])
        beside = np.abs(dot_product(away, np.array([-outward[k, 1], outward[k, 0]])))
        parallel = np.abs(dot_product(normals[others], outward[k])) > FACES_FACING
        # the two faces of a wall are at least this far apart
        found.append(bool(((deep > CRACK_M) & (beside < SAMPLE_M) & parallel).any()))
    return _share(np.asarray(found))


def _large_parts(grid: PlanGrid, wall: Cells) -> int:
    """Parts that stand apart and are larger than a shed."""
    parts = _hull(wall)
    count, _, stats, _ = cv2.connectedComponentsWithStats(parts)
    return int(np.count_nonzero(stats[1:count, cv2.CC_STAT_AREA] * grid.size_m**2 > SHED_M2))


def _share(marked: np.ndarray) -> float:
    return float(marked.mean()) if len(marked) else 0.0
