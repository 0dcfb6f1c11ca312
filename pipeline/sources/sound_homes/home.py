"""Make one sound home from its index and a seed: draw a programme, lay it out several times, keep the best sound one.

H1  Every room can be reached from the front door; bedrooms and a toilet or bath without crossing a bedroom.
H2  Living rooms, dining rooms, kitchens, bedrooms and offices have a window; a kitchen may be open to a room with one.
H3  Rooms keep the least area and width and the largest aspect of their label (``LIMITS``, stricter than the limits of
    ``stats.audit``).
H4  A room has at most twice the area that is asked for.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Final, NamedTuple

import numpy as np
import shapely
from shapely.affinity import affine_transform

from pipeline.sources.homes.values import Rect, snap_wall_line
from pipeline.sources.sound_homes.layout import lay_out_rooms
from pipeline.sources.sound_homes.openings import (
    place_doors,
    place_front_door,
    place_outdoors,
    place_windows,
    rect_in_wall,
    shared_stretches,
)
from pipeline.sources.sound_homes.programme import draw_kind, draw_programme
from pipeline.sources.sound_homes.values import (
    HALL,
    OUTDOORS,
    Cell,
    Doorway,
    Layout,
    Programme,
    SoundHome,
    Window,
)

LIT: Final = frozenset({"Living_Room", "Dining_Room", "Kitchen", "Bedroom", "Child_Room", "Office"})
SLEEPING: Final = frozenset({"Bedroom", "Child_Room"})
LIMITS: Final = {
    "Living_Room": (12.0, 3.0, 2.1),
    "Kitchen": (4.0, 1.8, 2.4),
    "Dining_Room": (6.0, 2.3, 2.0),
    "Bedroom": (8.5, 2.6, 1.8),
    "Child_Room": (8.0, 2.5, 1.8),
    "Office": (6.5, 2.2, 2.0),
    "Bathroom": (2.8, 1.5, 2.6),
    "Toilet": (1.3, 0.9, 2.7),
    "Storage": (0.9, 0.8, 3.0),
    "Wardrobe": (1.8, 1.1, 3.2),
    "Garage": (14.0, 3.0, 2.4),
}
"""H3: least area (m2), least width (m), largest aspect."""
_MOST: Final = 1.7
_HALL_M2: Final = 1.1
"""What a hall has for each room without being too large: 7.5 m2 for 6.8 rooms (Swiss Dwellings)."""
_HALL_WEIGHT: Final = 6.0
_WAY_M: Final = 1.0
"""The least width of a hall, metres."""
_OPEN_M: Final = 1.5
"""The least opening through which a kitchen has its light from another room, metres."""
_TRIES: Final = 60
_GOOD: Final = 6
"""Of so many sound layouts the best is kept."""
_DRAWS: Final = 40
_SPREAD: Final = 8
"""Beside the seed and the index, so that other kinds of made houses draw other numbers."""


def sound_home_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a home."""
    return hashlib.sha256(f"houseexpo sound {seed} {index}".encode()).hexdigest()[:32]


def make_sound_home(index: int, seed: int) -> SoundHome:
    """Make home ``index`` of a seed; a programme that no layout holds is drawn again."""
    rng = np.random.default_rng([seed, index, _SPREAD])
    kind = draw_kind(rng)
    for _ in range(_DRAWS):
        programme = draw_programme(kind, rng)
        tries = (_try_home(programme, rng) for _ in range(_TRIES))
        found = list(islice((each for each in tries if each is not None), _GOOD))
        if found:
            best = min(found, key=lambda each: each[0])[1]
            return _turned(replace(best, id=sound_home_id(index, seed)), rng)
    raise RuntimeError(f"sound home {index} of seed {seed}: no layout in {_DRAWS} programmes")


