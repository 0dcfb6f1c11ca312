"""Kind ``roomplan``: a phone's model of a flat: walls are sheets on the room's side, doors and windows named sheets.

Where two rooms meet there are two sheets, a wall's thickness apart, each with the door's sheet in its hole; nothing
closes the gap between them, and nothing stands outside. Mere openings are holes. Floors are thin slabs.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import shapely
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.parts.sheets import sheet, zone_areas
from tests.builders.kinds.parts.solids3d import flat, joined, prism, upright
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import OUTSIDE, Member, Opening, Part, Storey
from tests.builders.kinds.writers import write


def make(rng: Generator, folder: Path, name: str) -> Member:
    """Write one model into a folder."""
    storey = random_home(rng, Style(size=str(rng.choice(["small", "home"])), outer_m=(0.1, 0.25), height_m=(2.3, 2.8)))
    parts = faces(storey) + [part for o in storey.openings for part in filled(storey, o)]
    if rng.random() < 0.5:
        parts += [Part("ceiling", flat(r, storey.height, up=False), "ceiling", "ceiling") for r in zone_areas(storey)]
    style, made = str(rng.choice(["{}_{}", "{}{}", "{}.{:03d}"])), []
    for k, part in enumerate(parts):
        word = part.name if style == "{}_{}" else part.name.capitalize()
        made.append(Part(style.format(word, k), part.mesh, part.role, f"Material_{len(part.name) + k % 7}"))
    placing = random_placing(rng, "y", turned=0.4)
    path = write([made[k] for k in rng.permutation(len(made))], folder / f"{name}.glb", placing)
    truth = truth_of(storey, placing, "scan", name)
    return Member(path, (truth,), f"{len(made)} sheets", placing.up, placing.unit_m)


def faces(storey: Storey) -> list[Part]:
    """The sheets of the walls, one node for each straight face, and the floors."""
    parts = []
    for area in zone_areas(storey):
        for ring in (area.exterior, *area.interiors):
            for a, b in itertools.pairwise(np.asarray(ring.coords)):
                made = sheet(storey, a, b, storey.openings, 0.0, storey.height)
                parts += [Part("wall", joined(made), "wall")] if made else []
        parts.append(Part("floor", prism(area, -0.1, 0.0), "floor"))
    return parts


def filled(storey: Storey, opening: Opening) -> list[Part]:
    """The sheets of a door or a window: one on each side that is a room."""
    if opening.kind == "opening":
        return []
    wall, parts = storey.walls[opening.wall], []
    word = "window" if opening.kind in {"window", "french"} else "door"
    for side, cell in zip((1, -1), wall.sides, strict=True):
        if cell != OUTSIDE:
            shift = side * wall.thickness / 2
            ends = wall.at(opening.start, shift), wall.at(opening.end, shift)
            if storey.rooms[cell].distance(shapely.Point(wall.at(opening.centre, shift))) < 0.01:
                parts.append(Part(word, upright(*ends, opening.sill, opening.head), "leaf"))
    return parts
