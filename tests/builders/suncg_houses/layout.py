"""Draw a generated storey's rooms (labels, areas), and lay them out along a corridor, round a core or in wings, in cm.

Numbers and labels follow the published counts. Rooms lie along a corridor, round a core, or in wings, as in homes.
Cells are in whole centimetres, so that neighbours share their borders exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely.affinity import affine_transform

from tests.builders.suncg_houses.values import Cell, RoomSpec

# Plans with 1, 2, ... 30 rooms among 33,717 published ones.
_ROOM_COUNTS: Final = np.fromstring(
    "603 1590 2339 3239 4019 4276 3921 3239 2710 2044 1466 1120 801 547 431 "
    "287 214 191 121 103 74 66 60 34 35 26 13 30 18 8",
    sep=" ",
)


class _Kind(NamedTuple):
    """Rooms of this label over all of SUNCG; usual area, m2; narrowest side, cm; one more for every ``per`` rooms."""

    label: str
    published: int
    area: float
    side: int
    per: int


# Hallways come with corridors (layout), Aeration with shafts (difficulties): neither is drawn here.
_KINDS: Final = (
    _Kind("Bedroom", 68334, 15.0, 240, 2),
    _Kind("Room", 60354, 12.0, 180, 3),
    _Kind("Bathroom", 51078, 6.5, 150, 4),
    _Kind("Toilet", 43961, 3.0, 100, 5),
    _Kind("Kitchen", 36427, 13.0, 210, 14),
    _Kind("Living_Room", 25693, 27.0, 300, 14),
    _Kind("Office", 19176, 13.0, 220, 7),
    _Kind("Dining_Room", 16456, 16.0, 260, 16),
    _Kind("Garage", 12664, 24.0, 280, 99),
    _Kind("Hall", 8029, 12.0, 200, 99),
    _Kind("Balcony", 5611, 6.0, 130, 8),
    _Kind("Child_Room", 5409, 13.0, 230, 5),
    _Kind("Gym", 5089, 22.0, 280, 99),
    _Kind("Wardrobe", 3470, 4.5, 130, 6),
    _Kind("Storage", 3411, 4.5, 120, 8),
    _Kind("Guest_Room", 2964, 14.0, 230, 10),
    _Kind("Terrace", 2504, 14.0, 200, 20),
    _Kind("Entryway", 2373, 7.0, 150, 99),
    _Kind("Lobby", 2352, 10.0, 180, 99),
    _Kind("Loggia", 1514, 6.0, 130, 10),
    _Kind("Boiler_room", 1098, 5.0, 150, 99),
    _Kind("Passenger_elevator", 299, 3.0, 140, 99),
    _Kind("Freight_elevator", 89, 5.0, 160, 99),
)
_HOMES: Final = {"Bedroom", "Room", "Living_Room", "Kitchen", "Office", "Gym"}  # a house has one of these at least
_UNNAMED_SHARE, _TWICE_NAMED_SHARE = 0.06, 0.04
_AREA_SPREAD = 0.28  # of a room's area about the usual one, as the standard deviation of its logarithm


def draw_room_count(rng: np.random.Generator, least: int = 1) -> int:
    """Draw a number of rooms, ``least`` or more."""
    weights = _ROOM_COUNTS[least - 1 :]
    return least + int(rng.choice(len(weights), p=weights / weights.sum()))


def draw_rooms(number: int, rng: np.random.Generator) -> list[RoomSpec]:
    """Draw ``number`` rooms: labels by published counts, none more often than a house of that size has it."""
    taken = [0] * len(_KINDS)
    specs = []
    size = float(rng.lognormal(0.0, 0.15))  # some houses are roomier than others
    for drawn in range(number):
        weights = np.array(
            [
                kind.published if taken[i] < 1 + number // kind.per and (drawn or kind.label in _HOMES) else 0
                for i, kind in enumerate(_KINDS)
            ],
            dtype=np.float64,
        )
        index = int(rng.choice(len(_KINDS), p=weights / weights.sum()))
        taken[index] += 1
        kind = _KINDS[index]
        area = kind.area * size * float(np.clip(rng.lognormal(0.0, _AREA_SPREAD), 0.6, 1.8))
        specs.append(RoomSpec(_words(kind.label, rng), area, kind.side))
    return specs


def draw_corridor_labels(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw what a corridor is called."""
    return (("Hallway",), ("Hallway",), ("Hallway",), ("Hall",), ("Room",), ())[int(rng.integers(6))]


