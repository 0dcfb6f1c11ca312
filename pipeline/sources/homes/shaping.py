"""Rooms that are no rectangles: an L round a smaller room, and walls that reach into a room. Areas stay what they are.

A space is then several rectangles, joined where the wall between them is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.sources.homes.joints import Joint, across
from pipeline.sources.homes.slicing import NEAR_M, borders
from pipeline.sources.homes.values import Rect, on_grid

_CORNERS_OF_L, _CORNERS_OF_STUB = 2, 4
_SHARE_OF_L, _SPENT = 0.6, (0.7, 1.0)
_WAY_M, _MIN_M = 1.2, 0.9
WIDE_M = 2.4
"""A gap wider than this is no door."""


@dataclass
class Shaped:
    """Rectangles, the space of each, and the gaps between those of one space."""

    rects: list[Rect]
    space_of: list[int]
    gaps: list[Joint]


def shaped(rects: list[Rect], corners: int, wall_m: float, rng: np.random.Generator) -> Shaped:
    """Give rooms about so many corners beyond four each."""
    found = Shaped(list(rects), list(range(len(rects))), [])
    left = corners * float(rng.uniform(*_SPENT))
    for _ in range(corners):
        if left < _CORNERS_OF_L:
            break
        if rng.random() < _SHARE_OF_L:
            left -= _CORNERS_OF_L * _bend(found, wall_m, rng)
        elif left >= _CORNERS_OF_STUB:
            left -= _CORNERS_OF_STUB * _stub(found, wall_m, rng)
        left -= 0.2
    return found


def one_space(rects: list[Rect], wall_m: float) -> Shaped:
    """Join all rectangles to one space, each by a whole border, the longest ones; other walls between them stay."""
    ways = sorted(borders(rects).items(), key=lambda way: way[1][1] - way[1][2])
    group = list(range(len(rects)))
    gaps = []
    for pair, (line, low, high, upright) in ways:
        one, other = group[pair[0]], group[pair[1]]
        if one != other:
            group = [one if g == other else g for g in group]
            gap = across(line, low + wall_m / 2, high - wall_m / 2, wall_m, upright=upright)
            gaps.append(Joint(pair, gap))
    return Shaped(rects, [0] * len(rects), gaps)


def _bend(found: Shaped, wall_m: float, rng: np.random.Generator) -> bool:
    """Let a room that has a whole side in common with a smaller one go round it, or False if none is fit."""
    alone = {k for k, space in enumerate(found.space_of) if found.space_of.count(space) == 1}
    pairs = [
        pair if _area(found.rects[pair[0]]) < _area(found.rects[pair[1]]) else pair[::-1]
        for pair, (_, low, high, upright) in borders(found.rects).items()
        if alone >= {*pair} and all(_spans(found.rects[k], low, high, upright) for k in pair)
    ]
    for pick in rng.permutation(len(pairs)).tolist():
        small, large = pairs[pick]
        a, b = found.rects[small], found.rects[large]
        x1, y1, x2, y2 = min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])
        width = float(np.sqrt(_area(a)) * rng.uniform(0.75, 1.35))
        height = _area(a) / width
        if min(width, height) < _MIN_M or x2 - x1 - width < _WAY_M or y2 - y1 - height < _WAY_M:
            continue
        left, low = rng.random() < 0.5, rng.random() < 0.5
        cut_x, cut_y = (x1 + width if left else x2 - width), (y1 + height if low else y2 - height)
        cut_x, cut_y = on_grid(cut_x, wall_m), on_grid(cut_y, wall_m)
        found.rects[small] = _rect(x1 if left else x2, y1 if low else y2, cut_x, cut_y)
        found.rects[large] = _rect(x1 if left else x2, y2 if low else y1, cut_x, cut_y)
        found.rects.append(_rect(x2 if left else x1, y1, cut_x, y2))
        found.space_of.append(found.space_of[large])
        _, start, end, _ = borders([found.rects[large], found.rects[-1]])[0, 1]
        gap = across(cut_x, start + wall_m / 2, end - wall_m / 2, wall_m, upright=True)
        found.gaps.append(Joint((large, len(found.rects) - 1), gap))
        return True
    return False


def _stub(found: Shaped, wall_m: float, rng: np.random.Generator) -> bool:
    """Divide a large room by a wall that leaves a wide gap at its end, or False if none is large enough."""
    alone = [k for k, space in enumerate(found.space_of) if found.space_of.count(space) == 1]  # no wall ends in a gap
    fit = [k for k in alone if min(_size(found.rects[k])) > WIDE_M + 0.6 + wall_m]
    if not fit:
        return False
    areas = np.array([_area(found.rects[k]) for k in fit])
    k = fit[int(rng.choice(len(fit), p=areas / areas.sum()))]
    x1, y1, x2, y2 = found.rects[k]
    upright, share = bool(rng.random() < 0.5), float(rng.uniform(0.25, 0.75))
    line, low, high = (x1 + (x2 - x1) * share, y1, y2) if upright else (y1 + (y2 - y1) * share, x1, x2)
    line = on_grid(line, wall_m)
    halves = ((x1, y1, line, y2), (line, y1, x2, y2)) if upright else ((x1, y1, x2, line), (x1, line, x2, y2))
    if min(min(_size(half)) for half in halves) < WIDE_M / 2:
        return False
    found.rects[k] = halves[0]
    found.rects.append(halves[1])
    found.space_of.append(found.space_of[k])
    stub = round(float(rng.uniform(0.3, high - low - wall_m - WIDE_M)), 2)
    low, high = low + wall_m / 2, high - wall_m / 2
    low, high = (low + stub, high) if rng.random() < 0.5 else (low, high - stub)
    found.gaps.append(Joint((k, len(found.rects) - 1), across(line, low, high, wall_m, upright=upright)))
    return True


def _spans(rect: Rect, low: float, high: float, upright: bool) -> bool:
    """Whether a border takes up a whole side of a rectangle."""
    side = (rect[1], rect[3]) if upright else (rect[0], rect[2])
    return abs(side[0] - low) < NEAR_M and abs(side[1] - high) < NEAR_M


def _rect(x1: float, y1: float, x2: float, y2: float) -> Rect:
    return min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2)


def _size(rect: Rect) -> tuple[float, float]:
    return rect[2] - rect[0], rect[3] - rect[1]


def _area(rect: Rect) -> float:
    return (rect[2] - rect[0]) * (rect[3] - rect[1])
