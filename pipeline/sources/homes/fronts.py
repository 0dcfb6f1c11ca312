"""The front door: through an outer wall of the room where people would come in."""

from __future__ import annotations

from typing import Final

import numpy as np
import shapely

from pipeline.sources.homes.values import Door, Rect

_WELCOME: Final = {"Entryway": 4.0, "Lobby": 3.0, "Hall": 2.5, "Hallway": 2.0, "Living_Room": 1.5, "Kitchen": 0.5}
_WIDTH_M: Final = 0.9
_CORNER_M: Final = 0.2
_BEFORE_M: Final = 0.6
"""So much room is before it."""
_SECOND: Final = 0.25


def front_doors(
    spaces: list[shapely.Polygon], names: tuple[tuple[str, ...], ...], wall_m: float, rng: np.random.Generator
) -> tuple[Door, ...]:
    """Return a front door, sometimes two; none where no axis-parallel outer wall is long enough."""
    welcome = [_WELCOME.get(each[0] if each else "", 0.0) + float(rng.gumbel()) for each in names]
    wanted = 1 + int(rng.random() < _SECOND)
    found: list[Door] = []
    for k in np.argsort(welcome)[::-1].tolist():
        others = [space for j, space in enumerate(spaces) if j != k]
        places = [
            rect
            for rect, before in _places(spaces[k], wall_m, rng)
            if all(shapely.box(*rect).distance(other) > wall_m + _BEFORE_M for other in others)
            and not spaces[k].intersects(shapely.box(*before))  # a wall that ends in the room is no outer one
        ]
        if places:
            found.append(Door(places[int(rng.integers(len(places)))], (k, None)))
        if len(found) == wanted:
            break
    return tuple(found)


def _places(space: shapely.Polygon, wall_m: float, rng: np.random.Generator) -> list[tuple[Rect, Rect]]:
    """One place on each axis-parallel wall that is long enough, from just inside the room through the wall.

    The second rectangle is what lies before the door, from the middle of the wall on.
    """
    ring = shapely.get_coordinates(shapely.orient_polygons(space).exterior)
    found = []
    for (x1, y1), (x2, y2) in zip(ring[:-1].tolist(), ring[1:].tolist(), strict=True):
        length = abs(x2 - x1) + abs(y2 - y1)
        if min(abs(x2 - x1), abs(y2 - y1)) > 1e-6 or length < _WIDTH_M + 2 * _CORNER_M:
            continue
        at = float(rng.uniform(_CORNER_M, length - _CORNER_M - _WIDTH_M))
        dx, dy = (x2 - x1) / length, (y2 - y1) / length
        a = x1 + dx * at, y1 + dy * at
        b = a[0] + dx * _WIDTH_M + dy * (wall_m + 1e-3), a[1] + dy * _WIDTH_M - dx * (wall_m + 1e-3)
        a = a[0] - dy * 1e-3, a[1] + dx * 1e-3
        c = x1 + dx * at + dy * wall_m / 2, y1 + dy * at - dx * wall_m / 2
        d = c[0] + dx * _WIDTH_M + dy * _BEFORE_M, c[1] + dy * _WIDTH_M - dx * _BEFORE_M
        found.append((_rect(a, b), _rect(c, d)))
    return found


def _rect(a: tuple[float, float], b: tuple[float, float]) -> Rect:
    return min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])
