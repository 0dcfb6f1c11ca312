"""Make rooms of a home's rectangles (some L-shaped, some with a wall's end in them), and join them by a tree of doors.

Published houses are trees of rooms: their outlines have no holes, and a wall that stood free between two ways round is
lost. Made houses are trees, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pipeline.sources.homes.slicing import shared_borders
from pipeline.sources.homes.values import Rect, snap_wall_line
from pipeline.sources.homes.wishes import extra_doors
from pipeline.tolerances import SAME

DOOR_CORNER_M = 0.06
"""A door's jamb stands so far from a wall's face, or is flush with it."""
BORDER_M = 0.72
"""The least clear width that a border must have to take a door."""
NARROWEST_MADE_DOOR_M = 0.5
"""No door is narrower: a robot of 0.2 m passes each with some room to spare."""
_AT_CORNER, _IN_MIDDLE = 0.1, 0.25
_NARROW_WEIGHT = 2.0
"""How much it counts that a wall has no room for the narrowest door that is asked for, half as much for the widest."""
_OF_FLUSH, _OF_FLUSH_ON_BOTH = 2, 4
_Way: TypeAlias = tuple[tuple[int, int], tuple[float, float, float, bool]]
HUB, RICHER = 1.3, 1.8
"""How much the label of a room, and a door that it has, speak for another door."""
ENTRANCE, ENTERED = "Entryway", 1.1
"""How much more than its doors that label speaks for another one: rooms lie round the one that is entered."""
ENDS = {"Bathroom": 0.7, "Toilet": 0.9, "Storage": 0.8, "Wardrobe": 0.9, "Balcony": 0.8, "Garage": 0.6, "Loggia": 0.8}


@dataclass(frozen=True)
class WallGap:
    """A gap in the wall between rectangles ``pair``: its freed area."""

    pair: tuple[int, int]
    gap: Rect


@dataclass(frozen=True)
class DoorWishes:
    """What is asked of the doors: their widths, ascending.

    ``fewer`` are corners less than four a door where a jamb is flush with a room's side.
    """

    widths: tuple[float, ...]
    fewer: int
    wall_m: float


def join_spaces_by_doors(
    rects: list[Rect], space_of: list[int], labels: list[str | None], asked: DoorWishes, rng: np.random.Generator
) -> list[WallGap] | None:
    """Join all spaces by a tree of doors, through the walls that people would choose, or None if some stay apart.

    The tree grows from a hub: of all walls between what is joined and what is not, the one is taken whose rooms are
    likeliest to have many doors; a room that has some gets more.
    """
    ways: dict[tuple[int, int], _Way] = {}
    for pair, at in shared_borders(rects).items():
        one, other = sorted((space_of[pair[0]], space_of[pair[1]]))
        if one != other and _widest_door(at, asked.wall_m) >= BORDER_M:
            known = ways.get((one, other))
            if known is None or at[2] - at[1] > known[1][2] - known[1][1]:  # into the longest border of two spaces
                ways[one, other] = pair, at
    count = max(space_of) + 1
    reach = np.zeros(count)
    for one, other in ways:
        reach[[one, other]] += 1.0
    pull = np.array([HUB * extra_doors(label) + ENTERED * (label == ENTRANCE) for label in labels])
    pull += 0.5 * reach + rng.gumbel(size=count)
    inside, degree = {int(np.argmax(pull))}, np.zeros(count)
    found: list[_Way] = []
    while len(inside) < count:
        edges = [(one, other) for one, other in ways if (one in inside) != (other in inside)]
        if not edges:
            return None
        costs = [
            _cost(labels[a], labels[b], rng)
            + _NARROW_WEIGHT * _lacking(_widest_door(ways[a, b][1], asked.wall_m), asked.widths)
            - pull[a]
            - pull[b]
            - RICHER * (degree[a] + degree[b])
            for a, b in edges
        ]
        one, other = edges[int(np.argmin(costs))]
        degree[[one, other]] += 1.0
        inside |= {one, other}
        found.append(ways[one, other])
    return _place_joints(found, rects, asked, rng)


def _lacking(clear_m: float, widths: tuple[float, ...]) -> float:
    """Return how unfit a border is for the doors that are asked for."""
    return float(clear_m < widths[0]) + 0.5 * float(clear_m < widths[-1])


def _widest_door(at: tuple[float, float, float, bool], wall_m: float) -> float:
    """Return how wide a door may be in a border."""
    return at[2] - at[1] - wall_m - 2 * DOOR_CORNER_M


def _place_joints(ways: list[_Way], rects: list[Rect], asked: DoorWishes, rng: np.random.Generator) -> list[WallGap]:
    """Deal the widths to the borders, the widest door first, and place each; some jambs are flush with a side wall."""
    widths: dict[int, float] = {}
    for width in asked.widths[::-1]:
        left = [k for k in range(len(ways)) if k not in widths]
        fit = [k for k in left if _widest_door(ways[k][1], asked.wall_m) >= width]
        k = fit[int(rng.integers(len(fit)))] if fit else max(left, key=lambda k: _widest_door(ways[k][1], asked.wall_m))
        widths[k] = width if fit else _instead(_widest_door(ways[k][1], asked.wall_m), asked.widths)
    found, fewer = [], asked.fewer
    for k in range(len(ways)):
        pair, (line, start, end, upright) = ways[k]
        low, high = start + asked.wall_m / 2, end - asked.wall_m / 2
        if fewer >= _OF_FLUSH:
            first = bool(rng.random() < 0.5)
            at = low if first else high - widths[k]
            fewer -= _OF_FLUSH_ON_BOTH if _are_aligned(rects, pair, upright, first) else _OF_FLUSH
        else:
            low, high = low + DOOR_CORNER_M, high - DOOR_CORNER_M
            at = low + (high - low - widths[k]) * _draw_position(rng)
        at = round(at, 2)
        found.append(WallGap(pair, wall_gap_rectangle(line, at, at + widths[k], asked.wall_m, upright=upright)))
    return found


def _instead(clear_m: float, widths: tuple[float, ...]) -> float:
    """Return what stands where no door fits that is left: the widest one of the home's that does, or a narrower one."""
    return max((width for width in widths if width <= clear_m), default=max(round(clear_m, 2), NARROWEST_MADE_DOOR_M))


