"""Draw floors of offices as occupancy grids: corridors, rooms in rows beside them, doors, thin and thick walls.

Houses teach a predictor nothing about floors of offices, in which rooms of equal width repeat along corridors and the
outer wall goes on for many metres. No floor of a real building was used; the lengths are those of usual offices.

R1  One to five straight corridors meet at right angles: a line, an L, a Z, a U, a T, a ring or a comb.
R2  Rooms stand in rows on one side or both sides of each corridor. Their widths are multiples of a module of the floor,
    and repeat. Some rooms are divided, some are left open to the corridor, some rows are deeper than others.
R3  Each room has a door to the corridor or, where it does not touch it, to another room that can be reached. A room
    that touches none is closed, like a shaft.
R4  Walls are drawn at 0.05 m; 2 x 2 pixels make a cell of 0.1 m, which is occupied if one of them is. Inside and
    outside are free, as in a drawing. The walls of some floors are lines, one to three pixels wide. Those of the others
    have a thickness from 0.1 m to 0.5 m, outer walls up to 0.8 m: a robot sees the surface on its side.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Labels = npt.NDArray[np.int32]

_PIXELS_PER_M: Final = 20
_OUTSIDE, _CORRIDOR, _FIRST_ROOM = 0, 1, 2
_MARGIN_M: Final = 1.0
_THICK_SHARE: Final = 0.7
_INNER_M, _OUTER_M = (0.1, 0.5), 0.8
"""The thickness of inner walls; the greatest of outer ones."""
_SHAPES: Final = ("line", "L", "Z", "U", "T", "ring", "comb")


def make_office_floor(rng: np.random.Generator) -> tuple[Bools, Bools]:
    """Return a floor: occupied cells and the cells of its corridors, (rows, cols) each, of 0.1 m."""
    labels = _draw_spaces(rng)
    walls = _walls_between(labels)
    outer = walls & _near(labels == _OUTSIDE)
    thick = 1
    if rng.random() < _THICK_SHARE:
        thick = _between(rng, *_INNER_M)
        walls = _thicken(walls, thick) | _thicken(outer, _between(rng, thick / _PIXELS_PER_M, _OUTER_M))
    else:
        if rng.random() < 0.3:
            walls |= _near(outer)
        if rng.random() < 0.25:
            walls[1:] |= walls[:-1].copy()
            walls[:, 1:] |= walls[:, :-1].copy()
    for gap in _find_doors(labels, thick, rng):
        walls[gap] = False
    _add_doors_across(walls, labels, rng)
    _add_columns(walls, labels, rng)
    rows, cols = walls.shape[0] // 2, walls.shape[1] // 2
    cells: Bools = np.asarray(walls[: 2 * rows, : 2 * cols].reshape(rows, 2, cols, 2).any(axis=(1, 3)), bool)
    corridors: Bools = (labels[: 2 * rows : 2, : 2 * cols : 2] == _CORRIDOR) & ~cells
    return cells, corridors


def _px(metres: float) -> int:
    return round(metres * _PIXELS_PER_M)


def _between(rng: np.random.Generator, least_m: float, most_m: float) -> int:
    return _px(rng.uniform(least_m, most_m))


def _near(cells: Bools) -> Bools:
    return _thicken(cells, 3)


def _thicken(walls: Bools, thick: int) -> Bools:
    """Return walls of a thickness in pixels, from lines of one."""
    found: Bools = cv2.dilate(walls.astype(np.uint8), np.ones((thick, thick), np.uint8)) != 0
    return found


def _corridor_lines(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    """Return the middle lines (x0, y0, x1, y1) of corridors in pixels (R1)."""
    a, b, c = (_between(rng, 12, 45) for _ in range(3))
    b = max(b, _px(16))
    shape = str(rng.choice(_SHAPES, p=(0.2, 0.2, 0.12, 0.14, 0.1, 0.12, 0.12)))
    pitch, teeth = _between(rng, 15, 24), int(rng.integers(2, 4))
    lines: dict[str, list[tuple[int, int, int, int]]] = {
        "line": [(0, 0, a + c, 0)],
        "L": [(0, 0, a, 0), (a, 0, a, b)],
        "Z": [(0, 0, a, 0), (a, 0, a, b), (a, b, a + c, b)],
        "U": [(0, 0, a, 0), (a, 0, a, b), (a - min(a, c), b, a, b)],
        "T": [(0, 0, a + c, 0), (a, 0, a, b)],
        "ring": [(0, 0, a, 0), (0, b, a, b), (0, 0, 0, b), (a, 0, a, b)],
        "comb": [(0, 0, pitch * (teeth - 1), 0), *((k * pitch, 0, k * pitch, b) for k in range(teeth))],
    }
    return lines[shape]


def _draw_spaces(rng: np.random.Generator) -> Labels:
    """Return the label of each pixel's space: outside, corridor, or a room (R1, R2)."""
    lines = _corridor_lines(rng)
    deep = _px(9.0 + _MARGIN_M)
    x_from, y_from = min(line[0] for line in lines) - deep, min(line[1] for line in lines) - deep
    size = (max(line[3] for line in lines) + deep - y_from, max(line[2] for line in lines) + deep - x_from)
    labels = np.zeros(size, np.int32)
    width, module = _between(rng, 1.4, 2.8), _between(rng, 1.1, 1.7)
    both = rng.random() < 0.8
    depths = [_between(rng, 3.0, 7.0), _between(rng, 3.0, 7.0)]
    label = _FIRST_ROOM
    corridors = []
    for x0, y0, x1, y1 in lines:
        along_x = y0 == y1
        start, end = (x0 - x_from, x1 - x_from) if along_x else (y0 - y_from, y1 - y_from)
        middle = (y0 - y_from) if along_x else (x0 - x_from)
        drawn = labels if along_x else labels.T
        half = width // 2
        for side in (-1, 1):
            if not both and side > 0 and rng.random() < 0.7:
                continue
            edge = middle + side * half
            band = (edge, edge + side * depths[side > 0])
            label = _draw_row(drawn, (start - half, end + half), band, module, label, rng)
        corridors.append((drawn, middle - half, middle + half, start - half, end + half))
    for drawn, low, high, start, end in corridors:
        drawn[low:high, start:end] = _CORRIDOR
    if rng.random() < 0.15:
        _cut_corner(labels, rng)
    return labels


