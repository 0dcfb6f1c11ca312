"""Places for a piece: boxes along the axes, (n, 4) as x1, y1, x2, y2 in centimetres, with the way each one faces.

A box faces +x, +y, -x or -y (0 to 3): its back is on the other side, its ``front`` must stay free.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Boxes = npt.NDArray[np.int64]
FACINGS: Final = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
STEP_CM: Final = 10


class Candidates(NamedTuple):
    """Places for one piece, the one liked best first: boxes (n, 4), facings (n,), widths (n,)."""

    boxes: Boxes
    facings: npt.NDArray[np.int64]


class Edge(NamedTuple):
    """A wall along an axis: where it lies, its extent along it, and the way that what stands at it faces."""

    at: int
    low: int
    high: int
    facing: int


def walls_of(rings: list[npt.NDArray[np.int64]]) -> list[Edge]:
    """Return the edges along the axes of rings (n, 2) that have the room on their left, unclosed."""
    found = []
    for ring in rings:
        for (x1, y1), (x2, y2) in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist(), strict=True):
            if y1 == y2 and x1 != x2:  # left of +x is +y
                found.append(Edge(y1, min(x1, x2), max(x1, x2), 1 if x2 > x1 else 3))
            elif x1 == x2 and y1 != y2:  # left of +y is -x
                found.append(Edge(x1, min(y1, y2), max(y1, y2), 2 if y2 > y1 else 0))
    return found


def boxed(facing: int, back: int, start: int, width: int, depth: int) -> tuple[int, int, int, int]:
    """Return the box whose back lies at ``back`` and begins at ``start`` along it."""
    end = start + width
    far = back + depth * (1 if facing < 2 else -1)
    low, high = min(back, far), max(back, far)
    return (low, start, high, end) if facing % 2 == 0 else (start, low, end, high)


def back_and_span(box: npt.NDArray[np.int64], facing: int) -> tuple[int, int, int]:
    """Return where the back of a box lies, and from where to where it reaches along it."""
    x1, y1, x2, y2 = box.tolist()
    low, high, start, end = (x1, x2, y1, y2) if facing % 2 == 0 else (y1, y2, x1, x2)
    return (low if facing < 2 else high), start, end


def fronts(boxes: Boxes, facings: npt.NDArray[np.int64], reach: int) -> Boxes:
    """Return the boxes with what must stay free before them."""
    ahead = FACINGS[facings] * reach
    return np.asarray(boxes + np.column_stack([np.minimum(ahead, 0), np.maximum(ahead, 0)]))


def grown(boxes: Boxes, by: int) -> Boxes:
    """Return the boxes with a margin all round."""
    return np.asarray(boxes + np.array([-by, -by, by, by]))


def apart(boxes: Boxes, others: Boxes) -> npt.NDArray[np.bool_]:
    """Whether each box (n, 4) shares no area with any of the others (m, 4)."""
    if not len(others):
        return np.ones(len(boxes), dtype=bool)
    a, b = boxes[:, None], others[None]
    crossing = (a[..., 0] < b[..., 2]) & (b[..., 0] < a[..., 2]) & (a[..., 1] < b[..., 3]) & (b[..., 1] < a[..., 3])
    return np.asarray(~crossing.any(axis=1))
