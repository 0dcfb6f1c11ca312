"""Which level surfaces of a mesh are floors of storeys: roomy, clear overhead, with walls standing around them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.sources.plan_grid import Cells, PlanGrid
from pipeline.sources.surfaces import Bools, Floats, Surfaces, cut, weighted_quantile

CLEAR_M = 1.8  # wall, and clear height, that a storey's floor must have above it
ROOMY_M2 = 4.0  # less than this is a landing, a table or a bed
SHARE = 0.15  # of the largest floor's area, so that the head of a stair on a roof is no storey
WALLED = 0.5  # share of a floor's outer boundary along which walls stand
WALL_REACH_M = 0.5
APART_M = 0.9  # floors closer than this in height are one storey with steps
WINDOW_M = 0.06  # half the window in which faces make one surface: coverings, scans
TURNED = 0.3  # share of area that may be wound the other way in a mesh that is wound with care
HALF_ROOM_M = 0.4  # narrower surfaces are wall tops, sills, shelves and steps


@dataclass(frozen=True, eq=False)
class Layer:
    """Level faces of about one height: where their lower and upper tenth of area lies, and the cells they cover."""

    bottom: float
    top: float
    faces: Bools
    cells: Cells


@dataclass(frozen=True, eq=False)
class FloorSurface:
    """A floor: the layer that gives its height, the cells walls enclose, the faces of all its steps."""

    layer: Layer
    region: Cells
    area_m2: float
    faces: Bools


def find_layers(surfaces: Surfaces, grid: PlanGrid) -> list[Layer]:
    """Return the roomy level surfaces by height; either winding counts, since models disagree about it."""
    flats = surfaces.flats()
    if not flats.any():
        return []
    heights = (surfaces.low[:, 2] + surfaces.high[:, 2]) / 2
    peaks = _peaks(heights[flats], surfaces.area[flats])
    layers = (_layer(surfaces, flats & (np.abs(heights - peak) <= WINDOW_M), heights, grid) for peak in peaks)
    return sorted((layer for layer in layers if layer), key=lambda layer: layer.top)


def _peaks(heights: Floats, areas: Floats, step: float = 0.01) -> list[float]:
    """Heights about which the most area gathers, the largest first, two windows apart."""
    slot = np.floor((heights - heights.min()) / step).astype(np.int64)
    if slot.max() > 1_000_000:  # farther than 10 km from the rest: no part of a house
        keep = slot <= 1_000_000
        slot, areas = slot[keep], areas[keep]
    reach = round(WINDOW_M / step)
    single = np.bincount(slot, areas, minlength=2 * reach + 1)
    gathered = np.convolve(single, np.ones(2 * reach + 1), mode="same")
    peaks = []
    while gathered.max() >= ROOMY_M2:
        best = int(gathered.argmax())
        start = max(best - reach, 0)
        middle = start + int(single[start : best + reach + 1].argmax())  # where most of it lies
        peaks.append(float(heights.min() + (middle + 0.5) * step))
        gathered[max(middle - 2 * reach, 0) : middle + 2 * reach + 1] = 0.0
        gathered[best] = 0.0
    return peaks


def _layer(surfaces: Surfaces, faces: Bools, heights: Floats, grid: PlanGrid) -> Layer | None:
    if not faces.any():
        return None
    cells = grid.cover(surfaces.triangles(faces)[:, :, :2])
    cells = grid.opened(grid.closed(cells, 0.15), HALF_ROOM_M)
    if grid.area(cells) < ROOMY_M2:
        return None
    height, area = heights[faces], surfaces.area[faces]
    bottom, top = weighted_quantile(height, area, 0.1), weighted_quantile(height, area, 0.9)
    return Layer(bottom, top, faces, cells)


def find_floors(surfaces: Surfaces, walls: Bools, layers: list[Layer], grid: PlanGrid) -> list[FloorSurface]:
    """Return the storeys' floors from the lowest to the highest; none where walls stand without a floor."""
    found = [_floor(surfaces, walls, layer, layers, grid) for layer in layers]
    floors = sorted((floor for floor in found if floor), key=lambda floor: -floor.area_m2)
    kept: list[FloorSurface] = []
    for floor in floors:
        near = [i for i, other in enumerate(kept) if abs(other.layer.top - floor.layer.top) < APART_M]
        if near:  # a step within the storey of a larger floor
            other = kept[near[0]]
            ups = _looks_up(surfaces, other.layer), _looks_up(surfaces, floor.layer)
            if min(ups) < TURNED and max(ups) > 1 - TURNED:  # one is the underside of the other's slab
                kept[near[0]] = other if ups[0] > ups[1] else floor
                continue
            kept[near[0]] = FloorSurface(other.layer, other.region, other.area_m2, other.faces | floor.faces)
        elif floor.area_m2 >= SHARE * floors[0].area_m2:
            kept.append(floor)
    return sorted(kept, key=lambda floor: floor.layer.top)


def _looks_up(surfaces: Surfaces, layer: Layer) -> float:
    """Share of a layer's area that is wound to look up."""
    area = surfaces.area[layer.faces]
    return float(area[surfaces.normal[layer.faces, 2] > 0].sum() / area.sum())


def _floor(surfaces: Surfaces, walls: Bools, layer: Layer, layers: list[Layer], grid: PlanGrid) -> FloorSurface | None:
    """Judge one layer: what of it is clear overhead and lies among walls, and how much of its rim they line."""
    free = layer.cells.copy()
    for other in layers:
        if layer.top + WINDOW_M < other.top < layer.top + CLEAR_M:
            free[other.cells > 0] = 0
    free = grid.opened(free, HALF_ROOM_M)
    # Lintels over wide windows stand for the wall there; a low storey has none at the second height.
    segments = np.concatenate([cut(surfaces, walls, layer.top + height) for height in (CLEAR_M - 0.05, 2.15)])
    standing = grid.trace(segments) & grid.grown(free, WALL_REACH_M)
    region = _filled(free & _hull(standing))
    area = grid.area(region)
    rim = region & grid.grown(1 - region, grid.size_m)
    if area < ROOMY_M2:
        return None
    lined = np.count_nonzero(rim & grid.grown(standing, WALL_REACH_M)) / np.count_nonzero(rim)
    return FloorSurface(layer, region, area, layer.faces) if lined >= WALLED else None


def enclosed_cells(surfaces: Surfaces, walls: Bools, foot: float, grid: PlanGrid) -> Cells:
    """Return the convex hull of the walls that stand a metre over ``foot``: the most that a storey there can hold."""
    return _hull(grid.trace(cut(surfaces, walls, foot + 1.0)))


def _hull(mask: Cells) -> Cells:
    """Convex hull of the marked cells: where walls could enclose something."""
    out = np.zeros_like(mask)
    points = cv2.findNonZero(mask)
    if points is not None:
        cv2.fillConvexPoly(out, cv2.convexHull(points), 1)
    return out


def _filled(mask: Cells) -> Cells:
    """Fill a mask's holes: stair wells, and what furniture covers."""
    contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[-2]
    return np.asarray(cv2.drawContours(np.zeros_like(mask), contours, -1, 1, cv2.FILLED), np.uint8)
