"""Read ProcTHOR houses, one in a JSON file or many, packed by gzip or not: yield one level for each.

Frame: Unity's axes are left-handed, so that x = X and y = Z show the house from above as it is; z = Y. Of many houses,
each has a line, or all are one JSON list. A file of lines is read as a stream: a build lists where each begins, a
worker goes there, and only one house is in memory.

R1  A wall is a sheet, drawn once for each of its rooms; here it stands once, DRAWN_SHEET_M thick about the sheet. A
    wall marked ``empty`` divides two rooms without standing.
R2  A door's or window's hole is measured along ``wall0`` from its first corner; older houses write it as a box
    (``boundingBox``). What has no leaf (a doorframe) is an opening without a door.
R3  Objects are furniture where the file has their boxes (``axisAlignedBoundingBox``); it names most by a model only.

A house is read as checked values. Keys that plans do not need are passed over.
"""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import itertools
import math
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely

from houseexpo.plan import Frame
from houseexpo.plan.room_labels import canonical
from pipeline.geometry.prisms import make_prisms
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import (
    Hole,
    Wall,
    openings_of_windows,
    passage_openings,
    polygon_from_ring,
    unite_rooms,
    wall_mesh,
)
from pipeline.sources.files import check_lengths, decode_document, id_from_file_name
from pipeline.sources.reader_choice import (
    begins_with_list,
    has_house_lines,
    objects_in_list,
    open_unpacked,
    reader_for_json,
)
from pipeline.sources.tolerances import DRAWN_SHEET_M, LARGEST_BYTES, LARGEST_TEXT_BYTES
from pipeline.values import Input, Level, SourceObject, SourceRoom

_ADVICE = "copy it again from the data set"


class Corner(msgspec.Struct, frozen=True):
    """A point of the scene in Unity's axes, metres; a hole's x runs along its wall, y is height."""

    x: float
    y: float
    z: float = 0.0


class WallRectangle(msgspec.Struct, frozen=True):
    """A wall: an upright rectangle, its first two corners on the floor."""

    id: str
    polygon: list[Corner]
    empty: bool = False


class HoleBox(msgspec.Struct, frozen=True):
    """A hole as older houses write it."""

    min: Corner
    max: Corner


class WallHole(msgspec.Struct, frozen=True):
    """A door or a window."""

    id: str
    wall0: str
    wall1: str = ""
    polygon: list[Corner] = msgspec.field(name="holePolygon", default_factory=list)
    box: HoleBox | None = msgspec.field(name="boundingBox", default=None)
    asset: str = msgspec.field(name="assetId", default="")

    @property
    def hole(self) -> list[Corner]:
        """The corners of its hole (R2)."""
        return self.polygon or ([self.box.min, self.box.max] if self.box else [])


class HouseRoom(msgspec.Struct, frozen=True, rename="camel"):
    """A room."""

    floor_polygon: list[Corner]
    room_type: str = ""


class ObjectBox(msgspec.Struct, frozen=True):
    """A box along the scene's axes."""

    center: Corner
    size: Corner


class HouseObject(msgspec.Struct, frozen=True):
    """An object; what stands on it is beside it in no plan."""

    id: str = ""
    box: ObjectBox | None = msgspec.field(name="axisAlignedBoundingBox", default=None)


class ProcthorHouse(msgspec.Struct, frozen=True):
    """One house."""

    walls: list[WallRectangle]
    rooms: list[HouseRoom]
    doors: list[WallHole] = []
    windows: list[WallHole] = []
    objects: list[HouseObject] = []


_HOUSE = msgspec.json.Decoder(ProcthorHouse)


def parse_house(data: bytes, name: str) -> ProcthorHouse:
    """Read one house; raises Rejection (EMPTY, UNREADABLE, NOT_FINITE, BAD_UNITS)."""
    house = decode_document(_HOUSE, data, name, _ADVICE)
    corners = (corner for shape in _shapes(house) for corner in shape)
    check_lengths([(corner.x, corner.y, corner.z) for corner in corners], name, _ADVICE)
    return house


def _shapes(house: ProcthorHouse) -> Iterable[list[Corner]]:
    yield from (wall.polygon for wall in house.walls)
    yield from (slot.hole for slot in [*house.doors, *house.windows])
    yield from (room.floor_polygon for room in house.rooms)
    yield from ([thing.box.center, thing.box.size] for thing in house.objects if thing.box is not None)


