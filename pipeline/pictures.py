"""Draw the result of each stage of a house as an RGB picture, like the paper's Figure 2, or all on one sheet."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image, ImageDraw
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.graph import shortest_path
from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.drawing.room_names import load_font
from houseexpo.drawing.styles import DOOR_COLOURS, INK, PAPER, WALL
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Box, Frame
from pipeline.algorithm import StageResult
from pipeline.geometry.areas import polygons_of
from pipeline.geometry.rooms_and_passages import walkable_floor
from pipeline.png import Picture, encode_png
from pipeline.values import Evidence, JoinedPoints, Layout, Planes, Spaces

OUTSIDE = "#e4e6e8"
FLOOR = "#f6f4ef"
GONE = "#e07a6b"
SIDE_PX = 900
_COLUMNS, _TILE_PX = 3, 480  # of the sheet: 1,650 pixels wide, so that its words can be read
PATH = "#7a4fb5"
DOOR, OPENING = DOOR_COLOURS["entrance"], "#f0c987"
LINTEL, SILL, GAP, RAIL, BOUNDARY = "#2f6da8", "#4aa3a2", "#8fbde0", "#a68fd0", "#d98a1f"
CANDIDATES = {
    "opening": OPENING,
    "door": DOOR,
    "lintel": LINTEL,
    "sill": SILL,
    "gap": GAP,
    "gate": GAP,
    "mouth": GAP,
    "rail": RAIL,
    "room_edge": BOUNDARY,
    "floor_edge": BOUNDARY,
    "wall_ends": BOUNDARY,
}


def stage_pictures(results: Sequence[StageResult], frame: Frame, side_px: int = SIDE_PX) -> list[tuple[str, Picture]]:
    """Return name and picture (rows, cols, 3) of each stage, in order; y points up, as in the level frame.

    ``frame`` is the level's: the picture of the evidence has the source's metres on its edges. ``side_px`` is the
    longer side of a picture.
    """
    if not results:
        return []
    pictures: list[tuple[str, Picture]] = []
    bounds = _bounds(results)
    before: Spaces | None = None
    for result in results:
        value = result.value
        if isinstance(value, FloorPlan):
            pictures.append(("plan", draw_plan(value, size=side_px)))
            continue
        canvas = AreaCanvas(bounds, side_px)
        if isinstance(value, Evidence):
            pictures.append(("evidence", draw_evidence(value, bounds, frame, side_px)))
        elif isinstance(value, Planes):
            pictures += _draw_planes(value, bounds, side_px)
        elif isinstance(value, Layout):
            pictures.append(("layout", _draw_layout(canvas, value)))
        elif isinstance(value, Spaces):
            pictures.append((result.stage, _draw_spaces(canvas, value, before)))
            before = value
    return pictures


def results_of_building(results: Sequence[StageResult], level_id: str, building_id: str) -> list[StageResult]:
    """Return the steps of the whole level, and of one of its buildings."""
    return [result for result in results if result.id in {level_id, building_id}]


def compose_sheet(results: Sequence[StageResult], frame: Frame) -> bytes:
    """Lay the pictures of the stages out on one sheet, a PNG, each with its name; equal ones in a row are one."""
    shown: list[tuple[str, Picture]] = []
    for title, image in stage_pictures(results, frame, _TILE_PX):
        same = shown and np.array_equal(shown[-1][1][:-WORDS_PX], image[:-WORDS_PX])
        if same:
            shown[-1] = f"{shown[-1][0]}, {title}", shown[-1][1]
        else:
            shown.append((title, image))
    titles, images = zip(*shown, strict=True)
    return encode_png(contact_sheet(images, min(len(images), _COLUMNS), titles))


def _bounds(results: Sequence[StageResult]) -> Box:
    """Return the bounds of everything in the first stages; one metre if there is nothing."""
    seen: list[BaseGeometry] = []
    for value in (result.value for result in results):
        if isinstance(value, Evidence):
            seen += [value.walls, value.furniture, value.rails, *([value.floor] if value.floor is not None else [])]
        elif isinstance(value, Planes):
            seen += [value.door, value.sills, value.lintels]
    found = [shape.bounds for shape in seen if not shape.is_empty] or [(0.0, 0.0, 1.0, 1.0)]
    low, high = np.min(found, axis=0)[:2], np.max(found, axis=0)[2:]
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _draw_planes(planes: Planes, bounds: Box, side_px: int) -> list[tuple[str, Picture]]:
    door = AreaCanvas(bounds, side_px)
    door.fill(planes.door, WALL)
    known = shapely.union_all([doorway.polygon for doorway in planes.doorways])
    layers = [
        ("railing", RAIL, planes.rails),
        ("lintel", LINTEL, planes.lintels),
        ("sill", SILL, planes.sills),
        ("known doorway", DOOR, known),
        ("wall", WALL, planes.door),
    ]
    ground = AreaCanvas(bounds, side_px)
    for _, colour, shape in layers:
        ground.fill(shape, colour)
    legend = [(name, colour) for name, colour, shape in layers if not shape.is_empty]
    where = f", {planes.heights['door']:.2f} m" if "door" in planes.heights else ""
    return [
        ("door plane", door.finish(f"door plane P_d{where}", [("stands", WALL)])),
        ("ground plane", ground.finish("ground plane P_g: what closes the openings that P_d leaves", legend)),
    ]


def _draw_layout(canvas: AreaCanvas, layout: Layout) -> Picture:
    _draw_floors(canvas, layout.rooms)
    canvas.fill(layout.door, WALL)
    for candidate in layout.candidates:
        canvas.fill(candidate.polygon, CANDIDATES[candidate.closed_by])
    used = {c.closed_by for c in layout.candidates}
    legend = [
        ("wall", WALL),
        *((kind.replace("_", " "), colour) for kind, colour in CANDIDATES.items() if kind in used),
    ]
    return canvas.finish(f"layout: {len(layout.rooms)} closed spaces", legend)


def _draw_spaces(canvas: AreaCanvas, spaces: Spaces, before: Spaces | None) -> Picture:
    if spaces.outlines:
        canvas.fill(Polygon([(-1e4, -1e4), (1e4, -1e4), (1e4, 1e4), (-1e4, 1e4)]), OUTSIDE)
        for outline in spaces.outlines:
            canvas.fill(outline, WALL)
    else:
        canvas.fill(spaces.walls, WALL)
    gone = _lost_rooms(spaces, before)
    for room in gone:
        canvas.fill(room, GONE)
    _draw_floors(canvas, spaces.rooms)
    for passage in spaces.passages:
        canvas.fill(passage.strip(), DOOR_COLOURS[passage.kind])
    paths = _paths(spaces, spaces.joined[len(before.joined) :]) if before is not None else []
    for path in paths:
        canvas.trace(path, PATH)
    kinds = sorted({p.kind for p in spaces.passages})
    legend = [(kind, DOOR_COLOURS[kind]) for kind in kinds] + ([("filled or erased", GONE)] if gone else [])
    legend += [("path of a pair", PATH)] if paths else []
    notes = ", ".join(f"{name.replace('_', ' ')}: {value}" for name, value in spaces.notes.items())
    return canvas.finish(f"{len(spaces.rooms)} rooms, {len(spaces.passages)} passages  {notes}", legend)


def _paths(spaces: Spaces, pairs: Sequence[JoinedPoints]) -> list[npt.NDArray[np.float64]]:
    """Return the paths (n, 2) between pairs that cuts joined; pairs of parts that were left out have none."""
    if not pairs:
        return []
    floor = walkable_floor(spaces)
    found = [shortest_path(shapely.buffer(floor, -pair.radius_m), *pair.points) for pair in pairs]
    return [way.points for way in found if way is not None]


def _lost_rooms(spaces: Spaces, before: Spaces | None) -> list[Polygon]:
    """Return the rooms of the stage before that are gone."""
    if before is None:
        return []
    tree = shapely.STRtree(spaces.rooms)
    return [r for r in before.rooms if not len(tree.query(r.representative_point(), predicate="within"))]


def _draw_floors(canvas: AreaCanvas, rooms: Iterable[BaseGeometry]) -> None:
    for room in rooms:
        canvas.fill(room, FLOOR)


# A picture of plan areas to scale, with a title, a legend and the source's metres on its edges.


Legend = Sequence[tuple[str, str]]

WORDS_PX = 84  # below a picture: its title, and two lines of its legend
FINE = 2  # drawn larger by this and scaled down, so that edges are smooth
MARGIN_M, MARGIN_SHARE = 0.5, 0.03
TICKS = 12  # at most, along one edge
STEPS_M = (0.5, 1, 2, 5, 10, 20, 50)
RULER = "#9aa0a6"
CROSS = "#c2185b"  # on floors, furniture and walls alike


class AreaCanvas:
    """Areas in metres painted over each other, with a legend below."""

    def __init__(self, bounds: Box, side_px: int = SIDE_PX) -> None:
        x1, y1, x2, y2 = bounds
        margin = max(MARGIN_M, MARGIN_SHARE * max(x2 - x1, y2 - y1))
        self.bounds = x1 - margin, y1 - margin, x2 + margin, y2 + margin
        self.origin = np.array([x1 - margin, y2 + margin])
        width, height = x2 - x1 + 2 * margin, y2 - y1 + 2 * margin
        self.scale = side_px * FINE / max(width, height)
        self.image = Image.new("RGB", (round(width * self.scale), round(height * self.scale)), PAPER)

    def fill(self, shape: BaseGeometry, colour: str) -> None:
        """Paint every polygon of a geometry, holes left out."""
        for polygon in polygons_of(shape):
            outer, holes = self._pixels(polygon.exterior), [self._pixels(hole) for hole in polygon.interiors]
            (left, top), (right, bottom) = np.min(outer, axis=0), np.max(outer, axis=0)
            x, y = max(math.floor(left), 0), max(math.floor(top), 0)
            size = min(math.ceil(right) + 1, self.image.width) - x, min(math.ceil(bottom) + 1, self.image.height) - y
            if min(size) <= 0:
                continue
            mask = Image.new("1", size)  # no larger than it has to be: a large picture takes milliseconds to paste
            pen = ImageDraw.Draw(mask)
            for fill, ring in ((1, outer), *((0, hole) for hole in holes)):
                pen.polygon([(px - x, py - y) for px, py in ring], fill=fill)
            self.image.paste(colour, (x, y), mask)

    def trace(self, path: npt.NDArray[np.float64], colour: str) -> None:
        """Draw a thin line through points (n, 2)."""
        ImageDraw.Draw(self.image).line(self._pixels(shapely.linestrings(path)), fill=colour, width=2 * FINE)

    def ruler(self, frame: Frame) -> None:
        """Write the metres of the source's plan axes along the lower and the left edge.

        Where the frame turns the axes, crosses at whole steps name both coordinates instead.
        """
        (a, b, tx), (c, d, ty) = frame.matrix
        x1, y1, x2, y2 = self.bounds
        pen, type_ = ImageDraw.Draw(self.image), load_font(11 * FINE)
        if b or c:
            for place, words in turned_ticks(self.bounds, frame):
                px, py = self._pixel(place)
                for line in ((px - 4 * FINE, py, px + 4 * FINE, py), (px, py - 4 * FINE, px, py + 4 * FINE)):
                    pen.line(line, fill=CROSS, width=FINE)
                pen.text((px, py + 5 * FINE), words, fill=CROSS, font=type_, anchor="mt")
            return
        for x, words in ruler_ticks(x1, x2, a, tx):
            at = self._pixel((x, y1))
            pen.line((at[0], at[1] - 4 * FINE, *at), fill=RULER, width=FINE)
            pen.text((at[0], at[1] - 5 * FINE), words, fill=RULER, font=type_, anchor="mb")
        for y, words in ruler_ticks(y1, y2, d, ty):
            at = self._pixel((x1, y))
            pen.line((at[0], at[1], at[0] + 4 * FINE, at[1]), fill=RULER, width=FINE)
            pen.text((at[0] + 6 * FINE, at[1]), words, fill=RULER, font=type_, anchor="lm")

    def finish(self, title: str, legend: Legend) -> Picture:
        """Scale down, and add title and legend."""
        width, height = self.image.size
        small = self.image.reduce(FINE).crop((0, 0, width // FINE, height // FINE))
        page = Image.new("RGB", (max(small.width, 520), small.height + WORDS_PX), PAPER)
        page.paste(small, ((page.width - small.width) // 2, 0))
        pen = ImageDraw.Draw(page)
        pen.text((12, small.height + 6), title, fill=INK, font=load_font(17))
        x = 12.0
        y = small.height
        for name, colour in legend:
            wide = 34 + pen.textlength(name, font=load_font(14))
            if x + wide > page.width and x > 12:
                x, y = 12.0, y + 20
            pen.rectangle((x, y + 38, x + 14, y + 52), fill=colour, outline=INK)
            pen.text((x + 20, y + 36), name, fill=INK, font=load_font(14))
            x += wide
        return np.asarray(page, np.uint8)

    def _pixel(self, at: tuple[float, float]) -> tuple[float, float]:
        x, y = (np.array(at) - self.origin) * [self.scale, -self.scale]
        return float(x), float(y)

    def _pixels(self, ring: BaseGeometry) -> list[tuple[float, float]]:
        points = (shapely.get_coordinates(ring) - self.origin) * [self.scale, -self.scale]
        return [(float(x), float(y)) for x, y in points]


def ruler_ticks(low: float, high: float, factor: float, shift: float) -> Iterator[tuple[float, str]]:
    """Yield places on a level's axis, metres, where the source's has whole steps, and the source's metres there.

    The source's metres are ``factor`` times the level's, plus ``shift``. Close to the ends there is no room for words.
    """
    step = next((step for step in STEPS_M if (high - low) / step <= TICKS), STEPS_M[-1])
    first, last = sorted((factor * low + shift, factor * high + shift))
    for k in range(math.ceil(first / step + 0.25), math.floor(last / step - 0.25) + 1):
        yield (k * step - shift) / factor, f"{k * step:g}"


def turned_ticks(bounds: Box, frame: Frame) -> Iterator[tuple[tuple[float, float], str]]:
    """Yield points of a level, metres, where both of the source's plan axes have whole steps, and the metres there."""
    x1, y1, x2, y2 = bounds
    to_source = np.vstack([frame.matrix, (0, 0, 1)])
    x, y, _ = to_source @ np.array([(x1, y1, 1), (x2, y1, 1), (x2, y2, 1), (x1, y2, 1)]).T
    step = next((step for step in STEPS_M if max(np.ptp(x), np.ptp(y)) / step <= TICKS), STEPS_M[-1])
    near = [range(math.ceil(v.min() / step), math.floor(v.max() / step) + 1) for v in (x, y)]
    for i, k in itertools.product(*near):
        px, py, _ = (np.linalg.inv(to_source) @ (i * step, k * step, 1)).tolist()
        if x1 < px < x2 and y1 < py < y2:
            yield (px, py), f"{i * step:g}, {k * step:g}"


