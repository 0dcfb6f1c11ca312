"""Make one storey at random: rooms, walls, openings, furniture, and the one difficulty that is asked for, if any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from tests.builders.suncg_houses import difficulties
from tests.builders.suncg_houses.furniture import furnish_rooms
from tests.builders.suncg_houses.layout import draw_room_count, draw_rooms, lay_out_rooms
from tests.builders.suncg_houses.values import Cell, Storey, Wall
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