def _are_aligned(rects: list[Rect], pair: tuple[int, int], upright: bool, first: bool) -> bool:
    """Return whether both rectangles of a border end where it starts (``first``) or ends."""
    side = (1 if upright else 0) + (0 if first else 2)
    return abs(rects[pair[0]][side] - rects[pair[1]][side]) < SAME


def _draw_position(rng: np.random.Generator) -> float:
    """Draw where along a wall a door is, 0 to 1: near a corner, in the middle, anywhere."""
    draw = rng.random()
    if draw < _AT_CORNER:
        near = float(abs(rng.normal(0.0, 0.12)))
        return min(near, 1.0) if rng.random() < 0.5 else max(1.0 - near, 0.0)
    return 0.5 if draw < _AT_CORNER + _IN_MIDDLE else float(rng.random())


def _cost(one: str | None, other: str | None, rng: np.random.Generator) -> float:
    """Return how unlikely a door between two rooms is, whatever other doors they have."""
    return 2.0 * ENDS.get(one or "", 0.0) * ENDS.get(other or "", 0.0) - float(rng.gumbel())


def wall_gap_rectangle(line: float, low: float, high: float, wall_m: float, *, upright: bool) -> Rect:
    """Return the gap in a wall on a line, from one room's face to the other's and a little into both."""
    half = wall_m / 2 + 1e-3
    return (line - half, low, line + half, high) if upright else (low, line - half, high, line + half)


# Rooms that are no rectangles: an L round a smaller room, and walls that reach into a room. Areas stay what they are.
#
# A space is then several rectangles, joined where the wall between them is left out.


_CORNERS_OF_L, _CORNERS_OF_STUB = 2, 4
_SHARE_OF_L, _SPENT = 0.6, (0.7, 1.0)
_WAY_M, _MIN_M = 1.2, 0.9
WIDEST_MADE_M = 2.4
"""A gap wider than this is no door."""


@dataclass
class ShapedRooms:
    """Rectangles, the space of each, and the gaps between those of one space."""

    rects: list[Rect]
    space_of: list[int]
    gaps: list[WallGap]


def bend_rooms(rects: list[Rect], corners: int, wall_m: float, rng: np.random.Generator) -> ShapedRooms:
    """Give rooms about so many corners beyond four each."""
    found = ShapedRooms(list(rects), list(range(len(rects))), [])
    left = corners * float(rng.uniform(*_SPENT))
    for _ in range(corners):
        if left < _CORNERS_OF_L:
            break
        if rng.random() < _SHARE_OF_L:
            left -= _CORNERS_OF_L * _bend(found, wall_m, rng)
        elif left >= _CORNERS_OF_STUB:
            left -= _CORNERS_OF_STUB * _divide_by_stub(found, wall_m, rng)
        left -= 0.2
    return found


