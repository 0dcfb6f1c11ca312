"""Kind ``procthor``: walls without thickness, two sheets in one place for each, door holes to the floor, windows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import shapely
import trimesh
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.parts.sheets import facade, sheet_ring
from tests.builders.kinds.parts.solids3d import flat, joined
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write

STYLE = Style(outer_m=(0.1, 0.1), inner_m=(0.1, 0.1), height_m=(2.4, 3.4), windows=0.5)


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one house into a folder."""
    thick = random_home(rng, replace(STYLE, size=str(rng.choice(["small", "home"]))))
    storey = replace(thick, walls=tuple(replace(w, thickness=0.0) for w in thick.walls))
    parts = [Part(f"wall_{k}", mesh, "wall", "wall") for k, mesh in enumerate(walls(storey))]
    if rng.random() < 0.6:
        parts += [Part(f"floor_{r}", flat(c.polygon, 0.0), "floor", "floor") for r, c in enumerate(storey.cells)]
    if rng.random() < 0.3:
        parts.append(Part("ceiling", flat(storey.footprint, storey.height, up=False), "ceiling", "ceiling"))
    parts = [parts[k] for k in rng.permutation(len(parts))]
    suffix = str(rng.choice([".ply", ".obj", ".glb", ".stl"]))
    placing = random_placing(rng, UP_OF[suffix], turned=0.2)
    path = write(parts, folder / f"{name}{suffix}", placing)
    return Member(path, (truth_of(storey, placing, "sheet", name),), f"{len(parts)} sheets", placing.up, placing.unit_m)


def walls(storey: Storey) -> list[trimesh.Trimesh]:
    """The sheets of each zone, and those of the outside in the same places."""
    made = []
    for group in storey.zones:
        area = joined_cells(storey, group)
        made.append(joined(sheet_ring(storey, area, storey.openings, 0.0, storey.height)))
    outer = [sheet_ring(storey, p, storey.openings, 0.0, storey.height, inward=False) for p in facade(storey)]
    return made + [joined(sheets) for sheets in outer]


def joined_cells(storey: Storey, group: tuple[int, ...]) -> shapely.Polygon:
    """The cells of a zone as one polygon."""
    return shapely.union_all([storey.cells[k].polygon for k in group])