_STREAMS: dict[tuple[str, int], gzip.GzipFile] = {}  # this process's one open packed file


def find(path: str, **options: str) -> Iterator[Input]:
    """List the houses of one file in its order; option ``file`` is its name in the source."""
    file = Path(path)
    name = options.get("file", f"{file.absolute().parent.name}/{file.name}")
    settings = (("file", name),)
    base = id_from_file_name(name.removesuffix(".gz"))
    parts = _parts(file)
    if parts is None:
        yield Input(base, "procthor", str(file), options=settings)
        return
    for number, (start, length) in enumerate(parts):
        yield Input(f"{base}_{number:06d}", "procthor", str(file), f"{start}:{length}", settings)


def read(item: Input) -> Iterator[Level]:
    """Yield the level of one house; raise Rejection if it cannot be read."""
    data, options = read_house_bytes(item), dict(item.options)
    name = options.get("file", Path(item.path).name)
    house = parse_house(data, name)
    walls = _walls(house)
    if not walls:
        raise Rejection("source", Reason.EMPTY, f"{name}: no wall stands in the house", "leave it out")
    holes, rooms = _holes(house, name), _rooms(house)
    top = max(wall.top_m for wall in walls)
    yield Level(
        id=item.id,
        walls=wall_mesh(walls, holes),
        ceiling_m=top,
        frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "y", 0.0, 0),
        floor=unite_rooms(room.polygon for room in rooms if room.polygon is not None),
        furniture=_furniture(house.objects),
        named_openings=True,
        only_walls=True,
        rooms=rooms,
        room_count=len(rooms) or None,
        openings=passage_openings(holes),
        windows=openings_of_windows(holes),
        n_objects=len(house.objects),
        provenance={"source": "procthor", "file": name, "sha256": hashlib.sha256(data).hexdigest()},
    )


def read_house_bytes(item: Input) -> bytes:
    """Return the bytes of one house; raise Rejection if they are not there."""
    name = Path(item.path).name
    try:
        if not item.key:
            with open_unpacked(Path(item.path)) as stream:
                data = bytes(stream.read(LARGEST_TEXT_BYTES))
        else:
            start, length = (int(part) for part in item.key.split(":"))
            data = _part(item.path, start, length)
    except FileNotFoundError:
        raise Rejection("source", Reason.MISSING_FILE, f"{name} does not exist", "check the path") from None
    except (OSError, EOFError, zlib.error) as error:
        detail = f"{name} cannot be unpacked to its end: {type(error).__name__}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if len(data) >= LARGEST_TEXT_BYTES:  # bytes of one house; the largest of ProcTHOR-10k has a hundredth of it
        detail = f"{name}: a house of {LARGEST_TEXT_BYTES >> 20} MB or more"
        raise Rejection("source", Reason.TOO_LARGE, detail, "expected one house a file, or one a line")
    return data


def _part(path: str, start: int, length: int) -> bytes:
    """Return a part of a file: of a packed one the stream stays open, as the lines are asked for in their order."""
    changed = Path(path).stat().st_mtime_ns
    if (path, changed) not in _STREAMS:
        for old in list(_STREAMS):
            _STREAMS.pop(old).close()
        stream = open_unpacked(Path(path))
        if not isinstance(stream, gzip.GzipFile):
            with stream:
                stream.seek(start)
                return bytes(stream.read(length))
        _STREAMS[path, changed] = stream
    _STREAMS[path, changed].seek(start)
    return _STREAMS[path, changed].read(length)


def _parts(file: Path) -> Iterable[tuple[int, int]] | None:
    """Return start and length of each house of a file of many, or None of a file of one."""
    with contextlib.suppress(OSError, EOFError, zlib.error):
        if begins_with_list(file):
            with open_unpacked(file) as stream:
                data = bytes(stream.read(LARGEST_BYTES))
            if not has_house_lines(file) or reader_for_json(data) == "procthor":
                return list(objects_in_list(data)) or None
    lines = _lines(file)
    first, second = next(lines, None), next(lines, None)
    if first is None or second is None:
        return None
    if not has_house_lines(file) and not any(_is_house(file, each) for each in (first, second)):
        return None
    return itertools.chain((first, second), lines)


