"""Convert a sound home to a level for the stages: walls with doors and windows, a floor, named rooms and openings.

Walls are prisms, as of other made homes (``homes.level``). A door has a sill and a lintel, a window a wall below and a
lintel above. A balcony is bounded by parapets under the slab of the balcony above.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Final

import numpy as np
import shapely

from houseexpo.plan import Frame
from pipeline.geometry.areas import drop_lines_and_points, subtract, unite
from pipeline.geometry.prisms import Prism, Prisms
from pipeline.sources.files import level_id
from pipeline.sources.homes.level import DOOR_HEAD_M, SILL_M, WALL_TOP_M, pieces_of, prisms_mesh
from pipeline.sources.sound_homes.stairs import STOREY_M
from pipeline.sources.sound_homes.values import STAIRS, SoundHome, Storey, Window
from pipeline.sources.tolerances import FILE_GRID_M
from pipeline.values import MADE, Level, Opening, SourceObject, SourceRoom

_PARAPET_M: Final = 1.0
"""What building codes ask of a parapet."""


def levels_of_sound_home(home: SoundHome) -> Iterator[Level]:
    """Yield the levels of a home, from the ground up."""
    number = len(home.storeys)
    digest = sound_home_digest(home)
    for k, storey in enumerate(home.storeys):
        below = home.storeys[k - 1] if k else None
        rooms = [
            SourceRoom(("stairs",), (), polygon=room)
            if label == STAIRS
            else SourceRoom((label,), (label,), polygon=room)
            for label, room in zip(storey.labels, storey.rooms, strict=True)
        ]
        doors = [
            Opening.named(shapely.box(*door.rect), has_door=not door.is_open)
            for door in (*storey.doors, *storey.fronts)
        ]
        shell = _shell(storey, home)
        void = storey.void
        yield Level(
            id=level_id(home.id, k, number),
            walls=_walls(storey, home, shell),
            ceiling_m=WALL_TOP_M,
            frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), up="z", floor=round(k * STOREY_M, 4), level=k),
            floor=shell if void is None else subtract(shell, void.area),
            below=void and void.area,
            stairs=void and below and unite([step.area for step in below.steps]),
            rooms=tuple(rooms),
            room_count=len(rooms),
            openings=tuple(doors),
            windows=tuple(_window(window, storey.rooms[window.room]) for window in storey.windows),
            named_openings=True,
            only_walls=True,
            furniture=(SourceObject(("stairs",), prisms_mesh([step.prism for step in storey.steps])),)
            if storey.steps
            else (),
            provenance={"source": MADE, "style": "sound", "kind": home.kind, "sha256": digest},
        )


def _window(window: Window, room: shapely.Polygon) -> Opening:
    place = shapely.box(*window.rect)
    to_room = np.diff(shapely.get_coordinates(shapely.shortest_line(place.centroid, room)), axis=0)[0]
    return Opening.window(place, (window.sill_m, window.head_m), to_room)


def sound_home_digest(home: SoundHome) -> str:
    """SHA-256 of what a home is, in hex digits."""
    parts = []
    for storey in home.storeys:
        steps = [step.area for step in storey.steps]
        parts += [shapely.to_wkb(shapely.normalize(each)) for each in (*storey.rooms, *steps, *(storey.void or ()))]
        said = (storey.labels, storey.doors, storey.fronts, storey.windows, [step.top_m for step in storey.steps])
        parts.append(repr(said).encode())
    return hashlib.sha256(b"".join([*parts, repr((home.kind, home.inner_m, home.outer_m)).encode()])).hexdigest()


def _shell(storey: Storey, home: SoundHome) -> shapely.Geometry:
    """Return the area of a storey with its outer walls."""
    thick = [home.inner_m if k in storey.balconies else home.outer_m for k in range(len(storey.rooms))]
    found = shapely.buffer(storey.rooms, thick, join_style="mitre").tolist()
    if storey.void is not None:
        found.append(shapely.buffer(storey.void.area, home.outer_m, join_style="mitre"))
    return shapely.union_all(found)


def _walls(storey: Storey, home: SoundHome, shell: shapely.Geometry) -> Prisms:
    """Walls stand; in doors sills lie and lintels hang; windows stand between walls below and lintels."""
    void = shapely.Polygon() if storey.void is None else storey.void.area
    spaces = shapely.union_all([*storey.rooms, void])
    solid = drop_lines_and_points(shapely.difference(shell, spaces, grid_size=FILE_GRID_M))
    doors = shapely.union_all([shapely.box(*door.rect) for door in (*storey.doors, *storey.fronts)])
    prisms = []
    for window in storey.windows:
        for piece in pieces_of(shapely.intersection(solid, shapely.box(*window.rect))):
            prisms += [(piece, 0.0, window.sill_m), (piece, window.head_m, WALL_TOP_M)]
    panes = shapely.union_all([shapely.box(*window.rect) for window in storey.windows])
    inside = [room for k, room in enumerate(storey.rooms) if k not in storey.balconies]
    house = shapely.buffer([*inside, void], home.outer_m, join_style="mitre")
    parapets = drop_lines_and_points(shapely.difference(solid, shapely.union_all(house)))
    for piece in pieces_of(parapets):
        prisms += [(piece, 0.0, _PARAPET_M), (piece, DOOR_HEAD_M, WALL_TOP_M)]
    standing = shapely.difference(solid, shapely.union_all([doors, panes, parapets]), grid_size=FILE_GRID_M)
    prisms += [(piece, 0.0, WALL_TOP_M) for piece in pieces_of(standing)]
    for piece in pieces_of(shapely.intersection(solid, doors)):
        prisms += [(piece, 0.0, SILL_M), (piece, DOOR_HEAD_M, WALL_TOP_M)]
    if storey.void is not None:
        prisms += [(piece, 0.0, _PARAPET_M) for piece in pieces_of(storey.void.railing)]
    return Prisms(Prism(*each) for each in prisms)
