"""Lay rooms out as homes are: along a corridor, round a core, in wings. Returns cells in whole centimetres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.affinity import affine_transform

from pipeline.sources.procedural.program import corridor_words
from pipeline.sources.procedural.slicing import Placed, Rect, divide, misfit, row, shared_out
from pipeline.sources.procedural.values import Cell, Spec

_TRIES = 24
_MISFIT_CM = 10.0
_RING_SHARE = 0.55


@dataclass
class _Block:
    """A full rectangle of rooms, its corner at the origin, and the corridors in it."""

    width: int
    height: int
    placed: Placed
    corridors: list[tuple[shapely.Polygon, tuple[str, ...]]]
    feature: str


def lay_out(specs: list[Spec], rng: np.random.Generator) -> tuple[list[Cell], int | None, str]:
    """Place rooms; corridors take the place of some of them.

    Returns
    -------
    cells : list of Cell
        In cm, disjoint; all but the tips of wings lie within y from 0 to the main block's height.
    wing_from : int or None
        The height (cm) at which wings begin, None without wings.
    feature : str
        "ring" where a corridor closes round a core, else the name of the layout.
    """
    ring = len(specs) >= 6 and rng.random() < _RING_SHARE  # chosen once: of many tries most rings would lose
    best = _attempt(list(specs), ring, rng)
    for _ in range(_TRIES):
        if best[0] <= _MISFIT_CM:
            break
        best = min(best, _attempt(list(specs), ring, rng), key=lambda attempt: attempt[0])
    return _cells(best[1], best[2]), (best[1][0].height if len(best[1]) > 1 else None), best[3]


def _attempt(specs: list[Spec], ring: bool, rng: np.random.Generator) -> tuple[float, list[_Block], list[Rect], str]:
    """Return one layout: how badly it fits, its blocks, where they stand, its name."""
    n_wings = int(rng.choice([0, 1, 2], p=[0.45, 0.42, 0.13])) if len(specs) >= 9 else int(rng.random() < 0.4)
    if len(specs) < (8 if ring else 5):
        n_wings = 0
    parts = shared_out(specs, [1.0] + [rng.uniform(0.3, 0.55) for _ in range(n_wings)], rng)
    main = _ring(parts[0], rng) if ring and len(parts[0]) >= 6 else _block(parts[0], rng)
    blocks, places = [main], [(0, 0, main.width, main.height)]
    penalty = max(misfit(main.placed), _stretched(main))
    for k, part in enumerate(part for part in parts[1:] if part):
        width = int(main.width * rng.uniform(0.34, 0.38 if n_wings == 2 else 0.6))
        wing = _block(part, rng, width)
        left = 0 if k == 0 else main.width - width
        if n_wings == 1 and rng.random() < 0.4:  # a T
            left = int((main.width - width) * rng.uniform(0.25, 0.75))
        penalty = max(penalty, misfit(wing.placed), _stretched(wing), 220.0 - wing.height)
        blocks.append(wing)
        places.append((left, main.height, left + width, main.height + wing.height))
    shape = ("", "wing ", "two wings ")[len(blocks) - 1]
    return penalty, blocks, places, shape + main.feature


def _stretched(block: _Block) -> float:
    """Return how far a block is from a shape that people build, as ``misfit`` does: up to 2.2 times as long as wide."""
    short, long = sorted((block.width, block.height))
    return 60.0 * (long / max(short, 1) - 2.2)


def _block(specs: list[Spec], rng: np.random.Generator, width: int | None = None) -> _Block:
    """Lay out one rectangle; ``width`` fixes one side of it."""
    area = sum(spec.area for spec in specs) * 1e4
    if width is None:
        width = round(np.sqrt(area * rng.uniform(0.75, 2.0)))
    if len(specs) < 5:
        height = round(area / width)
        return _Block(width, height, divide((0, 0, width, height), specs, rng), [], "plain")
    return _spine(specs, width, rng)


def _spine(specs: list[Spec], width: int, rng: np.random.Generator) -> _Block:
    """Lay rooms along a corridor, on both sides of it or on one, and often a large one across an end."""
    words = corridor_words(rng)
    specs.remove(min(specs, key=lambda spec: abs(spec.area - 9.0)))  # the corridor is a room, too
    lane = int(rng.integers(100, 165))
    height = round(sum(spec.area for spec in specs) * 1e4 / width) + lane
    if height > 1.25 * width:  # runs the other way
        turned = _straight(specs, height, width, lane, rng)
        placed = [((y1, x1, y2, x2), spec) for (x1, y1, x2, y2), spec in turned[0]]
        (x1, y1, x2, y2) = turned[1]
        return _Block(width, height, placed, [(shapely.box(y1, x1, y2, x2), words)], "spine")
    placed, corridor = _straight(specs, width, height, lane, rng)
    return _Block(width, height, placed, [(shapely.box(*corridor), words)], "spine")


def _straight(specs: list[Spec], width: int, height: int, lane: int, rng: np.random.Generator) -> tuple[Placed, Rect]:
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
        return placed + row((start, lane, end, height), specs, rng), (start, 0, end, lane)
    low = round(depth * rng.uniform(0.38, 0.62))
    below, above = shared_out(specs, [low, depth - low], rng)
    placed += row((start, 0, end, low), below, rng) + row((start, low + lane, end, height), above, rng)
    return placed, (start, low, end, low + lane)


def _ring(specs: list[Spec], rng: np.random.Generator) -> _Block:
    """Lay a corridor round a core of small rooms, and other rooms round it on two, three or four sides."""
    words = corridor_words(rng)
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
    dealt = shared_out(outer, [1.2, 1.2, 0.8, 0.8][:n_sides], rng)
    below, above, left, right = dealt + [[] for _ in range(4 - n_sides)]
    wide_l, wide_r = (round(sum(spec.area for spec in side) * 1e4 / ring_h) for side in (left, right))
    width = wide_l + ring_w + wide_r
    low, high = (round(sum(spec.area for spec in side) * 1e4 / width) for side in (below, above))
    y1, y2, x1, x2 = low, low + ring_h, wide_l, wide_l + ring_w
    hole = (x1 + lane, y1 + lane, x2 - lane, y2 - lane)
    placed = divide(hole, core, rng)
    placed += row((0, 0, width, low), below, rng) + row((0, y2, width, y2 + high), above, rng)
    for side, rect in ((left, (0, y1, x1, y2)), (right, (x2, y1, width, y2))):
        if side:
            placed += divide(rect, side, rng, across=False)
    corridor = shapely.box(x1, y1, x2, y2).difference(shapely.box(*hole))
    return _Block(width, y2 + high, placed, [(corridor, words)], "ring")


def _cells(blocks: list[_Block], places: list[Rect]) -> list[Cell]:
    cells = []
    for block, (x, y, _, _) in zip(blocks, places, strict=True):
        shift = [1, 0, 0, 1, x, y]
        cells += [Cell(affine_transform(shapely.box(*rect), shift), spec.words) for rect, spec in block.placed]
        cells += [Cell(affine_transform(polygon, shift), words, "corridor") for polygon, words in block.corridors]
    return cells
