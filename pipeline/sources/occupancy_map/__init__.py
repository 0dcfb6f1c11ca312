"""Read a robot's map as one level: tell its rooms apart (``rooms``), draw them with straight walls, join them by doors.

Formats: all that ``houseexpo.grids.read_map`` reads: a ``map.yaml`` with its picture, a picture or an array with the
build's option ``resolution``, and a bag.

R1  A room's outline is that of its cells, without the doorways, with straight walls in a few directions.
R2  Between two rooms is a wall, at least ``LINE_WALL_M`` thick, even where the map shows none: there the way is an
    opening.
R3  A way narrower than ``DOOR_M`` is called a door, a wider one an opening: a map does not show leaves.
R4  Heights are unknown: walls are as high as those of a drawing. The frame is the map's own, with its origin and yaw.
R5  What lies outside of the house (``rooms``, R7) is no room. A way to it is an entrance, through the outer wall.
R6  Where a room ends at unseen space or at the picture's border, its edge is a guess. The plan says which share of the
    edges is guessed, and how many rooms end there for the most part. If most of all edges is guessed, only the ends of
    rays bound the rooms: they are open ground, as in R8.
R7  If the file says that all cells that are not free are wall (``RobotMap.walls_only``), nothing is furniture or noise:
    only the steps of the cells are straightened. The quality is rated as for a drawing, else by R10.
R11 A wall that hangs in a room, or stands free in it, stays (``seen_walls``): it is a slit or a hole of the room.
R12 A gap in a straight side of a room, beyond which nothing was seen, is an entrance (``seen_walls``).
R13 What was seen to stand in a room is furniture (``clutter``, R5); only ``--furniture`` puts it into the plan.
R10 What the cells say against the plan is measured as grounds of its quality (``signs``).
R9  A doorway spans the stretch along which both of its rooms reach it: a part with a wall before it is no way. It ends
    where a wider doorway meets it or lies before it; if nothing is left, only the wider one stays. A way narrower than
    any door, at a corner of the rooms, is moved to where a door has space.
R8  If half of the border or more is free, and all rooms touch it (``rooms``, R7), the rooms are open ground: only the
    picture ends them. This happens when thresholds make unseen space free, and no wall is closed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.affinity import affine_transform
from shapely.geometry.base import BaseGeometry

from houseexpo.grids.robot_map import MapError, RobotMap, read_map
from houseexpo.plan import Frame
from pipeline.geometry.areas import (
    buffer_mitred,
    dot_product,
    drop_lines_and_points,
    drop_thin_parts,
    polygons_of,
    smooth_edges,
)
from pipeline.geometry.openings import ClosedBy, Opening
from pipeline.geometry.prisms import make_prisms
from pipeline.geometry.straighten import straighten_outlines
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import Hole, walls_around_floors
from pipeline.sources.files import LeftOutParts, check_file, input_from_file
from pipeline.sources.occupancy_map.clutter import things_in_rooms
from pipeline.sources.occupancy_map.gaps import THICKEST_M, THINNEST_CELLS, area_of_cells
from pipeline.sources.occupancy_map.rooms import (
    SMALLEST_M2,
    RoomConnection,
    Segmentation,
    free_share_of_border,
    label_boxes,
    main_edge_direction,
    segment_rooms,
)
from pipeline.sources.occupancy_map.seen_walls import SeenSides, cut_walls, entrance_gaps, walls_in_rooms
from pipeline.sources.occupancy_map.signs import measure_signs
from pipeline.sources.storeys.scale import said_size
from pipeline.sources.tolerances import DOOR_HEIGHT_M, FILE_GRID_M, LINE_WALL_M, OBJECT_HEIGHT_M, WALL_HEIGHT_M
from pipeline.sources.vector_plans.drawing import Drawing, DrawnStorey, levels_from_drawing
from pipeline.tolerances import CRACK_M, HAND_M, MOST, NEARLY_ALL, PARTITION_M, RUN_M, SHOULDERS_M
from pipeline.values import EDGE, Input, Level, SourceObject, SourceRoom

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

DOOR_M: Final = 1.4
STRAIGHT_M: Final = 0.12
ANGLE_DEG: Final = 12.0
WAY_REACH_M: Final = 1.5
"""How far from the middle of a way its rooms may begin."""
NARROWEST_PART_CELLS: Final = 3
"""R7: the least width of a part of a room, in cells."""
_REASONS: Final = {
    "missing_file": Reason.MISSING_FILE,
    "unreadable": Reason.UNREADABLE,
    "too_large": Reason.TOO_LARGE,
    "bad_units": Reason.BAD_UNITS,
    "empty": Reason.EMPTY,
}


def find(path: str, **options: str) -> Iterator[Input]:
    """List one map; option ``resolution`` is the side of a cell, metres, where its file does not say it."""
    yield input_from_file(path, "occupancy_map", options)


_RESOLUTION = (
    "a picture or an array is read as a robot's map: give --resolution, the side of a cell in metres; export a drawing "
    "of a plan as .dxf"
)


def read(item: Input) -> Iterator[Level]:
    """Yield the one level of a map.

    Raises
    ------
    Rejection
        Where the map cannot be read, names no size of its cells, or has no room.
    """
    path, options = Path(item.path), dict(item.options)
    if path.is_file():
        check_file(path)
    name = options.get("file", path.name)
    units, scale = said_size(options)
    given = float(options["resolution"]) if options.get("resolution") else None
    try:
        found = scaled_map(path, given, units, scale).trimmed()
    except MapError as error:
        advice = _RESOLUTION if "side of a cell" in error.problem else error.advice
        raise Rejection("source", _REASONS[error.fault], error.problem, advice) from None
    drawing = Drawing("robot's map", (_storey(found, name),), LeftOutParts())
    for level in levels_from_drawing(item, drawing, path, name):
        again = partial(measure_signs, found.free, found.occupied, found.resolution_m) if level.signs else None
        frame, unit_m = _frame_in_map(level.frame, found), (units or 1.0) * scale
        seen = partial(_occupied_area, found.occupied, found.resolution_m)
        yield replace(level, frame=frame, guesses=_guesses(level), unit_m=unit_m, measure_signs=again, seen_walls=seen)


def scaled_map(path: Path, resolution: float | None, units: float | None, scale: float) -> RobotMap:
    """Return a map with its size as a person gives it: ``units`` is its metre, or a cell of a picture without a size.

    Raises
    ------
    MapError
        See ``read_map``.
    """
    factor = (units or 1.0) * scale
    try:
        found = read_map(path, resolution)
    except MapError as error:
        if units is None or error.fault != "bad_units":
            raise
        return read_map(path, factor)
    if factor == 1.0:
        return found
    x, y, yaw = found.origin
    return replace(found, resolution_m=found.resolution_m * factor, origin=(x * factor, y * factor, yaw))


def _no_room(name: str, found: str) -> Rejection:
    detail = f"{name}: expected a room of {SMALLEST_M2:g} m² or more of free cells, found {found}"
    advice = "let the robot map more if it has hardly begun, and check the resolution of the map"
    return Rejection("source", Reason.NO_LEVEL, detail, advice)


def _storey(found: RobotMap, name: str) -> DrawnStorey:
    free, occupied = found.free, found.occupied
    free_m2 = float(np.count_nonzero(free)) * found.resolution_m**2
    if free_m2 < SMALLEST_M2:  # cells of a tenth of a millimetre would take minutes to segment
        raise _no_room(name, f"{free_m2:.2g} m² in all")
    parts = segment_rooms(free, found.resolution_m, occupied=occupied, walls_only=found.walls_only)
    edges = _Edges.of_cells(parts.cell_m) if found.walls_only else _Edges()
    height_m = found.occupancy.shape[0] * found.resolution_m
    openings = [_opening_of(way, parts.cell_m, height_m) for way in parts.ways]
    rooms = _outlines(parts, openings, height_m, edges)
    if not rooms.keys() - parts.outside:
        raise _no_room(name, "none")
    outlines, holes = _flatten_doorways(openings, rooms, parts.outside)
    if not found.walls_only:
        outlines = _with_seen_walls(outlines, free, occupied, found.resolution_m)
        holes += _entrances(outlines, holes, free, occupied, found.resolution_m)
    unseen, rooms_in_part = _unseen_shares(parts, free, occupied, found.resolution_m)
    about: dict[str, Any] = {"resolution_m": found.resolution_m, "unseen_edge": round(unseen, 3)}
    if rooms_in_part:
        about["rooms_seen_in_part"] = rooms_in_part
    if found.yaw_note:
        about["yaw"] = found.yaw_note
    if found.unknown_shade is not None:
        about["unknown_shade"] = found.unknown_shade
    doorways = [hole.shape for hole in holes]
    open_share = free_share_of_border(free, occupied, found.resolution_m)
    if not parts.outside and open_share >= MOST:  # R8
        about["open_border"] = round(open_share, 3)
    return DrawnStorey(
        walls=tuple(walls_around_floors(outlines, WALL_HEIGHT_M)),
        holes=tuple(holes),
        rooms=tuple(SourceRoom((), (), outline) for outline in outlines),
        about=about,
        furniture=() if found.walls_only else tuple(_things(outlines, free, occupied, found.resolution_m)),
        signs={} if found.walls_only else measure_signs(free, occupied, found.resolution_m, outlines, doorways),
    )


def _with_seen_walls(outlines: list[Polygon], free: Bools, occupied: Bools, cell_m: float) -> list[Polygon]:
    """Return the rooms without the walls that hang or stand in them."""
    height_m = free.shape[0] * cell_m
    inside = _cells_inside(outlines, free.shape, cell_m)
    found = walls_in_rooms(inside, free, occupied, cell_m, main_edge_direction(free))
    walls = [Polygon(corners * (cell_m, -cell_m) + (0.0, height_m)) for corners in found]
    near = shapely.STRtree(walls)
    return [cut_walls(outline, [walls[k] for k in sorted(near.query(outline).tolist())]) for outline in outlines]


def _things(outlines: list[Polygon], free: Bools, occupied: Bools, cell_m: float) -> Iterator[SourceObject]:
    """Yield what stands in the rooms, each ``OBJECT_HEIGHT_M`` high, without the steps of its cells."""
    cells = things_in_rooms(_cells_inside(outlines, free.shape, cell_m), free, occupied, cell_m)
    area = affine_transform(area_of_cells(cells), [cell_m, 0.0, 0.0, cell_m, 0.0, free.shape[0] * cell_m])
    for thing in polygons_of(shapely.simplify(area, cell_m)):
        if thing.area > HAND_M**2:
            yield SourceObject((), make_prisms(thing, 0.0, OBJECT_HEIGHT_M))


def _cells_inside(outlines: list[Polygon], shape: tuple[int, ...], cell_m: float) -> Bools:
    """Return the cells (rows, cols) inside of the rooms."""
    inside, height_m = np.zeros(shape, np.uint8), shape[0] * cell_m
    for outline in outlines:
        rings = [shapely.get_coordinates(outline.exterior), *map(shapely.get_coordinates, outline.interiors)]
        cv2.fillPoly(
            inside, [np.rint((ring * (1, -1) + (0, height_m)) / cell_m - 0.5).astype(np.int32) for ring in rings], 1
        )
    return inside.view(bool)


def _entrances(outlines: list[Polygon], holes: list[Hole], free: Bools, occupied: Bools, cell_m: float) -> list[Hole]:
    """Return the entrances to what was not seen."""
    found: list[Hole] = []
    sides = SeenSides(free, occupied, cell_m)
    for number, outline in enumerate(outlines):
        rest = [*outlines[:number], *outlines[number + 1 :], *(hole.shape for hole in (*holes, *found))]
        for (a, b), out in entrance_gaps(outline, rest, sides):
            deep = out * (LINE_WALL_M + HAND_M)
            is_door = float(np.hypot(*(b - a))) < DOOR_M
            found.append(
                Hole(Polygon([a, b, b + deep, a + deep]), 0.0, DOOR_HEIGHT_M, is_door, (float(out[0]), float(out[1])))
            )
    return found


def _guesses(level: Level) -> tuple[str, ...]:
    """Return the guesses; a smaller unseen share of the edges is a sign of the level instead."""
    about = level.provenance
    return (EDGE,) if "open_border" in about or float(about["unseen_edge"]) > MOST else ()


def _frame_in_map(frame: Frame, found: RobotMap) -> Frame:
    """Return the frame of a level that was drawn in metres from the lower-left corner of the grid."""
    grid = np.array([*found.affine, (0.0, 0.0, 1.0)]) @ np.array([*frame.matrix, (0.0, 0.0, 1.0)])
    (a, b, c), (d, e, f) = grid[:2].tolist()
    return replace(frame, matrix=((a, b, c), (d, e, f)))


def _opening_of(way: RoomConnection, cell_m: float, height_m: float) -> Opening:
    """Return a way in metres, y up: as wide as it is or a narrow door, as deep as the wall at its jambs.

    Its sides are the numbers of the rooms.
    """
    a, b = way.jambs * (cell_m, -cell_m) + (0.0, height_m)
    length = float(np.hypot(*(b - a)))
    along = (b - a) / max(length, 1e-9)
    spread = along * max(SHOULDERS_M - length, 0.0) / 2  # noise makes doors narrower than they are
    a, b = a - spread, b + spread
    depth = float(np.clip(way.thick_m, LINE_WALL_M, THICKEST_M))
    deep = np.array([-along[1], along[0]]) * depth / 2
    shape = Polygon([a - deep, b - deep, b + deep, a + deep])
    middle, width = np.asarray(shape.centroid.coords[0]), float(np.hypot(*(b - a)))
    closed_by: ClosedBy = "door" if way.width_m < DOOR_M else "opening"
    return Opening(middle, along, width, depth, way.rooms, polygon=shape, closed_by=closed_by)


def _between(opening: Opening, low: float, high: float, beside_m: float = 0.0) -> Polygon:
    """Return the rectangle from ``low`` to ``high`` across an opening, ``beside_m`` wider than it on both sides."""
    half = opening.along * (opening.width / 2 + beside_m)
    near, far = opening.centre + low * opening.across, opening.centre + high * opening.across
    found: Polygon = shapely.polygons(np.array([near - half, near + half, far + half, far - half]))
    return found


def _hole(opening: Opening, low: float, high: float) -> Hole:
    """Return an opening as a hole through a wall from ``low`` to ``high``."""
    x, y = opening.across.tolist()
    return Hole(_between(opening, low, high), 0.0, DOOR_HEIGHT_M, opening.has_door, (x, y))


@dataclass(frozen=True)
class _Edges:
    """How far the outline of a room may be from its cells, metres: what at its edge is noise."""

    straight_m: float = STRAIGHT_M
    narrowest_m: float = RUN_M  # what is narrower is noise at a room's edge
    clutter_m2: float = SMALLEST_M2  # smaller holes in a room are clutter
    room_m2: float = SMALLEST_M2
    exact: bool = False

    @classmethod
    def of_cells(cls, cell_m: float) -> _Edges:
        """Return the tolerances for a map whose cells are all wall or free: its edges are exact to a cell."""
        return cls(
            THINNEST_CELLS * cell_m,  # no straight face lies farther from its cells
            NARROWEST_PART_CELLS * cell_m,
            (NARROWEST_PART_CELLS * cell_m) ** 2,
            NEARLY_ALL * SMALLEST_M2,
            exact=True,
        )


def _outlines(parts: Segmentation, openings: list[Opening], height_m: float, edges: _Edges) -> dict[int, Polygon]:
    """Return the rooms by their numbers, none nearer to another than a wall."""
    doorways = np.array([each.polygon for each in openings], np.object_)
    places = shapely.STRtree(doorways)
    raw = {}
    for number, (rows, cols) in sorted(label_boxes(parts.rooms)):
        mask = parts.rooms[rows, cols] == number
        corner = cols.start, rows.start
        if edges.exact:
            traced = _exact_area(mask, corner, parts.cell_m, height_m)
        else:
            traced = _trace_cells(*_without_specks(mask, corner, parts.cell_m), parts.cell_m, height_m)
        whole = _smooth(traced, edges)
        near = doorways[np.sort(places.query(whole, predicate="intersects"))]
        outline = _largest(shapely.difference(whole, shapely.union_all(near)) if len(near) else whole, edges)
        if outline.area >= edges.room_m2:
            raw[number] = outline
    straight = straighten_outlines(list(raw.values()), offset_m=edges.straight_m, angle_deg=ANGLE_DEG)
    found: dict[int, Polygon] = {}
    by_size = sorted(zip(raw, straight, strict=True), key=lambda each: (each[0] in parts.outside, -each[1].area))
    for number, outline in by_size:
        near = _near(list(found.values()), outline, LINE_WALL_M)
        around = buffer_mitred(near, LINE_WALL_M)
        left: BaseGeometry = shapely.difference(outline, shapely.union_all(around)) if len(near) else outline
        piece = _largest(left, edges)
        if piece.area >= edges.room_m2:
            found[number] = piece
    return found


def _without_specks(mask: Bools, corner: tuple[int, int], cell_m: float) -> tuple[Bools, tuple[int, int]]:
    """Return cells closed where they are nearer than RUN_M, without specks, and the new corner.

    ``_smooth`` does the same, but takes a hundred times as long with thousands of specks, such as the ends of rays.
    """
    reach = max((round(RUN_M / cell_m) - 1) // 2, 0)
    kernel = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    closed = cv2.morphologyEx(np.pad(mask, reach + 1).view(np.uint8), cv2.MORPH_CLOSE, kernel)
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    large = stats[:, cv2.CC_STAT_AREA] * cell_m**2 >= RUN_M**2
    large[0] = False
    return np.asarray(large[pieces]), (corner[0] - reach - 1, corner[1] - reach - 1)


def _largest(area: BaseGeometry, edges: _Edges) -> Polygon:
    """Return the largest piece of an area without what noise leaves beside it; an empty polygon if nothing is left."""
    return max(polygons_of(drop_thin_parts(area, edges.narrowest_m)), key=lambda piece: piece.area, default=Polygon())


def _smooth(whole: BaseGeometry, edges: _Edges) -> BaseGeometry:
    """An area without what noise does to its edge, and without small holes."""
    smooth = polygons_of(smooth_edges(whole, edges.narrowest_m))
    parts = [shapely.simplify(part, edges.straight_m / 2) for part in smooth]
    kept = [
        Polygon(part.exterior, [hole for hole in part.interiors if Polygon(hole).area >= edges.clutter_m2])
        for part in parts
    ]
    return shapely.union_all(kept)


def _flatten_doorways(
    openings: list[Opening], rooms: dict[int, Polygon], outside: frozenset[int]
) -> tuple[list[Polygon], list[Hole]]:
    """Return the rooms with flat faces on both sides of each doorway, and the doorways from face to face (R1, R5).

    A part of one room behind the face of the other, up to a step deep, goes to the other room. Otherwise a sliver of it
    would lie between the doorway and the room into which the doorway leads.
    """
    rooms, holes = dict(rooms), list[tuple[Opening, float, float]]()
    for drawn in openings:
        if outside.issuperset(drawn.sides):
            continue
        opening = _move_from_corner(drawn, rooms)
        sides = [rooms[number] for number in opening.sides if number in rooms]
        spans = [span for side in sides if (span := _reach(opening, side)) is not None]
        if len(spans) < 2:
            continue
        (one, first), (other, second) = sorted(zip(spans, opening.sides, strict=True))
        low, high = one[1], other[0]
        if high - low < LINE_WALL_M:  # R2
            low, high = (low + high - LINE_WALL_M) / 2, (low + high + LINE_WALL_M) / 2
        for number, span, beyond in (
            (first, (one[0] - HAND_M, low), (low, high + HAND_M)),
            (second, (high, other[1] + HAND_M), (low - HAND_M, high)),
        ):
            step = _between(opening, *span) if span[1] - span[0] > FILE_GRID_M else Polygon()
            with_step = drop_lines_and_points(shapely.union(rooms[number], step, grid_size=FILE_GRID_M))
            # a wall goes on beside a doorway
            whole = shapely.difference(with_step, _between(opening, *beyond, HAND_M), grid_size=FILE_GRID_M)
            rooms[number] = max(polygons_of(whole), key=lambda piece: piece.area, default=rooms[number])
        if first in outside:
            low = high - LINE_WALL_M - HAND_M  # R5: the wall that is put around the rooms, and a step out of it
        elif second in outside:
            high = low + LINE_WALL_M + HAND_M
        holes.append((replace(opening, sides=(first, second)), low, high))
    inside = [number for number in rooms if number not in outside]
    kept = dict(zip(inside, _keep_apart([rooms[number] for number in inside]), strict=True))
    strips = [_between(opening, low, high) for opening, low, high in holes]
    pairs = shapely.STRtree(strips).query(strips, predicate="dwithin", distance=HAND_M) if strips else np.zeros((2, 0))
    beside = [pairs[1][pairs[0] == k].tolist() for k in range(len(strips))]
    cut: dict[int, Hole] = {}
    for k in sorted(range(len(holes)), key=lambda k: -holes[k][0].width):
        opening, low, high = holes[k]
        sides = [kept.get(number) for number in opening.sides]
        hole = _as_wide_as_both(opening, low, high, sides, [cut[j].shape for j in beside[k] if j in cut])
        if hole is not None:
            cut[k] = hole
    return list(kept.values()), [cut[k] for k in sorted(cut)]


def _move_from_corner(opening: Opening, rooms: dict[int, Polygon]) -> Opening:
    """Return an opening as narrow as a door may be, moved by its width at most to where both rooms lie beside."""
    half, along = opening.width / 2, opening.along
    if half > SHOULDERS_M / 2 + FILE_GRID_M or not rooms.keys() >= set(opening.sides):
        return opening
    around = _between(opening, -THICKEST_M, THICKEST_M, SHOULDERS_M)
    one, other = (_spans_along(shapely.intersection(rooms[k], around), opening.centre, along) for k in opening.sides)
    moves = [min(max(0.0, low + half), high - half) for low, high in _shared_spans(one, other) if high - low > 2 * half]
    return replace(opening, centre=opening.centre + along * min(moves, key=abs)) if moves else opening


def _as_wide_as_both(
    opening: Opening, low: float, high: float, sides: list[Polygon | None], wider: list[Polygon]
) -> Hole | None:
    """Return the doorway from ``low`` to ``high`` between the first and the second side, None for outside.

    Return None if nothing is left of it beside doorways that are ``wider``.
    """
    full, along = opening.width / 2, opening.along
    lanes = [opening.centre + face * opening.across for face in (low - CRACK_M, high + CRACK_M)]
    spans = [(-full, full)]
    for side, middle in zip(sides, lanes, strict=True):
        if side is not None:
            lane = shapely.linestrings([middle - full * along, middle + full * along])
            spans = _shared_spans(spans, _spans_along(shapely.intersection(side, lane), middle, along))
    start, end = max(spans, key=_length, default=(0.0, 0.0))
    if end - start < RUN_M:  # a way that the map shows stays a way
        spans, start, end = [(-full, full)], -full, full
    whole = _between(opening, low - CRACK_M, high + CRACK_M)
    near = _near(wider, whole, 2 * CRACK_M)
    if len(near):
        around = shapely.union_all(buffer_mitred(near, 2 * CRACK_M))
        taken = _spans_along(shapely.intersection(around, whole), lanes[0], along)
        edges = [-np.inf, *(edge for span in sorted(taken) for edge in span), np.inf]
        spans = _shared_spans(spans, list(zip(edges[::2], edges[1::2], strict=True)))
        start, end = max(spans, key=_length, default=(0.0, 0.0))
        if end - start < RUN_M:
            return None
    if end - start > 2 * full - FILE_GRID_M:
        return _hole(opening, low, high)
    return _hole(opening.part_between(start, end), low, high)


def _spans_along(shape: BaseGeometry, start: Floats, along: Floats) -> list[tuple[float, float]]:
    """Return from where to where each part of a shape reaches along a line."""
    ways = (dot_product(shapely.get_coordinates(part) - start, along) for part in shapely.get_parts(shape))
    return [(float(way.min()), float(way.max())) for way in ways if len(way)]


def _shared_spans(one: list[tuple[float, float]], other: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return what two lists of spans share."""
    both = ((max(a, c), min(b, d)) for a, b in one for c, d in other)
    return [span for span in both if span[0] < span[1]]


