"""Kinds in the formats of docs/sources.md: the same random homes, written as each source writes them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.random import Generator

from tests.builders.formats import front3d, gazebo, procthor, roomplan, sweethome
from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.placing import Placing, truth_of
from tests.builders.kinds.values import Member, Storey

THIN = Style(outer_m=(0.1, 0.1), inner_m=(0.1, 0.1), windows=0.5)


def make_procthor(rng: Generator, folder: Path, name: str) -> Member:
    """Write a ProcTHOR house: no wall has a thickness."""
    thick = random_home(rng, THIN)
    storey = replace(thick, walls=tuple(replace(wall, thickness=0.0) for wall in thick.walls))
    walls, slots = [], []
    for k, wall in enumerate(storey.walls):
        walls += [
            procthor.wall(f"wall|{k}|{side}", *ends) for side, ends in enumerate([(wall.a, wall.b), (wall.b, wall.a)])
        ]
    for k, hole in enumerate(storey.openings):
        slot = procthor.door(f"hole|{k}", f"wall|{hole.wall}|0", f"wall|{hole.wall}|1", hole.start, hole.end, hole.sill)
        slot["holePolygon"][1]["y"] = hole.head
        slots.append(slot | {"assetId": "Doorframe_1" if hole.kind == "opening" else "Doorway_1"})
    rooms = [
        {
            "id": f"room|{k}",
            "roomType": cell.label,
            "floorPolygon": [procthor.point(x, 0.0, y) for x, y in _ring(cell.polygon)],
        }
        for k, cell in enumerate(storey.cells)
    ]
    doors = [slot for slot, hole in zip(slots, storey.openings, strict=True) if hole.kind != "window"]
    windows = [slot for slot, hole in zip(slots, storey.openings, strict=True) if hole.kind == "window"]
    house = {"doors": doors, "walls": walls, "windows": windows, "rooms": rooms, "objects": []}
    path = procthor.write(folder / f"{name}.json", house)
    return _member(path, storey, Placing(), name)


def make_front3d(rng: Generator, folder: Path, name: str) -> Member:
    """Write a 3D-FRONT scene: floors, sheets on the rooms' sides, the reveals of the holes."""
    storey = random_home(rng)
    meshes: dict[str, list[dict[str, Any]]] = {}
    for k, (cell, room) in enumerate(zip(storey.cells, storey.rooms, strict=True)):
        floor = shapely.get_coordinates(shapely.get_parts(shapely.constrained_delaunay_triangles(room)))
        corners = [(x, 0.0, -y) for x, y in floor]
        triangles = [corners[j : j + 3] for j in range(0, len(corners), 4)]
        flat = [value for triangle in triangles for corner in triangle for value in corner]
        faces = list(range(3 * len(triangles)))
        own = [{"uid": f"{k}f", "type": "Floor", "xyz": flat, "faces": faces}]
        for j, (a, b) in enumerate(_sides(storey, room)):
            sheet = [(a[0], 0.0, -a[1]), (b[0], 0.0, -b[1]), (b[0], storey.height, -b[1]), (a[0], storey.height, -a[1])]
            own.append(front3d.mesh(f"{k}w{j}", "WallInner", sheet))
        meshes[f"{cell.label}-{k}"] = own
    kinds = {"window": "Window", "opening": "Hole"}
    for k, hole in enumerate(storey.openings):
        p = _ring(storey.gap(hole))
        jambs = [(p[i], p[j]) for i, j in ((0, 3), (1, 2))]
        corners = [
            (x, z, -y)
            for a, b in jambs
            for (x, y), z in ((a, hole.sill), (b, hole.sill), (b, hole.head), (a, hole.head))
        ]
        meshes[f"none-{k}"] = [front3d.mesh(f"o{k}", kinds.get(hole.kind, "Door"), corners)]
    rooms = [
        {"type": key.split("-")[0], "instanceid": key, "children": [{"ref": mesh["uid"]} for mesh in own]}
        for key, own in meshes.items()
    ]
    scene = {"mesh": [mesh for own in meshes.values() for mesh in own], "scene": {"room": rooms}, "furniture": []}
    return _member(front3d.write(folder / f"{name}.json", scene), storey, Placing(up="y"), name)


def make_sdf(rng: Generator, folder: Path, name: str) -> Member:
    """Write a Gazebo world: each wall a link of boxes."""
    storey, links = random_home(rng), []
    for k, wall in enumerate(storey.walls):
        start, end = -storey.reach(k, wall.a), wall.length + storey.reach(k, wall.b)
        pieces, at = [], start
        for hole in storey.on(k):
            pieces += [(at, hole.start, 0.0, storey.height), (hole.start, hole.end, 0.0, hole.sill)]
            pieces.append((hole.start, hole.end, hole.head, storey.height))
            at = hole.end
        pieces.append((at, end, 0.0, storey.height))
        boxes = [
            gazebo.box(f"v{j}", (b - a, wall.thickness, high - low), f"{(a + b) / 2} 0 {(low + high) / 2} 0 0 0")
            for j, (a, b, low, high) in enumerate(pieces)
            if b - a > 1e-6 and high - low > 1e-6
        ]
        pose = f"{wall.a[0]} {wall.a[1]} 0 0 0 {np.arctan2(wall.along[1], wall.along[0])}"
        links.append(f"<link name='Wall_{k}'><pose>{pose}</pose>{''.join(boxes)}</link>")
    path = folder / f"{name}.world"
    path.write_text(gazebo.world(f"<model name='home'><static>1</static>{''.join(links)}</model>"))
    return _member(path, storey, Placing(), name, "raw_sdf", named=False)


