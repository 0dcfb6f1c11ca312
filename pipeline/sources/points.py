"""Read a point cloud of rooms (.ply without faces, .pcd, .xyz, .las, .laz, .e57): yield a level for each storey.

The walls of a level are points too, the middles of voxels.

Frame: x = X, y = Y of a z-up cloud; x = X, y = -Z of a y-up one. A cloud names nothing: walls and doorways are found
by the stages, as in a scanned surface.

R1  A level is the middles of the voxels between its floor and its ceiling, with the noise of the floor and without that
    of the ceiling.

**Voxels**: a cloud is kept as the voxels that it fills, put together while its file is read.

V1  Points that are not finite are passed over; a cloud of nothing else is none.
V2  A cloud longer than LONGEST_CLOUD_M, or with more than MAX_VOXELS, is no flat. But a sensor sees through windows and
    in mirrors: the few points that lie farther are passed over, and so are those beyond all others (``_near``).
V3  Up is z, unless the fullest level layer along y is clearly fuller: floors and ceilings are the largest faces.

**Storeys**, from the histogram of heights.

S1  A layer is level where it is as full as LEVEL_LAYER of the fullest: floors and ceilings are, table tops are not.
S2  A storey goes from a level layer to the next one that is CLOUD_STOREY_M higher; what lies between is furniture.
S3  The noise of a ceiling hangs below it: it begins where a layer holds more than the walls do, CEILING_EDGE of theirs.
S4  Above the last layer a storey goes up to where the cloud ends: a scan without a ceiling.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import KEY as LEFT_OUT
from pipeline.sources.files import input_from_file, level_id
from pipeline.sources.points_file import read_blocks
from pipeline.sources.storeys.scale import metres_per_unit
from pipeline.sources.tolerances import (
    CEILING_EDGE,
    CEILING_NOISE_M,
    CLOUD_STOREY_M,
    CLOUD_TOP,
    FEWEST_VOXELS,
    FLOOR_NOISE_M,
    LAYER_APART_M,
    LEVEL_LAYER,
    LONGEST_CLOUD_M,
    SLAB_BETWEEN_M,
    STRAY,
    STRAY_M,
    VOXEL_M,
    WALLS_ONLY_M,
    Y_IS_UP,
)
from pipeline.values import Input, Level, Mesh

MAX_VOXELS = 30_000_000
_BITS = 20
_HALF = 1 << (_BITS - 1)


@dataclass(frozen=True, eq=False)
class Voxels:
    """Filled voxels by index (n, 3), x and y in the plan and z up; ``origin`` is voxel 0's corner in metres."""

    index: npt.NDArray[np.int32]
    origin: npt.NDArray[np.float64]
    up: str
    far: int = 0
    """How many voxels, or points beyond LONGEST_CLOUD_M, were passed over (V2)."""

    def centres(self) -> npt.NDArray[np.float64]:
        """Middles (n, 3) in metres, in the plan's axes."""
        return self.origin + (self.index + 0.5) * VOXEL_M


def fill_voxels(blocks: Iterable[npt.NDArray[np.float64]], metres: float, up: str, name: str) -> Voxels:
    """Read points (n, 3) in a unit of ``metres``; raises Rejection (EMPTY, NOT_FINITE, TOO_LARGE, BAD_UNITS)."""
    origin: npt.NDArray[np.float64] | None = None
    keys = np.empty(0, np.int64)
    waiting: list[npt.NDArray[np.int64]] = []
    seen, far, farthest = 0, 0, 0.0
    for block in blocks:
        seen += len(block)
        points = block[np.isfinite(block).all(axis=1)] * metres  # V1
        if not len(points):
            continue
        if origin is None:
            origin = np.floor(np.median(points, axis=0))
        index = np.floor((points - origin) / VOXEL_M)
        away = np.abs(index).max(axis=1) * VOXEL_M > LONGEST_CLOUD_M  # V2
        far += int(away.sum())
        farthest = max(farthest, float(np.abs(index).max() * VOXEL_M))
        index = index[~away]
        packed = (index.astype(np.int64) + _HALF) @ np.array([1 << (2 * _BITS), 1 << _BITS, 1])
        waiting.append(np.unique(packed))
        if sum(map(len, waiting)) > max(len(keys), 4_000_000):
            keys, waiting = np.unique(np.concatenate([keys, *waiting])), []
            if len(keys) > MAX_VOXELS:
                raise _too_large(name, len(keys))
    if far > STRAY * seen:
        detail = f"{name} has points {farthest:.4g} m from its middle, expected {LONGEST_CLOUD_M:.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "cut the flat out, or give --units")
    keys = np.unique(np.concatenate([keys, *waiting]))
    if origin is None:
        reason, what = (Reason.NOT_FINITE, "no point that is finite") if seen else (Reason.EMPTY, "no point")
        raise Rejection("source", reason, f"{name} has {what}", "export the cloud again")
    if len(keys) > MAX_VOXELS:
        raise _too_large(name, len(keys))
    if len(keys) < FEWEST_VOXELS:
        detail = f"{name} fills {len(keys):,} voxels of 2 cm, expected {FEWEST_VOXELS} at least"
        raise Rejection("source", Reason.EMPTY, detail, "give a scan of a room")
    mask = (1 << _BITS) - 1
    index3 = np.column_stack([keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask]) - _HALF
    near = _drop_strays(index3.astype(np.int32))
    return _turn_upright(near, origin, up, far + len(index3) - len(near))


