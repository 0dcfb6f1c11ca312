"""Convert a sound home to a level for the stages: walls with doors and windows, a floor, named rooms and openings.

Walls are prisms, as of other made homes (``homes.level``). A door has a sill and a lintel, a window a wall below and a
lintel above. A balcony is bounded by parapets under the slab of the balcony above.
"""

from __future__ import annotations

import hashlib
from typing import Final

import shapely

from houseexpo.plan import Frame
from pipeline.geometry.areas import polygons_of
from pipeline.geometry.meshes import Mesh
from pipeline.sources.homes.level import DOOR_HEAD_M, SILL_M, WALL_TOP_M, prisms_mesh
from pipeline.sources.sound_homes.values import SoundHome
from pipeline.values import MADE, Level, Opening, SourceRoom

_MIN_M2: Final = 1e-4
_PARAPET_M: Final = 1.0
"""What building codes ask of a parapet."""


def level_from_sound_home(home: SoundHome) -> Level:
    """Return the one level of a home."""
    rooms = [SourceRoom((label,), (label,), polygon=room) for label, room in zip(home.labels, home.rooms, strict=True)]
    doors = (*home.doors, *home.fronts)
    return Level(
        id=home.id,
        walls=_walls(home),
        ceiling_m=WALL_TOP_M,
        frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), up="z", floor=0.0, level=0),
        floor=_shell(home),
        rooms=tuple(rooms),
        room_count=len(rooms),
        openings=tuple(Opening.named(shapely.box(*door.rect), True) for door in doors),
        named_openings=True,
        provenance={"source": MADE, "style": "sound", "kind": home.kind, "sha256": sound_home_digest(home)},
    )


def sound_home_digest(home: SoundHome) -> str:
    """SHA-256 of what a home is, in hex digits."""
    parts = [shapely.to_wkb(shapely.normalize(room)) for room in home.rooms]
    said = (home.kind, home.labels, home.doors, home.fronts, home.windows, home.inner_m, home.outer_m)
    return hashlib.sha256(b"".join([*parts, repr(said).encode()])).hexdigest()


def _shell(home: SoundHome) -> shapely.Geometry:
    """Return the area of the house with its outer walls."""
    thick = [home.inner_m if k in home.balconies else home.outer_m for k in range(len(home.rooms))]
    return shapely.union_all(shapely.buffer(home.rooms, thick, join_style="mitre"))


def _walls(home: SoundHome) -> Mesh:
    """Walls stand; in doors sills lie and lintels hang; windows stand between walls below and lintels."""
    solid = shapely.difference(_shell(home), shapely.union_all(home.rooms))
    doors = shapely.union_all([shapely.box(*door.rect) for door in (*home.doors, *home.fronts)])
    prisms = []
    for window in home.windows:
        for piece in _pieces(shapely.intersection(solid, shapely.box(*window.rect))):
            prisms += [(piece, 0.0, window.sill_m), (piece, window.head_m, WALL_TOP_M)]
    panes = shapely.union_all([shapely.box(*window.rect) for window in home.windows])
    house = [
        shapely.buffer(r, home.outer_m, join_style="mitre") for k, r in enumerate(home.rooms) if k not in home.balconies
    ]
    parapets = shapely.difference(solid, shapely.union_all(house))
    for piece in _pieces(parapets):
        prisms += [(piece, 0.0, _PARAPET_M), (piece, DOOR_HEAD_M, WALL_TOP_M)]
    standing = shapely.difference(solid, shapely.union_all([doors, panes, parapets]))
    prisms += [(piece, 0.0, WALL_TOP_M) for piece in _pieces(standing)]
    for piece in _pieces(shapely.intersection(solid, doors)):
        prisms += [(piece, 0.0, SILL_M), (piece, DOOR_HEAD_M, WALL_TOP_M)]
    return prisms_mesh(prisms)


def _pieces(shape: shapely.Geometry) -> list[shapely.Polygon]:
    return [each for each in polygons_of(shape) if each.area > _MIN_M2]
