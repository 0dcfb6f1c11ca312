"""Make one sound home from its index and a seed: draw a programme, lay it out several times, keep the best sound one.

H1  Every room can be reached from the front door; bedrooms and a toilet or bath without crossing a bedroom.
H2  Living rooms, dining rooms, kitchens, bedrooms and offices have a window; a kitchen may be open to a room with one.
H3  Rooms keep their limits (``limits``).
H4  The largest bedroom of a storey is no child's room.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from typing import Final, NamedTuple

import numpy as np
import shapely
from shapely.affinity import affine_transform

from houseexpo.analysis.audit import LIGHT_M
from houseexpo.tolerances import SAME_M2
from pipeline.sources.homes.values import Rect, snap_wall_line
from pipeline.sources.sound_homes.courtyard import lay_out_courtyard
from pipeline.sources.sound_homes.footprint import add_bay, angle_wall
from pipeline.sources.sound_homes.houses import Frame, lay_out_ground, lay_out_upper
from pipeline.sources.sound_homes.layout import draw_days, lay_out_rooms
from pipeline.sources.sound_homes.limits import distance_from_wishes, keeps_limits
from pipeline.sources.sound_homes.openings import (
    Stretch,
    outer_stretches,
    place_courtyard,
    place_doors,
    place_front_door,
    place_outdoors,
    place_windows,
    rect_in_wall,
    shared_stretches,
)
from pipeline.sources.sound_homes.programme import STOREYS, draw_kind, draw_programme
from pipeline.sources.sound_homes.stairs import Stair, Step, steps_of
from pipeline.sources.sound_homes.values import (
    HALL,
    LIT,
    OUTDOORS,
    SLEEPING,
    STAIRS,
    Cell,
    Doorway,
    Layout,
    Programme,
    Side,
    SoundHome,
    Storey,
    Void,
    Window,
)
from pipeline.tolerances import SHEET_M

_WAY_M: Final = 1.0
"""The least width of a hall, metres."""
_BAYS: Final = {
    "studio": 0.0,
    "flat": 0.06,
    "row house": 0.2,
    "house": 0.35,
    "bungalow": 0.3,
    "villa": 0.5,
    "shared flat": 0.06,
    "practice": 0.0,
}
_ANGLED: Final = {
    "studio": 0.15,
    "flat": 0.15,
    "row house": 0.0,
    "house": 0.0,
    "bungalow": 0.1,
    "villa": 0.0,
    "shared flat": 0.15,
    "practice": 0.1,
}
"""How often a bay, or an angled wall, is looked for; not all find a place."""
_OWN: Final = frozenset({"Bathroom", "Wardrobe"})
_TRIES: Final = 30
_GROUNDS: Final = 360
"""Ground floors that are tried for one programme of a house, or layouts round a courtyard."""
_GOOD: Final = 6
"""Of so many sound layouts the best is kept."""
_DRAWS: Final = 40
_OWN_STREAM: Final = 8
"""Beside the seed and the index, so that other kinds of made houses draw other numbers."""


def sound_home_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a home."""
    return hashlib.sha256(f"houseexpo sound {seed} {index}".encode()).hexdigest()[:32]


def make_sound_home(index: int, seed: int) -> SoundHome:
    """Make home ``index`` of a seed; a programme that no layout holds is drawn again."""
    rng = np.random.default_rng([seed, index, _OWN_STREAM])
    kind = draw_kind(rng)
    for _ in range(_DRAWS):
        programme = draw_programme(kind, rng)
        storeys = _make_flat(programme, rng) if programme.storeys == 1 else _make_house(programme, rng)
        if storeys is not None:
            storeys = _with_angles(storeys, programme, rng)
            turn = _draw_turn(rng)
            storeys = tuple(_turned(storey, turn) for storey in storeys)
            return SoundHome(sound_home_id(index, seed), kind, storeys, programme.inner_m, programme.outer_m)
    raise RuntimeError(f"sound home {index} of seed {seed}: no layout in {_DRAWS} programmes")


def _with_angles(storeys: tuple[Storey, ...], programme: Programme, rng: np.random.Generator) -> tuple[Storey, ...]:
    """Return the storeys with a bay on the ground, or with an angled wall, in some homes (``footprint``)."""
    ground, *above = storeys
    if rng.random() < _BAYS[programme.kind]:
        ground = add_bay(ground, programme.outer_m, _stays_sound, rng)
    if not above and rng.random() < _ANGLED[programme.kind]:
        ground = angle_wall(ground, _stays_sound, rng)
    return (ground, *above)


def _stays_sound(label: str, room: shapely.Polygon) -> bool:
    """Return whether a room that is no rectangle is still sound (H1, H3)."""
    return keeps_limits(label, room) and (label != "Hallway" or _is_one_way(room))


