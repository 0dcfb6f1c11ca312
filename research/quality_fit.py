"""Show the qualities of plans and the model that a fit of ``pipeline.quality`` finds: see ``research.weights_fit``.

What a person called right is right, everything else is not; a file counts with the least sure of its plans. The first
half of the corpus is fitted on, and scored by models that saw nothing of a file's repository.
"""

from __future__ import annotations

import numpy as np
from rich.table import Table

from pipeline.quality import GROUNDS
from tests.builders.judged import (
    PRECISION,
    Bools,
    Floats,
    Judged,
    Model,
    area_under_curve,
    left_out_scores,
    likeliest_model,
    met_of,
    per_file,
    precision_at,
)

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
