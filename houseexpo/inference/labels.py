"""Assign the labels of a published plan's boxes to the rooms that were found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.plan import Box

if TYPE_CHECKING:
    from shapely import Polygon

Matrix = npt.NDArray[np.float64]

_FITS: Final = 0.3
_COVERS: Final = 0.8
_INSIDE: Final = 0.5


def labels_of(rooms: list[Polygon], category: Mapping[str, tuple[Box, ...]]) -> list[tuple[str, ...]]:
    """Return the labels of each room, the one whose box fits best first.

    A box contains a room of the source with its walls and with objects, which may extend beyond it. Equal boxes are one
    room with several labels.

    R1  Boxes and rooms are paired so that the sum of their intersections over union is largest.
    R2  A remaining box belongs to a room without a box that it covers, since objects may have enlarged the box.
    R3  If there is no such room, several rooms of the source are one here, and the box adds its labels to the room that
        it lies in.
    """
    words: dict[Box, list[str]] = {}
    for label, boxes in category.items():
        for box in boxes:
            words.setdefault(box, []).append(label)
    found: list[list[tuple[bool, float, str]]] = [[] for _ in rooms]
    if words and rooms:
        shared, fit, sizes = _overlaps(rooms, np.array(list(words)))
        paired = _paired(fit)
        for i, labels in enumerate(words.values()):
            room = paired.get(i)
            if room is None:
                room = _holder(i, shared, fit, sizes, set(paired.values()))
            if room is not None:
                found[room] += [(i in paired, float(fit[i, room]), label) for label in labels]
    ordered = [sorted(names, key=lambda name: (not name[0], -name[1])) for names in found]
    return [tuple(dict.fromkeys(label for *_, label in names)) for names in ordered]


def _overlaps(rooms: list[Polygon], boxes: Matrix) -> tuple[Matrix, Matrix, tuple[Matrix, Matrix]]:
    """Return the shared area and the intersection over union (boxes, rooms), and the areas of boxes and rooms."""
    import shapely

    shapes = shapely.box(*boxes.T)
    box, room = shapely.STRtree(rooms).query(shapes, predicate="intersects")
    shared = np.zeros((len(shapes), len(rooms)))
    shared[box, room] = shapely.area(shapely.intersection(shapes[box], np.array(rooms)[room]))
    sizes = shapely.area(shapes), shapely.area(rooms)
    union = sizes[0][:, None] + sizes[1] - shared
    return shared, shared / np.maximum(union, 1e-9), sizes


def _paired(fit: Matrix) -> dict[int, int]:
    """Return the room of each box (R1)."""
    from scipy.optimize import linear_sum_assignment

    pairs = zip(*(k.tolist() for k in linear_sum_assignment(-fit)), strict=True)
    return {box: room for box, room in pairs if fit[box, room] > _FITS}


def _holder(box: int, shared: Matrix, fit: Matrix, sizes: tuple[Matrix, Matrix], taken: set[int]) -> int | None:
    """Return the room of a remaining box (R2, R3)."""
    covered = [k for k in range(len(sizes[1])) if k not in taken and shared[box, k] > _COVERS * sizes[1][k]]
    if covered:
        return max(covered, key=lambda k: float(fit[box, k]))
    room = int(shared[box].argmax())
    return room if shared[box, room] > _INSIDE * sizes[0][box] else None
