"""Kind ``solids``: a house as CAD programs export it: solid walls, leaves absent, closed, ajar or open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_storeys
from tests.builders.kinds.parts.joinery import Joinery, fitted
from tests.builders.kinds.parts.slabs import flight, floor_slab, pitched_roof
from tests.builders.kinds.parts.solids3d import joined, moved, prism
from tests.builders.kinds.parts.wall_bodies import STYLES, wall_bodies
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write

FORMATS = (".ply", ".obj", ".glb", ".stl", ".dae", ".off")
UNDECLARED = (".ply", ".obj", ".stl", ".off")
"""Formats that say nothing of their unit."""


def make(rng: Generator, folder: Path, name: str, scale: float = 1.0) -> Member:
    """Write one house into a folder; ``scale`` is what a unit of a model stands for (20 m at 1:20)."""
    count = int(rng.choice([1, 1, 1, 2, 3]))
    storeys = random_storeys(
        rng, Style(size=str(rng.choice(["home", "home", "small"])) if count == 1 else "home"), count
    )
    return render(storeys, rng, folder, name, scale)


def render(storeys: list[Storey], rng: Generator, folder: Path, name: str, scale: float = 1.0) -> Member:
    """Write storeys as solids in a random manner."""
    style, joinery = str(rng.choice(STYLES)), Joinery.draw(rng)
    slab = round(float(rng.uniform(0.15, 0.35)), 2)
    floors = len(storeys) > 1 or rng.random() < 0.6
    cover = str(rng.choice(["none", "none", "slab", "roof"]))
    parts, floors_z, z = [], [], 0.0
    for level, storey in enumerate(storeys):
        below = storeys[level - 1] if level else None
        made = storey_parts(storey, style, joinery, rng, slab if floors else 0.0)
        if below is not None:
            rise = below.height + slab
            made += [Part("stair", moved(joined(flight(storey, rise)), 0, 0, -rise), "stair", "stair")]
        parts += [replace(p, mesh=moved(p.mesh, 0, 0, z), name=f"L{level}_{p.name}") for p in made]
        floors_z.append(z)
        z += storey.height + slab
    top = z - slab
    if cover == "slab":
        parts.append(Part("roof", prism(storeys[-1].footprint, top, top + slab), "roof", "roof"))
    if cover == "roof":
        parts.append(Part("ceiling", prism(storeys[-1].footprint, top, top + slab), "roof", "roof"))
        parts.append(Part("roof", pitched_roof(storeys[-1], top + slab, rng), "roof", "roof"))
    order = rng.permutation(len(parts)) if rng.random() < 0.5 else np.arange(len(parts))
    suffix = str(rng.choice(FORMATS if scale == 1.0 else UNDECLARED))
    up = "z" if suffix == ".obj" and rng.random() < 0.3 else UP_OF[suffix]
    units = ("m",) if suffix == ".glb" or scale != 1.0 else ("m", "m", "m", "cm", "mm", "in")
    placing = random_placing(rng, up, units, scale=scale)
    path = write([parts[k] for k in order], folder / f"{name}{suffix}", placing)
    truths = [truth_of(s, placing, "solid", f"{name}_{k}", floors_z[k]) for k, s in enumerate(storeys)]
    about = f"{len(storeys)} storeys, {style}, doors {joinery.doors}, frames {joinery.frames}, floors {floors}, {cover}"
    return Member(path, tuple(truths), about, placing.up, placing.unit_m)


def storey_parts(storey: Storey, style: str, joinery: Joinery, rng: Generator, slab: float) -> list[Part]:
    """Walls, floor and what stands in the openings of a storey whose floor is at 0."""
    walls = wall_bodies(storey, style)
    parts = [Part(f"wall_{k}", mesh, "wall", "wall") for k, mesh in enumerate(walls)]
    if rng.random() < 0.3:
        parts = [Part("walls", joined(walls), "wall", "wall")]
    if slab:
        parts.append(Part("slab", floor_slab(storey, slab), "floor", "floor"))
    return parts + fitted(storey, joinery, rng)
