"""Make a test house (storeys with walls, doors, furniture) from its index and a seed, whatever others are made.

Some houses hold a planted difficulty, or repeat an earlier house.

Every hundred houses hold each difficulty in the same share. Some houses have walls that spell characters.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Final

import numpy as np
import shapely
from shapely.affinity import affine_transform

from tests.builders.suncg_houses import difficulties
from tests.builders.suncg_houses.furniture import furnish_rooms, furniture_without_house
from tests.builders.suncg_houses.layout import draw_room_count, draw_rooms, lay_out_rooms
from tests.builders.suncg_houses.values import Cell, House, Opening, PlacedItem, Point, Storey, Wall
from tests.builders.suncg_houses.walls import (
    are_all_cells_joined,
    build_walls,
    cell_edges,
    outer_edge_parts,
    place_entrances,
    place_interior_doors,
    place_windows,
    shared_edge_parts,
)

_OBLIQUE_SHARE, _DIVIDER_SHARE, _CARVED_SHARE, _MERGED_SHARE = 0.2, 0.22, 0.45, 0.15
_MIN_ROOMS = {"no_door": 3, "garage_apart": 6, "closed_cell": 2}
_STOREY_TRIES = 40


def make_storey(difficulty: str | None, rng: np.random.Generator) -> Storey:
    """Make a storey with at most one difficulty planted; tries again where rooms cannot all be joined or planted."""
    storey = _attempt(difficulty, rng)
    for _ in range(_STOREY_TRIES):
        if storey is not None:
            return storey
        storey = _attempt(difficulty, rng)
    raise RuntimeError(f"no storey with {difficulty or 'all rooms joined'} in {_STOREY_TRIES} tries")


def _attempt(difficulty: str | None, rng: np.random.Generator) -> Storey | None:
    drawn: list[Cell] | None
    drawn = _cells(draw_room_count(rng, _MIN_ROOMS.get(difficulty or "", 1)), rng)
    if difficulty == "closed_cell":
        drawn = difficulties.add_shafts(drawn, rng)
    elif difficulty == "garage_apart":
        drawn = difficulties.add_garage(drawn, rng)
    if drawn is None:
        return None
    cells = [replace(cell, polygon=shapely.transform(cell.polygon, lambda points: points / 100)) for cell in drawn]
    edges = cell_edges(cells)
    shared = shared_edge_parts(edges)
    outer = outer_edge_parts(edges, shared)
    doors = place_interior_doors(cells, edges, shared, rng)
    if not are_all_cells_joined(cells, doors):
        return None
    planted: tuple[str, ...] = (difficulty,) if difficulty else ()
    if difficulty == "no_door":
        shut = difficulties.remove_only_door(cells, doors, rng)
        if shut is None:
            return None
        doors = shut
    openings = doors + place_entrances(cells, edges, outer, rng)
    openings += place_windows(cells, edges, outer, openings, rng)
    walls = build_walls(edges, {each.edge for each in shared}, rng)
    if rng.random() < _DIVIDER_SHARE:
        dividers = _dividers(cells, rng)
        walls += dividers
    if difficulty in {"open_front", "half_open_front"}:
        opened = difficulties.remove_outer_wall(
            cells, walls, openings, outer, half=difficulty == "half_open_front", rng=rng
        )
        if opened is None:
            return None
        walls, openings = opened
    items = furnish_rooms(cells, openings, rng)
    return Storey(tuple(cells), tuple(walls), tuple(openings), tuple(items), True, planted)


def _cells(number: int, rng: np.random.Generator) -> list[Cell]:
    """Return the cells of a storey in cm."""
    merged = number > 4 and rng.random() < _MERGED_SHARE
    specs = draw_rooms(number + merged, rng)
    small = [spec for spec in specs if spec.area < 6]
    carved = small[0] if number > 3 and small and rng.random() < _CARVED_SHARE else None
    cells, wing_from = lay_out_rooms([spec for spec in specs if spec is not carved], rng)
    if carved:
        cells = difficulties.carve_small_room(cells, carved, rng)
    if merged:
        cells = difficulties.merge_two_living_rooms(cells, rng)
    if number > 3 and rng.random() < 0.6:
        cells = difficulties.offset_front_rooms(cells, rng)
    turned = False
    if rng.random() < _OBLIQUE_SHARE:
        draw = rng.random()
        if wing_from is not None and draw < 0.35:
            cells = difficulties.slant_wing(cells, wing_from, rng)
        elif draw < 0.5:
            cells = difficulties.add_bay_window(cells, rng)
        elif draw < 0.6:
            turned = True
        else:
            for _ in range(int(rng.integers(1, 3))):
                cells = difficulties.cut_off_outer_corner(cells, rng)
    return difficulties.turn_house(cells, rng, turned)


def _dividers(cells: list[Cell], rng: np.random.Generator) -> list[Wall]:
    """Stand a wall free in the middle of the largest room, where people can walk round it."""
    rooms = [i for i, cell in enumerate(cells) if cell.use == "room" and not cell.polygon.interiors]
    index = max(rooms, key=lambda i: cells[i].polygon.area)
    sides = np.diff(shapely.get_coordinates(cells[index].polygon.exterior), axis=0)
    along = sides[int(np.argmax(np.hypot(*sides.T)))]
    along = along / np.hypot(*along)
    if rng.random() < 0.3:
        along = np.array([-along[1], along[0]])
    length = float(rng.uniform(1.0, 2.4))
    centre = shapely.get_coordinates(shapely.maximum_inscribed_circle(cells[index].polygon, tolerance=0.05))[0]
    start = centre - along * length / 2
    if cells[index].polygon.boundary.distance(shapely.LineString([start, start + along * length])) < 0.95:
        return []
    return [Wall(index, (start[0], start[1]), (along[0], along[1]), length)]


# Each stroke joins points (column, row) written as two digits; rows count upward.
_STROKES: Final = {
    "A": "00-04 04-24 24-20 02-22",
    "C": "20-00 00-04 04-24",
    "E": "20-00 00-04 04-24 02-12",
    "F": "00-04 04-24 02-12",
    "H": "00-04 20-24 02-22",
    "I": "10-14",
    "K": "00-04 02-24 02-20",
    "L": "04-00 00-20",
    "M": "00-04 04-12 12-24 24-20",
    "N": "00-04 04-20 20-24",
    "O": "00-04 04-24 24-20 20-00",
    "S": "00-20 20-22 22-02 02-04 04-24",
    "T": "04-24 10-14",
    "U": "04-00 00-20 20-24",
    "V": "04-10 10-24",
    "X": "00-24 04-20",
    "Z": "04-24 24-00 00-20",
    "1": "10-14 03-14",
    "2": "04-24 24-22 22-02 02-00 00-20",
    "4": "04-02 02-22 24-20",
    "5": "24-04 04-02 02-22 22-20 20-00",
    "7": "04-24 24-00",
}


def make_lettering(rng: np.random.Generator) -> Storey:
    """Write three to seven characters with walls that stand free; one nameless room without a floor holds each.

    No ring encloses 2 m2: the largest, an O, is 1.0 by 1.8 m at most.
    """
    text = rng.choice(sorted(_STROKES), size=int(rng.integers(3, 8)))
    wide, high = float(rng.uniform(0.7, 1.0)), float(rng.uniform(1.2, 1.8))
    walls = []
    for index, character in enumerate(text.tolist()):
        for stroke in _STROKES[character].split():
            a, b = (
                np.array([(int(point[0]) / 2 + 1.6 * index) * wide, int(point[1]) / 4 * high])
                for point in stroke.split("-")
            )
            length = float(np.hypot(*(b - a)))
            direction = (b - a) / length
            walls.append(Wall(index, (a[0], a[1]), (direction[0], direction[1]), length, (0.05, 0.05)))
    cells = [Cell(shapely.box(1.6 * k * wide, 0.0, (1.6 * k + 1) * wide, high), ()) for k in range(len(text))]
    return Storey(tuple(cells), tuple(walls), has_floor=False, difficulties=("characters",))


# Which house is what: every hundred houses hold each difficulty in the same share, at places that the seed chooses.


SOUND: Final = "sound"
DUPLICATES: Final = ("exact_duplicate", "shifted_duplicate", "mirrored_duplicate", "jittered_duplicate")
PER_HUNDRED: Final = {
    "closed_cell": 5,
    "no_door": 5,
    "garage_apart": 4,
    "open_front": 4,
    "half_open_front": 4,
    "objects_only": 4,
    "characters": 4,
    "exact_duplicate": 4,
    "shifted_duplicate": 2,
    "mirrored_duplicate": 2,
    "jittered_duplicate": 2,
}
_ROLES: Final = [role for role, count in PER_HUNDRED.items() for _ in range(count)]
_HOUSES_PER_BLOCK: Final = 100
_LOOK_BACK: Final = 60


def scene_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a house."""
    return hashlib.sha256(f"houseexpo procedural {seed} {index}".encode()).hexdigest()[:32]


