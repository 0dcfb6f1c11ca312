"""Find the levels of a z-up mesh.

R1  A floor is a level surface with room to stand on and 1.8 m of wall around and clear height above it
    (``floors.find_floors``): slabs, ceilings, table tops, sills and wall tops have area too and are none.
    A floor less than 2.15 m over another one of the same place, and smaller than half of it, is a landing, a row of
    shelves or of door heads.
R2  Walls without a floor are a house of one level that begins at the foot of the walls; such a level may also lie
    below the lowest floor, where a full storey of walls goes down from it.
    Ground that lies under the foot of all walls gives the floor's area, not its height.
    A lowest floor that lies over the foot of the walls and is a small part of the house is the tops of furniture.
R3  Walls may be looked at up to the underside of what closes the level: the next floor's slab, a roof slab, else the
    top of the walls. A hung ceiling does not close it: nearly all walls run on through it, as through no slab. What
    hardly any wall runs on through closes it, whatever stands on it: a slab under the foot of a roof, but not the
    ceilings of some rooms, lower than those of others.
R4  What the source calls floor is the floor's area where it is most of it; what it calls ceiling or roof is no floor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from shapely import MultiPolygon, Polygon

from pipeline.rejection import Reason, Rejection
from pipeline.sources.floor_area import floor_area
from pipeline.sources.floors import APART_M, CLEAR_M, FloorSurface, Layer, enclosed_cells, find_floors, find_layers
from pipeline.sources.plan_grid import Cells, PlanGrid
from pipeline.sources.surfaces import Bools, Surfaces, WallProfile, weighted_quantile
from pipeline.sources.voids import open_below
from pipeline.values import Mesh

BELOW_M = 0.3  # faces this far under the floor stay with the level
MARGIN_M = 0.05  # the last height stays this far under what closes the level
SLAB_M = 0.65  # the thickest slab between two storeys
ATTIC_M = 1.0  # walls that go on so far over a slab are an attic's; over less, it may be a hung ceiling
THROUGH = 0.9  # of the wall length that reaches a layer; where more runs on through it, it hangs between the walls
ENDED = 0.05  # where no more runs on through it, the walls end there
SHORTEST_WALLS_M = 2.0
FURNITURE_M = 0.25
HOVER_M = 0.15
HOVER_SHARE = 0.15  # of the usual wall length
FURNITURE_SHARE = 0.4  # of the plan
LOWEST_STOREY_M = 2.15  # from floor to floor, where one lies over the other
MIN_SHARE = 0.1  # of the house's plan; a smaller upper floor is the head of a stair, or a row of shelves
NAMED_SHARE = 0.5  # of a surface, beyond which its names are believed


@dataclass(frozen=True, eq=False)
class FoundLevel:
    """One level of a mesh: ``walls`` with the floor at z = 0; ``floor_z`` and ``ceiling_m`` (above it) in metres.

    ``below`` is where nothing lies between the heights of this floor and of a lower one (``open_below``).
    """

    floor_z: float
    ceiling_m: float
    walls: Mesh
    floor: Polygon | MultiPolygon | None
    below: Polygon | MultiPolygon | None = None


def find_levels(
    mesh: Mesh, named_floor: Bools | None = None, named_ceiling: Bools | None = None
) -> tuple[FoundLevel, ...]:
    """Return the levels of a z-up mesh in metres, from the lowest to the highest.

    ``named_floor`` and ``named_ceiling`` mark the faces (m,) that the source calls so.

    Raises
    ------
    Rejection
        NO_LEVEL where no wall of 1.8 m stands.
    """
    surfaces = Surfaces.of(mesh)
    walls = surfaces.walls()
    profile = WallProfile.of(surfaces, walls) if walls.any() else None
    foot = _foot(surfaces, walls, profile) if profile else None
    if profile is None or foot is None:
        detail = f"no wall of {CLEAR_M} m stands among the {len(mesh.faces):,} faces"
        raise Rejection("source", Reason.NO_LEVEL, detail, "check the up axis and the units, or give --up and --units")
    grid = PlanGrid.over(*wall_bounds(surfaces, walls))
    layers = find_layers(surfaces, grid)
    none = np.zeros(len(mesh.faces), np.bool_)
    names = none if named_floor is None else named_floor, none if named_ceiling is None else named_ceiling
    candidates = [layer for layer in layers if not _is_named(surfaces, layer, names[1])]
    floors: list[FloorSurface | None] = list(find_floors(surfaces, walls, candidates, grid))
    enclosed = enclosed_cells(surfaces, walls, foot, grid)
    lowest = floors[0] if floors else None
    if lowest and foot < lowest.layer.top - FURNITURE_M and lowest.area_m2 < FURNITURE_SHARE * grid.area(enclosed):
        floors = floors[1:]  # R2: tops of beds and tables
        lowest = floors[0] if floors else None
    if lowest is None or foot < lowest.layer.top - CLEAR_M:
        floors = [None, *floors]
    floors = _storeys(floors, foot, grid.area(enclosed))
    heights = [floor.layer.top if floor else foot for floor in floors]
    if heights[0] < foot - HOVER_M and profile.length_at(heights[0] + HOVER_M / 2) < HOVER_SHARE * profile.usual:
        heights[0] = foot  # R2: ground under the house
    found = []
    for floor, height in zip(floors, heights, strict=True):
        around = _profile_around(surfaces, walls, floor, grid) if len(heights) > 1 else profile
        region = floor.region if floor else enclosed
        near = walls & grid.at(grid.grown(region, 0.5), (surfaces.low[:, :2] + surfaces.high[:, :2]) / 2)
        through = partial(_through, surfaces, near)
        above = _next_floor(floor, height, floors)
        ceiling = _ceiling(around, layers, region, height, above=above, through=through)
        part = mesh if len(heights) == 1 else _slice(surfaces, height - BELOW_M, height + ceiling)
        area = _area(surfaces, floor, names[0], grid) if floor else None
        below = open_below(surfaces, height, floors, grid)
        found.append(FoundLevel(height, ceiling, _lowered(part, height), area, below))
    return tuple(found)


def _storeys(floors: list[FloorSurface | None], foot: float, enclosed_m2: float) -> list[FloorSurface | None]:
    """R1: leave out what lies too close over a larger floor; the first may be the unseen floor of the walls' foot."""
    kept: list[FloorSurface | None] = []
    for floor in floors:
        below = kept[-1] if kept else None
        if kept and floor is not None:
            size = below.area_m2 if below else enclosed_m2
            height = below.layer.top if below else foot
            shared = np.count_nonzero(floor.region & below.region) if below else np.count_nonzero(floor.region)
            over = shared >= 0.5 * np.count_nonzero(floor.region)
            if over and floor.layer.top - height < LOWEST_STOREY_M and floor.area_m2 < 0.5 * size:
                continue
            if floor.area_m2 < MIN_SHARE * enclosed_m2:
                continue
        kept.append(floor)
    return kept


