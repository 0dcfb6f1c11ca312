"""Lay out the picture of a plan as areas and texts in plan metres, which pixels, SVG and matplotlib then draw."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.drawing.door_leaves import OUTDOORS, Leaf, door_leaves, entrance_gap, valid_shape, window_in_walls
from houseexpo.drawing.room_names import SMALLEST_PX, TextLines, place_name, text_length
from houseexpo.drawing.stairs import DrawnStair, drawn_stairs, is_stair
from houseexpo.drawing.styles import DOOR_COLOURS, DOOR_TINTS, UNSURE, Style, StyleName, style_named
from houseexpo.errors import ConfigError
from houseexpo.grids.frame import check_not_too_coarse
from houseexpo.plan import DOOR_KINDS, Box, Door, PlanObject
from houseexpo.plan.model import PlanData

if TYPE_CHECKING:
    from shapely import LineString, MultiPolygon, Polygon
    from shapely.geometry.base import BaseGeometry

_GAP_M: Final = 0.6  # walls are not drawn farther outside the outline
_LEAF_M: Final = 0.05
_PARAPET_WIDTH_M: Final = 0.05
_NECK_M: Final = 0.01  # what is cut off beside a door to a balcony, so that no sliver of it stays
_DASH_M: Final = 0.12  # an unsure door is dashed, an unsure room is hatched with bands of this width at this distance
_HATCH_M: Final = (0.06, 0.6)
_EDGE_M: Final = 0.03  # the line around a piece of furniture
_SAME_ROOM: Final = 0.7  # boxes with a larger intersection over union are one room with several labels
_BARS_M: Final = (0.5, 1, 2, 5, 10, 20, 50)


@dataclass(frozen=True)
class FilledArea:
    """A filled polygon, metres."""

    shape: Polygon | MultiPolygon
    fill: str


@dataclass(frozen=True)
class _Space:
    """A room, or the label box of a room in a published plan."""

    labels: tuple[str, ...]
    shape: Polygon
    name: str
    id: int | None = None
    is_stair: bool = False

    @property
    def words(self) -> tuple[str, ...]:
        """The text in it: its name, if any, and the area of a room."""
        area = () if self.id is None else (f"{self.shape.area:.1f} m²",)
        return (*([self.name] if self.name else ()), *area)


@dataclass(frozen=True)
class ThinLine:
    """A line through points (n, 2) in metres; ``width`` is in pixels."""

    points: npt.NDArray[np.float64]
    colour: str
    width: float


@dataclass(frozen=True)
class Scene:
    """A picture: ``bounds`` in metres, and a scale.

    Later areas cover earlier ones, lines cover areas, and texts cover lines. ``key_areas`` and ``key_words`` are the
    scale bar and the legend, below the plan.
    """

    bounds: Box
    pixels_per_metre: float
    style: Style
    areas: tuple[FilledArea, ...]
    lines: tuple[ThinLine, ...]
    words: tuple[TextLines, ...]
    key_areas: tuple[FilledArea, ...]
    key_words: tuple[TextLines, ...]


@dataclass(frozen=True)
class Parts:
    """Which parts of a plan a picture shows, and how thick its outer walls are, metres."""

    rooms: bool = True
    labels: bool = True
    doors: bool = True
    objects: bool = True
    walls: bool = True
    wall_m: float = 0.15


ALL_PARTS: Final = Parts()


def lay_out_plan(
    plan: PlanData,
    pixels_per_metre: float | None,
    size: int,
    style: StyleName = "architect",
    parts: Parts = ALL_PARTS,
) -> Scene:
    """Lay out the picture of a plan in a style (``houseexpo.drawing.styles``).

    It shows rooms with label and area, dark walls, doors and furniture, and below them a scale bar and a legend of the
    parts that need an explanation. An unsure door (more likely wrong than right) is dashed, an unsure room is hatched.
    A published plan has no rooms; the parts of its label boxes in the free space are drawn instead.
    """
    import shapely

    look = style_named(style)
    x1, y1, x2, y2 = plan.free_space.bounds
    extent = max(x2 - x1, y2 - y1)
    # the margins take 4% of the size on each side and a line of text below
    scale = size * 0.92 / extent if pixels_per_metre is None else pixels_per_metre
    if not (math.isfinite(scale) and scale > 0):
        asked = f"size {size!r}" if pixels_per_metre is None else f"pixels_per_metre {pixels_per_metre!r}"
        raise ConfigError(f"picture: expected a size of more than 0 pixels, found {asked}")
    check_not_too_coarse((x1, y1, x2, y2), scale, plan.id)
    text = _letters_px(scale)
    margin, line = 0.04 * extent + parts.wall_m, 2.2 * text / scale
    rooms = (list(_rooms(plan)) or list(_boxes(plan))) if parts.rooms else []
    doors = plan.doors if parts.doors else ()
    objects = plan.objects if parts.objects else plan.stairwells
    leaves = door_leaves(plan) if look.swings and doors else {}
    hair = min(max(0.02 * scale, 0.7), 1.6)  # thin lines and leaves stay visible, and thin
    areas: list[FilledArea] = []
    lines: list[ThinLine] = []
    walls = closed_walls(plan, parts.wall_m)
    if parts.walls:
        areas.append(FilledArea(walls, look.wall))
    areas.append(FilledArea(plan.free_space, look.floor))
    for place, label in open_places(plan, walls, parts.wall_m) if parts.walls else ():
        areas.append(FilledArea(place, look.room(label) if parts.rooms else look.floor))
        edge = shapely.line_merge(place.boundary.difference(walls.buffer(_PARAPET_WIDTH_M / 2)))
        lines += [ThinLine(shapely.get_coordinates(part), look.wall, 2 * hair) for part in shapely.get_parts(edge)]
    areas += [FilledArea(room.shape, look.room(room.labels[0])) for room in rooms]
    areas += _hatches(plan, look) if parts.rooms else ()
    for thing in objects:
        areas += _furniture(thing, look)
        if look.swings:
            lines.append(ThinLine(_close_ring(thing.ring), look.line, hair))
    stairs = list(drawn_stairs(plan)) if parts.rooms else []
    for stair in stairs:
        lines += [ThinLine(points, look.line, hair) for points in (*stair.treads, stair.way, stair.head)]
    for door in doors:
        if look.swings:
            areas += _gap(door, plan, walls, look) if door.kind == "entrance" and parts.walls and door.width else ()
            lines += _door_lines(door, leaves.get(door.id, ()), look, hair, scale)
        else:
            areas += _coloured_door(door)
    for _, gap in drawn_windows(plan, walls, parts.wall_m) if parts.doors and parts.walls else ():
        areas.append(FilledArea(gap, look.floor if look.swings else DOOR_TINTS["window"]))
        lines += _window_lines(gap, look, hair)
    words = _words(rooms, objects, leaves, stairs, look=look, scale=scale) if parts.labels else ()
    bottom = y1 - margin
    key_areas, key_words, right = _key(plan, (x1, bottom - line / 2), text, scale, look)
    bounds = (x1 - margin, bottom - line, max(x2 + margin, right + text / scale), y2 + margin)
    return Scene(bounds, scale, look, tuple(areas), tuple(lines), tuple(words), (*key_areas,), (*key_words,))


def place_words(
    plan: PlanData, leaves: Mapping[int, Sequence[Leaf]], scales: Iterable[float]
) -> Iterator[list[TextLines]]:
    """Yield the words of a plan's picture for each scale, pixels per metre: names and areas of rooms, ways of stairs.

    ``leaves`` are those of ``door_leaves``.
    """
    rooms, stairs = list(_rooms(plan)) or list(_boxes(plan)), list(drawn_stairs(plan))
    for scale in scales:
        yield _words(rooms, plan.objects, leaves, stairs, look=style_named("architect"), scale=scale)


def _letters_px(scale: float) -> float:
    return min(max(0.24 * scale, 9.0), 15.0)


def _words(
    rooms: Sequence[_Space],
    objects: Sequence[PlanObject],
    leaves: Mapping[int, Sequence[Leaf]],
    stairs: Sequence[DrawnStair],
    *,
    look: Style,
    scale: float,
) -> list[TextLines]:
    """Return the rooms' names and areas, and "up" or "down" at stairs, where they fit."""
    size = _letters_px(scale)
    swings = [leaf.swing for several in leaves.values() for leaf in several]
    words = list(_names(rooms, objects, swings, look, scale=scale, size=size))
    return words + [word for stair in stairs if (word := _up_or_down(stair, look, scale, size))]


