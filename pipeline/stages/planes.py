"""Return what stands at door height (plane P_d) and near the ground (P_g): sections of the mesh, or from the evidence.

R1  Where doors have sills (SUNCG), P_d is the section at h_d, all that stands in a robot's way, and P_g the section at
    h_g, as in the paper.
R2  Elsewhere P_d is the walls of the evidence without the doorways. P_g is P_d with the doorways and lintels that close
    its gaps.
R3  What stands below head height only (a railing, a parapet) may close floor that nothing else closes. Stage ``layout``
    decides which of these bound a room, so they are kept apart from P_d.
R4  No cut runs through coplanar faces; the heights used are recorded.
"""

from __future__ import annotations

from shapely.geometry.base import BaseGeometry

from pipeline.config import PlanesConfig
from pipeline.geometry.areas import EMPTY, drop_thin_parts, subtract, unite
from pipeline.geometry.mesh_slicing import (
    MeshSlicer,
    SectionSegments,
    height_or_middle_of_widest_gap,
    segments_that_differ,
)
from pipeline.geometry.wall_sections import WallSection, section_from_segments
from pipeline.rejection import Reason, Rejection
from pipeline.tolerances import SLIVER_M
from pipeline.values import Evidence, Level, Planes


def find_planes(level: Level, evidence: Evidence, config: PlanesConfig) -> Planes:
    """Return the two planes of a level; raise Rejection if nothing stands in the door plane."""
    planes = _with_sills(level, config) if level.sills else _from_evidence(evidence)
    if planes.door.is_empty:
        objects = f" and {level.n_objects} objects" if level.n_objects else ""
        raise Rejection(
            "planes",
            Reason.NO_LAYOUT,
            f"no wall stands on the floor: found {len(level.walls.faces)} wall faces{objects}",
            "a house needs walls; give its units and up axis if it has some",
        )
    return planes


def _with_sills(level: Level, config: PlanesConfig) -> Planes:
    """Return the planes as the paper's two sections, for a source whose doors have sills (SUNCG)."""
    cutter = MeshSlicer(level.walls)
    door_height = height_or_middle_of_widest_gap(config.door_m, cutter.heights)
    ground_height = height_or_middle_of_widest_gap(config.ground_m, cutter.heights)
    standing_cut, ground_cut = cutter.cut(door_height), cutter.cut(ground_height)
    standing = _section(standing_cut, config)
    door = unite([standing.walls, standing.solids])
    if not standing.closets.is_empty:  # an overlay with nothing would turn rings
        door = subtract(door, standing.closets)
    ground = _section(segments_that_differ(ground_cut, standing_cut), config, sheets=False).walls
    return Planes(
        door=door,
        sills=drop_thin_parts(subtract(ground, door), SLIVER_M),
        lintels=EMPTY,
        rails=EMPTY,
        tall=standing.walls,
        heights={"ground": ground_height, "door": door_height},
    )


def _section(cut: SectionSegments, config: PlanesConfig, *, sheets: bool = True) -> WallSection:
    return section_from_segments(cut, sheet_m=config.sheet_m, solid_m=config.solid_m, sheets=sheets)


def _from_evidence(evidence: Evidence) -> Planes:
    """Return the planes: the walls without the doorways, and these closed by doorways and lintels."""
    known = unite([doorway.polygon for doorway in evidence.doorways])
    door = subtract(evidence.walls, known)
    return Planes(
        door=door,
        sills=EMPTY,
        lintels=_beyond(evidence.lintels, known, door),
        rails=_beyond(evidence.rails, known, evidence.lintels),
        tall=unite([evidence.tall, known]),
        heights=evidence.heights,
        doorways=evidence.doorways,
        leaves=evidence.leaves,
    )


def _beyond(what: BaseGeometry, known: BaseGeometry, other: BaseGeometry) -> BaseGeometry:
    """Return what of an area lies in neither of two others. The first of them often holds all of it."""
    if what.is_empty or subtract(what, known).is_empty:
        return EMPTY
    return drop_thin_parts(subtract(what, unite([other, known])), SLIVER_M)
