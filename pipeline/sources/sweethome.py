"""Read a Sweet Home 3D home (``.sh3d``, or its ``Home.xml`` in centimetres): yield its levels in metres.

Frame: the file's plan is drawn with y down; a level has y up, and its frame takes (x, y) back to the file's metres.

R1  A level is one where a wall stands. Rooms with a name have the label that it spells.
R2  A home that has only the older ``Home`` entry (a Java serialisation, before 5.3) is read from that.
R3  A home without any wall, whose doors stand in the edges of its rooms, has walls along these edges, as thick as the
    program draws them.

**Reading** ``Home.xml`` as values in metres; x right, y DOWN as in the file, heights above the ground.

H1  What carries no ``level`` belongs to the one level of a home without levels. Heights count from the level.
H2  A wall without a height has the home's; ``heightAtEnd`` slopes it; ``arcExtent`` (radians) bends it.
H3  A piece that is not visible is not there. A level that is not shown is one all the same. Groups hold pieces, which
    have places of their own.
H4  A piece without a sash is a mere opening where the catalogue calls it a frame: sliding windows have no sash either.
H5  A piece or a room that cannot be read is left out; a wall that cannot be read ends the reading.
H7  A window by its kind or its name, other than a French or a sliding one, is no way out if it is fixed or starts above
    the floor, however low.
H8  Nor is any window of an upper storey a way out if it leads into the air: where neither a room nor a piece of its
    level lies before it (a balcony), nor what the walls of a lower level enclose (a roof).
H6  A piece of furniture that is called a door, and is as large as one, is a door if it stands in a wall.

**Shapes** of walls and doors in plan, metres, axes as in the file.

S1  A wall is a strip about its middle; a bent one a strip about its arc.
S2  Where two walls are joined, the corner between their ends is filled up to where their outer faces meet.
S3  A sloping wall goes up in steps of 0.1 m.
S4  A door's hole goes through the whole of each wall that runs along it and in which its frame stands, however deep the
    frame is.

**Old homes**: the ``Home`` entry of Sweet Home 3D before 5.3, a Java serialisation, is turned into the ``Home.xml``
that newer versions write. The library only reads the values: no class is loaded and nothing is run. Fields have the
names of the later attributes; a wall's neighbours and an object's level are references, which get ids here.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.affinity import scale, translate
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.geometry.areas import fill_enclosed, polygons_of, shares_inside, unite
from pipeline.geometry.prisms import make_prisms
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import (
    Hole,
    Wall,
    drop_outdoor_rooms,
    fill_between_rooms,
    openings_of_windows,
    passage_openings,
    polygon_from_ring,
    subtract_rooms_from_walls,
    unite_rooms,
    wall_mesh,
)
from pipeline.sources.files import Element, LeftOutParts, check_file, input_from_file, level_id, parse_xml, read_member
from pipeline.sources.roles import Role, labels_for, role_from_name, split_words, word_role
from pipeline.sources.tolerances import (
    ALONG,
    ARC_STEP_RAD,
    DEEPEST,
    FEW,
    LARGEST_BYTES,
    LONGEST_LENGTH_M,
    NAMED_DOOR_M,
    NARROWEST_DOOR_M,
    SHARPEST,
    SLOPE_STEPS,
    SWEETHOME_WALL_CM,
    TINY,
    TURN_RAD,
    WALL_HEIGHT_M,
    WIDEST_DOOR_BODY_M,
)
from pipeline.tolerances import CM_M, HAND_M, HEAD_M, KNEE_M, MM_M, MOST, SHOULDERS_M, THICK_WALL_M
from pipeline.values import Input, Level, SourceObject, SourceRoom

WALKED_THROUGH: Final = re.compile(r"french|slid|schieb|coulissant|corredera|scorrevol", re.IGNORECASE)  # H7
PIECES = frozenset({"pieceOfFurniture", "light", "shelfUnit"})
_ADVICE = "save it again in Sweet Home 3D"


@dataclass(frozen=True)
class SweetHomeLevel:
    """A level: ``key`` is the file's own id of it, "" for a home without levels."""

    key: str
    name: str
    elevation_m: float
    height_m: float
    shown: bool = True


@dataclass(frozen=True)
class DrawnWall:
    """A wall along its middle from ``start`` to ``end``; ``key`` and its neighbours' at both ends."""

    key: str
    level: str
    start: tuple[float, float]
    end: tuple[float, float]
    thickness_m: float
    height_m: float
    end_height_m: float
    arc_rad: float
    joined: tuple[str, str]