def join_to_one_space(rects: list[Rect], wall_m: float) -> ShapedRooms:
    """Join all rectangles to one space, each by a whole border, the longest ones; other walls between them stay."""
    ways = sorted(shared_borders(rects).items(), key=lambda way: way[1][1] - way[1][2])
    group = list(range(len(rects)))
    gaps = []
    for pair, (line, low, high, upright) in ways:
        one, other = group[pair[0]], group[pair[1]]
        if one != other:
            group = [one if g == other else g for g in group]
            gap = wall_gap_rectangle(line, low + wall_m / 2, high - wall_m / 2, wall_m, upright=upright)
            gaps.append(WallGap(pair, gap))
    return ShapedRooms(rects, [0] * len(rects), gaps)


def _bend(found: ShapedRooms, wall_m: float, rng: np.random.Generator) -> bool:
    """Let a room that has a whole side in common with a smaller one go round it, or False if none is fit."""
    alone = {k for k, space in enumerate(found.space_of) if found.space_of.count(space) == 1}
    pairs = [
        pair if _area(found.rects[pair[0]]) < _area(found.rects[pair[1]]) else pair[::-1]
        for pair, (_, low, high, upright) in shared_borders(found.rects).items()
        if alone >= {*pair} and all(_covers_side(found.rects[k], low, high, upright) for k in pair)
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
        cut_x, cut_y = snap_wall_line(cut_x, wall_m), snap_wall_line(cut_y, wall_m)
        found.rects[small] = _rect(x1 if left else x2, y1 if low else y2, cut_x, cut_y)
        found.rects[large] = _rect(x1 if left else x2, y2 if low else y1, cut_x, cut_y)
        found.rects.append(_rect(x2 if left else x1, y1, cut_x, y2))
        found.space_of.append(found.space_of[large])
        _, start, end, _ = shared_borders([found.rects[large], found.rects[-1]])[0, 1]
        gap = wall_gap_rectangle(cut_x, start + wall_m / 2, end - wall_m / 2, wall_m, upright=True)
        found.gaps.append(WallGap((large, len(found.rects) - 1), gap))
        return True
    return False


def _divide_by_stub(found: ShapedRooms, wall_m: float, rng: np.random.Generator) -> bool:
    """Divide a large room by a wall that leaves a wide gap at its end, or False if none is large enough."""
    alone = [k for k, space in enumerate(found.space_of) if found.space_of.count(space) == 1]  # no wall ends in a gap
    fit = [k for k in alone if min(_size(found.rects[k])) > WIDEST_MADE_M + 0.6 + wall_m]
    if not fit:
        return False
    areas = np.array([_area(found.rects[k]) for k in fit])
    k = fit[int(rng.choice(len(fit), p=areas / areas.sum()))]
    x1, y1, x2, y2 = found.rects[k]
    upright, share = bool(rng.random() < 0.5), float(rng.uniform(0.25, 0.75))
    line, low, high = (x1 + (x2 - x1) * share, y1, y2) if upright else (y1 + (y2 - y1) * share, x1, x2)
    line = snap_wall_line(line, wall_m)
    halves = ((x1, y1, line, y2), (line, y1, x2, y2)) if upright else ((x1, y1, x2, line), (x1, line, x2, y2))
    if min(min(_size(half)) for half in halves) < WIDEST_MADE_M / 2:
        return False
    found.rects[k] = halves[0]
    found.rects.append(halves[1])
    found.space_of.append(found.space_of[k])
    stub = round(float(rng.uniform(0.3, high - low - wall_m - WIDEST_MADE_M)), 2)
    low, high = low + wall_m / 2, high - wall_m / 2
    low, high = (low + stub, high) if rng.random() < 0.5 else (low, high - stub)
    found.gaps.append(WallGap((k, len(found.rects) - 1), wall_gap_rectangle(line, low, high, wall_m, upright=upright)))
    return True


def _covers_side(rect: Rect, low: float, high: float, upright: bool) -> bool:
    """Return whether a border takes up a whole side of a rectangle."""
    side = (rect[1], rect[3]) if upright else (rect[0], rect[2])
    return abs(side[0] - low) < SAME and abs(side[1] - high) < SAME


def _rect(x1: float, y1: float, x2: float, y2: float) -> Rect:
    return min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2)


def _size(rect: Rect) -> tuple[float, float]:
    return rect[2] - rect[0], rect[3] - rect[1]


def _area(rect: Rect) -> float:
    return (rect[2] - rect[0]) * (rect[3] - rect[1])
