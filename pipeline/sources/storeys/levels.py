"""Divide the mesh of a house (metres, z up) into levels: find its floors, and cut the mesh above each.

R1  A floor is a level surface with room to stand on and 1.8 m of wall around and clear height above it
    (``find_floors``): slabs, ceilings, table tops, sills and wall tops have area too and are not floors.
    A floor less than 2.15 m over another one of the same place, and smaller than half of it, is a landing, a row of
    shelves or of door heads. Two floors that lie side by side under one ceiling, and closer in height than a cut
    through the walls lies over a floor, are one level: a hall of which a part is raised. The larger
    gives the height.
R2  Walls without a floor are a house of one level that begins at the foot of the walls; such a level may also lie
    below the lowest floor, where a full storey of walls goes down from it.
    Ground that lies under the foot of all walls gives the floor's area, not its height.
    A lowest floor that lies over the foot of the walls and is a small part of the house is the tops of furniture.
R3  Walls may be looked at up to the underside of what closes the level: the next floor's slab, a roof slab, else the
    top of the walls. A hung ceiling does not close it: nearly all walls run on through it, as through no slab. What
    hardly any wall runs on through closes it, whatever stands on it: a slab under the foot of a roof, but not the
    ceilings of some rooms, lower than those of others.
R4  What the source calls floor is the floor's area where it is most of it; what it calls ceiling or roof is no floor.
R5  Where a person says the heights of the floors, these are the levels. A level surface within ``SNAP_M`` gives the
    exact height.

A floor's area is exact where its faces are few, and comes from the grid where a scan has many.

**Voids**: where one looks down from a level onto the floor of a lower one: a stair's void, a gallery, the air over a
terrace.

V1  Nothing that lies level or sloped is within reach under the floor's height: neither a step of the floor, nor the
    ceiling below it, where a source draws no floor above that. The upper steps of a stair are, so that its void is open
    in part.
V2  A floor of a lower level lies under it: in a storey that was exported by itself, what the floor lacks may be
    missing for any reason.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from houseexpo.corrections.openings import SNAP_M
from pipeline.geometry.areas import polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.storeys.surfaces import (
    Bools,
    Cells,
    Floats,
    PlanGrid,
    Surfaces,
    WallProfile,
    cut_at_height,
    weighted_quantile,
)
from pipeline.sources.tolerances import (
    CHEST_AND_HEAD_M,
    COVER_MARGIN_M,
    FAR_FROM_ORIGIN_M,
    FEW,
    FLOOR_FACES,
    LAYER_HALF_M,
    LINTEL_CUT_M,
    LONGEST_AT_LEAST_M,
    MANY_BODY_FACES,
    OUTSIDE_SHARE,
    SCARCELY,
    SPLIT_LEVEL_M,
    THICKEST_SLAB_M,
    TINY,
    UPRIGHT_M2,
    VERTICAL,
)
from pipeline.tolerances import (
    AROUND_M,
    CM_M,
    CRACK_M,
    FOOT_M,
    HAND_M,
    HARDLY,
    HEAD_M,
    MM_M,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PLACE_M,
    ROOMY_M2,
    SAME,
    SOME,
    SPECK,
    STANDS,
    THIN_WALL_M,
    WALL_M,
)
from pipeline.values import Mesh


def floor_polygon(triangles: Floats, region: Cells, grid: PlanGrid) -> Polygon | MultiPolygon | None:
    """Unite plan triangles (k, 3, 2); beyond MANY_BODY_FACES outline the grid's ``region`` instead."""
    if len(triangles) > MANY_BODY_FACES:
        parts = _outlines(region, grid)
    else:
        parts = shapely.polygons(triangles)
        parts = parts[shapely.area(parts) > UPRIGHT_M2]
    area = shapely.union_all(parts, grid_size=MM_M)
    if area.area > 2 * grid.area(region):  # ground that goes on outside, at the floor's own height
        hull = shapely.union_all(_outlines(region, grid)).convex_hull
        area = area.intersection(hull.buffer(PLACE_M, join_style="mitre"))  # the ground around is cut off
    pieces = [piece for piece in shapely.get_parts(area) if isinstance(piece, Polygon) and piece.area > 0]
    if not pieces:
        return None
    return pieces[0] if len(pieces) == 1 else MultiPolygon(pieces)


