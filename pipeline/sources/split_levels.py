"""The storeys of a split level: halves of a house whose floors lie at heights of their own, half a storey apart."""

from __future__ import annotations

import numpy as np

from pipeline.sources.surfaces import Bools, Floats, Surfaces, weighted_quantile

MAX_LAYERS = 60  # a house of scanned faces has level ones at every height
EDGE = 0.02  # of a layer's area, on each side: a stair or a sill beside it
SAME_PLACE = 0.6  # of what two layers cover together
ELSEWHERE = 0.2  # of the smaller one


def storeys_apart(
    surfaces: Surfaces, flats: Bools, axis: int, layers: Floats, step: float
) -> list[tuple[float, float]]:
    """Pairs of heights of one place (a floor, and the ceiling over it) that only layers of other places lie between.

    ``layers`` are the heights of the level faces that cover the plan, rising, each ``step`` high.
    """
    if not 2 < len(layers) <= MAX_LAYERS:
        return []
    plan = [i for i in range(3) if i != axis]
    heights = (surfaces.low[:, axis] + surfaces.high[:, axis]) / 2
    near = [np.flatnonzero(flats & (np.abs(heights - layer) <= step)) for layer in layers]
    boxes = [_box(surfaces, faces, plan) for faces in near]
    found = []
    for low, box in enumerate(boxes):
        for high in range(low + 1, len(boxes)):
            if _shared(box, boxes[high]) > ELSEWHERE:
                if high > low + 1 and _shared(box, boxes[high], together=True) > SAME_PLACE:
                    found.append((float(layers[low]), float(layers[high])))
                break
    return found


def _box(surfaces: Surfaces, faces: np.ndarray, plan: list[int]) -> Floats:
    """Plan bounds (2, 2), low and high, of all but the edges of a layer."""
    area = surfaces.area[faces]
    low = [weighted_quantile(surfaces.low[faces, i], area, EDGE) for i in plan]
    return np.array([low, [weighted_quantile(surfaces.high[faces, i], area, 1 - EDGE) for i in plan]])


def _shared(one: Floats, other: Floats, *, together: bool = False) -> float:
    """Which share of the smaller of two boxes lies in both, or of all that they cover ``together``."""
    both = float(np.prod(np.maximum(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]), 0.0)))
    areas = [max(float(np.prod(box[1] - box[0])), 1e-12) for box in (one, other)]
    return both / (sum(areas) - both if together else min(areas))
