"""A picture of each stage (the paper's Figure 2): what the stage saw, and what it did, in colour."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image, ImageDraw
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.drawing import draw_plan
from houseexpo.plan import FloorPlan
from houseexpo.scene import DOOR_COLOURS, INK, PAPER, WALL, font
from pipeline.algorithm import Snapshot
from pipeline.geometry.overlay import polygons_of
from pipeline.values import Layout, Planes, Spaces

Picture = npt.NDArray[np.uint8]

SIDE_PX = 900
FINE = 2  # drawn larger by this and scaled down, so that edges are smooth
MARGIN_M = 0.5
OUTSIDE = "#e4e6e8"
FLOOR = "#f6f4ef"
GONE = "#e07a6b"
PATH = "#7a4fb5"
LINTEL, SILL, GAP, RAIL, BOUNDARY = "#2f6da8", "#4aa3a2", "#8fbde0", "#a68fd0", "#d98a1f"
CLOSERS = {"lintel": LINTEL, "sill": SILL, "gap": GAP, "rail": RAIL, "floor_edge": BOUNDARY, "wall_ends": BOUNDARY}
Legend = Sequence[tuple[str, str]]


def stage_pictures(snapshots: Sequence[Snapshot]) -> list[tuple[str, Picture]]:
    """Name and picture (rows, cols, 3) of each stage, in order; y points up, as in the level frame."""
    pictures: list[tuple[str, Picture]] = []
    bounds = _bounds(snapshots)
    before: Spaces | None = None
    for snapshot in snapshots:
        value = snapshot.value
        if isinstance(value, FloorPlan):
            pictures.append(("plan", draw_plan(value, size=SIDE_PX)))
            continue
        canvas = _Canvas(bounds)
        if isinstance(value, Planes):
            pictures += _draw_planes(value, bounds)
        elif isinstance(value, Layout):
            pictures.append(("layout", _draw_layout(canvas, value)))
        else:
            pictures.append((snapshot.stage, _draw_spaces(canvas, value, before)))
            before = value
    return pictures


class _Canvas:
    """Areas in metres painted over each other, with a legend below."""

    def __init__(self, bounds: tuple[float, float, float, float]) -> None:
        x1, y1, x2, y2 = bounds
        self.origin = np.array([x1 - MARGIN_M, y2 + MARGIN_M])
        width, height = x2 - x1 + 2 * MARGIN_M, y2 - y1 + 2 * MARGIN_M
        self.scale = SIDE_PX * FINE / max(width, height)
        self.image = Image.new("RGB", (round(width * self.scale), round(height * self.scale)), PAPER)

    def fill(self, shape: BaseGeometry, colour: str) -> None:
        """Paint every polygon of a geometry, holes left out."""
        for polygon in polygons_of(shape):
            mask = Image.new("1", self.image.size)
            pen = ImageDraw.Draw(mask)
            pen.polygon(self._pixels(polygon.exterior), fill=1)
            for hole in polygon.interiors:
                pen.polygon(self._pixels(hole), fill=0)
            self.image.paste(colour, mask=mask)

    def trace(self, path: npt.NDArray[np.float64], colour: str) -> None:
        """Draw a thin line through points (n, 2)."""
        ImageDraw.Draw(self.image).line(self._pixels(shapely.linestrings(path)), fill=colour, width=2 * FINE)

    def finished(self, title: str, legend: Legend) -> Picture:
        """Scale down, and add title and legend."""
        width, height = self.image.size
        small = self.image.resize((width // FINE, height // FINE), Image.Resampling.LANCZOS)
        page = Image.new("RGB", (max(small.width, 520), small.height + 64), PAPER)
        page.paste(small, ((page.width - small.width) // 2, 0))
        pen = ImageDraw.Draw(page)
        pen.text((12, small.height + 6), title, fill=INK, font=font(17))
        x = 12.0
        for name, colour in legend:
            pen.rectangle((x, small.height + 38, x + 14, small.height + 52), fill=colour, outline=INK)
            pen.text((x + 20, small.height + 36), name, fill=INK, font=font(14))
            x += 34 + pen.textlength(name, font=font(14))
        return np.asarray(page, np.uint8)

    def _pixels(self, ring: BaseGeometry) -> list[tuple[float, float]]:
        points = (shapely.get_coordinates(ring) - self.origin) * [self.scale, -self.scale]
        return [(float(x), float(y)) for x, y in points]


def _bounds(snapshots: Sequence[Snapshot]) -> tuple[float, float, float, float]:
    planes = [s.value for s in snapshots if isinstance(s.value, Planes)]
    found = [b for p in planes for b in (p.door.bounds, p.low.bounds, p.high.bounds) if b and not np.isnan(b[0])]
    low, high = np.min(found, axis=0)[:2], np.max(found, axis=0)[2:]
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _draw_planes(planes: Planes, bounds: tuple[float, float, float, float]) -> list[tuple[str, Picture]]:
    door = _Canvas(bounds)
    door.fill(planes.door, WALL)
    height = planes.heights["door"]
    ground = _Canvas(bounds)
    ground.fill(planes.rails, RAIL)
    ground.fill(planes.high, LINTEL)
    ground.fill(planes.low, SILL)
    ground.fill(planes.door, WALL)
    closing = "sills" if not planes.low.is_empty else "lintels and railings"
    return [
        ("door plane", door.finished(f"door plane P_d, {height:.2f} m", [("stands", WALL)])),
        (
            "ground plane",
            ground.finished(
                f"ground plane P_g: {closing} close what P_d leaves open",
                [("wall", WALL), ("lintel", LINTEL), ("sill", SILL), ("railing", RAIL)],
            ),
        ),
    ]


def _draw_layout(canvas: _Canvas, layout: Layout) -> Picture:
    _spread(canvas, layout.rooms)
    canvas.fill(layout.door, WALL)
    for closer in layout.closers:
        canvas.fill(closer.polygon, CLOSERS[closer.kind])
    used = {c.kind for c in layout.closers}
    legend = [("wall", WALL), *((kind.replace("_", " "), colour) for kind, colour in CLOSERS.items() if kind in used)]
    return canvas.finished(f"layout: {len(layout.rooms)} closed spaces", legend)


def _draw_spaces(canvas: _Canvas, spaces: Spaces, before: Spaces | None) -> Picture:
    if spaces.outlines:
        canvas.fill(Polygon([(-1e4, -1e4), (1e4, -1e4), (1e4, 1e4), (-1e4, 1e4)]), OUTSIDE)
        for outline in spaces.outlines:
            canvas.fill(outline, WALL)
    else:
        canvas.fill(spaces.walls, WALL)
    gone = _gone(spaces, before)
    for room in gone:
        canvas.fill(room, GONE)
    _spread(canvas, spaces.rooms)
    for passage in spaces.passages:
        canvas.fill(passage.bridge.strip(), DOOR_COLOURS[passage.kind])
    new_paths = spaces.paths[len(before.paths) :] if before is not None else ()
    for path in new_paths:
        canvas.trace(path, PATH)
    kinds = sorted({p.kind for p in spaces.passages})
    legend = [(kind, DOOR_COLOURS[kind]) for kind in kinds] + ([("filled or erased", GONE)] if gone else [])
    legend += [("path of a pair", PATH)] if new_paths else []
    notes = ", ".join(f"{name.replace('_', ' ')}: {value}" for name, value in spaces.notes.items())
    return canvas.finished(f"{len(spaces.rooms)} rooms, {len(spaces.passages)} passages  {notes}", legend)


def _gone(spaces: Spaces, before: Spaces | None) -> list[Polygon]:
    """Rooms of the stage before that no longer stand."""
    if before is None:
        return []
    tree = shapely.STRtree(spaces.rooms)
    return [r for r in before.rooms if not len(tree.query(r.representative_point(), predicate="within"))]


def _spread(canvas: _Canvas, rooms: Iterable[BaseGeometry]) -> None:
    for room in rooms:
        canvas.fill(room, FLOOR)
