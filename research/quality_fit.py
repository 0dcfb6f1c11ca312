"""Fit the model of ``pipeline.quality`` anew and print the table of its weights, to be put there by hand.

::

    python -m research.quality_fit --members 12 --corpus checkouts --built built

``--built`` keeps the houses as they were built (``research.built_houses``), and builds none that is there already.
``--corpus`` adds the houses of the corpus: what a person called right is right, everything else is not; a file counts
with the least sure of its plans. The first half is fitted on, and scored by models that saw nothing of a file's
repository; the second half is only counted, where ``--both-halves`` asks for it.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from pipeline.quality import GROUNDS, score_quality
from research.built_houses import BuiltHouse, built_file, built_member
from research.confidence_fit import in_order
from tests.builders.judged import (
    PRECISION,
    Bools,
    Floats,
    Judged,
    Model,
    area_under_curve,
    damage_of,
    fit,
    judged,
    left_out_scores,
    likeliest_model,
    met_of,
    per_file,
    precision_at,
    split,
)
from tests.builders.kinds.measuring import paired
from tests.builders.kinds.registry import KINDS
from tests.builders.shared import as_json
from tests.corpus import manifest, runs

UNSURE = 0.5
AREA = 0.9
"""The area under the curve that is asked of houses on which the model was not fitted."""


def quality_table(rows: dict[str, tuple[Floats, Bools]]) -> Table:
    """Show how good scores are, a row for each name: how many right plans are unsure, how many sure ones are right."""
    table = Table(title=f"Quality of plans (asked: precision {PRECISION:g} at 0.8, area {AREA:g})")
    for k, heading in enumerate(
        ("plans", "n", "right", "below 0.5", "at 0.8 or more", "precision", "area under curve")
    ):
        table.add_column(heading, justify="right" if k else "left")
    for name, (scores, met) in rows.items():
        sure, precision = f"{(scores >= 0.8).sum()}", precision_at(scores, met)
        figures = (f"{value:.3f}" for value in (precision, area_under_curve(scores, met)))
        table.add_row(name, str(len(met)), str(met.sum()), str((scores[met] < UNSURE).sum()), sure, *figures)
    return table


def by_kind(plans: list[Judged]) -> dict[str, tuple[Floats, Bools]]:
    """Return scores and judgements as the plans carry them, by kind."""
    kinds = sorted({plan.kind for plan in plans})
    return {kind: met_of([plan for plan in plans if plan.kind == kind]) for kind in kinds}


def source_of(model: Model) -> str:
    """Write the model as it stands in ``pipeline/quality.py``."""
    most = {g.name: f", most={g.most:.2f}" if g.most else "" for g in GROUNDS}
    lines = [f'    QualityGround("{g.name}", {model.weights[g.name]:.2f}{most[g.name]}),' for g in GROUNDS]
    return "\n".join(
        [f"BIAS: Final = {model.bias:.2f}", "GROUNDS: Final = (", *lines, ")", f"SPREAD: Final = {model.spread:.2f}"]
    )


def judge_made(kinds: list[str], members: int, seed: int, built: Path | None) -> list[Judged]:
    """Build made houses and the cases of the development data, and judge their plans."""
    tasks = [(kind, number) for number in range(members) for kind in kinds]
    with tempfile.TemporaryDirectory() as folder:
        work = partial(_of_member, seed=seed, folder=Path(folder), built=built)
        made = in_order(work, tasks)
        return made + list(judged([], 0, seed, Path(folder)))


def _of_member(task: tuple[str, int], seed: int, folder: Path, built: Path | None) -> list[Judged]:
    kind, number = task
    house = built_member(task, seed, folder, built)
    plans = [as_json(building.plan) for _, buildings in house.storeys for building in buildings]
    met = {score["plan"]: not score["failing"] for score in paired(house.truths, plans)[0] if "plan" in score}
    kind = "damaged" if damage_of(kind, number, seed) else kind
    return [Judged(f"{task[0]} {number}", kind, met.get(k, False), *each) for k, each in enumerate(_qualities(house))]


def of_corpus(folder: Path, half: int, built: Path | None) -> list[Judged]:
    """Build the judged files of a half of the corpus that lie in a folder, and return their plans."""
    files = [file for file in manifest.load() if file.half == half and (file.verdict or not file.interior)]
    names = [file.name for file in files if file.is_in(folder)]
    return in_order(partial(_of_file, folder=folder, built=built), names)


def _of_file(name: str, folder: Path, built: Path | None) -> list[Judged]:
    file = next(file for file in manifest.load() if file.name == name)
    house = built_file(file, folder, built)
    verdict, _ = runs.verdict_of(file, house.outcome)
    right, kind = verdict is manifest.Verdict.RIGHT, f"corpus {file.half}"
    return [Judged(file.repository, kind, right, *each, name) for each in _qualities(house) if verdict]


def _qualities(house: BuiltHouse) -> list[tuple[float, Mapping[str, float]]]:
    """Return score and grounds of each plan, as the models of today tell them."""
    rated = [(level, building.rated(level).grounds) for level, buildings in house.storeys for building in buildings]
    return [(score_quality(grounds, marked=level.sills).score, grounds) for level, grounds in rated]


def corpus_rows(plans: list[Judged], counted: list[Judged], model: Model) -> dict[str, tuple[Floats, Bools]]:
    """Return scores and judgements of the corpus's files: the first half left out in turn, the second counted."""
    first = [plan for plan in plans if plan.file]
    rows = {}
    for name, half in (("half 1", first), ("half 2", counted)):
        if half:
            rows[f"{name}, as they carry it"] = per_file(half, np.array([plan.score for plan in half]))
    if first:
        lowered = likeliest_model(plans).bias - model.bias
        rows["half 1, left out"] = per_file(first, left_out_scores(plans, lowered))
    if counted:
        rows["half 2, counted"] = per_file(counted, model.scores(counted))
    return rows


def main() -> None:
    """Judge, fit on the houses that are for it, show what comes of it on the others, and print the model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=100)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--built", type=Path)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--both-halves", action="store_true", help="count the corpus's second half too")
    given = parser.parse_args()
    plans = judge_made(given.kinds.split(","), given.members, given.seed, given.built)
    counted: list[Judged] = []
    if given.corpus:
        plans += of_corpus(given.corpus.absolute(), 1, given.built)
    if given.corpus and given.both_halves:
        counted = of_corpus(given.corpus.absolute(), 2, given.built)
    fitted, held_out = split(plans)
    tried = fit(fitted)
    model = fit(plans)
    rows = {
        "as they carry it": met_of(plans),
        "fitted": (tried.scores(fitted), np.array([p.met for p in fitted])),
        "held out": (tried.scores(held_out), np.array([p.met for p in held_out])),
        "fitted on all": (model.scores(plans), np.array([p.met for p in plans])),
    }
    console = Console(width=120)
    console.print(quality_table({**rows, **by_kind(plans), **corpus_rows(plans, counted, model)}))
    console.print(source_of(model), highlight=False, markup=False)


if __name__ == "__main__":
    main()
