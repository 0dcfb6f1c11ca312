"""Random homes of the kit in SUNCG's layout on disk, some with a planted fault, and their truth in the form of cases.

``write_house`` makes one house from its index and a seed, whatever others are made; ``write_houses`` makes many. Every
hundred houses hold each fault in the same share. A wall is two slabs of 0.05 m, which both of its rooms draw.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Polygon, box
from shapely.affinity import affine_transform

from pipeline.sources.homes.level import DOOR_HEAD_M, SILL_M, WALL_TOP_M, Meshed, prism_mesh
from tests.builders.kinds.homes import Style, random_home, whole
from tests.builders.kinds.placing import Placing, truth_of
from tests.builders.kinds.values import LEADS_IN, OUTSIDE, Cell, Opening, Point, Storey, Wall, joint

THICK_M = 0.1
STYLE = Style(outer_m=(THICK_M, THICK_M), inner_m=(THICK_M, THICK_M), height_m=(WALL_TOP_M, WALL_TOP_M), merged=False)
STOREY_M = 2.8
WINDOW_M = (0.87, 2.23)
FLOOR_M, CEILING_M = (0.0, 0.05), (2.69, 2.74)
JITTER_M = 0.008
LEAF = "122"
SIZES = {
    "1101": (1.6, 0.5, 2.0),
    "1102": (0.9, 0.45, 1.9),
    "1103": (1.2, 0.75, 0.8),
    "1104": (0.45, 0.9, 0.45),
    LEAF: (0.8, 2.05, 0.04),
}
"""Width, height and depth of models, metres; the others are those of no door."""
DUPLICATES = ("exact_duplicate", "shifted_duplicate", "mirrored_duplicate", "jittered_duplicate")
PER_HUNDRED = {
    "closed_cell": 5,
    "no_door": 5,
    "garage_apart": 4,
    "open_front": 4,
    "half_open_front": 4,
    "objects_only": 4,
    "characters": 4,
    "exact_duplicate": 4,
    "shifted_duplicate": 2,
    "mirrored_duplicate": 2,
    "jittered_duplicate": 2,
}
ROLES = [role for role, count in PER_HUNDRED.items() for _ in range(count)]
LOOK_BACK = 60
"""A duplicate repeats one of so many houses before it."""
STROKES = {
    "A": "00-04 04-24 24-20 02-22",
    "C": "20-00 00-04 04-24",
    "E": "20-00 00-04 04-24 02-12",
    "H": "00-04 20-24 02-22",
    "K": "00-04 02-24 02-20",
    "L": "04-00 00-20",
    "N": "00-04 04-20 20-24",
    "O": "00-04 04-24 24-20 20-00",
    "T": "04-24 10-14",
    "Z": "04-24 24-00 00-20",
}
"""Each stroke joins points (column, row) written as two digits; rows count upward."""

BOX = np.array(
    [(2, 1, 0), (3, 2, 0), (4, 5, 6), (4, 6, 7)]
    + [face for k in range(4) for face in ((k, (k + 1) % 4, (k + 1) % 4 + 4), (k, (k + 1) % 4 + 4, k + 4))]
)
"""Faces of four lower corners, counter-clockwise, and the four over them."""

Part = tuple[str, Meshed]
Span = tuple[float, float]


@dataclass(frozen=True)
class Item:
    """A piece of furniture or a door's leaf: its model, where it stands, how it is turned (radians), its room."""

    model: str
    centre: Point
    angle: float
    room: int | None = None


@dataclass(frozen=True, eq=False)
class Level:
    """A storey: which parts of its walls are not built, by wall, and what stands in it."""

    storey: Storey = field(default_factory=lambda: Storey((), (), (), WALL_TOP_M, ()))
    items: tuple[Item, ...] = ()
    missing: tuple[tuple[int, float, float], ...] = ()
    has_floor: bool = True


