"""What stands in a storey of a cloud: a picture of the plan from above, then polygons, in four layers of height.

R1  The picture is turned to the walls' main direction, so that straight walls have straight edges in it.
R2  A cell stands in a band of heights where most of the band's steps have points: outliers fill few of them.
R3  Wall is what stands under the ceiling too; furniture does not. A wall of noise is drawn in to its middle.
    What lies behind it, where no floor was seen, is wall for THICK_M, as only one face of an outer wall is seen.
R4  What two sheets enclose, and no floor shows between them, is the inside of a wall.
R5  Holes of occlusion, narrower than a door, are closed where wall stands above.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.overlay import united
from pipeline.sources.points_storeys import Storey
from pipeline.sources.points_voxels import Voxels

CELL_M = 0.02
STEP_M = 0.1
SHARE = 0.5
SLIT_M = 0.36
HOLE_M = 0.3
HIGH_HOLE_M = 0.8  # above the doors a gap of a wall is none of them
SPECK_M = 0.2
FLOOR_M = 0.08
RUN = (11, 41)
"""Cells over which a wall is looked at along itself: more of them in a thin cloud, for ENOUGH points."""
ENOUGH = 60
WIDE = 9
RIDGE = 0.75
THICK_M = 0.06
FRINGE_M = 0.12
SMOOTH = 1.0  # cells by which an edge may be drawn straighter
USUAL = 0.98  # a cell with this share of all below it is one of a wall
FAINT = 0.2
LEVELS = (0.0, 0.85, 1.5, 2.05)
"""Where the layers begin, metres above the floor; the last goes up to the ceiling."""

Mask = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Standing:
    """Walls by layer (bottom, top, plan area), and the floor's plan area, in the cloud's plan axes."""

    layers: tuple[tuple[float, float, BaseGeometry], ...]
    floor: BaseGeometry


def find_walls(voxels: Voxels, storey: Storey) -> Standing:
    """Find what stands in a storey."""
    points = voxels.centres()
    height = points[:, 2] - storey.floor_m
    clear = storey.ceiling_m - storey.floor_m
    points, height = points[(height > -FLOOR_M) & (height < clear)], height[(height > -FLOOR_M) & (height < clear)]
    picture = _Picture.of(points[:, :2], (height > 0.3) & (height < clear - FLOOR_M))
    high = picture.standing(height, LEVELS[-1] + STEP_M, clear - FLOOR_M)
    floor = picture.level(np.abs(height) < FLOOR_M)
    high = _closed(high, HIGH_HOLE_M)
    behind = _without_floor(high, floor)
    layers = []
    for bottom, top in zip(LEVELS, (*LEVELS[1:], clear), strict=True):
        last = top == clear
        mask = high if last else picture.standing(height, bottom + 0.15, min(top, clear) - 0.05) & _grown(high, 0.06)
        mask = _without_specks(mask if last else _closed(mask, HOLE_M))
        mask = _with_insides(mask | (_grown(mask, THICK_M) & behind), floor)
        layers.append((bottom, top, picture.polygons(mask)))
    return Standing(tuple(layers), picture.polygons(_closed(floor, SLIT_M)))


@dataclass(frozen=True, eq=False)
class _Picture:
    """Cells of CELL_M over the plan, turned by ``angle``; ``cell`` is each point's (row, column)."""

    angle: float
    origin: npt.NDArray[np.float64]
    shape: tuple[int, int]
    cell: npt.NDArray[np.int64]

    @classmethod
    def of(cls, plan: npt.NDArray[np.float64], upright: npt.NDArray[np.bool_]) -> _Picture:
        angle = _main_direction(plan[upright] if upright.any() else plan)
        turned = plan @ _turn(-angle).T
        origin = turned.min(axis=0) - 0.5
        cell = np.floor((turned - origin) / CELL_M).astype(np.int64)[:, ::-1]
        rows, columns = (int(most) + 1 + int(0.5 / CELL_M) for most in cell.max(axis=0))
        return cls(angle, origin, (rows, columns), cell)

    def level(self, chosen: npt.NDArray[np.bool_]) -> Mask:
        """Cells around which the chosen points lie as close as in most places."""
        mass = np.zeros(self.shape, np.float32)
        np.add.at(mass, tuple(self.cell[chosen].T), 1.0)
        mass = np.asarray(cv2.blur(mass, (5, 5)), np.float32)
        usual = float(np.median(mass[mass > 0])) if mass.any() else 0.0
        return _closed((mass > FAINT * usual).astype(np.uint8), 0.1)

    def standing(self, height: npt.NDArray[np.float64], low: float, high: float) -> Mask:
        """R2, R3."""
        steps = max(1, round((high - low) / STEP_M))
        edges = np.linspace(low, max(high, low + STEP_M), steps + 1)
        filled = np.zeros(self.shape, np.float32)
        mass = np.zeros(self.shape, np.float32)
        for a, b in pairwise(edges):
            chosen = (height >= a) & (height < b)
            here = np.zeros(self.shape, np.float32)
            np.add.at(here, tuple(self.cell[chosen].T), 1.0)
            mass += here
            filled += _dilated((here > 0).astype(np.uint8), 3)
        return _ridges(mass, filled >= SHARE * steps)

    def polygons(self, mask: Mask) -> BaseGeometry:
        """The mask's area in the cloud's plan axes."""
        contours, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)[-2:]
        rings = []
        for contour, (_, _, _, parent) in zip(contours, tree[0] if tree is not None else (), strict=True):
            ring = cv2.approxPolyDP(contour, SMOOTH, closed=True)[:, 0].astype(np.float64)
            if len(ring) > 2:
                shape = shapely.make_valid(shapely.Polygon(ring * CELL_M + self.origin + CELL_M / 2))
                grow = CELL_M / 2 if parent < 0 else -CELL_M / 2  # contours run through the cells' middles
                rings.append((parent < 0, shapely.buffer(shape, grow, join_style="mitre")))
        outer = united([shape for is_outer, shape in rings if is_outer])
        inner = united([shape for is_outer, shape in rings if not is_outer])
        area = shapely.difference(outer, inner)
        return shapely.transform(area, lambda xy: xy @ _turn(self.angle).T)