class _Try(NamedTuple):
    """A sound layout with its openings and its distance from what is asked for."""

    distance: float
    layout: Layout
    openings: _Openings


def _make_flat(programme: Programme, rng: np.random.Generator) -> tuple[Storey, ...] | None:
    if programme.courtyard:
        courts = (lay_out_courtyard(programme, rng) for _ in range(_GROUNDS))
        best = _best_of(courts, programme, _GOOD, rng)
        return None if best is None else (_storey(programme, best.layout, best.openings),)
    for day in draw_days(programme, rng):
        best = _best_of(lay_out_rooms(programme, day, rng), programme, _GOOD, rng)
        if best is not None:
            return (_storey(programme, best.layout, best.openings),)
    return None


def _make_house(programme: Programme, rng: np.random.Generator) -> tuple[Storey, ...] | None:
    """Return the storeys of a house: of some sound ground floors the best that sound storeys fit on."""
    tries = ((frame, _sound(layout, programme, rng)) for frame, layout in _grounds(programme, rng))
    sound = list(islice(((frame, ground) for frame, ground in tries if ground is not None), _GOOD))
    for frame, ground in sorted(sound, key=lambda pair: pair[1].distance):
        found = [ground]
        for level in range(2, programme.storeys + 1):
            ends = level == programme.storeys
            below = found[-1].layout
            layouts = (lay_out_upper(frame, below, programme, rng, ends=ends) for _ in range(_TRIES))
            best = _best_of(layouts, programme, _GOOD, rng)
            if best is None:
                break
            found.append(best)
        else:
            return tuple(_storey(programme, each.layout, each.openings) for each in found)
    return None


def _grounds(programme: Programme, rng: np.random.Generator) -> Iterator[tuple[Frame, Layout]]:
    for _ in range(_GROUNDS):
        found = lay_out_ground(programme, rng)
        if found is not None:
            yield found


def _best_of(
    layouts: Iterable[Layout | None], programme: Programme, count: int, rng: np.random.Generator
) -> _Try | None:
    """Return the one nearest to what is asked for among the first ``count`` sound layouts."""
    tries = (_sound(layout, programme, rng) for layout in layouts if layout is not None)
    found = list(islice((each for each in tries if each is not None), count))
    return min(found, key=lambda each: each.distance) if found else None


def _sound(layout: Layout, programme: Programme, rng: np.random.Generator) -> _Try | None:
    """Return a layout on the grid with its openings, or None if it is not sound."""
    layout = _on_grid(layout, programme.inner_m)
    distance = distance_from_wishes(layout.labels, layout.areas_m2, layout.cells, programme)
    openings = None if distance is None else _open_up(layout, programme, rng)
    if distance is None or openings is None:
        return None
    return _Try(distance, layout, openings) if _is_one_way(_room(layout, HALL, programme.inner_m)) else None


class _Openings(NamedTuple):
    """Doors, front doors, windows, and the label and inner rectangle of each balcony and terrace.

    Balconies are numbered after the rooms of the layout, in the doors too.
    """

    doors: list[Doorway]
    fronts: list[Doorway]
    windows: list[Window]
    outdoors: list[tuple[str, Rect]]


def _open_up(layout: Layout, programme: Programme, rng: np.random.Generator) -> _Openings | None:
    """Return the openings of a layout, or None where a room is out of reach (H1) or has no light (H2)."""
    walls = programme.inner_m, programme.outer_m
    rooms = {cell.room for cell in layout.cells if layout.labels[cell.room] != STAIRS}
    doors = place_doors(layout, programme.inner_m, rng)
    if doors is None or not _are_joined(rooms, doors):  # H1
        return None
    outside = outer_stretches(layout.cells)
    lit = [(place, wall) for place, wall in outside if wall.side in programme.light]
    fronts = place_front_door(layout, outside, *walls, rng)
    if fronts is None:  # H1
        return None
    if layout.stair_up is not None and layout.stair_down is None:
        foot = _foot(layout, layout.stair_up, programme.inner_m)
        doors.append(Doorway(foot, (HALL, layout.labels.index(STAIRS)), is_open=True))
    found = _go_out(layout, programme, outside, rng)
    if found is None:
        return None
    outdoors, ways, glazed = found
    doors += ways
    fronts += glazed
    windows = place_windows(layout, lit, walls, [door.rect for door in (*fronts, *doors)], rng)
    bright = {window.room for window in windows} | {door.rooms[0] for door in fronts[1:]}
    bright |= {door.rooms[0] for door in doors if door.rooms[1] is not None and door.rooms[1] >= len(layout.labels)}
    bright |= _open_kitchens(layout, doors, bright)
    if any(layout.labels[room] in LIT for room in rooms - bright):  # H2
        return None
    return _Openings(doors, fronts, windows, outdoors)