def _words(label: str, rng: np.random.Generator) -> tuple[str, ...]:
    draw = rng.random()
    if draw < _UNNAMED_SHARE:
        return ()
    second = {"Bathroom": "Toilet", "Living_Room": "Dining_Room", "Bedroom": "Office", "Kitchen": "Dining_Room"}
    if draw < _UNNAMED_SHARE + 2 * _TWICE_NAMED_SHARE and label in second:
        return label, second[label]
    return (label,)


# Divide rectangles among rooms by area. Whole centimetres, so that neighbours share their borders exactly.


Rect: TypeAlias = tuple[int, int, int, int]
"""x1, y1, x2, y2 in cm."""
Placed: TypeAlias = list[tuple[Rect, RoomSpec]]


def divide_rectangle(rect: Rect, specs: list[RoomSpec], rng: np.random.Generator, across: bool | None = None) -> Placed:
    """Cut a rectangle in two again and again, mostly across its longer side; ``across`` fixes the first cut (x cut)."""
    if len(specs) == 1:
        return [(rect, specs[0])]
    x1, y1, x2, y2 = rect
    order = [specs[i] for i in rng.permutation(len(specs))]
    sums = np.cumsum([spec.area for spec in order])
    shares = sums[:-1] / sums[-1]
    index = int(np.argmin(np.abs(shares - rng.uniform(0.35, 0.65))))
    first, rest = order[: index + 1], order[index + 1 :]
    if across is None:
        across = bool((x2 - x1 >= y2 - y1) != (rng.random() < 0.08))
    if across:
        cut = x1 + round((x2 - x1) * float(shares[index]))
        halves: tuple[Rect, Rect] = (x1, y1, cut, y2), (cut, y1, x2, y2)
    else:
        cut = y1 + round((y2 - y1) * float(shares[index]))
        halves = (x1, y1, x2, cut), (x1, cut, x2, y2)
    return divide_rectangle(halves[0], first, rng) + divide_rectangle(halves[1], rest, rng)


