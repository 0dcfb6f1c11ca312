"""Read an indoor map in IndoorGML: its cell spaces as rooms, and the doors between them.

Format: OGC IndoorGML 1.0 and 1.1, core and navigation module (OGC 14-005). A cell has a polygon or a solid, a state
stands for it in a graph, and transitions join states. Coordinates are metres, or degrees where ``srsName`` says EPSG
4326, latitude first.

R1  A cell is a room where it stands: the lowest level faces of a solid, or its polygon. Its name is that of the room.
R2  A connection space, an anchor space, and a cell that is called a door are doors: one walks along the shorter side.
    So are connection and anchor boundaries.
R3  Cells share their faces in most files: where two rooms touch, a wall is put between them.
R4  In a file that draws no door, each transition between two rooms that touch is a door of the usual width where its
    line crosses their common edge; its place is a guess.
R5  Cells whose floors lie less than head height apart are one storey.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.file_kinds import format_suffix
from pipeline.geometry.areas import drop_lines_and_points, polygons_of
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import Element, LeftOutParts, parse_xml
from pipeline.sources.roles import Role, role_from_name
from pipeline.sources.tolerances import FILE_GRID_M, IFC_DOOR_M
from pipeline.sources.vector_plans.drawing import Drawing, DrawnStorey, Feature
from pipeline.sources.vector_plans.geojson import degrees_to_metres
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.tolerances import CRACK_M, HEAD_M

Floats = npt.NDArray[np.float64]
_ROOT = re.compile(rb"<(\w+:)?IndoorFeatures[\s>]")
_DOOR_SPACES: Final = frozenset({"ConnectionSpace", "AnchorSpace"})
_CELLS: Final = frozenset(
    {"CellSpace", "GeneralSpace", "TransitionSpace", "TransferSpace", "NavigableSpace", *_DOOR_SPACES}
)
_DOOR_BOUNDARIES: Final = frozenset({"ConnectionBoundary", "AnchorBoundary"})
_ADVICE = "export the map again"


@dataclass
class _Map:
    """What a file holds: spaces and doors with the heights of their floors, and the lines of its transitions."""

    spaces: list[tuple[float, Feature]] = field(default_factory=list)
    doors: list[tuple[float, BaseGeometry]] = field(default_factory=list)
    ways: list[LineString] = field(default_factory=list)


def can_read(path: Path, head: bytes) -> bool:
    """By the root of the document."""
    return format_suffix(path, head) in {".gml", ".xml", ".indoorgml"} and _ROOT.search(head) is not None


def read_drawing(path: Path) -> Drawing:
    """Read a map.

    Raises
    ------
    Rejection
        UNREADABLE where the file is not XML or a number is invalid, NO_LEVEL where no cell has a floor.
    """
    data = path.read_bytes()
    left_out = LeftOutParts()
    found = _Map()
    for element in parse_xml(data, path.name, left_out).iter():
        name = _name_of(element)
        if name in _CELLS:
            _add_cell(element, name, found, left_out)
        elif name in _DOOR_BOUNDARIES:
            found.doors += [(height, line) for line, height in _lines(element) if line.length > 0.0]
        elif name == "Transition":
            found.ways += [line for line, _ in _lines(element)]
    if found.spaces and b"4326" in data:
        found = _in_metres(found)
    storeys = [_storey(found, low, high) for low, high in _heights([height for height, _ in found.spaces])]
    guesses = () if found.doors or not found.ways else ("doors",)
    return Drawing("indoorgml", tuple(storeys), left_out, guesses, wanted="cells with a floor", advice=_ADVICE)


def _name_of(element: Element) -> str:
    """Return the name of an element without its prefix."""
    return str(element.tag).rpartition(":")[2]


def _texts(element: Element, name: str) -> Iterator[str]:
    for inner in element.iter():
        if _name_of(inner) == name and inner.text and inner.text.strip():
            yield inner.text.strip()


def _add_cell(cell: Element, kind: str, found: _Map, left_out: LeftOutParts) -> None:
    """R1, R2."""
    word = next(_texts(cell, "name"), "")
    faces = list(_faces(cell))
    if not faces:
        left_out.add(f"cell {word or cell.get('gml:id', '')!r} has no polygon")
        return
    floor = min(float(face[:, 2].min()) for face in faces)
    level = [face for face in faces if np.ptp(face[:, 2]) < FILE_GRID_M and face[0, 2] - floor < FILE_GRID_M] or faces
    area = drop_lines_and_points(shapely.union_all([shapely.make_valid(Polygon(face[:, :2])) for face in level]))
    role = role_from_name(word)
    if kind in _DOOR_SPACES or (role is not None and role.role is Role.DOOR):
        found.doors.append((floor, area))
    else:
        found.spaces.append((floor, Feature("space", area, (word,) if word else (), walled=True)))


def _faces(element: Element) -> Iterator[Floats]:
    """Yield the outer rings (n, 3) of all polygons in an element."""
    for polygon in element.iter():
        if _name_of(polygon) == "Polygon":
            for exterior in polygon:
                if _name_of(exterior) == "exterior":
                    ring = _points(exterior, closed=True)
                    if len(ring) > 3:
                        yield ring


def _lines(element: Element) -> Iterator[tuple[LineString, float]]:
    """Yield the lines of a boundary or a transition in plan, with their lowest height; of a face, its longest side."""
    for inner in element.iter():
        if _name_of(inner) == "LineString":
            points = _points(inner, closed=False)
        elif _name_of(inner) == "exterior":
            points = _points(inner, closed=True)
            if len(points):
                far = int(np.argmax(np.hypot(*(points[:, :2] - points[0, :2]).T)))
                points = points[[0, far]]
        else:
            continue
        if len(points) > 1:
            yield LineString(points[:, :2]), float(points[:, 2].min())


def _points(element: Element, *, closed: bool) -> Floats:
    """Return points (n, 3); a list without ``srsDimension`` has the dimension in which its ring closes, else 3."""
    rows = [_numbers(text) for text in _texts(element, "pos")]
    if not rows:
        for part in element.iter():
            if _name_of(part) == "posList" and part.text:
                values = _numbers(part.text)
                said = part.get("srsDimension") or element.get("srsDimension")
                sizes = [int(said)] if said in {"2", "3"} else [3, 2]
                fits = [n for n in sizes if len(values) % n == 0]
                if closed:
                    fits = [n for n in fits if np.allclose(values[:n], values[-n:], atol=FILE_GRID_M)] or fits
                if fits:
                    rows = list(values.reshape(-1, fits[0]))
    if not rows or len({len(row) for row in rows}) != 1 or len(rows[0]) not in {2, 3}:
        return np.empty((0, 3))
    points = np.array(rows)
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])


def _numbers(text: str) -> Floats:
    try:
        found = np.array([float(word) for word in text.split()], np.float64)
    except ValueError:
        detail = f"expected coordinates, found {' '.join(text.split())[:60]!r}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if not np.isfinite(found).all():
        raise Rejection("source", Reason.NOT_FINITE, "a coordinate is not finite", _ADVICE)
    return found


def _in_metres(found: _Map) -> _Map:
    """Turn latitude and longitude into metres."""
    turned = [shapely.transform(each.shape, lambda points: points[:, ::-1]) for _, each in found.spaces]
    to_metres = degrees_to_metres(turned)

    def placed(shape: BaseGeometry) -> BaseGeometry:
        return shapely.transform(shape, lambda points: to_metres(points[:, ::-1]))

    return _Map(
        [(height, replace(each, shape=placed(each.shape))) for height, each in found.spaces],
        [(height, placed(shape)) for height, shape in found.doors],
        [placed(line) for line in found.ways],
    )


def _heights(floors: Sequence[float]) -> Iterator[tuple[float, float]]:
    """R5: yield from which height to which each storey has its floors."""
    low: float | None = None
    for floor in sorted(floors):
        if low is not None and floor - low < HEAD_M:
            continue
        if low is not None:
            yield low, floor
        low = floor
    if low is not None:
        yield low, np.inf


def _storey(found: _Map, low: float, high: float) -> DrawnStorey:
    here = [each for height, each in found.spaces if low <= height < high]
    doors = [shape for height, shape in found.doors if low - HEAD_M / 2 <= height < high - HEAD_M / 2]
    if not found.doors:  # R4
        doors = list(_crossings([part for each in here for part in polygons_of(each.shape)], found.ways))
    return replace(storey_from_features([*here, *(Feature("door", shape) for shape in doors)], low), all_named=False)


def _crossings(rooms: Sequence[Polygon], ways: Sequence[LineString]) -> Iterator[LineString]:
    """R4: yield a line from jamb to jamb where a transition crosses the common edge of two rooms."""
    tree = shapely.STRtree(rooms)
    for way in ways:
        pair = [rooms[k] for end in (0, -1) for k in tree.query(shapely.get_point(way, end), "intersects")]
        if len(pair) != 2 or pair[0] is pair[1]:
            continue
        edge = shapely.line_merge(pair[0].boundary.intersection(pair[1].buffer(CRACK_M)))
        crossed = [part for part in shapely.get_parts(edge) if isinstance(part, LineString) and part.intersects(way)]
        for part in crossed[:1]:
            middle = part.project(part.intersection(way).centroid)
            half = min(IFC_DOOR_M[0], part.length) / 2
            middle = min(max(middle, half), part.length - half)
            yield LineString([part.interpolate(middle - half), part.interpolate(middle + half)])
