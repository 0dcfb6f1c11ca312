"""Plan -> format -> plan, for every format that the project writes and a reader of it: a table of what comes back.

The plans are those of ``houseexpo build procedural:100 --seed 2019`` of which the pipeline is sure.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan
from houseexpo.dataset import open_dataset
from houseexpo.exports import export
from pipeline.cli_build import from_python
from tests.builders.batch import labels, likeness, plans_of
from tests.pipeline.test_round_trips import FINE_M, FORMS, MAPS, sound

HOUSES, SEED = 100, 2019


def test_what_comes_back_of_each_format(tmp_path: Path) -> None:
    home = tmp_path / "plans"
    from_python([f"procedural:{HOUSES}"], str(home), config=None, overrides=None, workers=2, others="refuse", seed=SEED)
    data = open_dataset(home)
    plans = sound([data[name] for name in data.ids])
    table = Table(title=f"Plans that come back, of {len(plans)} (seed {SEED})")
    for heading in ("format", "rooms", "doors", "kinds of doors", "entrances", "labels", "IoU: least", "mean"):
        table.add_column(heading, justify="left" if heading == "format" else "right")
    for form in sorted({*FORMS, *MAPS}):
        rows = [_row(plan, _through(plan, form, tmp_path / form / plan.id)) for plan in plans]
        counts, ious = np.array([row[:-1] for row in rows]).sum(axis=0), [row[-1] for row in rows]
        table.add_row(form, *map(str, counts.tolist()), f"{min(ious):.4f}", f"{np.mean(ious):.4f}")
    Console(width=140).print(table)


def _through(plan: FloorPlan, form: str, folder: Path) -> FloorPlan:
    """Return what comes back of a plan: of several buildings, the largest."""
    suffix, options = MAPS.get(form, (FORMS.get(form, ""), {}))
    cells = {"resolution": FINE_M} if form in MAPS else {}
    file = next(each for each in export(plan, form, folder, **cells) if each.name.endswith(suffix))
    return max(plans_of(file, **options), key=lambda each: each.area)


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
