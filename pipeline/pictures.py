"""A picture of each stage (the paper's Figure 2): what the stage saw, and what it did, in colour."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.geodesic import shortest_way
from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.drawing.scene import DOOR_COLOURS, WALL
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Box, Frame
from pipeline.algorithm import Snapshot
from pipeline.canvas import SIDE_PX, Canvas, Picture
from pipeline.evidence_picture import draw_evidence
from pipeline.geometry.standing import floor_of
from pipeline.png import as_png
from pipeline.values import Evidence, JoinedPair, Layout, Planes, Spaces

OUTSIDE = "#e4e6e8"
FLOOR = "#f6f4ef"
GONE = "#e07a6b"
_COLUMNS = 5  # of the sheet
PATH = "#7a4fb5"
DOOR, OPENING = DOOR_COLOURS["entrance"], "#f0c987"
LINTEL, SILL, GAP, RAIL, BOUNDARY = "#2f6da8", "#4aa3a2", "#8fbde0", "#a68fd0", "#d98a1f"
CLOSERS = {
    "opening": OPENING,
    "door": DOOR,
    "lintel": LINTEL,
    "sill": SILL,
    "gap": GAP,
    "gate": GAP,
    "rail": RAIL,
    "room_edge": BOUNDARY,
    "floor_edge": BOUNDARY,
    "wall_ends": BOUNDARY,
}


def stage_pictures(snapshots: Sequence[Snapshot], frame: Frame) -> list[tuple[str, Picture]]:
    """Name and picture (rows, cols, 3) of each stage, in order; y points up, as in the level frame.

    ``frame`` is the level's: the picture of the evidence has the source's metres on its edges.
    """
    if not snapshots:
        return []
    pictures: list[tuple[str, Picture]] = []
    bounds = _bounds(snapshots)
    before: Spaces | None = None
    for snapshot in snapshots:
        value = snapshot.value
        if isinstance(value, FloorPlan):
            pictures.append(("plan", draw_plan(value, size=SIDE_PX)))
            continue
        canvas = Canvas(bounds)
        if isinstance(value, Evidence):
            pictures.append(("evidence", draw_evidence(value, bounds, frame)))
        elif isinstance(value, Planes):
            pictures += _draw_planes(value, bounds)
        elif isinstance(value, Layout):
            pictures.append(("layout", _draw_layout(canvas, value)))
        elif isinstance(value, Spaces):
            pictures.append((snapshot.stage, _draw_spaces(canvas, value, before)))
            before = value
    return pictures


def of_building(snapshots: Sequence[Snapshot], level_id: str, building_id: str) -> list[Snapshot]:
    """Return the steps of the whole level, and of one of its buildings."""
    return [snapshot for snapshot in snapshots if snapshot.id in {level_id, building_id}]


def sheet_of(pictures: Sequence[tuple[str, Picture]]) -> bytes:
    """Lay the pictures of the stages out on one sheet, a PNG, each with its name."""
    titles, images = zip(*pictures, strict=True)
    return as_png(contact_sheet(images, min(len(images), _COLUMNS), titles))


def _bounds(snapshots: Sequence[Snapshot]) -> Box:
    """Bounds of all that the first stages saw; a metre where that is nothing."""
    seen: list[BaseGeometry] = []
    for value in (snapshot.value for snapshot in snapshots):
        if isinstance(value, Evidence):
            seen += [value.walls, value.furniture, value.rails, *([value.floor] if value.floor is not None else [])]
        elif isinstance(value, Planes):
            seen += [value.door, value.low, value.high]
    found = [shape.bounds for shape in seen if not shape.is_empty] or [(0.0, 0.0, 1.0, 1.0)]
    low, high = np.min(found, axis=0)[:2], np.max(found, axis=0)[2:]
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _draw_planes(planes: Planes, bounds: Box) -> list[tuple[str, Picture]]:
    door = Canvas(bounds)
    door.fill(planes.door, WALL)
    known = shapely.union_all([doorway.polygon for doorway in planes.doorways])
    layers = [
        ("railing", RAIL, planes.rails),
        ("lintel", LINTEL, planes.high),
        ("sill", SILL, planes.low),
        ("known doorway", DOOR, known),
        ("wall", WALL, planes.door),
    ]
    ground = Canvas(bounds)
    for _, colour, shape in layers:
        ground.fill(shape, colour)
    legend = [(name, colour) for name, colour, shape in layers if not shape.is_empty]
    where = f", {planes.heights['door']:.2f} m" if "door" in planes.heights else ""
    return [
        ("door plane", door.finished(f"door plane P_d{where}", [("stands", WALL)])),
        ("ground plane", ground.finished("ground plane P_g: what closes the openings that P_d leaves", legend)),
    ]


def _draw_layout(canvas: Canvas, layout: Layout) -> Picture:
    _spread(canvas, layout.rooms)
    canvas.fill(layout.door, WALL)
    for closer in layout.closers:
        canvas.fill(closer.polygon, CLOSERS[closer.kind])
    used = {c.kind for c in layout.closers}
    legend = [("wall", WALL), *((kind.replace("_", " "), colour) for kind, colour in CLOSERS.items() if kind in used)]
    return canvas.finished(f"layout: {len(layout.rooms)} closed spaces", legend)


def _draw_spaces(canvas: Canvas, spaces: Spaces, before: Spaces | None) -> Picture:
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
    paths = _paths(spaces, spaces.joined[len(before.joined) :]) if before is not None else []
    for path in paths:
        canvas.trace(path, PATH)
    kinds = sorted({p.kind for p in spaces.passages})
    legend = [(kind, DOOR_COLOURS[kind]) for kind in kinds] + ([("filled or erased", GONE)] if gone else [])
    legend += [("path of a pair", PATH)] if paths else []
    notes = ", ".join(f"{name.replace('_', ' ')}: {value}" for name, value in spaces.notes.items())
    return canvas.finished(f"{len(spaces.rooms)} rooms, {len(spaces.passages)} passages  {notes}", legend)


def _paths(spaces: Spaces, pairs: Sequence[JoinedPair]) -> list[npt.NDArray[np.float64]]:
    """The paths (n, 2) between pairs that cuts joined; a pair of a part that was left out in the end has none."""
    if not pairs:
        return []
    floor = floor_of(spaces)
    found = [shortest_way(shapely.buffer(floor, -pair.radius_m), *pair.points) for pair in pairs]
    return [way.points for way in found if way is not None]


def _gone(spaces: Spaces, before: Spaces | None) -> list[Polygon]:
    """Rooms of the stage before that no longer stand."""
    if before is None:
        return []
    tree = shapely.STRtree(spaces.rooms)
    return [r for r in before.rooms if not len(tree.query(r.representative_point(), predicate="within"))]


def _spread(canvas: Canvas, rooms: Iterable[BaseGeometry]) -> None:
    for room in rooms:
        canvas.fill(room, FLOOR)