@dataclass(frozen=True)
class FurniturePiece:
    """A piece of furniture, a door or a window: a box about (x, y), turned by an angle (clockwise as drawn)."""

    level: str
    name: str
    at: tuple[float, float]
    angle_rad: float
    width_m: float
    depth_m: float
    height_m: float
    elevation_m: float


@dataclass(frozen=True)
class DoorOrWindow(FurniturePiece):
    """The part that stands in the wall, as shares of width and depth; ``has_leaf`` tells it from a mere frame.

    ``is_window`` is True where the program says that it is a window and no door, ``called_window`` where its kind or
    its name has a word for windows, French ones included.
    """

    wall_left: float
    wall_width: float
    wall_distance: float
    wall_thickness: float
    mirrored: bool
    has_leaf: bool
    is_window: bool = False
    called_window: bool = False


@dataclass(frozen=True)
class DrawnRoom:
    """A room: its ring and its name, or "" if it has none."""

    level: str
    name: str
    ring: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SweetHome:
    """A home; levels from the lowest to the highest."""

    levels: tuple[SweetHomeLevel, ...]
    walls: tuple[DrawnWall, ...]
    doors: tuple[DoorOrWindow, ...]
    rooms: tuple[DrawnRoom, ...]
    furniture: tuple[FurniturePiece, ...]


def parse_home(root: Element, name: str, left_out: LeftOutParts) -> SweetHome:
    """Read a home; raises Rejection (UNREADABLE, NOT_FINITE, BAD_UNITS) where its levels or walls are damaged."""
    if root.tag != "home":
        detail = f"{name}: expected <home>, found <{root.tag[:40]}>"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    usual = _length(root, "wallHeight", WALL_HEIGHT_M / CM_M)
    storeys = [
        SweetHomeLevel(
            each.get("id", ""),
            each.get("name", ""),
            _length(each, "elevation"),
            _length(each, "height", WALL_HEIGHT_M / CM_M),
            _flag(each, "visible", True),
        )
        for each in root.findall("level")
    ]
    levels = sorted(storeys, key=lambda each: each.elevation_m) or [SweetHomeLevel("", "", 0.0, usual)]
    here = {each.key for each in levels}
    doors: list[DoorOrWindow] = []
    furniture: list[FurniturePiece] = []
    rooms: list[DrawnRoom] = []
    for each in (*_visible(root), *root.iter("room")):
        if each.get("level", "") in here:
            with left_out.part():  # H5
                if each.tag == "room":
                    rooms.append(_room(each))
                elif each.tag == "doorOrWindow":
                    doors.append(_door(each, _values(each)))
                else:
                    furniture.append(FurniturePiece(**_values(each)))
    walls = tuple(_wall(each, usual) for each in root.iter("wall") if each.get("level", "") in here)
    called = [(piece, door) for piece in furniture if (door := _called_door(piece, walls))]
    doors += [door for _, door in called]
    furniture = [piece for piece in furniture if all(piece is not other for other, _ in called)]
    return SweetHome(
        levels=tuple(levels),
        walls=walls,
        doors=tuple(doors),
        rooms=tuple(rooms),
        furniture=tuple(furniture),
    )


def _visible(element: Element) -> Iterator[Element]:
    """H3."""
    for child in element:
        if not _flag(child, "visible", True):
            continue
        if child.tag == "furnitureGroup":
            yield from _visible(child)
        elif child.tag in PIECES or child.tag == "doorOrWindow":
            yield child


def _wall(element: Element, usual: float) -> DrawnWall:
    """H2."""
    height = _length(element, "height", usual / CM_M)
    return DrawnWall(
        key=element.get("id", ""),
        level=element.get("level", ""),
        start=(_length(element, "xStart"), _length(element, "yStart")),
        end=(_length(element, "xEnd"), _length(element, "yEnd")),
        thickness_m=abs(_length(element, "thickness", SWEETHOME_WALL_CM)),
        height_m=height,
        end_height_m=_length(element, "heightAtEnd", height / CM_M),
        arc_rad=_number(element, "arcExtent", 0.0),
        joined=(element.get("wallAtStart", ""), element.get("wallAtEnd", "")),
    )


