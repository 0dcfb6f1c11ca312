"""Divide rectangles among rooms by area. Whole centimetres, so that neighbours share their borders exactly."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from pipeline.sources.procedural.values import Spec

Rect: TypeAlias = tuple[int, int, int, int]
"""x1, y1, x2, y2 in cm."""
Placed: TypeAlias = list[tuple[Rect, Spec]]


def divide(rect: Rect, specs: list[Spec], rng: np.random.Generator, across: bool | None = None) -> Placed:
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
    return divide(halves[0], first, rng) + divide(halves[1], rest, rng)


def row(rect: Rect, specs: list[Spec], rng: np.random.Generator) -> Placed:
    """Set rooms side by side in x, each as deep as the rectangle; rooms too small for that stand behind one another."""
    if not specs:
        return []
    x1, y1, x2, y2 = rect
    groups = _grouped(specs, max(y2 - y1, 1))  # a misfit may have no depth at all
    groups = [groups[i] for i in rng.permutation(len(groups))]
    areas = np.array([sum(spec.area for spec in group) for group in groups])
    cuts = x1 + np.round(np.concatenate([[0.0], np.cumsum(areas) / areas.sum()]) * (x2 - x1)).astype(int)
    placed: Placed = []
    for group, left, right in zip(groups, cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        placed += divide((left, y1, right, y2), group, rng, across=False)
    return placed


def shared_out(specs: list[Spec], shares: list[float], rng: np.random.Generator) -> list[list[Spec]]:
    """Deal rooms to places so that their areas are about in proportion to ``shares``; none stays empty if possible."""
    total = sum(spec.area for spec in specs)
    left = np.array(shares) / sum(shares) * total
    groups: list[list[Spec]] = [[] for _ in shares]
    for i in sorted(range(len(specs)), key=lambda i: -specs[i].area * float(rng.uniform(0.8, 1.25))):
        k = int(np.argmax(left))
        groups[k].append(specs[i])
        left[k] -= specs[i].area
    return groups


def misfit(placed: Placed) -> float:
    """Return how badly rooms fit, or 0 if each is wide enough and none is much longer than wide."""
    worst = 0.0
    for (x1, y1, x2, y2), spec in placed:
        short, long = sorted((x2 - x1, y2 - y1))
        worst = max(worst, spec.side - short, 60.0 * (long / max(short, 1) - 2.8))
    return worst


def _grouped(specs: list[Spec], depth: int) -> list[list[Spec]]:
    groups = [[spec] for spec in specs if spec.area * 1e4 / depth >= spec.side]
    behind: list[Spec] = []
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
