"""The storeys of a cloud by its height histogram.

R1  A layer is level where it is as full as STRONG of the fullest: floors and ceilings are, table tops are not.
R2  A storey goes from a level layer to the next one that is STOREY_M higher; what lies between is furniture.
R3  The noise of a ceiling hangs below it: it begins where a layer holds more than the walls do, EDGE of theirs.
R4  Above the last layer a storey goes up to where the cloud ends: a scan without a ceiling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.sources.points_voxels import VOXEL_M, Voxels

STRONG = 0.25
STOREY_M = (1.9, 6.0)
SHARE = 0.995
EDGE, MARGIN_M, NOISE_M = 1.6, 0.4, 0.16


@dataclass(frozen=True)
class Storey:
    """Heights in metres; ``ceiling_m`` is where the points of the ceiling begin."""

    floor_m: float
    ceiling_m: float


def find_storeys(voxels: Voxels) -> list[Storey]:
    """Return the storeys, lowest first; empty where nothing is as high as one."""
    z = voxels.index[:, 2]
    low = int(z.min())
    counts = np.convolve(np.bincount(z - low), np.ones(3), mode="same")
    peaks = _peaks(counts)
    top = float(np.quantile(z - low, SHARE))
    found: list[tuple[int, float]] = []
    k = 0
    while k < len(peaks):
        least, most = peaks[k] + STOREY_M[0] / VOXEL_M, peaks[k] + STOREY_M[1] / VOXEL_M
        over = next((p for p in peaks[k + 1 :] if least <= p <= most), None)
        if over is not None:  # R2
            found.append((peaks[k], over))
            k = peaks.index(over)
            k += 1 if k + 1 < len(peaks) and peaks[k + 1] - over < 0.8 / VOXEL_M else 0
        else:
            if not found and top >= least:  # R4
                found.append((peaks[k], min(top, most)))
            k += 1
    bottom = float(voxels.origin[2]) + (low + 0.5) * VOXEL_M
    plain = np.bincount(z - low, minlength=len(counts))
    return [
        Storey(bottom + _middle(plain, floor) * VOXEL_M, bottom + _edge(plain, floor, ceiling) * VOXEL_M)
        for floor, ceiling in found
    ]


def _peaks(counts: np.ndarray) -> list[int]:
    """R1: the fullest layer of each run of full ones, lowest first."""
    full = np.flatnonzero(counts >= STRONG * counts.max())
    runs = np.split(full, np.flatnonzero(np.diff(full) > 0.1 / VOXEL_M) + 1)
    return [int(run[np.argmax(counts[run])]) for run in runs]


def _edge(counts: np.ndarray, floor: float, ceiling: float) -> float:
    """R3."""
    low, high = round(floor), min(round(ceiling), len(counts) - 1)
    margin = round(MARGIN_M / VOXEL_M)
    usual = float(np.median(counts[low + margin : high - margin]))
    below = np.arange(high - round(NOISE_M / VOXEL_M), high + 1)
    full = below[counts[below] > EDGE * usual]
    return float(full[0]) - 0.5 if len(full) else high + 0.5


def _middle(counts: np.ndarray, layer: float) -> float:
    """The middle of what a layer and its neighbours hold: floors are noisy, and lie between two layers."""
    near = np.arange(max(0, round(layer) - 2), min(len(counts), round(layer) + 3))
    return float(np.average(near, weights=counts[near])) if counts[near].any() else layer