def _lines(file: Path) -> Iterator[tuple[int, int]]:
    """Yield start and length of each line that is not blank; what cannot be unpacked is one more line."""
    start = 0
    try:
        with open_unpacked(file) as stream:
            while line := stream.readline(LARGEST_TEXT_BYTES):
                if line.strip():
                    yield start, len(line)
                start += len(line)
    except (OSError, EOFError, zlib.error):
        yield start, LARGEST_TEXT_BYTES - 1


def _is_house(file: Path, line: tuple[int, int]) -> bool:
    """Return whether a line is a whole JSON document: a house that is written over several lines has none."""
    with open_unpacked(file) as stream:
        stream.seek(line[0])
        text = stream.read(line[1]).strip()
    return bool(text.startswith(b"{") and text.endswith(b"}"))


def _walls(house: ProcthorHouse) -> list[Wall]:
    """Return the walls, each once, although a wall is drawn for each of its rooms, and as thick as a drawn sheet."""
    found = []
    for wall in house.walls:
        ends = _wall_ends(wall)
        if not wall.empty and ends is not None:
            shape = shapely.buffer(shapely.LineString(ends), DRAWN_SHEET_M / 2, cap_style="square")
            heights = [corner.y for corner in wall.polygon]
            found.append(Wall(shape, min(heights), max(heights)))
    return found


def _wall_ends(wall: WallRectangle) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the ends of a wall in plan, the corner first from which its holes are measured."""
    corners = [(corner.x, corner.z) for corner in wall.polygon]
    if len(corners) < 3:
        return None
    end = max(corners[1:], key=lambda corner: math.dist(corners[0], corner))
    return (corners[0], end) if math.dist(corners[0], end) > DRAWN_SHEET_M else None


def _holes(house: ProcthorHouse, name: str) -> list[Hole]:
    """Return the doors and windows, measured along their first wall from its first corner."""
    walls = {wall.id: wall for wall in house.walls}
    found = []
    for slot, is_door in [(door, True) for door in house.doors] + [(window, False) for window in house.windows]:
        wall = walls.get(slot.wall0) or walls.get(slot.wall1)
        ends = _wall_ends(wall) if wall is not None else None
        if wall is None or ends is None or len(slot.hole) < 2:
            found_none = f"no wall {slot.wall0!r}" if wall is None else f"no hole in {wall.id!r}"
            detail = f"{name}: {slot.id}: expected a hole in one of its walls, found {found_none}"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
        foot = min(corner.y for corner in wall.polygon)
        found.append(_hole(slot, np.array(ends), foot, is_door))
    return found


def _hole(slot: WallHole, ends: Any, foot: float, is_door: bool) -> Hole:
    along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    reach = [corner.x for corner in slot.hole]
    line = shapely.LineString([ends[0] + min(reach) * along, ends[0] + max(reach) * along])
    shape = shapely.buffer(line, DRAWN_SHEET_M / 2, cap_style="flat")
    heights = [foot + corner.y for corner in slot.hole]
    has_leaf = is_door and not slot.asset.startswith("Doorframe")
    return Hole(shape, min(heights), max(heights), has_leaf)


def _rooms(house: ProcthorHouse) -> tuple[SourceRoom, ...]:
    found = []
    for room in house.rooms:
        label = canonical(room.room_type)
        polygon = polygon_from_ring((corner.x, corner.z) for corner in room.floor_polygon)
        words = (room.room_type,) if room.room_type else ()
        found.append(SourceRoom(words, (label,) if label else (), polygon))
    return tuple(found)


def _furniture(things: list[HouseObject]) -> tuple[SourceObject, ...]:
    """Return the objects whose boxes the file has."""
    found = []
    for thing in things:
        if thing.box is None:
            continue
        centre, size = thing.box.center, thing.box.size
        low, high = (centre.x - size.x / 2, centre.z - size.z / 2), (centre.x + size.x / 2, centre.z + size.z / 2)
        body = make_prisms(shapely.box(*low, *high), centre.y - size.y / 2, centre.y + size.y / 2)
        found.append(SourceObject((thing.id.partition("|")[0],), body))
    return tuple(found)