def _try_home(programme: Programme, rng: np.random.Generator) -> tuple[float, SoundHome] | None:
    """Return a sound home with its distance from what is asked for, or None if the try is not sound."""
    layout = lay_out_rooms(programme, rng)
    if layout is None:
        return None
    cells = tuple(Cell(_on_grid(cell.rect, programme.inner_m), cell.room) for cell in layout.cells)
    layout = replace(layout, cells=cells)
    distance = _distance(layout, programme)
    openings = None if distance is None else _open_up(layout, programme, rng)
    if distance is None or openings is None:
        return None
    home = _home(programme, layout, openings)
    return (distance, home) if _is_one_way(home.rooms[HALL]) else None


class _Openings(NamedTuple):
    """Doors, front doors, windows, and a balcony if there is one."""

    doors: list[Doorway]
    fronts: list[Doorway]
    windows: list[Window]
    balcony: Rect | None


def _open_up(layout: Layout, programme: Programme, rng: np.random.Generator) -> _Openings | None:
    """Return the openings of a layout, or None where a room is out of reach (H1) or has no light (H2)."""
    walls = programme.inner_m, programme.outer_m
    doors = place_doors(layout, programme.inner_m, rng)
    front = place_front_door(layout, *walls, rng)
    rooms = {cell.room for cell in layout.cells}
    if doors is None or front is None or not _are_joined(rooms, doors):  # H1
        return None
    balcony, fronts = None, [front]
    wished = [each for each in programme.rooms if each.label in OUTDOORS]
    if wished or programme.kind in {"bungalow", "villa", "row house"}:
        outdoors = place_outdoors(layout, programme.light, walls, wished[0].area_m2 if wished else 0.0, rng)
        if outdoors is None:
            return None
        balcony, ways = outdoors
        (fronts if balcony is None else doors).extend(ways)
    windows = place_windows(layout, programme.light, walls, [door.rect for door in (*fronts, *doors)], rng)
    lit = {window.room for window in windows}
    lit |= {door.rooms[0] for door in (*fronts[1:], *doors) if door.rooms[1] is None}
    lit |= _open_kitchens(layout, doors, lit)
    if any(layout.labels[room] in LIT for room in rooms - lit):  # H2
        return None
    return _Openings(doors, fronts, windows, balcony)


def _are_joined(rooms: set[int], doors: list[Doorway]) -> bool:
    """Return whether doors lead from the hall to all rooms."""
    reached = {HALL}
    for _ in rooms:
        reached |= {room for door in doors if reached & {*door.rooms} for room in door.rooms if room is not None}
    return reached == rooms


def _open_kitchens(layout: Layout, doors: list[Doorway], lit: set[int]) -> set[int]:
    """Return the kitchens that are open to a room with light (H2)."""
    found = set()
    for door in doors:
        one, other = door.rooms
        wide = max(door.rect[2] - door.rect[0], door.rect[3] - door.rect[1]) >= _OPEN_M
        if other is not None and wide:
            found |= {a for a, b in ((one, other), (other, one)) if layout.labels[a] == "Kitchen" and b in lit}
    return found


def _is_one_way(hall: shapely.Geometry) -> bool:
    """Return whether people who are ``_WAY_M`` wide get everywhere in the hall (H1)."""
    return isinstance(hall, shapely.Polygon) and isinstance(
        hall.buffer(-_WAY_M / 2, join_style="mitre"), shapely.Polygon
    )


def _on_grid(rect: Rect, wall_m: float) -> Rect:
    x1, y1, x2, y2 = (snap_wall_line(value, wall_m) for value in rect)
    return x1, y1, x2, y2


