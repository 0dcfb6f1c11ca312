"""Compute the log-odds that a narrow place of a map separates two rooms: a sum of curves, one for each feature.

The features come from the measures of the narrow place (``NarrowPlaces``); ``rooms`` joins basins by the log-odds.

The log-odds are ``SEPARATION_BIAS`` plus, for each feature, the value of its curve, which is linear between its knots
and level beyond them. The curves were fitted (logistic, ridge) on Bormann's empty maps, on these with furniture and
noise that the project adds, and on maps that PseudoSLAM makes of them and of plans; ``python -m research.map_fit FOLDER
--plans FILE`` fits them again and prints this table. No furnished and no real map was used.
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
    "stub_m": (-0.1, 0.0, 0.1, 0.2, 0.4),
    "step_m": (0.0, 0.3, 0.8, 1.5, 3.0),
    "least_m": (-0.1, 0.0, 0.1, 0.2, 0.4, 0.8, 1.5),
    "turn_m": (-0.1, 0.0, 0.1, 0.2, 0.4, 0.8, 1.5),
}
"""The features and the knots of their curves: the width; half of it, as a share of the clearance of the less and of the
more spacious side; the area of the smaller side; and the others of ``NarrowPlaces``."""

SEPARATION_BIAS: Final = 0.134
CURVES: Final[dict[str, tuple[float, ...]]] = {
    "width_m": (-0.15, 0.69, 1.30, 0.72, -0.31, -0.48, -0.55, -1.08),
    "of_lower": (-0.59, 0.28, 0.01, 0.40, 0.02),
    "of_higher": (1.50, 0.80, 0.23, -0.71, -1.69),
    "smaller_m2": (-2.29, -0.79, 0.32, 0.20, 0.86, 1.82),
    "thin_m": (-0.61, 1.93, 1.12, -0.93, -0.63, -0.74),
    "near_m": (-0.14, -0.67, 0.16, 0.15, 0.63),
    "far_m": (-0.16, -0.25, -0.03, -0.14, 0.71),
    "less_m": (-0.03, 0.06, -0.27, 0.49, -0.11),
    "stub_m": (0.33, 0.62, -0.02, -0.31, -0.49),
    "step_m": (0.74, -0.75, -0.05, 0.36, -0.19),
    "least_m": (-0.52, -1.07, -0.50, -0.10, 1.31, 0.70, 0.30),
    "turn_m": (-0.22, -0.44, 0.44, 0.38, -0.85, -0.05, 0.86),
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
        "stub_m": narrows.stub_m,
        "step_m": narrows.step_m,
        "least_m": narrows.least_m,
        "turn_m": narrows.turn_m,
    }


def separation_log_odds(narrows: NarrowPlaces, peaks_m: Floats, areas_m2: Floats) -> Floats:
    """Return the log-odds (n,) that narrow places separate rooms."""
    found = narrow_place_features(narrows, peaks_m, areas_m2)
    curves = (np.interp(found[name], KNOTS[name], curve) for name, curve in CURVES.items())
    return sum(curves, np.full(len(peaks_m), SEPARATION_BIAS))