def _is_named(surfaces: Surfaces, layer: Layer, named: Bools) -> bool:
    """Tell whether most of a layer's area is called so."""
    named_area = float(surfaces.area[layer.faces & named].sum())
    return named_area > NAMED_SHARE * float(surfaces.area[layer.faces].sum())


def _area(surfaces: Surfaces, floor: FloorSurface, named: Bools, grid: PlanGrid) -> Polygon | MultiPolygon | None:
    """R4: plan area of the faces that the source calls floor, where they are most of it, else of all at its height."""
    height = (surfaces.low[:, 2] + surfaces.high[:, 2]) / 2
    called = named & surfaces.flats() & (np.abs(height - floor.layer.top) < APART_M)
    flat = float(surfaces.area[called].sum())
    faces = called if flat > NAMED_SHARE * floor.area_m2 else floor.faces
    return floor_area(surfaces.triangles(faces)[:, :, :2], floor.region, grid)


def wall_bounds(surfaces: Surfaces, walls: Bools) -> tuple[np.ndarray, np.ndarray]:
    """Plan bounds (x, y) low and high of all but half a percent of the wall area on each side."""
    low, high, area = surfaces.low[walls, :2], surfaces.high[walls, :2], surfaces.area[walls]
    ends = [[weighted_quantile(low[:, i], area, 0.005), weighted_quantile(high[:, i], area, 0.995)] for i in (0, 1)]
    bounds = np.asarray(ends).T
    return bounds[0], bounds[1]