def _go_out(
    layout: Layout, programme: Programme, outside: list[tuple[int, Stretch]], rng: np.random.Generator
) -> tuple[list[tuple[str, Rect]], list[Doorway], list[Doorway]] | None:
    """Return balconies and terraces, the ways to them, and glazed doors into the open; None if the first has no place.

    Rooms outside are numbered after the rooms of the layout.
    """
    walls = programme.inner_m, programme.outer_m
    lit = [(place, wall) for place, wall in outside if wall.side in programme.light]
    if layout.court is not None:
        found = place_courtyard(layout, outside, walls, rng)
        if found is None:
            return None
        court, ways = found
        return [("Terrace", court)], [replace(way, rooms=(way.rooms[0], len(layout.labels))) for way in ways], []
    wished = [each for each in programme.rooms if each.label in OUTDOORS]
    if layout.entrance is None:
        wished = [each for each in wished if each.label == "Balcony"]
    elif programme.kind in STOREYS:
        wished = [each for each in wished if each.label == "Terrace"]
    if layout.entrance and not wished and programme.kind in {"bungalow", *STOREYS}:
        way = place_outdoors(layout, lit, walls, 0.0, rng)
        return None if way is None else ([], [], way[1])
    outdoors: list[tuple[str, Rect]] = []
    doors: list[Doorway] = []
    for k, wish in enumerate(wished):
        first = layout.entrance is not None and not k
        placed = place_outdoors(
            layout,
            lit,
            walls,
            wish.area_m2,
            rng,
            others=[rect for _, rect in outdoors],
            label=wish.label,
            beds=not first,
        )
        if placed is not None and placed[0] is not None:
            number = len(layout.labels) + len(outdoors)
            outdoors.append((wish.label, placed[0]))
            doors += [replace(way, rooms=(way.rooms[0], number)) for way in placed[1]]
        elif first:
            return None
    return outdoors, doors, []


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
        wide = max(door.rect[2] - door.rect[0], door.rect[3] - door.rect[1]) >= LIGHT_M
        if other is not None and other < len(layout.labels) and wide:
            found |= {a for a, b in ((one, other), (other, one)) if layout.labels[a] == "Kitchen" and b in lit}
    return found


def _is_one_way(hall: shapely.Geometry) -> bool:
    """Return whether people who are ``_WAY_M`` wide get everywhere in the hall (H1)."""
    middles = hall.buffer(-_WAY_M / 2, join_style="mitre")
    if not (isinstance(hall, shapely.Polygon) and isinstance(middles, shapely.Polygon)):
        return False
    return bool(hall.area - middles.buffer(_WAY_M / 2, join_style="mitre").area < SAME_M2)


def _on_grid(layout: Layout, wall_m: float) -> Layout:
    stairs = [stair for stair in (layout.stair_up, layout.stair_down) if stair is not None]
    rects = [*(cell.rect for cell in layout.cells), *(stair.rect for stair in stairs)]
    snapped = {line: snap_wall_line(line, wall_m) for line in {line for rect in rects for line in rect}}

    def on_grid(rect: Rect) -> Rect:
        x1, y1, x2, y2 = rect
        return snapped[x1], snapped[y1], snapped[x2], snapped[y2]

    cells = tuple(Cell(on_grid(rect), room) for rect, room in layout.cells)
    up, down = (stair and replace(stair, rect=on_grid(stair.rect)) for stair in (layout.stair_up, layout.stair_down))
    court = layout.court and on_grid(layout.court)
    return replace(layout, cells=cells, stair_up=up, stair_down=down, court=court)


def _storey(programme: Programme, layout: Layout, openings: _Openings) -> Storey:
    doors, fronts, windows, outdoors = openings
    inner = programme.inner_m
    void = None if layout.stair_down is None else _void(layout.stair_down, inner)
    numbers = sorted({cell.room for cell in layout.cells if void is None or layout.labels[cell.room] != STAIRS})
    place = {room: k for k, room in enumerate(numbers)}
    shapes = [_room(layout, room, inner) for room in numbers]
    labels = [_final_label(layout.labels[room], programme.kind) for room in numbers]
    for k, (label, rect) in enumerate(outdoors):
        place[len(layout.labels) + k] = len(labels)
        labels.append(label)
        shapes.append(shapely.box(*rect))

    def numbered(door: Doorway) -> Doorway:
        one, other = door.rooms
        return replace(door, rooms=(place[one], None if other is None else place[other]))

    inside = tuple(map(numbered, doors))
    _give_parents_the_largest(labels, shapes, inside)
    return Storey(
        labels=tuple(labels),
        rooms=tuple(shapes),
        doors=inside,
        fronts=tuple(map(numbered, fronts)),
        windows=tuple(replace(window, room=place[window.room]) for window in windows if window.room in place),
        balconies=tuple(range(len(labels) - len(outdoors), len(labels))),
        steps=() if layout.stair_up is None else steps_of(layout.stair_up, inner),
        void=void,
    )


