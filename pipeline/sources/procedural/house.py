"""Make a house from its index and a seed, alone: the same house whatever others are made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely.affinity import affine_transform

from pipeline.sources.procedural.characters import sign
from pipeline.sources.procedural.furniture import loose_items
from pipeline.sources.procedural.roles import DUPLICATES, SOUND, original_of, role_of, scene_id
from pipeline.sources.procedural.storey import make_storey
from pipeline.sources.procedural.values import House, Item, Opening, Point, Storey, Wall

_STOREYS, _STOREY_SHARES = (1, 2, 3), (0.86, 0.12, 0.02)
_JITTER_M = 0.008


def make_house(index: int, seed: int) -> House:
    """Make house ``index`` of a seed."""
    role = role_of(index, seed)
    rng = np.random.default_rng([seed, index])
    if role in DUPLICATES:
        source = original_of(index, seed)
        return _repeated(make_house(source, seed), role, scene_id(index, seed), rng)
    if role == "objects_only":
        items = tuple(loose_items(rng))
        bare = Storey(items=items, difficulties=(role,), expected="rejected:no_layout")
        return _somewhere(House(scene_id(index, seed), (bare,)), rng)
    if role == "characters":
        return _somewhere(House(scene_id(index, seed), (sign(rng),)), rng)
    ground = make_storey(None if role == SOUND else role, rng)
    upper = [make_storey(None, rng) for _ in range(1, int(rng.choice(_STOREYS, p=_STOREY_SHARES)))]
    return _somewhere(House(scene_id(index, seed), (ground, *upper)), rng)


def level_id(house: str, level: int) -> str:
    """Return the id of a level's plan: the lowest has the scene's own."""
    return house if level == 0 else f"{house}_L{level}"


def _repeated(source: House, role: str, house_id: str, rng: np.random.Generator) -> House:
    """Return a copy under another id: the same, elsewhere, mirrored, or with each wall moved by up to 8 mm."""
    storeys = []
    matrix = {
        "shifted_duplicate": [1, 0, 0, 1, float(rng.uniform(-20, 20)), float(rng.uniform(-20, 20))],
        "mirrored_duplicate": [-1, 0, 0, 1, float(rng.uniform(20, 90)), 0.0],
    }.get(role)
    for level, storey in enumerate(source.storeys):
        copy = _moved(storey, matrix) if matrix else storey
        if role == "jittered_duplicate":
            moves = rng.uniform(-_JITTER_M, _JITTER_M, len(copy.walls)).tolist()
            walls = [replace(w, shift=w.shift + move) for w, move in zip(copy.walls, moves, strict=True)]
            copy = replace(copy, walls=tuple(walls))
        expected = f"duplicate_of:{level_id(source.id, level)}"
        storeys.append(replace(copy, difficulties=(role,), expected=expected))
    return replace(source, id=house_id, storeys=tuple(storeys))


def _somewhere(house: House, rng: np.random.Generator) -> House:
    """Move a house to where scenes lie: anywhere in the first hundred metres."""
    x, z = rng.uniform(20, 60, 2).round(3).tolist()
    return replace(house, storeys=tuple(_moved(storey, [1, 0, 0, 1, x, z]) for storey in house.storeys))


def _moved(storey: Storey, matrix: list[float]) -> Storey:
    """Take a storey through a rigid map of the plan, mirroring included (then walls run the other way)."""
    a, b, c, d, tx, tz = matrix
    mirrored = a * d - b * c < 0

    def point(p: Point) -> Point:
        return a * p[0] + b * p[1] + tx, c * p[0] + d * p[1] + tz

    def vector(v: Point) -> Point:
        return a * v[0] + b * v[1], c * v[0] + d * v[1]

    def wall(w: Wall) -> Wall:
        if not mirrored:
            return replace(w, start=point(w.start), direction=vector(w.direction))
        end = (w.start[0] + w.direction[0] * w.length, w.start[1] + w.direction[1] * w.length)
        along = vector(w.direction)
        missing = tuple((w.length - high, w.length - low) for low, high in reversed(w.missing))
        return replace(
            w, start=point(end), direction=(-along[0], -along[1]), ends=w.ends[::-1], skew=-w.skew, missing=missing
        )

    def opening(o: Opening) -> Opening:
        return replace(o, centre=point(o.centre), direction=vector(o.direction))

    def item(i: Item) -> Item:
        along = vector((float(np.cos(i.angle)), float(np.sin(i.angle))))
        return replace(i, centre=point(i.centre), angle=float(np.arctan2(along[1], along[0])))

    return replace(
        storey,
        cells=tuple(replace(cell, polygon=affine_transform(cell.polygon, matrix)) for cell in storey.cells),
        walls=tuple(map(wall, storey.walls)),
        openings=tuple(map(opening, storey.openings)),
        items=tuple(map(item, storey.items)),
    )