def write_houses(folder: Path, count: int, seed: int) -> None:
    """Write houses 0 to ``count`` - 1 of a seed."""
    for index in range(count):
        write_house(folder, index, seed)


def write_house(folder: Path, index: int, seed: int) -> None:
    """Write a house into a SUNCG root, and truth/<id>.json for each of its levels."""
    name, levels = scene_id(index, seed), make_house(index, seed)
    _write_scene(folder, name, levels)
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    for number, level in enumerate(levels):
        truth = _truth(level, f"{name}_L{number}" if number else name, number * STOREY_M)
        (folder / "truth" / f"{truth['id']}.json").write_text(json.dumps(truth | {"difficulties": fault(index, seed)}))


def scene_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a house."""
    return hashlib.sha256(f"houseexpo procedural {seed} {index}".encode()).hexdigest()[:32]


def fault(index: int, seed: int) -> list[str]:
    """Return what is planted in a house; a duplicate without a house before it is sound."""
    role = _drawn_role(index, seed)
    return [] if role is None or (role in DUPLICATES and not _originals(index, seed)) else [role]


def _drawn_role(index: int, seed: int) -> str | None:
    order = np.random.default_rng([seed, index // 100, 1]).permutation(100)
    return dict(enumerate(ROLES)).get(int(order[index % 100]))


def _originals(index: int, seed: int) -> list[int]:
    return [k for k in range(max(0, index - LOOK_BACK), index) if _drawn_role(k, seed) is None]


def make_house(index: int, seed: int) -> tuple[Level, ...]:
    """Make the levels of a house, from the ground up."""
    rng = np.random.default_rng([seed, index])
    role = next(iter(fault(index, seed)), "")
    if role in DUPLICATES:
        originals = _originals(index, seed)
        original = originals[int(np.random.default_rng([seed, index, 2]).integers(len(originals)))]
        return tuple(_copied(level, role, rng) for level in make_house(original, seed))
    if role == "objects_only":
        models = rng.choice([model for model in SIZES if model != LEAF], int(rng.integers(4, 15))).tolist()
        return (
            Level(items=tuple(Item(model, (20 + 9 * rng.random(), 30 + 9 * rng.random()), 0.0) for model in models)),
        )
    if role == "characters":
        return (_lettering(rng),)
    count = int(rng.choice([1, 2, 3], p=[0.86, 0.12, 0.02]))
    levels = [_sound(rng) for _ in range(count)]
    planted = FAULTS[role](levels[0], rng) if role else levels[0]
    while planted is None:
        planted = FAULTS[role](_sound(rng), rng)
    turn = rng.random() * 0.6 if rng.random() < 0.1 else 0.0
    (c, s), (x, y) = (np.cos(turn), np.sin(turn)), rng.uniform(20, 60, 2).round(3)
    return tuple(_furnished(_moved(level, [c, -s, s, c, x, y]), rng) for level in (planted, *levels[1:]))


def _sound(rng: Generator) -> Level:
    """Return a home whose doors and windows are as high as SUNCG's; some walls between rooms are skewed a little."""
    storey = random_home(rng, STYLE)
    heights = {"window": WINDOW_M}
    holes = [
        replace(hole, sill=sill, head=head, leaves=())
        for hole in storey.openings
        for sill, head in [heights.get(hole.kind, (SILL_M, DOOR_HEAD_M))]
    ]
    return Level(storey.with_openings(holes))


# Faults: each takes a sound level and returns it with the fault planted, or None if it has no place for it.