def _length(span: tuple[float, float]) -> float:
    return span[1] - span[0]


def _keep_apart(rooms: list[Polygon]) -> list[Polygon]:
    """Return the rooms with a wall also where the face at a doorway, beside a corner, reached another room."""
    kept = list(rooms)
    order = sorted(range(len(kept)), key=lambda k: -kept[k].area)
    for at, k in enumerate(order):
        near = _near([kept[other] for other in order[:at]], kept[k], LINE_WALL_M / 2)
        if len(near):
            around = buffer_mitred(near, LINE_WALL_M)
            left = shapely.difference(kept[k], shapely.union_all(around), grid_size=FILE_GRID_M)
            kept[k] = max(polygons_of(left), key=lambda piece: piece.area, default=kept[k])
    return kept


def _near(others: list[Polygon], room: Polygon, distance_m: float) -> npt.NDArray[np.object_]:
    """Return those of other rooms that are nearer to a room than ``distance_m``, or as near."""
    rooms = np.array(others, np.object_)
    return rooms[shapely.dwithin(rooms, room, distance_m)] if others else rooms


def _reach(opening: Opening, room_: Polygon) -> tuple[float, float] | None:
    """Return the least and the greatest distance, m, across from the middle of a way to the near edge of a room."""
    starts = opening.centre + np.array([[-0.9], [0.0], [0.9]]) * opening.along * opening.width / 2
    lanes = shapely.linestrings(
        np.stack([starts - WAY_REACH_M * opening.across, starts + WAY_REACH_M * opening.across], axis=1)
    )
    parts, lane = shapely.get_parts(shapely.intersection(room_, lanes), return_index=True)
    points, part = shapely.get_coordinates(parts, return_index=True)
    away = dot_product(points - starts[lane[part]], opening.across)
    met: dict[int, list[tuple[float, float]]] = {}
    for k in np.unique(part).tolist():
        of_part = away[part == k]
        met.setdefault(int(lane[k]), []).append((float(of_part.min()), float(of_part.max())))
    ends = [min(spans, key=_from_zero) for spans in met.values()]
    if not ends:
        return None
    below = sum(low + high for low, high in ends) < 0
    faces = [high if below else low for low, high in ends]
    return min(faces), max(faces)


