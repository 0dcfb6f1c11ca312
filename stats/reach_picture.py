"""A plan as a small SVG: the free space, the places where a robot can stand, and those that it cannot reach."""

from __future__ import annotations

from collections.abc import Iterable

from houseexpo.analysis.navigability import standing_pieces
from houseexpo.drawing.svg_paths import path_data
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import Space, rings_of


def reach_svg(plan: FloorPlan, radius_m: float) -> str:
    """Return the SVG of a plan, x right and y up, with the width that the page gives it."""
    x1, y1, x2, y2 = plan.bbox
    pieces = standing_pieces(plan.free_space, radius_m)
    side, edge = max(x2 - x1, y2 - y1), 0.02 * max(x2 - x1, y2 - y1)
    left, top = (x1 + x2 - side) / 2 - edge, -(y1 + y2 + side) / 2 - edge
    return "".join(
        (
            f'<svg role="img" viewBox="{left:.2f} {top:.2f} {side + 2 * edge:.2f} {side + 2 * edge:.2f}">',
            _path([plan.free_space], "floor"),
            _path(pieces[:1], "stand"),
            _path(pieces[1:], "shut"),
            "</svg>",
        )
    )


def _path(shapes: Iterable[Space], name: str) -> str:
    rings = [ring for shape in shapes for ring in rings_of(shape)]
    steps = path_data((ring * (1.0, -1.0) for ring in rings), "{:.2f}".format)
    return f'<path class="{name}" fill-rule="evenodd" d="{steps}"/>' if steps else ""