# What stands in a level and what it is taken for, one colour each, so that a person sees why a plan is as it is.
#
# The picture has the metres of the source's plan axes: what ``overrides.toml`` takes.


EVIDENCE_FLOOR = "#f1ece0"
FURNITURE = "#c8b08a"
EVIDENCE_RAIL = "#a68fd0"
EVIDENCE_LINTEL = "#8fbde0"
DOORWAY = "#f2b134"
LEAF = "#c4451c"


def draw_evidence(evidence: Evidence, bounds: Box, frame: Frame, side_px: int = SIDE_PX) -> Picture:
    """Paint the evidence, (rows, cols, 3); what is small and telling lies above what is large."""
    layers: list[tuple[str, str, BaseGeometry]] = [
        ("floor", EVIDENCE_FLOOR, evidence.floor or shapely.Polygon()),
        ("furniture", FURNITURE, evidence.furniture),
        ("parapet or railing", EVIDENCE_RAIL, evidence.rails),
        ("lintel", EVIDENCE_LINTEL, evidence.lintels),
        ("wall", WALL, evidence.walls),
        ("known doorway", DOORWAY, shapely.union_all([doorway.polygon for doorway in evidence.doorways])),
        ("door leaf", LEAF, shapely.union_all(evidence.leaves)),
    ]
    canvas = AreaCanvas(bounds, side_px)
    for _, colour, shape in layers:
        canvas.fill(shape, colour)
    canvas.ruler(frame)
    legend = [(name, colour) for name, colour, shape in layers if not shape.is_empty]
    axes = "X and Y" if frame.up == "z" else "X and Z"
    return canvas.finish(f"evidence, with the source's {axes}, metres", legend)