def _distance(layout: Layout, programme: Programme) -> float | None:
    """Return how far areas are from those asked for, or None if a room breaks a limit (H3, H4)."""
    wished = {k: each.area_m2 for k, each in enumerate((r for r in programme.rooms if r.label not in OUTDOORS), 1)}
    total = 0.0
    for cell in layout.cells:
        label = layout.labels[cell.room]
        if cell.room == HALL:
            continue
        x1, y1, x2, y2 = cell.rect
        short, long = sorted((x2 - x1 - programme.inner_m, y2 - y1 - programme.inner_m))
        least, width, aspect = LIMITS[label]
        if short < width or short * long < least or long > aspect * short:
            return None
        if cell.room in wished:
            ratio = short * long / wished[cell.room]
            if ratio > _MOST and label != "Storage":
                return None
            total += abs(float(np.log(ratio)))
    hall = sum((x2 - x1 - programme.inner_m) * (y2 - y1 - programme.inner_m) for x1, y1, x2, y2 in _hall(layout))
    total += _HALL_WEIGHT * max(0.0, float(np.log(hall / (_HALL_M2 * len(wished)))))
    return total / len(layout.cells)


def _hall(layout: Layout) -> Iterator[Rect]:
    yield from (cell.rect for cell in layout.cells if cell.room == HALL)


def _home(programme: Programme, layout: Layout, openings: _Openings) -> SoundHome:
    doors, fronts, windows, balcony = openings
    inner, half = programme.inner_m, programme.inner_m / 2
    numbers = sorted({cell.room for cell in layout.cells})
    place = {room: k for k, room in enumerate(numbers)}
    shapes = []
    for room in numbers:
        parts = [_inner(cell.rect, half) for cell in layout.cells if cell.room == room]
        if room == HALL:
            parts += [
                shapely.box(*rect_in_wall(wall, wall.low + half, wall.high - half, inner))
                for wall in shared_stretches(layout.cells, room, room)
            ]
        shapes.append(shapely.union_all(parts, grid_size=1e-4))
    labels = [_final_label(layout.labels[room], programme.kind) for room in numbers]
    outside = []
    if balcony is not None:
        outside.append(len(labels))
        labels += [each.label for each in programme.rooms if each.label in OUTDOORS]
        shapes.append(shapely.box(*balcony))

    def numbered(door: Doorway) -> Doorway:
        one, other = door.rooms
        if other is None and door not in fronts:
            return Doorway(door.rect, (place[one], outside[0]))
        return Doorway(door.rect, (place[one], None if other is None else place[other]))

    return SoundHome(
        id="",
        kind=programme.kind,
        labels=tuple(labels),
        rooms=tuple(shapes),
        doors=tuple(map(numbered, doors)),
        fronts=tuple(map(numbered, fronts)),
        windows=tuple(replace(window, room=place[window.room]) for window in windows),
        balconies=tuple(outside),
        inner_m=inner,
        outer_m=programme.outer_m,
    )


def _inner(rect: Rect, half_m: float) -> shapely.Polygon:
    x1, y1, x2, y2 = rect
    return shapely.box(x1 + half_m, y1 + half_m, x2 - half_m, y2 - half_m)


def _final_label(label: str, kind: str) -> str:
    return "Lobby" if kind == "practice" and label == "Living_Room" else label


_TURNS: Final = ((1, 0, 0, 1), (0, -1, 1, 0), (-1, 0, 0, -1), (0, 1, -1, 0))


def _turned(home: SoundHome, rng: np.random.Generator) -> SoundHome:
    """Mirror and turn a home at random."""
    a, b, c, d = _TURNS[int(rng.integers(4))]
    if rng.random() < 0.5:
        a, c = -a, -c
    matrix = [a, b, c, d, 0, 0]

    def rect(of: Rect) -> Rect:
        x1, y1, x2, y2 = (round(value, 4) for value in affine_transform(shapely.box(*of), matrix).bounds)
        return x1, y1, x2, y2

    return replace(
        home,
        rooms=tuple(affine_transform(room, matrix) for room in home.rooms),
        doors=tuple(Doorway(rect(door.rect), door.rooms) for door in home.doors),
        fronts=tuple(Doorway(rect(door.rect), door.rooms) for door in home.fronts),
        windows=tuple(replace(window, rect=rect(window.rect)) for window in home.windows),
    )
