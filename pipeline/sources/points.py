"""Point clouds of a room or a flat (.ply without faces, .pcd, .xyz, .las, .laz, .e57): a level for each storey.

Frame: x = X, y = Y of a z-up cloud; x = X, y = -Z of a y-up one. A cloud names nothing: walls and doorways are found by
the stages, as in a scanned surface.

R1  A level is the middles of the voxels between its floor and its ceiling, with the noise of the floor and without that
    of the ceiling.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.left_out import KEY as LEFT_OUT
from pipeline.sources.naming import level_id, single_input
from pipeline.sources.points_file import blocks
from pipeline.sources.points_storeys import Storey, find_storeys
from pipeline.sources.points_voxels import Voxels, fill
from pipeline.sources.sizes import metres_of
from pipeline.values import Input, Level, Mesh

NOISE_M = 0.1
"""Noise of a floor lies so far below it."""


def find(path: str, **options: str) -> Iterator[Input]:
    """List one cloud; options ``up`` (auto, y, z) and ``units`` (auto: metres)."""
    yield single_input(path, "points", options)


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
    voxels = fill(blocks(path), metres_of(units) or 1.0, options.get("up", "auto"), path.name)
    storeys = find_storeys(voxels)
    if not storeys:
        detail = f"{name}: expected two level layers 1.9 to 6 m apart, or walls over one, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "check the up axis and the units, or give --up and --units")
    provenance = {"source": "points", "file": name, "sha256": sha256_of(path), "up": voxels.up}
    if voxels.far:
        provenance[LEFT_OUT] = f"{voxels.far:,} points or voxels of 2 cm far from all others"
    for number, storey in enumerate(storeys):
        yield _level(voxels, storey, level_id(item.id, number, len(storeys)), number, provenance)


def _level(voxels: Voxels, storey: Storey, name: str, number: int, provenance: dict[str, str]) -> Level:
    """R1."""
    x, y, _ = (float(value) for value in voxels.origin)
    points = voxels.centres() - (x, y, storey.floor_m)
    clear = storey.ceiling_m - storey.floor_m
    sign = -1.0 if voxels.up == "y" else 1.0
    return Level(
        id=name,
        walls=Mesh(points[(points[:, 2] > -NOISE_M) & (points[:, 2] < clear)], np.empty((0, 3), np.int64)),
        ceiling_m=clear,
        frame=Frame(((1.0, 0.0, x), (0.0, sign, sign * y)), "y" if voxels.up == "y" else "z", storey.floor_m, number),
        provenance=provenance,
    )
