"""What the paper names as hard, planted on purpose: closed cells, rooms without a door, garages apart, open fronts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.affinity import affine_transform

from pipeline.sources.procedural.reshape import carve
from pipeline.sources.procedural.values import Cell, Opening, Part, Spec, Wall

_APART_M = (2.4, 6.0)
_Vector = npt.NDArray[np.float64]


def add_shafts(cells: list[Cell], rng: np.random.Generator) -> list[Cell] | None:
    """Cut one to three shafts (below 2 m2) out of rooms or stand chimneys in them, or None if there is no place."""
    n_before = len(cells)
    for _ in range(int(rng.integers(1, 4))):
        words = (("Aeration",), ())[int(rng.integers(2))]
        spec = Spec(words, float(rng.uniform(0.5, 1.6)), int(rng.integers(55, 80)))
        cells = _chimney(cells, spec, rng) if rng.random() < 0.3 else carve(cells, spec, rng, "shaft")
    return cells if len(cells) > n_before else None


def _chimney(cells: list[Cell], spec: Spec, rng: np.random.Generator) -> list[Cell]:
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


def without_door(cells: list[Cell], doors: list[Opening], rng: np.random.Generator) -> list[Opening] | None:
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


def open_front(
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