def _with_shaft(level: Level, rng: Generator) -> Level | None:
    """Stand a closed shaft of 0.5 to 1.6 m2 against a wall of a room, away from its doors."""
    storey = level.storey
    for k in rng.permutation(len(storey.walls)).tolist():
        wall, wide, deep = storey.walls[k], float(rng.uniform(0.8, 1.4)), float(rng.uniform(0.75, 1.2))
        at = float(rng.uniform(0.5, max(0.6, wall.length - wide - 0.5)))
        number = max(wall.sides)
        left = 1.0 if wall.sides[0] == number else -1.0
        corners = [tuple(wall.at(s, left * t)) for s, t in ((at, 0), (at + wide, 0), (at + wide, deep), (at, deep))]
        shaft, cell = Polygon(corners), storey.cells[number]
        near = any(storey.gap(hole, 0.8).intersects(shaft.buffer(0.4)) for hole in storey.openings)
        rest = cell.polygon.difference(shaft)
        if (
            near
            or wall.length < wide + 1
            or not cell.polygon.buffer(1e-6).covers(shaft)
            or not isinstance(rest, Polygon)
        ):
            continue
        cells = [*storey.cells, Cell("", shaft, floor=False)]
        cells[number] = replace(cell, polygon=rest)
        sides = [Wall(corners[i], corners[j], THICK_M, (number, len(cells) - 1)) for i, j in ((1, 2), (2, 3), (3, 0))]
        found = replace(storey, cells=tuple(cells), walls=(*storey.walls, *sides))
        if whole(found.rooms[number]):
            return replace(level, storey=found)
    return None


def _without_only_door(level: Level, rng: Generator) -> Level | None:
    """Take the door of a room that has only one."""
    storey = level.storey
    doors = [hole for hole in storey.openings if hole.kind != "window"]
    rooms = [k for k, room in enumerate(storey.rooms) if room.area > 4 and len(_holes_of(storey, k, doors)) == 1]
    only = [hole for k in rooms for hole in _holes_of(storey, k, doors) if hole.kind in LEADS_IN]
    if not only or len(storey.cells) < 3:
        return None
    gone = only[int(rng.integers(len(only)))]
    return replace(level, storey=storey.with_openings([hole for hole in storey.openings if hole is not gone]))


def _holes_of(storey: Storey, room: int, holes: list[Opening]) -> list[Opening]:
    return [hole for hole in holes if room in storey.walls[hole.wall].sides]


def _with_garage(level: Level, rng: Generator) -> Level | None:
    """Put a garage 2.4 to 6 m beside the house, if it is under a fifth of its size."""
    storey = level.storey
    x, y = storey.footprint.bounds[2] + float(rng.uniform(2.4, 6.0)), storey.footprint.bounds[1]
    wide, deep = float(rng.uniform(2.7, 3.4)), float(rng.uniform(4.0, 5.5))
    if wide * deep > 0.2 * storey.footprint.area:
        return None
    corners = [(x, y), (x + wide, y), (x + wide, y + deep), (x, y + deep)]
    number, first = len(storey.cells), len(storey.walls)
    walls = [Wall(corners[i], corners[(i + 1) % 4], THICK_M, (number, OUTSIDE)) for i in range(4)]
    gate = Opening(first, 0.2, wide - 0.2, "entrance", SILL_M, DOOR_HEAD_M)
    cells = (*storey.cells, Cell("Garage", Polygon(corners), floor=False))
    return replace(
        level,
        storey=replace(storey, cells=cells, walls=(*storey.walls, *walls), openings=(*storey.openings, gate)),
    )


def _with_open_front(level: Level, rng: Generator, *, half: bool) -> Level | None:
    """Leave out an outer wall, or the better half of one."""
    storey = level.storey
    long = [k for k, wall in enumerate(storey.walls) if wall.outer and wall.length > 2.6]
    if not long:
        return None
    k = long[int(rng.integers(len(long)))]
    low, high = -1.0, storey.walls[k].length + 1.0
    if half:
        low = float(rng.choice([low, 0.3]))
        high = max(low, 0.0) + max(1.7, storey.walls[k].length * float(rng.uniform(0.4, 0.65)))
    left = [hole for hole in storey.openings if hole.wall != k or hole.end < low or hole.start > high]
    return replace(level, storey=storey.with_openings(left), missing=((k, low, high),))


