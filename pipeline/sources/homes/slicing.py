"""Divide a box into one rectangle for each area (m2) by repeated cuts, then move outer sides in to give it its shape.

Rectangles share their borders, which are the centre lines of walls. What is cut off at the box's corners and sides
makes wings, recesses and steps, as where rooms of a floor planner are set beside each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from pipeline.sources.homes.values import Rect
from pipeline.tolerances import SAME, SPECK

MIN_SIDE_M = 0.9
_HUB = 0.4
"""How much it counts that no room has a border with all others."""
_NEAR_ENOUGH = 0.04
"""A layout this near to what is asked is taken at once."""


@dataclass(frozen=True)
class WantedRectangles:
    """Rectangles of these areas (m2, walls included) in a box; what they leave free of it lies at its edge."""

    width_m: float
    height_m: float
    areas_m2: tuple[float, ...]

    @property
    def void_m2(self) -> float:
        """What of the box is not house."""
        return max(self.width_m * self.height_m - sum(self.areas_m2), 0.0)


def slice_box(asked: WantedRectangles, door_m: float, tries: int, rng: np.random.Generator) -> list[Rect] | None:
    """Return one rectangle an area, in order, all joined by borders of ``door_m`` and more, or None if none is found.

    Of several tries the one is taken that is nearest to the areas and to the box, with the fewest narrow rooms.
    """
    best: tuple[float, list[Rect]] | None = None
    for _ in range(tries):
        rects = _attempt(asked, rng)
        cost = _cost(rects, asked)
        if best is not None and cost >= best[0]:
            continue  # without a look at its doors
        doors = _doorways(rects, door_m)
        if not is_connected(len(rects), doors) or _has_courtyard(rects):
            continue
        cost += _HUB * _without_hub(len(rects), doors)
        if best is None or cost < best[0]:
            best = cost, rects
        if cost < _NEAR_ENOUGH:
            break
    return None if best is None else best[1]


def shared_borders(rects: list[Rect]) -> dict[tuple[int, int], tuple[float, float, float, bool]]:
    """Return the border of each two rectangles that have one: where its line is, from, to, whether it is upright."""
    x1, y1, x2, y2 = np.array(rects).T
    found = {}
    for upright, a1, a2, b1, b2 in ((True, x1, x2, y1, y2), (False, y1, y2, x1, x2)):
        low, high = np.maximum(b1[:, None], b1), np.minimum(b2[:, None], b2)
        meets = (np.abs(a2[:, None] - a1) < SAME) & (high - low > SAME)  # the first ends where the second begins
        for i, j in np.argwhere(meets).tolist():
            found[min(i, j), max(i, j)] = (float(a2[i]), float(low[i, j]), float(high[i, j]), upright)
    return dict(sorted(found.items()))


def is_connected(count: int, ways: Iterable[tuple[int, int]]) -> bool:
    """Return whether these ways lead from any of ``count`` rectangles to any other."""
    group = list(range(count))
    for i, j in ways:
        one, other = group[i], group[j]
        if one != other:
            group = [one if g == other else g for g in group]
    return len(set(group)) == 1


def _doorways(rects: list[Rect], door_m: float) -> list[tuple[int, int]]:
    return [pair for pair, (_, low, high, _) in shared_borders(rects).items() if high - low >= door_m]


def _attempt(asked: WantedRectangles, rng: np.random.Generator) -> list[Rect]:
    """Cut the box, with some of what is not house as rectangles of their own, and pull outer sides for the rest."""
    n, void = len(asked.areas_m2), asked.void_m2
    share = void / (asked.width_m * asked.height_m)
    n_voids = int(rng.integers(0, min(1 + n // 2, 4))) if share > 0.06 else 0
    blocks = share if n == 1 else share * float(rng.uniform(0.3, 1.0)) if n_voids else 0.0
    cuts = rng.dirichlet(np.full(n_voids, 1.5)) * blocks if n_voids else np.zeros(0)
    pulls = np.zeros(n)
    if share - cuts.sum() > SPECK:  # the rest are walls: houses have no recess of a few centimetres
        chosen = rng.random(n) < rng.uniform(0.25, 0.8)
        chosen[int(rng.integers(n))] = True
        pulls = chosen * rng.uniform(0.2, 1.0, n) * np.array(asked.areas_m2)
        pulls *= (share - cuts.sum()) * asked.width_m * asked.height_m / pulls.sum()
    sizes = [*(np.array(asked.areas_m2) + pulls).tolist(), *(cuts * asked.width_m * asked.height_m).tolist()]
    placed: dict[int, Rect] = {}
    _divide((0.0, 0.0, asked.width_m, asked.height_m), list(range(len(sizes))), sizes, placed, rng)
    rects = [placed[k] for k in range(n)]
    _pull(rects, pulls, asked, rng)
    x1, y1, x2, y2 = _bounds(rects)
    if x1 > SAME or y1 > SAME or asked.width_m - x2 > SAME or asked.height_m - y2 > SAME:
        rects = _fill_box(rects, asked)
    return rects


def _divide(
    rect: Rect, order: list[int], sizes: list[float], placed: dict[int, Rect], rng: np.random.Generator
) -> None:
    """Cut a rectangle in two again and again, mostly across its longer side."""
    if len(order) == 1:
        placed[order[0]] = rect
        return
    x1, y1, x2, y2 = rect
    order = [order[i] for i in rng.permutation(len(order))]
    sums = np.cumsum([sizes[k] for k in order])
    shares = sums[:-1] / sums[-1]
    at = int(np.argmin(np.abs(shares - rng.uniform(0.3, 0.7))))
    share = float(shares[at])
    long = (x2 - x1) >= (y2 - y1)
    if long != (rng.random() < 0.12):
        cut = x1 + (x2 - x1) * share
        halves: tuple[Rect, Rect] = (x1, y1, cut, y2), (cut, y1, x2, y2)
    else:
        cut = y1 + (y2 - y1) * share
        halves = (x1, y1, x2, cut), (x1, cut, x2, y2)
    _divide(halves[0], order[: at + 1], sizes, placed, rng)
    _divide(halves[1], order[at + 1 :], sizes, placed, rng)


def _pull(rects: list[Rect], pulls: np.ndarray, asked: WantedRectangles, rng: np.random.Generator) -> None:
    """Move outer sides inward, each rectangle by its own area; one that lies inside keeps its own."""
    box = (0.0, 0.0, asked.width_m, asked.height_m)
    for k in np.flatnonzero(pulls > 0).tolist():
        rect = rects[k]
        outer = [side for side in range(4) if abs(rect[side] - box[side]) < SAME]
        if not outer:
            continue
        side = outer[int(rng.integers(len(outer)))]
        across = rect[3] - rect[1] if side % 2 == 0 else rect[2] - rect[0]
        deep = rect[2] - rect[0] if side % 2 == 0 else rect[3] - rect[1]
        step = min(pulls[k] / across, deep - max(MIN_SIDE_M, 0.25 * deep))
        if step > 0.05:
            moved = list(rect)
            moved[side] += step if side < 2 else -step
            rects[k] = (moved[0], moved[1], moved[2], moved[3])


def _has_courtyard(rects: list[Rect]) -> bool:
    """Return whether there is a courtyard, from which no way leads out: outlines as published cannot show one."""
    whole = shapely.union_all(shapely.box(*np.array(rects).T), grid_size=1e-6)
    return bool(shapely.get_num_interior_rings(shapely.get_parts(whole)).any())


def _fill_box(rects: list[Rect], asked: WantedRectangles) -> list[Rect]:
    """Fill the box again."""
    x1, y1, x2, y2 = _bounds(rects)
    sx, sy = asked.width_m / (x2 - x1), asked.height_m / (y2 - y1)
    return [((a - x1) * sx, (b - y1) * sy, (c - x1) * sx, (d - y1) * sy) for a, b, c, d in rects]


def _cost(rects: list[Rect], asked: WantedRectangles) -> float:
    """Return how far a layout is from what is asked, or 0 if it is just that."""
    sizes = np.array([[x2 - x1, y2 - y1] for x1, y1, x2, y2 in rects])
    areas, wanted = sizes.prod(axis=1), np.array(asked.areas_m2)
    whole = abs(areas.sum() / wanted.sum() - 1.0)
    each = float(np.abs(np.log(areas / wanted)).mean())
    short, long = sizes.min(axis=1), sizes.max(axis=1)
    narrow = float(
        np.clip(1.3 - short, 0.0, None).sum() + np.clip(long / np.maximum(short, 0.1) - 3.5, 0.0, None).sum()
    )
    return float(2.0 * whole + 0.8 * each + 0.2 * narrow)


def _without_hub(count: int, ways: list[tuple[int, int]]) -> float:
    """Return the share of rectangles that do not border on the one with the most borders."""
    return 1.0 - float(np.bincount(np.array(ways).ravel()).max()) / (count - 1) if ways else 0.0


def _bounds(rects: list[Rect]) -> Rect:
    x1, y1, x2, y2 = np.array(rects).T
    return float(x1.min()), float(y1.min()), float(x2.max()), float(y2.max())
