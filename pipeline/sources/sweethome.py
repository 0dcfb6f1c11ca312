"""Sweet Home 3D: the levels of a ``.sh3d`` home, or of its ``Home.xml``; centimetres in the file.

Frame: the file's plan is drawn with y down; a level has y up, and its frame takes (x, y) back to the file's metres.

R1  A level is one where a wall stands. Rooms with a name have the label that it spells.
R2  A home that has only the older ``Home`` entry (a Java serialisation, before 5.3) is read from that.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import shapely
from shapely import Polygon
from shapely.affinity import scale

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.archives import read_member
from pipeline.sources.drawn_storeys import Wall, beside, between, clean, floor_of, indoors, openings, prism, standing
from pipeline.sources.left_out import LeftOut
from pipeline.sources.naming import check_file, level_id, single_input
from pipeline.sources.room_names import labels_for
from pipeline.sources.sweethome_home import DrawnRoom, Home, Piece, Storey, home_of
from pipeline.sources.sweethome_java import home_element
from pipeline.sources.sweethome_shapes import bodies, footprint, hole_of, strips
from pipeline.sources.xml_tree import LARGEST_BYTES, Element, parse_xml
from pipeline.values import Input, Level, SourceObject, SourceRoom

JAVA = b"\xac\xed"
"""How a Java serialisation begins."""


def find(path: str, **options: str) -> Iterator[Input]:
    """List one home."""
    yield single_input(path, "sweethome", options)


def read(item: Input) -> Iterator[Level]:
    """Yield the home's levels, lowest first; raise Rejection if it cannot be read or no wall stands in it."""
    path = Path(item.path)
    name = dict(item.options).get("file", path.name)
    left_out = LeftOut()
    home = home_of(_home(path), path.name, left_out)
    levels = [level for level in home.levels if any(wall.level == level.key for wall in home.walls)]  # R1
    if not levels:
        raise Rejection(
            "source", Reason.EMPTY, f"{name}: no wall stands in the home", "draw its walls, not its furniture"
        )
    provenance = {"source": "sweethome", "file": name, "sha256": sha256_of(path)} | left_out.provenance
    for number, level in enumerate(levels):
        yield _level(home, level, level_id(item.id, number, len(levels)), number, provenance)


def _level(home: Home, storey: Storey, name: str, number: int, provenance: dict[str, str]) -> Level:
    found = strips([wall for wall in home.walls if wall.level == storey.key])
    holes = [
        replace(hole, shape=_turned(hole.shape), across=(hole.across[0], -hole.across[1]))
        for door in home.doors
        if door.level == storey.key and (hole := hole_of(door, found)) is not None
    ]
    walls = [Wall(_turned(wall.shape), wall.bottom_m, wall.top_m) for wall in bodies(found)]
    rooms = indoors([_room(room) for room in home.rooms if room.level == storey.key], walls)
    walls = beside(rooms, walls, holes)
    fillings, holes = between(rooms, walls, holes)
    pieces = [piece for piece in home.furniture if piece.level == storey.key]
    return Level(
        id=name,
        walls=standing([*walls, *fillings], holes),
        ceiling_m=max((wall.top_m for wall in walls), default=0.0),
        frame=Frame(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)), "z", storey.elevation_m, number),
        floor=floor_of(room.polygon for room in rooms if room.polygon is not None),
        furniture=tuple(_object(piece) for piece in pieces),
        named_openings=True,
        rooms=rooms,
        room_count=len(rooms) or None,
        openings=openings(holes),
        n_objects=len(pieces),
        provenance={**provenance, "storey": storey.name, **({} if storey.shown else {"hidden": "yes"})},
    )


def _home(path: Path) -> Element:
    check_file(path)
    with path.open("rb") as stream:
        head = stream.read(2)
    if head != b"PK":
        with path.open("rb") as stream:
            data = stream.read(LARGEST_BYTES + 1)
        return home_element(data, path.name) if head == JAVA else parse_xml(data, path.name)
    found = read_member(path, ("Home.xml",), LARGEST_BYTES)
    if found is not None:
        return parse_xml(found, path.name)
    older = read_member(path, ("Home",), LARGEST_BYTES)  # R2
    if older is None:
        detail = f"{path.name}: expected Home.xml or Home in it, found neither"
        raise Rejection("source", Reason.UNREADABLE, detail, "save it again in Sweet Home 3D")
    return home_element(older, path.name)


def _room(room: DrawnRoom) -> SourceRoom:
    words = (room.name,) if room.name else ()
    polygon = clean(room.ring)
    return SourceRoom(words, labels_for(words), None if polygon is None else _turned(polygon))


def _object(piece: Piece) -> SourceObject:
    bottom = piece.elevation_m
    return SourceObject((piece.name,), prism(_turned(footprint(piece)), bottom, bottom + piece.height_m))


def _turned(shape: Polygon) -> Polygon:
    """From y down to y up."""
    turned: Polygon = shapely.normalize(scale(shape, 1.0, -1.0, origin=(0.0, 0.0)))
    return turned
