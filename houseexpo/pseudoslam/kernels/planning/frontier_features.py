"""Compute numerical features of frontiers from the robot's own map, and scores, which are weighted sums of them.

R1  Only the map and its borders are used; cells outside the grid do not count as unknown. (The grid of a simulated
    house is its bounding box, so that it reveals a little about the house's size.)
R2  Lengths are divided by 10 m, areas are logarithmic, shares are unchanged, so that all numbers are of the order of
    one.
R3  Distances between frontiers are straight lines; the distance to each is that of the robot's path.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontiers import unknown_area_in_sight
from houseexpo.pseudoslam.kernels.planning.paths import trace_path
from houseexpo.pseudoslam.kernels.planning.planner_types import STRAIGHT
from houseexpo.pseudoslam.kernels.tolerances import FEATURE_BESIDE_M, FEATURE_BOX_M, FEATURE_FAR_M, FEATURE_RINGS_M
from houseexpo.pseudoslam.kernels.types import Floats, Grid, PathScratch, Rows

FEATURES = (
    "way", "log way", "way beyond the nearest", "rank", "turn", "large", "log length", "log sight from the goal",
    "log sight from the middle", "sight less the best", "unknown within 1 m", "unknown within 2.5 m",
    "unknown within 5 m", "free within 2.5 m", "walls within 2.5 m", "others within 3 m", "others near the robot",
    "nearer to the others", "nearer to their length", "tour beyond the shortest", "to the rim", "large ones",
    "log free area", "unknown share", "steps",
)  # fmt: skip
"""The names of the features, in order. The last four are equal for all frontiers of a map."""
LOOKED_AT = 16
"""The number of frontiers that are scored: those that ``find_frontiers`` ranks first."""


class FeatureRules(NamedTuple):
    """The parameters of features, the same for all maps."""

    metre: float
    """Pixels."""
    range_px: float
    """The laser's."""
    large: int
    """As ``FrontierRules``'s."""
    apart: int
    """Rows and columns between two samples in a box."""
    fan_cos: Floats
    """(n,), directions of beams from a place, for ``unknown_area_in_sight``."""
    fan_sin: Floats


@njit(cache=True, nogil=True)
def compute_features(
    known: Grid, x: float, y: float, heading: float, steps: int, frontiers: Rows, n: int, rules: FeatureRules,
    found: PathScratch, features: Floats,
) -> int:  # fmt: skip
    """Compute the features of the first of n frontiers; return their number, at most ``LOOKED_AT``.

    Parameters
    ----------
    known
        (rows, cols), the map.
    x, y, heading, steps
        The robot's believed pose, pixels and radians, and its number of steps so far.
    frontiers
        (n,) ``FRONTIER``, from ``find_frontiers``.
    found
        The distances that it computed.
    features
        (LOOKED_AT, len(FEATURES)), output.
    """
    n = min(n, LOOKED_AT)
    cols, far_px = known.shape[1], FEATURE_FAR_M * rules.metre
    nearest, best_sight = frontiers[0].way, 0.0
    for i in range(n):
        nearest = min(nearest, frontiers[i].way)
    for i in range(n):
        one, out = frontiers[i], features[i]
        way = one.way / STRAIGHT
        sight = _seen_m2(known, one.goal, rules.range_px, rules)
        best_sight = max(best_sight, sight)
        out[0] = way / far_px
        out[1] = math.log1p(way / rules.metre)
        out[2] = (way - nearest / STRAIGHT) / far_px
        out[3] = i / LOOKED_AT
        out[4] = _turn(one.goal, x, y, heading, cols, rules.metre, found)
        out[5] = 1.0 if one.cells >= rules.large else 0.0
        out[6] = math.log1p(one.cells / rules.metre)
        out[7] = math.log1p(sight)
        out[8] = math.log1p(_seen_m2(known, one.middle, 0.6 * rules.range_px, rules))
        _look_around(known, one.middle, rules, out)
        _compare(frontiers, n, i, x, y, cols, rules.metre, out)
    shortest = math.inf
    for i in range(n):
        shortest = min(shortest, features[i, 19])
    _sum_up(known, frontiers, n, steps, rules, features)
    for i in range(n):
        features[i, 9] = math.log1p(best_sight) - features[i, 7]
        features[i, 19] -= shortest
    return n


@njit(cache=True, nogil=True)
def _seen_m2(known: Grid, cell: int, range_px: float, rules: FeatureRules) -> float:
    """Return the unknown area that is visible from a cell, m2."""
    row, col = cell // known.shape[1], cell % known.shape[1]
    area = unknown_area_in_sight(known, col + 0.5, row + 0.5, range_px, rules.fan_cos, rules.fan_sin)
    return area / rules.metre**2


