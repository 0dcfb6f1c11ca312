"""How spaces are joined: walls that are left out, so that two rectangles are one space, and a tree of doors.

Published houses are trees of rooms: their outline has no holes, and whatever wall stood free between two ways round
was lost with them. Made ones are, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pipeline.sources.homes.slicing import NEAR_M, borders
from pipeline.sources.homes.values import Rect
from pipeline.sources.homes.wishes import hub_of

CORNER_M = 0.06
"""A door's jamb stands so far from a wall's face, or is flush with it."""
BORDER_M = 0.72
"""The least clear width that a border must have to take a door."""
MIN_DOOR_M = 0.5
"""No door is narrower: a robot of 0.2 m passes each with some room to spare."""
_AT_CORNER, _IN_MIDDLE = 0.1, 0.25
_NARROW = 2.0
"""How much it counts that a wall has no room for the narrowest door that is asked for, half as much for the widest."""
_OF_FLUSH, _OF_FLUSH_ON_BOTH = 2, 4
_Way: TypeAlias = tuple[tuple[int, int], tuple[float, float, float, bool]]
HUB, RICHER = 1.3, 1.8
"""How much the label of a room, and a door that it has, speak for another door."""
ENTRANCE, ENTERED = "Entryway", 1.1
"""How much more than its doors that label speaks for another one: rooms lie round the one that is entered."""
ENDS = {"Bathroom": 0.7, "Toilet": 0.9, "Storage": 0.8, "Wardrobe": 0.9, "Balcony": 0.8, "Garage": 0.6, "Loggia": 0.8}


@dataclass(frozen=True)
class Joint:
    """A gap in the wall between rectangles ``pair``: its freed area."""

    pair: tuple[int, int]
    gap: Rect


@dataclass(frozen=True)
class Doorways:
    """What is asked of the doors: their widths, ascending.

    ``fewer`` are corners less than four a door where a jamb is flush with a room's side.
    """

    widths: tuple[float, ...]
    fewer: int
    wall_m: float


def doors(
    rects: list[Rect], space_of: list[int], labels: list[str | None], asked: Doorways, rng: np.random.Generator
) -> list[Joint] | None:
    """Join all spaces by a tree of doors, through the walls that people would choose, or None if some stay apart.

    The tree grows from a hub: of all walls between what is joined and what is not, the one is taken whose rooms are
    likeliest to have many doors; a room that has some gets more.
    """
    ways: dict[tuple[int, int], _Way] = {}
    for pair, at in borders(rects).items():
        one, other = sorted((space_of[pair[0]], space_of[pair[1]]))
        if one != other and _clear(at, asked.wall_m) >= BORDER_M:
            known = ways.get((one, other))
            if known is None or at[2] - at[1] > known[1][2] - known[1][1]:  # into the longest border of two spaces
                ways[one, other] = pair, at
    count = max(space_of) + 1
    reach = np.zeros(count)
    for one, other in ways:
        reach[[one, other]] += 1.0
    pull = np.array([HUB * hub_of(label) + ENTERED * (label == ENTRANCE) for label in labels])
    pull += 0.5 * reach + rng.gumbel(size=count)
    inside, degree = {int(np.argmax(pull))}, np.zeros(count)
    found: list[_Way] = []
    while len(inside) < count:
        edges = [(one, other) for one, other in ways if (one in inside) != (other in inside)]
        if not edges:
            return None
        costs = [
            _cost(labels[a], labels[b], rng)
            + _NARROW * _lacking(_clear(ways[a, b][1], asked.wall_m), asked.widths)
            - pull[a]
            - pull[b]
            - RICHER * (degree[a] + degree[b])
            for a, b in edges
        ]
        one, other = edges[int(np.argmin(costs))]
        degree[[one, other]] += 1.0
        inside |= {one, other}
        found.append(ways[one, other])
    return _placed(found, rects, asked, rng)


def _lacking(clear_m: float, widths: tuple[float, ...]) -> float:
    """Return how unfit a border is for the doors that are asked for."""
    return float(clear_m < widths[0]) + 0.5 * float(clear_m < widths[-1])


def _clear(at: tuple[float, float, float, bool], wall_m: float) -> float:
    """Return how wide a door may be in a border."""
    return at[2] - at[1] - wall_m - 2 * CORNER_M


def _placed(ways: list[_Way], rects: list[Rect], asked: Doorways, rng: np.random.Generator) -> list[Joint]:
    """Deal the widths to the borders, the widest door first, and place each; some jambs are flush with a side wall."""
    widths: dict[int, float] = {}
    for width in asked.widths[::-1]:
        left = [k for k in range(len(ways)) if k not in widths]
        fit = [k for k in left if _clear(ways[k][1], asked.wall_m) >= width]
        k = fit[int(rng.integers(len(fit)))] if fit else max(left, key=lambda k: _clear(ways[k][1], asked.wall_m))
        widths[k] = width if fit else _instead(_clear(ways[k][1], asked.wall_m), asked.widths)
    found, fewer = [], asked.fewer
    for k in range(len(ways)):
        pair, (line, start, end, upright) = ways[k]
        low, high = start + asked.wall_m / 2, end - asked.wall_m / 2
        if fewer >= _OF_FLUSH:
            first = bool(rng.random() < 0.5)
            at = low if first else high - widths[k]
            fewer -= _OF_FLUSH_ON_BOTH if _aligned(rects, pair, upright, first) else _OF_FLUSH
        else:
            low, high = low + CORNER_M, high - CORNER_M
            at = low + (high - low - widths[k]) * _place(rng)
        at = round(at, 2)
        found.append(Joint(pair, across(line, at, at + widths[k], asked.wall_m, upright=upright)))
    return found


def _instead(clear_m: float, widths: tuple[float, ...]) -> float:
    """Return what stands where no door fits that is left: the widest one of the home's that does, or a narrower one."""
    return max((width for width in widths if width <= clear_m), default=max(round(clear_m, 2), MIN_DOOR_M))


def _aligned(rects: list[Rect], pair: tuple[int, int], upright: bool, first: bool) -> bool:
    """Whether both rectangles of a border end where it starts (``first``) or ends."""
    side = (1 if upright else 0) + (0 if first else 2)
    return abs(rects[pair[0]][side] - rects[pair[1]][side]) < NEAR_M


def _place(rng: np.random.Generator) -> float:
    """Draw where along a wall a door is, 0 to 1: near a corner, in the middle, anywhere."""
    draw = rng.random()
    if draw < _AT_CORNER:
        near = float(abs(rng.normal(0.0, 0.12)))
        return min(near, 1.0) if rng.random() < 0.5 else max(1.0 - near, 0.0)
    return 0.5 if draw < _AT_CORNER + _IN_MIDDLE else float(rng.random())


def _cost(one: str | None, other: str | None, rng: np.random.Generator) -> float:
    """Return how unlikely a door between two rooms is, whatever other doors they have."""
    return 2.0 * ENDS.get(one or "", 0.0) * ENDS.get(other or "", 0.0) - float(rng.gumbel())


def across(line: float, low: float, high: float, wall_m: float, *, upright: bool) -> Rect:
    """Return the gap in a wall on a line, from one room's face to the other's and a little into both."""
    half = wall_m / 2 + 1e-3
    return (line - half, low, line + half, high) if upright else (low, line - half, high, line + half)