FAULTS: dict[str, Callable[[Level, Generator], Level | None]] = {
    "closed_cell": _with_shaft,
    "no_door": _without_only_door,
    "garage_apart": _with_garage,
    "open_front": partial(_with_open_front, half=False),
    "half_open_front": partial(_with_open_front, half=True),
}


def _lettering(rng: Generator) -> Level:
    """Write three to seven characters with walls that stand free; one nameless room without a floor holds each.

    No ring encloses 2 m2: the largest, an O, is 1.0 by 1.8 m at most.
    """
    wide, high = float(rng.uniform(0.7, 1.0)), float(rng.uniform(1.2, 1.8))
    cells, walls = [], []
    for k, character in enumerate(rng.choice(sorted(STROKES), size=int(rng.integers(3, 8))).tolist()):
        x = 30 + 1.6 * k * wide
        cells.append(Cell("", box(x, 30.0, x + wide, 30.0 + high)))
        for stroke in STROKES[character].split():
            a, b = ((x + int(p[0]) / 2 * wide, 30.0 + int(p[1]) / 4 * high) for p in stroke.split("-"))
            walls.append(Wall(a, b, THICK_M, (k, k)))
    return Level(Storey(tuple(cells), tuple(walls), (), WALL_TOP_M, ()), has_floor=False)


def _copied(level: Level, role: str, rng: Generator) -> Level:
    """Return a copy: the same, elsewhere, mirrored, or with each corner moved by up to 8 mm."""
    if role == "shifted_duplicate":
        return _moved(level, [1, 0, 0, 1, 7.25, -11.5])
    if role == "mirrored_duplicate":
        return _moved(level, [-1, 0, 0, 1, 95.0, 0])
    if role == "jittered_duplicate":
        moves = {end: rng.uniform(-JITTER_M, JITTER_M, 2) for end in level.storey.joints}
        walls = [
            replace(wall, a=tuple(wall.a + moves[joint(wall.a)]), b=tuple(wall.b + moves[joint(wall.b)]))
            for wall in level.storey.walls
        ]
        return replace(level, storey=replace(level.storey, walls=tuple(walls)))
    return level


def _moved(level: Level, matrix: list[float]) -> Level:
    """Take a level through a rigid map of the plan; where that mirrors, the sides of walls change places."""
    mirrored = matrix[0] * matrix[3] < matrix[1] * matrix[2]

    def point(at: Point) -> Point:
        (a, b, c, d, tx, ty), (x, y) = matrix, at
        return float(a * x + b * y + tx), float(c * x + d * y + ty)

    def turned(angle: float) -> float:
        (x1, y1), (x2, y2) = point((0.0, 0.0)), point((float(np.cos(angle)), float(np.sin(angle))))
        return float(np.arctan2(y2 - y1, x2 - x1))

    storey = level.storey
    found = replace(
        storey,
        cells=tuple(replace(cell, polygon=affine_transform(cell.polygon, matrix)) for cell in storey.cells),
        walls=tuple(
            replace(
                wall, a=point(wall.a), b=point(wall.b), sides=(wall.sides[1], wall.sides[0]) if mirrored else wall.sides
            )
            for wall in storey.walls
        ),
        pillars=tuple(affine_transform(pillar, matrix) for pillar in storey.pillars),
    )
    items = [replace(item, centre=point(item.centre), angle=turned(item.angle)) for item in level.items]
    return replace(level, storey=found, items=tuple(items))


def _furnished(level: Level, rng: Generator) -> Level:
    """Put one or two pieces into each room and a leaf into each door."""
    items = []
    for number, room in enumerate(level.storey.rooms):
        inner = room.buffer(-0.4)
        for _ in range(int(rng.integers(1, 3)) if not inner.is_empty else 0):
            (x1, y1, x2, y2), model = inner.bounds, sorted(SIZES)[int(rng.integers(4))]
            at = (float(rng.uniform(x1, x2)), float(rng.uniform(y1, y2)))
            if model != LEAF and shapely.contains_xy(inner, *at):
                items.append(Item(model, at, float(rng.integers(4)) * np.pi / 2, number))
    for hole in level.storey.openings:
        wall = level.storey.walls[hole.wall]
        if hole.kind not in {"window", "opening"}:
            x, y = wall.at(hole.centre).tolist()
            items.append(Item(LEAF, (x, y), float(np.arctan2(wall.along[1], wall.along[0])), max(wall.sides)))
    return replace(level, items=tuple(items))


