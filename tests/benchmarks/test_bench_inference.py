"""How well and how fast rooms and doors are found from an outline alone."""

from __future__ import annotations

import gzip
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo.floorplan import FloorPlan, decode
from houseexpo.inference import with_rooms
from tests.builders.batch import made_plans
from tests.builders.matching import Matches, bare, matches, total
from tests.builders.shared import CASES, DATA, NOT_YET, as_json, case, needs_shared, plan_nearest, scorer

HOUSES, PUBLISHED, SEED = 200, 2000, 2019
RATES = ("room recall", "room precision", "door recall", "door precision")


def table_of(title: str, *headings: str) -> Table:
    """An empty table, its figures to the right."""
    table = Table(title=title)
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="right" if k else "left")
    return table


def test_the_pipelines_plans_with_their_rooms_and_doors_hidden(tmp_path: Path) -> None:
    plans = made_plans(tmp_path, HOUSES, SEED)
    table = table_of(f"{len(plans)} plans of {HOUSES} made houses", "what is left", *RATES)
    hide: dict[str, Callable[[FloorPlan], FloorPlan]] = {
        "verts, holes": bare,
        "verts": lambda plan: bare(plan, holes=False),
    }
    for name, hidden in hide.items():
        counts: Matches = total([matches(plan, with_rooms(hidden(plan))) for plan in plans])
        table.add_row(name, *(f"{rate:.3f}" for rate in counts.rates()))
        assert min(counts.rates()) >= 0.85
    Console(width=120).print(table)


@needs_shared
def test_real_houses_with_their_rings_left() -> None:
    table = table_of("Real houses, verts and holes left", "case", *RATES)
    rows = []
    for name in sorted(set(CASES) - set(NOT_YET)):
        truth = case(name)
        plan = plan_nearest(DATA / truth["mesh"], truth["floor_z"])
        score = scorer()(as_json(with_rooms(replace(plan, rooms=(), doors=(), windows=()))), truth)
        rows.append([score[key.replace(" ", "_")] for key in RATES])
        table.add_row(name, *(f"{value:.3f}" for value in rows[-1]))
    table.add_row("mean", *(f"{value:.3f}" for value in np.mean(rows, axis=0)))
    Console(width=120).print(table)
    assert np.mean(rows, axis=0).min() >= 0.85


@needs_shared
def test_published_plans() -> None:
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        lines = stream.readlines()
    chosen = np.random.default_rng(SEED).choice(len(lines), PUBLISHED, replace=False)
    with_rooms(decode(lines[0]))  # imports
    off, seconds = [], []
    for k in chosen:
        plan = decode(lines[k])
        start = time.process_time()
        found = with_rooms(plan)
        seconds.append(time.process_time() - start)
        off.append(len(found.rooms) - plan.room_num)
    table = table_of(f"{PUBLISHED} published plans: rooms found less room_num", "", "median", "mean", "95%", "worst")
    for name, values in (("difference", np.array(off)), ("its size", np.abs(off)), ("ms", 1000 * np.array(seconds))):
        figures = np.median(values), np.mean(values), np.percentile(values, 95), values[np.abs(values).argmax()]
        table.add_row(name, *(f"{figure:.1f}" for figure in figures))
    Console(width=120).print(table)
    assert np.median(np.abs(off)) <= 1
    assert np.mean(seconds) * len(lines) / 2 <= 600
