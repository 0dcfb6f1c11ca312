"""Leaves and panes that are one body with their wall: what is shut leaves a recess under its lintel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bodies import Box
from pipeline.geometry.doorways import box_of, rectangle
from pipeline.geometry.overlay import clipped, mitred, overlap, polygons_of, united
from pipeline.geometry.regions import opened

WIDTH_M = (0.45, 2.8)
DEPTH_M = (0.015, 0.6)
LEAF_M = 0.09
STRAIGHT = 0.7
JOIN_M = 0.01
SEAM_M = 0.12
LOOKS = np.linspace(-0.4, 0.4, 5)

Floats = npt.NDArray[np.float64]


def leaves_in_recesses(lintels: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    """Doorways in which a thin piece of ``walls`` stands beside a slim lintel; each is the piece and the lintels by it.

    ``lintels`` is what hangs over free floor. A lintel over an open door is as deep as the wall; one over a recess is
    slimmer, and what stands beside it, as long as it, is the leaf.
    """
    found = _recesses(lintels, walls, WIDTH_M)
    return polygons_of(united(_with_lintel(leaf, lintel) for lintel, leaf in found))


def glazed_recesses(lintels: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    """Lintels beside a pane too wide for a door: full-height glazing stands there, and the wall is as deep as they."""
    bare = opened(lintels, SEAM_M)  # without the seams of a ceiling that end at them
    return [lintel for lintel, _ in _recesses(bare, walls, (WIDTH_M[1], np.inf))]


def _recesses(
    lintels: BaseGeometry, walls: BaseGeometry, width_m: tuple[float, float]
) -> list[tuple[Polygon, Polygon]]:
    """Slim lintels of such widths, each with the thin piece of wall beside it."""
    found = []
    for lintel in polygons_of(lintels):
        box = box_of(lintel)
        slim = DEPTH_M[0] <= box.thickness <= DEPTH_M[1] and width_m[0] <= box.width <= width_m[1]
        if not slim or lintel.area < STRAIGHT * box.width * box.thickness:
            continue
        x1, y1, x2, y2 = lintel.bounds
        near = clipped(walls, x1 - 0.5, y1 - 0.5, x2 + 0.5, y2 + 0.5)
        for sign in (-1.0, 1.0):
            thickness = _thickness_beside(box, sign, near)
            if thickness is not None:
                found += [(lintel, leaf) for leaf in _leaf(box, sign, thickness, near)]
    return found


def _with_lintel(leaf: Polygon, lintel: Polygon) -> BaseGeometry:
    """A leaf and the lintel beside it as one area."""
    return mitred(mitred(united([leaf, lintel]), JOIN_M), -JOIN_M)


def _thickness_beside(box: Box, sign: float, walls: BaseGeometry) -> float | None:
    """How thick the wall is that touches one long side, or None if it is none, or too thick for a leaf."""
    across = sign * box.across
    found: list[float] = []
    for share in LOOKS:
        foot = box.centre + share * box.width * box.along + (box.thickness / 2 - 0.01) * across
        ray = shapely.linestrings([foot, foot + (LEAF_M + 0.05) * across])
        parts = [p for p in shapely.get_parts(shapely.intersection(ray, walls)) if p.length > 0]
        if not parts:
            continue
        ends = (shapely.get_coordinates(parts[0]) - foot) @ across
        if ends.min() <= 0.03 and ends.max() <= LEAF_M + 0.02:
            found.append(float(ends.max() - ends.min()))
    return float(np.median(found)) if len(found) >= len(LOOKS) - 1 else None


def _leaf(box: Box, sign: float, thickness: float, walls: BaseGeometry) -> list[Polygon]:
    centre = box.centre + sign * box.across * (box.thickness + thickness) / 2
    strip = rectangle(Box(centre, box.along, box.width, thickness + 0.02, 0.0, 0.0))
    return polygons_of(overlap(strip, walls))[:1]
