"""Lay out the picture of a plan as areas and texts in plan metres, which pixels, SVG and matplotlib then draw."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import check_not_too_coarse
from houseexpo.plan import DOOR_KINDS, Box, DoorKind
from houseexpo.plan.model import PlanData
from houseexpo.plan.room_labels import label_colour

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont
    from shapely import LineString, MultiPolygon, Point, Polygon
    from shapely.geometry.base import BaseGeometry

INK: Final = "#2f343b"
PAPER: Final = "#ffffff"
WALL: Final = "#454b54"
FLOOR: Final = "#f6f4ef"
FURNITURE: Final = "#e2ddd3"
_UNSURE_ROOM: Final = "#8d8778"
FURNITURE_EDGE: Final = "#a9a294"
# blue, light blue, amber, magenta: distinguishable by colour-blind readers
DOOR_COLOURS: Final[dict[DoorKind, str]] = {
    "door": "#2f6da8",
    "opening": "#8fbde0",
    "entrance": "#e39a1f",
    "cut": "#c2188f",
}
_TINTS: Final[dict[DoorKind, str]] = {
    "door": "#bdd3e6",
    "opening": "#dcebf6",
    "entrance": "#f6ddb3",
    "cut": "#edb9de",
}

_WALL_M: Final = 0.15  # walls are drawn this thick around the outline, and solid up to four times this
_LEAF_M: Final = 0.05
_DASH_M: Final = 0.12  # an unsure door is dashed, an unsure room is hatched with bands of this width at this distance
_HATCH_M: Final = (0.06, 0.6)
_EDGE_M: Final = 0.03  # the line around a piece of furniture
_SMALLEST_PX: Final = 8
_SAME_ROOM: Final = 0.7  # boxes with a larger intersection over union are one room with several labels
_BARS_M: Final = (0.5, 1, 2, 5, 10, 20, 50)


@dataclass(frozen=True)
class FilledArea:
    """A filled polygon, metres."""

    shape: Polygon | MultiPolygon
    fill: str


@dataclass(frozen=True)
class _Space:
    """A room, or the label box of one in a published plan."""

    labels: tuple[str, ...]
    shape: Polygon


@dataclass(frozen=True)
class TextLines:
    """Lines of text, centred on a point in metres or starting there; ``size`` is in pixels."""

    x: float
    y: float
    lines: tuple[str, ...]
    size: float
    centred: bool = True


@dataclass(frozen=True)
class Scene:
    """A picture: ``bounds`` in metres, and a scale; later areas cover earlier ones, and texts cover areas."""

    bounds: Box
    pixels_per_metre: float
    areas: tuple[FilledArea, ...]
    words: tuple[TextLines, ...]


@lru_cache(maxsize=64)  # a new font object would be unpacked, and its glyphs drawn, again
def load_font(size: float) -> FreeTypeFont:
    """Return the font that comes with Pillow, so that pictures look the same on every machine."""
    from PIL import ImageFont

    return ImageFont.load_default(size)  # type: ignore[return-value]  # a FreeTypeFont wherever a size is given


def lay_out_plan(plan: PlanData, pixels_per_metre: float | None, size: int) -> Scene:
    """Lay out the picture of a plan.

    It has rooms in their label's colour with the label and the area, dark walls, light furniture, doors by kind, and
    below them a scale bar and a legend. What is more likely wrong than right is shown as unsure: a door dashed, a room
    hatched. A published plan has no rooms; the parts of its label boxes in the free space are drawn instead.
    """
    x1, y1, x2, y2 = plan.free_space.bounds
    extent = max(x2 - x1, y2 - y1)
    # the margins take 4% of the size on each side and a line of text below
    scale = size * 0.92 / extent if pixels_per_metre is None else pixels_per_metre
    if not (math.isfinite(scale) and scale > 0):
        asked = f"size {size!r}" if pixels_per_metre is None else f"pixels_per_metre {pixels_per_metre!r}"
        raise ConfigError(f"picture: expected a size of more than 0 pixels, found {asked}")
    check_not_too_coarse((x1, y1, x2, y2), scale, plan.id)
    text = min(max(0.24 * scale, 9.0), 15.0)
    margin, line = 0.04 * extent + _WALL_M, 2.2 * text / scale
    closed = _inner_area(plan).buffer(2 * _WALL_M, join_style="mitre").buffer(-_WALL_M, join_style="mitre")
    rooms = list(_rooms(plan)) or list(_boxes(plan))
    floors = [FilledArea(room.shape, label_colour(room.labels[0])) for room in rooms]
    inside = [*floors, *_hatches(plan), *_furniture(plan), *_doors(plan)]
    areas = [FilledArea(closed, WALL), FilledArea(plan.free_space, FLOOR), *inside]
    words = [found for room in rooms if (found := _label(room, scale, text, area=bool(plan.rooms)))]
    bottom = y1 - margin
    key_areas, key_words, right = _key(plan, (x1, bottom - line / 2), text, scale)
    bounds = (x1 - margin, bottom - line, max(x2 + margin, right + text / scale), y2 + margin)
    return Scene(bounds, scale, (*areas, *key_areas), (*words, *key_words))


def _inner_area(plan: PlanData) -> Polygon | MultiPolygon:
    """Return the area of the outline and of furniture that is cut out of it."""
    if not plan.objects:
        return plan.outline
    import shapely

    return shapely.union_all([plan.outline, plan.floor])


def _rooms(plan: PlanData) -> list[_Space]:
    return [_Space((room.label,), room.polygon) for room in plan.rooms]


def _boxes(plan: PlanData) -> list[_Space]:
    """Return the label boxes within the free space, large ones first; boxes of one room share their text."""
    import shapely

    boxes = [(label, shapely.box(*found)) for label, several in plan.room_category.items() for found in several]
    whole: list[Polygon] = []
    spaces: list[_Space] = []
    for label, box in sorted(boxes, key=lambda item: float(item[1].area)):
        part = _largest(plan.free_space.intersection(box))
        if part is None:
            continue
        twin = next((i for i, other in enumerate(whole) if _overlap(part, other) > _SAME_ROOM), None)
        if twin is not None:
            spaces[twin] = replace(spaces[twin], labels=(*spaces[twin].labels, label))
        elif (seen := _largest(part.difference(shapely.union_all(whole)))) is not None:
            whole.append(part)
            spaces.append(_Space((label,), seen))
    return spaces


def _largest(shape: BaseGeometry) -> Polygon | None:
    import shapely

    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
    return max(parts, key=lambda part: float(part.area), default=None)


def _overlap(one: Polygon, other: Polygon) -> float:
    common = float(one.intersection(other).area)
    return common / (float(one.area) + float(other.area) - common)


def _furniture(plan: PlanData) -> Iterator[FilledArea]:
    for thing in plan.objects:
        yield FilledArea(thing.polygon, FURNITURE_EDGE)
        if not (inside := thing.polygon.buffer(-_EDGE_M, join_style="mitre")).is_empty:
            yield FilledArea(inside, FURNITURE)


def _doors(plan: PlanData) -> Iterator[FilledArea]:
    import shapely

    for door in plan.doors:
        yield FilledArea(door.polygon, _TINTS[door.kind])
        leaf = shapely.LineString(door.segment)
        for part in _dashes(leaf) if door.is_unsure else [leaf]:
            yield FilledArea(part.buffer(_LEAF_M / 2, cap_style="flat"), DOOR_COLOURS[door.kind])


def _dashes(line: LineString) -> list[LineString]:
    """Return a line as dashes, the first and the last at its ends."""
    from shapely.ops import substring

    count = max(3, 2 * math.floor(line.length / _DASH_M / 2) + 1)
    each = line.length / count
    return [substring(line, k * each, (k + 1) * each) for k in range(0, count, 2)]


def _hatches(plan: PlanData) -> Iterator[FilledArea]:
    """Return the hatching of unsure rooms."""
    import shapely

    thick, apart = _HATCH_M
    for room in plan.rooms:
        if not room.is_unsure:
            continue
        x1, y1, x2, y2 = room.polygon.bounds
        steps = range(math.floor((x1 + y1) / apart), math.ceil((x2 + y2) / apart) + 1)
        lines = [shapely.LineString([(k * apart - y1, y1), (k * apart - y2, y2)]) for k in steps]
        bands = shapely.buffer(shapely.union_all(lines), thick / 2).intersection(room.polygon)
        for part in shapely.get_parts(bands):
            yield FilledArea(part, _UNSURE_ROOM)


def _label(room: _Space, scale: float, size: float, *, area: bool) -> TextLines | None:
    """Place a label and the area where the room is wide, as large as fits on one or more lines; None if too small."""
    centre, clearance = _middle(room.shape)
    wide_px = _free_width(room.shape, centre) * scale * 0.92
    tall_px = 2 * clearance * scale * 0.95
    extra = (f"{room.shape.area:.1f} m²",) if area else ()
    name = " / ".join(room.labels).replace("_", " ")
    stack = name.split(" / ") if " / " in name else name.split(" ")
    layouts = [(name, *extra), (*stack, *extra), (name,), tuple(stack)]  # in order of preference

    length = {line: _text_length(line, size) for lines in layouts for line in lines}

    def fits(lines: tuple[str, ...]) -> float:
        longest = max(length[line] for line in lines)
        return min(size, size * wide_px / longest, tall_px / (1.2 * len(lines)))

    lines = next((found for found in layouts if fits(found) >= 0.85 * size), None) or max(layouts, key=fits)
    return TextLines(centre.x, centre.y, lines, round(fits(lines), 1)) if fits(lines) >= _SMALLEST_PX else None


@lru_cache(maxsize=4096)  # plans have the same few names
def _text_length(text: str, size: float) -> float:
    return load_font(size).getlength(text.replace("²", "2"))  # Pillow's font has no superscript 2


def _middle(shape: Polygon) -> tuple[Point, float]:
    """Return the centroid if there is space around it, else the centre of the widest disc; and the space, metres."""
    import shapely

    circle = shapely.maximum_inscribed_circle(shape, tolerance=0.05)
    centroid = shape.centroid
    space = float(shape.boundary.distance(centroid))
    if shape.contains(centroid) and space > 0.6 * circle.length:
        return centroid, space
    return shapely.Point(circle.coords[0]), float(circle.length)


def _free_width(shape: Polygon, centre: Point) -> float:
    """Return the free width around a point, the same on its left and right, metres."""
    import shapely

    x1, _, x2, _ = shape.bounds
    whole = shape if shape.is_valid else shapely.make_valid(shape)
    across = whole.intersection(shapely.LineString([(x1 - 1, centre.y), (x2 + 1, centre.y)]))
    for part in shapely.get_parts(across):
        left, _, right, _ = part.bounds
        if left <= centre.x <= right:
            return float(2 * min(centre.x - left, right - centre.x))
    return 0.0


def _key(
    plan: PlanData, start: tuple[float, float], size: float, scale: float
) -> tuple[list[FilledArea], list[TextLines], float]:
    """Return a scale bar and a legend of doors and furniture in a row from a point, and the row's end, metres."""
    import shapely

    (x, y), half, em = start, 0.18 * size / scale, size / scale
    x1, y1, x2, y2 = plan.bbox
    length = max((bar for bar in _BARS_M if bar <= max(x2 - x1, y2 - y1) / 4), default=_BARS_M[0])
    areas = [FilledArea(shapely.box(x, y - half, x + length, y + half), INK)]
    areas += [FilledArea(shapely.box(x + length / 2, y - half * 0.5, x + length - half / 2, y + half * 0.5), PAPER)]
    entries = [(f"{length:g} m", x + length + 0.5 * em)]
    occur: dict[str, str] = {k: DOOR_COLOURS[k] for k in DOOR_KINDS if any(door.kind == k for door in plan.doors)}
    occur |= {"furniture": FURNITURE_EDGE} if plan.objects else {}
    unsure = any(room.is_unsure for room in plan.rooms) or any(door.is_unsure for door in plan.doors)
    occur |= {"unsure": _UNSURE_ROOM} if unsure else {}
    for name, fill in occur.items():
        left = entries[-1][1] + load_font(size).getlength(entries[-1][0]) / scale + 1.2 * em
        steps = ((0.0, 1.0),) if name != "unsure" else ((0.0, 0.2), (0.4, 0.6), (0.8, 1.0))
        for a, b in steps:
            areas.append(FilledArea(shapely.box(left + a * em, y - half * 1.6, left + b * em, y + half * 1.6), fill))
        entries.append((name, left + 1.4 * em))
    words = [TextLines(at, y, (text,), size, centred=False) for text, at in entries]
    return areas, words, entries[-1][1] + load_font(size).getlength(entries[-1][0]) / scale