def make_sh3d(rng: Generator, folder: Path, name: str) -> Member:
    """Write a Sweet Home 3D home."""
    storey, content = random_home(rng), []
    for k, wall in enumerate(storey.walls):
        a, b = wall.at(-storey.reach(k, wall.a)) * 100, wall.at(wall.length + storey.reach(k, wall.b)) * 100
        ends = f"xStart='{a[0]}' yStart='{-a[1]}' xEnd='{b[0]}' yEnd='{-b[1]}'"
        content.append(f"<wall id='{k}' {ends} height='{storey.height * 100}' thickness='{wall.thickness * 100}'/>")
    for cell, room in zip(storey.cells, storey.rooms, strict=True):
        points = "".join(f"<point x='{100 * x}' y='{-100 * y}'/>" for x, y in _ring(room))
        content.append(f"<room name='{cell.label}'>{points}</room>")
    for hole in storey.openings:
        wall = storey.walls[hole.wall]
        x, y = wall.at(hole.centre) * 100
        size = f"width='{hole.width * 100}' depth='{wall.thickness * 100}' height='{(hole.head - hole.sill) * 100}'"
        place = f"x='{x}' y='{-y}' elevation='{hole.sill * 100}' angle='{-np.arctan2(wall.along[1], wall.along[0])}'"
        sash, kind = ("", "doorFrame") if hole.kind == "opening" else ("<sash/>", "door")
        content.append(f"<doorOrWindow catalogId='{kind}' {place} {size}>{sash}</doorOrWindow>")
    home = f"<home wallHeight='{storey.height * 100}'>{''.join(content)}</home>"
    return _member(sweethome.write(folder / f"{name}.sh3d", home), storey, Placing(up="y"), name)


def make_roomplan(rng: Generator, folder: Path, name: str) -> Member:
    """Write a RoomPlan structure: each room for itself."""
    storey, rooms = random_home(rng, Style(merged=False)), []
    for k, (cell, room) in enumerate(zip(storey.cells, storey.rooms, strict=True)):
        middle = room.representative_point()
        found: dict[str, list[Any]] = {
            "walls": [_surface("wall", a, b, 0.0, storey.height) for a, b in _sides(storey, room)],
            "sections": [{"label": cell.label, "center": [middle.x, roomplan.FLOOR, -middle.y]}],
            "floors": [_floor(room)],
        }
        for hole in storey.openings:
            wall = storey.walls[hole.wall]
            if k in wall.sides:
                side = wall.thickness / 2 * (1 if wall.sides[0] == k else -1)
                ends = wall.at(hole.start, side), wall.at(hole.end, side)
                word = {"window": "window", "opening": "opening"}.get(hole.kind, "door")
                found.setdefault(f"{word}s", []).append(_surface(word, *ends, hole.sill, hole.head))
        rooms.append(found)
    path = roomplan.write(folder / f"{name}.json", {"rooms": rooms, "walls": [], "version": 2})
    return _member(path, storey, Placing(shift=(0.0, 0.0, roomplan.FLOOR), up="y"), name)


def _floor(room: shapely.Polygon) -> dict[str, Any]:
    flat = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, roomplan.FLOOR, 0, 1]
    corners = [[x, y, 0.0] for x, y in _ring(room)]
    return {"category": {"floor": {}}, "dimensions": [1.0, 1.0, 0.0], "transform": flat, "polygonCorners": corners}


def _surface(word: str, a: Any, b: Any, low: float, high: float) -> dict[str, Any]:
    return roomplan.surface(word, (float(a[0]), -float(a[1])), (float(b[0]), -float(b[1])), low, high)


def _sides(storey: Storey, room: shapely.Polygon) -> list[tuple[np.ndarray, np.ndarray]]:
    """The edges of a room along which a wall stands."""
    ring = np.array([*_ring(room), _ring(room)[0]])
    walls = storey.wall_area.buffer(0.02)
    return [(a, b) for a, b in pairwise(ring) if walls.contains(shapely.Point((a + b) / 2))]


def _ring(shape: shapely.Polygon) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in shape.exterior.coords[:-1]]


def _member(path: Path, storey: Storey, placing: Placing, name: str, row: str = "raw", named: bool = True) -> Member:
    """A house whose source names its rooms one by one, or (``named`` False) does not."""
    truth = truth_of(storey, placing, row, name)
    if named:
        truth["zones"] = [[k] for k in range(len(truth["rooms"]))]
    return Member(path, (truth,), f"{len(storey.cells)} cells", placing.up, 1.0)
