"""Tell what matters of a drawing whose layers nobody understood: its main part, its likely walls, and its unit.

R1  The parts of a sheet (plans, elevations, a legend) lie apart. The main part is the one with the most lines.
R2  Walls are drawn by their two faces. Of a layer, the length of lines counts that run beside one other line or two,
    at a distance that a wall can have, in a house of this size if no unit is known; stairs and hatches run beside more.
    It counts for less where the layer has other lines too. Layers without such lines follow by their length.
R3  A drawing at full size is in m, cm or mm, one on paper in mm at a usual scale, others are in inches or feet. A unit
    fits where the house has the size of a house, and its walls are as thick as walls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import shapely
from PIL import Image, ImageDraw

from pipeline.sources.tolerances import PARALLEL, WALL_THICKNESS_M
from pipeline.sources.vector_plans.drawing import Floats, Line

Bounds = tuple[float, float, float, float]
_CELLS: Final = 40
"""Along the longer side of a sheet: parts with a free cell between them lie apart."""
_DISTANCES: Final = (0.001, 0.04)
"""Thickness of walls as shares of a house's longer side: 2 to 80 cm of 20 m."""
_MOST_BESIDE: Final = 2.2
"""A face of a wall has its other face beside it, and that of the next wall's end; a tread has several others."""
_LEAST_BESIDE: Final = 0.3
"""Share of a line that runs beside another."""
_RANKED_LINES: Final = 2_000
"""The longest of a layer are looked at."""
_UNITS_M: Final = ((1.0, 0.001, 0.01), (0.05, 0.1, 0.02, 0.2), (0.0254, 0.3048))
"""R3: full size; 1:50, 1:100, 1:20 and 1:200; others."""
_HOUSE_M: Final = (3.0, 200.0)
_WALL_M: Final = 0.15
"""Usual thickness of a wall."""


def main_part(lines: Sequence[Line]) -> Bounds:
    """Return the bounds (x1, y1, x2, y2) of the part of a sheet with the most lines (R1)."""
    from scipy.ndimage import label

    boxes = np.array([[*np.min(points, axis=0)[:2], *np.max(points, axis=0)[:2]] for _, points in lines])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    cell = float((high - low).max()) / _CELLS or 1.0
    image = Image.new("1", (_CELLS + 1, _CELLS + 1))
    pen = ImageDraw.Draw(image)
    for _, points in lines:
        pen.line([tuple(at) for at in ((np.asarray(points)[:, :2] - low) / cell).astype(int).tolist()], fill=1)
    parts, _ = label(np.asarray(image), np.ones((3, 3)))
    columns, rows = np.array([(np.asarray(points)[0, :2] - low) / cell for _, points in lines]).astype(int).T
    own = parts[rows, columns]
    main = boxes[own == np.bincount(own).argmax()]
    (x1, y1), (x2, y2) = main[:, :2].min(axis=0).tolist(), main[:, 2:].max(axis=0).tolist()
    return x1, y1, x2, y2


def rank_layers(lines: Sequence[Line], within: Bounds, unit_m: float | None = None) -> list[tuple[str, float]]:
    """Return the layers in a part of a sheet, the likeliest walls first (R2), each with the distance of its pairs.

    The distance is 0 where a layer has no pairs. Where ``unit_m``, the metres in a unit, is known, walls are as thick
    as walls, however much else is drawn beside the house.
    """
    size, inside = max(within[2] - within[0], within[3] - within[1]), shapely.box(*within)
    low, high = (share * size for share in _DISTANCES)
    thinnest, thickest = (thick / unit_m for thick in WALL_THICKNESS_M) if unit_m else (low, high)
    by_layer: dict[str, list[Floats]] = {}
    for name, points in lines:
        there = np.asarray(points, np.float64)[:, :2]
        if inside.intersects(shapely.Point(there[0])):
            by_layer.setdefault(name, []).append(np.stack([there[:-1], there[1:]], axis=1))
    found = []
    for name, pieces in by_layer.items():
        paired, whole, thick = _pairs(np.concatenate(pieces), (thinnest, thickest), max(high, thickest))
        found.append((paired**2 / max(whole, paired) if paired else 0.0, whole, name, thick))
    return [(name, thick) for _, _, name, thick in sorted(found, key=lambda each: (-each[0], -each[1], each[2]))]


def _pairs(pieces: Floats, thick: tuple[float, float], beside: float) -> tuple[float, float, float]:
    """Return the length of pieces (n, 2, 2) that are faces, that of all, and the usual distance of two faces (R2).

    The faces of a wall are as far apart as ``thick``; other lines count as far as ``beside``.
    """
    long = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
    whole = float(long.sum())
    order = np.argsort(-long, kind="stable")[:_RANKED_LINES]
    order = order[long[order] > 2 * thick[0]]
    pieces, long = pieces[order], long[order]
    if not len(pieces):
        return 0.0, whole, 0.0
    way, shapes = (pieces[:, 1] - pieces[:, 0]) / long[:, None], shapely.linestrings(pieces)
    one, other = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=beside)
    is_parallel = np.abs(way[one, 0] * way[other, 1] - way[one, 1] * way[other, 0]) < PARALLEL
    one, other = one[is_parallel & (one != other)], other[is_parallel & (one != other)]
    across = np.column_stack([-way[one, 1], way[one, 0]])
    apart = np.abs(((pieces[other].mean(axis=1) - pieces[one].mean(axis=1)) * across).sum(axis=1))
    ends = np.sort(((pieces[other] - pieces[one, :1]) * way[one, None]).sum(axis=2), axis=1)
    common = np.minimum(ends[:, 1], long[one]) - np.maximum(ends[:, 0], 0.0)
    is_beside = (thick[0] <= apart) & (apart <= beside) & (common > 2 * apart)
    is_pair = is_beside & (apart <= thick[1])
    all_beside, paired = (
        np.bincount(one[each], common[each] / long[one[each]], len(pieces)) for each in (is_beside, is_pair)
    )
    is_face = (paired > _LEAST_BESIDE) & (all_beside < _MOST_BESIDE)
    distances = apart[is_pair & is_face[one]]
    return float(long[is_face].sum()), whole, float(np.median(distances)) if len(distances) else 0.0


def likely_units(size: float, thick: float, scale: float = 1.0) -> list[float]:
    """Return the metres that a unit of a drawing may have, the likeliest first (R3).

    ``size`` is the longer side of its main part and ``thick`` the distance of its pairs, in its unit; ``thick`` is 0 if
    there are none. With a ``scale`` that somebody has stated (N of 1:N), only units of length are tried.
    """

    def fits(unit_m: float) -> bool:
        is_house = _HOUSE_M[0] <= size * unit_m * scale <= _HOUSE_M[1]
        return is_house and (not thick or WALL_THICKNESS_M[0] <= thick * unit_m * scale <= WALL_THICKNESS_M[1])

    def unusual(unit_m: float) -> float:
        return abs(math.log(thick * unit_m / _WALL_M)) if thick else 0.0

    full, paper, others = _UNITS_M
    found = [*full, *(sorted(paper, key=unusual) if scale == 1.0 else ()), *others]
    return [unit_m for unit_m in found if fits(unit_m)]
