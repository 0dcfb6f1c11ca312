"""Kind ``office``: a storey of 60 to 150 rooms along corridors, glazed partitions, all door heads at one height."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from numpy.random import Generator
from shapely import box

from tests.builders.kinds.homes import whole
from tests.builders.kinds.parts.joinery import Joinery, fitted
from tests.builders.kinds.parts.layout import on_grid
from tests.builders.kinds.parts.openings import Heads, furnish_openings
from tests.builders.kinds.parts.slabs import floor_slab
from tests.builders.kinds.parts.topology import storey_of
from tests.builders.kinds.parts.wall_bodies import wall_bodies
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import Cell, Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write

LABELS = (
    ["OFFICE"] * 8
    + ["MEETING ROOM"] * 3
    + ["OPEN OFFICE"] * 2
    + ["STORAGE", "COPY", "MENS RR", "WOMENS RR", "BREAK RM"]
)
WIDTHS = {"OPEN OFFICE": (6.0, 9.0), "MEETING ROOM": (3.5, 6.0), "OFFICE": (2.6, 4.0)}


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one storey into a folder."""
    storey = random_office(rng)
    style = str(rng.choice(["boxes", "holes", "courses", "one"]))
    doors = str(rng.choice(["none", "none", "closed", "mixed"]))
    joinery = Joinery(doors, bool(rng.random() < 0.4), False, bool(rng.random() < 0.5))
    parts = [Part(f"wall_{k}", mesh, "wall", "wall") for k, mesh in enumerate(wall_bodies(storey, style))]
    parts += fitted(storey, joinery, rng)
    if rng.random() < 0.5:
        parts.append(Part("slab", floor_slab(storey, 0.3), "floor", "concrete"))
    suffix = str(rng.choice([".ply", ".obj", ".glb", ".stl"]))
    placing = random_placing(rng, UP_OF[suffix], turned=0.2)
    path = write(parts, folder / f"{name}{suffix}", placing)
    about = f"{len(storey.cells)} rooms, {style}, doors {doors}, {sum(len(p.mesh.faces) for p in parts)} faces"
    return Member(path, (truth_of(storey, placing, "solid", name),), about, placing.up, placing.unit_m)


def random_office(rng: Generator) -> Storey:
    """A storey whose corridors and rooms can all be reached."""
    while True:
        cells = [Cell(label, shape) for label, shape in comb(rng)]
        if not 60 <= len(cells) <= 150:
            continue
        height = round(float(rng.uniform(2.6, 3.4)), 2)
        outer, inner = round(float(rng.uniform(0.2, 0.45)), 2), round(float(rng.uniform(0.09, 0.16)), 3)
        bare = glazed(storey_of(cells, [], outer, inner, height), rng)
        if not all(whole(r) for r in bare.rooms):
            continue
        head = float(rng.choice([2.1, 2.134, 2.03, 2.2]))
        made = furnish_openings(bare, rng, {}, [0], Heads(head, head if rng.random() < 0.5 else head + 0.3), 0.5)
        if made is not None:
            return made


def comb(rng: Generator) -> list[tuple[str, shapely.Polygon]]:
    """Corridors side by side, joined at one or both ends, between double rows of rooms."""
    corridors, length = int(rng.integers(2, 5)), on_grid(rng.uniform(34, 62))
    wide, ways, rows, y = on_grid(rng.uniform(1.6, 2.4)), [], [], 0.0
    for _ in range(corridors):
        for _ in range(2):
            deep = on_grid(rng.uniform(3.4, 6.0))
            rows.append((y, y + deep))
            y += deep
            if len(rows) % 2:
                ways.append((y, y + wide))
                y += wide
    ends = [(0.0, wide)] + ([(length - wide, length)] if rng.random() < 0.5 else [])
    low, high = ways[0][0], ways[-1][1]
    spine = shapely.union_all([box(0.0, a, length, b) for a, b in ways] + [box(a, low, b, high) for a, b in ends])
    cells = [("CORRIDOR", spine)]
    for a, b in rows:
        start = wide if low < a < high else 0.0
        stop = length - wide if len(ends) == 2 and low < a < high else length
        cells += [(label, box(x1, a, x2, b)) for label, x1, x2 in row(rng, start, stop)]
    return cells


def row(rng: Generator, start: float, stop: float) -> list[tuple[str, float, float]]:
    """Rooms side by side."""
    made, x = [], start
    while x < stop - 1e-6:
        label = str(rng.choice(LABELS))
        end = on_grid(x + rng.uniform(*WIDTHS.get(label, (2.0, 3.2))))
        end = stop if stop - end < 2.6 else end
        made.append((label, x, end))
        x = end
    return made


def glazed(storey: Storey, rng: Generator) -> Storey:
    """Some partitions at the corridor are full-height glass, thinner than the others."""
    share = float(rng.choice([0.0, 0.3, 0.7]))
    thin = round(float(rng.uniform(0.05, 0.08)), 3)
    walls = []
    for wall in storey.walls:
        labels = {storey.cells[s].label for s in wall.sides if s >= 0}
        fits = not wall.outer and "CORRIDOR" in labels and labels & {"OFFICE", "MEETING ROOM", "OPEN OFFICE"}
        walls.append(replace(wall, thickness=thin, glass=True) if fits and rng.random() < share else wall)
    return replace(storey, walls=tuple(np.array(walls, dtype=object)))
