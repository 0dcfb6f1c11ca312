"""A plan through a file and back: what the pipeline makes of it, and how much of the plan that is."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import shapely

from houseexpo import FloorPlan
from houseexpo.exports import export, oriented
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from pipeline.values import Level


def plans_of(path: Path, **options: str) -> list[FloorPlan]:
    """Build every level of a source, without the batch around it."""
    found = []
    for item in find(str(path), **options):
        for level in reader(item.reader).read(item):
            assert isinstance(level, Level), level
            made = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            found += [plan for plan in made if isinstance(plan, FloorPlan)]
    return found


def through(plan: FloorPlan, form: str, folder: Path, suffix: str = "") -> FloorPlan:
    """Write a plan in a format and build a plan of the file again: the largest, of several buildings."""
    files = [file for file in export(plan, form, folder) if file.name.endswith(suffix)]
    return max(plans_of(files[0]), key=lambda each: each.area)


def likeness(plan: FloorPlan, other: FloorPlan) -> float:
    """IoU of the free space of two plans; the lower left corners of their bounds are laid on each other."""
    one, two = oriented(plan).free_space, other.free_space
    (x1, y1, *_), (x2, y2, *_) = one.bounds, two.bounds
    moved = shapely.affinity.translate(two, x1 - x2, y1 - y2)
    return float(one.intersection(moved).area / one.union(moved).area)


def labels(plan: FloorPlan) -> Counter[str]:
    """How many rooms have which label."""
    return Counter(room.label for room in plan.rooms)
