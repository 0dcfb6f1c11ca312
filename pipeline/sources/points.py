"""Point clouds of a room or a flat (.ply without faces, .pcd, .xyz, .las, .laz, .e57): a level for each storey.

Frame: x = X, y = Y of a z-up cloud; x = X, y = -Z of a y-up one. A cloud names nothing: walls are what persists from
the floor to the ceiling, doors are found by the stages, as in a mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import shapely
from shapely import MultiPolygon, Polygon
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import Frame
from pipeline.geometry.overlay import areas
from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn import prism, united
from pipeline.sources.naming import base_id, level_id, sha256
from pipeline.sources.points_file import blocks
from pipeline.sources.points_storeys import Storey, find_storeys
from pipeline.sources.points_voxels import Voxels, fill
from pipeline.sources.points_walls import find_walls
from pipeline.sources.scale import UNITS
from pipeline.values import Input, Level


def find(path: str, **options: str) -> Iterator[Input]:
    """List one cloud; options ``up`` (auto, y, z) and ``units`` (auto: metres)."""
    file = Path(path)
    name = options.get("file", f"{file.absolute().parent.name}/{file.name}")
    yield Input(base_id(name), "points", str(file), options=tuple(sorted({**options, "file": name}.items())))


def read(item: Input) -> Iterator[Level]:
    """Yield the cloud's levels, lowest first.

    Raises
    ------
    Rejection
        Where it cannot be read, is too large, or has no storey.
    MissingDependencyError
        Where the library for its format is not installed.
    """
    options, path = dict(item.options), Path(item.path)
    name = options.get("file", path.name)
    units = options.get("units", "auto")
    voxels = fill(blocks(path), UNITS.get(units, 1.0), options.get("up", "auto"), path.name)
    storeys = find_storeys(voxels)
    if not storeys:
        detail = f"{name}: expected two level layers 1.9 to 6 m apart, or walls over one, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "check the up axis and the units, or give --up and --units")
    provenance = {"source": "points", "file": name, "sha256": sha256(path), "up": voxels.up}
    for number, storey in enumerate(storeys):
        yield _level(voxels, storey, level_id(item.id, number, len(storeys)), number, provenance)


def _level(voxels: Voxels, storey: Storey, name: str, number: int, provenance: dict[str, str]) -> Level:
    found = find_walls(voxels, storey)
    x, y = (float(value) for value in voxels.origin[:2])
    bodies = [prism(translate(area, -x, -y), bottom, top) for bottom, top, area in found.layers]
    sign = -1.0 if voxels.up == "y" else 1.0
    return Level(
        id=name,
        walls=united(bodies),
        ceiling_m=storey.ceiling_m - storey.floor_m - 0.02,
        frame=Frame(((1.0, 0.0, x), (0.0, sign, sign * y)), "y" if voxels.up == "y" else "z", storey.floor_m, number),
        floor=_floor(translate(found.floor, -x, -y)),
        provenance=provenance,
    )


def _floor(area: BaseGeometry) -> Polygon | MultiPolygon | None:
    shape = areas(shapely.simplify(area, 0.02))
    return shape if isinstance(shape, Polygon | MultiPolygon) and not shape.is_empty else None
