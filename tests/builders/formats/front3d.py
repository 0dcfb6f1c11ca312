"""A tiny 3D-FRONT scene: a bedroom of 3 x 4 m, a wall of 0.2 m, a living room of 5 x 4 m; walls as sheets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

Rectangle = tuple[float, float, float, float]
BEDROOM: Rectangle = (0.0, 0.0, 3.0, 4.0)
LIVING: Rectangle = (3.2, 0.0, 8.2, 4.0)
TOP = 2.8


def scene(*more: tuple[str, list[dict[str, Any]]], y: float = 0.0) -> dict[str, Any]:
    """Return the scene; ``more`` are further rooms with their meshes. (x1, z1, x2, z2) are in the file's axes."""
    rooms = [
        ("MasterBedroom", [*room("b", BEDROOM, y), box("d1", "Door", (3.0, 1.0, 3.1, 1.9), y, y + 2.1)]),
        ("LivingDiningRoom", [*room("l", LIVING, y), box("d2", "Door", (3.1, 1.0, 3.2, 1.9), y, y + 2.1)]),
        ("none", [box("front", "Door", (8.2, 2.0, 8.3, 3.0), y, y + 2.1)]),
        ("none", [box("w", "Window", (5.0, 4.0, 6.0, 4.1), y + 0.9, y + 2.0)]),
        *more,
    ]
    sofa = {"uid": "sofa/model", "size": [2.0, 0.8, 1.0], "category": "Sofa", "title": "sofa"}
    place = {"ref": "sofa/model", "pos": [6.0, y, 2.0], "rot": [0.0, 0.7071068, 0.0, 0.7071068], "scale": [1, 1, 1]}
    children = [[{"ref": mesh["uid"], "pos": [0, 0, 0]} for mesh in meshes] for _, meshes in rooms]
    children[1].append(place)
    return {
        "uid": "house",
        "design_version": "V5",
        "furniture": [sofa, {"uid": "lamp/model", "size": None}],
        "mesh": [mesh for _, meshes in rooms for mesh in meshes],
        "scene": {
            "room": [
                {"type": name, "instanceid": f"{name}-{k}", "children": children[k]}
                for k, (name, _) in enumerate(rooms)
            ]
        },
    }


def room(key: str, rectangle: Rectangle, y: float = 0.0) -> list[dict[str, Any]]:
    """Return a floor and the sheets of its walls."""
    x1, z1, x2, z2 = rectangle
    floor = mesh(f"{key}f", "Floor", [(x1, y, z1), (x1, y, z2), (x2, y, z2), (x2, y, z1)])
    ring = [(x1, z1), (x1, z2), (x2, z2), (x2, z1)]
    sheets = []
    for k in range(4):
        (ax, az), (bx, bz) = ring[k], ring[(k + 1) % 4]
        corners = [(ax, y, az), (bx, y, bz), (bx, y + TOP, bz), (ax, y + TOP, az)]
        sheets.append(mesh(f"{key}w{k}", "WallInner", corners))
    return [floor, *sheets]


def box(uid: str, kind: str, rectangle: Rectangle, low: float, high: float) -> dict[str, Any]:
    """Return the reveal of a hole: its two jambs."""
    x1, z1, x2, z2 = rectangle
    along_x = x2 - x1 > z2 - z1
    ends = [[(x1, z1), (x1, z2)], [(x2, z1), (x2, z2)]] if along_x else [[(x1, z1), (x2, z1)], [(x1, z2), (x2, z2)]]
    corners = [(x, y, z) for (ax, az), (bx, bz) in ends for x, y, z in
               [(ax, low, az), (bx, low, bz), (bx, high, bz), (ax, high, az)]]  # fmt: skip
    return mesh(uid, kind, corners)


def mesh(uid: str, kind: str, corners: list[tuple[float, float, float]]) -> dict[str, Any]:
    """Return rectangles, four corners each, as triangles."""
    faces = [k + j for k in range(0, len(corners), 4) for j in (0, 1, 2, 0, 2, 3)]
    return {"uid": uid, "type": kind, "xyz": [value for corner in corners for value in corner], "faces": faces}


def write(path: Path, value: Any) -> Path:
    """Write a scene."""
    path.write_text(json.dumps(value))
    return path