def _values(element: Element) -> dict[str, Any]:
    return {
        "level": element.get("level", ""),
        "name": element.get("name", ""),
        "at": (_length(element, "x"), _length(element, "y")),
        "angle_rad": _number(element, "angle", 0.0),
        "width_m": abs(_length(element, "width")),
        "depth_m": abs(_length(element, "depth")),
        "height_m": abs(_length(element, "height")),
        "elevation_m": _length(element, "elevation"),
    }


def _door(element: Element, values: dict[str, Any]) -> DoorOrWindow:
    return DoorOrWindow(
        **values,
        wall_left=_number(element, "wallLeft", 0.0),
        wall_width=_number(element, "wallWidth", 1.0),
        wall_distance=_number(element, "wallDistance", 0.0),
        wall_thickness=_number(element, "wallThickness", 1.0),
        mirrored=_flag(element, "modelMirrored", False),
        has_leaf=element.find("sash") is not None or not _is_frame(element),
        is_window=_is_window(element, values["elevation_m"]),
        called_window=Role.WALL in _roles(element),
    )


def _is_window(element: Element, sill_m: float) -> bool:
    """H7."""
    kind, roles = _kind(element), _roles(element)
    if Role.WALL not in roles or Role.DOOR in roles or WALKED_THROUGH.search(kind):
        return False
    return sill_m > HAND_M or "fixed" in kind.lower()


def _kind(element: Element) -> str:
    return f"{element.get('catalogId') or ''} {element.get('name') or ''}"


def _roles(element: Element) -> set[Role | None]:
    """Return what the words of a piece's kind and name stand for."""
    return {word_role(word) for word in split_words(_kind(element))}


def _called_door(piece: FurniturePiece, walls: Sequence[DrawnWall]) -> DoorOrWindow | None:
    """H6; None where a piece is not called a door, or stands in no wall."""
    named = role_from_name(piece.name)
    if named is None or named.role is not Role.DOOR or piece.elevation_m > KNEE_M:
        return None
    high = NAMED_DOOR_M[0] <= piece.height_m <= NAMED_DOOR_M[1]
    if not (high and NARROWEST_DOOR_M <= piece.width_m <= WIDEST_DOOR_BODY_M and piece.depth_m <= THICK_WALL_M):
        return None
    door = DoorOrWindow(
        **vars(piece),
        wall_left=0.0,
        wall_width=1.0,
        wall_distance=0.0,
        wall_thickness=1.0,
        mirrored=False,
        has_leaf=True,
    )
    strips = wall_strips([wall for wall in walls if wall.level == piece.level])
    return door if hole_of_door(door, strips) is not None else None


def _is_frame(element: Element) -> bool:
    """H4."""
    kind = (element.get("catalogId") or element.get("name") or "").lower()
    return "frame" in kind or "opening" in kind


def _room(element: Element) -> DrawnRoom:
    ring = tuple((_length(point, "x"), _length(point, "y")) for point in element.findall("point"))
    return DrawnRoom(element.get("level", ""), " ".join(element.get("name", "").split()), ring)


def _length(element: Element, key: str, usual: float = 0.0) -> float:
    """Return metres."""
    return _number(element, key, usual, LONGEST_LENGTH_M / CM_M) * CM_M


def _number(element: Element, key: str, usual: float, most: float = 1000.0) -> float:
    text = element.get(key)
    if text is None:
        return usual
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        detail = f"{key} of {element.tag} {element.get('id', '')!r} is {text[:40]!r}, expected a finite number"
        raise Rejection("source", Reason.NOT_FINITE, detail, _ADVICE)
    if abs(value) > most:
        detail = f"{key} of {element.tag} {element.get('id', '')!r} is {value:.4g}, expected {most:.0f} at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, _ADVICE)
    return value


def _flag(element: Element, key: str, usual: bool) -> bool:
    return element.get(key, str(usual)).strip().lower() == "true"


@dataclass(frozen=True, eq=False)
class WallStrip:
    """A wall with its middle line (n, 2) and its shape."""

    wall: DrawnWall
    line: Any
    shape: Polygon


def wall_strips(walls: Sequence[DrawnWall]) -> list[WallStrip]:
    """S1: return the walls that have a length and a thickness."""
    found = []
    for wall in walls:
        line = _middle(wall)
        if math.dist(wall.start, wall.end) > MM_M and wall.thickness_m > MM_M:
            shape = LineString(line).buffer(wall.thickness_m / 2, cap_style="flat", join_style="mitre")
            found.append(WallStrip(wall, line, max(polygons_of(shape), key=lambda part: part.area)))
    return found