def _draw_row(  # noqa: PLR0917
    drawn: Labels, along: tuple[int, int], band: tuple[int, int], module: int, label: int, rng: np.random.Generator
) -> int:
    """Draw a row of rooms from the edge of a corridor, where a band begins (R2); return the next label."""
    at, end = along
    edge, depth = band[0], band[1] - band[0]
    at -= int(rng.integers(0, 2)) * abs(depth)
    end += int(rng.integers(0, 2)) * abs(depth)
    while at < end:
        room = module * int(rng.choice((2, 2, 2, 3, 3, 4, 5, 7)))
        deep = depth + (round(depth * rng.uniform(-0.35, 0.3)) if rng.random() < 0.12 else 0)
        kind = rng.random()
        for _ in range(int(rng.geometric(0.3))):
            if at >= end:
                break
            to = min(at + room, end)
            if end - to < _px(1.5):
                to = end
            low, high = sorted((edge, edge + deep))
            if kind < 0.05 and to - at < _px(8):  # open to the corridor
                drawn[low:high, at:to] = _CORRIDOR
            elif kind < 0.15:  # small rooms behind a common one
                front = edge + round(deep * rng.uniform(0.3, 0.5))
                drawn[slice(*sorted((edge, front))), at:to] = label
                label += 1
                small = max(round((to - at) / max((to - at) // _px(1.6), 1)), _px(1.0))
                for cell in range(at, to, small):
                    drawn[slice(*sorted((front, edge + deep))), cell : min(cell + small, to)] = label
                    label += 1
            elif kind < 0.25:  # divided in depth
                front = edge + round(deep * rng.uniform(0.35, 0.65))
                drawn[slice(*sorted((edge, front))), at:to] = label
                drawn[slice(*sorted((front, edge + deep))), at:to] = label + 1
                label += 2
            else:
                drawn[low:high, at:to] = label
                label += 1
            at = to
    return label


def _cut_corner(labels: Labels, rng: np.random.Generator) -> None:
    """Cut a corner of the building along a slanting line."""
    inside = np.argwhere(labels != _OUTSIDE)
    (top, left), (bottom, right) = inside.min(axis=0), inside.max(axis=0)
    across, down = _between(rng, 3, 8), _between(rng, 3, 8)
    y, x = np.mgrid[: labels.shape[0], : labels.shape[1]]
    dx = (x - left) if rng.random() < 0.5 else (right - x)
    dy = (y - top) if rng.random() < 0.5 else (bottom - y)
    labels[dx / across + dy / down < 1] = _OUTSIDE


def _walls_between(labels: Labels) -> Bools:
    """Return the pixels whose space differs from that of a neighbour to the right, below or between the two."""
    walls = np.zeros(labels.shape, bool)
    walls[:, :-1] |= labels[:, :-1] != labels[:, 1:]
    walls[:-1] |= labels[:-1] != labels[1:]
    walls[:-1, :-1] |= labels[:-1, :-1] != labels[1:, 1:]
    return walls


def _straight_borders(labels: Labels) -> dict[tuple[int, int], list[tuple[int, int, int, bool]]]:
    """Return the straight borders of each two spaces: (line, start, end, whether it lies along x), in pixels."""
    found: dict[tuple[int, int], list[tuple[int, int, int, bool]]] = {}
    for along_x, drawn in ((True, labels), (False, labels.T)):
        one, other = drawn[:-1].astype(np.int64), drawn[1:].astype(np.int64)
        pair = np.where(one != other, np.minimum(one, other) * 100_000 + np.maximum(one, other), -1)
        starts = np.ones(pair.shape, bool)
        starts[:, 1:] = pair[:, 1:] != pair[:, :-1]
        at = np.flatnonzero(starts.ravel())
        ends = np.append(at[1:], pair.size)
        real = pair.ravel()[at] >= 0
        for start, end in zip(at[real].tolist(), ends[real].tolist(), strict=True):
            line, first = divmod(start, pair.shape[1])
            key = divmod(int(pair[line, first]), 100_000)
            found.setdefault(key, []).append((line, first, first + end - start, along_x))
    return found


def _find_doors(labels: Labels, thick: int, rng: np.random.Generator) -> list[tuple[slice, slice]]:
    """Return the pixels to free for doors (R3) in walls of a thickness in pixels."""
    borders = {pair: runs for pair, runs in _straight_borders(labels).items() if pair[0] != _OUTSIDE}
    beside: dict[int, list[int]] = {}
    for one, other in borders:
        beside.setdefault(one, []).append(other)
        beside.setdefault(other, []).append(one)
    habit, door = float(rng.choice((0.1, 0.5, 0.9))), _between(rng, 0.7, 1.2)
    gaps: list[tuple[slice, slice]] = []

    def join(one: int, other: int) -> bool:
        line, start, end, along_x = max(borders[min(one, other), max(one, other)], key=lambda run: run[2] - run[1])
        wide = door if rng.random() < 0.8 else _between(rng, 0.7, 1.2)
        post = _px(0.15) + thick // 2
        if end - start < wide + 2 * post:
            return False
        share = habit if rng.random() < 0.7 else rng.random()
        first = start + post + round(share * (end - start - wide - 2 * post))
        across, gap = slice(line - 1 - thick // 2, line + 3 + thick // 2), slice(first, first + wide)
        gaps.append((across, gap) if along_x else (gap, across))
        return True

    reached, todo = {_CORRIDOR}, [_CORRIDOR]
    while todo:
        here = todo.pop(0)
        for room in beside.get(here, []):
            if room not in reached:
                if join(here, room):
                    reached.add(room)
                    todo.append(room)
            elif room > here != _CORRIDOR and rng.random() < 0.05:
                join(here, room)
    return gaps


def _add_doors_across(walls: Bools, labels: Labels, rng: np.random.Generator) -> None:
    """Part the corridor at some places by a wall with a wide door."""
    for drawn, space in ((walls, labels), (walls.T, labels.T)):
        for _ in range(int(rng.integers(0, 4))):
            col = int(rng.integers(space.shape[1]))
            corridor = np.flatnonzero(space[:, col] == _CORRIDOR)
            if not len(corridor):
                continue
            run = rng.choice(corridor)
            low = high = int(run)
            while space[low - 1, col] == _CORRIDOR:
                low -= 1
            while space[high + 1, col] == _CORRIDOR:
                high += 1
            if _px(1.2) < high - low < _px(3.0):
                wide = min(_between(rng, 0.9, 1.8), high - low - 4)
                middle = (low + high) // 2
                gap = drawn[middle - wide // 2 : middle + wide // 2, col].copy()
                drawn[low:high, col] = True
                drawn[middle - wide // 2 : middle + wide // 2, col] = gap


def _add_columns(walls: Bools, labels: Labels, rng: np.random.Generator) -> None:
    """Stand columns on a grid of the floor."""
    if rng.random() > 0.3:
        return
    side, pitch = _between(rng, 0.2, 0.5), _between(rng, 4.0, 8.0)
    for row in range(pitch // 2, labels.shape[0] - side, pitch):
        for col in range(pitch // 2, labels.shape[1] - side, pitch):
            if labels[row, col] > _CORRIDOR:
                walls[row : row + side, col : col + side] = True
