"""Tiny houses as levels: boxes and sheets in the level frame, whose rooms and doors can be written down."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import trimesh

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Frame
from pipeline.algorithm import StageResult, plan_largest_building, run_stages
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from pipeline.values import Level, Mesh, Spaces
from tests.builders.meshes import Rectangle, box, joined, sheet

CEILING = 2.5
HEAD = 2.1
FRAME = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
Parts = list[trimesh.Trimesh]


@dataclass(frozen=True)
class Hole:
    """A hole in a wall from ``start`` to ``end`` along it, metres on its own axis; open from ``low`` to ``high``."""

    start: float
    end: float
    low: float = 0.0
    high: float = HEAD


def levels_of(path: Path, **options: str) -> list[Level]:
    """Read all levels of a file."""
    found = [each for item in find(str(path), **options) for each in reader(item.reader).read(item)]
    assert all(isinstance(each, Level) for each in found)
    return found  # type: ignore[return-value]


def gap(start: float, end: float) -> Hole:
    """Return a hole of full height."""
    return Hole(start, end, 0.0, CEILING)


def window(start: float, end: float) -> Hole:
    """Return a window with a parapet and a lintel."""
    return Hole(start, end, 0.9, 2.1)


def wall(rectangle: Rectangle, *holes: Hole, foot: float = 0.0, top: float = CEILING) -> Parts:
    """Return the boxes of a wall that runs along the longer side of its rectangle, holes left open."""
    x1, y1, x2, y2 = rectangle
    along_x = x2 - x1 >= y2 - y1
    start, end = (x1, x2) if along_x else (y1, y2)

    def part(a: float, b: float, low: float, high: float) -> Parts:
        if b <= a or high <= low:
            return []
        return [box((a, y1, b, y2) if along_x else (x1, a, x2, b), low, high)]

    parts: Parts = []
    for hole in sorted(holes, key=lambda h: h.start):
        parts += part(start, hole.start, foot, top)
        parts += part(hole.start, hole.end, foot, hole.low) + part(hole.start, hole.end, hole.high, top)
        start = hole.end
    return parts + part(start, end, foot, top)


def sheet_wall(start: tuple[float, float], end: tuple[float, float], *holes: Hole) -> Parts:
    """Return a wall without thickness; holes are measured from its start."""
    a, b = np.array(start), np.array(end)
    unit = (b - a) / np.hypot(*(b - a))

    def part(s: float, e: float, low: float, high: float) -> Parts:
        return [sheet(tuple(a + s * unit), tuple(a + e * unit), low, high)] if e > s and high > low else []

    at, parts = 0.0, []
    for hole in sorted(holes, key=lambda h: h.start):
        parts += part(at, hole.start, 0.0, CEILING)
        parts += part(hole.start, hole.end, 0.0, hole.low) + part(hole.start, hole.end, hole.high, CEILING)
        at = hole.end
    return parts + part(at, float(np.hypot(*(b - a))), 0.0, CEILING)


def shell(inner: Rectangle, thickness: float = 0.2, front: Sequence[Hole] = ()) -> Parts:
    """Return four walls round a rectangle of free floor; the holes of ``front`` are in the lower one."""
    x1, y1, x2, y2 = inner
    t = thickness
    return [
        *wall((x1 - t, y1 - t, x2 + t, y1), *front),
        *wall((x1 - t, y2, x2 + t, y2 + t)),
        *wall((x1 - t, y1, x1, y2)),
        *wall((x2, y1, x2 + t, y2)),
    ]


def level(walls: Mesh | Iterable[trimesh.Trimesh], **values: Any) -> Level:
    """Return walls as a level of 2.5 m; ``values`` are other fields of ``Level``."""
    mesh = walls if isinstance(walls, Mesh) else joined(list(walls))
    return Level(**{"id": "tiny", "walls": mesh, "ceiling_m": CEILING, "frame": FRAME} | values)


def two_rooms(*holes: Hole, thickness: float = 0.2) -> Parts:
    """Rooms of 4 x 3 m and 3 x 3 m: x from 0 to 4 and 4.2 to 7.2; ``holes`` are in the wall between (along y)."""
    right = 4.0 + thickness
    return [*shell((0.0, 0.0, right + 3.0, 3.0)), *wall((4.0, 0.0, right, 3.0), *holes)]


def three_rooms(first: Sequence[Hole] = (), second: Sequence[Hole] = ()) -> Parts:
    """Rooms of 3 x 3 m in a row, walls at x = 3.0 to 3.1 and 6.1 to 6.3."""
    return [
        *shell((0.0, 0.0, 9.3, 3.0)),
        *wall((3.0, 0.0, 3.1, 3.0), *first),
        *wall((6.1, 0.0, 6.3, 3.0), *second),
    ]


def plan_of(house: Level | Iterable[trimesh.Trimesh], config: PipelineConfig | None = None, seed: int = 0) -> FloorPlan:
    """Run all of Algorithm 1."""
    house = house if isinstance(house, Level) else level(house)
    return plan_largest_building(house, config or PipelineConfig(), np.random.default_rng(seed))


def stage_values(house: Level | Iterable[trimesh.Trimesh], config: PipelineConfig | None = None) -> dict[str, Any]:
    """Return what each stage made, by its name."""
    house = house if isinstance(house, Level) else level(house)
    found: Iterable[StageResult] = run_stages(house, config or PipelineConfig(), np.random.default_rng(0))
    return {result.stage: result.value for result in found}


def difference(a: shapely.Geometry, b: shapely.Geometry) -> float:
    """Area of the symmetric difference over the larger area."""
    return float(shapely.symmetric_difference(a, b).area / max(a.area, b.area))


def kinds(found: FloorPlan | Spaces) -> list[str]:
    """Kinds of all doors or passages, sorted."""
    return sorted(door.kind for door in (found.doors if isinstance(found, FloorPlan) else found.passages))
