"""Heights to cut at: never through coplanar faces, for the plane at the top of a cube gives nothing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

CLEARANCE_M = 0.002
"""A cut keeps this far from every vertex height, where the mesh leaves room for it."""


def distinct_heights(z: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
    """Vertex heights between ``low`` and ``high`` (metres), sorted, to the millimetre."""
    inside = z[(z > low - 1e-9) & (z < high + 1e-9)]
    return np.unique(np.round(inside, 3))


def near(wanted: float, z: npt.NDArray[np.float64]) -> float:
    """Return ``wanted``, or the middle of the largest gap between vertex heights within half of it to either side.

    Parameters
    ----------
    wanted
        Height in metres above the level's floor.
    z
        (n,) vertex heights of the mesh, metres.
    """
    if not z.size or np.abs(z - wanted).min() >= CLEARANCE_M:
        return wanted
    low, high = 0.5 * wanted, 1.5 * wanted
    edges = np.concatenate([[low], distinct_heights(z, low, high), [high]])
    widest = int(np.argmax(np.diff(edges)))
    return float(edges[widest] + edges[widest + 1]) / 2


def clear_of(wanted: float, z: npt.NDArray[np.float64], *, step: float = 0.005, most: int = 20) -> float:
    """Return the height nearest to ``wanted``, in steps, that keeps its distance from every vertex height.

    A scan has a vertex at every height: there ``wanted`` itself is as good as any.
    """
    near_by = z[np.abs(z - wanted) < (most + 1) * step]
    for k in range(most):
        for height in (wanted - k * step, wanted + k * step):
            if not near_by.size or np.abs(near_by - height).min() >= CLEARANCE_M:
                return height
    return wanted


def between(z: npt.NDArray[np.float64], low: float, high: float, *, smallest_gap: float, most: int) -> list[float]:
    """Heights that see every distinct section of a mesh of upright walls between ``low`` and ``high``.

    Between two neighbouring vertex heights the section of an upright wall does not change, so the middle of each gap
    is enough: the ``most`` widest of them, the highest always among them. A scan has a vertex at every height: there,
    ``most`` evenly spaced heights stand for the gaps.
    """
    if high <= low:
        return []
    edges = np.concatenate([[low], distinct_heights(z, low, high), [high]])
    gaps = np.diff(edges)
    wide = np.flatnonzero(gaps >= smallest_gap)
    if len(wide) and gaps[wide].sum() > 0.5 * (high - low):
        others = wide[:-1][np.argsort(-gaps[wide[:-1]], kind="stable")[: most - 1]]
        return [float(edges[k] + edges[k + 1]) / 2 for k in sorted([*others, wide[-1]])]
    spread = np.linspace(low, high, most + 2)[1:-1]
    return [near_gap(float(h), edges) for h in spread]


def near_gap(wanted: float, edges: npt.NDArray[np.float64]) -> float:
    """Move a height off a vertex height by the smallest step that keeps it clear."""
    if np.abs(edges - wanted).min() >= CLEARANCE_M / 2:
        return wanted
    k = int(np.searchsorted(edges, wanted))
    above = edges[k : k + 2]
    return float(above.mean()) if len(above) == 2 else wanted + CLEARANCE_M
