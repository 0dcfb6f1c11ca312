"""Fit the model of ``pipeline.quality`` anew and print the table of its weights, to be put there by hand.

::

    python -m research.quality_fit --members 40 --records records.jsonl --corpus checkouts

``--records`` keeps what was judged, and judges nothing where the file is there already. ``--corpus`` adds the houses of
the corpus: what a person called right is right, everything else is not; a file counts with the least sure of its plans.
The first half is fitted on, and scored by models that saw nothing of a file's repository; the second half is only
counted.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import nullcontext
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from pipeline.quality import GROUNDS
from tests.builders.judged import (
    PRECISION,
    WORKERS,
    Bools,
    Floats,
    Judged,
    Model,
    area_under_curve,
    fit,
    judged,
    left_out_scores,
    likeliest_model,
    met_of,
    per_file,
    precision_at,
    split,
)
from tests.builders.kinds.registry import KINDS
from tests.corpus import manifest, runs

AREA = 0.9
"""The area under the curve that is asked of houses on which the model was not fitted."""


def quality_table(rows: dict[str, tuple[Floats, Bools]]) -> Table:
    """Show how good scores are: a row for each name with its scores and which plans are right."""
    table = Table(title=f"Quality of plans (asked: precision {PRECISION:g} at 0.8, area {AREA:g})")
    for k, heading in enumerate(("plans", "n", "right", "at 0.8 or more", "precision", "area under curve")):
        table.add_column(heading, justify="right" if k else "left")
    for name, (scores, met) in rows.items():
        sure, precision = f"{(scores >= 0.8).sum()}", precision_at(scores, met)
        figures = (f"{value:.3f}" for value in (precision, area_under_curve(scores, met)))
        table.add_row(name, str(len(met)), str(met.sum()), sure, *figures)
    return table


def by_kind(plans: list[Judged]) -> dict[str, tuple[Floats, Bools]]:
    """Return scores and judgements as the plans carry them, by kind."""
    kinds = sorted({plan.kind for plan in plans})
    return {kind: met_of([plan for plan in plans if plan.kind == kind]) for kind in kinds}


def source_of(model: Model) -> str:
    """Write the model as it stands in ``pipeline/quality.py``."""
    most = {g.name: f", most={g.most:.2f}" if g.most else "" for g in GROUNDS}
    lines = [f'    QualityGround("{g.name}", {model.weights[g.name]:.2f}{most[g.name]}),' for g in GROUNDS]
    return "\n".join([f"BIAS: Final = {model.bias:.2f}", "GROUNDS: Final = (", *lines, ")"])


def judge_or_read(kinds: list[str], members: int, seed: int, records: Path | None) -> list[Judged]:
    """Return what the file of records has, where there is one; else judge, and write each plan there as it comes."""
    if records and records.exists():
        return [msgspec.json.decode(line, type=Judged) for line in records.read_bytes().splitlines()]
    plans = []
    with tempfile.TemporaryDirectory() as folder, records.open("wb") if records else nullcontext() as stream:
        for plan in judged(kinds, members, seed, Path(folder)):
            plans.append(plan)
            if stream:
                stream.write(msgspec.json.encode(plan) + b"\n")
                stream.flush()
    return plans


def of_corpus(folder: Path, half: int) -> list[Judged]:
    """Build the judged files of a half of the corpus that lie in a folder, and return their plans."""
    files = [file for file in manifest.load() if file.half == half and (file.verdict or not file.interior)]
    found = []
    files = [file for file in files if file.is_in(folder)]
    for built in runs.run(files, folder, folder / ".built", workers=WORKERS, progress=lambda *_: None):
        right = built.verdict is manifest.Verdict.RIGHT
        for plan in built.plans if built.verdict else ():
            quality = plan["quality"]
            house, kind = built.file.repository, f"corpus {half}"
            found.append(Judged(house, kind, right, quality["score"], quality["grounds"], built.file.name))
    return found


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
    parser.add_argument("--records", type=Path)
    parser.add_argument("--corpus", type=Path)
    given = parser.parse_args()
    plans = judge_or_read(given.kinds.split(","), given.members, given.seed, given.records)
    counted: list[Judged] = []
    if given.corpus:
        plans += of_corpus(given.corpus.absolute(), 1)
        counted = of_corpus(given.corpus.absolute(), 2)
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