def _foot(surfaces: Surfaces, walls: Bools, profile: WallProfile) -> float | None:
    """Return the exact height at which half of the usual wall length begins, or None if no storey of walls stands."""
    usual = profile.usual
    if usual < SHORTEST_WALLS_M:
        return None
    standing = np.flatnonzero(profile.length >= usual / 2)
    bottom, top = profile.edges[standing[0]], profile.edges[standing[-1] + 1]
    if top - bottom < CLEAR_M:
        return None
    low = surfaces.low[walls, 2]
    near = np.abs(low - bottom) < 0.02
    return weighted_quantile(low[near], surfaces.area[walls][near], 0.5) if near.any() else float(bottom)


def _profile_around(surfaces: Surfaces, walls: Bools, floor: FloorSurface | None, grid: PlanGrid) -> WallProfile:
    """Profile of the walls that stand in or around a floor: in a split level, those of its own half."""
    if floor is None:
        return WallProfile.of(surfaces, walls)
    middle = (surfaces.low[:, :2] + surfaces.high[:, :2]) / 2
    return WallProfile.of(surfaces, walls & grid.at(grid.grown(floor.region, 0.5), middle))


def _next_floor(floor: FloorSurface | None, height: float, floors: list[FloorSurface | None]) -> float | None:
    """Height of the next floor over this one; in a split level the neighbour half a storey up is not over it."""
    for other in floors:
        if other and other.layer.top >= height + CLEAR_M:
            shared = np.count_nonzero(other.region & floor.region) if floor else 0
            if floor is None or shared >= 0.25 * min(np.count_nonzero(floor.region), np.count_nonzero(other.region)):
                return other.layer.top
    return None


def _ceiling(
    profile: WallProfile,
    layers: list[Layer],
    region: Cells,
    height: float,
    *,
    above: float | None,
    through: Callable[[Layer], float],
) -> float:
    """R3: height above the floor up to which this level's walls may be looked at."""
    end = above if above is not None else profile.end_above(height + CLEAR_M, height + 0.3)
    size = np.count_nonzero(region)
    covers = [
        layer
        for layer in layers
        if height + CLEAR_M < layer.top <= end + 0.07 and np.count_nonzero(layer.cells & region) >= size / 2
    ]
    closing = [cover for cover in covers if end - cover.top < 0.1]
    if not closing and above is None:  # a slab under an attic or a parapet, on which walls go on
        closing = [c for c in covers if through(c) <= (THROUGH if end - c.top > ATTIC_M else ENDED)]
    if not closing:  # sheets, or walls open above; a hung ceiling closes nothing
        return float(end - height - (MARGIN_M if above is not None else 0.0))
    slab = closing[-1]
    lower = [cover.bottom for cover in covers if slab.top - SLAB_M <= cover.bottom < slab.bottom]
    thin = slab.top - slab.bottom < 0.02
    underside = lower[-1] if thin and lower else slab.bottom
    return float(max(underside - MARGIN_M, height + CLEAR_M) - height)


def _through(surfaces: Surfaces, walls: Bools, layer: Layer) -> float:
    """R3: which share of the walls that reach a layer runs on through it, face by face."""
    below = layer.bottom - MARGIN_M
    reach = walls & (surfaces.low[:, 2] < below) & (surfaces.high[:, 2] > below)
    length = surfaces.area[reach] / (surfaces.high[reach, 2] - surfaces.low[reach, 2])
    through = surfaces.high[reach, 2] > layer.top + MARGIN_M
    return float(length[through].sum()) / max(float(length.sum()), 1e-9)


def _slice(surfaces: Surfaces, low: float, high: float) -> Mesh:
    """Faces between two heights, also those that only reach in, with only their own vertices."""
    touched = (surfaces.low[:, 2] <= high) & (surfaces.high[:, 2] > low + 1e-6)
    used, faces = np.unique(surfaces.mesh.faces[touched], return_inverse=True)
    return Mesh(surfaces.mesh.vertices[used], faces.reshape(-1, 3).astype(np.int64))


def _lowered(mesh: Mesh, height: float) -> Mesh:
    return Mesh(mesh.vertices - (0.0, 0.0, height), mesh.faces)
