"""Doors and rooms one by one: is each true one among the candidates, and how good is the confidence of those found.

``--members`` and ``--kinds`` choose houses of the kit as they do for the benchmark of the kinds. A true inner door has
a candidate where one lies within 0.1 m of its middle; a true boundary where a wall or a candidate lies within 0.12 m.
The confidence is measured on houses of a seed on which its models were not fitted.
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import shapely
from rich.console import Console
from rich.table import Table

from pipeline.config import PipelineConfig
from pipeline.executors.local import Failure, run
from pipeline.sources import find, reader
from pipeline.stages.confidence import models
from pipeline.stages.evidence import gather
from pipeline.stages.layout import candidates
from pipeline.stages.planes import cut_planes
from pipeline.values import Level
from research.confidence_fit import LIMITS, SAME_FLOOR_M, collected, table_of
from tests.builders.kinds.registry import KINDS, make_member
from tests.corpus.truths import in_source

DOOR_M = 0.1
BOUNDARY_M = 0.12
STEP_M = 0.05
FITTED_SEED = 0


def missing(task: tuple[str, int], seed: int, folder: Path) -> Counter[str]:
    """Count the true doors and metres of true boundary of a made house, and those without a candidate."""
    member = make_member(*task, seed, folder / task[0])
    found: Counter[str] = Counter()
    for level in (level for item in find(str(member.path)) for level in reader(item.reader).read(item)):
        if not isinstance(level, Level):
            continue
        truth = min(member.truths, key=lambda each: abs(each["floor_z"] - level.frame.floor))
        if abs(truth["floor_z"] - level.frame.floor) > SAME_FLOOR_M:
            continue
        config = PipelineConfig()
        evidence = gather(level, config.evidence)
        planes = cut_planes(level, evidence, config.planes)
        closing = [each.polygon for each in candidates(level, planes, config.layout)]
        shapes = shapely.union_all([*closing, *evidence.leaves, *(d.polygon for d in evidence.doorways)])
        shapes = shapely.transform(shapes, partial(in_source, level))
        walls = shapely.union_all([shapely.transform(evidence.walls, partial(in_source, level)), shapes])
        for door in (each for each in truth["doors"] if each["interior"]):
            found["doors"] += 1
            found["doors missing"] += int(shapely.Point(door["centre"]).distance(shapes) > DOOR_M)
        rooms = [shapely.Polygon(room["polygon"], room["holes"]).buffer(0) for room in truth["rooms"]]
        groups = truth.get("zones") or [[k] for k in range(len(rooms))]
        for zone in (shapely.union_all([rooms[k].buffer(0.02) for k in group]).buffer(-0.02) for group in groups):
            edge = zone.boundary
            points = shapely.line_interpolate_point(edge, np.arange(0, edge.length, STEP_M))
            found["boundary"] += len(points)
            found["boundary missing"] += int((shapely.distance(points, walls) > BOUNDARY_M).sum())
    return found


def test_true_doors_and_boundaries_have_candidates(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    tasks = [(kind, number) for number in range(option("--members")) for kind in kinds]
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in kinds}
    for task, result in run(partial(missing, seed=option("--seed"), folder=tmp_path), tasks, workers=2, limits=LIMITS):
        if not isinstance(result, Failure):
            counts[task[0]] += result
    table = Table(title="Without a candidate (asked: below 2%)")
    for k, heading in enumerate(("kind", "true doors", "missing", "true boundary, m", "missing")):
        table.add_column(heading, justify="right" if k else "left")
    for kind, found in counts.items():
        share = [found[f"{name} missing"] / max(found[name], 1) for name in ("doors", "boundary")]
        metres = f"{found['boundary'] * STEP_M:.0f}"
        table.add_row(kind, str(found["doors"]), f"{share[0]:.1%}", metres, f"{share[1]:.1%}")
    Console(width=120).print(table)
    assert sum(found["doors"] for found in counts.values())


def test_confidence_tells_true_parts_from_false_ones(request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    seed = option("--seed") or FITTED_SEED + 1
    parts = collected(kinds, option("--members"), seed, None, None)
    Console(width=120).print(table_of(parts, models()))
    assert {part.part for part in parts} == {"door", "entrance", "room"}
