"""A point cloud as the voxels that it fills, put together while its file is read.

R1  Points that are not finite are passed over; a cloud of nothing else is none.
R2  A cloud longer than LONGEST_M, or with more than MAX_VOXELS, is no flat. But a sensor sees through windows and in
    mirrors: the few points that lie farther are passed over, and so are those that lie beyond all others (``_near``).
R3  Up is z, unless the fullest level layer along y is clearly fuller: floors and ceilings are the largest faces.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection

VOXEL_M = 0.02
LONGEST_M = 200.0
FEWEST_VOXELS = 500
FEW = 0.002  # of all points, or voxels
BESIDE_M = 4.0
MAX_VOXELS = 30_000_000
Y_UP = 1.4
_BITS = 20
_HALF = 1 << (_BITS - 1)


@dataclass(frozen=True, eq=False)
class Voxels:
    """Filled voxels by index (n, 3), x and y in the plan and z up; ``origin`` is voxel 0's corner in metres."""

    index: npt.NDArray[np.int32]
    origin: npt.NDArray[np.float64]
    up: str
    far: int = 0
    """How many voxels, or points beyond LONGEST_M, were passed over (R2)."""

    def centres(self) -> npt.NDArray[np.float64]:
        """Middles (n, 3) in metres, in the plan's axes."""
        return self.origin + (self.index + 0.5) * VOXEL_M


def fill(blocks: Iterable[npt.NDArray[np.float64]], metres: float, up: str, name: str) -> Voxels:
    """Read points (n, 3) in a unit of ``metres``; raises Rejection (EMPTY, NOT_FINITE, TOO_LARGE, BAD_UNITS)."""
    origin: npt.NDArray[np.float64] | None = None
    keys = np.empty(0, np.int64)
    waiting: list[npt.NDArray[np.int64]] = []
    seen, far, farthest = 0, 0, 0.0
    for block in blocks:
        seen += len(block)
        points = block[np.isfinite(block).all(axis=1)] * metres  # R1
        if not len(points):
            continue
        if origin is None:
            origin = np.floor(np.median(points, axis=0))
        index = np.floor((points - origin) / VOXEL_M)
        away = np.abs(index).max(axis=1) * VOXEL_M > LONGEST_M  # R2
        far += int(away.sum())
        farthest = max(farthest, float(np.abs(index).max() * VOXEL_M))
        index = index[~away]
        packed = (index.astype(np.int64) + _HALF) @ np.array([1 << (2 * _BITS), 1 << _BITS, 1])
        waiting.append(np.unique(packed))
        if sum(map(len, waiting)) > max(len(keys), 4_000_000):
            keys, waiting = np.unique(np.concatenate([keys, *waiting])), []
            if len(keys) > MAX_VOXELS:
                raise _too_large(name, len(keys))
    if far > FEW * seen:
        detail = f"{name} has points {farthest:.4g} m from its middle, expected {LONGEST_M:.0f} m at most"
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
    near = _near(index3.astype(np.int32))
    return _upright(near, origin, up, far + len(index3) - len(near))


def _near(index: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """R2: voxels no farther than BESIDE_M from where, along each axis, all but FEW of them lie."""
    low, high = np.quantile(index, (FEW / 2, 1 - FEW / 2), axis=0)
    beside = BESIDE_M / VOXEL_M
    near: npt.NDArray[np.bool_] = ((index >= low - beside) & (index <= high + beside)).all(axis=1)
    return index[near]


def _upright(index: npt.NDArray[np.int32], origin: npt.NDArray[np.float64], up: str, far: int) -> Voxels:
    """R3; a y-up cloud is turned by a quarter about x, so that y = -Z."""
    axis = up if up in {"y", "z"} else "y" if _fullest(index[:, 1]) > Y_UP * _fullest(index[:, 2]) else "z"
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
