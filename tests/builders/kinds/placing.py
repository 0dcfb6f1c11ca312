"""Where a house stands in its file: turned, moved, on another axis, in another unit; and the truth in that place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.random import Generator

from tests.builders.kinds.values import LEADS_IN, Storey

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


@dataclass(frozen=True)
class Placing:
    """From the house's frame to the file's: a turn about the upright axis, a shift, the up axis, the unit's length.

    ``unit_m`` is what one unit of the file stands for in the real house (0.01 for centimetres, 20 for 1:20 in metres).
    """

    turn_rad: float = 0.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: Literal["y", "z"] = "z"
    unit_m: float = 1.0

    def in_file(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the house in the file's axes and unit."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        x, y, z = (np.asarray(points, float) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + self.shift).T
        return np.column_stack([x, z, -y] if self.up == "y" else [x, y, z]) / self.unit_m

    def on_plan(self, points: Sequence[Sequence[float]] | np.ndarray) -> np.ndarray:
        """Plan points (n, 2) of the house on the source's plan axes: (X, Y), or (X, Z) where Y is up; metres."""
        flat = np.column_stack([np.asarray(points, float), np.zeros(len(points))])
        placed = self.in_file(flat) * self.unit_m
        return placed[:, [0, 2]] if self.up == "y" else placed[:, :2]

    def mesh_in_file(self, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
        """A mesh in the file's axes and unit."""
        return trimesh.Trimesh(self.in_file(mesh.vertices), mesh.faces, process=False)


def random_placing(
    rng: Generator,
    up: Literal["y", "z"],
    units: Sequence[str] = ("m",),
    turned: float = 0.35,
    far: float = 0.1,
    scale: float = 1.0,
) -> Placing:
    """Most houses stand along the axes, some turned by quarters, some by any angle; few stand far from the origin.

    ``scale`` is what a unit of a model stands for (20 m at 1:20).
    """
    pick = rng.random()
    turn = rng.uniform(0, 2 * math.pi) if pick < turned else math.pi / 2 * int(rng.integers(4))
    reach = 400.0 if rng.random() < far else 12.0
    lift = 0.0 if rng.random() < 0.6 else float(rng.uniform(-1.5, 3.0))
    shift = (*(float(v) for v in rng.uniform(-reach, reach, 2)), lift)
    return Placing(float(turn), shift, up, scale * UNITS[str(rng.choice(list(units)))])


def truth_of(storey: Storey, placing: Placing, row: str, name: str, floor_z: float = 0.0) -> dict[str, Any]:
    """What a storey holds, in the form of ``data/cases``; ``floor_z`` is the floor's height in the house's frame."""
    kept = [k for k, cell in enumerate(storey.cells) if cell.floor and storey.rooms[k].area > 0.2]
    number = {cell: n for n, cell in enumerate(kept)}
    rooms = []
    for k in kept:
        polygon = storey.rooms[k]
        rings = [rounded(placing.on_plan(np.asarray(r.coords)[:-1])) for r in (polygon.exterior, *polygon.interiors)]
        rooms.append({"label": storey.cells[k].label, "polygon": rings[0], "holes": rings[1:]})
    doors = [door_of(storey, k, placing) for k, o in enumerate(storey.openings) if o.kind != "window"]
    zones = [[number[c] for c in zone if c in number] for zone in storey.zones]
    return {
        "id": name,
        "kind": row,
        "floor_z": round(floor_z + placing.shift[2], 4),
        "rooms": rooms,
        "doors": doors,
        "zones": [z for z in zones if z],
    }


def door_of(storey: Storey, index: int, placing: Placing) -> dict[str, Any]:
    """An opening as a case has it."""
    opening = storey.openings[index]
    wall = storey.walls[opening.wall]
    start, centre, end = placing.on_plan([wall.at(s) for s in (opening.start, opening.centre, opening.end)])
    direction = (end - start) / np.hypot(*(end - start))
    return {
        "centre": [round(float(v), 4) for v in centre],
        "width": round(opening.width, 4),
        "thickness": round(max(wall.thickness, 0.02), 4),
        "direction": [round(float(v), 6) for v in direction],
        "interior": opening.kind in LEADS_IN,
    }


def rounded(ring: np.ndarray) -> list[list[float]]:
    """A ring to a tenth of a millimetre."""
    return [[round(float(x), 4), round(float(y), 4)] for x, y in ring]