def _truth(level: Level, name: str, floor_z: float) -> dict[str, Any]:
    """What is true of a level: shafts and what stands apart are no rooms; walls that are missing count as standing."""
    storey = level.storey
    if not level.has_floor:
        return {"id": name, "floor_z": floor_z, "rooms": [], "doors": []}
    sides = [storey.walls[hole.wall].sides for hole in storey.openings]
    inside = [all(k < 0 or storey.cells[k].floor for k in pair) for pair in sides]
    storey = storey.with_openings([hole for hole, its in zip(storey.openings, inside, strict=True) if its])
    return truth_of(storey, Placing(), "raw", name, floor_z)


# The files: house.json, the meshes of rooms (OBJ), and the models of furniture.


def _write_scene(root: Path, name: str, levels: tuple[Level, ...]) -> None:
    """Write house/<id>/, room/<id>/ and what is missing of object/ under a root folder."""
    rooms = root / "room" / name
    rooms.mkdir(parents=True, exist_ok=True)
    nodes = [_nodes(level, number) for number, level in enumerate(levels)]
    for number, level in enumerate(levels):
        for room, cell in enumerate(level.storey.cells):
            files = {"w": list(_wall_parts(level, number, room))}
            if level.has_floor:
                files["f"] = [("Floor", prism_mesh(cell.polygon, *FLOOR_M))]
                files["c"] = [("Ceiling", prism_mesh(cell.polygon, *CEILING_M))]
            for suffix, parts in files.items():
                _write_obj(rooms / f"fr_{number}rm_{room}{suffix}.obj", parts, number * STOREY_M)
    for model in sorted({item.model for level in levels for item in level.items}):
        (root / "object" / model).mkdir(parents=True, exist_ok=True)
        width, height, depth = SIZES[model]
        parts = [(f"Model#{model}", prism_mesh(box(-width / 2, -depth / 2, width / 2, depth / 2), 0.0, height))]
        _write_obj(root / "object" / model / f"{model}.obj", parts, 0.0)
    scene = {
        "version": "suncg@1.0.0",
        "id": name,
        "up": [0, 1, 0],
        "front": [0, 0, 1],
        "scaleToMeters": 1,
        "levels": [{"id": str(k), "bbox": _around(own), "nodes": own} for k, own in enumerate(nodes)],
        "bbox": _around([node for own in nodes for node in own]),
    }
    folder = root / "house" / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "house.json").write_text(json.dumps(scene, separators=(",", ":")))


def _wall_parts(level: Level, number: int, room: int) -> Iterator[Part]:
    """Yield the slabs of a room's walls, inside and outside, around the holes in them."""
    storey = level.storey
    for k, wall in enumerate(storey.walls):
        if room not in wall.sides:
            continue
        holes = [(hole.start, hole.end, hole.sill, hole.head) for hole in storey.on(k)]
        holes += [(low, high, 0.0, WALL_TOP_M) for gone, low, high in level.missing if gone == k]
        pieces, at = [], -storey.reach(k, wall.a)
        for start, end, sill, head in sorted(holes):
            pieces += [(at, start, 0.0, WALL_TOP_M), (start, end, 0.0, sill), (start, end, head, WALL_TOP_M)]
            at = end
        pieces.append((at, wall.length + storey.reach(k, wall.b), 0.0, WALL_TOP_M))
        for start, end, low, high in pieces:
            if end - start > 0.001 and high - low > 0.001:
                for word, sides in (("Inside", (0.0, wall.thickness / 2)), ("Outside", (-wall.thickness / 2, 0.0))):
                    yield f"Wall{word}#{number}_{room}_{k}", _slab(wall, (start, end), sides, (low, high))
    for pillar in storey.pillars:
        if storey.cells[room].polygon.intersects(pillar.centroid):
            yield f"WallInside#{number}_{room}_pillar", prism_mesh(pillar, 0.0, WALL_TOP_M)


