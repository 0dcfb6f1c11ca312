"""How well plans agree with what is known: real houses, and houses whose parameters we know.

Then how well the quality that a plan carries tells plans that meet the table from those that do not, by kind. Plans of
houses on which the model was not fitted stand in a row of their own. ``--members`` and ``--kinds`` choose houses of the
kit as they do for the benchmark of the kinds; the cases of the development data are among them.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.values import Level
from research.quality_fit import by_kind, quality_table
from tests.builders import shared
from tests.builders.judged import NAMES, judged, met_of, split
from tests.builders.kinds.registry import KINDS
from tests.builders.shared import CASES, DATA, NOT_YET, as_json, case, needs_shared, plan_nearest, planned, scorer
from tests.builders.suncg_houses import write_houses

HOUSES, SEED = 200, 11
COLUMNS = {
    "free_iou": "free IoU",
    "room_recall": "room recall",
    "room_precision": "precision",
    "door_recall": "door recall",
    "door_precision": "precision",
    "width_error_m": "width error (m)",
    "cuts": "cuts",
    "cuts_needed": "needed",
    "components": "parts",
    "label_accuracy": "labels",
    "valid": "valid",
}

PLANES = ("free_iou", "room_recall", "room_precision", "door_recall", "door_precision")


def table_of(title: str, *headings: str) -> Table:
    """An empty table, its figures to the right."""
    table = Table(title=title)
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="right" if k else "left")
    return table


def shown(value: float | bool | None) -> str:
    """A figure as the README shows it."""
    return "" if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)


@needs_shared
def test_real_houses() -> None:
    table = table_of("Real houses, from the mesh and from the IFC file", "case", *COLUMNS.values(), "core s")
    for name in CASES:
        truth = case(name)
        for key in ("mesh", "ifc"):
            if key not in truth:
                continue
            start = time.process_time()
            try:
                plan = as_json(plan_nearest(DATA / truth[key], truth["floor_z"]))
            except LookupError:
                if name not in NOT_YET:
                    raise
                table.add_row(f"{name} ({key})", "no plan")
                continue
            seconds = time.process_time() - start
            score = scorer()(plan, truth if key == "mesh" else {**truth, "zones": None})
            if key == "mesh":
                score["label_accuracy"] = None  # a mesh names nothing
            table.add_row(f"{name} ({key})", *(shown(score.get(c)) for c in COLUMNS), f"{seconds:.1f}")
            assert score["valid"] or name in NOT_YET
    Console(width=180).print(table)


@needs_shared
def test_real_meshes_by_the_papers_planes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the walls of several heights bring: meshes read by the two planes of the paper, and as they are."""
    levels = shared.levels
    table = table_of("Real meshes, means", "planes", "plans", *(COLUMNS[key] for key in PLANES))
    recall = {}
    for name, sills in (("the paper's two", True), ("of several heights", False)):
        found = partial(_with_sills, levels, sills=sills)
        monkeypatch.setattr(shared, "levels", found)
        scores, cases = [], [each for each in CASES if "mesh" in case(each)]
        for each in cases:
            truth = case(each)
            try:
                plan = as_json(plan_nearest(DATA / truth["mesh"], truth["floor_z"]))
            except LookupError:
                continue
            scores.append(scorer()(plan, truth))
        known = {key: [score[key] for score in scores if score.get(key) is not None] for key in PLANES}
        table.add_row(name, f"{len(scores)} of {len(cases)}", *(f"{np.mean(known[key]):.2f}" for key in PLANES))
        recall[sills] = np.mean(known["door_recall"])
    Console(width=140).print(table)
    assert recall[False] > recall[True]


def _with_sills(levels: Callable[[Path], Iterable[Level]], path: Path, *, sills: bool) -> list[Level]:
    """The levels of a file, all of them read as those of SUNCG if ``sills``."""
    return [replace(level, sills=level.sills or sills) for level in levels(path)]


@needs_shared
def test_houses_with_a_known_truth(tmp_path: Path) -> None:
    write_houses(tmp_path, HOUSES, SEED)
    iou: dict[str, list[float]] = {}
    outcome: Counter[tuple[str, str]] = Counter()
    worst = Counter[str]()
    for item in suncg.find(str(tmp_path)):
        for level in suncg.read(item):
            truth = msgspec.json.decode((tmp_path / "truth" / f"{level.id}.json").read_bytes())
            kind = ", ".join(truth["difficulties"]) or "sound"
            try:
                plan = planned(level)
            except Rejection as rejection:
                outcome[kind, f"rejected:{rejection.reason}"] += 1
                continue
            outcome[kind, "plan"] += 1
            score = scorer()(as_json(plan), truth)
            iou.setdefault(kind, []).append(score["free_iou"])
            worst["unreachable"] += score["components"] != 1
            worst["invalid"] += not score["valid"]
            worst["rooms missed"] += score["room_recall"] < 1
            worst["doors missed"] += score.get("door_recall", 1) < 1
    table = table_of(f"{HOUSES} made houses against their truth", "planted", "came out as", "levels", "median", "worst")
    for (kind, result), count in sorted(outcome.items()):
        found = iou.get(kind, []) if result == "plan" else []
        table.add_row(kind, result, str(count), *(shown(float(f(found))) if found else "" for f in (np.median, np.min)))
    console = Console(width=140)
    console.print(table)
    console.print(dict(worst))
    assert worst["unreachable"] == worst["invalid"] == 0
    assert min(map(min, iou.values())) > 0.98, "a plan lacks a part of its house"


@needs_shared
def test_quality_tells_right_plans_from_wrong_ones(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    plans = list(judged(kinds, option("--members"), option("--seed"), tmp_path))
    _, held_out = split(plans)
    rows = {"all": met_of(plans), "held out": met_of(held_out), **by_kind(plans)}
    Console(width=120).print(quality_table(rows))
    assert plans
    assert {name for plan in plans for name in plan.grounds} >= set(NAMES), "a ground that no plan gives weighs nothing"
