"""Reshape the room polygons of a generated storey, and plant difficulties in it, such as a room without a door.

Rooms round a corner, bays, cut corners and slanted wings; closed cells, rooms without a door, detached garages, open
fronts. Cells stay disjoint. Lengths are in centimetres, in ``remove_only_door`` and ``remove_outer_wall`` in metres.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.affinity import affine_transform

from tests.builders.suncg_houses.values import Cell, Opening, Part, RoomSpec, Use, Wall


def carve_small_room(cells: list[Cell], spec: RoomSpec, rng: np.random.Generator, use: Use = "room") -> list[Cell]:
    """Cut a small room out of a corner of a large rectangular one, which becomes an L; else change nothing."""
    hosts = [i for i, cell in enumerate(cells) if _is_box(cell) and min(_size(cell)) >= spec.side + 180]
    if not hosts:
        return cells
    index = max(hosts, key=lambda i: cells[i].polygon.area * float(rng.uniform(0.6, 1.0)))
    width, height = _size(cells[index])
    x1, y1, x2, y2 = cells[index].polygon.bounds
    a = round(min(max(spec.side, np.sqrt(spec.area * 1e4) * rng.uniform(0.8, 1.25)), width - 160))
    b = round(min(max(spec.side, spec.area * 1e4 / a), height - 160))
    left, low = rng.random() < 0.5, rng.random() < 0.5
    sx, sy = (x1 if left else x2 - a), (y1 if low else y2 - b)
    small = shapely.box(sx, sy, sx + a, sy + b)
    rest = replace(cells[index], polygon=cells[index].polygon.difference(small))
    return [*cells[:index], rest, *cells[index + 1 :], Cell(small, spec.words, use)]


def merge_two_living_rooms(cells: list[Cell], rng: np.random.Generator) -> list[Cell]:
    """Throw two living rooms that share a wall together into one, which keeps the words of both."""
    social = {"Living_Room", "Kitchen", "Dining_Room", "Hall", "Entryway"}
    mine = [i for i, cell in enumerate(cells) if cell.words and set(cell.words) <= social and _is_box(cell)]
    for i, j in rng.permutation([(i, j) for i in mine for j in mine if i < j]).reshape(-1, 2).tolist():
        shared = cells[i].polygon.intersection(cells[j].polygon)
        union = cells[i].polygon.union(cells[j].polygon)
        if shared.length >= 200 and isinstance(union, shapely.Polygon):
            both = Cell(union.simplify(0), tuple(dict.fromkeys(cells[i].words + cells[j].words)))
            return [cell for k, cell in enumerate(cells) if k not in {i, j}] + [both]
    return cells


def offset_front_rooms(cells: list[Cell], rng: np.random.Generator) -> list[Cell]:
    """Let some rooms on the front (the lowest y) stand out by up to 1.2 m."""
    front = min(cell.polygon.bounds[1] for cell in cells)
    result = []
    for cell in cells:
        x1, y1, x2, _ = cell.polygon.bounds
        if y1 == front and _is_box(cell) and cell.use == "room" and rng.random() < 0.3:
            step = float(rng.integers(30, 120))
            cell = replace(cell, polygon=shapely.box(x1, y1 - step, x2, cell.polygon.bounds[3]))  # noqa: PLW2901
        result.append(cell)
    return result


def cut_off_outer_corner(cells: list[Cell], rng: np.random.Generator) -> list[Cell]:
    """Cut off an outer corner of the house, at 45 degrees or at any angle."""
    corners = []
    for index, cell in enumerate(cells):
        if cell.use != "room" or cell.polygon.area < 60_000:
            continue
        ring = shapely.get_coordinates(shapely.orient_polygons(cell.polygon).exterior)[:-1]
        corners += [(index, ring[k - 1], ring[k], ring[(k + 1) % len(ring)]) for k in range(len(ring))]
    for k in rng.permutation(len(corners)).tolist():
        index, before, corner, after = corners[k]
        arms = before - corner, after - corner
        lengths = np.hypot(*arms[0]), np.hypot(*arms[1])
        if arms[1][0] * arms[0][1] - arms[1][1] * arms[0][0] <= 0 or min(lengths) < 200:  # the corner must be convex
            continue
        cuts = [rng.uniform(80.0, min(220.0, 0.5 * length)) for length in lengths]
        if rng.random() < 0.5:
            cuts = [min(cuts)] * 2
        tips = [corner + arm / length * cut for arm, length, cut in zip(arms, lengths, cuts, strict=True)]
        piece = shapely.Polygon([tips[0], corner, tips[1]])
        others = [cell.polygon for i, cell in enumerate(cells) if i != index]
        if all(piece.distance(other) > 20 for other in others):
            ring = [tuple(point) for point in shapely.get_coordinates(cells[index].polygon.exterior)[:-1]]
            at = ring.index(tuple(corner))
            order = tips if cells[index].polygon.exterior.is_ccw else tips[::-1]
            ring[at : at + 1] = [tuple(point) for point in order]
            cut_off = replace(cells[index], polygon=shapely.Polygon(ring))
            return [*cells[:index], cut_off, *cells[index + 1 :]]
    return cells


def add_bay_window(cells: list[Cell], rng: np.random.Generator) -> list[Cell]:
    """Give a room a bay window with slanted sides."""
    for index in rng.permutation(len(cells)).tolist():
        cell = cells[index]
        if cell.use != "room" or not _is_box(cell):
            continue
        x1, y1, x2, y2 = cell.polygon.bounds
        depth, width = float(rng.uniform(60, 110)), float(rng.uniform(200, 300))
        if x2 - x1 < width + 80:
            continue
        middle = rng.uniform(x1 + 40 + width / 2, x2 - 40 - width / 2)
        foot, sign = (y1, -1.0) if rng.random() < 0.5 else (y2, 1.0)
        inset = depth * float(rng.uniform(0.6, 1.2))
        tip = foot + sign * depth
        ends = [(middle - width / 2, foot), (middle + width / 2, foot)]
        bump = shapely.Polygon([*ends, (middle + width / 2 - inset, tip), (middle - width / 2 + inset, tip)])
        if width > 2 * inset + 40 and all(bump.distance(c.polygon) > 40 for k, c in enumerate(cells) if k != index):
            out = replace(cell, polygon=cell.polygon.union(bump))
            return [*cells[:index], out, *cells[index + 1 :]]
    return cells


def slant_wing(cells: list[Cell], wing_from: float, rng: np.random.Generator) -> list[Cell]:
    """Let everything above ``wing_from`` lean to one side by 8 to 25 degrees."""
    lean = float(np.tan(np.radians(rng.uniform(8, 25)))) * (1 if rng.random() < 0.5 else -1)
    shear = [1, lean, 0, 1, -lean * wing_from, 0]
    return [
        replace(cell, polygon=affine_transform(cell.polygon, shear)) if cell.polygon.bounds[1] >= wing_from else cell
        for cell in cells
    ]


def turn_house(cells: list[Cell], rng: np.random.Generator, oblique: bool) -> list[Cell]:
    """Turn and mirror the house as a whole: by quarter turns, or by any angle where it is to stand obliquely."""
    quarter = int(rng.integers(4))
    angle = float(rng.uniform(0.1, 0.7)) if oblique else 0.0
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarter]
    c, s = c * np.cos(angle) - s * np.sin(angle), c * np.sin(angle) + s * np.cos(angle)
    flip = 1 if rng.random() < 0.5 else -1
    matrix = [c * flip, -s, s * flip, c, 0, 0]
    return [replace(cell, polygon=affine_transform(cell.polygon, matrix)) for cell in cells]


def _is_box(cell: Cell) -> bool:
    x1, y1, x2, y2 = cell.polygon.bounds
    return not cell.polygon.interiors and abs(cell.polygon.area - (x2 - x1) * (y2 - y1)) < 1e-6


def _size(cell: Cell) -> tuple[float, float]:
    x1, y1, x2, y2 = cell.polygon.bounds
    return x2 - x1, y2 - y1


# What the paper names as hard, planted on purpose: closed cells, rooms without a door, garages apart, open fronts.


_APART_M = (2.4, 6.0)
_Vector = npt.NDArray[np.float64]


def add_shafts(cells: list[Cell], rng: np.random.Generator) -> list[Cell] | None:
    """Cut one to three shafts (below 2 m2) out of rooms or stand chimneys in them, or None if there is no place."""
    n_before = len(cells)
    for _ in range(int(rng.integers(1, 4))):
        words = (("Aeration",), ())[int(rng.integers(2))]
        spec = RoomSpec(words, float(rng.uniform(0.5, 1.6)), int(rng.integers(55, 80)))
        cells = _chimney(cells, spec, rng) if rng.random() < 0.3 else carve_small_room(cells, spec, rng, "shaft")
    return cells if len(cells) > n_before else None


def _chimney(cells: list[Cell], spec: RoomSpec, rng: np.random.Generator) -> list[Cell]:
    """Stand a closed block in the middle of the widest room, with at least a metre all round."""
    rooms = [i for i, cell in enumerate(cells) if cell.use == "room" and not cell.polygon.interiors]
    circles = [shapely.maximum_inscribed_circle(cells[i].polygon, tolerance=5.0) for i in rooms]
    best = int(np.argmax([circle.length for circle in circles]))
    x, y = shapely.get_coordinates(circles[best])[0].round()
    a, b = float(spec.side), float(round(min(spec.area, 1.2) * 1e4 / spec.side))
    if rng.random() < 0.5:
        a, b = b, a
    block = shapely.box(x - a / 2, y - b / 2, x + a / 2, y + b / 2)
    cell = cells[rooms[best]]
    if cell.polygon.boundary.distance(block) < 100:
        return cells
    around = replace(cell, polygon=cell.polygon.difference(block))
    return [*cells[: rooms[best]], around, *cells[rooms[best] + 1 :], Cell(block, spec.words, "shaft")]


def add_garage(cells: list[Cell], rng: np.random.Generator) -> list[Cell] | None:
    """Put a garage beside the house, over 2 m off, under a quarter of its size, or None if the house is too small."""
    house = shapely.union_all([cell.polygon for cell in cells])
    wide = float(rng.integers(270, 340))
    deep = min(float(rng.integers(480, 650)), house.area * 0.2 / wide)
    if deep < 400:
        return None
    _, y1, x2, y2 = house.bounds
    gap = float(rng.uniform(*_APART_M)) * 100
    y = float(rng.uniform(y1 - deep / 2, y2 - deep / 2))
    box = affine_transform(shapely.box(0, 0, wide, deep), [1, 0, 0, 1, x2 + gap, y])
    return [*cells, Cell(box, ("Garage",), "garage")]


def remove_only_door(cells: list[Cell], doors: list[Opening], rng: np.random.Generator) -> list[Opening] | None:
    """Take the door of a room that has only one, or None if no room but corridors and closets has just one."""
    ends = [cell for door in doors for cell in door.cells]
    leaves = [
        i
        for i, cell in enumerate(cells)
        if ends.count(i) == 1 and cell.use == "room" and cell.polygon.area > 4.0 and cell.polygon.buffer(-0.6).area > 0
    ]
    if not leaves:
        return None
    shut = leaves[int(rng.integers(len(leaves)))]
    return [door for door in doors if shut not in door.cells]


def remove_outer_wall(
    cells: list[Cell],
    walls: list[Wall],
    openings: list[Opening],
    outer: list[tuple[int, Part]],
    *,
    half: bool,
    rng: np.random.Generator,
) -> tuple[list[Wall], list[Opening]] | None:
    """Leave out an outer wall, or the better half of one, or None if no outer wall is long enough.

    ``walls`` begins with one wall an edge, in the order of the edges.
    """
    whole = [
        edge
        for edge, (low, high) in outer
        if low == 0.0 and high == walls[edge].length and high > 2.6 and cells[walls[edge].cell].use == "room"
    ]
    if not whole:
        return None
    edge = whole[int(rng.integers(len(whole)))]
    wall = walls[edge]
    low, high = -wall.ends[0], wall.length + wall.ends[1]
    if half:
        width = max(1.7, wall.length * float(rng.uniform(0.4, 0.65)))
        low = float(rng.choice([low, rng.uniform(0.2, max(0.3, wall.length - width - 0.2))]))
        high = low + width
    start, along = np.array(wall.start), np.array(wall.direction)
    left = [each for each in openings if not _lies_in(each, start, along, low, high)]
    opened = [*walls[:edge], replace(wall, missing=((low, high),)), *walls[edge + 1 :]]
    return opened, left


def _lies_in(opening: Opening, start: _Vector, along: _Vector, low: float, high: float) -> bool:
    relative = np.array(opening.centre) - start
    at, off = float(relative @ along), abs(float(relative[0] * along[1] - relative[1] * along[0]))
    return off < 0.1 and low - opening.width / 2 - 0.1 < at < high + opening.width / 2 + 0.1