def wall_bodies(found: Sequence[WallStrip]) -> list[Wall]:
    """Return the walls and the corners between them as pieces that stand on the floor."""
    by_key = {strip.wall.key: strip for strip in found if strip.wall.key}
    return [piece for strip in found for piece in (*_sloped_walls(strip), *_corners(strip, by_key))]


def hole_of_door(door: DoorOrWindow, found: Sequence[WallStrip]) -> Hole | None:
    """S4, or None if it stands in no wall."""
    across, along = _axes(door.angle_rad)
    left = 1 - door.wall_left - door.wall_width if door.mirrored else door.wall_left
    u = (-0.5 + left) * door.width_m, (-0.5 + left + door.wall_width) * door.width_m
    v = (-0.5 + door.wall_distance) * door.depth_m
    frame = _quad(door.at, along, across, u, (v, v + door.wall_thickness * door.depth_m))
    cut = []
    for strip in found:
        runs = [direction for direction in _directions(strip.line) if abs(np.dot(direction, along)) > ALONG]
        if runs and shapely.intersection(frame, strip.shape).area > FEW * min(frame.area, _share(strip, frame)):
            reach = strip.wall.thickness_m + door.depth_m
            lane = _quad(door.at, along, across, u, (v - reach, v + door.wall_thickness * door.depth_m + reach))
            cut.append(shapely.intersection(lane, strip.shape))
    parts = [part for part in polygons_of(shapely.union_all(cut)) if part.distance(frame) < MM_M]
    if not parts:
        return None
    shape = shapely.convex_hull(shapely.union_all(parts))
    return Hole(
        shape,
        door.elevation_m,
        door.elevation_m + door.height_m,
        door.has_leaf,
        (float(across[0]), float(across[1])),
        door.is_window,
    )


def piece_footprint(piece: FurniturePiece) -> Polygon:
    """Return a piece's box seen from above."""
    across, along = _axes(piece.angle_rad)
    half = piece.width_m / 2, piece.depth_m / 2
    return _quad(piece.at, along, across, (-half[0], half[0]), (-half[1], half[1]))


def _share(strip: WallStrip, frame: Polygon) -> float:
    """Area that a frame could have in a wall thinner than itself."""
    longest = max(frame.length / 2 - strip.wall.thickness_m, MM_M)
    return float(longest * strip.wall.thickness_m)


def _middle(wall: DrawnWall) -> Any:
    """Return the points (n, 2) of a wall's middle."""
    a, b = np.array(wall.start), np.array(wall.end)
    if abs(wall.arc_rad) < TURN_RAD or abs(wall.arc_rad) > 2 * math.pi - TURN_RAD:
        return np.stack([a, b])
    centre = (a + b) / 2 - np.array([b[1] - a[1], a[0] - b[0]]) / (2 * math.tan(wall.arc_rad / 2))
    turns = np.linspace(0.0, wall.arc_rad, max(3, math.ceil(abs(wall.arc_rad) / ARC_STEP_RAD)) + 1)
    cos, sin = np.cos(turns), np.sin(turns)
    x, y = a - centre
    return centre + np.column_stack([x * cos - y * sin, x * sin + y * cos])


def _sloped_walls(strip: WallStrip) -> Iterable[Wall]:
    """S3."""
    wall = strip.wall
    rise = wall.end_height_m - wall.height_m
    if abs(rise) < HAND_M:
        return [Wall(strip.shape, 0.0, max(wall.height_m, wall.end_height_m))]
    count = min(SLOPE_STEPS, math.ceil(abs(rise) / HAND_M))
    line = LineString(strip.line)
    found = []
    for k in range(count):
        part = substring(line, k / count, (k + 1) / count, normalized=True)
        shape = part.buffer(wall.thickness_m / 2, cap_style="flat", join_style="mitre")
        found.append(Wall(shape, 0.0, wall.height_m + rise * (k + 0.5) / count))
    return found


