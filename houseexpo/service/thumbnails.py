"""Small pictures of plans, quick to make: the outline, and rooms or label boxes in their colours.

``houseexpo.drawing`` lays letters out and cuts boxes exactly; hundreds of small pictures a second do without. Walls
are a line, and boxes of published plans are cut by the browser (``clipPath``).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, Final

import numpy as np

from houseexpo.drawing.scene import DOOR_COLOURS
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.plan.categories import colour

SIDE: Final = 200
"""Longer side of a picture, px; all are square."""

_MARGIN: Final = 6.0
_WALL: Final = "#6b7380"
_FLOOR: Final = "#f6f4ef"
_FURNITURE: Final = "#cfc8ba"
_FINE_PX: Final = 0.4  # corners that are nearer to a straight line cannot be seen
_MANY: Final = 400


def thumbnail(plan: FloorPlan) -> bytes:
    """Return a plan as a small square SVG, x right and y up; it takes its background from the page."""
    x1, y1, x2, y2 = plan.bbox
    scale = (SIDE - 2 * _MARGIN) / max(x2 - x1, y2 - y1, 1e-6)
    left, top = (SIDE - (x2 - x1) * scale) / 2, (SIDE + (y2 - y1) * scale) / 2

    def path(rings: Iterable[Any]) -> str:
        drawn = (np.asarray(ring, dtype=np.float64) - (x1, y1) for ring in rings)
        return "".join(_path(ring * (scale, -scale) + (left, top)) for ring in drawn)

    whole = path([plan.verts, *plan.holes])
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIDE} {SIDE}" fill-rule="evenodd">',
        f"<title>{escape(plan.id)}</title>",
        f'<path d="{whole}" fill="{_FLOOR}"/>',
        *(_rooms(plan, path) if plan.rooms else _boxes(plan, path, whole)),
        *(f'<path d="{path([thing.polygon])}" fill="{_FURNITURE}"/>' for thing in plan.objects),
        f'<path d="{whole}" fill="none" stroke="{_WALL}" stroke-width="2" stroke-linejoin="round"/>',
        *(f'<path d="{path([door.polygon])}" fill="{DOOR_COLOURS[door.kind]}"/>' for door in plan.doors),
        "</svg>",
    ]
    return "".join(parts).encode()


def _rooms(plan: FloorPlan, path: Any) -> Iterable[str]:
    for room in plan.rooms:
        yield f'<path d="{path([room.polygon, *room.holes])}" fill="{colour(room.label)}" stroke="{_WALL}"/>'


def _boxes(plan: FloorPlan, path: Any, whole: str) -> Iterable[str]:
    """Label boxes, the large below the small, cut by the outline."""
    boxes = [(label, box) for label, found in plan.room_category.items() for box in found]
    boxes.sort(key=lambda item: -(item[1][2] - item[1][0]) * (item[1][3] - item[1][1]))
    yield f'<clipPath id="a"><path clip-rule="evenodd" d="{whole}"/></clipPath><g clip-path="url(#a)">'
    for label, (x1, y1, x2, y2) in boxes:
        yield f'<path d="{path([[(x1, y1), (x2, y1), (x2, y2), (x1, y2)]])}" fill="{colour(label)}"/>'
    yield "</g>"


def _path(ring: Ring) -> str:
    points: Sequence[Sequence[float]] = _fewer(ring).round(1).tolist()
    return "M" + " ".join(f"{x:g},{y:g}" for x, y in points) + "Z"


def _fewer(ring: Ring) -> Ring:
    if len(ring) <= _MANY:
        return ring
    import shapely

    fewer: Ring = shapely.get_coordinates(shapely.simplify(shapely.linearrings(ring), _FINE_PX))[:-1]
    return fewer
