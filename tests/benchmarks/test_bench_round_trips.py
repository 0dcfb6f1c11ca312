"""Plan -> format -> plan, for every format that the project writes and a reader of it: a table of what comes back.

The plans are those of ``houseexpo build "procedural:100?style=published" --seed 2019`` of which the pipeline is sure.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan
from houseexpo.dataset import open_dataset
from houseexpo.exports import export
from pipeline.algorithm import plan_level
from pipeline.cli_build import from_python
from pipeline.config import PipelineConfig
from pipeline.sources import find, reader
from tests.builders.batch import labels, likeness
from tests.pipeline.test_round_trips import FINE_M, FORMS, MAPS, sound

HOUSES, SEED = 100, 2019
COLUMNS = ("rooms", "doors", "kinds of doors", "entrances", "labels", "IoU: least", "mean")


def test_what_comes_back_of_each_format(tmp_path: Path) -> None:
    home = tmp_path / "plans"
    from_python(
        [f"procedural:{HOUSES}?style=published"],
        str(home),
        config=None,
        overrides=None,
        workers=2,
        others="refuse",
        seed=SEED,
    )
    data = open_dataset(home)
    plans = sound([data[name] for name in data.ids])
    table = Table(title=f"Plans that come back, of {len(plans)} (seed {SEED}), and processor time per plan, median, ms")
    for heading in ("format", *COLUMNS, "write", "read", "plan"):
        table.add_column(heading, justify="left" if heading == "format" else "right")
    for form in sorted({*FORMS, *MAPS}):
        trips = [_through(plan, form, tmp_path / form / plan.id) for plan in plans]
        rows = [_row(plan, trip.found) for plan, trip in zip(plans, trips, strict=True)]
        counts, ious = np.array([row[:-1] for row in rows]).sum(axis=0), [row[-1] for row in rows]
        spent = np.median([trip.seconds for trip in trips], axis=0) * 1000
        said = [*map(str, counts.tolist()), f"{min(ious):.4f}", f"{np.mean(ious):.4f}", *(f"{ms:.1f}" for ms in spent)]
        table.add_row(form, *said)
        Console(width=140).print(form, *said)  # as it comes: the whole takes minutes
    Console(width=140).print(table)


class _Trip(NamedTuple):
    """What came back, and the seconds of processor that writing, reading and planning took."""

    found: FloorPlan
    seconds: tuple[float, float, float]


def _through(plan: FloorPlan, form: str, folder: Path) -> _Trip:
    """Return what comes back of a plan: of several buildings, the largest."""
    suffix, options = MAPS.get(form, (FORMS.get(form, ""), {}))
    cells = {"resolution": FINE_M} if form in MAPS else {}
    start = time.process_time()
    file = next(each for each in export(plan, form, folder, **cells) if each.name.endswith(suffix))
    written = time.process_time()
    levels = [each for item in find(str(file), **options) for each in reader(item.reader).read(item)]
    read = time.process_time()
    made = [each for level in levels for each in plan_level(level, PipelineConfig(), np.random.default_rng(0))]
    spent = (written - start, read - written, time.process_time() - read)
    return _Trip(max((each for each in made if isinstance(each, FloorPlan)), key=lambda each: each.area), spent)


def _row(plan: FloorPlan, found: FloorPlan) -> tuple[bool, bool, bool, bool, bool, float]:
    """Say which parts of a plan came back, all of them, and the IoU of its free space."""
    kinds, there = ([door.kind for door in each.doors] for each in (plan, found))
    inner, inner_there = ([kind for kind in each if kind != "entrance"] for each in (kinds, there))
    return (
        len(found.rooms) == len(plan.rooms),
        len(inner) == len(inner_there),
        sorted(inner) == sorted(inner_there),
        kinds.count("entrance") == there.count("entrance"),
        labels(found) == labels(plan),
        likeness(plan, found),
    )