def _corners(strip: WallStrip, by_key: Mapping[str, WallStrip]) -> Iterable[Wall]:
    """S2."""
    for at_end, key in enumerate(strip.wall.joined):
        other = by_key.get(key)
        if other is None:
            continue
        line = strip.line[::-1] if at_end else strip.line
        near = line[0]
        other_line = other.line
        if np.hypot(*(other_line[-1] - near)) < np.hypot(*(other_line[0] - near)):
            other_line = other_line[::-1]
        halves = strip.wall.thickness_m / 2, other.wall.thickness_m / 2
        shape = _corner(near, line[1] - near, other_line[0], other_line[1] - other_line[0], halves)
        top = strip.wall.end_height_m if at_end else strip.wall.height_m
        if shape is not None:
            yield Wall(shape, 0.0, min(top, max(other.wall.height_m, other.wall.end_height_m)))


def _corner(a: Any, u: Any, b: Any, v: Any, halves: tuple[float, float]) -> Polygon | None:
    """Return what lies between the ends of two walls that leave from a and b in the directions u and v."""
    u, v = u / np.hypot(*u), v / np.hypot(*v)
    n, m = np.array([-u[1], u[0]]) * halves[0], np.array([-v[1], v[0]]) * halves[1]
    points = [a + n, a - n, b + m, b - m]
    turn = u[0] * v[1] - u[1] * v[0]
    if abs(turn) > TURN_RAD:
        for p, q in ((a + n, b - m), (a - n, b + m)):
            t = ((q - p)[0] * v[1] - (q - p)[1] * v[0]) / turn
            if abs(t) < SHARPEST * 2 * max(halves):
                points.append(p + t * u)
    hull = shapely.convex_hull(shapely.MultiPoint(np.array(points)))
    return hull if isinstance(hull, Polygon) and hull.area > MM_M**2 else None


def _directions(line: Any) -> Any:
    steps = np.diff(line, axis=0)
    return steps / np.maximum(np.hypot(*steps.T), TINY)[:, None]


def _axes(angle: float) -> tuple[Any, Any]:
    """Return the directions of a piece's depth (from its back) and of its width."""
    return np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])


def _quad(at: Any, along: Any, across: Any, u: tuple[float, float], v: tuple[float, float]) -> Polygon:
    corners = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])]
    return Polygon([np.array(at) + s * along + t * across for s, t in corners])


MODEL: Final = "com.eteks.sweethome3d.model."
_NOT_JAVA: Final = "open it in Sweet Home 3D 5.3 or newer and save it"
_LISTS: Final = ("furnitureWithGroups", "furnitureWithDoorsAndWindows", "furniture")
"""Where the furniture stands, from 2.3 on, from 1.8 on, and before."""


def parse_home_xml(data: bytes, name: str) -> Element:
    """Return a home as the root of ``Home.xml``; raises Rejection (UNREADABLE) where it is damaged, or no home."""
    from javaobj.v2.main import load

    try:
        fields = _fields(load(io.BytesIO(data)))
        return _Writer().home(fields)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001  # the library raises whatever broken bytes lead it to
        text = " ".join(str(error).split())[:120]
        detail = f"{name}: its Home, which Sweet Home 3D wrote before version 5.3, cannot be read: {text}"
        raise Rejection("source", Reason.UNREADABLE, detail, _NOT_JAVA) from None


class _Writer:
    """Makes elements of objects, and gives ids to those that others refer to."""

    def __init__(self) -> None:
        self._ids: dict[int, str] = {}

    def home(self, fields: Mapping[str, Any]) -> Element:
        root = ET.Element("home", _plain(fields))
        for level in fields.get("levels") or ():
            ET.SubElement(root, "level", {"id": self._id(level), **_plain(_fields(level))})
        listed: Iterable[Any] = next((fields[key] for key in _LISTS if fields.get(key) is not None), ())
        for piece in listed:
            self._piece(root, piece, 0)
        for wall in fields.get("walls") or ():
            self._object(root, "wall", wall)
        for room in fields.get("rooms") or ():
            made = self._object(root, "room", room)
            for x, y in _fields(room).get("points") or ():
                ET.SubElement(made, "point", {"x": str(float(x)), "y": str(float(y))})
        return root

    def _piece(self, parent: Element, piece: Any, deep: int) -> None:
        kind = piece.classdesc.name.removeprefix(MODEL)
        if kind == "HomeFurnitureGroup" and deep < DEEPEST:
            group = self._object(parent, "furnitureGroup", piece)
            for inner in _fields(piece).get("furniture") or ():
                self._piece(group, inner, deep + 1)
            return
        made = self._object(parent, "doorOrWindow" if kind == "HomeDoorOrWindow" else "pieceOfFurniture", piece)
        for _ in _fields(piece).get("sashes") or ():
            ET.SubElement(made, "sash")

    def _object(self, parent: Element, tag: str, found: Any) -> Element:
        fields = _fields(found)
        refers = {key: self._id(fields[key]) for key in ("level", "wallAtStart", "wallAtEnd") if fields.get(key)}
        return ET.SubElement(parent, tag, {"id": self._id(found), **_plain(fields), **refers})

    def _id(self, found: Any) -> str:
        return self._ids.setdefault(found.handle, f"{len(self._ids)}")


