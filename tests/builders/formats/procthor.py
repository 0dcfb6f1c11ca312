"""A tiny ProcTHOR house: a bedroom of 3 x 4 m, a kitchen of 5 x 4 m beside it, a door between, one to the outside."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

HEIGHT = 2.6


def house(dx: float = 0.0) -> dict[str, Any]:
    """Return the house, shifted along X."""
    rooms = {"2": ("Bedroom", (0.0, 0.0, 3.0, 4.0)), "3": ("Kitchen", (3.0, 0.0, 8.0, 4.0))}
    walls = []
    for key, (_, (x1, z1, x2, z2)) in rooms.items():
        ring = [(x1 + dx, z1), (x1 + dx, z2), (x2 + dx, z2), (x2 + dx, z1)]
        walls += [wall(f"wall|{key}|{k}", ring[k], ring[(k + 1) % 4]) for k in range(4)]
    walls.append(wall("wall|exterior|0", (0.0 + dx, 0.0), (0.0 + dx, 4.0)))
    return {
        "doors": [door("door|2|3", "wall|2|2", "wall|3|0", 1.0, 1.9), door("door|1|2", "wall|2|0", "", 2.0, 3.0)],
        "metadata": {"schema": "1.0.0"},
        "objects": [{"assetId": "Bed_1", "id": "Bed|2|0", "position": {"x": 1.0, "y": 0.3, "z": 1.0}}],
        "rooms": [
            {
                "id": f"room|{key}",
                "roomType": name,
                "floorPolygon": [point(x + dx, 0.0, z) for x, z in [(x1, z1), (x1, z2), (x2, z2), (x2, z1)]],
            }
            for key, (name, (x1, z1, x2, z2)) in rooms.items()
        ],
        "walls": walls,
        "windows": [door("window|3", "wall|3|2", "", 1.0, 2.0, low=0.9)],
    }


def point(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    """Return a point as Unity writes it."""
    return {"x": x, "y": y, "z": z}


def wall(name: str, a: tuple[float, float], b: tuple[float, float], **values: Any) -> dict[str, Any]:
    """Return an upright rectangle from a to b."""
    foot = [point(a[0], 0.0, a[1]), point(b[0], 0.0, b[1])]
    return {"id": name, "polygon": [*foot, *({**corner, "y": HEIGHT} for corner in foot)], **values}


def door(name: str, wall0: str, wall1: str, start: float, end: float, low: float = 0.0) -> dict[str, Any]:
    """Return a hole from ``start`` to ``end`` along ``wall0``."""
    hole = [point(start, low), point(end, 2.1)]
    return {"id": name, "wall0": wall0, "wall1": wall1, "holePolygon": hole, "assetId": "Doorway_1"}


def write(path: Path, value: Any) -> Path:
    """Write one house as JSON, or a list of them one a line; ``.gz`` is packed."""
    houses = value if isinstance(value, list) else [value]
    data = b"".join(json.dumps(each).encode() + b"\n" for each in houses)
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    return path