def _drop_strays(index: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """V2: voxels no farther than STRAY_M from where, along each axis, all but STRAY of them lie."""
    low, high = np.quantile(index, (STRAY / 2, 1 - STRAY / 2), axis=0)
    beside = STRAY_M / VOXEL_M
    near: npt.NDArray[np.bool_] = ((index >= low - beside) & (index <= high + beside)).all(axis=1)
    return index[near]


def _turn_upright(index: npt.NDArray[np.int32], origin: npt.NDArray[np.float64], up: str, far: int) -> Voxels:
    """V3; a y-up cloud is turned by a quarter about x, so that y = -Z."""
    axis = up if up in {"y", "z"} else "y" if _fullest(index[:, 1]) > Y_IS_UP * _fullest(index[:, 2]) else "z"
    if axis == "z":
        return Voxels(index, origin, "z", far)
    turned = np.column_stack([index[:, 0], -1 - index[:, 2], index[:, 1]])
    return Voxels(turned, np.array([origin[0], -origin[2], origin[1]]), "y", far)


def _fullest(layer: npt.NDArray[np.int32]) -> int:
    counts = np.bincount(layer - layer.min())
    return int(np.convolve(counts, np.ones(3, np.int64), mode="same").max())


def _too_large(name: str, count: int) -> Rejection:
    detail = f"{name} fills {count:,} voxels of 2 cm, expected {MAX_VOXELS:,} at most"
    return Rejection("source", Reason.TOO_LARGE, detail, "cut the flat out of the cloud")


@dataclass(frozen=True)
class StoreyHeights:
    """Heights in metres; ``ceiling_m`` is where the points of the ceiling begin."""

    floor_m: float
    ceiling_m: float


def find_storeys(voxels: Voxels) -> list[StoreyHeights]:
    """Return the storeys, lowest first; empty where nothing is as high as one."""
    z = voxels.index[:, 2]
    low = int(z.min())
    counts = np.convolve(np.bincount(z - low), np.ones(3), mode="same")
    peaks = _peaks(counts)
    top = float(np.quantile(z - low, CLOUD_TOP))
    found: list[tuple[int, float]] = []
    k = 0
    while k < len(peaks):
        least, most = peaks[k] + CLOUD_STOREY_M[0] / VOXEL_M, peaks[k] + CLOUD_STOREY_M[1] / VOXEL_M
        over = next((p for p in peaks[k + 1 :] if least <= p <= most), None)
        if over is not None:  # S2
            found.append((peaks[k], over))
            k = peaks.index(over)
            k += 1 if k + 1 < len(peaks) and peaks[k + 1] - over < SLAB_BETWEEN_M / VOXEL_M else 0
        else:
            if not found and top >= least:  # S4
                found.append((peaks[k], min(top, most)))
            k += 1
    bottom = float(voxels.origin[2]) + (low + 0.5) * VOXEL_M
    plain = np.bincount(z - low, minlength=len(counts))
    return [
        StoreyHeights(bottom + _middle(plain, floor) * VOXEL_M, bottom + _edge(plain, floor, ceiling) * VOXEL_M)
        for floor, ceiling in found
    ]


def _peaks(counts: np.ndarray) -> list[int]:
    """S1: the fullest layer of each run of full ones, lowest first."""
    full = np.flatnonzero(counts >= LEVEL_LAYER * counts.max())
    runs = np.split(full, np.flatnonzero(np.diff(full) > LAYER_APART_M / VOXEL_M) + 1)
    return [int(run[np.argmax(counts[run])]) for run in runs]


def _edge(counts: np.ndarray, floor: float, ceiling: float) -> float:
    """S3."""
    low, high = round(floor), min(round(ceiling), len(counts) - 1)
    margin = round(WALLS_ONLY_M / VOXEL_M)
    usual = float(np.median(counts[low + margin : high - margin]))
    below = np.arange(high - round(CEILING_NOISE_M / VOXEL_M), high + 1)
    full = below[counts[below] > CEILING_EDGE * usual]
    return float(full[0]) - 0.5 if len(full) else high + 0.5


def _middle(counts: np.ndarray, layer: float) -> float:
    """Return the middle of what a layer and its neighbours hold: floors are noisy, and lie between two layers."""
    near = np.arange(max(0, round(layer) - 2), min(len(counts), round(layer) + 3))
    return float(np.average(near, weights=counts[near])) if counts[near].any() else layer


def find(path: str, **options: str) -> Iterator[Input]:
    """List one cloud; options ``up`` (auto, y, z) and ``units`` (auto: metres)."""
    yield input_from_file(path, "points", options)


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
    voxels = fill_voxels(read_blocks(path), metres_per_unit(units) or 1.0, options.get("up", "auto"), path.name)
    storeys = find_storeys(voxels)
    if not storeys:
        detail = f"{name}: expected two level layers 1.9 to 6 m apart, or walls over one, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "check the up axis and the units, or give --up and --units")
    provenance = {"source": "points", "file": name, "sha256": sha256_of(path), "up": voxels.up}
    if voxels.far:
        provenance[LEFT_OUT] = f"{voxels.far:,} points or voxels of 2 cm far from all others"
    for number, storey in enumerate(storeys):
        yield _level(voxels, storey, level_id(item.id, number, len(storeys)), number, provenance)


def _level(voxels: Voxels, storey: StoreyHeights, name: str, number: int, provenance: dict[str, str]) -> Level:
    """R1."""
    x, y, _ = (float(value) for value in voxels.origin)
    points = voxels.centres() - (x, y, storey.floor_m)
    clear = storey.ceiling_m - storey.floor_m
    sign = -1.0 if voxels.up == "y" else 1.0
    return Level(
        id=name,
        walls=Mesh(points[(points[:, 2] > -FLOOR_NOISE_M) & (points[:, 2] < clear)], np.empty((0, 3), np.int64)),
        ceiling_m=clear,
        frame=Frame(((1.0, 0.0, x), (0.0, sign, sign * y)), "y" if voxels.up == "y" else "z", storey.floor_m, number),
        provenance=provenance,
    )
