"""A tiny RoomPlan home: a bedroom of 3 x 4 m, a wall of 0.12 m, a kitchen of 5 x 4 m; surfaces at the rooms' sides."""

from __future__ import annotations

import json
import math
import zipfile
from pathlib import Path
from typing import Any

Rectangle = tuple[float, float, float, float]
Pair = tuple[float, float]
ROOMS: dict[str, Rectangle] = {"bedroom": (0.0, 0.0, 3.0, 4.0), "kitchen": (3.12, 0.0, 8.12, 4.0)}
HEIGHT = 2.5
FLOOR = -1.2


def surface(
    word: str, a: tuple[float, float], b: tuple[float, float], low: float = 0.0, high: float = HEIGHT
) -> dict[str, Any]:
    """Return an upright surface from a to b, (x, z) in the file's axes."""
    length, angle = math.dist(a, b), math.atan2(-(b[1] - a[1]), b[0] - a[0])
    middle = ((a[0] + b[0]) / 2, FLOOR + (low + high) / 2, (a[1] + b[1]) / 2)
    category: Any = {word: {"isOpen": False} if word == "door" else {}}
    return {"category": category, "dimensions": [length, high - low, 0], "transform": turned(angle, middle)}


def turned(angle: float, at: tuple[float, float, float]) -> list[float]:
    """Return a turn about the upright axis and a shift, column by column."""
    c, s = math.cos(angle), math.sin(angle)
    return [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, *at, 1]


def floor(rectangle: Rectangle) -> dict[str, Any]:
    """Return a floor with its corners in a frame whose z is upright."""
    x1, z1, x2, z2 = rectangle
    corners = [[x1, -z1, 0], [x2, -z1, 0], [x2, -z2, 0], [x1, -z2, 0]]
    flat = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, FLOOR, 0, 1]
    return {
        "category": {"floor": {}},
        "dimensions": [x2 - x1, z2 - z1, 0],
        "transform": flat,
        "polygonCorners": corners,
    }


def room(name: str, rectangle: Rectangle, floors: bool = True, **more: list[Any]) -> dict[str, Any]:
    """Return a captured room."""
    x1, z1, x2, z2 = rectangle
    ring = [(x1, z1), (x2, z1), (x2, z2), (x1, z2)]
    section = {"label": name, "center": [(x1 + x2) / 2, FLOOR, (z1 + z2) / 2], "story": 0}
    return {
        "walls": [surface("wall", ring[k], ring[(k + 1) % 4]) for k in range(4)],
        "floors": [floor(rectangle)] if floors else [],
        "sections": [section],
        "windows": [surface("window", (x1 + 1, z2), (x1 + 2, z2), 0.9, 2.0)],
        **more,
    }


def home(floors: bool = True) -> dict[str, Any]:
    """Return a captured structure: a door between the rooms that both have, an opening to the outside."""
    between = surface("door", (3.0, 1.0), (3.0, 1.9), 0.0, 2.1), surface("door", (3.12, 1.9), (3.12, 1.0), 0.0, 2.1)
    front = surface("opening", (8.12, 2.0), (8.12, 3.2), 0.0, 2.2)
    bed = {
        "category": {"bed": {}},
        "dimensions": [1.6, 0.5, 2.0],
        "transform": turned(math.pi / 2, (1.0, FLOOR + 0.25, 1.0)),
    }
    first, second = ROOMS.items()
    rooms = [
        room(*first, floors, doors=[between[0]], objects=[bed]),
        room(*second, floors, doors=[between[1]], openings=[front]),
    ]
    return {"version": 2, "rooms": rooms, "walls": [wall for each in rooms for wall in each["walls"]]}


def whole(divided: bool = True) -> dict[str, Any]:
    """Return one captured room: a floor of 8 x 4 m, a wall through it with a door, and two sections."""
    found = room("livingRoom", (0.0, 0.0, 8.0, 4.0))
    if divided:
        found["walls"].append(surface("wall", (3.0, 0.0), (3.0, 4.0)))
        found["doors"] = [surface("door", (3.0, 1.0), (3.0, 1.9), 0.0, 2.1)]
    centers = {"bedroom": 1.5, "livingRoom": 5.5}
    found["sections"] = [{"label": label, "center": [x, FLOOR, 2.0]} for label, x in centers.items()]
    return found


def write(path: Path, value: Any) -> Path:
    """Write a scan as JSON."""
    path.write_text(json.dumps(value))
    return path


def usda(value: dict[str, Any], extra: str = "", parametric: bool = False) -> str:
    """Return the walls, doors, openings and objects of a structure as a USD scene in text; ``parametric``: as cubes."""
    prims: list[str] = []
    write_box = _cube if parametric else _mesh
    for each in value["rooms"]:
        for kind in ("walls", "doors", "openings", "windows", "objects"):
            for item in each.get(kind, []):
                name = f"{next(iter(item['category'])).capitalize()}{len(prims)}"
                prims.append(write_box(name, item["dimensions"], item["transform"]))
        for item in each["floors"]:
            prims.append(_mesh(f"Floor{len(prims)}", [], item["transform"], item["polygonCorners"]))
    if parametric:
        sections = [section for each in value["rooms"] for section in each["sections"]]
        prims.append(f'    def Xform "Section_grp"\n    {{\n{"".join(map(_section, sections))}    }}\n')
    header = '#usda 1.0\n(\n    defaultPrim = "Room"\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n'
    return f'{header}def Xform "Room" {extra}\n{{\n{"".join(prims)}}}\n'


