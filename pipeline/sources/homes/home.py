"""Make one home, as room polygons and doors in metres, from its index and a seed, independently of all other homes."""

from __future__ import annotations

import hashlib
from typing import Final

import numpy as np
import shapely

from pipeline.sources.homes.corners import CornerWishes, add_corners, draw_front_doors
from pipeline.sources.homes.shaping import (
    WIDEST_MADE_M,
    DoorWishes,
    ShapedRooms,
    bend_rooms,
    join_spaces_by_doors,
    join_to_one_space,
)
from pipeline.sources.homes.slicing import WantedRectangles, slice_box
from pipeline.sources.homes.values import Home, HomeDoor, HomeWish, NamedBox, Rect, snap_wall_line
from pipeline.sources.homes.wishes import draw_home_wish

_WISHES: Final = 12
_SLICINGS: Final = 24
_STREAM: Final = 7
"""Beside the seed and the index, so that other kinds of made houses draw other numbers."""
_BORDER_M: Final = 0.75
_ROBOT_M: Final = 0.22
_PLAIN: Final = 0.95
"""A house of one room that fills so much of its box is a rectangle."""


def home_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a home."""
    return hashlib.sha256(f"houseexpo home {seed} {index}".encode()).hexdigest()[:32]


def make_home(index: int, seed: int) -> Home:
    """Make home ``index`` of a seed; a wish that cannot be met is drawn again."""
    rng = np.random.default_rng([seed, index, _STREAM])
    for _ in range(_WISHES):
        home = _try_home(home_id(index, seed), draw_home_wish(rng), rng)
        if home is not None:
            return home
    raise RuntimeError(f"home {index} of seed {seed}: no layout in {_WISHES} wishes")


def _try_home(name: str, wish: HomeWish, rng: np.random.Generator) -> Home | None:
    """Lay out, bend rooms, then join them by doors, or None if the wish cannot be met."""
    width, height = (wish.long_m, wish.short_m) if rng.random() < 0.5 else (wish.short_m, wish.long_m)
    extent = wish.area_m2 / (width * height)
    alone = wish.spaces == 1 and extent < _PLAIN  # a room that is no rectangle consists of some
    areas = wish.areas_m2 if not alone else tuple(wish.area_m2 * rng.dirichlet(np.full(int(rng.integers(2, 4)), 2.0)))
    with_walls = tuple(area + 2 * wish.wall_m * area**0.5 for area in areas)
    asked = WantedRectangles(width + wish.wall_m, height + wish.wall_m, with_walls)
    rects = slice_box(asked, (WIDEST_MADE_M if alone else _BORDER_M) + wish.wall_m, _SLICINGS, rng)
    if rects is None:
        return None
    rects = [_on_grid(rect, wish.wall_m) for rect in rects]
    found = join_to_one_space(rects, wish.wall_m) if alone else bend_rooms(rects, wish.corners, wish.wall_m, rng)
    return _home_of(name, wish, found, rng)


def _on_grid(rect: Rect, wall_m: float) -> Rect:
    x1, y1, x2, y2 = (snap_wall_line(value, wall_m) for value in rect)
    return x1, y1, x2, y2


def _home_of(name: str, wish: HomeWish, found: ShapedRooms, rng: np.random.Generator) -> Home | None:
    labels = [each[0] if each else None for each in wish.names]
    asked = DoorWishes(wish.doors, -wish.corners, wish.wall_m)
    joints = join_spaces_by_doors(found.rects, found.space_of, labels, asked, rng)
    if joints is None:
        return None
    half = wish.wall_m / 2
    inner = [shapely.box(x1 + half, y1 + half, x2 - half, y2 - half) for x1, y1, x2, y2 in found.rects]
    inner += [shapely.box(*gap.gap) for gap in found.gaps]
    owner = [*found.space_of, *(found.space_of[gap.pair[0]] for gap in found.gaps)]
    spaces = [
        shapely.union_all([shape for shape, k in zip(inner, owner, strict=True) if k == space], grid_size=1e-4)
        for space in range(wish.spaces)
    ]
    ways = tuple(HomeDoor(each.gap, (found.space_of[each.pair[0]], found.space_of[each.pair[1]])) for each in joints)
    spaces = add_corners(spaces, ways, CornerWishes(wish.corners, wish.oblique, wish.wall_m), rng)
    if not _passable(spaces, ways):
        return None
    fronts = draw_front_doors(spaces, wish.names, wish.wall_m, rng)
    return Home(name, tuple(spaces), ways, fronts, _boxes(wish, spaces, rng), wish.rooms, wish.wall_m)


def _passable(spaces: list[shapely.Polygon], ways: tuple[HomeDoor, ...]) -> bool:
    """Return whether a robot gets everywhere, in each space and through all doors."""
    free = shapely.union_all([*spaces, *(shapely.box(*way.rect) for way in ways)], grid_size=1e-4)
    places = shapely.buffer([*spaces, free], -_ROBOT_M)
    return all(isinstance(place, shapely.Polygon) and not place.is_empty for place in places)


def _boxes(wish: HomeWish, spaces: list[shapely.Polygon], rng: np.random.Generator) -> tuple[NamedBox, ...]:
    """Return boxes: the first name of a space has its whole box, the others parts of it."""
    boxes = []
    for space, labels in zip(spaces, wish.names, strict=True):
        x1, y1, x2, y2 = space.buffer(wish.wall_m / 2).bounds if space.area else space.bounds
        for k, label in enumerate(labels):
            low, high = sorted(rng.uniform(0.0, 1.0, 2)) if k else (0.0, 1.0)
            if x2 - x1 > y2 - y1:
                box = (x1 + (x2 - x1) * low, y1, x1 + (x2 - x1) * high, y2)
            else:
                box = (x1, y1 + (y2 - y1) * low, x2, y1 + (y2 - y1) * high)
            boxes.append(NamedBox(label, tuple(round(float(value), 3) for value in box)))  # type: ignore[arg-type]
    return tuple(boxes)
