"""Kind ``rowhouses``: two to four houses wall to wall in one mesh (nobody passes from one to another), or detached."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_home, thicknesses, whole
from tests.builders.kinds.parts.alterations import draft_home
from tests.builders.kinds.parts.joinery import Joinery
from tests.builders.kinds.parts.layout import Draft
from tests.builders.kinds.parts.openings import Heads, furnish_openings
from tests.builders.kinds.parts.solids3d import moved
from tests.builders.kinds.parts.topology import storey_of
from tests.builders.kinds.parts.wall_bodies import STYLES
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.solids import storey_parts
from tests.builders.kinds.values import Cell, Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one row, or two or three detached houses, into a folder."""
    style, joinery = str(rng.choice(STYLES)), Joinery.draw(rng)
    slab = 0.2 if rng.random() < 0.6 else 0.0
    detached = rng.random() < 0.35
    storeys = apart(rng) if detached else [(random_row(rng), 0.0)]
    parts: list[Part] = []
    for storey, x in storeys:
        made = storey_parts(storey, style, joinery, rng, slab)
        parts += [Part(p.name, moved(p.mesh, x, 0.0), p.role, p.material) for p in made]
    suffix = str(rng.choice([".ply", ".obj", ".glb", ".stl"]))
    placing = random_placing(rng, UP_OF[suffix])
    path = write([parts[k] for k in rng.permutation(len(parts))], folder / f"{name}{suffix}", placing)
    truths = [truth_of(shifted(s, x), placing, "solid", f"{name}_B{k}") for k, (s, x) in enumerate(storeys)]
    what = f"{len(storeys)} detached" if detached else f"{1 + max(c.unit for c in storeys[0][0].cells)} in a row"
    return Member(
        path,
        tuple(truths),
        f"{what}, {style}, doors {joinery.doors}, frames {joinery.frames}, slab {slab}",
        placing.up,
        placing.unit_m,
    )


def apart(rng: Generator) -> list[tuple[Storey, float]]:
    """Houses with gardens between them: each with where it starts."""
    made, x = [], 0.0
    height = float(rng.uniform(2.4, 3.0))
    for _ in range(int(rng.integers(2, 4))):
        storey = random_home(rng, Style(size="small", height_m=(height, height)))
        x1, _, x2, _ = storey.footprint.bounds
        made.append((storey, x - x1))
        x += x2 - x1 + float(rng.uniform(2.0, 8.0))
    return made


def shifted(storey: Storey, x: float) -> Storey:
    """The same storey moved along x."""
    cells = [Cell(c.label, shapely.affinity.translate(c.polygon, x), c.unit, c.floor) for c in storey.cells]
    walls = [
        type(w)((w.a[0] + x, w.a[1]), (w.b[0] + x, w.b[1]), w.thickness, w.sides, w.height, w.glass)
        for w in storey.walls
    ]
    return Storey(tuple(cells), tuple(walls), storey.openings, storey.height, storey.zones,
                  tuple(shapely.affinity.translate(p, x) for p in storey.pillars))  # fmt: skip


def random_row(rng: Generator) -> Storey:
    """One layout, mirrored from house to house, with doors and windows of their own."""
    while True:
        draft, count = draft_home(rng, "row"), int(rng.integers(2, 5))
        cells, merged, private, entrances = repeated(draft, count)
        outer, inner = thicknesses(rng, Style())
        height = round(float(rng.uniform(2.4, 3.1)), 2)
        bare = storey_of(cells, merged, outer, inner, height, party_m=round(float(rng.uniform(0.2, 0.4)), 2))
        if not all(whole(r) for r in bare.rooms):
            continue
        made = furnish_openings(bare, rng, private, entrances, Heads.draw(rng, height))
        if made is not None:
            return made


def repeated(draft: Draft, count: int) -> tuple[list[Cell], list[tuple[int, int]], dict[int, int], list[int]]:
    """The cells of ``count`` narrow houses: the layout turned so that its corridor runs from street to garden."""
    cells: list[Cell] = []
    merged, private, entrances = [], {}, []
    tall = max(s.bounds[3] for s in draft.shapes)
    for unit in range(count):
        first = len(cells)
        for label, shape in zip(draft.labels, draft.shapes, strict=True):
            x, y = np.asarray(shape.exterior.coords).T
            across = y if unit % 2 == 0 else tall - y
            ring = np.column_stack([across + unit * tall, x])
            cells.append(Cell(label, shapely.Polygon(np.round(ring, 6)), unit))
        merged += [(first + i, first + j) for i, j in draft.merged]
        private |= {first + i: first + j for i, j in draft.private.items()}
        entrances.append(first + draft.entrance)
    return cells, merged, private, entrances