def planted_fault(index: int, seed: int) -> str:
    """Return what is planted in a house, "sound" for nothing; a duplicate without a house before it is sound."""
    role = _draw_role(index, seed)
    return SOUND if role in DUPLICATES and not _originals(index, seed) else role


def original_index(index: int, seed: int) -> int:
    """Return the index of the sound house that a duplicate repeats."""
    choices = _originals(index, seed)
    return choices[int(np.random.default_rng([seed, index, 2]).integers(len(choices)))]


def _originals(index: int, seed: int) -> list[int]:
    return [k for k in range(max(0, index - _LOOK_BACK), index) if _draw_role(k, seed) == SOUND]


def _draw_role(index: int, seed: int) -> str:
    order = np.random.default_rng([seed, index // _HOUSES_PER_BLOCK, 1]).permutation(_HOUSES_PER_BLOCK)
    place = int(order[index % _HOUSES_PER_BLOCK])
    return _ROLES[place] if place < len(_ROLES) else SOUND


# The house itself.


_STOREYS, _STOREY_SHARES = (1, 2, 3), (0.86, 0.12, 0.02)
_JITTER_M = 0.008


def make_house(index: int, seed: int) -> House:
    """Make house ``index`` of a seed."""
    role = planted_fault(index, seed)
    rng = np.random.default_rng([seed, index])
    if role in DUPLICATES:
        source = original_index(index, seed)
        return _copy_house(make_house(source, seed), role, scene_id(index, seed), rng)
    if role == "objects_only":
        items = tuple(furniture_without_house(rng))
        bare = Storey(items=items, difficulties=(role,))
        return _move_to_scene(House(scene_id(index, seed), (bare,)), rng)
    if role == "characters":
        return _move_to_scene(House(scene_id(index, seed), (make_lettering(rng),)), rng)
    ground = make_storey(None if role == SOUND else role, rng)
    upper = [make_storey(None, rng) for _ in range(1, int(rng.choice(_STOREYS, p=_STOREY_SHARES)))]
    return _move_to_scene(House(scene_id(index, seed), (ground, *upper)), rng)


def storey_plan_id(house: str, level: int) -> str:
    """Return the id of a level's plan: the lowest has the scene's own."""
    return house if level == 0 else f"{house}_L{level}"


def _copy_house(source: House, role: str, house_id: str, rng: np.random.Generator) -> House:
    """Return a copy under another id: the same, elsewhere, mirrored, or with each wall moved by up to 8 mm."""
    storeys = []
    matrix = {
        "shifted_duplicate": [1, 0, 0, 1, float(rng.uniform(-20, 20)), float(rng.uniform(-20, 20))],
        "mirrored_duplicate": [-1, 0, 0, 1, float(rng.uniform(20, 90)), 0.0],
    }.get(role)
    for storey in source.storeys:
        copy = _transform(storey, matrix) if matrix else storey
        if role == "jittered_duplicate":
            moves = rng.uniform(-_JITTER_M, _JITTER_M, len(copy.walls)).tolist()
            walls = [replace(w, shift=w.shift + move) for w, move in zip(copy.walls, moves, strict=True)]
            copy = replace(copy, walls=tuple(walls))
        storeys.append(replace(copy, difficulties=(role,)))
    return replace(source, id=house_id, storeys=tuple(storeys))


def _move_to_scene(house: House, rng: np.random.Generator) -> House:
    """Move a house to where scenes lie: anywhere in the first hundred metres."""
    x, z = rng.uniform(20, 60, 2).round(3).tolist()
    return replace(house, storeys=tuple(_transform(storey, [1, 0, 0, 1, x, z]) for storey in house.storeys))


def _transform(storey: Storey, matrix: list[float]) -> Storey:
    """Take a storey through a rigid map of the plan, mirroring included (then walls run the other way)."""
    a, b, c, d, tx, tz = matrix
    mirrored = a * d - b * c < 0

    def point(p: Point) -> Point:
        return a * p[0] + b * p[1] + tx, c * p[0] + d * p[1] + tz

    def vector(v: Point) -> Point:
        return a * v[0] + b * v[1], c * v[0] + d * v[1]

    def wall(w: Wall) -> Wall:
        if not mirrored:
            return replace(w, start=point(w.start), direction=vector(w.direction))
        end = (w.start[0] + w.direction[0] * w.length, w.start[1] + w.direction[1] * w.length)
        along = vector(w.direction)
        missing = tuple((w.length - high, w.length - low) for low, high in reversed(w.missing))
        return replace(
            w, start=point(end), direction=(-along[0], -along[1]), ends=w.ends[::-1], skew=-w.skew, missing=missing
        )

    def opening(o: Opening) -> Opening:
        return replace(o, centre=point(o.centre), direction=vector(o.direction))

    def item(i: PlacedItem) -> PlacedItem:
        along = vector((float(np.cos(i.angle)), float(np.sin(i.angle))))
        return replace(i, centre=point(i.centre), angle=float(np.arctan2(along[1], along[0])))

    return replace(
        storey,
        cells=tuple(replace(cell, polygon=affine_transform(cell.polygon, matrix)) for cell in storey.cells),
        walls=tuple(map(wall, storey.walls)),
        openings=tuple(map(opening, storey.openings)),
        items=tuple(map(item, storey.items)),
    )