def place_side_by_side(rect: Rect, specs: list[RoomSpec], rng: np.random.Generator) -> Placed:
    """Set rooms side by side in x, each as deep as the rectangle; rooms too small for that stand behind one another."""
    if not specs:
        return []
    x1, y1, x2, y2 = rect
    groups = _group_specs(specs, max(y2 - y1, 1))  # a misfit may have no depth at all
    groups = [groups[i] for i in rng.permutation(len(groups))]
    areas = np.array([sum(spec.area for spec in group) for group in groups])
    cuts = x1 + np.round(np.concatenate([[0.0], np.cumsum(areas) / areas.sum()]) * (x2 - x1)).astype(int)
    placed: Placed = []
    for group, left, right in zip(groups, cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        placed += divide_rectangle((left, y1, right, y2), group, rng, across=False)
    return placed


def distribute_rooms(specs: list[RoomSpec], shares: list[float], rng: np.random.Generator) -> list[list[RoomSpec]]:
    """Distribute rooms over places, roughly in proportion to ``shares``; no place stays empty if that is possible."""
    total = sum(spec.area for spec in specs)
    left = np.array(shares) / sum(shares) * total
    groups: list[list[RoomSpec]] = [[] for _ in shares]
    for i in sorted(range(len(specs)), key=lambda i: -specs[i].area * float(rng.uniform(0.8, 1.25))):
        k = int(np.argmax(left))
        groups[k].append(specs[i])
        left[k] -= specs[i].area
    return groups


def misfit_score(placed: Placed) -> float:
    """Return how badly rooms fit, or 0 if each is wide enough and none is much longer than wide."""
    worst = 0.0
    for (x1, y1, x2, y2), spec in placed:
        short, long = sorted((x2 - x1, y2 - y1))
        worst = max(worst, spec.side - short, 60.0 * (long / max(short, 1) - 2.8))
    return worst


def _group_specs(specs: list[RoomSpec], depth: int) -> list[list[RoomSpec]]:
    groups = [[spec] for spec in specs if spec.area * 1e4 / depth >= spec.side]
    behind: list[RoomSpec] = []
    for spec in specs:
        if spec.area * 1e4 / depth >= spec.side:
            continue
        behind.append(spec)
        if sum(each.area for each in behind) * 1e4 / depth >= max(each.side for each in behind):
            groups.append(behind)
            behind = []
    if behind and groups:
        groups[-1] = groups[-1] + behind
    elif behind:
        groups.append(behind)
    return groups


# Lay rooms out as homes are: along a corridor, round a core, in wings. Returns cells in whole centimetres.


_LAYOUT_TRIES = 24
_MISFIT_CM = 10.0
_RING_SHARE = 0.55


@dataclass
class _Block:
    """A full rectangle of rooms, its corner at the origin, and the corridors in it."""

    width: int
    height: int
    placed: Placed
    corridors: list[tuple[shapely.Polygon, tuple[str, ...]]]


def lay_out_rooms(specs: list[RoomSpec], rng: np.random.Generator) -> tuple[list[Cell], int | None]:
    """Place rooms; corridors take the place of some of them.

    Returns
    -------
    cells : list of Cell
        In cm, disjoint; all but the tips of wings lie within y from 0 to the main block's height.
    wing_from : int or None
        The height (cm) at which wings begin, None without wings.
    """
    ring = len(specs) >= 6 and rng.random() < _RING_SHARE  # chosen once: of many tries most rings would lose
    best = _attempt(list(specs), ring, rng)
    for _ in range(_LAYOUT_TRIES):
        if best[0] <= _MISFIT_CM:
            break
        best = min(best, _attempt(list(specs), ring, rng), key=lambda attempt: attempt[0])
    return _cells(best[1], best[2]), (best[1][0].height if len(best[1]) > 1 else None)


def _attempt(specs: list[RoomSpec], ring: bool, rng: np.random.Generator) -> tuple[float, list[_Block], list[Rect]]:
    """Return one layout: how badly it fits, its blocks, where they stand."""
    n_wings = int(rng.choice([0, 1, 2], p=[0.45, 0.42, 0.13])) if len(specs) >= 9 else int(rng.random() < 0.4)
    if len(specs) < (8 if ring else 5):
        n_wings = 0
    parts = distribute_rooms(specs, [1.0] + [rng.uniform(0.3, 0.55) for _ in range(n_wings)], rng)
    main = _ring(parts[0], rng) if ring and len(parts[0]) >= 6 else _block(parts[0], rng)
    blocks, places = [main], [(0, 0, main.width, main.height)]
    penalty = max(misfit_score(main.placed), _excess_length(main))
    for k, part in enumerate(part for part in parts[1:] if part):
        width = int(main.width * rng.uniform(0.34, 0.38 if n_wings == 2 else 0.6))
        wing = _block(part, rng, width)
        left = 0 if k == 0 else main.width - width
        if n_wings == 1 and rng.random() < 0.4:  # a T
            left = int((main.width - width) * rng.uniform(0.25, 0.75))
        penalty = max(penalty, misfit_score(wing.placed), _excess_length(wing), 220.0 - wing.height)
        blocks.append(wing)
        places.append((left, main.height, left + width, main.height + wing.height))
    return penalty, blocks, places


def _excess_length(block: _Block) -> float:
    """Return how far a block is from a usual shape, as ``misfit_score`` does: up to 2.2 times as long as wide."""
    short, long = sorted((block.width, block.height))
    return 60.0 * (long / max(short, 1) - 2.2)


def _block(specs: list[RoomSpec], rng: np.random.Generator, width: int | None = None) -> _Block:
    """Lay out one rectangle; ``width`` fixes one side of it."""
    area = sum(spec.area for spec in specs) * 1e4
    if width is None:
        width = round(np.sqrt(area * rng.uniform(0.75, 2.0)))
    if len(specs) < 5:
        height = round(area / width)
        return _Block(width, height, divide_rectangle((0, 0, width, height), specs, rng), [])
    return _spine(specs, width, rng)


def _spine(specs: list[RoomSpec], width: int, rng: np.random.Generator) -> _Block:
    """Lay rooms along a corridor, on both sides of it or on one, and often a large one across an end."""
    words = draw_corridor_labels(rng)
    specs.remove(min(specs, key=lambda spec: abs(spec.area - 9.0)))  # the corridor is a room, too
    lane = int(rng.integers(100, 165))
    height = round(sum(spec.area for spec in specs) * 1e4 / width) + lane
    if height > 1.25 * width:  # runs the other way
        turned = _straight(specs, height, width, lane, rng)
        placed = [((y1, x1, y2, x2), spec) for (x1, y1, x2, y2), spec in turned[0]]
        (x1, y1, x2, y2) = turned[1]
        return _Block(width, height, placed, [(shapely.box(y1, x1, y2, x2), words)])
    placed, corridor = _straight(specs, width, height, lane, rng)
    return _Block(width, height, placed, [(shapely.box(*corridor), words)])


def _straight(
    specs: list[RoomSpec], width: int, height: int, lane: int, rng: np.random.Generator
) -> tuple[Placed, Rect]:
    """Place a corridor in x, and rooms along it."""
    placed: Placed = []
    start, end = 0, width
    if rng.random() < 0.6:
        head = max(specs, key=lambda spec: spec.area)
        specs = [spec for spec in specs if spec is not head]
        across = min(round(head.area * 1e4 / height), width // 2)
        at_start = rng.random() < 0.5
        placed.append(((0, 0, across, height) if at_start else (width - across, 0, width, height), head))
        start, end = (across, width) if at_start else (0, width - across)
    depth = height - lane
    if depth < 470 or len(specs) < 3 or rng.random() < 0.12:
        return placed + place_side_by_side((start, lane, end, height), specs, rng), (start, 0, end, lane)
    low = round(depth * rng.uniform(0.38, 0.62))
    below, above = distribute_rooms(specs, [low, depth - low], rng)
    placed += place_side_by_side((start, 0, end, low), below, rng) + place_side_by_side(
        (start, low + lane, end, height), above, rng
    )
    return placed, (start, low, end, low + lane)


def _ring(specs: list[RoomSpec], rng: np.random.Generator) -> _Block:
    """Lay a corridor round a core of small rooms, and other rooms round it on two, three or four sides."""
    words = draw_corridor_labels(rng)
    specs = sorted(specs, key=lambda spec: spec.area)
    specs.remove(min(specs, key=lambda spec: abs(spec.area - 9.0)))
    lane = int(rng.integers(95, 145))
    n_core = 1 if len(specs) < 9 else int(rng.integers(1, 3))
    core, outer = specs[:n_core], specs[n_core:]
    area = sum(spec.area for spec in core) * 1e4
    core_w = round(np.sqrt(area * rng.uniform(0.8, 1.8)))
    core_h = round(area / core_w)
    ring_w, ring_h = core_w + 2 * lane, core_h + 2 * lane
    n_sides = min(4, len(outer), int(rng.integers(2, 5)) if len(outer) < 7 else 4)
    dealt = distribute_rooms(outer, [1.2, 1.2, 0.8, 0.8][:n_sides], rng)
    below, above, left, right = dealt + [[] for _ in range(4 - n_sides)]
    wide_l, wide_r = (round(sum(spec.area for spec in side) * 1e4 / ring_h) for side in (left, right))
    width = wide_l + ring_w + wide_r
    low, high = (round(sum(spec.area for spec in side) * 1e4 / width) for side in (below, above))
    y1, y2, x1, x2 = low, low + ring_h, wide_l, wide_l + ring_w
    hole = (x1 + lane, y1 + lane, x2 - lane, y2 - lane)
    placed = divide_rectangle(hole, core, rng)
    placed += place_side_by_side((0, 0, width, low), below, rng) + place_side_by_side(
        (0, y2, width, y2 + high), above, rng
    )
    for side, rect in ((left, (0, y1, x1, y2)), (right, (x2, y1, width, y2))):
        if side:
            placed += divide_rectangle(rect, side, rng, across=False)
    corridor = shapely.box(x1, y1, x2, y2).difference(shapely.box(*hole))
    return _Block(width, y2 + high, placed, [(corridor, words)])


def _cells(blocks: list[_Block], places: list[Rect]) -> list[Cell]:
    cells = []
    for block, (x, y, _, _) in zip(blocks, places, strict=True):
        shift = [1, 0, 0, 1, x, y]
        cells += [Cell(affine_transform(shapely.box(*rect), shift), spec.words) for rect, spec in block.placed]
        cells += [Cell(affine_transform(polygon, shift), words, "corridor") for polygon, words in block.corridors]
    return cells
