"""Make a home from its index and a seed, alone: the same home whatever others are made."""

from __future__ import annotations

import hashlib
from typing import Final

import numpy as np
import shapely

from pipeline.sources.homes.details import Details, detailed
from pipeline.sources.homes.fronts import front_doors
from pipeline.sources.homes.joints import Joint, doors, merged
from pipeline.sources.homes.slicing import Asked, lay_out
from pipeline.sources.homes.values import Door, Home, NamedBox, Rect, Wish
from pipeline.sources.homes.wishes import draw_wish

_DRAWS: Final = 12
_TRIES: Final = 24
_SPREAD: Final = 7
"""Beside the seed and the index, so that other kinds of made houses draw other numbers."""
_CORNERS_OF_MERGE: Final = 3
_BORDER_M: Final = 0.75


def home_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a home."""
    return hashlib.sha256(f"houseexpo home {seed} {index}".encode()).hexdigest()[:32]


def make_home(index: int, seed: int) -> Home:
    """Make home ``index`` of a seed; a wish that cannot be met is drawn anew."""
    rng = np.random.default_rng([seed, index, _SPREAD])
    for _ in range(_DRAWS):
        home = _made(home_id(index, seed), draw_wish(rng), rng)
        if home is not None:
            return home
    raise RuntimeError(f"home {index} of seed {seed}: no layout in {_DRAWS} wishes")


def _made(name: str, wish: Wish, rng: np.random.Generator) -> Home | None:
    merges = min(int(rng.poisson(max(wish.corners, 0) / _CORNERS_OF_MERGE * 0.6)), 2 * wish.spaces)
    areas = _split(wish, merges, rng)
    width, height = (wish.long_m, wish.short_m) if rng.random() < 0.5 else (wish.short_m, wish.long_m)
    with_walls = [area + 2 * wish.wall_m * np.sqrt(area) for area in areas]
    asked = Asked(width + wish.wall_m, height + wish.wall_m, tuple(with_walls))
    rects = lay_out(asked, _BORDER_M + wish.wall_m, _TRIES, rng)
    if rects is None:
        return None
    return _walled(name, wish, rects, merges, rng)


def _split(wish: Wish, merges: int, rng: np.random.Generator) -> list[float]:
    """Divide some spaces in two rectangles, mostly large ones; return the areas of all rectangles."""
    areas = list(wish.areas_m2)
    for _ in range(merges):
        k = int(np.argmax(np.array(areas) * rng.uniform(0.2, 1.0, len(areas))))
        share = float(rng.uniform(0.2, 0.8))
        areas.append(areas[k] * share)
        areas[k] *= 1 - share
    return areas


def _walled(name: str, wish: Wish, rects: list[Rect], merges: int, rng: np.random.Generator) -> Home | None:
    """Leave walls out until there are as many spaces as asked for, then join the spaces by doors."""
    gaps = merged(rects, wish.wall_m, merges, rng)
    space_of = _grouped(len(rects), gaps)
    sizes = np.zeros(max(space_of) + 1)
    for (x1, y1, x2, y2), space in zip(rects, space_of, strict=True):
        sizes[space] += (x2 - x1) * (y2 - y1)
    names = _renamed(wish, sizes)
    joints = doors(rects, space_of, [each[0] if each else None for each in names], wish.wall_m, rng)
    if joints is None:
        return None
    half = wish.wall_m / 2
    inner = [shapely.box(x1 + half, y1 + half, x2 - half, y2 - half) for x1, y1, x2, y2 in rects]
    inner += [shapely.box(*gap.gap) for gap in gaps]
    owner = [*space_of, *(space_of[gap.pair[0]] for gap in gaps)]
    spaces = [
        shapely.union_all([shape for shape, k in zip(inner, owner, strict=True) if k == space], grid_size=1e-4)
        for space in range(len(sizes))
    ]
    found = tuple(Door(joint.gap, (space_of[joint.pair[0]], space_of[joint.pair[1]])) for joint in joints)
    spaces = detailed(spaces, found, Details(wish.corners, wish.oblique, wish.wall_m), rng)
    fronts = front_doors(spaces, names, wish.wall_m, rng)
    return Home(name, tuple(spaces), found, fronts, _boxes(wish, spaces, names, rng), wish.rooms, wish.wall_m)


def _grouped(count: int, gaps: list[Joint]) -> list[int]:
    """Return the space of each rectangle, numbered from 0."""
    group = list(range(count))
    for gap in gaps:
        old, new = group[gap.pair[1]], group[gap.pair[0]]
        group = [new if g == old else g for g in group]
    numbers = {g: k for k, g in enumerate(dict.fromkeys(group))}
    return [numbers[g] for g in group]


def _renamed(wish: Wish, sizes: np.ndarray) -> list[tuple[str, ...]]:
    """Give the spaces the names whose areas are nearest, in order of size; what is too many names the largest."""
    by_wish = np.argsort(wish.areas_m2)[::-1]
    by_size = np.argsort(sizes)[::-1]
    names: list[tuple[str, ...]] = [()] * len(sizes)
    for rank, k in enumerate(by_wish.tolist()):
        space = int(by_size[min(rank, len(by_size) - 1)])
        names[space] = (*names[space], *wish.names[k])
    return names


def _boxes(
    wish: Wish, spaces: list[shapely.Polygon], names: list[tuple[str, ...]], rng: np.random.Generator
) -> tuple[NamedBox, ...]:
    """The first name of a space has its box, the others parts of it."""
    boxes = []
    for space, labels in zip(spaces, names, strict=True):
        x1, y1, x2, y2 = space.buffer(wish.wall_m / 2).bounds if space.area else space.bounds
        for k, label in enumerate(labels):
            low, high = sorted(rng.uniform(0.0, 1.0, 2)) if k else (0.0, 1.0)
            if x2 - x1 > y2 - y1:
                box = (x1 + (x2 - x1) * low, y1, x1 + (x2 - x1) * high, y2)
            else:
                box = (x1, y1 + (y2 - y1) * low, x2, y1 + (y2 - y1) * high)
            boxes.append(NamedBox(label, tuple(round(float(value), 3) for value in box)))  # type: ignore[arg-type]
    return tuple(boxes)
