"""How spaces are joined: walls that are left out, so that two rectangles are one space, and a tree of doors.

Published houses are trees of rooms: their outline has no holes, and whatever wall stood free between two ways round
was lost with them. Made ones are, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pipeline.sources.homes.slicing import borders
from pipeline.sources.homes.values import Rect
from pipeline.sources.homes.wishes import door_width, hub_of

CORNER_M = 0.06
"""A door's jamb stands so far from a wall's face at least."""
LEAST_DOOR_M, LEAST_WIDTH_M = 0.72, 0.5
_AT_CORNER, _IN_MIDDLE = 0.1, 0.25
_AGAIN, _AGAIN_SHARES, _DRAWS = (0.95, 0.6, 0.2), (0.28, 0.27, 0.45), 8
_LONG_M, _WIDER = 2.2, 0.05
"""A border so long takes any door; some more of these are wide ones, for the many borders that take none."""
_Way: TypeAlias = tuple[tuple[int, int], tuple[float, float, float, bool]]
HUB, RICHER = 1.3, 1.6
"""How much the label of a room, and a door that it has, speak for another door."""
ENDS = {"Bathroom": 0.7, "Toilet": 0.9, "Storage": 0.8, "Wardrobe": 0.9, "Balcony": 0.8, "Garage": 0.6, "Loggia": 0.8}


@dataclass(frozen=True)
class Joint:
    """A gap in the wall between rectangles ``pair``: its freed area."""

    pair: tuple[int, int]
    gap: Rect


def doors(
    rects: list[Rect], space_of: list[int], labels: list[str | None], wall_m: float, rng: np.random.Generator
) -> list[Joint] | None:
    """Join all spaces by a tree of doors, through the walls that people would choose; None where some stay apart.

    The tree grows from a hub: of all walls between what is joined and what is not, the one is taken whose rooms are
    likeliest to have many doors; a room that has some gets more.
    """
    ways: dict[tuple[int, int], list[_Way]] = {}
    for pair, at in borders(rects).items():
        one, other = space_of[pair[0]], space_of[pair[1]]
        clear = at[2] - at[1] - wall_m - 2 * CORNER_M
        if one != other and clear >= LEAST_DOOR_M:
            ways.setdefault((min(one, other), max(one, other)), []).append((pair, at))
    count = max(space_of) + 1
    reach = np.zeros(count)
    for one, other in ways:
        reach[[one, other]] += 1.0
    pull = np.array([HUB * hub_of(label) for label in labels]) + 0.5 * reach + rng.gumbel(size=count)
    inside, degree = {int(np.argmax(pull))}, np.zeros(count)
    found: list[Joint] = []
    widths = _Widths(float(rng.choice(_AGAIN, p=_AGAIN_SHARES)), [])
    while len(inside) < count:
        edges = [(one, other) for one, other in ways if (one in inside) != (other in inside)]
        if not edges:
            return None
        costs = [
            _cost(labels[a], labels[b], rng) - pull[a] - pull[b] - RICHER * (degree[a] + degree[b]) for a, b in edges
        ]
        one, other = edges[int(np.argmin(costs))]
        degree[[one, other]] += 1.0
        inside |= {one, other}
        found.append(_door(ways[one, other], widths, wall_m, rng))
    return found


@dataclass
class _Widths:
    """Widths of one house's doors: most houses have doors of many widths, some of one."""

    again: float
    before: list[float]

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a width: that of a door before, but for a centimetre, or any."""
        if self.before and rng.random() < self.again:
            return self.before[int(rng.integers(len(self.before)))] + float(rng.integers(-1, 2)) / 100
        return door_width(rng)


def _door(ways: list[_Way], widths: _Widths, wall_m: float, rng: np.random.Generator) -> Joint:
    """Put a door into the longest border of two spaces; doors of one house are often equally wide."""
    pair, (line, start, end, upright) = max(ways, key=lambda way: way[1][2] - way[1][1])
    low, high = start + wall_m / 2 + CORNER_M, end - wall_m / 2 - CORNER_M
    for _ in range(_DRAWS):
        width = widths.draw(rng)
        if width <= high - low:
            break
    if high - low > _LONG_M and rng.random() < _WIDER:
        width = min(door_width(rng, least_m=1.5), high - low)
    width = max(min(width, high - low), LEAST_WIDTH_M)
    widths.before.append(width)
    at = low + (high - low - width) * _place(rng)
    return Joint(pair, across(line, at, at + width, wall_m, upright=upright))


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
