"""Furniture of many shapes. Frame: x along the wall (0 is the middle), y into the room (0 is the wall's face), z up."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.random import Generator

from tests.builders.kinds.parts.solids3d import box, cylinder, joined

Maker = Callable[[Generator, float], list[trimesh.Trimesh]]


def legs(x1: float, y1: float, x2: float, y2: float, high: float, thick: float = 0.05) -> list[trimesh.Trimesh]:
    """Four legs under a rectangle."""
    return [box(x, y, 0.0, x + thick, y + thick, high) for x in (x1, x2 - thick) for y in (y1, y2 - thick)]


def bed(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A bed with headboard, mattress and pillows."""
    wide, long = float(rng.choice([0.9, 1.4, 1.6, 1.8])), float(rng.uniform(1.95, 2.15))
    half, base = wide / 2, float(rng.uniform(0.25, 0.35))
    on_floor = rng.random() < 0.5
    parts = [box(-half, 0.0, 0.0, half, 0.06, float(rng.uniform(0.8, 1.2)))]
    parts.append(box(-half, 0.06, 0.0 if on_floor else 0.15, half, long, base))
    parts.append(box(-half + 0.03, 0.08, base, half - 0.03, long - 0.03, base + 0.22))
    parts += [] if on_floor else legs(-half, 0.06, half, long, 0.15)
    for x in (0.0,) if wide < 1.2 else (-wide / 4, wide / 4):
        parts.append(box(x - 0.3, 0.12, base + 0.22, x + 0.3, 0.5, base + 0.32))
    return parts