def drawn_windows(
    plan: PlanData, house: Polygon | MultiPolygon, wall_m: float = ALL_PARTS.wall_m
) -> Iterator[tuple[Door, Polygon]]:
    """Yield the windows of a plan, each with the part of the walls of ``closed_walls`` that it takes."""
    walls = house.difference(plan.floor) if plan.windows else house
    for window in plan.windows:
        if (gap := window_in_walls(window, walls, wall_m)) is not None:
            yield window, gap


def closed_walls(plan: PlanData, wall_m: float = ALL_PARTS.wall_m) -> Polygon | MultiPolygon:
    """Return the house with its walls: gaps between rooms are filled, up to four times the outer walls' thickness.

    Balconies and terraces are outside.
    """
    import shapely

    outdoors = [room for room in plan.rooms if room.label in OUTDOORS]
    numbers = {room.id for room in outdoors}
    ways = [door.polygon for door in plan.doors if numbers.intersection(door.rooms)]
    outside = shapely.union_all([valid_shape(room.polygon) for room in outdoors] + ways)
    inside = _inner_area(plan)
    if not outside.is_empty:
        near = outside.buffer(_NECK_M, join_style="mitre")
        walls = [part for part in shapely.get_parts(inside.difference(plan.floor)) if part.intersects(near)]
        rest = inside.difference(shapely.union_all([near, *walls]))
        inside = inside if rest.is_empty else rest
    return _close(inside, wall_m, wall_m)


