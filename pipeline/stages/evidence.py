"""Decide which parts of a level's mesh are walls, lintels, door leaves, rails and furniture; return their plan areas.

The paper cuts at one height. That serves SUNCG, where furniture is known and every door has a sill. In other houses,
each thing is judged by the heights at which it begins and ends.

R1  A wall stands from the floor to head height: it is there at breast height and at head height.
R2  A window is wall: what stands at sill height, or at any height above a threshold's, touches wall, and has wall over
    the opening above it (a lamp over a table touches none). Glazing from the floor up, too wide for a door or a row of
    three panes or more, is wall as deep as the lintel over it. Where the walls of a mesh are cut off, what stands lower
    between the ends of two walls in one line is wall: the window over it is cut off, too.
R3  Under a sloped roof a wall may end at the roof before head height.
R4  Two sheets are one wall (``geometry.wall_sections``), and so are two walls with an edge of the same wall over them:
    the slit between them is filled.
R5  A body that is mostly thick and ends below the walls beside it is furniture (a cupboard), unless the source calls it
    wall, or it goes on from one wall or lintel to another. What ends below head height is furniture too, unless it is
    thin: then it may be a railing or a parapet.
R6  A lintel hangs over free floor from head height up to where the walls beside it end; what ends lower is not a
    lintel. Nor is a closet, which the walls close all round over its door (``geometry.wall_sections``).
R7  A leaf, found by its shape or named by the source, is not wall; where it stands closed there is a doorway
    (``geometry.doorways``). Where the source names its openings, and doors among them, anything else shaped like a leaf
    is glazing: the frame of a window, a pane beside a door.
R8  No cut runs through coplanar faces; the heights used are recorded.
R9  Upright walls do not begin or end between two heights unless a corner lies between. If no corner lies between floor
    and head height, there is no sill, window or railing, and no cut is made to look for them. A cut above head height
    that would show the same walls again is left out as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.config import EvidenceConfig
from pipeline.geometry.areas import (
    EMPTY,
    buffer_mitred,
    clip_to_box,
    drop_thin_parts,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.doorways import doorway_around_leaf, find_known_doorways, glazed_recesses, judge_leaves
from pipeline.geometry.leaves import LeafBodies, find_plates, may_hold_leaves, part_from_panelling
from pipeline.geometry.mesh_slicing import MeshSlicer, nearest_clear_height, section_heights
from pipeline.geometry.meshes import Bodies, box_around_polygon, footprint
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.scan_columns import columns_of_mesh, columns_of_points, is_scan
from pipeline.geometry.scan_walls import find_wall_masks, mask_to_area, wall_top_height
from pipeline.geometry.wall_gaps import WallEnd, wall_ends
from pipeline.geometry.wall_sections import (
    WallSections,
    close_cracks,
    ends_at_sloped_roof,
    find_low_headroom,
    find_overhangs,
    find_pieces_below_wall_tops,
    long_slits_between_sheets,
)
from pipeline.tolerances import (
    CM_M,
    CRACK_M,
    FOOT_M,
    HAND_M,
    LAP_M,
    LARGELY,
    RAIL_M,
    SHEET_M,
    SLIVER_M,
    STAND_M,
    STANDS,
    STUB_M,
    THIN_WALL_M,
    WALL_M,
)
from pipeline.values import CUT_OFF, Evidence, Level

MAX_HEIGHTS = 8
LARGEST_CUPBOARD_M2 = 2.5


def gather_evidence(level: Level, config: EvidenceConfig) -> Evidence:
    """Decide what each thing in a level is. A level without walls gives empty evidence."""
    if level.sills or level.walls.is_empty:
        return Evidence(EMPTY, EMPTY, EMPTY, EMPTY, _furniture(level), floor=level.floor)
    if not isinstance(level.walls, Prisms) and (level.walls.is_cloud or is_scan(level.walls)):
        return gather_scan_evidence(level, config)
    leaves, panes, cutter = _take_leaves_out(level)
    heights = _Heights.of(cutter, level, config)
    sections = WallSections(cutter, config.sheet_m, config.solid_m, heights.sill)
    as_high = cutter.is_upright_between(min(heights.step, heights.sill), heights.head)  # R9
    new = [h for h in heights.above if not (level.only_walls and cutter.is_upright_between(heights.head, h))]
    if new:
        sections = sections.believed(heights.breast, new[-1])
    foot = EMPTY if as_high else sections.foot
    above = [sections.at(height) for height in new]
    full = intersect(sections.at(heights.breast), sections.at(heights.head))  # R1
    full = _fill_between_sheets(full, sections, heights)  # R4
    closets = sections.closets_at(heights.breast, heights.head)
    if not closets.is_empty:  # space, though walls close it all round
        full = subtract(full, closets)
    ends = [] if level.only_walls else find_pieces_below_wall_tops(full, above, [heights.head, *heights.above])
    beside = unite([full, unite(above)]) if ends else EMPTY
    lower = [each for each in ends if _is_cupboard(each.part, beside)]
    cupboards = unite(each.part for each in lower if not ends_at_sloped_roof(each.part, cutter, each.stood_m))  # R5
    if not cupboards.is_empty:  # even a thin rest along their edges would part the floor
        full = drop_thin_parts(subtract(full, cupboards), CM_M)
    hanging = find_overhangs(above, full if cupboards.is_empty else unite([full, cupboards]))  # R6
    hanging = subtract(hanging, sections.closets)
    judged = judge_leaves(leaves, full, hanging)  # R7
    if judged.walls:
        again = MeshSlicer(Bodies.of(level.walls).only(list(judged.walls)))
        full = close_cracks(unite([full, WallSections(again, config.sheet_m, config.solid_m, heights.breast).foot]))
    sills = EMPTY if as_high else unite([foot, sections.at(heights.step)])
    windows = _in_walls(drop_thin_parts(intersect(hanging, sills), SLIVER_M), full)  # R2
    low = _beyond(foot, [full, hanging, cupboards])
    sloped = [part for part in polygons_of(low) if ends_at_sloped_roof(part, cutter)]  # R3
    walls = close_cracks(unite([full, windows, *sloped]))
    lintels = drop_thin_parts(subtract(hanging, walls), SLIVER_M)
    glazed = glazed_recesses(lintels, walls, panes, any_width=level.names_doors)  # R2, R7
    walls, lintels = unite([walls, *glazed]), subtract(lintels, unite(glazed))
    doorways, found_leaves = find_known_doorways(level.openings, level.door_meshes, walls, lintels, judged)
    rails = EMPTY if as_high else unite([foot, *(sections.at(height) for height in heights.between)])
    standing = _beyond(rails, [walls, lintels, cupboards])
    if CUT_OFF in level.guesses:  # R2
        walls = unite([walls, *_between_wall_ends(standing, walls)])
        standing = _beyond(standing, [walls])
    thick = drop_thin_parts(standing, RAIL_M)
    return Evidence(
        walls=walls,
        tall=full,
        lintels=lintels,
        rails=subtract(standing, thick),
        furniture=unite([cupboards, thick, judged.furniture, _furniture(level)]),
        doorways=tuple(doorways),
        leaves=tuple(found_leaves),
        floor=level.floor,
        low_headroom=find_low_headroom(level.walls),
        partial_height=_ending_below_ceiling(full, sections, heights, level.ceiling_m),
        shallow_headers=_shallow_headers(sections, heights, level.ceiling_m),
        heights=heights.as_record,
    )


def _take_leaves_out(level: Level) -> tuple[list[LeafBodies], list[LeafBodies], MeshSlicer | Prisms]:
    """Return what is shaped as a door (R7), the panes in rows (R2), and the walls without doors, ready to be cut."""
    if isinstance(level.walls, Prisms) and not may_hold_leaves(level.walls, level.ceiling_m):
        return [], [], level.walls
    bodies = Bodies.of(level.walls)
    leaves, panes = part_from_panelling([] if level.names_doors else find_plates(bodies, level.ceiling_m))
    if isinstance(level.walls, Prisms) and not leaves:
        return [], panes, level.walls
    return leaves, panes, MeshSlicer(bodies.without([k for leaf in leaves for k in leaf.bodies]))


def _beyond(what: BaseGeometry, known: list[BaseGeometry]) -> BaseGeometry:
    """Return the part of an area outside all of the known areas."""
    return EMPTY if what.is_empty else drop_thin_parts(subtract(what, unite(known)), SLIVER_M)


def _shallow_headers(sections: WallSections, heights: _Heights, ceiling_m: float) -> BaseGeometry:
    """Return what hangs from the ceiling by less than ``HAND_M``. It occurs only in the highest section."""
    *lower, highest = heights.above or [0.0]
    if not lower or 2 * (ceiling_m - highest) > HAND_M:  # a section stands in the middle of its layer
        return EMPTY
    return drop_thin_parts(subtract(sections.at(highest), unite(map(sections.at, lower))), SLIVER_M)


def _ending_below_ceiling(
    full: BaseGeometry, sections: WallSections, heights: _Heights, ceiling_m: float
) -> BaseGeometry:
    """Return the walls that end more than ``HAND_M`` below the ceiling."""
    lower = [height for height in heights.above if height <= ceiling_m - HAND_M]
    if not lower or not sections.cutter.may_end_between(heights.head, lower[-1]):  # R9
        return EMPTY
    return drop_thin_parts(subtract(full, sections.at(lower[-1])), SLIVER_M)


def _furniture(level: Level) -> BaseGeometry:
    return unite([footprint(each.mesh) for each in level.furniture]) if level.furniture else EMPTY


@dataclass(frozen=True)
class _Heights:
    """The heights at which a level is cut, metres above its floor (R8)."""

    step: float
    sill: float
    breast: float
    head: float
    above: list[float]
    between: list[float]

    @classmethod
    def of(cls, cutter: MeshSlicer | Prisms, level: Level, config: EvidenceConfig) -> _Heights:
        z = cutter.heights
        wanted = FOOT_M, config.sill_m, config.breast_m, config.head_m - 0.1
        step, sill, breast, head = (nearest_clear_height(height, z) for height in wanted)
        top = max(level.ceiling_m, config.head_m + STAND_M)
        above = section_heights(z, config.head_m, top, smallest_gap=STAND_M, most=MAX_HEIGHTS)
        railings = section_heights(z, config.sill_m, config.head_m, smallest_gap=CRACK_M, most=MAX_HEIGHTS // 2)
        return cls(step, sill, breast, head, above, railings)

    @property
    def as_record(self) -> dict[str, float | list[float]]:
        return {"sill": self.sill, "breast": self.breast, "head": self.head, "lintels": self.above}


def _fill_between_sheets(full: BaseGeometry, sections: WallSections, heights: _Heights) -> BaseGeometry:
    """Return the walls with the slit between two sheets filled, where the same wall lies over the slit (R4)."""
    slits = long_slits_between_sheets(full)
    if slits.is_empty:
        return full
    slits = drop_thin_parts(intersect(slits, unite(map(sections.at, heights.above))), SLIVER_M)
    long = [buffer_mitred(p, LAP_M) for p in polygons_of(slits) if box_around_polygon(p).width > WALL_M]
    return unite([full, *long]) if long else full


def _in_walls(windows: BaseGeometry, full: BaseGeometry) -> BaseGeometry:
    """Return the pieces that touch a wall (R2)."""
    parts = polygons_of(windows)
    if not parts:
        return EMPTY
    near = shapely.STRtree(polygons_of(full)).query(parts, predicate="dwithin", distance=SLIVER_M)[0]
    return unite([parts[k] for k in sorted(set(near.tolist()))])


def _is_cupboard(part: Polygon, walls: BaseGeometry) -> bool:
    """Return whether a part, once filled (cupboards are often hollow), is mostly thick and not part of a wall.

    A low part of a wall stands between ends of the rest of the wall, or of lintels over its doors.
    """
    whole = Polygon(part.exterior)
    if whole.area > LARGEST_CUPBOARD_M2 or drop_thin_parts(whole, RAIL_M).area < whole.area / 2:
        return False
    x1, y1, x2, y2 = part.bounds
    near = clip_to_box(walls, x1 - 1.0, y1 - 1.0, x2 + 1.0, y2 + 1.0)
    rest = subtract(near, shapely.buffer(part, 0.01, join_style="mitre"))
    if _goes_on(whole, rest):
        return False
    box = box_around_polygon(whole)
    between = doorway_around_leaf(box, rest)
    return between is None or between.thickness < LARGELY * box.thickness


def _goes_on(part: Polygon, walls: BaseGeometry) -> bool:
    """Return whether a part ends at walls at two places or more, and most of its edge is free (R5).

    A cupboard has its back at one wall, also in a corner or a niche, and is deeper than most walls. A sheet that goes
    on above, such as a facade, does not count as one of these walls.
    """
    if drop_thin_parts(part, STUB_M).area > part.area / 2:
        return False
    ends = polygons_of(intersect(subtract(buffer_mitred(part, SHEET_M), part), drop_thin_parts(walls, SHEET_M)))
    return len(ends) > 1 and sum(end.area for end in ends) / SHEET_M < STANDS * part.exterior.length


def _between_wall_ends(low: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    """Return the low pieces that stand between two ends of walls that face each other (R2)."""
    parts, ends = polygons_of(low), list(wall_ends(walls, nibs=True))
    if not (parts and ends):
        return []
    touch = shapely.STRtree(parts).query([shapely.points(end.centre) for end in ends], "dwithin", distance=SLIVER_M).T
    met: dict[int, list[WallEnd]] = {}
    for end, part in touch.tolist():
        met.setdefault(part, []).append(ends[end])
    return [parts[k] for k, near in sorted(met.items()) if any(a.faces(b) for a, b in combinations(near, 2))]


# Find walls, lintels and doorways of a scanned level, a mesh or a point cloud.
#
# S1  A single section of a scan says little: walls and doorways are judged by columns (``geometry.scan_walls``).
# S2  A doorway without a lintel in the scan is found as a gap by the stage ``layout``, as in every house.
# S3  The floor of a scan is incomplete, so a room without floor is kept.
# S4  Where the scan ends and nothing stands, there is no wall but an open edge (``geometry.scan_walls``, R4). It closes
#     the room, as the edge of a floor does, and the plan says so.


SCAN_CELL_M = 0.025
"""Side of a cell of the columns of scans."""


def gather_scan_evidence(level: Level, config: EvidenceConfig) -> Evidence:
    """Decide what each thing in a scanned level is."""
    mesh, top = level.walls, max(level.ceiling_m, config.head_m)
    if mesh.is_cloud:
        columns = columns_of_points(mesh.vertices, THIN_WALL_M, top, SCAN_CELL_M)
    else:
        columns = columns_of_mesh(mesh, THIN_WALL_M, top, SCAN_CELL_M)
    masks = find_wall_masks(columns)
    closed = mask_to_area(masks.walls, masks.raster)
    doorways = unite([Polygon(masks.raster.level_points(box)) for box in masks.doorways])
    walls, lintels = subtract(closed, doorways), intersect(closed, doorways)
    open_edge = EMPTY
    if masks.open_edge.any():  # S4
        beyond = subtract(buffer_mitred(mask_to_area(masks.open_edge, masks.raster), 2 * SCAN_CELL_M), doorways)
        walls, open_edge = subtract(walls, beyond), intersect(walls, beyond)
    judged = judge_leaves([], walls, lintels)
    known, leaves = find_known_doorways(level.openings, level.door_meshes, walls, lintels, judged)
    return Evidence(
        walls=walls,
        tall=walls,
        lintels=lintels,
        rails=EMPTY,
        furniture=unite([footprint(each.mesh) for each in level.furniture]),
        doorways=tuple(known),
        leaves=tuple(leaves),
        heights={"columns": [THIN_WALL_M, round(wall_top_height(columns), 4)]},
        scanned=True,
        open_edge=open_edge,
    )
