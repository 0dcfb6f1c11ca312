"""Read a point cloud of rooms (.ply without faces, .pcd, .xyz, .las, .laz, .e57): yield a level for each storey.

The walls of a level are points too, the middles of voxels.

Frame: x = X, y = Y of a z-up cloud; x = X, y = -Z of a y-up one. A cloud names nothing: walls and doorways are found
by the stages, as in a scanned surface.

R1  A level is the middles of the voxels between its floor and its ceiling, with the noise of the floor and without that
    of the ceiling.

**Voxels**: a cloud is kept as the voxels that it fills, put together while its file is read.

V1  Points that are not finite are passed over; a cloud without finite points is rejected.
V2  A cloud longer than LONGEST_CLOUD_M, or with more voxels than LARGEST_GRID, is no flat. But a sensor sees through
    windows and in mirrors: the few points that lie farther are passed over, as are those beyond all others (``_near``).
V3  Up is z, unless the fullest level layer along y is clearly fuller: floors and ceilings are the largest faces.
V4  A sensor that is held askew writes a cloud that is. It is turned to where its fullest level layer is the fullest, if
    this holds FULLER times as much as before.
V5  The unit is the metre. Where the cloud is too large for metres, it is the first of the smaller units in which its
    storeys take more than half of its height.

**Storeys**, from the histogram of heights.

S1  A layer is level where it is as full as QUARTER of the fullest: floors and ceilings are, table tops are not.
S2  A storey goes from a level layer to the next one that is CLOUD_STOREY_M higher; what lies between is furniture.
S3  The noise of a ceiling hangs below it: it begins where a layer holds more than the walls do, CEILING_EDGE of theirs.
S4  Above the last layer a storey goes up to where the cloud ends: a scan without a ceiling.
S5  Below a layer that nothing lies over, a storey goes down to where the cloud ends, and as deep as the lowest storeys
    are at least: a sensor that sees no floor. The layers of its walls hold far less, or it is no ceiling. A floor that
    lies below the cloud is a guess.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import KEY as LEFT_OUT
from pipeline.sources.files import input_from_file, level_id
from pipeline.sources.points_file import read_blocks
from pipeline.sources.storeys.scale import UNITS, said_size
from pipeline.sources.tolerances import (
    CEILING_EDGE,
    CLOUD_STOREY_M,
    CLOUD_TOP,
    FEWEST_VOXELS,
    FULLER,
    LARGEST_GRID,
    LONGEST_CLOUD_M,
    LOWEST_HEAD_M,
    QUARTER,
    STRAY,
    STRAY_M,
    THICKEST_SLAB_M,
    VOXEL_M,
    WALLS_ONLY_M,
)
from pipeline.tolerances import HAND_M, THIN_WALL_M
from pipeline.values import Input, Level, Mesh

TILT_SAMPLE = 20_000
TILTS = ((0.2, 12.0, 2.0), (0.1, 2.0, 1.0), (0.06, 1.0, 0.5), (0.06, 0.5, 0.25))
"""Searches for the tilt, each about what the one before found: layers so thick (m), so far, in such steps (degrees)."""
SMALLER_UNITS = ("cm", "mm")
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
    turn: npt.NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    """(3, 3): how the plan's axes and up lie in the cloud's, row by row (V4)."""

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
            if len(keys) > LARGEST_GRID:
                raise _too_large(name, len(keys))
    if far > STRAY * seen:
        detail = f"{name} has points {farthest:.4g} m from its middle, expected {LONGEST_CLOUD_M:.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "cut the flat out, or give --units")
    keys = np.unique(np.concatenate([keys, *waiting]))
    if origin is None:
        reason, what = (Reason.NOT_FINITE, "no point that is finite") if seen else (Reason.EMPTY, "no point")
        raise Rejection("source", reason, f"{name} has {what}", "export the cloud again")
    if len(keys) > LARGEST_GRID:
        raise _too_large(name, len(keys))
    if len(keys) < FEWEST_VOXELS:
        detail = f"{name} fills {len(keys):,} voxels of 2 cm, expected {FEWEST_VOXELS} at least"
        raise Rejection("source", Reason.EMPTY, detail, "give a scan of a room")
    mask = (1 << _BITS) - 1
    index3 = np.column_stack([keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask]) - _HALF
    near = _drop_strays(index3.astype(np.int32))
    return _level_out(_turn_upright(near, origin, up, far + len(index3) - len(near)))


def _drop_strays(index: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """V2: voxels no farther than STRAY_M from where, along each axis, all but STRAY of them lie."""
    low, high = np.quantile(index, (STRAY / 2, 1 - STRAY / 2), axis=0)
    beside = STRAY_M / VOXEL_M
    near: npt.NDArray[np.bool_] = ((index >= low - beside) & (index <= high + beside)).all(axis=1)
    return index[near]


def _turn_upright(index: npt.NDArray[np.int32], origin: npt.NDArray[np.float64], up: str, far: int) -> Voxels:
    """V3; a y-up cloud is turned by a quarter about x, so that y = -Z."""
    axis = up if up in {"y", "z"} else "y" if _fullest(index[:, 1]) > FULLER * _fullest(index[:, 2]) else "z"
    if axis == "z":
        return Voxels(index, origin, "z", far)
    turned = np.column_stack([index[:, 0], -1 - index[:, 2], index[:, 1]])
    return Voxels(turned, np.array([origin[0], -origin[2], origin[1]]), "y", far)


def _level_out(voxels: Voxels) -> Voxels:
    """V4."""
    points = voxels.centres()
    tried = points[:: max(1, len(points) // TILT_SAMPLE)] - voxels.origin
    up = np.array([0.0, 0.0, 1.0])
    for layer_m, most_deg, step_deg in TILTS:
        slopes = np.tan(np.deg2rad(np.arange(-most_deg, most_deg + step_deg / 2, step_deg)))
        ways = [up + np.array([x, y, 0.0]) for x in slopes for y in slopes]
        ways.sort(key=lambda way: float(np.hypot(way[0], way[1])))  # of equals, the one that is turned least
        up = max(ways, key=lambda way: _fullest_layer(tried @ (way / np.linalg.norm(way)), layer_m))
    up /= np.linalg.norm(up)
    layer_m = TILTS[-1][0]
    if _fullest_layer(tried @ up, layer_m) < FULLER * _fullest_layer(tried[:, 2], layer_m):
        return voxels
    axis = np.cross(up, (0.0, 0.0, 1.0))
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn = np.eye(3) + skew + skew @ skew / (1.0 + up[2])
    level = points @ turn.T
    origin = np.floor(level.min(axis=0))
    index = np.unique(np.floor((level - origin) / VOXEL_M).astype(np.int32), axis=0)
    return replace(voxels, index=index, origin=origin, turn=turn)


def _fullest_layer(heights: npt.NDArray[np.float64], layer_m: float) -> int:
    """Return how many heights the fullest layer, so many metres thick, holds."""
    return _fullest(np.floor((heights - heights.min()) * (3.0 / layer_m)).astype(np.int32))


def _fullest(layer: npt.NDArray[np.int32]) -> int:
    counts = np.bincount(layer - layer.min())
    return int(np.convolve(counts, np.ones(3, np.int64), mode="same").max())


def _too_large(name: str, count: int) -> Rejection:
    detail = f"{name} fills {count:,} voxels of 2 cm, expected {LARGEST_GRID:,} at most"
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
            k += 1 if k + 1 < len(peaks) and peaks[k + 1] - over < THICKEST_SLAB_M / VOXEL_M else 0
        else:
            if not found and top >= least:  # S4
                found.append((peaks[k], min(top, most)))
            k += 1
    if not found and peaks and top - peaks[-1] < HAND_M / VOXEL_M:  # S5
        lowest = round(float(np.quantile(z - low, 1 - CLOUD_TOP)))
        depth = (peaks[-1] - lowest) * VOXEL_M
        walls = float(np.median(counts[lowest : peaks[-1]])) if depth > 0 else np.inf
        if LOWEST_HEAD_M <= depth <= CLOUD_STOREY_M[1] and walls < QUARTER * counts[peaks[-1]]:
            found.append((peaks[-1] - round(max(depth, CLOUD_STOREY_M[0]) / VOXEL_M), peaks[-1]))
    bottom = float(voxels.origin[2]) + (low + 0.5) * VOXEL_M
    plain = np.bincount(z - low, minlength=len(counts))
    return [
        StoreyHeights(bottom + _middle(plain, floor) * VOXEL_M, bottom + _edge(plain, floor, ceiling) * VOXEL_M)
        for floor, ceiling in found
    ]


def _peaks(counts: np.ndarray) -> list[int]:
    """S1: the fullest layer of each run of full ones, lowest first."""
    full = np.flatnonzero(counts >= QUARTER * counts.max())
    # full layers that are farther apart in height are two
    runs = np.split(full, np.flatnonzero(np.diff(full) > HAND_M / VOXEL_M) + 1)
    return [int(run[np.argmax(counts[run])]) for run in runs]


def _edge(counts: np.ndarray, floor: float, ceiling: float) -> float:
    """S3."""
    low, high = max(0, round(floor)), min(round(ceiling), len(counts) - 1)
    margin = round(WALLS_ONLY_M / VOXEL_M)
    usual = float(np.median(counts[low + margin : high - margin]))
    below = np.arange(high - round(THIN_WALL_M / VOXEL_M), high + 1)
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
    units, scale = said_size(options)
    wish = None if units is None and scale == 1.0 else (units or 1.0) * scale
    voxels, storeys, guesses, unit_m = _measure(path, wish, options.get("up", "auto"))
    if not storeys:
        detail = f"{name}: expected two level layers 1.9 to 6 m apart, or walls over one, found none"
        raise Rejection("source", Reason.NO_LEVEL, detail, "check the up axis and the units, or give --up and --units")
    provenance = {"source": "points", "file": name, "sha256": sha256_of(path), "up": voxels.up}
    if voxels.far:
        provenance[LEFT_OUT] = f"{voxels.far:,} points or voxels of 2 cm far from all others"
    for number, storey in enumerate(storeys):
        made = _level(voxels, storey, level_id(item.id, number, len(storeys)), number, provenance)
        yield replace(made, guesses=guesses, unit_m=unit_m)


def _measure(path: Path, metres: float | None, up: str) -> tuple[Voxels, list[StoreyHeights], tuple[str, ...], float]:
    """V5: return the voxels, the storeys, what was guessed, and metres in a unit; raises as ``fill_voxels``."""
    try:
        voxels = fill_voxels(read_blocks(path), metres or 1.0, up, path.name)
        storeys = find_storeys(voxels)
        return voxels, storeys, _guessed_floor(voxels, storeys), metres or 1.0
    except Rejection as rejection:
        if metres is not None or rejection.reason is not Reason.BAD_UNITS:
            raise
        for smaller in SMALLER_UNITS:
            with suppress(Rejection):
                voxels = fill_voxels(read_blocks(path), UNITS[smaller], up, path.name)
                storeys = find_storeys(voxels)
                if sum(storey.ceiling_m - storey.floor_m for storey in storeys) > _height(voxels) / 2:
                    return voxels, storeys, ("units", *_guessed_floor(voxels, storeys)), UNITS[smaller]
        raise


def _guessed_floor(voxels: Voxels, storeys: list[StoreyHeights]) -> tuple[str, ...]:
    """S5."""
    z = voxels.index[:, 2]
    begins = float(voxels.origin[2]) + float(np.quantile(z, 1 - CLOUD_TOP)) * VOXEL_M
    # a ceiling has so much noise below it
    return ("floor",) if storeys and storeys[0].floor_m < begins - THIN_WALL_M else ()


def _height(voxels: Voxels) -> float:
    """Return how high a cloud is, without what lies over its top."""
    return float(np.quantile(voxels.index[:, 2], CLOUD_TOP) - voxels.index[:, 2].min()) * VOXEL_M


def _level(voxels: Voxels, storey: StoreyHeights, name: str, number: int, provenance: dict[str, str]) -> Level:
    """Return the level of the voxels between a floor and its ceiling, without the ceiling's noise."""
    x, y, _ = (float(value) for value in voxels.origin)
    (a, b), (c, d) = voxels.turn.T[:2, :2].tolist()
    at = (voxels.turn.T @ (x, y, storey.floor_m)).tolist() if a < 1.0 else (x, y)
    points = voxels.centres() - (x, y, storey.floor_m)
    clear = storey.ceiling_m - storey.floor_m
    sign = -1.0 if voxels.up == "y" else 1.0
    return Level(
        id=name,
        # the noise of a floor lies below it
        walls=Mesh(points[(points[:, 2] > -HAND_M) & (points[:, 2] < clear)], np.empty((0, 3), np.int64)),
        ceiling_m=clear,
        frame=Frame(
            ((a, b, at[0]), (sign * c, sign * d, sign * at[1])),
            "y" if voxels.up == "y" else "z",
            storey.floor_m,
            number,
        ),
        provenance=provenance,
    )
