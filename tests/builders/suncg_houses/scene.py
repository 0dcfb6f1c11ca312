"""Write a generated house into a SUNCG root folder: its house.json, its room meshes (OBJ), its furniture's models."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.homes.level import WALL_TOP_M, Meshed, prism_mesh
from tests.builders.suncg_houses.furniture import LEAF, LEAF_SIZE, MODELS
from tests.builders.suncg_houses.values import House, Opening, PlacedItem, Storey, Wall
from tests.builders.suncg_houses.walls import Hole, Slab, slab_holes, wall_slabs

_Indices: TypeAlias = npt.NDArray[np.int64]


def slab_mesh(slab: Slab, holes: list[Hole]) -> Meshed:
    """Return a closed mesh of a slab: a grid through the holes' edges, without the fields that are holes."""
    at = sorted({*slab.span, *(value for hole in holes for value in hole[:2])})
    up = sorted({0.0, WALL_TOP_M, *(value for hole in holes for value in hole[2:])})
    cut = frozenset(
        (i, j)
        for low, high, bottom, top in holes
        for i in range(at.index(low), at.index(high))
        for j in range(up.index(bottom), up.index(top))
    )
    line, level, side, faces = _grid(len(at) - 1, len(up) - 1, cut)
    along, height = np.array(at)[line], np.array(up)[level]
    points = np.empty((len(along), 3))
    points[:, :2] = slab.plan(along, np.array(slab.offset)[side])
    points[:, 2] = height
    return points, np.stack([along, height], axis=1), faces


@lru_cache(maxsize=4096)
def _grid(columns: int, rows: int, cut: frozenset[tuple[int, int]]) -> tuple[_Indices, _Indices, _Indices, _Indices]:
    """Return line, level and side of each node, and the faces of ``columns`` by ``rows`` fields less those cut.

    Sides are 0 (right) and 1 (left). Each field has a face on either side, and a reveal wherever it borders on a hole
    or on the end of the slab.
    """
    fields = {(i, j) for i in range(columns) for j in range(rows)} - cut
    quads = []
    for i, j in sorted(fields):
        right = [((i + a) * (rows + 1) + j + b) * 2 for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        quads += [right, [node + 1 for node in reversed(right)]]
        for k, neighbour in enumerate(((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j))):
            if neighbour not in fields:
                a, b = right[k], right[(k + 1) % 4]
                quads.append([b, a, a + 1, b + 1])
    quad = np.array(quads)
    line, level, side = np.indices((columns + 1, rows + 1, 2)).reshape(3, -1)
    return line, level, side, np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


_FLOOR_M = (0.0, 0.05)
_CEILING_M = (2.69, 2.74)
_MATERIAL = "newmtl plain\nKd 0.8 0.8 0.8\n"
_Part = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]
"""Name, points (x, y, height), texture, faces."""


def write_scene(root: Path, house: House) -> None:
    """Write house/<id>/, room/<id>/ and what is missing of object/ under a root folder."""
    rooms = root / "room" / house.id
    rooms.mkdir(parents=True, exist_ok=True)
    levels = []
    for index, storey in enumerate(house.storeys):
        foot = index * house.storey_height
        levels.append(_level(storey, index, foot))
        for room in range(len(storey.cells)):
            for suffix, parts in _room_parts(storey, index, room):
                _write_obj(rooms / f"{_model_id(index, room)}{suffix}.obj", parts, foot, material=suffix == "w")
    for model in sorted({item.model for storey in house.storeys for item in storey.items}):
        _write_model(root / "object" / model, model)
    boxes = [level["bbox"] for level in levels if level["bbox"] is not None]
    scene = {
        "version": "suncg@1.0.0",
        "id": house.id,
        "up": [0, 1, 0],
        "front": [0, 0, 1],
        "scaleToMeters": 1,
        "levels": levels,
        "bbox": _around([(box["min"], box["max"]) for box in boxes]) if boxes else None,
    }
    folder = root / "house" / house.id
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "house.json").write_text(json.dumps(scene, separators=(",", ":")))


def _model_id(level: int, room: int) -> str:
    return f"fr_{level}rm_{room}"


def _room_parts(storey: Storey, level: int, room: int) -> list[tuple[str, list[_Part]]]:
    """Return the meshes of a room's files by suffix."""
    walls = [wall for wall in storey.walls if wall.cell == room]
    openings = [opening for opening in storey.openings if room in opening.cells]
    files = [("w", _wall_parts(walls, openings, f"{level}_{room}"))]
    if storey.has_floor:
        polygon = storey.cells[room].polygon
        files.append(("f", [("Floor", *prism_mesh(polygon, *_FLOOR_M))]))
        files.append(("c", [("Ceiling", *prism_mesh(polygon, *_CEILING_M))]))
    return [(suffix, parts) for suffix, parts in files if parts]