def _slab(wall: Wall, along: Span, across: Span, heights: Span) -> Meshed:
    """Return a closed box: its spans along the wall, to the left of its line, and in height."""
    (a, b), (right, left) = along, across
    plan = np.array([wall.at(*corner) for corner in ((a, right), (b, right), (b, left), (a, left))])
    twice = np.tile(plan, (2, 1))
    return np.column_stack([twice, np.repeat(heights, 4)]), twice, BOX


def _write_obj(path: Path, parts: list[Part], foot: float) -> None:
    """Write parts as objects of an OBJ file: X, Y and Z are plan x, height and plan y, which mirrors, so faces turn."""
    text = [f"mtllib {path.stem}.mtl\n"]
    first = 1
    for name, (points, texture, faces) in parts:
        scene = points[:, [0, 2, 1]] + [0.0, foot, 0.0]
        corners = np.repeat(faces[:, ::-1] + first, 2, axis=1)
        text.append(f"o {name}\ng {name}\n")
        text.append("v %.6f %.6f %.6f\n" * len(scene) % tuple(scene.ravel().tolist()))
        text.append("vt %.4f %.4f\n" * len(texture) % tuple(texture.ravel().tolist()))
        text.append("usemtl plain\n" + "f %d/%d %d/%d %d/%d\n" * len(corners) % tuple(corners.ravel().tolist()))
        first += len(scene)
    path.write_text("".join(text))
    path.with_suffix(".mtl").write_text("newmtl plain\nKd 0.8 0.8 0.8\n")


def _nodes(level: Level, number: int) -> list[dict[str, Any]]:
    """Return the nodes of a level of house.json: its rooms first, then the objects."""
    foot, count = number * STOREY_M, len(level.storey.cells)
    found: list[dict[str, Any]] = []
    for room, cell in enumerate(level.storey.cells):
        x1, y1, x2, y2 = cell.polygon.buffer(THICK_M / 2).bounds
        node = {
            "id": f"{number}_{room}",
            "type": "Room",
            "valid": 1,
            "modelId": f"fr_{number}rm_{room}",
            "roomTypes": [cell.label] if cell.label else [],
            "nodeIndices": [count + k for k, item in enumerate(level.items) if item.room == room],
            "bbox": {"min": [x1, foot, y1], "max": [x2, foot + WALL_TOP_M, y2]},
        }
        found.append(node if level.has_floor else node | {"hideFloor": 1, "hideCeiling": 1})
    for item in level.items:
        (width, height, depth), (x, z), up = SIZES[item.model], item.centre, foot + FLOOR_M[1]
        c, s = float(np.cos(item.angle)), float(np.sin(item.angle))
        half_x, half_z = abs(c) * width / 2 + abs(s) * depth / 2, abs(s) * width / 2 + abs(c) * depth / 2
        columns = [c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, x, up, z, 1]  # a matrix column by column
        found.append({
            "id": f"{number}_{len(found)}", "type": "Object", "valid": 1, "modelId": item.model,
            "transform": [round(value, 6) for value in columns], "isMirrored": 0, "state": 0, "materials": [],
            "bbox": {"min": [x - half_x, up, z - half_z], "max": [x + half_x, up + height, z + half_z]},
        })  # fmt: skip
    return found


def _around(nodes: list[dict[str, Any]]) -> dict[str, list[float]] | None:
    if not nodes:
        return None
    low, high = ([node["bbox"][end] for node in nodes] for end in ("min", "max"))
    return {"min": np.min(low, axis=0).tolist(), "max": np.max(high, axis=0).tolist()}