def _outlines(region: Cells, grid: PlanGrid) -> np.ndarray:
    contours = cv2.findContours(region, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[-2]
    rings = [contour[:, 0] * grid.size_m + np.asarray(grid.origin) + grid.size_m / 2 for contour in contours]
    half = grid.size_m / 2  # contours run through the centres of the outermost cells
    return np.asarray([Polygon(ring).buffer(half, join_style="mitre") for ring in rings if len(ring) > 2])


@dataclass(frozen=True, eq=False)
class LevelLayer:
    """Level faces of about one height: where their lower and upper tenth of area lies, and the cells they cover."""

    bottom: float
    top: float
    faces: Bools
    cells: Cells


@dataclass(frozen=True, eq=False)
class FloorSurface:
    """A floor: the layer that gives its height, the cells of it that walls enclose, their area.

    ``faces`` and ``steps`` are the faces and the enclosed cells of the layer and of all its steps.
    """

    layer: LevelLayer
    region: Cells
    area_m2: float
    faces: Bools
    steps: Cells


def find_layers(surfaces: Surfaces, grid: PlanGrid) -> list[LevelLayer]:
    """Return the roomy level surfaces by height; either winding counts, since models disagree about it."""
    flats = surfaces.flats()
    if not flats.any():
        return []
    heights = (surfaces.low[:, 2] + surfaces.high[:, 2]) / 2
    peaks = _peaks(heights[flats], surfaces.area[flats])
    layers = (_layer(surfaces, flats & (np.abs(heights - peak) <= LAYER_HALF_M), heights, grid) for peak in peaks)
    return sorted((layer for layer in layers if layer), key=lambda layer: layer.top)


def _peaks(heights: Floats, areas: Floats) -> list[float]:
    """Heights about which the most area gathers, the largest first, two windows apart."""
    slot = np.floor((heights - heights.min()) / CM_M).astype(np.int64)  # step of profiles over the height
    if slot.max() > 1_000_000:  # farther than 10 km from the rest: no part of a house
        keep = slot <= 1_000_000
        slot, areas = slot[keep], areas[keep]
    reach = round(LAYER_HALF_M / CM_M)
    single = np.bincount(slot, areas, minlength=2 * reach + 1)
    gathered = np.convolve(single, np.ones(2 * reach + 1), mode="same")
    peaks = []
    while gathered.max() >= ROOMY_M2:  # a smaller level surface is a landing, a table or a bed
        best = int(gathered.argmax())
        start = max(best - reach, 0)
        middle = start + int(single[start : best + reach + 1].argmax())  # where most of it lies
        peaks.append(float(heights.min() + (middle + 0.5) * CM_M))
        gathered[max(middle - 2 * reach, 0) : middle + 2 * reach + 1] = 0.0
        gathered[best] = 0.0
    return peaks


def _layer(surfaces: Surfaces, faces: Bools, heights: Floats, grid: PlanGrid) -> LevelLayer | None:
    if not faces.any():
        return None
    cells = grid.cover(surfaces.triangles(faces)[:, :, :2])
    # gaps in a level surface are closed
    cells = grid.drop_narrow(grid.fill_gaps(cells, THIN_WALL_M), WALL_M)
    if grid.area(cells) < ROOMY_M2:
        return None
    height, area = heights[faces], surfaces.area[faces]
    bottom, top = weighted_quantile(height, area, FLOOR_FACES[0]), weighted_quantile(height, area, FLOOR_FACES[1])
    return LevelLayer(bottom, top, faces, cells)


def find_floors(surfaces: Surfaces, walls: Bools, layers: list[LevelLayer], grid: PlanGrid) -> list[FloorSurface]:
    """Return the storeys' floors from the lowest to the highest; none where walls stand without a floor."""
    found = [_floor(surfaces, walls, layer, layers, grid) for layer in layers]
    floors = sorted((floor for floor in found if floor), key=lambda floor: -floor.area_m2)
    kept: list[FloorSurface] = []
    for floor in floors:
        near = [i for i, other in enumerate(kept) if abs(other.layer.top - floor.layer.top) < SPLIT_LEVEL_M]
        if near:  # a step within the storey of a larger floor
            other = kept[near[0]]
            ups = _looks_up(surfaces, other.layer), _looks_up(surfaces, floor.layer)
            shared = np.count_nonzero(floor.region & other.region)
            # a floor more than half of which lies over another is of the same place
            both_sides = shared >= MOST * np.count_nonzero(other.region)
            if both_sides and min(ups) < SOME and max(ups) > 1 - SOME:  # one is the underside of the other's slab
                kept[near[0]] = other if ups[0] > ups[1] else floor
                continue
            kept[near[0]] = replace(other, faces=other.faces | floor.faces, steps=other.steps | floor.steps)
        # the head of a stair on a roof is no storey
        elif floor.area_m2 >= HARDLY * floors[0].area_m2:
            kept.append(floor)
    return sorted(kept, key=lambda floor: floor.layer.top)


def _looks_up(surfaces: Surfaces, layer: LevelLayer) -> float:
    """Share of a layer's area that is wound to look up."""
    area = surfaces.area[layer.faces]
    return float(area[surfaces.normal[layer.faces, 2] > 0].sum() / area.sum())


def _floor(
    surfaces: Surfaces, walls: Bools, layer: LevelLayer, layers: list[LevelLayer], grid: PlanGrid
) -> FloorSurface | None:
    """Judge one layer: what of it is clear overhead and lies among walls, and how much of its rim they line."""
    free = layer.cells.copy()
    for other in layers:
        if layer.top + LAYER_HALF_M < other.top < layer.top + HEAD_M:
            free[other.cells > 0] = 0
    free = grid.drop_narrow(free, WALL_M)  # narrower level surfaces are wall tops, sills and steps
    # Lintels over wide windows stand for the wall there; a low storey has none at the second height.
    segments = np.concatenate(
        [cut_at_height(surfaces, walls, layer.top + height) for height in (HEAD_M - COVER_MARGIN_M, LINTEL_CUT_M)]
    )
    standing = grid.trace(segments) & grid.grow(free, PLACE_M)  # a wall this near to a floor's boundary stands along it
    region = _fill_holes(free & _hull(standing))
    area = grid.area(region)
    rim = region & grid.grow(1 - region, grid.size_m)
    if area < ROOMY_M2:
        return None
    lined = np.count_nonzero(rim & grid.grow(standing, PLACE_M)) / np.count_nonzero(rim)
    steps = _fill_holes(layer.cells & _hull(standing))
    # along half of a floor's outer boundary stand walls
    return FloorSurface(layer, region, area, layer.faces, steps) if lined >= MOST else None


def enclosed_cells(surfaces: Surfaces, walls: Bools, foot: float, grid: PlanGrid) -> Cells:
    """Return the convex hull of the walls that stand a metre over ``foot``: the most that a storey there can hold."""
    return _hull(grid.trace(cut_at_height(surfaces, walls, foot + 1.0)))


def _hull(mask: Cells) -> Cells:
    """Convex hull of the marked cells: where walls could enclose something."""
    out = np.zeros_like(mask)
    points = cv2.findNonZero(mask)
    if points is not None:
        cv2.fillConvexPoly(out, cv2.convexHull(points), 1)
    return out


def _fill_holes(mask: Cells) -> Cells:
    """Fill a mask's holes: stair wells, and what furniture covers."""
    contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[-2]
    return np.asarray(cv2.drawContours(np.zeros_like(mask), contours, -1, 1, cv2.FILLED), np.uint8)


def open_area_below(
    surfaces: Surfaces, height: float, floors: Sequence[FloorSurface | None], grid: PlanGrid
) -> Polygon | MultiPolygon | None:
    """Return that area of the plan for the level at ``height``, or None if it is empty."""
    lower = [floor.steps for floor in floors if floor is not None and floor.layer.top <= height - HEAD_M]
    if not lower:
        return None  # V2
    # what lies so far under and over the floor fills a void
    near = (surfaces.high[:, 2] > height - AROUND_M) & (surfaces.low[:, 2] < height + FOOT_M)
    covering = near & (np.abs(surfaces.normal[:, 2]) > VERTICAL)
    covered = grid.cover(surfaces.triangles(covering)[:, :, :2])  # V1
    # a narrower void is a crack between floor and wall
    shape = _outline(grid.drop_narrow(np.bitwise_or.reduce(lower) & (1 - covered), HAND_M), grid)
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None


def _outline(mask: Cells, grid: PlanGrid) -> shapely.Geometry:
    """Return the area of a mask's cells, from the runs of its rows."""
    edges = np.diff(np.pad(mask.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, start = np.nonzero(edges == 1)
    end = np.nonzero(edges == -1)[1]
    (x, y), size = grid.origin, grid.size_m
    return shapely.union_all(shapely.box(x + start * size, y + row * size, x + end * size, y + (row + 1) * size))


@dataclass(frozen=True, eq=False)
class FoundLevel:
    """One level of a mesh: ``walls`` with the floor at z = 0; ``floor_z`` and ``ceiling_m`` (above it) in metres.

    ``below`` is where nothing lies between the heights of this floor and of a lower one (``open_area_below``).
    """

    floor_z: float
    ceiling_m: float
    walls: Mesh
    floor: Polygon | MultiPolygon | None
    below: Polygon | MultiPolygon | None = None


def find_levels(
    mesh: Mesh,
    named_floor: Bools | None = None,
    named_ceiling: Bools | None = None,
    asked: Sequence[float] = (),
) -> tuple[FoundLevel, ...]:
    """Return the levels of a z-up mesh in metres, from the lowest to the highest.

    ``named_floor`` and ``named_ceiling`` mark the faces (m,) that the source calls so. ``asked`` are the heights of the
    floors that a person says, in rising order; then there are these levels and no others (R5).

    Raises
    ------
    Rejection
        NO_LEVEL where no wall of 1.8 m stands.
    """
    surfaces = Surfaces.of(mesh)
    walls = surfaces.walls()
    profile = WallProfile.of(surfaces, walls) if walls.any() else None
    foot = _storey_foot(surfaces, walls, profile) if profile else None
    if profile is None or foot is None:
        x, y, z = np.ptp(mesh.vertices, axis=0)
        detail = f"no wall of {HEAD_M} m stands among the {len(mesh.faces):,} faces, which are {z:.2f} m high in all "
        detail += f"on {x:.1f} x {y:.1f} m"
        advice = (
            "check the up axis and the units, or give --up and --units; --storey-height if the walls are cut off low"
        )
        raise Rejection("source", Reason.NO_LEVEL, detail, advice)
    grid = PlanGrid.over(*wall_bounds(surfaces, walls))
    layers = find_layers(surfaces, grid)
    none = np.zeros(len(mesh.faces), np.bool_)
    names = none if named_floor is None else named_floor, none if named_ceiling is None else named_ceiling
    candidates = [layer for layer in layers if not _is_named(surfaces, layer, names[1])]
    floors: list[FloorSurface | None] = list(find_floors(surfaces, walls, candidates, grid))
    enclosed = enclosed_cells(surfaces, walls, foot, grid)
    lowest = floors[0] if floors else None
    # the tops of furniture cover less of the plan
    small = lowest is not None and grid.area(lowest.steps) < STANDS * grid.area(enclosed)
    if small and lowest and foot < lowest.layer.top - FOOT_M:
        floors = floors[1:]  # R2: tops of beds and tables
        lowest = floors[0] if floors else None
    if lowest is None or foot < lowest.layer.top - HEAD_M:  # clear height of a room, and height of a wall, at least
        floors = [None, *floors]
    floors = _storeys(floors, foot, grid.area(enclosed))
    heights = [floor.layer.top if floor else foot for floor in floors]
    # walls hover where hardly any stands between their feet and the ground
    if heights[0] < foot - THIN_WALL_M and profile.length_at(heights[0] + THIN_WALL_M / 2) < HARDLY * profile.usual:
        heights[0] = foot  # R2: ground under the house
    if asked:  # R5
        floors = [_asked_floor(surfaces, walls, height, layers, grid) for height in asked]
        heights = [floor.layer.top if floor else height for floor, height in zip(floors, asked, strict=True)]
    found = []
    for k, (floor, height) in enumerate(zip(floors, heights, strict=True)):
        is_one = len(heights) == 1 and not asked
        own = walls if is_one or floor is None else _walls_around(surfaces, walls, floor.region, grid)
        around = WallProfile.of(surfaces, own)
        region = floor.region if floor else enclosed_cells(surfaces, walls, height, grid) if asked else enclosed
        near = _walls_around(surfaces, walls, region, grid)
        through = partial(_share_running_through, surfaces, near)
        above = next(iter(heights[k + 1 :]), None) if asked else _next_floor(floor, height, floors)
        ceiling = _ceiling(around, layers, region, height, above=above, through=through)
        # what lies so far under a floor belongs to it
        part = mesh if len(heights) == 1 and not asked else _slice(surfaces, height - FOOT_M, height + ceiling)
        area = _area(surfaces, floor, names[0], grid) if floor else None
        below = open_area_below(surfaces, height, floors, grid)
        found.append(FoundLevel(height, ceiling, _lower(part, height), area, below))
    return tuple(found) if asked else _join_parts_of_halls(found)


def other_floors(mesh: Mesh, taken: Sequence[float]) -> list[float]:
    """Return the heights of level surfaces in a house (metres, z up) that may be floors beside those ``taken``.

    They are a clear height away from them, half of the walls around them stand on them, they are no landings, and the
    largest comes first.
    """
    surfaces = Surfaces.of(mesh)
    walls = surfaces.walls()
    if not walls.any():
        return []
    grid = PlanGrid.over(*wall_bounds(surfaces, walls))
    layers = [(grid.area(layer.cells), layer) for layer in find_layers(surfaces, grid)]
    largest, found = max((area for area, _ in layers), default=0.0), list[tuple[float, float]]()
    for area, layer in layers:
        if area < FEW * largest or any(abs(layer.top - height) < HEAD_M for height in taken):
            continue
        around = _walls_around(surfaces, walls, layer.cells, grid)
        profile = WallProfile.of(surfaces, around) if around.any() else None
        if profile and profile.length_at(layer.top + HEAD_M / 2) >= profile.usual / 2:
            found.append((area, layer.top))
    kept: list[float] = []
    for area, low in sorted(found, reverse=True):
        over = [top for size, top in found if 0.0 <= top - low <= THICKEST_SLAB_M and size >= MOSTLY * area]
        height = max(over)  # not the underside of a slab
        if all(abs(height - other) >= HEAD_M for other in kept):
            kept.append(round(height, 2))
    return kept


def _asked_floor(
    surfaces: Surfaces, walls: Bools, height: float, layers: Sequence[LevelLayer], grid: PlanGrid
) -> FloorSurface | None:
    """Return the nearest level surface within a hand's breadth of a height, None if there is none."""
    near = [layer for layer in layers if abs(layer.top - height) <= SNAP_M]
    if not near:
        return None
    layer = min(near, key=lambda each: abs(each.top - height))
    region = _fill_holes(layer.cells & enclosed_cells(surfaces, walls, layer.top, grid))
    if grid.area(region) < ROOMY_M2:
        return None
    return FloorSurface(layer, region, grid.area(region), layer.faces, region)


def _join_parts_of_halls(levels: Sequence[FoundLevel]) -> tuple[FoundLevel, ...]:
    """Join a level with the next where both end at one ceiling and one cut meets the walls of both.

    The larger floor gives the height.
    """
    kept: list[FoundLevel] = []
    for level in levels:
        low = kept[-1] if kept else None
        if low is None or low.floor is None or level.floor is None or not _are_under_one_ceiling(low, level):
            kept.append(level)
            continue
        lasting = low if low.floor.area >= level.floor.area else level
        floor = shapely.union_all([low.floor, level.floor], grid_size=MM_M)
        kept[-1] = replace(lasting, floor=MultiPolygon(polygons_of(floor)))
    return tuple(kept)


def _are_under_one_ceiling(low: FoundLevel, high: FoundLevel) -> bool:
    tops = low.floor_z + low.ceiling_m, high.floor_z + high.ceiling_m
    return high.floor_z - low.floor_z < CHEST_AND_HEAD_M[0] and abs(tops[0] - tops[1]) < COVER_MARGIN_M


def _storeys(floors: list[FloorSurface | None], foot: float, enclosed_m2: float) -> list[FloorSurface | None]:
    """Leave out what lies too close over a larger floor; the first may be the unseen floor of the walls' foot."""
    kept: list[FloorSurface | None] = []
    for floor in floors:
        below = kept[-1] if kept else None
        if kept and floor is not None:
            size = below.area_m2 if below else enclosed_m2
            height = below.layer.top if below else foot
            shared = np.count_nonzero(floor.region & below.region) if below else np.count_nonzero(floor.region)
            over = shared >= MOST * np.count_nonzero(floor.region)
            # lower than a door over the floor below, and smaller than half of it: a landing, a row of shelves
            if over and floor.layer.top - height < LINTEL_CUT_M and floor.area_m2 < MOST * size:
                continue
            # a smaller upper floor is the head of a stair, or a row of shelves
            if floor.area_m2 < SCARCELY * enclosed_m2:  # the head of a stair, or shelves
                continue
        kept.append(floor)
    return kept


def _is_named(surfaces: Surfaces, layer: LevelLayer, named: Bools) -> bool:
    """Tell whether most of a layer's area is called so."""
    named_area = float(surfaces.area[layer.faces & named].sum())
    # names are believed that most of a surface has
    return named_area > MOST * float(surfaces.area[layer.faces].sum())


def _area(surfaces: Surfaces, floor: FloorSurface, named: Bools, grid: PlanGrid) -> Polygon | MultiPolygon | None:
    """Plan area of the faces that the source calls floor, where they are most of it, else of all at its height."""
    height = (surfaces.low[:, 2] + surfaces.high[:, 2]) / 2
    called = named & surfaces.flats() & (np.abs(height - floor.layer.top) < SPLIT_LEVEL_M)
    flat = float(surfaces.area[called].sum())
    faces = called if flat > MOST * floor.area_m2 else floor.faces
    return floor_polygon(surfaces.triangles(faces)[:, :, :2], floor.region, grid)


def wall_bounds(surfaces: Surfaces, walls: Bools) -> tuple[np.ndarray, np.ndarray]:
    """Plan bounds (x, y) low and high of all but half a percent of the wall area on each side."""
    low, high, area = surfaces.low[walls, :2], surfaces.high[walls, :2], surfaces.area[walls]
    ends = [
        [weighted_quantile(low[:, i], area, OUTSIDE_SHARE), weighted_quantile(high[:, i], area, 1 - OUTSIDE_SHARE)]
        for i in (0, 1)
    ]
    bounds = np.asarray(ends).T
    return bounds[0], bounds[1]


def _storey_foot(surfaces: Surfaces, walls: Bools, profile: WallProfile) -> float | None:
    """Return the exact height at which half of the usual wall length begins, or None if no storey of walls stands."""
    usual = profile.usual
    if usual < LONGEST_AT_LEAST_M:  # walls that are shorter in all make no storey
        return None
    standing = np.flatnonzero(profile.length >= usual / 2)
    bottom, top = profile.edges[standing[0]], profile.edges[standing[-1] + 1]
    if top - bottom < HEAD_M:
        return None
    low = surfaces.low[walls, 2]
    near = np.abs(low - bottom) < CRACK_M  # walls that start this near to each other start at one height
    return weighted_quantile(low[near], surfaces.area[walls][near], 0.5) if near.any() else float(bottom)


def _walls_around(surfaces: Surfaces, walls: Bools, region: Cells, grid: PlanGrid) -> Bools:
    """Walls that stand in or around a floor: in a split level, those of its own half."""
    return walls & grid.at(grid.grow(region, PLACE_M), (surfaces.low[:, :2] + surfaces.high[:, :2]) / 2)


def _next_floor(floor: FloorSurface | None, height: float, floors: list[FloorSurface | None]) -> float | None:
    """Height of the next floor over this one; in a split level the neighbour half a storey up is not over it."""
    for other in floors:
        if other and other.layer.top >= height + HEAD_M:
            shared = np.count_nonzero(other.region & floor.region) if floor else 0
            # the higher of two floors lies over the other from such a share of the smaller one on
            if floor is None or shared >= SOME * min(np.count_nonzero(floor.region), np.count_nonzero(other.region)):
                return other.layer.top
    return None


def _ceiling(
    profile: WallProfile,
    layers: list[LevelLayer],
    region: Cells,
    height: float,
    *,
    above: float | None,
    through: Callable[[LevelLayer], float],
) -> float:
    """Height above the floor up to which this level's walls may be looked at."""
    # skirtings end below the height from which walls are measured
    end = above if above is not None else profile.end_above(height + HEAD_M, height + FOOT_M)
    size = np.count_nonzero(region)
    covers = [
        layer
        for layer in layers
        if height + HEAD_M < layer.top <= end + HAND_M and np.count_nonzero(layer.cells & region) >= size / 2
    ]
    # a level surface so near to the top of the walls closes the level
    closing = [cover for cover in covers if end - cover.top < HAND_M]
    if not closing and above is None:  # a slab under an attic or a parapet, on which walls go on
        # a layer through which more of the walls goes on hangs between them
        # walls that go on a metre over a slab are those of an attic; over less, it may be a hung ceiling
        closing = [c for c in covers if through(c) <= (NEARLY_ALL if end - c.top > AROUND_M else SPECK)]
    if not closing:  # sheets, or walls open above; a hung ceiling closes nothing
        return float(end - height - (COVER_MARGIN_M if above is not None else 0.0))
    slab = closing[-1]
    lower = [cover.bottom for cover in covers if slab.top - THICKEST_SLAB_M <= cover.bottom < slab.bottom]
    thin = slab.top - slab.bottom < CRACK_M  # a level surface that is thinner is one face of a slab
    underside = lower[-1] if thin and lower else slab.bottom
    return float(max(underside - COVER_MARGIN_M, height + HEAD_M) - height)


def _share_running_through(surfaces: Surfaces, walls: Bools, layer: LevelLayer) -> float:
    """Return which share of the walls that reach a layer runs on through it, face by face."""
    below = layer.bottom - COVER_MARGIN_M
    reach = walls & (surfaces.low[:, 2] < below) & (surfaces.high[:, 2] > below)
    length = surfaces.area[reach] / (surfaces.high[reach, 2] - surfaces.low[reach, 2])
    through = surfaces.high[reach, 2] > layer.top + COVER_MARGIN_M
    return float(length[through].sum()) / max(float(length.sum()), TINY)


def _slice(surfaces: Surfaces, low: float, high: float) -> Mesh:
    """Faces between two heights, also those that only reach in, with only their own vertices."""
    touched = (surfaces.low[:, 2] <= high) & (surfaces.high[:, 2] > low + SAME)
    used, faces = np.unique(surfaces.mesh.faces[touched], return_inverse=True)
    return Mesh(surfaces.mesh.vertices[used], faces.reshape(-1, 3).astype(np.int64))


def _lower(mesh: Mesh, height: float) -> Mesh:
    return Mesh(mesh.vertices - (0.0, 0.0, height), mesh.faces)


# Models that stand far from their origin are moved near it; the way back is kept in the level's frame.


Shift = tuple[float, float, float]


def shift_to_origin(points: npt.NDArray[np.float64]) -> Shift:
    """Return whole metres (x, y, z) to subtract from points (n, 3), so that they lie near the origin."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    if np.abs(middle).max() < FAR_FROM_ORIGIN_M:
        return 0.0, 0.0, 0.0
    x, y, z = (float(value) for value in np.round(middle))
    return x, y, z
