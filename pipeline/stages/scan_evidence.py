"""Find walls, lintels and doorways of a scanned level, a mesh or a point cloud: ``stages.evidence`` for scans.

R1  Of a scan, no single section is worth much: walls and doorways are judged by columns (``geometry.scan_walls``).
R2  A doorway without a lintel in the scan is found as a gap by the stage ``layout``, as in every house.
R3  The floor of a scan is as incomplete as the rest of it, so that it deletes no room.
R4  Where the scan ends and nothing stands, there is no wall but an open edge (``geometry.scan_walls``, R4). It closes
    the room, as the edge of a floor does, and the plan says so.
"""

from __future__ import annotations

from shapely import Polygon

from pipeline.config import EvidenceConfig
from pipeline.geometry.areas import EMPTY, buffer_mitred, intersect, subtract, unite
from pipeline.geometry.doorways import find_known_doorways, judge_leaves
from pipeline.geometry.meshes import footprint
from pipeline.geometry.scan_columns import columns_of_mesh, columns_of_points
from pipeline.geometry.scan_walls import find_wall_masks, mask_to_area, wall_top_height
from pipeline.tolerances import THIN_WALL_M
from pipeline.values import Evidence, Level

CELL_M = 0.025


def gather_scan_evidence(level: Level, config: EvidenceConfig) -> Evidence:
    """Decide what each thing in a scanned level is."""
    mesh, top = level.walls, max(level.ceiling_m, config.head_m)
    if mesh.is_cloud:
        columns = columns_of_points(mesh.vertices, THIN_WALL_M, top, CELL_M)
    else:
        columns = columns_of_mesh(mesh, THIN_WALL_M, top, CELL_M)
    masks = find_wall_masks(columns)
    closed = mask_to_area(masks.walls, masks.raster)
    doorways = unite([Polygon(masks.raster.level_points(box)) for box in masks.doorways])
    walls, lintels = subtract(closed, doorways), intersect(closed, doorways)
    open_edge = EMPTY
    if masks.open_edge.any():  # R4
        beyond = subtract(buffer_mitred(mask_to_area(masks.open_edge, masks.raster), 2 * CELL_M), doorways)
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