def _wall_parts(walls: list[Wall], openings: list[Opening], name: str) -> list[_Part]:
    parts = []
    for number, wall in enumerate(walls):
        for slab in wall_slabs(wall):
            side = "Inside" if slab.inside else "Outside"
            parts.append((f"Wall{side}#{name}_{number}", *slab_mesh(slab, slab_holes(slab, openings))))
    return parts


def _write_obj(path: Path, parts: list[_Part], foot: float, material: bool = False) -> None:
    """Write parts as objects of an OBJ file: X, Y and Z are plan x, height and plan y, which mirrors, so faces turn."""
    text = [f"mtllib {path.stem}.mtl\n"] if material else []
    first = 1
    for name, points, texture, faces in parts:
        scene = points[:, [0, 2, 1]] + [0.0, foot, 0.0]
        corners = np.repeat(faces[:, ::-1] + first, 2, axis=1)
        text.append(f"o {name}\ng {name}\n")
        text.append("v %.6f %.6f %.6f\n" * len(scene) % tuple(scene.ravel().tolist()))
        text.append("vt %.4f %.4f\n" * len(texture) % tuple(texture.ravel().tolist()))
        if material:
            text.append("usemtl plain\n")
        text.append("f %d/%d %d/%d %d/%d\n" * len(corners) % tuple(corners.ravel().tolist()))
        first += len(scene)
    path.write_text("".join(text))
    if material:
        path.with_suffix(".mtl").write_text(_MATERIAL)


def _write_model(folder: Path, model: str) -> None:
    """Write a box that stands on its origin, as furniture does."""
    if folder.is_dir():
        return
    folder.mkdir(parents=True)
    width, height, depth = LEAF_SIZE if model == LEAF else MODELS[model]
    box = shapely.box(-width / 2, -depth / 2, width / 2, depth / 2)
    _write_obj(folder / f"{model}.obj", [(f"Model#{model}", *prism_mesh(box, 0.0, height))], 0.0)


def _level(storey: Storey, index: int, foot: float) -> dict[str, Any]:
    """Return a level of house.json: its rooms first, then the objects."""
    nodes: list[dict[str, Any]] = []
    for room, cell in enumerate(storey.cells):
        inside = [len(storey.cells) + k for k, item in enumerate(storey.items) if item.cell == room]
        x1, y1, x2, y2 = cell.polygon.bounds
        node = {
            "id": f"{index}_{room}",
            "type": "Room",
            "valid": 1,
            "modelId": _model_id(index, room),
            "roomTypes": list(cell.words),
            "nodeIndices": inside,
            "bbox": _box((x1 - 0.05, foot, y1 - 0.05), (x2 + 0.05, foot + WALL_TOP_M, y2 + 0.05)),
        }
        hidden = {} if storey.has_floor else {"hideFloor": 1, "hideCeiling": 1}
        nodes.append(node | hidden)
    for item in storey.items:
        nodes.append(_object(item, f"{index}_{len(nodes)}", foot))
    boxes = [(node["bbox"]["min"], node["bbox"]["max"]) for node in nodes]
    return {"id": str(index), "bbox": _around(boxes) if boxes else None, "nodes": nodes}


def _object(item: PlacedItem, node_id: str, foot: float) -> dict[str, Any]:
    """Return an Object node; ``transform`` lists a 4 x 4 matrix column by column."""
    width, height, depth = LEAF_SIZE if item.model == LEAF else MODELS[item.model]
    c, s = float(np.cos(item.angle)), float(np.sin(item.angle))
    (x, z), up = item.centre, foot + _FLOOR_M[1]
    half_x, half_z = abs(c) * width / 2 + abs(s) * depth / 2, abs(s) * width / 2 + abs(c) * depth / 2
    columns = [c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, x, up, z, 1]
    return {
        "id": node_id,
        "type": "Object",
        "valid": 1,
        "modelId": item.model,
        "transform": [round(value, 6) for value in columns],
        "isMirrored": 0,
        "state": 0,
        "materials": [],
        "bbox": _box((x - half_x, up, z - half_z), (x + half_x, up + height, z + half_z)),
    }


def _box(low: tuple[float, ...], high: tuple[float, ...]) -> dict[str, list[float]]:
    return {"min": [round(value, 6) for value in low], "max": [round(value, 6) for value in high]}


def _around(boxes: list[tuple[list[float], list[float]]]) -> dict[str, list[float]]:
    return _box(
        tuple(np.min([low for low, _ in boxes], axis=0).tolist()),
        tuple(np.max([high for _, high in boxes], axis=0).tolist()),
    )