def _room(layout: Layout, room: int, wall_m: float) -> shapely.Geometry:
    """Return the inner shape of a room; no wall stands between the cells of the hall."""
    half = wall_m / 2
    parts = [_inner(cell.rect, half) for cell in layout.cells if cell.room == room]
    if room == HALL:
        parts += [
            shapely.box(*rect_in_wall(wall, wall.low + half, wall.high - half, wall_m))
            for wall in shared_stretches(layout.cells, room, room)
        ]
    return shapely.union_all(parts, grid_size=1e-4)


def _foot(layout: Layout, stair: Stair, wall_m: float) -> Rect:
    """Return the opening in the wall between a stair and the hall, where one steps on the stair."""
    half, jamb = wall_m / 2, wall_m / 2 + SHEET_M
    x1, y1, x2, y2 = stair.rect
    if stair.kind == "half":
        side: Side = "north"
        at, low, high = y2, x1 + jamb, x2 - jamb
    elif stair.kind == "straight":
        walls = shared_stretches(layout.cells, layout.labels.index(STAIRS), HALL)
        at, low, high, side = next(each.at for each in walls if each.side == "south"), x1 + jamb, x2 - jamb, "south"
    else:
        at, low, high, side = x1 if stair.foot == "west" else x2, y1 + jamb, y1 + x2 - x1 - half, stair.foot
    return rect_in_wall(Stretch(side, at, low, high), low, high, wall_m)


def _void(stair: Stair, wall_m: float) -> Void:
    """Return the opening over a stair up to the landing, and what parts the two."""
    half = wall_m / 2
    x1, y1, x2, y2 = stair.rect
    x1, y1, x2, y2 = round(x1 + half, 4), round(y1 + half, 4), round(x2 - half, 4), round(y2 + half, 4)
    free = (x1 + x2) / 2 if stair.kind == "half" else x1
    return Void(
        shapely.box(x1, y1, x2, y2),
        shapely.box(x1, y2 - SHEET_M, free, y2) if free > x1 else shapely.Polygon(),
        shapely.box(free, y2 - SHEET_M, x2, y2),
    )


def _inner(rect: Rect, half_m: float) -> shapely.Polygon:
    x1, y1, x2, y2 = rect
    return shapely.box(x1 + half_m, y1 + half_m, x2 - half_m, y2 - half_m)


def _give_parents_the_largest(labels: list[str], shapes: list[shapely.Geometry], doors: Iterable[Doorway]) -> None:
    """Make a child's room that is the largest bedroom the parents', and one of theirs without a bath a child's (H4)."""
    beds = sorted((k for k, label in enumerate(labels) if label in SLEEPING), key=lambda k: -shapes[k].area)
    parents = [k for k in beds if labels[k] == "Bedroom"]
    if parents and parents[0] != beds[0] and keeps_limits("Bedroom", shapes[beds[0]]):
        own = {room for door in doors for room in door.rooms if {labels[k] for k in door.rooms if k is not None} & _OWN}
        labels[beds[0]] = "Bedroom"
        for k in [k for k in parents if k not in own][:1]:
            labels[k] = "Child_Room"


def _final_label(label: str, kind: str) -> str:
    return "Lobby" if kind == "practice" and label == "Living_Room" else label


_TURNS: Final = ((1, 0, 0, 1), (0, -1, 1, 0), (-1, 0, 0, -1), (0, 1, -1, 0))


def _draw_turn(rng: np.random.Generator) -> list[int]:
    """Return the matrix that mirrors and turns a home."""
    a, b, c, d = _TURNS[int(rng.integers(4))]
    if rng.random() < 0.5:
        a, c = -a, -c
    return [a, b, c, d, 0, 0]


def _turned(storey: Storey, matrix: list[int]) -> Storey:
    def rect(of: Rect) -> Rect:
        x1, y1, x2, y2 = (round(value, 4) for value in affine_transform(shapely.box(*of), matrix).bounds)
        return x1, y1, x2, y2

    return replace(
        storey,
        rooms=tuple(affine_transform(room, matrix) for room in storey.rooms),
        doors=tuple(replace(door, rect=rect(door.rect)) for door in storey.doors),
        fronts=tuple(replace(door, rect=rect(door.rect)) for door in storey.fronts),
        windows=tuple(replace(window, rect=rect(window.rect)) for window in storey.windows),
        steps=tuple(Step(affine_transform(step.area, matrix), step.top_m) for step in storey.steps),
        void=storey.void and Void(*(affine_transform(each, matrix) for each in storey.void)),
    )
