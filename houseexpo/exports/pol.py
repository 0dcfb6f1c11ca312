"""Convert a plan's free space to ``.pol``, a polygon with holes in the text format of art gallery problem instances."""

from __future__ import annotations

from fractions import Fraction

import shapely

from houseexpo.errors import PlanError
from houseexpo.exports.encoding import Files
from houseexpo.exports.placement import ExportFrame, Orientation, orient_plan, pose_in_export
from houseexpo.floorplan import FloorPlan

_DENOMINATOR = 10_000  # a tenth of a millimetre; published coordinates, in centimetres, are exact


def pol(plan: FloorPlan, *, orientation: Orientation = "world", frame: ExportFrame | None = None) -> Files:
    """Write ``<id>.pol``: one line with every coordinate as a fraction, in metres.

    ``n x1 y1 ... xn yn`` is the outline, counter-clockwise. If there are holes, their number follows, and then each
    hole in the same form, clockwise. Mirrored plans are mirrored back.

    Raises
    ------
    PlanError
        The free space has several pieces; the format can represent only one.
    """
    space = pose_in_export(plan, orientation, frame).shape(orient_plan(plan, orientation).free_space)
    if space.geom_type != "Polygon":
        pieces = len(shapely.get_parts(space))
        raise PlanError(f"expected a free space in one piece, as .pol holds, found {pieces} pieces", "verts", plan.id)
    polygon = shapely.orient_polygons(space)
    words = _ring(polygon.exterior)
    if polygon.interiors:
        words += [str(len(polygon.interiors)), *(word for hole in polygon.interiors for word in _ring(hole))]
    return {f"{plan.id}.pol": (" ".join(words) + "\n").encode()}


def _ring(ring: shapely.LinearRing) -> list[str]:
    points = shapely.get_coordinates(ring)[:-1].tolist()
    return [str(len(points)), *(_fraction(value) for point in points for value in point)]


def _fraction(value: float) -> str:
    exact = Fraction(round(value * _DENOMINATOR), _DENOMINATOR)
    return f"{exact.numerator}/{exact.denominator}"