def _mesh(name: str, size: list[float], matrix: list[float], corners: list[list[float]] | None = None) -> str:
    points = corners or [[x * size[0], y * size[1], z * size[2]] for z in (-0.5, 0.5) for x, y in
                         ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]  # fmt: skip
    rows = [matrix[k : k + 4] for k in range(0, 16, 4)]
    faces = [list(range(k, k + 4)) for k in range(0, len(points), 4)]
    return (
        f'    def Mesh "{name}"\n    {{\n'
        f"        matrix4d xformOp:transform = ({', '.join(str(tuple(row)) for row in rows)})\n"
        '        uniform token[] xformOpOrder = ["xformOp:transform"]\n'
        f"        point3f[] points = [{', '.join(str(tuple(point)) for point in points)}]\n"
        f"        int[] faceVertexCounts = {[4] * len(faces)}\n"
        f"        int[] faceVertexIndices = {[k for face in faces for k in face]}\n    }}\n"
    )


def _cube(name: str, size: list[float], matrix: list[float]) -> str:
    rows = [matrix[k : k + 4] for k in range(0, 16, 4)]
    return (
        f'    def Cube "{name}"\n    {{\n'
        "        double size = 1\n"
        f"        double3 xformOp:scale = {tuple(each or 0.0001 for each in size)}\n"
        f"        matrix4d xformOp:transform = ({', '.join(str(tuple(row)) for row in rows)})\n"
        '        uniform token[] xformOpOrder = ["xformOp:transform", "xformOp:scale"]\n    }\n'
    )


def _section(section: dict[str, Any]) -> str:
    return (
        f'    def Xform "{section["label"]}0"\n    {{\n'
        f"        double3 xformOp:translate = {tuple(section['center'])}\n"
        '        uniform token[] xformOpOrder = ["xformOp:translate"]\n    }\n'
    )


def pack(path: Path, layers: dict[str, str | bytes]) -> Path:
    """Write a USDZ: a zip whose members are stored."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, content in layers.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return path


def bodies_usda(
    rectangle: Rectangle,
    holes: list[tuple[int, float, float, float, float]],
    glazed: int | None = None,
    thick: float = 0.16,
) -> str:
    """Return a room as phones write it: walls are bodies outside of the surface, and the floor goes on under them.

    ``holes`` are (wall, start, end, low, high); the one of index ``glazed`` holds a window.
    """
    x1, z1, x2, z2 = rectangle
    ring = [(x1, z1), (x2, z1), (x2, z2), (x1, z2)]
    prims: list[str] = []
    for k in range(4):
        (ax, az), (bx, bz) = ring[k], ring[(k + 1) % 4]
        length = math.dist((ax, az), (bx, bz))
        ux, uz = (bx - ax) / length, (bz - az) / length

        def at(u: float, out: float, y: float, a: Pair = (ax, az), d: Pair = (ux, uz)) -> tuple[float, float, float]:
            return (a[0] + u * d[0] + out * d[1], FLOOR + y, a[1] + u * d[1] - out * d[0])

        own = sorted(hole[1:] for hole in holes if hole[0] == k)
        quads: list[Rectangle] = []
        last = 0.0
        for start, end, low, high in [*own, (length, length, 0.0, HEIGHT)]:
            quads += [(last, start, 0.0, HEIGHT), (start, end, 0.0, low), (start, end, high, HEIGHT)]
            last = end
        points = [
            at(u, out, y)
            for out in (0.0, thick)
            for a, b, low, high in quads
            if b - a > 0 and high - low > 0
            for u, y in ((a, low), (b, low), (b, high), (a, high))
        ]
        prims.append(_quads(f"Wall{k}", points))
        for number, (wall, start, end, low, high) in enumerate(holes):
            if wall == k and number == glazed:
                corners = ((start, low), (end, low), (end, high), (start, high))
                prims.append(_quads("Window0", [at(u, out, y) for out in (0.04, 0.12) for u, y in corners]))
    slab = [(x1 - thick, z1 - thick), (x2 + thick, z1 - thick), (x2 + thick, z2 + thick), (x1 - thick, z2 + thick)]
    prims.append(_quads("Floor0", [(x, FLOOR - 0.08, z) for x, z in slab]))
    header = '#usda 1.0\n(\n    defaultPrim = "Room"\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n'
    return f'{header}def Xform "Room"\n{{\n{"".join(prims)}}}\n'


def _quads(name: str, points: list[tuple[float, float, float]]) -> str:
    count = len(points) // 4
    return (
        f'    def Mesh "{name}"\n    {{\n'
        f"        point3f[] points = [{', '.join(str(point) for point in points)}]\n"
        f"        int[] faceVertexCounts = {[4] * count}\n"
        f"        int[] faceVertexIndices = {list(range(4 * count))}\n    }}\n"
    )