def _ridges(mass: npt.NDArray[np.float32], filled: npt.NDArray[np.bool_]) -> Mask:
    """R3: filled cells in the middle of a wall along rows or columns, where it has most of its points."""
    found = np.zeros(mass.shape, np.uint8)
    usual = float(np.quantile(mass[mass > 0], USUAL)) if mass.any() else 0.0
    run = int(np.clip(ENOUGH / max(usual, 1e-9), *RUN)) // 2 * 2 + 1
    for along, across in (((run, 1), (1, WIDE)), ((1, run), (WIDE, 1))):  # cv2 has (width, height)
        smooth = np.asarray(cv2.blur(mass, along), np.float32)
        most = np.asarray(cv2.dilate(smooth, np.ones(across[::-1], np.uint8)), np.float32)
        whole = np.asarray(cv2.blur(filled.astype(np.float32), along), np.float32)
        found |= ((smooth > np.maximum(RIDGE * most, FAINT * usual)) & (whole >= SHARE)).astype(np.uint8)
    return found


def _main_direction(plan: npt.NDArray[np.float64]) -> float:
    """R1: the angle, radians in a quarter turn, at which the points fall into the fewest rows and columns."""
    chosen = plan[:: max(1, len(plan) // 50_000)]
    chosen = chosen + np.random.default_rng(0).uniform(-CELL_M / 2, CELL_M / 2, chosen.shape)  # off the voxels' grid

    def sharpness(angle: float) -> float:
        turned = chosen @ _turn(-angle).T
        rows = [np.bincount(np.floor((axis - axis.min()) / 0.03).astype(np.int64)) for axis in turned.T]
        return float(sum((row.astype(np.float64) ** 2).sum() for row in rows))

    coarse = max(np.radians(np.arange(0, 90, 1.5)), key=sharpness)
    return float(max(coarse + np.radians(np.arange(-1.5, 1.51, 0.125)), key=sharpness))


def _turn(angle: float) -> npt.NDArray[np.float64]:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _dilated(mask: Mask, cells: int) -> Mask:
    return np.asarray(cv2.dilate(mask, np.ones((cells, cells), np.uint8)), np.uint8)


def _grown(mask: Mask, metres: float) -> Mask:
    return _dilated(mask, 2 * round(metres / CELL_M) + 1)


def _closed(mask: Mask, metres: float) -> Mask:
    """R5."""
    long = np.ones((1, max(1, round(metres / CELL_M))), np.uint8)
    both = [np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, line), np.uint8) for line in (long, long.T)]
    return both[0] | both[1]


def _with_insides(mask: Mask, floor: Mask) -> Mask:
    """R4."""
    inside = _closed(mask, SLIT_M) & (1 - mask) & (1 - floor)
    return mask | np.asarray(cv2.morphologyEx(inside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), np.uint8)


def _without_floor(high: Mask, floor: Mask) -> Mask:
    """R3: what the walls part off and has no floor: the outside, and the inside of walls."""
    count, labels = cv2.connectedComponents(1 - high, connectivity=4)
    area = np.bincount(labels.ravel(), minlength=count)
    seen = np.bincount(labels.ravel(), weights=floor.ravel(), minlength=count)
    bare: Mask = (seen < 0.5 * area)[labels].astype(np.uint8)
    size = round(FRINGE_M / CELL_M)
    inner = cv2.morphologyEx(floor & (1 - _dilated(high, 3)), cv2.MORPH_OPEN, np.ones((size, size), np.uint8))
    return bare & (1 - np.asarray(inner, np.uint8))  # noise throws a fringe of floor behind the walls


def _without_specks(mask: Mask) -> Mask:
    count, labels, sizes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    longest = np.maximum(sizes[:, cv2.CC_STAT_WIDTH], sizes[:, cv2.CC_STAT_HEIGHT])
    keep = longest * CELL_M >= SPECK_M
    keep[0] = False
    kept: Mask = keep[labels].astype(np.uint8)
    return kept if count > 1 else mask
