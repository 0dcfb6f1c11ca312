"""Robots' maps with known rooms that PseudoSLAM makes of the kit's offices and homes, and of published plans.

R1  The storeys are those of the kit (``kinds``): offices, whose corridor is one room round all its bends, and homes.
    Cells between which no wall stands are one room. A door's cells belong to no room.
R2  A published plan says its rooms as boxes. It serves where its boxes overlap by no more than a wall, and where they
    cover it.
R3  The robot looks around from places that it can reach, with the errors of a real one: ranges, registration and lost
    beams. What it saw free more often than taken is free. No room is asked for where it has seen nothing.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from houseexpo.pseudoslam import LaserConfig, NoiseConfig, Simulator, SimulatorConfig, map_house
from tests.builders.kinds.homes import random_home
from tests.builders.kinds.office import random_office
from tests.builders.kinds.values import LEADS_IN, Storey
from tests.builders.robot_maps import CELL_M, TrueMap, furnished

MARGIN_M = 0.5
OVERLAP_M = 0.35
COVERED = 0.97
FEWEST_ROOMS = 4
TOUCH_M = 0.01
PLACE_M2 = (3.0, 6.0, 12.0)
"""R3: the robot looks around from one place in so many square metres."""


def office_map(seed: int) -> TrueMap:
    """Return an office of the kit, as a perfect map."""
    return _map_of_storey(random_office(np.random.default_rng([1, seed])), f"office {seed}")


def home_map(seed: int) -> TrueMap:
    """Return a home of the kit, as a perfect map."""
    return _map_of_storey(random_home(np.random.default_rng([2, seed])), f"home {seed}")


def published_maps(file: Path, count: int, every: int = 97) -> Iterator[TrueMap]:
    """Yield up to ``count`` published plans of a file of JSON lines as perfect maps, of each ``every``-th line; R2."""
    with gzip.open(file, "rt") as lines:
        for k, line in enumerate(lines):
            if count and k % every == 0:
                made = _map_of_boxes(json.loads(line))
                if made is not None:
                    count -= 1
                    yield made


def look_around(made: TrueMap, rng: np.random.Generator) -> TrueMap:
    """Return the map that a robot makes of a perfect one; R3."""
    sigma = float(rng.choice([0.0, 0.02, 0.04]))
    noise = NoiseConfig(
        laser_m=sigma, registration_m=sigma / 2, registration_deg=10 * sigma, drop_out=float(rng.choice([0.0, 0.1]))
    )
    laser = LaserConfig(range_m=float(rng.choice([5.0, 8.0, 12.0])), fov_deg=360.0)
    config = SimulatorConfig(pixels_per_metre=1 / CELL_M, laser=laser, noise=noise)
    simulator = Simulator.of(map_house(~made.free, CELL_M, name=made.name), config)
    seen = np.zeros((2, *made.free.shape), np.int32)
    for _ in range(round(made.free.sum() * CELL_M**2 / rng.choice(PLACE_M2))):
        data = simulator.map(simulator.start(rng)).data[::-1]
        top, left = ((have - want) // 2 for have, want in zip(data.shape, made.free.shape, strict=True))
        part = data[top : top + made.free.shape[0], left : left + made.free.shape[1]]
        seen += (part == 0, part == 100)
    free, occupied = (seen[0] > 0) & (seen[0] > seen[1]), (seen[1] > 0) & (seen[1] >= seen[0])
    return TrueMap(f"{made.name} seen", free, np.where(free, made.rooms, 0).astype(np.int32), occupied=occupied)


def seen_maps(plans: Path, offices: int, homes: int, published: int) -> Iterator[TrueMap]:
    """Yield maps of each kind, empty and furnished in turn, each as a robot makes it."""
    perfect = [office_map(seed) for seed in range(offices)] + [home_map(seed) for seed in range(homes)]
    for k, made in enumerate([*perfect, *published_maps(plans, published)]):
        rng = np.random.default_rng([3, k])
        yield look_around(replace(furnished(made, rng), name=made.name) if k % 2 else made, rng)


def _map_of_storey(storey: Storey, name: str) -> TrueMap:
    """R1."""
    group = {cell: min(zone) for zone in storey.zones for cell in zone}
    rooms: dict[int, list[BaseGeometry]] = {}
    for k, room in enumerate(storey.rooms):
        rooms.setdefault(group.get(k, k), []).append(room)
    for zone in storey.zones:
        for one, other in combinations(zone, 2):
            both = (storey.cells[each].polygon.buffer(TOUCH_M) for each in (one, other))
            rooms[min(zone)].append(shapely.difference(shapely.intersection(*both), storey.wall_area))
    doorways: list[BaseGeometry] = [storey.gap(opening) for opening in storey.openings if opening.kind in LEADS_IN]
    return _rasterise(name, [shapely.union_all(parts) for parts in rooms.values()], doorways)


def _map_of_boxes(record: dict[str, Any]) -> TrueMap | None:
    """R2; None for a plan that does not serve."""
    outline = Polygon(record["verts"])
    named = (corners for each in record["room_category"].values() for corners in each)
    boxes = {tuple(round(value, 1) for value in corners) for corners in named}
    shapes = [box(*corners) for corners in sorted(boxes)]
    if len(shapes) < FEWEST_ROOMS or not outline.is_valid:
        return None
    if any((one & other).buffer(-OVERLAP_M / 2).area > 0 for one, other in combinations(shapes, 2)):
        return None
    if (outline & shapely.union_all(shapes)).area < COVERED * outline.area:
        return None
    return _rasterise(record["id"], shapes, [], outline)


def _rasterise(
    name: str, rooms: list[BaseGeometry], between: list[BaseGeometry], outline: BaseGeometry | None = None
) -> TrueMap:
    """Return the map of rooms and what is free between them; an ``outline`` is all that is free."""
    whole = shapely.union_all([*rooms, *between]) if outline is None else outline
    left, bottom, right, top = whole.bounds
    x = np.arange(left - MARGIN_M, right + MARGIN_M, CELL_M)
    y = np.arange(top + MARGIN_M, bottom - MARGIN_M, -CELL_M)
    points = np.meshgrid(x, y)
    free: npt.NDArray[np.bool_] = shapely.contains_xy(whole, *points)
    label = np.zeros(free.shape, np.int32)
    for number, shape in enumerate(rooms, 1):
        inside = shapely.contains_xy(shape, *points)
        label = np.where(inside & (label == 0), number, np.where(inside, -1, label)).astype(np.int32)
    return TrueMap(name, free, np.where(free, np.maximum(label, 0), 0).astype(np.int32))
