"""Kind ``front3d``: rooms of sheets and a shell of sheets, hollow between, as 3D-FRONT houses are.

Walls are capped at the top and open at jambs and windows; floors lie in the rooms and not inside the walls.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import shapely
import trimesh
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.parts.furnishing import furnished
from tests.builders.kinds.parts.sheets import facade, jambs, sheet_ring, zone_areas
from tests.builders.kinds.parts.solids3d import flat, joined, upright
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import LEADS_IN, Member, Part, Storey
from tests.builders.kinds.writers import write

STYLE = Style(outer_m=(0.1, 0.3), inner_m=(0.1, 0.25), height_m=(2.5, 2.9))


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one house into a folder."""
    storey = random_home(rng, STYLE)
    parts = shell(storey, rng)
    if rng.random() < 0.25:
        parts += [Part(t.sort, t.mesh, "furniture", t.sort) for t in furnished(storey, rng, 0.7)]
    parts = [parts[k] for k in rng.permutation(len(parts))]
    suffix = str(rng.choice([".obj", ".obj", ".glb", ".ply"]))
    placing = random_placing(rng, "y" if suffix != ".ply" else "z", turned=0.15)
    path = write(parts, folder / f"{name}{suffix}", placing)
    return Member(path, (truth_of(storey, placing, "sheet", name),), f"{len(parts)} sheets", placing.up, placing.unit_m)


def shell(storey: Storey, rng: Generator) -> list[Part]:
    """All sheets: each room's walls as one mesh, floor and ceiling; the outer shell; caps; thresholds; linings."""
    high, parts = storey.height, []
    thresholds, ceilings = bool(rng.random() < 0.5), bool(rng.random() < 0.8)
    lined, boards, panes = (bool(rng.random() < share) for share in (0.25, 0.3, 0.3))
    for group, area in zip(storey.zones, zone_areas(storey), strict=True):
        walls = joined(sheet_ring(storey, area, storey.openings, 0.0, high))
        parts.append(Part("WallInner", walls, "wall", "wall_paint"))
        for k in group:
            parts.append(Part("Floor", flat(storey.rooms[k], 0.0), "floor", "floor_wood"))
            if boards:
                parts.append(Part("Baseboard", baseboard(storey, k), "wall", "baseboard"))
            if ceilings:
                parts.append(Part("Ceiling", flat(storey.rooms[k], high, up=False), "ceiling", "ceiling"))
    for polygon in facade(storey):
        outer = joined(sheet_ring(storey, polygon, storey.openings, 0.0, high, inward=False))
        parts.append(Part("WallOuter", outer, "wall", "outer"))
    parts.append(Part("WallTop", flat(storey.wall_area, high), "wall", "cap"))
    for o in storey.openings:
        if thresholds and o.kind in LEADS_IN:
            parts.append(Part("Threshold", flat(storey.gap(o), 0.0), "floor", "threshold"))
        if lined and o.kind in LEADS_IN:
            parts.append(Part("Pocket", jambs(storey, o, high), "frame", "pocket"))
        if panes and o.kind in {"window", "french"}:
            wall = storey.walls[o.wall]
            parts.append(Part("Window", upright(wall.at(o.start), wall.at(o.end), o.sill, o.head), "window", "glass"))
    return [
        p
        for p in parts
        if isinstance(p.mesh, trimesh.Trimesh) and len(p.mesh.faces) > 0 and np.isfinite(p.mesh.vertices).all()
    ]


def baseboard(storey: Storey, room: int) -> trimesh.Trimesh:
    """A low sheet a centimetre before a room's walls, open at doors."""
    inner = storey.rooms[room].buffer(-0.01, join_style="mitre")
    doors = [storey.gap(o, 0.05) for o in storey.openings if o.sill < 0.1]
    line = inner.exterior.difference(shapely.union_all(doors))
    runs = [np.asarray(g.coords) for g in shapely.get_parts(line)]
    return joined([upright(a, b, 0.0, 0.09) for run in runs for a, b in itertools.pairwise(run)])
