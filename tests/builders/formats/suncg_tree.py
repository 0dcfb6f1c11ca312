"""A small SUNCG root written by hand, by no code of the project: plain slabs as text, awkward nodes on purpose."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

HOUSE = "0004d52d1aeeb8ae6de39d6bd993e992"
Node = dict[str, Any]


def slabs_obj(slabs: list[tuple[list[tuple[float, float]], float, float]], material: str | None = None) -> str:
    """Write closed slabs, each of four plan corners (X, Z), a foot and a top, as quads."""
    lines = [f"mtllib {material}"] if material else []
    for k, (corners, foot, top) in enumerate(slabs):
        lines.append(f"o WallInside#0_0_{k}")
        lines += [f"v {x} {y} {z}" for y in (foot, top) for x, z in corners]
        lines += ["vt 0 0", "vn 0 1 0"]
        sides = [(i, i + 4, (i + 1) % 4 + 4, (i + 1) % 4) for i in range(4)]
        for quad in [(0, 1, 2, 3), (7, 6, 5, 4), *sides]:
            lines.append("f " + " ".join(f"{8 * k + i + 1}/1/1" for i in quad))
    return "\n".join(lines) + "\n"


def rectangle(x1: float, z1: float, x2: float, z2: float) -> list[tuple[float, float]]:
    return [(x1, z1), (x2, z1), (x2, z2), (x1, z2)]


def walls_round(x1: float, z1: float, x2: float, z2: float, foot: float = 0.0) -> list[Any]:
    """Four walls, 0.1 m thick, round a room whose inner faces are given."""
    plans = [(x1 - 0.1, z1 - 0.1, x2 + 0.1, z1), (x1 - 0.1, z2, x2 + 0.1, z2 + 0.1), (x1 - 0.1, z1, x1, z2)]
    return [(rectangle(*plan), foot, foot + 2.73) for plan in [*plans, (x2, z1, x2 + 0.1, z2)]]


def room(model: str, words: list[str], bounds: tuple[float, ...] | None, **flags: Any) -> Node:
    node = {"id": "0_0", "type": "Room", "valid": 1, "modelId": model, "roomTypes": words, "nodeIndices": []}
    if bounds is not None:
        x1, y1, z1, x2, y2, z2 = bounds
        node["bbox"] = {"min": [x1, y1, z1], "max": [x2, y2, z2]}
    return node | flags


def bed(x: float, y: float, z: float) -> Node:
    """A bed of 2 by 1 m, turned by a quarter about y, so that it is 1 m long in X; the matrix column by column."""
    transform = [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, x, y, z, 1]
    return {"id": "0_0", "type": "Object", "valid": 1, "modelId": "42", "transform": transform, "isMirrored": 0}


def write_tree(root: Path, scale: float = 1.0) -> dict[str, Any]:
    """Write the tree; returns house.json, so that a test can spoil it and write it again."""
    rooms, model = root / "room" / HOUSE, root / "object" / "42"
    rooms.mkdir(parents=True)
    model.mkdir(parents=True)
    (model / "42.obj").write_text(slabs_obj([(rectangle(-1.0, -0.5, 1.0, 0.5), 0.0, 0.5)]))
    (rooms / "walls.mtl").write_text("newmtl white\n")
    skewed = [(14.0, 20.0), (18.0, 20.05), (18.0, 19.95), (14.0, 19.9)]
    straight = (rectangle(14.0, 19.9, 18.0, 20.0), 0.0, 2.73)
    walls = {
        "fr_0rm_0": slabs_obj(walls_round(10, 20, 14, 23), "walls.mtl"),
        "fr_0rm_1": slabs_obj([straight, (skewed, 0.0, 2.73)]),
        "fr_2rm_0": slabs_obj(walls_round(10, 20, 14, 23, foot=2.9)),
    }
    floors = {
        "fr_0rm_0": (rectangle(10, 20, 14, 23), 0.0, 0.05),
        "fr_0rm_1": (rectangle(14, 20, 18, 23), 0.0, 0.05),
        "fr_0rm_3": (rectangle(10, 23, 14, 25), 0.0, 0.05),
        "fr_0gd_4": (rectangle(0, 0, 50, 50), -0.2, -0.15),
        "fr_2rm_0": (rectangle(10, 20, 14, 23), 2.9, 2.95),
    }
    for name, text in walls.items():
        (rooms / f"{name}w.obj").write_text(text)
    for name, slab in floors.items():
        (rooms / f"{name}f.obj").write_text(slabs_obj([slab]))
    ground = [
        room("fr_0rm_0", ["Bedroom", "Office"], (9.9, 0, 19.9, 14.1, 2.73, 23.1)),
        room("fr_0rm_1", [], (14, 0, 20, 18, 2.73, 23)),
        room("fr_0rm_2", ["Kitchen"], None, valid=0, bbox={"min": None}),
        room("fr_0rm_3", ["living room", "Winter garden"], (10, 0, 23, 14, 2.73, 25), hideWalls=1),
        {
            "id": "0_4",
            "type": "Ground",
            "valid": 1,
            "modelId": "fr_0gd_4",
            "bbox": {"min": [0, 0, 0], "max": [9, 0, 9]},
        },
        {"id": "0_5", "type": "Box", "valid": 1, "dimensions": [1, 1, 1], "transform": [1, 0]},
        bed(12.0, 0.05, 21.0),
        {"id": "0_7", "type": "Object", "valid": 0, "modelId": "none"},
    ]
    house = {
        "version": "suncg@1.0.0",
        "id": HOUSE,
        "up": [0, 1, 0],
        "front": [0, 0, 1],
        "scaleToMeters": scale,
        "bbox": {"min": [0, 0, 0], "max": [50, 9, 50]},
        "levels": [
            {"id": "0", "bbox": {}, "nodes": ground},
            {"id": "1", "valid": 0, "nodes": [room("fr_1rm_0", ["Bedroom"], None)]},
            {"id": "2", "valid": 1, "nodes": [room("fr_2rm_0", ["Bathroom"], (9.9, 2.9, 19.9, 14.1, 5.6, 23.1))]},
            {"id": "3", "nodes": [bed(1.0, 6.0, 1.0), bed(4.0, 6.0, 1.0)]},
        ],
    }
    write_house(root, house)
    return house


def write_house(root: Path, house: dict[str, Any]) -> None:
    folder = root / "house" / HOUSE
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "house.json").write_text(json.dumps(house))
