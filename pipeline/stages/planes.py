"""Algorithm 1, lines 1-2: cut the house at the ground plane and at the door plane.

R1  The door plane P_d is the section at h_d: all that stands in a robot's way.
R2  Where doors have sills (SUNCG), the ground plane P_g is the section at h_g, as in the paper.
R3  Elsewhere doors have none, and P_g is put together: P_d, and the lintels that close its gaps above head height. A
    lintel goes up as far as the walls beside it; what ends below (a step of a stair, a wall cabinet) is none.
R4  What stands at some other height (a railing, the foot of a parapet) may close floor that nothing else does.
    Which of these bound a room is decided region by region (stage ``layout``), so they travel apart from P_d.
R5  Above and below h_d only upright faces count (a sloped roof is no wall), of massive bodies only those that stand at
    h_d too (a slab does not), and only what is wide enough to be more than noise.
R6  No cut runs through coplanar faces; the heights used are recorded.
"""

from __future__ import annotations

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import PlanesConfig
from pipeline.geometry.cutting import Cutter, Segments, differing, merged
from pipeline.geometry.heights import between, near
from pipeline.geometry.overlay import EMPTY, overlap, polygons_of, subtract, united
from pipeline.geometry.regions import opened
from pipeline.geometry.walls import Section, section
from pipeline.rejection import Reason, Rejection
from pipeline.values import Level, Planes

MOST_HEIGHTS = 12
SMALLEST_GAP_M = 0.08
HANDRAIL_M = 0.02  # a handrail may be no higher, and closes what its balusters do not
WIDEST_RAIL_M = 0.3
SLIVER_M = 0.04  # less than a sheet gets, more than a baluster has
BESIDE_M = 0.3
STANDING = 0.5
"""Share of a massive body's section over the door plane, with which it is a wall or a chimney and no slab."""


def cut_planes(level: Level, config: PlanesConfig) -> Planes:
    """Cut the level; raises Rejection where nothing stands at the door plane."""
    cutter = Cutter(merged(level.walls, *(each.mesh for each in level.furniture)))
    door_height = near(config.door_m, cutter.heights)
    ground_height = near(config.ground_m, cutter.heights)
    heights: dict[str, float | list[float]] = {"ground": ground_height, "door": door_height}
    standing_cut, ground_cut = cutter.cut(door_height), cutter.cut(ground_height)
    standing = _section(standing_cut, config)
    door = united([standing.walls, standing.solids])  # R1
    if door.is_empty:
        objects = f" and {level.n_objects} objects" if level.n_objects else ""
        raise Rejection(
            "planes",
            Reason.NO_LAYOUT,
            f"nothing stands {door_height:.3f} m above the floor: found {len(level.walls.faces)} wall faces{objects}",
            "a house needs walls; give its units and up axis if it has some",
        )
    if level.sills:  # R2
        ground = _section(differing(ground_cut, standing_cut), config, sheets=False).walls
        return Planes(door, opened(subtract(ground, door), SLIVER_M), EMPTY, EMPTY, standing.walls, heights)
    low = subtract(_section(ground_cut, config, sheets=False).walls, door)
    high_at = between(cutter.heights, config.head_m, level.ceiling_m, smallest_gap=SMALLEST_GAP_M, most=MOST_HEIGHTS)
    rails_at = between(
        cutter.heights, 1.5 * config.door_m, config.head_m, smallest_gap=HANDRAIL_M, most=MOST_HEIGHTS // 2
    )
    above = _walls_at(cutter, high_at, door, config)
    high = _lintels(above, door)  # R3
    rails = united([low, *_walls_at(cutter, rails_at, door, config)])  # R4
    rails = opened(subtract(rails, united([door, high])), SLIVER_M)
    tall = overlap(door, united(above)) if above else standing.walls
    return Planes(
        door=door,
        low=EMPTY,
        high=high,
        rails=subtract(rails, opened(rails, WIDEST_RAIL_M)),
        tall=tall,
        heights={**heights, "lintels": high_at},
    )


def _section(cut: Segments, config: PlanesConfig, *, sheets: bool = True) -> Section:
    return section(cut, sheet_m=config.sheet_m, solid_m=config.solid_m, sheets=sheets)


def _walls_at(cutter: Cutter, heights: list[float], door: BaseGeometry, config: PlanesConfig) -> list[BaseGeometry]:
    """R5: at each height the walls, those as thick as a chimney included; a slab does not stand at the door plane."""
    found = []
    for height in heights:
        here = _section(cutter.cut(height, upright_only=True), config)
        massive = [part for part in polygons_of(here.solids) if overlap(part, door).area > STANDING * part.area]
        found.append(united([here.walls, *massive]) if massive else here.walls)
    return found


def _lintels(above: list[BaseGeometry], door: BaseGeometry) -> BaseGeometry:
    """R3: what closes gaps of the door plane, in sections from head height upwards."""
    found: list[BaseGeometry] = []
    higher, kept = EMPTY, EMPTY
    for here in reversed(above):
        closing = opened(subtract(here, door), SLIVER_M)
        ending = opened(subtract(closing, kept), SLIVER_M)
        hanging = [part for part in polygons_of(ending) if _walls_go_on(part, here, higher, door)]
        kept = subtract(closing, united(hanging)) if hanging else closing
        found.append(kept)
        higher = here
    return opened(united(found), SLIVER_M) if found else EMPTY


def _walls_go_on(part: Polygon, here: BaseGeometry, higher: BaseGeometry, door: BaseGeometry) -> bool:
    """Whether the walls beside a part reach higher than it does."""
    beside = overlap(shapely.buffer(part, BESIDE_M, quad_segs=2), overlap(here, door))
    return bool(overlap(beside, higher).area > 0.5 * beside.area)
