"""Draw small SVG pictures of plans quickly, for galleries: dark walls with windows, gaps at doors, pale rooms or boxes.

The colours are those of the style ``architect`` of ``houseexpo.drawing``. That package also places names, hangs doors
and clips boxes exactly, which is too slow for hundreds of pictures per second. Here walls are a broad line around the
free space, and the browser clips the boxes of published plans (``clipPath``). Coordinates are whole tenths of a pixel,
because writing numbers takes most of the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.drawing.door_leaves import OUTDOORS
from houseexpo.drawing.stairs import stair_lines
from houseexpo.drawing.styles import dark_colours, style_named
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Ring
from houseexpo.plan.room_labels import LABELS, UNLABELLED

SIDE: Final = 200
"""Side of a picture, px; all are square."""

_TENTHS: Final = 10 * SIDE
_MARGIN_TENTHS: Final = 60.0
_STYLE: Final = style_named("architect")
_FILLS: Final = {label: _STYLE.room(label) for label in (*LABELS, UNLABELLED)}
_NO_LABEL: Final = _FILLS[UNLABELLED]
_DARK: Final = dark_colours(_STYLE, set(_FILLS))
_RULES: Final = {label: f'[fill="{light}"]{{fill:{_DARK[light]}}}' for label, light in _FILLS.items()}
"""For each label the rule that changes its fill on dark pages."""
_BASE_RULES: Final = "".join(
    f'[{kind}="{light}"]{{{kind}:{_DARK[light]}}}'
    for kind, light in (
        ("fill", _STYLE.floor),
        ("stroke", _STYLE.floor),
        ("stroke", _STYLE.wall),
        ("stroke", _STYLE.line),
    )
)
_WALL_M: Final = 0.15
_WALL_TENTHS: Final = (14.0, 45.0)
"""Least and largest thickness of a wall: visible, and within the margin."""
_PARAPET_TENTHS: Final = 12
_FINE: Final = 4.0
"""Corners this close to a straight line are invisible, tenths of a pixel."""
_MANY: Final = 400
"""Rings with more vertices are simplified."""


def draw_thumbnail(plan: FloorPlan) -> bytes:
    """Return a plan as a small square SVG, x right and y up, with a transparent background."""
    x1, y1, x2, y2 = plan.bbox
    scale = (_TENTHS - 2 * _MARGIN_TENTHS) / max(x2 - x1, y2 - y1, 1e-6)
    left, top = (_TENTHS - (x2 - x1) * scale) / 2 - x1 * scale, (_TENTHS + (y2 - y1) * scale) / 2 + y1 * scale

    def path(rings: Iterable[Any], end: str = "Z") -> str:
        placed = (np.asarray(ring, dtype=np.float64) * (scale, -scale) + (left, top) for ring in rings)
        return "".join(_path(ring) + end for ring in placed)

    def box(x1: float, y1: float, x2: float, y2: float) -> str:
        start = round(left + x1 * scale)
        return f"M{start} {round(top - y1 * scale)}H{round(left + x2 * scale)}V{round(top - y2 * scale)}H{start}Z"

    whole = path([plan.verts, *plan.holes, *(thing.ring for thing in plan.objects)])
    outdoors = {room.id: room for room in plan.rooms if room.label in OUTDOORS}
    house, outward = whole, {None, *outdoors}
    if outdoors:  # their parapets are thin
        inside = [ring for room in plan.rooms if room.id not in outdoors for ring in (room.ring, *room.holes)]
        ways = (door.ring for door in plan.doors if outward.isdisjoint(door.rooms))
        house = path([*inside, *ways, *(thing.ring for thing in plan.objects if thing.room not in outdoors)])
    least, most = _WALL_TENTHS
    wall = round(2 * min(max(_WALL_M * scale, least), most))  # half of the line lies under the floor
    rules = "".join(_RULES.get(label, "") for label in {room.label: 0 for room in plan.rooms} or plan.room_category)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_TENTHS} {_TENTHS}" fill-rule="evenodd">',
        f"<title>{escape(plan.id)}</title>",
        f"<style>@media (prefers-color-scheme:dark){{{_BASE_RULES}{rules}}}</style>",
        *_open_places(path(room.ring for room in outdoors.values()), wall),
        f'<path d="{house}" fill="{_STYLE.floor}" stroke="{_STYLE.wall}" stroke-width="{wall}" paint-order="stroke"/>',
        *(_rooms(plan, path) if plan.rooms else _boxes(plan, box, whole)),
    ]
    if plan.objects:
        rings = path(thing.ring for thing in plan.objects)
        parts.append(f'<path d="{rings}" fill="{_STYLE.furniture}" stroke="{_STYLE.line}" stroke-width="5"/>')
    if stairs := path(stair_lines(plan), ""):
        parts.append(f'<path d="{stairs}" fill="none" stroke="{_STYLE.line}" stroke-width="5"/>')
    if gaps := path(door.ring for door in plan.doors if not outward.isdisjoint(door.rooms)):  # others are floor
        parts.append(f'<path d="{gaps}" fill="{_STYLE.floor}"/>')
    if plan.windows:
        parts.append(f'<path d="{path(_panes(plan, wall / 2 / scale))}" fill="{_STYLE.floor}"/>')
    return "".join([*parts, "</svg>"]).encode()


def _open_places(rings: str, wall: int) -> Iterable[str]:
    """Yield balconies and terraces with a thin parapet, as far outside as a wall would be."""
    for stroke, width in ((_STYLE.wall, wall + _PARAPET_TENTHS), (_STYLE.floor, wall)) if rings else ():
        yield f'<path d="{rings}" fill="{_STYLE.floor}" stroke="{stroke}" stroke-width="{width}"/>'


def _panes(plan: FloorPlan, wall_m: float) -> npt.NDArray[np.float64]:
    """Return the middle third of each window in its wall, drawn ``wall_m`` thick round the floor, (n, 4, 2)."""
    import shapely

    ends = np.array([window.segment for window in plan.windows], dtype=np.float64)
    along = (ends[:, 1] - ends[:, 0]) / np.maximum([window.width for window in plan.windows], 1e-6)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    sizes = [len(window.ring) for window in plan.windows]
    corners = np.concatenate([window.ring for window in plan.windows]) - np.repeat(ends[:, 0], sizes, axis=0)
    depths = (corners * np.repeat(across, sizes, axis=0)).sum(axis=1)
    starts = np.cumsum([0, *sizes[:-1]])
    low, high = np.minimum.reduceat(depths, starts), np.maximum.reduceat(depths, starts)
    faces = ends + np.stack([low, high])[..., None, None] * across[:, None]  # (2, n, 2 ends, 2)
    walls = shapely.multilinestrings([shapely.linearrings(ring) for ring in (plan.verts, *plan.holes)])
    is_low = np.less(*shapely.distance(walls, shapely.linestrings(faces)))
    near = np.where(is_low[:, None, None], *faces)
    out = (np.where(is_low, 1, -1)[:, None] * across * wall_m / 3)[:, None]
    return np.concatenate([near + out, (near + 2 * out)[:, ::-1]], axis=1)


def _rooms(plan: FloorPlan, path: Callable[[Iterable[Any]], str]) -> Iterable[str]:
    for room in plan.rooms:
        yield f'<path d="{path([room.ring, *room.holes])}" fill="{_FILLS[room.label]}"/>'


def _boxes(plan: FloorPlan, path: Callable[[float, float, float, float], str], whole: str) -> Iterable[str]:
    """Yield the label boxes, clipped by the outline, small ones above large ones."""
    boxes = [(label, box) for label, found in plan.room_category.items() for box in found]
    boxes.sort(key=lambda item: -(item[1][2] - item[1][0]) * (item[1][3] - item[1][1]))
    yield f'<clipPath id="a"><path clip-rule="evenodd" d="{whole}"/></clipPath><g clip-path="url(#a)">'
    for label, box in boxes:
        yield f'<path d="{path(*box)}" fill="{_FILLS.get(label, _NO_LABEL)}"/>'
    yield "</g>"


def _path(ring: Ring) -> str:
    return f"M{' '.join(map(str, np.rint(_fewer(ring)).astype(np.int64).ravel().tolist()))}"


def _fewer(ring: Ring) -> Ring:
    if len(ring) <= _MANY:
        return ring
    import shapely

    line = shapely.simplify(
        shapely.linearrings(ring), _FINE, preserve_topology=False
    )  # preserving the topology takes 10 ms
    fewer: Ring = shapely.get_coordinates(line)[:-1]
    return fewer