def _from_zero(span: tuple[float, float]) -> float:
    return max(span[0], -span[1], 0.0)


def _trace_cells(mask: Bools, corner: tuple[int, int], cell_m: float, height_m: float) -> BaseGeometry:
    """The area of cells (rows, cols) in metres, y up, along their edges; the first is (across, down) ``corner``."""
    twice = np.pad(mask.view(np.uint8).repeat(2, axis=0).repeat(2, axis=1), 1)
    rings, order = cv2.findContours(twice, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    shells: list[BaseGeometry] = []
    holes: list[BaseGeometry] = []
    for ring, (_, _, _, parent) in zip(rings, order[0], strict=True):
        if len(ring) >= 3:
            corners = (ring[:, 0, :].astype(float) - 0.5) / 2 + corner
            polygon = shapely.make_valid(Polygon(corners * (cell_m, -cell_m) + (0.0, height_m)))
            (shells if parent < 0 else holes).append(polygon)
    return shapely.difference(shapely.union_all(shells), shapely.union_all(holes))


def _exact_area(mask: Bools, corner: tuple[int, int], cell_m: float, height_m: float) -> BaseGeometry:
    """Return what ``_trace_cells`` does, without its bevels of half a cell."""
    x, y = corner
    return affine_transform(area_of_cells(mask), [cell_m, 0.0, 0.0, cell_m, x * cell_m, height_m - y * cell_m])


def _occupied_area(occupied: Bools, cell_m: float) -> BaseGeometry:
    """Return the occupied cells (rows, cols) as an area, m, y up, without the steps of its cells."""
    area = _exact_area(occupied, (0, 0), cell_m, occupied.shape[0] * cell_m)
    return shapely.simplify(area, cell_m / 2)


def _unseen_shares(parts: Segmentation, free: Bools, occupied: Bools, cell_m: float) -> tuple[float, int]:
    """Return the share of the rooms' edges beside unseen cells, and the number of rooms with most of theirs there.

    The map's own cells (rows, cols) are ``cell_m`` wide. An edge near an occupied cell was seen. Beyond the picture's
    border, nothing was seen.
    """
    count = int(parts.rooms.max(initial=0)) + 1
    is_room = np.ones(count, np.uint8)
    is_room[[0, *(number for number in parts.outside if number < count)]] = 0
    rooms = _pad_cells(parts.to_cells(is_room[parts.rooms], free.shape))
    ring = cv2.dilate(rooms, np.ones((3, 3), np.uint8)) > (rooms | _pad_cells(free.view(np.uint8)))
    reach = 2 * round(PARTITION_M / cell_m) + 1
    near = cv2.dilate(_pad_cells(occupied.view(np.uint8)), np.ones((reach, reach), np.uint8))
    edge = np.flatnonzero(ring)
    unseen, beside = near.ravel()[edge] == 0, _rooms_beside(parts, edge, ring.shape[1])
    of_room = [np.bincount(each, minlength=count) for each in (beside[unseen], beside)]
    # a room of which most of the edge is unseen was seen in part, as a fan of rays through a door
    most = (of_room[0] > MOST * of_room[1]) & (is_room > 0)
    return float(np.count_nonzero(unseen) / max(len(edge), 1)), int(most.sum())


def _pad_cells(cells: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return cells (rows, cols) with a rim of zeros, one cell wide."""
    return np.asarray(cv2.copyMakeBorder(cells, 1, 1, 1, 1, cv2.BORDER_CONSTANT), np.uint8)


def _rooms_beside(parts: Segmentation, cells: npt.NDArray[np.int64], width: int) -> npt.NDArray[np.int64]:
    """Return the number (n,) of a room beside each of some cells (n,), flat indices of a map with its rim."""
    rows, cols = parts.rooms.shape
    row, col = np.divmod(cells, width)
    beside = np.zeros(len(row), np.int64)
    for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        at = ((row + down - 1) // parts.scale).clip(0, rows - 1), ((col + right - 1) // parts.scale).clip(0, cols - 1)
        beside = np.where(beside > 0, beside, parts.rooms[at])
    return beside