def open_places(
    plan: PlanData, house: Polygon | MultiPolygon, wall_m: float = ALL_PARTS.wall_m
) -> Iterator[tuple[Polygon, str]]:
    """Yield balconies and terraces, with their parapets and up to the walls of ``closed_walls``, and their labels."""
    import shapely

    outdoors = [room for room in plan.rooms if room.label in OUTDOORS]
    beyond = _close(_inner_area(plan), wall_m, _PARAPET_WIDTH_M).difference(house) if outdoors else house
    for place in shapely.get_parts(beyond) if outdoors else ():
        labels = [room.label for room in outdoors if place.intersects(room.polygon)]
        if labels:
            yield place, labels[0]


def _close(inside: Polygon | MultiPolygon, wall_m: float, edge_m: float) -> Polygon | MultiPolygon:
    """Return an area with an edge around it, its gaps filled."""
    with np.errstate(divide="ignore", invalid="ignore"):  # GEOS divides by zero where parallel walls meet, and goes on
        return inside.buffer(2 * wall_m, join_style="mitre").buffer(edge_m - 2 * wall_m, join_style="mitre")


def _close_ring(ring: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.vstack([ring, ring[:1]])


def _inner_area(plan: PlanData) -> Polygon | MultiPolygon:
    """Return the area of the outline together with furniture that is cut out of the outline."""
    if not plan.objects:
        return plan.outline
    import shapely

    return shapely.union_all([plan.outline, plan.floor])


def _rooms(plan: PlanData) -> list[_Space]:
    return [_Space((room.label,), room.polygon, room.name, room.id, is_stair(room)) for room in plan.rooms]


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
            labels = (*spaces[twin].labels, label)
            spaces[twin] = replace(spaces[twin], labels=labels, name=" / ".join(labels).replace("_", " "))
        elif (seen := _largest(part.difference(shapely.union_all(whole)))) is not None:
            whole.append(part)
            spaces.append(_Space((label,), seen, label.replace("_", " ")))
    return spaces


def _largest(shape: BaseGeometry) -> Polygon | None:
    import shapely

    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
    return max(parts, key=lambda part: float(part.area), default=None)


def _overlap(one: Polygon, other: Polygon) -> float:
    common = float(one.intersection(other).area)
    return common / (float(one.area) + float(other.area) - common)


def _furniture(thing: PlanObject, look: Style) -> Iterator[FilledArea]:
    if look.swings:  # the edge is a thin line
        yield FilledArea(thing.polygon, look.furniture)
        return
    yield FilledArea(thing.polygon, look.line)
    if not (inside := thing.polygon.buffer(-_EDGE_M, join_style="mitre")).is_empty:
        yield FilledArea(inside, look.furniture)


def _coloured_door(door: Door) -> Iterator[FilledArea]:
    import shapely

    yield FilledArea(door.polygon, DOOR_TINTS[door.kind])
    leaf = shapely.LineString(door.segment)
    for part in _dashes(leaf) if door.is_unsure else [leaf]:
        yield FilledArea(part.buffer(_LEAF_M / 2, cap_style="flat"), DOOR_COLOURS[door.kind])


def _gap(door: Door, plan: PlanData, walls: Polygon | MultiPolygon, look: Style) -> Iterator[FilledArea]:
    """Return the gap of an entrance in the walls; other doors are free space."""
    gap = entrance_gap(door, _GAP_M).intersection(walls).difference(plan.floor)
    if gap.area > 0:
        yield FilledArea(gap, look.floor)


def _window_lines(gap: Polygon, look: Style, hair: float) -> Iterator[ThinLine]:
    """Return a window's double line, along the two faces of its wall."""
    import shapely

    for face in shapely.get_coordinates(gap)[:4].reshape(2, 2, 2):
        yield ThinLine(face, look.ink if look.swings else DOOR_COLOURS["window"], hair)


def _door_lines(door: Door, leaves: Sequence[Leaf], look: Style, hair: float, scale: float) -> Iterator[ThinLine]:
    """Return a door's leaves and their arcs, the threshold of an entrance, and the dashed edges of a cut."""
    import shapely

    drawn: list[tuple[npt.NDArray[np.float64], str, float, bool]] = []
    for leaf in leaves:
        drawn.append((np.array([leaf.hinge, leaf.end]), look.ink, min(max(_LEAF_M * scale, 1.2), 3.0), door.is_unsure))
        drawn.append((leaf.arc, look.line, hair, door.is_unsure))
    start, end = np.asarray(door.segment)
    if door.kind == "cut":
        drawn.append((np.array([start, end]), look.ink, hair, True))
    elif door.kind == "entrance" or (door.is_unsure and not leaves):
        drawn.append((np.array([start, end]), look.line, hair, door.is_unsure))
    for points, colour, width, dashed in drawn:
        parts = [shapely.get_coordinates(dash) for dash in _dashes(shapely.LineString(points))] if dashed else [points]
        for part in parts:
            yield ThinLine(part, colour, width)


def _dashes(line: LineString) -> list[LineString]:
    """Return a line as dashes, the first and the last at its ends."""
    from shapely.ops import substring

    count = max(3, 2 * math.floor(line.length / _DASH_M / 2) + 1)
    each = line.length / count
    return [substring(line, k * each, (k + 1) * each) for k in range(0, count, 2)]


def _hatches(plan: PlanData, look: Style) -> Iterator[FilledArea]:
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
            yield FilledArea(part, look.line if look.swings else UNSURE)


def _names(
    rooms: Sequence[_Space],
    objects: Sequence[PlanObject],
    swings: Sequence[Polygon],
    look: Style,
    *,
    scale: float,
    size: float,
) -> Iterator[TextLines]:
    """Return the rooms' names and areas, where they fit."""
    import shapely

    groups = [np.array(shapes, dtype=object) for shapes in (swings, [thing.polygon for thing in objects])]
    trees = [shapely.STRtree(shapes) for shapes in groups]
    for room in rooms:
        if room.is_stair:  # its lines say so
            continue
        inside = [valid_shape(thing.polygon) for thing in objects if thing.room is not None and thing.room == room.id]
        floor = _largest(shapely.union_all([valid_shape(room.shape), *inside])) or room.shape
        near, things = (
            shapes[np.sort(tree.query(floor, predicate="intersects"))].tolist()
            for shapes, tree in zip(groups, trees, strict=True)
        )
        halo = look.room(room.labels[0])
        found = place_name(floor, near, things, room.words, pixels_per_metre=scale, size=size, halo=halo)
        if found is not None:
            yield found


def _up_or_down(stair: DrawnStair, look: Style, scale: float, size: float) -> TextLines | None:
    """Return the word at the tail of a stair's arrow, where the flight has place for it."""
    first = stair.way[1] - stair.way[0]
    place = min(stair.broad_m, float(np.hypot(*first)))
    halo = look.furniture if stair.is_down else look.room("Unlabelled")
    for letters in (size, SMALLEST_PX):
        word = TextLines(0.0, 0.0, ("down" if stair.is_down else "up",), letters, halo=halo)
        box = word.box_m(scale)
        if max(box) <= place:
            ahead = first / np.hypot(*first)
            x, y = (stair.way[0] + ahead * np.abs(ahead @ box) / 2).tolist()
            return replace(word, x=x, y=y)
    return None


def _key(
    plan: PlanData, start: tuple[float, float], size: float, scale: float, look: Style
) -> tuple[list[FilledArea], list[TextLines], float]:
    """Return a scale bar and a legend of doors and furniture in a row from a point, and the row's end, metres."""
    import shapely

    (x, y), half, em = start, 0.18 * size / scale, size / scale
    x1, y1, x2, y2 = plan.bbox
    length = max((bar for bar in _BARS_M if bar <= max(x2 - x1, y2 - y1) / 4), default=_BARS_M[0])
    areas = [FilledArea(shapely.box(x, y - half, x + length, y + half), look.ink)]
    empty = shapely.box(x + length / 2, y - half * 0.5, x + length - half / 2, y + half * 0.5)
    areas += [FilledArea(empty, look.paper)]
    entries = [(f"{length:g} m", x + length + 0.5 * em)]
    kinds = [kind for kind in DOOR_KINDS if any(door.kind == kind for door in (*plan.doors, *plan.windows))]
    occur: dict[str, str] = {}
    if look.swings:  # leaves and furniture need no explanation
        occur |= {"cut": look.ink} if "cut" in kinds else {}
    else:
        occur |= {kind: DOOR_COLOURS[kind] for kind in kinds}
        occur |= {"furniture": look.line} if plan.furniture else {}
    unsure = any(room.is_unsure for room in plan.rooms) or any(door.is_unsure for door in plan.doors)
    occur |= {"unsure": look.line if look.swings else UNSURE} if unsure else {}
    for name, fill in occur.items():
        left = entries[-1][1] + text_length(entries[-1][0], size) / scale + 1.2 * em
        steps = ((0.0, 1.0),) if name != "unsure" and not look.swings else ((0.0, 0.2), (0.4, 0.6), (0.8, 1.0))
        for a, b in steps:
            areas.append(FilledArea(shapely.box(left + a * em, y - half * 1.6, left + b * em, y + half * 1.6), fill))
        entries.append((name, left + 1.4 * em))
    words = [TextLines(at, y, (text,), size, centred=False) for text, at in entries]
    return areas, words, entries[-1][1] + text_length(entries[-1][0], size) / scale