def _fields(found: Any) -> dict[str, Any]:
    """Return the fields of an object and of the classes above it, by name."""
    return {field.name: value for fields in found.field_data.values() for field, value in fields.items()}


def _plain(fields: Mapping[str, Any]) -> dict[str, str]:
    """Return the numbers, flags and texts among fields, as attributes; a number in an object counts too."""
    found = {}
    for key, value in fields.items():
        kind = getattr(getattr(value, "classdesc", None), "name", "")
        if kind in {"java.lang.Float", "java.lang.Double", "java.lang.Integer", "java.lang.Long"}:
            value = _fields(value)["value"]  # noqa: PLW2901
        if isinstance(value, bool):
            found[key] = str(value).lower()
        elif isinstance(value, int | float):
            found[key] = repr(float(value))
        elif type(value).__name__ == "JavaString":
            found[key] = str(value)
    return found


JAVA = b"\xac\xed"
"""How a Java serialisation begins."""


def find(path: str, **options: str) -> Iterator[Input]:
    """List one home."""
    yield input_from_file(path, "sweethome", options)


def read(item: Input) -> Iterator[Level]:
    """Yield the home's levels, lowest first; raise Rejection if it cannot be read or no wall stands in it."""
    path = Path(item.path)
    name = dict(item.options).get("file", path.name)
    left_out = LeftOutParts()
    home = parse_home(_home(path), path.name, left_out)
    home, guesses = (home, ()) if home.walls else (replace(home, walls=tuple(_walls_at_edges(home))), ("walls",))  # R3
    levels = [level for level in home.levels if any(wall.level == level.key for wall in home.walls)]  # R1
    if not levels:
        raise Rejection(
            "source", Reason.EMPTY, f"{name}: no wall stands in the home", "draw its walls, not its furniture"
        )
    provenance = {"source": "sweethome", "file": name, "sha256": sha256_of(path)} | left_out.provenance
    for number, level in enumerate(levels):
        yield replace(_level(home, level, level_id(item.id, number, len(levels)), number, provenance), guesses=guesses)


def _walls_at_edges(home: SweetHome) -> Iterator[DrawnWall]:
    """Yield walls along the edges of the rooms of each level where a door stands in one of these walls (R3)."""
    for level in home.levels:
        walls = [
            wall
            for k, room in enumerate(home.rooms)
            if room.level == level.key
            for wall in _walls_of_ring(k, room, level)
        ]
        found = wall_strips(walls)
        if any(door.level == level.key and hole_of_door(door, found) is not None for door in home.doors):
            yield from walls


def _walls_of_ring(number: int, room: DrawnRoom, level: SweetHomeLevel) -> Iterator[DrawnWall]:
    count = len(room.ring)
    for k, (start, end) in enumerate(zip(room.ring, room.ring[1:] + room.ring[:1], strict=True)):
        joined = (f"{number} {(k - 1) % count}", f"{number} {(k + 1) % count}")
        height, thickness = level.height_m, SWEETHOME_WALL_CM * CM_M
        yield DrawnWall(f"{number} {k}", level.key, start, end, thickness, height, height, 0.0, joined)