def sofa(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A sofa of two or three seats, some with a chaise longue."""
    half, deep = float(rng.choice([0.8, 1.0, 1.15])), float(rng.uniform(0.8, 1.0))
    parts = [box(-half, 0.0, 0.1, half, deep, 0.42), box(-half, 0.0, 0.42, half, 0.22, 0.85)]
    parts += [box(s * half - 0.1, 0.0, 0.1, s * half + 0.1, deep, 0.62) for s in (-1, 1)]
    parts += legs(-half, 0.05, half, deep, 0.1)
    if rng.random() < 0.3:
        parts.append(box(half - 0.75, deep - 0.01, 0.1, half + 0.1, deep + 0.7, 0.42))
    return parts


def chair(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A chair with its back to the wall."""
    return [box(-0.22, 0.02, 0.43, 0.22, 0.46, 0.47), box(-0.22, 0.02, 0.47, 0.22, 0.06, 0.92),
            *legs(-0.22, 0.02, 0.22, 0.46, 0.43, 0.035)]  # fmt: skip


def dining_table(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A table with chairs on both sides, some round; it stands free."""
    if rng.random() < 0.3:
        radius = float(rng.uniform(0.45, 0.65))
        parts = [
            cylinder(0, 1.2, radius, 0.71, 0.75, 24),
            cylinder(0, 1.2, 0.05, 0.0, 0.71),
            cylinder(0, 1.2, 0.3, 0, 0.03),
        ]
        return parts + seats([(0.0, 1.2 - radius - 0.3), (0.0, 1.2 + radius + 0.3)])
    half = float(rng.uniform(0.6, 0.95))
    parts = [box(-half, 0.8, 0.71, half, 1.65, 0.75), *legs(-half, 0.8, half, 1.65, 0.71, 0.06)]
    return parts + seats([(s * half / 2, y) for s in (-1, 1) for y in (0.55, 1.9)])


def seats(places: list[tuple[float, float]]) -> list[trimesh.Trimesh]:
    """Stools at places."""
    made = []
    for x, y in places:
        made += [box(x - 0.2, y - 0.2, 0.43, x + 0.2, y + 0.2, 0.47)]
        made += [m.apply_translation((x, y, 0)) for m in legs(-0.2, -0.2, 0.2, 0.2, 0.43, 0.035)]
        back = y - 0.2 if y < 1.2 else y + 0.17
        made.append(box(x - 0.2, back, 0.47, x + 0.2, back + 0.03, 0.9))
    return made


def coffee_table(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A low table."""
    return [box(-0.5, 1.3, 0.38, 0.5, 1.85, 0.42), *legs(-0.5, 1.3, 0.5, 1.85, 0.38)]


def desk(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A desk with drawers, a screen and a chair."""
    half = float(rng.uniform(0.55, 0.8))
    parts = [box(-half, 0.02, 0.71, half, 0.7, 0.74), box(half - 0.4, 0.05, 0.0, half, 0.65, 0.71)]
    parts += [box(-half, 0.02, 0.0, -half + 0.04, 0.7, 0.71), box(-0.28, 0.2, 0.85, 0.28, 0.22, 1.2)]
    parts += [box(-0.1, 0.15, 0.74, 0.1, 0.3, 0.76), box(-0.02, 0.2, 0.74, 0.02, 0.23, 0.9)]
    parts += [
        cylinder(-0.1, 1.0, 0.25, 0.42, 0.5),
        cylinder(-0.1, 1.0, 0.03, 0.05, 0.42),
        cylinder(-0.1, 1.0, 0.28, 0, 0.05),
    ]
    return parts


def wardrobe(rng: Generator, ceiling: float) -> list[trimesh.Trimesh]:
    """A wardrobe with doors, lower than the ceiling."""
    half, high = float(rng.uniform(0.45, 1.2)), float(min(rng.uniform(1.85, 2.25), ceiling - 0.2))
    parts = [box(-half, 0.0, 0.0, half, 0.56, high)]
    count = max(2, round(2 * half / 0.5))
    ends = np.linspace(-half, half, count + 1)
    parts += [box(a + 0.003, 0.56, 0.06, b - 0.003, 0.58, high - 0.02) for a, b in itertools.pairwise(ends)]
    return parts + [box(b - 0.04, 0.58, 1.0, b - 0.02, 0.61, 1.2) for b in ends[1:]]


def shelf(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A bookcase with boards and books."""
    half, high = float(rng.uniform(0.35, 0.6)), float(rng.uniform(1.1, 2.0))
    parts = [box(s * half - 0.01, 0.0, 0.0, s * half + 0.01, 0.3, high) for s in (-1, 1)]
    parts += [box(-half, 0.0, z, half, 0.3, z + 0.02) for z in np.arange(0.05, high, 0.35)]
    parts += [box(-half + 0.05, 0.05, z + 0.02, half * 0.4, 0.25, z + 0.25) for z in np.arange(0.05, high - 0.3, 0.35)]
    return [*parts, box(-half, 0.0, 0.0, half, 0.01, high)]


def kitchen_row(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A counter with sink and hob, wall cabinets above it, a refrigerator at one end."""
    half = float(rng.uniform(0.9, 1.5))
    parts = [box(-half, 0.0, 0.1, half, 0.58, 0.86), box(-half, 0.0, 0.86, half, 0.62, 0.9)]
    parts += [box(-half, 0.05, 0.0, half, 0.5, 0.1), box(-half, 0.0, 1.4, half, 0.35, float(rng.uniform(2.0, 2.15)))]
    parts += [box(-half - 0.62, 0.02, 0.0, -half - 0.02, 0.64, float(rng.uniform(1.6, 1.95)))]
    return [*parts, cylinder(half / 2, 0.3, 0.1, 0.9, 0.91), box(-half / 2, 0.1, 0.9, -half / 2 + 0.03, 0.13, 1.2)]


def dresser(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A chest of drawers with a mirror or a television on the wall."""
    half = float(rng.uniform(0.4, 0.8))
    parts = [box(-half, 0.0, 0.08, half, 0.42, float(rng.uniform(0.5, 0.9))), *legs(-half, 0, half, 0.42, 0.08)]
    return [*parts, box(-half * 0.8, 0.0, 1.1, half * 0.8, 0.05, 1.8)]


def television(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A television on a low board."""
    return [
        box(-0.8, 0.0, 0.1, 0.8, 0.4, 0.45),
        box(-0.6, 0.15, 0.55, 0.6, 0.2, 1.25),
        box(-0.2, 0.1, 0.45, 0.2, 0.3, 0.56),
    ]


def bathtub(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A bath, open at the top."""
    sides = [box(-0.8, y, 0.0, 0.8, y + 0.08, 0.55) for y in (0.0, 0.62)]
    ends = [box(x, 0.08, 0.0, x + 0.08, 0.62, 0.55) for x in (-0.8, 0.72)]
    return [*sides, *ends, box(-0.72, 0.08, 0.0, 0.72, 0.62, 0.12)]


def toilet(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A toilet with its cistern."""
    return [
        box(-0.2, 0.0, 0.4, 0.2, 0.18, 0.8),
        cylinder(0, 0.4, 0.19, 0.0, 0.4, 16),
        box(-0.12, 0.1, 0.0, 0.12, 0.4, 0.35),
    ]


def basin(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A wash basin with a mirror."""
    return [
        box(-0.3, 0.0, 0.72, 0.3, 0.45, 0.86),
        cylinder(0, 0.2, 0.07, 0.0, 0.72),
        box(-0.3, 0.0, 1.2, 0.3, 0.03, 1.8),
    ]


def shower(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A shower tray with a glass screen."""
    return [box(-0.45, 0.0, 0.0, 0.45, 0.85, 0.06), box(0.44, 0.0, 0.06, 0.45, 0.85, 1.95)]


def plant(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A plant in a pot."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=float(rng.uniform(0.2, 0.4)))
    ball.apply_translation((0, 0.35, float(rng.uniform(0.8, 1.3))))
    return [cylinder(0, 0.35, 0.16, 0.0, 0.35), cylinder(0, 0.35, 0.02, 0.35, 0.9, 6), ball]


def rug(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A rug in the middle."""
    return [box(-0.9, 0.9, 0.0, 0.9, 2.2, 0.012)]


def floor_lamp(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A lamp on a stand."""
    return [cylinder(0, 0.3, 0.15, 0, 0.03), cylinder(0, 0.3, 0.015, 0.03, 1.5, 6), cylinder(0, 0.3, 0.2, 1.4, 1.7)]


def hanging_lamp(rng: Generator, ceiling: float) -> list[trimesh.Trimesh]:
    """A lamp on a cord."""
    low = ceiling - float(rng.uniform(0.4, 0.9))
    return [cylinder(0, 0, 0.008, low, ceiling, 5), cylinder(0, 0, 0.2, low - 0.2, low, 12)]


def shelf_high(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A board and a picture on the wall."""
    return [box(-0.4, 0.0, 1.5, 0.4, 0.22, 1.53), box(-0.3, 0.0, 1.7, 0.3, 0.03, 2.0)]


def car(rng: Generator, _: float) -> list[trimesh.Trimesh]:
    """A car: body, cabin, wheels."""
    parts = [box(-0.88, 0.4, 0.3, 0.88, 4.4, 0.85), box(-0.75, 1.2, 0.85, 0.75, 3.5, 1.4)]
    return parts + [box(s * 0.8 - 0.1, y, 0.0, s * 0.8 + 0.1, y + 0.6, 0.6) for s in (-1, 1) for y in (0.9, 3.3)]


@dataclass(frozen=True)
class Sort:
    """A sort of furniture: its maker, and whether it stands at a wall, in the middle, or hangs."""

    make: Maker
    place: str = "wall"


SORTS = {
    "bed": Sort(bed), "sofa": Sort(sofa), "chair": Sort(chair), "dining_table": Sort(dining_table, "free"),
    "coffee_table": Sort(coffee_table, "free"), "desk": Sort(desk), "wardrobe": Sort(wardrobe),
    "shelf": Sort(shelf), "kitchen": Sort(kitchen_row), "dresser": Sort(dresser), "tv": Sort(television),
    "bathtub": Sort(bathtub), "toilet": Sort(toilet), "basin": Sort(basin), "shower": Sort(shower),
    "plant": Sort(plant), "rug": Sort(rug, "free"), "floor_lamp": Sort(floor_lamp),
    "lamp": Sort(hanging_lamp, "hang"), "wall_shelf": Sort(shelf_high), "car": Sort(car),
}  # fmt: skip


def thing(sort: str, rng: Generator, ceiling: float) -> trimesh.Trimesh:
    """One piece."""
    return joined(SORTS[sort].make(rng, ceiling))
