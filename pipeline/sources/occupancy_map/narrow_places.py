"""Find the narrow places of a map's free cells, borders between basins of clearance, and measure each of them.

The clearance of a free cell is its distance to the nearest cell that is not free. Each cell belongs to the basin of the
peak that the steepest way up leads to. Where two basins meet, the highest cell on their border is the middle of a
narrow place, and the nearest obstacles on its two sides are its jambs.

R1  Peaks that are hardly higher than the way between them count as one; there is no narrow place between them.
R2  A narrow place is described by what tells doors from gaps beside furniture: its width, the space on its two sides,
    the walls in which its jambs end, how wide it is a step before and behind it, and how far each jamb stands out. Both
    jambs of a doorway stand out into the way, on both sides. Where a corridor bends, one jamb is its straight wall, and
    the other is a corner, behind which the way widens on one side only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from pipeline.sources.occupancy_map.gaps import REACH_M
from pipeline.tolerances import AROUND_M, HAND_M, NEARLY_ALL, THIN_WALL_M

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Labels = npt.NDArray[np.int32]

CLOSE_M, NEAR_M, FAR_M = 0.15, 0.3, 1.0
"""Steps before and behind a narrow place, where the width is measured."""
RUN_STEP_M = 0.05
_NEIGHBOURS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


@dataclass(frozen=True, eq=False)
class Basins:
    """The basins of a map: ``label`` (rows, cols), 0 where not free, and arrays by label of their peaks and areas.

    ``narrows`` are the places where two of them meet.
    """

    label: Labels
    peak_m: Floats
    area_m2: Floats
    narrows: NarrowPlaces


@dataclass(frozen=True, eq=False)
class NarrowPlaces:
    """Narrow places (n): the basins on their sides, and what is known of them.

    ``sides`` (n, 2) labels; ``half_m`` (n,) the clearance in the middle; ``jambs`` (n, 2, 2) the (row, col) of cells on
    both sides; ``width_m`` (n,) between them; ``thin_m`` (n,) the thickness of the thinner of the walls that they are
    the ends of; ``near_m`` and ``far_m`` (n,) by how much the way is wider ``NEAR_M`` and ``FAR_M`` away, on the side
    where that is more, and ``less_m`` (n,) ``FAR_M`` away on the other side.

    A jamb stands out by as much as the way is wider beyond it, on one side. ``CLOSE_M`` away, ``stub_m`` (n,) is by how
    much one of the jambs stands out on both sides, ``step_m`` (n,) by how much one does on either. ``NEAR_M`` away,
    ``least_m`` (n,) is by how much both jambs stand out on both sides, ``turn_m`` (n,) by how much both do on either.
    """

    sides: Ints
    half_m: Floats
    jambs: Floats
    width_m: Floats
    thin_m: Floats
    near_m: Floats
    far_m: Floats
    less_m: Floats
    stub_m: Floats
    step_m: Floats
    least_m: Floats
    turn_m: Floats

    def only(self, kept: npt.NDArray[np.bool_] | Ints) -> NarrowPlaces:
        """Return some of them."""
        return NarrowPlaces(*(getattr(self, name)[kept] for name in self.__dataclass_fields__))

    def and_those_of(self, others: NarrowPlaces) -> NarrowPlaces:
        """Return these and others, in this order."""
        names = self.__dataclass_fields__
        return NarrowPlaces(*(np.concatenate([getattr(self, name), getattr(others, name)]) for name in names))


def find_basins(free: Bools, cell_m: float) -> Basins:
    """Return the basins of the free cells (rows, cols), joined by R1, and their narrow places."""
    clear = clearance_m(free, cell_m)
    cells = np.flatnonzero(free)
    framed = cells + 2 * (cells // free.shape[1]) + free.shape[1] + 3  # the same with a frame of one cell around
    of_cells = _climb(clear, cells, framed, cell_m)
    count = int(of_cells.max(initial=0)) + 1
    area = np.bincount(of_cells, minlength=count).astype(np.float64) * cell_m**2
    highest = np.zeros(count, clear.dtype)  # one type for all, or NumPy takes a hundred times as long
    np.maximum.at(highest, of_cells, clear.ravel()[cells])
    peak = highest.astype(np.float64)
    sides, half, cell = _meetings(clear, of_cells, cells, framed)
    root, peak = _merge_basins(sides, half, peak)
    area = np.asarray(np.bincount(root, weights=area, minlength=count), np.float64)
    sides = root[sides]
    apart = sides[:, 0] != sides[:, 1]
    sides, half, cell = sides[apart], half[apart], cell[apart]
    jambs = _jambs(free, cell, half / cell_m)
    label = np.zeros(free.shape, np.int32)
    label.ravel()[cells] = root[of_cells]
    return Basins(label, peak, area, _measure_narrows(free, sides, half, jambs, cell_m))


def clearance_m(free: Bools, cell_m: float) -> npt.NDArray[np.float32]:
    """Return the distance (rows, cols) of each free cell to the nearest that is not, metres; the border is not free."""
    padded = np.pad(free.view(np.uint8), 1)
    found = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    return np.asarray(found * np.float32(cell_m))


def _climb(clear: npt.NDArray[np.float32], cells: Ints, framed: Ints, cell_m: float) -> Ints:
    """Return the basin (n,) of each free cell: the plateau that the steepest way up the smoothed clearance ends on.

    ``cells`` (n,) are the flat indices of the free cells, and ``framed`` (n,) those in a map with a frame of one cell.
    """
    rows, cols = clear.shape
    smooth = cv2.GaussianBlur(clear, (0, 0), max(HAND_M / cell_m, 0.5), borderType=cv2.BORDER_CONSTANT)
    height = np.full((rows + 2) * (cols + 2), -1.0, np.float32)
    best = smooth.ravel()[cells]
    height[framed] = best
    top = framed.copy()
    for down, right in _NEIGHBOURS:
        there = framed + (down * (cols + 2) + right)
        high = height[there]
        higher = high > best + 1e-6
        np.copyto(best, high, where=higher)
        np.copyto(top, there, where=higher)
    number = np.zeros(len(height), np.int32)
    number[framed] = np.arange(len(cells), dtype=np.int32)
    up = number[top].astype(np.intp)
    while True:
        further = up[up]
        if np.array_equal(further, up):
            break
        up = further
    tops = np.zeros((rows, cols), np.uint8)
    tops.ravel()[cells[up == np.arange(len(up))]] = 1
    _, plateau = cv2.connectedComponents(tops, connectivity=8)
    return np.asarray(plateau.ravel()[cells[up]].astype(np.intp))


def _meetings(clear: npt.NDArray[np.float32], of_cells: Ints, cells: Ints, framed: Ints) -> tuple[Ints, Floats, Ints]:
    """Return for each pair of basins that meet: their labels (n, 2), the height and the flat index of the way.

    The arguments are those of ``_climb`` and what it returns.
    """
    rows, cols = clear.shape
    label = np.zeros((rows + 2) * (cols + 2), np.int32)
    label[framed] = of_cells
    found, beside = [], []
    for step, framed_step in ((1, 1), (cols, cols + 2)):
        there = label[framed + framed_step]
        meets = (there != of_cells) & (there > 0)
        at = cells[meets]
        found.append(np.stack([at, at + step], axis=1))
        beside.append(np.stack([of_cells[meets], there[meets]], axis=1))
    both = np.concatenate(found)
    pairs = np.sort(np.concatenate(beside), axis=1)
    height = clear.ravel()[both].min(axis=1).astype(float)
    order = np.lexsort((both[:, 0], -height, pairs[:, 1], pairs[:, 0]))
    pairs, height, at = pairs[order], height[order], both[order, 0]
    first = np.ones(len(pairs), bool)
    first[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    return pairs[first], height[first], at[first]


def _merge_basins(sides: Ints, half: Floats, peak: Floats) -> tuple[Ints, Floats]:
    """Merge peaks hardly higher than the way between them; return the basin of each, and the peaks."""
    root, peak = np.arange(len(peak)), peak.copy()
    parent = root.tolist()

    def find(one: int) -> int:
        while parent[one] != one:
            parent[one] = parent[parent[one]]
            one = parent[one]
        return one

    for k in np.argsort(-half, kind="stable").tolist():
        a, b = find(int(sides[k, 0])), find(int(sides[k, 1]))
        if a != b and half[k] > NEARLY_ALL * min(peak[a], peak[b]):
            low, high = min(a, b), max(a, b)
            parent[high] = low
            peak[low] = max(peak[low], peak[high])
    return np.array([find(k) for k in range(len(peak))]), peak


def _jambs(free: Bools, cells: Ints, reach: Floats) -> Floats:
    """Return the (row, col) of the nearest obstacles (n, 2, 2) on the two sides of cells, flat indices (n,)."""
    rows, cols = free.shape
    found = np.empty((len(cells), 2, 2))
    for k, (cell, half) in enumerate(zip(cells.tolist(), reach.tolist(), strict=True)):
        row, col = divmod(cell, cols)
        away = int(half * 1.7) + 3
        top, left = max(row - away, 0), max(col - away, 0)
        down, right = np.nonzero(~free[top : min(row + away + 1, rows), left : min(col + away + 1, cols)])
        down, right = down + top - row, right + left - col
        if not len(down):  # at the border of the map
            found[k] = [(row - half, col), (row + half, col)]
            continue
        length = np.hypot(down, right)
        one = int(length.argmin())
        facing = (down * down[one] + right * right[one]) / np.maximum(length * length[one], 1e-9)
        behind = np.where(facing < -0.5, length, np.where(facing < 0, length + 1e6, np.inf))
        other = int(behind.argmin())
        if np.isinf(behind[other]):
            found[k] = [(row + down[one], col + right[one]), (row - down[one], col - right[one])]
        else:
            found[k] = [(row + down[one], col + right[one]), (row + down[other], col + right[other])]
    return found


def measure_gaps(free: Bools, sides: Ints, jambs: Floats, cell_m: float) -> NarrowPlaces:
    """Return what R2 says of gaps (n) between jambs (n, 2, 2), (row, col)."""
    half = np.hypot(*(jambs[:, 1] - jambs[:, 0]).T) * (cell_m / 2)
    return _measure_narrows(free, sides, half, jambs, cell_m)


def _measure_narrows(free: Bools, sides: Ints, half: Floats, jambs: Floats, cell_m: float) -> NarrowPlaces:
    """Measure of each narrow place what tells doors from gaps beside furniture."""
    one, other = jambs[:, 0], jambs[:, 1]
    along = other - one
    length = np.maximum(np.hypot(*along.T), 1e-6) if len(along) else np.zeros(0)
    along = along / length[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    middle = (one + other) / 2
    width = length * cell_m

    def run(start: Floats, way: Floats, longest: float, step_m: float, *, wanted: bool) -> Floats:
        """How far (n,) from points (n, 2) one goes along ways (n, 2) before a cell is free, or is not (``wanted``)."""
        steps = np.arange(0.0, longest + 1e-9, step_m) / cell_m
        at = np.rint(start[:, None] + way[:, None] * steps[None, :, None]).astype(np.int64)
        inside = ((at >= 0) & (at < free.shape)).all(axis=2)
        value = np.zeros(inside.shape, bool)
        value[inside] = free[at[inside][:, 0], at[inside][:, 1]]
        hit = value == wanted
        return np.where(hit.any(axis=1), hit.argmax(axis=1), len(steps)) * step_m

    def thick(jamb: Floats, outward: Floats) -> Floats:
        behind = jamb + outward * (THIN_WALL_M / cell_m)  # where the thickness of the wall is measured
        left, right = (run(behind, sign * across, AROUND_M, RUN_STEP_M, wanted=True) for sign in (-1.0, 1.0))
        return left + right

    def beyond_jambs(away_m: float, step_m: float) -> Floats:
        """By how much the way is wider (jambs, sides, n) beyond each jamb, on each side of the narrow place."""
        found = np.empty((2, 2, len(along)))
        for side, sign in enumerate((-1.0, 1.0)):
            start = middle + sign * across * (away_m / cell_m)
            for jamb, way in enumerate((-1.0, 1.0)):
                found[jamb, side] = run(start, way * along, REACH_M, step_m, wanted=False) - width / 2
        return found

    thin = np.minimum(thick(one, -along), thick(other, along))
    close, near, far = (
        beyond_jambs(CLOSE_M, RUN_STEP_M),
        beyond_jambs(NEAR_M, RUN_STEP_M),
        beyond_jambs(FAR_M, 2 * RUN_STEP_M),
    )
    wider_near, wider_far = near.sum(axis=0), far.sum(axis=0)
    return NarrowPlaces(
        sides=sides,
        half_m=half,
        jambs=jambs,
        width_m=width,
        thin_m=thin,
        near_m=wider_near.max(axis=0),
        far_m=wider_far.max(axis=0),
        less_m=wider_far.min(axis=0),
        stub_m=close.min(axis=1).max(axis=0),
        step_m=close.max(axis=(0, 1)),
        least_m=near.min(axis=(0, 1)),
        turn_m=near.max(axis=1).min(axis=0),
    )


# ---------------------------------------------------------------------------------------------------------------------
# The log-odds that a narrow place of a map separates two rooms: a sum of curves, one for each feature.
#
# The features come from the measures of the narrow place (``NarrowPlaces``); ``rooms`` joins basins by the log-odds.
#
# The log-odds are ``SEPARATION_BIAS`` plus, for each feature, the value of its curve, which is linear between its knots
# and level beyond them. The curves were fitted (logistic, ridge) on Bormann's empty maps, on these with furniture and
# noise that the project adds, and on maps that PseudoSLAM makes of them and of plans; ``python -m
# research.map_fit FOLDER --plans FILE`` fits them again and prints this table. No furnished and no real map was used.
# ---------------------------------------------------------------------------------------------------------------------

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