def _level(home: SweetHome, storey: SweetHomeLevel, name: str, number: int, provenance: dict[str, str]) -> Level:
    found = wall_strips([wall for wall in home.walls if wall.level == storey.key])
    holes = [
        replace(hole, shape=_flip_y(hole.shape), across=(hole.across[0], -hole.across[1]))
        for hole in _holes(home, storey, found)
    ]
    walls = [Wall(_flip_y(wall.shape), wall.bottom_m, wall.top_m) for wall in wall_bodies(found)]
    rooms = drop_outdoor_rooms([_source_room(room) for room in home.rooms if room.level == storey.key], walls)
    walls = subtract_rooms_from_walls(rooms, walls, holes)
    fillings, holes = fill_between_rooms(rooms, walls, holes)
    pieces = [piece for piece in home.furniture if piece.level == storey.key]
    return Level(
        id=name,
        walls=wall_mesh([*walls, *fillings], holes),
        ceiling_m=max((wall.top_m for wall in walls), default=0.0),
        frame=Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "z", storey.elevation_m, number),
        floor=unite_rooms(room.polygon for room in rooms if room.polygon is not None),
        furniture=tuple(_object(piece) for piece in pieces),
        named_openings=True,
        only_walls=True,
        rooms=rooms,
        room_count=len(rooms) or None,
        openings=passage_openings(holes),
        windows=openings_of_windows(holes),
        n_objects=len(pieces),
        provenance={**provenance, "storey": storey.name, **({} if storey.shown else {"hidden": "yes"})},
    )


def _holes(home: SweetHome, storey: SweetHomeLevel, found: Sequence[WallStrip]) -> Iterator[Hole]:
    """Yield the holes in the walls of a level; a window that leads into the air is no way (H8)."""
    doors = [door for door in home.doors if door.level == storey.key]
    upper = storey.elevation_m >= HEAD_M and any(door.called_window for door in doors)
    footing = _footing(home, storey, found) if upper else None
    for door in doors:
        hole = hole_of_door(door, found)
        if hole is not None and footing is not None and door.called_window and _leads_into_the_air(hole, footing):
            yield replace(hole, is_window=True)
        elif hole is not None:
            yield hole


def _leads_into_the_air(hole: Hole, footing: BaseGeometry) -> bool:
    """Return whether there is nothing to stand on at one of both sides of a hole (H8)."""
    away = np.ptp(shapely.get_coordinates(hole.shape) @ hole.across) + SHOULDERS_M / 2
    x, y = away * np.array(hole.across)
    sides = [translate(hole.shape, sign * x, sign * y) for sign in (-1, 1)]
    return bool(shares_inside(sides, footing).min() < MOST)


def _footing(home: SweetHome, storey: SweetHomeLevel, found: Sequence[WallStrip]) -> BaseGeometry:
    """Return where one can stand in a storey: in rooms, within walls, on pieces, and on lower storeys (H8)."""
    lower = {each.key for each in home.levels if each.elevation_m < storey.elevation_m}
    below = wall_strips([wall for wall in home.walls if wall.level in lower])
    rooms = [polygon_from_ring(room.ring) for room in home.rooms if room.level == storey.key]
    pieces = [piece_footprint(piece) for piece in home.furniture if piece.level == storey.key]
    walls = [fill_enclosed(unite(strip.shape for strip in strips)) for strips in (found, below)]
    return unite([*walls, *(room for room in rooms if room is not None), *pieces])


def _home(path: Path) -> Element:
    check_file(path)
    with path.open("rb") as stream:
        head = stream.read(2)
    if head != b"PK":
        with path.open("rb") as stream:
            data = stream.read(LARGEST_BYTES + 1)
        return parse_home_xml(data, path.name) if head == JAVA else parse_xml(data, path.name)
    found = read_member(path, ("Home.xml",), LARGEST_BYTES)
    if found is not None:
        return parse_xml(found, path.name)
    older = read_member(path, ("Home",), LARGEST_BYTES)  # R2
    if older is None:
        detail = f"{path.name}: expected Home.xml or Home in it, found neither"
        raise Rejection("source", Reason.UNREADABLE, detail, "save it again in Sweet Home 3D")
    return parse_home_xml(older, path.name)


def _source_room(room: DrawnRoom) -> SourceRoom:
    words = (room.name,) if room.name else ()
    polygon = polygon_from_ring(room.ring)
    return SourceRoom(words, labels_for(words), None if polygon is None else _flip_y(polygon))


def _object(piece: FurniturePiece) -> SourceObject:
    bottom = piece.elevation_m
    return SourceObject((piece.name,), make_prisms(_flip_y(piece_footprint(piece)), bottom, bottom + piece.height_m))


def _flip_y(shape: Polygon) -> Polygon:
    """From y down to y up."""
    turned: Polygon = shapely.normalize(scale(shape, 1.0, -1.0, origin=(0.0, 0.0)))
    return turned
