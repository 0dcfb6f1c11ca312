"""How spaces are joined: walls that are left out, so that two rectangles are one space, and a tree of doors.

Published houses are trees of rooms: their outline has no holes, and whatever wall stood free between two ways round
was lost with them. Made ones are, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.sources.homes.slicing import borders
from pipeline.sources.homes.values import Rect
from pipeline.sources.homes.wishes import door_width

CORNER_M = 0.06
"""A door's jamb stands so far from a wall's face at least."""
LEAST_DOOR_M = 0.6
WIDE_M = 2.4
"""A gap wider than this is no door."""
_AT_CORNER, _IN_MIDDLE = 0.45, 0.15
HUBS = {"Hallway": 1.6, "Hall": 1.2, "Lobby": 1.0, "Entryway": 0.8, "Living_Room": 0.7, "Dining_Room": 0.3, "Room": 0.2}
ENDS = {"Bathroom": 0.7, "Toilet": 0.9, "Storage": 0.8, "Wardrobe": 0.9, "Balcony": 0.8, "Garage": 0.6, "Loggia": 0.8}


@dataclass(frozen=True)
class Joint:
    """A gap in the wall between rectangles ``pair``: its freed area."""

    pair: tuple[int, int]
    gap: Rect


def merged(rects: list[Rect], wall_m: float, count: int, rng: np.random.Generator) -> list[Joint]:
    """Choose up to ``count`` borders whose walls are left out, wholly or but for stubs, no two of them in a ring.

    A border is fit where the gap is wider than a door.
    """
    fit = {pair: at for pair, at in borders(rects).items() if at[2] - at[1] - wall_m >= WIDE_M}
    group = list(range(len(rects)))
    found = []
    for k in rng.permutation(len(fit)).tolist():
        if len(found) == count:
            break
        pair = list(fit)[k]
        if group[pair[0]] == group[pair[1]]:
            continue
        line, low, high, upright = fit[pair]
        low, high = low + wall_m / 2, high - wall_m / 2
        if rng.random() < 0.4 and high - low > WIDE_M + 0.3:
            spare = float(rng.uniform(0.2, high - low - WIDE_M))
            left = spare * float(rng.choice([0.0, 0.5, 1.0, rng.random()]))
            low, high = low + left, high - (spare - left)
        found.append(Joint(pair, _across(line, low, high, wall_m, upright)))
        old, new = group[pair[1]], group[pair[0]]
        group = [new if g == old else g for g in group]
    return found


def doors(
    rects: list[Rect], space_of: list[int], labels: list[str | None], wall_m: float, rng: np.random.Generator
) -> list[Joint] | None:
    """Join all spaces by a tree of doors, through the walls that people would choose; None where some stay apart."""
    ways = []
    for pair, at in borders(rects).items():
        one, other = space_of[pair[0]], space_of[pair[1]]
        clear = at[2] - at[1] - wall_m - 2 * CORNER_M
        if one != other and clear >= LEAST_DOOR_M:
            ways.append((_cost(labels[one], labels[other], rng), pair, at))
    group = list(range(max(space_of) + 1))
    found = []
    for _, pair, (line, start, end, upright) in sorted(ways):
        one, other = group[space_of[pair[0]]], group[space_of[pair[1]]]
        if one == other:
            continue
        group = [one if g == other else g for g in group]
        low, high = start + wall_m / 2 + CORNER_M, end - wall_m / 2 - CORNER_M
        width = min(door_width(rng), high - low)
        at = low + (high - low - width) * _place(rng)
        found.append(Joint(pair, _across(line, at, at + width, wall_m, upright)))
    return found if len(set(group)) == 1 else None


def _place(rng: np.random.Generator) -> float:
    """Draw where along a wall a door is, 0 to 1: near a corner, in the middle, anywhere."""
    draw = rng.random()
    if draw < _AT_CORNER:
        near = float(abs(rng.normal(0.0, 0.12)))
        return min(near, 1.0) if rng.random() < 0.5 else max(1.0 - near, 0.0)
    return 0.5 if draw < _AT_CORNER + _IN_MIDDLE else float(rng.random())


def _cost(one: str | None, other: str | None, rng: np.random.Generator) -> float:
    """Return how unlikely a door between two rooms is."""
    hub = HUBS.get(one or "", 0.0) + HUBS.get(other or "", 0.0)
    end = ENDS.get(one or "", 0.0) * ENDS.get(other or "", 0.0)
    return float(rng.gumbel()) - hub + 2.0 * end


def _across(line: float, low: float, high: float, wall_m: float, upright: bool) -> Rect:
    half = wall_m / 2 + 1e-3  # into both rooms, so that they become one
    return (line - half, low, line + half, high) if upright else (low, line - half, high, line + half)