@njit(cache=True, nogil=True)
def _turn(goal: int, x: float, y: float, heading: float, cols: int, metre: float, found: PathScratch) -> float:
    """Return the turn for the first metre of the path, as a share of half a turn."""
    path = found.queue[0]
    length = trace_path(found, goal, path)
    if length < 2:
        return 0.0
    cell = path[min(length - 1, int(metre))]
    off = math.atan2(y - (cell // cols + 0.5), cell % cols + 0.5 - x) - heading
    return abs(math.atan2(math.sin(off), math.cos(off))) / math.pi


@njit(cache=True, nogil=True)
def _look_around(known: Grid, middle: int, rules: FeatureRules, out: Floats) -> None:
    """Count unknown, free and occupied cells in boxes around a frontier's middle, without those off the grid."""
    rows, cols = known.shape
    row, col = middle // cols, middle % cols
    side = int(FEATURE_BOX_M * rules.metre) // rules.apart
    near, mid = FEATURE_RINGS_M[0] * rules.metre, FEATURE_RINGS_M[1] * rules.metre
    unknown_near, unknown_mid, unknown, free_mid, walls_mid, all_near, all_mid = 0, 0, 0, 0, 0, 0, 0
    for i in range(-side, side + 1):
        for j in range(-side, side + 1):
            off = max(abs(i), abs(j)) * rules.apart
            all_near += 1 if off <= near else 0
            all_mid += 1 if off <= mid else 0
            r, c = row + i * rules.apart, col + j * rules.apart
            if not (0 <= r < rows and 0 <= c < cols):
                continue
            value = known[r, c]
            if value == UNKNOWN:
                unknown += 1
                unknown_near += 1 if off <= near else 0
                unknown_mid += 1 if off <= mid else 0
            elif off <= mid:
                free_mid += 1 if value == FREE else 0
                walls_mid += 1 if value == OBSTACLE else 0
    out[10], out[11], out[12] = unknown_near / all_near, unknown_mid / all_mid, unknown / (2 * side + 1) ** 2
    out[13], out[14] = free_mid / all_mid, walls_mid / all_mid
    to_rim = min(row, rows - 1 - row, col, cols - 1 - col)
    out[20] = min(to_rim / (FEATURE_BOX_M * rules.metre), 1.0)


@njit(cache=True, nogil=True)
def _compare(frontiers: Rows, n: int, i: int, x: float, y: float, cols: int, metre: float, out: Floats) -> None:
    """Compare a frontier with the others (R3): those close to it, and the length of a tour that starts with it."""
    here_x, here_y = frontiers[i].middle % cols + 0.5, frontiers[i].middle // cols + 0.5
    beside, by_robot, nearer, weighted, weights = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        to_x, to_y = frontiers[j].middle % cols + 0.5, frontiers[j].middle // cols + 0.5
        length = frontiers[j].cells / metre
        robot_off = math.hypot(to_x - x, to_y - y) / metre
        by_robot += length if robot_off <= FEATURE_BESIDE_M else 0.0
        if j == i:
            continue
        off = math.hypot(to_x - here_x, to_y - here_y) / metre
        beside += length if off <= FEATURE_BESIDE_M else 0.0
        nearer += (robot_off - off) / FEATURE_FAR_M
        weighted += length * (robot_off - off) / FEATURE_FAR_M
        weights += length
    out[15], out[16] = math.log1p(beside), math.log1p(by_robot)
    out[17] = nearer / (n - 1) if n > 1 else 0.0
    out[18] = weighted / weights if weights > 0.0 else 0.0
    done = np.zeros(n, np.uint8)
    done[i], at_x, at_y = 1, here_x, here_y
    tour = frontiers[i].way / STRAIGHT
    for _ in range(n - 1):
        nearest, least = -1, math.inf
        for j in range(n):
            if done[j] == 0:
                off = math.hypot(frontiers[j].middle % cols + 0.5 - at_x, frontiers[j].middle // cols + 0.5 - at_y)
                if off < least:
                    nearest, least = j, off
        done[nearest] = 1
        tour += least
        at_x, at_y = frontiers[nearest].middle % cols + 0.5, frontiers[nearest].middle // cols + 0.5
    out[19] = tour / (FEATURE_FAR_M * metre)


@njit(cache=True, nogil=True)
def _sum_up(known: Grid, frontiers: Rows, n: int, steps: int, rules: FeatureRules, features: Floats) -> None:
    """Write the features that are equal for all: large frontiers, free and unknown area of the map, steps."""
    rows, cols = known.shape
    free, unknown, looked, large = 0, 0, 0, 0
    for row in range(0, rows, rules.apart):
        for col in range(0, cols, rules.apart):
            looked += 1
            free += 1 if known[row, col] == FREE else 0
            unknown += 1 if known[row, col] == UNKNOWN else 0
    for i in range(n):
        large += 1 if frontiers[i].cells >= rules.large else 0
    for i in range(n):
        features[i, 21] = large / LOOKED_AT
        features[i, 22] = math.log1p(free * (rules.apart / rules.metre) ** 2) / 4.0
        features[i, 23] = unknown / looked
        features[i, 24] = min(steps / 800.0, 1.0)


@njit(cache=True, nogil=True)
def score_frontiers(features: Floats, n: int, weights: Floats, scores: Floats) -> int:
    """Write the scores of the first n frontiers; return the index of the highest, of equal ones the first."""
    best = 0
    for i in range(n):
        score = 0.0
        for k in range(len(weights)):
            score += weights[k] * features[i, k]
        scores[i] = score
        if score > scores[best]:
            best = i
    return best
