"""How well rooms of a map agree with the true ones: the measures of ROSE2's evaluator, written anew.

Definition: goldleaf3i/declutter-reconstruct, ``code/util/evaluation.py`` (ROSE2, Luperto et al., 2022). For each found
room, the true room that it overlaps most counts, and for each true room, the found one. "Micro" there is the mean over
the rooms, "macro" is by area.

R1  True rooms of ``SMALLEST_PX`` pixels or fewer are left out; a found room counts whatever its size.
R2  Precision is the overlap by the found room's size, recall by the true room's.
R3  IoU is the overlap by what both cover; of equal overlaps, the first room counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Labels = npt.NDArray[np.integer]
SMALLEST_PX = 200


@dataclass(frozen=True)
class RoomScores:
    """The eight figures of ROSE2's tables, as shares; ``found`` and ``true`` are the numbers of rooms."""

    precision_micro: float
    precision_macro: float
    recall_micro: float
    recall_macro: float
    iou_found_mean: float
    iou_found: float
    iou_true_mean: float
    iou_true: float
    found: int
    true: int


def room_scores(found: Labels, true: Labels, smallest_px: int = SMALLEST_PX) -> RoomScores:
    """Compare labels (rows, cols), 0 for no room; raises ValueError if there is no room in either."""
    rows, cols = min(found.shape[0], true.shape[0]), min(found.shape[1], true.shape[1])
    found, true = found[:rows, :cols], true[:rows, :cols]
    shared = np.zeros((int(found.max()) + 1, int(true.max()) + 1), np.int64)
    np.add.at(shared, (found.ravel(), true.ravel()), 1)
    found_px, true_px = shared.sum(axis=1), shared.sum(axis=0)
    kept, asked = np.flatnonzero(found_px), np.flatnonzero(true_px > smallest_px)  # R1
    kept, asked = kept[kept > 0], asked[asked > 0]
    if not len(kept) or not len(asked):
        raise ValueError(f"{len(kept)} found and {len(asked)} true rooms")
    overlap = shared[np.ix_(kept, asked)]
    found_px, true_px = found_px[kept], true_px[asked]
    union = found_px[:, None] + true_px[None] - overlap
    p_micro, p_macro, f_mean, f_all = _best(overlap, union, found_px)
    r_micro, r_macro, t_mean, t_all = _best(overlap.T, union.T, true_px)
    return RoomScores(p_micro, p_macro, r_micro, r_macro, f_mean, f_all, t_mean, t_all, len(kept), len(asked))


def _best(overlap: Labels, union: Labels, size: Labels) -> tuple[float, float, float, float]:
    """R2, R3: for each row its best column."""
    best = overlap.argmax(axis=1)[:, None]
    most = np.take_along_axis(overlap, best, 1)[:, 0]
    both = np.where(most > 0, np.take_along_axis(union, best, 1)[:, 0], 1)
    return (
        float((most / size).mean()),
        float(most.sum() / size.sum()),
        float((most / both).mean()),
        float(most.sum() / both.sum()),
    )
