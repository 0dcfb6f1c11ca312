"""Kind ``gazebo``: walls as boxes with gaps of full height for doors, no windows, furniture of boxes, one mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.parts.furnishing import furnished
from tests.builders.kinds.parts.openings import WIDEST_GAP_M
from tests.builders.kinds.parts.solids3d import box, joined
from tests.builders.kinds.parts.wall_bodies import wall_bodies
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import Member, Opening, Part, Storey
from tests.builders.kinds.writers import UP_OF, write


def make(rng: Generator, folder: Path, name: str, scale: float = 1.0) -> Member:
    """Write one world's mesh into a folder; ``scale`` is what a unit of a model stands for (20 m at 1:20)."""
    inner = round(float(rng.uniform(0.1, 0.2)), 2)
    style = Style(outer_m=(inner, inner), inner_m=(inner, inner), height_m=(2.2, 3.0), windows=0.0)
    storey = without_lintels(random_home(rng, style), bool(rng.random() < 0.7))
    parts = [Part(f"Wall_{k}", mesh, "wall", "wall") for k, mesh in enumerate(wall_bodies(storey, "boxes"))]
    if rng.random() < 0.7:
        things = furnished(storey, rng, float(rng.uniform(0.3, 1.0)))
        parts += [Part(f"{t.sort}_{k}", blocky(t.mesh, rng), "furniture", t.sort) for k, t in enumerate(things)]
    if rng.random() < 0.4:
        x1, y1, x2, y2 = storey.footprint.bounds
        parts.append(Part("ground_plane", box(x1 - 2, y1 - 2, -0.05, x2 + 2, y2 + 2, 0.0), "ground", "ground"))
    parts = [parts[k] for k in rng.permutation(len(parts))]
    suffix = str(rng.choice([".ply", ".stl", ".dae" if scale == 1.0 else ".stl", ".obj"]))
    placing = random_placing(rng, "z" if suffix == ".obj" and rng.random() < 0.5 else UP_OF[suffix], scale=scale)
    path = write(parts, folder / f"{name}{suffix}", placing)
    return Member(
        path,
        (truth_of(storey, placing, "furnished", name),),
        f"{len(parts)} parts, {suffix}",
        placing.up,
        placing.unit_m,
    )


def without_lintels(storey: Storey, outer_door: bool) -> Storey:
    """The same storey with gaps of full height for doors; some worlds have no outer door."""
    kept = []
    for o in storey.openings:
        if o.kind in {"door", "opening"} or (o.kind == "entrance" and outer_door and o.width < WIDEST_GAP_M):
            end = min(o.end, o.start + WIDEST_GAP_M)
            kept.append(
                Opening(o.wall, o.start, end, "entrance" if o.kind == "entrance" else "opening", 0.0, storey.height)
            )
    return replace(storey, openings=tuple(kept))


def blocky(mesh: trimesh.Trimesh, rng: Generator) -> trimesh.Trimesh:
    """A thing as it is, or as the box round it."""
    pieces = mesh.split(only_watertight=False)
    if rng.random() < 0.5:
        return mesh
    return joined([box(*np.asarray(p.bounds).ravel()) for p in pieces])
