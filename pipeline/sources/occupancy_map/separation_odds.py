"""Compute the log-odds that a narrow place of a map separates two rooms: a sum of curves, one for each feature.

The features come from the measures of the narrow place (``NarrowPlaces``); ``rooms`` joins basins by the log-odds.

The log-odds are ``BIAS`` plus, for each feature, the value of its curve, which is linear between its knots and level
beyond them. The curves were fitted (logistic, ridge) on Bormann's empty maps, and on these with furniture and noise
that the project adds; ``python -m research.map_fit FOLDER`` fits them again and prints this table. No furnished and no
real map was used.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from pipeline.sources.occupancy_map.narrow_places import NarrowPlaces

Floats = npt.NDArray[np.float64]

KNOTS: Final = {
    "width_m": (0.3, 0.6, 0.9, 1.2, 1.6, 2.2, 3.0, 4.0),
    "of_lower": (0.3, 0.5, 0.65, 0.8, 0.9),
    "of_higher": (0.1, 0.25, 0.4, 0.6, 0.8),
    "smaller_m2": (1.0, 2.0, 4.0, 8.0, 16.0, 32.0),
    "thin_m": (0.05, 0.15, 0.3, 0.6, 1.0, 1.6),
    "near_m": (0.0, 0.5, 1.5, 3.0, 5.0),
    "far_m": (0.0, 0.5, 1.5, 3.0, 5.0),
    "less_m": (0.0, 0.5, 1.5, 3.0, 5.0),
}
"""The features and the knots of their curves: the width; half of it, as a share of the clearance of the less and of the
more spacious side; the area of the smaller side; and the last four of ``NarrowPlaces``."""

BIAS: Final = -0.051
CURVES: Final[dict[str, tuple[float, ...]]] = {
    "width_m": (-0.62, 0.09, 1.33, 0.91, -0.29, -0.51, -0.13, -0.84),
    "of_lower": (-0.38, 0.12, -0.07, 0.32, -0.04),
    "of_higher": (1.21, 0.57, 0.24, -0.42, -1.63),
    "smaller_m2": (-2.28, -0.90, 0.27, 0.15, 0.72, 1.99),
    "thin_m": (-0.88, 1.61, 0.84, -0.88, -0.55, -0.19),
    "near_m": (-0.37, -1.31, -0.08, 0.05, 1.66),
    "far_m": (-0.54, -0.25, -0.18, 0.02, 0.92),
    "less_m": (-0.05, -0.42, -0.42, 0.63, 0.22),
}
"""Values at the knots."""


def narrow_place_features(narrows: NarrowPlaces, peaks_m: Floats, areas_m2: Floats) -> dict[str, Floats]:
    """Return the features (n,) by name; ``peaks_m`` and ``areas_m2`` (n, 2) are those of the two sides."""
    return {
        "width_m": narrows.width_m,
        "of_lower": narrows.half_m / peaks_m.min(axis=1),
        "of_higher": narrows.half_m / peaks_m.max(axis=1),
        "smaller_m2": areas_m2.min(axis=1),
        "thin_m": narrows.thin_m,
        "near_m": narrows.near_m,
        "far_m": narrows.far_m,
        "less_m": narrows.less_m,
    }


def separation_log_odds(narrows: NarrowPlaces, peaks_m: Floats, areas_m2: Floats) -> Floats:
    """Return the log-odds (n,) that narrow places separate rooms."""
    found = narrow_place_features(narrows, peaks_m, areas_m2)
    curves = (np.interp(found[name], KNOTS[name], curve) for name, curve in CURVES.items())
    return sum(curves, np.full(len(peaks_m), BIAS))
