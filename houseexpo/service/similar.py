"""Plans that look like one: those of like size are compared cell by cell, under the symmetries of the square.

1. The plans nearest in area, sides and rooms are candidates.
2. Fingerprints (``analysis.similarity``) bound how much two plans differ from below; the least bounds come first.
3. Of those the difference is found on a grid of 0.1 m; plans that differ by more than half are not alike.
4. A candidate that was deleted or damaged while it is shown is left out.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from houseexpo.analysis.similarity import compare, comparison_mask, fingerprint, lower_bound
from houseexpo.errors import HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.service.collection import Opened

_CANDIDATES: Final = 120
_COMPARED: Final = 24
_PIXELS_PER_METRE: Final = 10.0
_MAX_DIFFERENCE: Final = 0.5
_FINGERPRINT: Final = "fingerprint, 3"
"""The name under which fingerprints are cached; another way of computing them needs another number."""


def similar(now: Opened, plan_id: str, most: int = 8) -> list[dict[str, Any]]:
    """Return the plans most like one: id, title, difference (0: the same; 1: nothing in common) and symmetry.

    UnknownPlanError where there is no plan of that id.
    """
    plan, table = now.plan(plan_id), now.views.table
    row = now.numbers[plan_id]
    columns = [_scaled(table.numbers(name), row) for name in ("area", "long_side", "short_side", "rooms")]
    far = np.sum(np.nan_to_num(np.stack(columns), nan=1.0) ** 2, axis=0)
    far[row] = np.inf
    near = np.argsort(far, kind="stable")[:_CANDIDATES]
    near = near[np.isfinite(far[near])]
    if not len(near):
        return []
    ids = [table.ids[other] for other in near.tolist()]
    try:
        kept = now.data.only(ids).derived(_FINGERPRINT, _fingerprint_of)
    except HouseExpoError:  # R4
        ids = [name for name in ids if _read(now, name) is not None]
        kept = now.data.only(ids).derived(_FINGERPRINT, _fingerprint_of)
    if not ids:
        return []
    prints = np.array(kept, dtype=np.int32)
    fine = comparison_mask(plan)
    bounds = lower_bound(fingerprint(fine), prints) / np.maximum(prints[:, 0], int(fine.sum()))
    mask = comparison_mask(plan, _PIXELS_PER_METRE)
    found: list[tuple[float, str, str]] = []
    for other in np.argsort(bounds, kind="stable")[:_COMPARED].tolist():
        limit = sorted(each[0] for each in found)[most - 1] if len(found) >= most else _MAX_DIFFERENCE
        if bounds[other] > limit:
            break
        there = _read(now, ids[other])  # R4, where its traits were known before
        if there is None:
            continue
        match = compare(mask, comparison_mask(there, _PIXELS_PER_METRE), limit)
        if match is not None:
            found.append((match.difference, ids[other], match.symmetry))
    return [
        {"id": name, "title": table.title(now.numbers[name]), "difference": round(difference, 4), "symmetry": symmetry}
        for difference, name, symmetry in sorted(found)[:most]
    ]


def _fingerprint_of(plan: FloorPlan) -> list[int]:
    found: list[int] = fingerprint(comparison_mask(plan)).tolist()
    return found


def _read(now: Opened, plan_id: str) -> FloorPlan | None:
    try:
        return now.data[plan_id]
    except HouseExpoError:
        return None


def _scaled(values: Any, row: int) -> Any:
    """Return how far each value lies from one of them, as a share of it."""
    return (values - values[row]) / max(abs(float(values[row])), 1.0)
