"""Hold a plan as its file draws it, and make levels of it for ``vector_plans``.

A reader says what it finds as ``Feature`` values; ``named_features.storey_from_features`` makes a ``DrawnStorey`` of
them, with walls as bodies and holes through them. The frame: metres, x right and y up in the plan.

R1  Two lines closer than THICK_WALL_M that enclose something are the faces of one wall: between them is wall.
R2  A door stands in a wall. Where its file leaves a gap in the wall, the gap is filled up to the wall's faces first, so
    that the door has a lintel; the wall's depth is that of the wall ends beside the door.
R3  A drawing of rooms without walls has its walls between and around the rooms (``walls_around_floors``).
R4  What lies far from the origin is moved near; the way back is in the level's frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.geometry.areas import dot_product, drop_thin_parts, polygons_of, unite
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import (
    Hole,
    Wall,
    deepen_to_wall_faces,
    merge_parallel_holes,
    openings_of_windows,
    passage_openings,
    polygon_from_ring,
    wall_prisms,
    walls_around_floors,
)
from pipeline.sources.files import LeftOutParts, level_id
from pipeline.sources.storeys.surfaces import weighted_quantile
from pipeline.sources.tolerances import (
    COVER_MARGIN_M,
    DEEPEST_WALL_M,
    DOOR_HEIGHT_M,
    FAR_FROM_ORIGIN_M,
    FILE_GRID_M,
    LINE_WALL_M,
    LONGEST_SITE_M,
    THICKEST_LINE_M,
    TINY,
    WALL_HEIGHT_M,
)
from pipeline.tolerances import CM_M, CRACK_M, MOST, THICK_WALL_M
from pipeline.values import IDLE, Input, Level, Mesh, Opening, SourceObject, SourceRoom

Point = tuple[float, float]
Line = tuple[str, Any]
"""The name and the points (n, 2) of a line that a drawing shows."""
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Feature:
    """One thing that a file draws, and what the file says of it: the value that all readers of drawings yield.

    =======  ===========================================  ====================================================
    kind     as an area                                   as a line
    =======  ===========================================  ====================================================
    wall     a closed line: a wall or the outline of a    a face; with ``thick_m`` the middle of a wall
             house; with ``filled`` a wall as it stands
    door     the area of the passage                      from jamb to jamb
    opening  the same, without a leaf                     the same
    swing                                                 hinge and the two ends of the arc that a leaf draws
    window   its area, with heights where ``top_m`` is    a line of it, or several
    room     its floor                                    a side of it
    space    the floor of a cell that shares its sides
             with others
    name                                                  a point in the room; ``words`` has the text
    object   a piece of furniture
    floor    what is floor, of a room or of none
    other    what the reader passes over; people see its  the same
             lines, and ``words`` names them
    =======  ===========================================  ====================================================

    Attributes
    ----------
    kind
        One of the words above.
    shape
        In the file's unit, x right and y up. An area may cross itself, and both may be of many parts.
    words, labels
        What the source calls it, and our labels of it, where the file says more than its words.
    thick_m
        Thickness of a wall that is drawn by its middle, or of the wall of a passage where the file draws none. An area
        of a passage that has one is a leaf, which may be thinner than the wall.
    low_m, top_m
        Heights over the floor; None is the usual one.
    filled
        Whether the area is a wall as it stands.
    walled
        Whether a space has a wall where it touches others; None: as it has a passage there, or none.
    """

    kind: str
    shape: BaseGeometry
    words: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    thick_m: float | None = None
    low_m: float = 0.0
    top_m: float | None = None
    filled: bool = False
    walled: bool | None = None


@dataclass(frozen=True, eq=False)
class DrawnStorey:
    """A storey of a drawing, metres: ``height_m`` is that of its floor.

    ``all_named``: the drawing names each passage, so that a gap without a name is not a passage.
    ``unnamed_gaps``: a wide gap is a passage, although the drawing names doors.
    ``about`` is for the plan's provenance, ``signs`` are those of the level. ``lines`` returns all lines of the storey,
    metres, for people to look at.
    """

    walls: tuple[Wall, ...] = ()
    holes: tuple[Hole, ...] = ()
    windows: tuple[Opening, ...] = ()
    rooms: tuple[SourceRoom, ...] = ()
    floor: Polygon | MultiPolygon | None = None
    furniture: tuple[SourceObject, ...] = ()
    height_m: float = 0.0
    all_named: bool = True
    unnamed_gaps: bool = False
    about: Mapping[str, Any] = field(default_factory=dict)
    signs: Mapping[str, float] = field(default_factory=dict)
    lines: Callable[[], Sequence[Line]] = tuple


@dataclass(frozen=True, eq=False)
class Drawing:
    """What a file holds: storeys, lowest first, what of it was left out, and what its reader had to guess.

    ``all_ways``: it states each way, as our own exports do (``STATES_WAYS``). ``y_up``: in the file y is up, and what
    is y in the storeys is -z there. ``unit_m`` is the length of the file's unit, metres. ``names`` are those of its
    parts (layers), ``idle`` is what a person said of it and what does nothing.
    """

    source: str
    storeys: tuple[DrawnStorey, ...]
    left_out: LeftOutParts
    guesses: tuple[str, ...] = ()
    y_up: bool = False
    all_ways: bool = False
    unit_m: float = 1.0
    names: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    wanted: str = "walls or rooms"
    advice: str = "draw the walls, or leave the file out"


def is_named(name: str, patterns: Iterable[str]) -> bool:
    """Return whether the name of a part is one of these, or matches one of them as a pattern."""
    return any(name == each or fnmatchcase(name, each) for each in patterns)


def points_from(said: Any, least: int = 2, columns: int = 0, unit_m: float = 1.0) -> Floats:
    """Return points (n, 2 or 3), metres, of a file; ValueError if they are not finite points, or beyond any building.

    ``columns`` is how many numbers a point has; 0 takes two or three.
    """
    found = np.array(said, np.float64) * unit_m
    if found.ndim != 2 or found.shape[1] not in ({columns} if columns else {2, 3}) or len(found) < least:
        raise ValueError(f"expected {least} points or more of {columns or '2 or 3'} numbers")
    if not np.isfinite(found).all() or np.abs(found).max() > 10 * LONGEST_SITE_M:
        raise ValueError("it lies beyond any building")
    return found


def area_from_ring(ring: Iterable[Sequence[float]]) -> Polygon:
    """Return the polygon of a ring (n, 2), its largest part where it crosses itself; ValueError if it has no area."""
    found = polygon_from_ring(ring)
    if found is None:
        raise ValueError("it has no area")
    return found


def wall_thickness(said_m: float) -> float:
    """Return the thickness of a wall that is drawn as a line: what a file says, if that may be one."""
    return said_m if CM_M < said_m < THICKEST_LINE_M else LINE_WALL_M


def walls_along_lines(lines: Iterable[tuple[Point, Point]], thick_m: float) -> list[Polygon]:
    """Return the walls along lines of one thickness: their corners are mitred, their ends stand out by half of it."""
    segments = [LineString(line) for line in lines if line[0] != line[1]]
    merged = shapely.line_merge(shapely.union_all(segments, grid_size=FILE_GRID_M)) if segments else LineString()
    body = shapely.buffer(merged, thick_m / 2, cap_style="square", join_style="mitre", mitre_limit=2.0)
    return polygons_of(body)


def walls_between_faces(shapes: Iterable[Polygon]) -> list[Polygon]:
    """Walls of some faces or bodies."""
    body = shapely.union_all(list(shapes), grid_size=FILE_GRID_M)
    whole = shapely.union_all([Polygon(part.exterior) for part in polygons_of(body)])
    voids = polygons_of(shapely.difference(whole, body))
    slits = [void for void in voids if drop_thin_parts(void, THICK_WALL_M).is_empty]
    return polygons_of(shapely.union_all([body, *slits], grid_size=FILE_GRID_M))


def walls_between_rooms(rooms: Sequence[Polygon], walled: Sequence[bool]) -> list[Polygon]:
    """Return walls along the edges at which rooms touch others, of those rooms that are ``walled``."""
    areas = shapely.STRtree(rooms)
    edges = []
    for number, room in enumerate(rooms):
        if walled[number]:
            edge = shapely.boundary(room)
            beside = [rooms[k] for k in areas.query(edge, "dwithin", distance=CRACK_M) if k != number]
            edges.append(shapely.intersection(edge, shapely.buffer(shapely.union_all(beside), CRACK_M)))
    lines = shapely.union_all(edges, grid_size=FILE_GRID_M)

    return polygons_of(shapely.buffer(lines, LINE_WALL_M / 2, cap_style="flat", join_style="mitre"))


def passage_rectangles(shapes: Sequence[BaseGeometry]) -> list[tuple[Polygon, Point] | None]:
    """Return of each passage the smallest turned rectangle round it, and the way, of length 1, on which one walks.

    One walks along the shorter side. None if a shape has no area.
    """
    boxes = np.atleast_1d(shapely.minimum_rotated_rectangle(np.array(shapes, np.object_)))
    areal = np.flatnonzero(shapely.get_type_id(boxes) == shapely.GeometryType.POLYGON)
    corners = shapely.get_coordinates(boxes[areal]).reshape(-1, 5, 2)
    sides = corners[:, 1:] - corners[:, :4]
    lengths = np.hypot(sides[..., 0], sides[..., 1])
    short = sides[np.arange(len(areal)), np.argmin(lengths, axis=1)]
    ways = (short / np.maximum(lengths.min(axis=1), TINY)[:, None]).tolist()
    found: list[tuple[Polygon, Point] | None] = [None] * len(boxes)
    for k, (x, y) in zip(areal.tolist(), ways, strict=True):
        found[k] = boxes[k], (x, y)
    return found


def door_hole(
    start: Sequence[float],
    end: Sequence[float],
    walls: Sequence[Polygon],
    *,
    has_door: bool,
    bottom_m: float = 0.0,
    top_m: float = DOOR_HEIGHT_M,
    thick_m: float = LINE_WALL_M,
) -> Hole | None:
    """Return the hole of a door that is drawn as a line from jamb to jamb; None if it has no length.

    R2: it goes as deep as the walls at its jambs, or along it where the wall has no gap; ``thick_m`` where none is.
    """
    a, b = np.asarray(start[:2], np.float64), np.asarray(end[:2], np.float64)
    length = float(np.hypot(*(b - a)))
    if not CM_M < length < LONGEST_SITE_M:  # a shorter door, or a thinner wall, has no stated size
        return None
    along = (b - a) / length
    across = np.array([-along[1], along[0]])
    near = _near(walls, LineString([a, b]))
    low, high = _depth(near, (a, b), across, thick_m)
    shape = Polygon([a + across * low, b + across * low, b + across * high, a + across * high])
    return Hole(shape, bottom_m, top_m, has_door, (float(across[0]), float(across[1])))


def deepen_to_walls(holes: Sequence[Hole], walls: Sequence[Polygon]) -> list[Hole]:
    """Return holes that are as deep as the walls in which they are drawn; one to which no wall comes stays the same."""
    if not holes or not walls:
        return list(holes)
    shapes, across = np.array([each.shape for each in holes]), np.array([each.across for each in holes])
    corners, hole = shapely.get_coordinates(shapes, return_index=True)
    boxes = shapely.bounds(shapes)[hole]
    middle = (boxes[:, :2] + boxes[:, 2:]) / 2
    corners = middle + (corners - middle) * (1.0 - FILE_GRID_M / 10)  # a wall that ends at a jamb only touches the lane
    step = DEEPEST_WALL_M * across[hole]
    ends = np.stack([corners - step, corners + step], axis=1).reshape(-1, 2)
    lanes = shapely.convex_hull(shapely.linestrings(ends, indices=np.repeat(hole, 2)))
    reached = set(shapely.STRtree(lanes).query(walls, predicate="intersects")[1].tolist())
    return [deepen_to_wall(each, walls) if k in reached else each for k, each in enumerate(holes)]


def deepen_to_wall(hole: Hole, walls: Sequence[Polygon]) -> Hole:
    """Return a hole that is as deep as the wall in which it is drawn; the same one where no wall is."""
    reached = deepen_to_wall_faces(hole, [Wall(wall, 0.0, hole.top_m) for wall in walls])
    if reached is None or reached.shape.area < MOST * hole.shape.area:
        return hole
    return reached


def deepen_to_jambs(hole: Hole, thick_m: float, walls: Sequence[Polygon]) -> Hole:
    """Return the hole of a leaf in a gap, as deep as the walls at its jambs, or ``thick_m`` where none is (R2)."""
    across = np.array(hole.across)
    along = np.array([-across[1], across[0]])
    corners = shapely.get_coordinates(hole.shape)
    beside, deep = corners @ along, corners @ across
    middle = across * (deep.min() + deep.max()) / 2
    start, end = along * beside.min() + middle, along * beside.max() + middle
    thick = max(thick_m, float(np.ptp(deep)))
    made = door_hole(start.tolist(), end.tolist(), walls, has_door=hole.has_door, thick_m=thick)
    wide = shapely.convex_hull(shapely.union_all([hole.shape, made.shape])) if made is not None else hole.shape
    return replace(hole, shape=wide) if isinstance(wide, Polygon) else hole


def _near(walls: Sequence[Polygon], line: LineString) -> BaseGeometry:
    return shapely.union_all([wall for wall in walls if shapely.dwithin(wall, line, COVER_MARGIN_M + CM_M)])


def _depth(walls: BaseGeometry, jambs: tuple[Floats, Floats], across: Floats, thick_m: float) -> tuple[float, float]:
    """Return how far the wall reaches to the right (negative) and to the left of a line."""
    a, b = jambs
    along = np.array([across[1], -across[0]])
    middle = (a + b) / 2
    end = along * COVER_MARGIN_M
    probes = [middle, a - end, b + end, a + end, b - end]
    found = []
    for probe in probes:
        ray = LineString([probe - across * DEEPEST_WALL_M, probe + across * DEEPEST_WALL_M])
        for part in shapely.get_parts(shapely.intersection(walls, ray)):
            ends = dot_product(shapely.get_coordinates(part) - probe, across)
            if (
                len(ends)
                and ends.min() <= CRACK_M  # a door's line may lie this far outside of its wall
                and ends.max() >= -CRACK_M
                and ends.max() - ends.min() < DEEPEST_WALL_M
                and np.abs(ends).max() < DEEPEST_WALL_M - FILE_GRID_M  # else the ray ends in a wall along it
            ):
                found.append((float(ends.min()), float(ends.max())))
        if found:  # nearest to what is asked for: the wall itself, then the ends beside it
            break
    if not found:
        return -thick_m / 2, thick_m / 2
    return min(low for low, _ in found), max(high for _, high in found)


def levels_from_drawing(item: Input, drawing: Drawing, path: Path, name: str) -> Iterator[Level]:
    """Yield the levels of a drawing; raise Rejection if none of its storeys has walls or rooms.

    Raises
    ------
    Rejection
        NO_LEVEL where nothing is drawn, BAD_UNITS where it is larger than any building.
    """
    drawn = storeys_drawn(drawing)
    if not drawn:
        detail = f"{name}: expected {drawing.wanted}, found none"
        detail += f"; left out: {drawing.left_out.note}" if drawing.left_out else ""
        raise Rejection("source", Reason.NO_LEVEL, detail, drawing.advice)
    provenance: dict[str, Any] = {
        "source": drawing.source,
        "file": name,
        "sha256": sha256_of(path),
    } | drawing.left_out.provenance
    provenance |= {IDLE: list(drawing.idle)} if drawing.idle else {}
    for number, storey in enumerate(drawn):
        made = _level(storey, name)
        yield replace(
            made,
            id=level_id(item.id, number, len(drawn)),
            frame=replace(_flip_y(made.frame) if drawing.y_up else made.frame, level=number),
            guesses=drawing.guesses,
            unit_m=drawing.unit_m,
            all_ways=drawing.all_ways,
            signs=storey.signs,
            provenance={**provenance, **storey.about},
        )


def storeys_drawn(drawing: Drawing) -> list[DrawnStorey]:
    """Return the storeys that become levels, lowest first."""
    drawn = [storey for storey in drawing.storeys if storey.walls or any(each.polygon for each in storey.rooms)]
    return sorted(drawn, key=lambda each: each.height_m)


def usual_height(tops: Sequence[tuple[float, float]]) -> float:
    """Return the height at which most of the walls end, metres; ``tops`` are heights, and lengths of outlines.

    The pieces under windows are many, but short.
    """
    high, long = np.array(tops or [(WALL_HEIGHT_M, 1.0)]).T
    return weighted_quantile(high, long, 0.5)


def _flip_y(frame: Frame) -> Frame:
    """Return the frame of a level whose file has y up: plan (x, y) is (x, -z) there."""
    (a, b, x), (c, d, y) = frame.matrix
    return replace(frame, matrix=((a, b, x), (-c, -d, -y)), up="y")


def _level(storey: DrawnStorey, name: str) -> Level:
    """Return a level, still without its own id and number."""
    storey, shift = _move_near(storey, name)
    shapes = [each.polygon for each in storey.rooms if each.polygon is not None]
    if storey.walls:
        walls = list(storey.walls)
        top = usual_height([(wall.top_m, wall.shape.length) for wall in walls])
        holes = list(storey.holes)
    else:
        top = WALL_HEIGHT_M
        walls = walls_around_floors(shapes, top)  # R3
        holes = [
            deep
            for hole in merge_parallel_holes(storey.holes)
            if (deep := deepen_to_wall_faces(hole, walls)) is not None
        ]
    named = [each for each in storey.rooms if each.polygon is not None or each.box is not None]
    return Level(
        id="",
        walls=wall_prisms(walls, holes, filled_to_m=top if storey.walls else None),  # R2
        ceiling_m=top,
        frame=Frame(((1.0, 0.0, shift[0]), (0.0, 1.0, shift[1])), "z", storey.height_m, 0),
        floor=storey.floor or (_floor([*shapes, *(hole.shape for hole in holes)]) if shapes else None),
        furniture=storey.furniture,
        named_openings=storey.all_named and bool(holes),
        unnamed_gaps=storey.unnamed_gaps,
        only_walls=True,
        rooms=tuple(named),
        room_count=len(shapes) or None,
        openings=passage_openings(holes),
        windows=(*storey.windows, *openings_of_windows(holes)),
        n_objects=len(storey.furniture),
    )


def _floor(shapes: Sequence[Polygon]) -> Polygon | MultiPolygon | None:
    """Return what rooms and passages cover together: without a grid, which takes three times as long."""
    area = unite(shapes)
    return area if isinstance(area, Polygon | MultiPolygon) and not area.is_empty else None


def _move_near(storey: DrawnStorey, name: str) -> tuple[DrawnStorey, Point]:
    """Move what lies far from the origin near it; return the storey and the shift."""
    shapes = [wall.shape for wall in storey.walls] + [r.polygon for r in storey.rooms if r.polygon is not None]
    x1, y1, x2, y2 = shapely.total_bounds(shapes).tolist()
    if not np.isfinite([x1, y1, x2, y2]).all():
        raise Rejection("source", Reason.NOT_FINITE, f"{name} has coordinates that are not finite", "correct them")
    length = max(x2 - x1, y2 - y1)
    if length > LONGEST_SITE_M:
        said = f"{length:,.0f}" if length < 1e9 else f"{length:.3g}"
        detail = f"{name} is {said} m long, expected {LONGEST_SITE_M:,.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "give its scale, or leave it out")
    if max(abs(x1), abs(y1), abs(x2), abs(y2)) < FAR_FROM_ORIGIN_M:
        return storey, (0.0, 0.0)
    dx, dy = float(np.floor(x1)), float(np.floor(y1))
    return _move_storey(storey, lambda points: points - (dx, dy)), (dx, dy)


def scale_drawing(drawing: Drawing, factor: float) -> Drawing:
    """Return a drawing with its lengths in plan multiplied; heights are those that readers give to drawings."""
    storeys = tuple(_move_storey(storey, lambda points: points * factor) for storey in drawing.storeys)
    return replace(drawing, storeys=storeys, unit_m=drawing.unit_m * factor)


def _move_storey(storey: DrawnStorey, to: Callable[[Floats], Floats]) -> DrawnStorey:
    """Return a storey whose points in plan (n, 2) are moved."""

    def moved(shape: Any) -> Any:
        return None if shape is None else shapely.transform(shape, to)

    def room(each: SourceRoom) -> SourceRoom:
        x1, y1, x2, y2 = (0.0,) * 4 if each.box is None else to(np.reshape(each.box, (2, 2))).ravel().tolist()
        return replace(each, polygon=moved(each.polygon), box=each.box and (x1, y1, x2, y2))

    def thing(each: SourceObject) -> SourceObject:
        points = np.column_stack([to(each.mesh.vertices[:, :2]), each.mesh.vertices[:, 2]])
        return SourceObject(each.words, Mesh(points, each.mesh.faces))

    return replace(
        storey,
        walls=tuple(replace(wall, shape=moved(wall.shape)) for wall in storey.walls),
        holes=tuple(replace(hole, shape=moved(hole.shape)) for hole in storey.holes),
        windows=tuple(
            Opening.window(moved(each.polygon), (each.sill_m, each.head_m), each.across) for each in storey.windows
        ),
        rooms=tuple(map(room, storey.rooms)),
        floor=moved(storey.floor),
        furniture=tuple(map(thing, storey.furniture)),
        lines=lambda: [(name, to(points)) for name, points in storey.lines()],
    )
