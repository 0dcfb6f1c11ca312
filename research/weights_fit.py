"""Fit all models of ``pipeline/stages/weights.toml``, spaces, doors, entrances and rooms, and that of the quality.

::

    python -m research.weights_fit --corpus checkouts --built built --write

``--built`` keeps the houses as they were built (``research.built_houses``), and builds none that is there already: a
run that was cut off goes on where it ended. Two runs over the same folder write the same bytes, whatever
``weights.toml`` holds: the model of spaces is fitted first, and what rests on it is measured anew by it. The model of
``pipeline.quality`` is printed, to be put there by hand. ``research.confidence_fit`` gathers what they learn from.

The table ``map``, the model of the quality of maps, stays as it is: ``research.map_quality_fit`` fits it.

It shows how good the models are on the first half: each repository is rated by models that saw nothing of it. The
second half is only counted, where ``--both-halves`` asks for it.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from pipeline.fitting.models import fit
from pipeline.fitting.rows import SPACE, HouseRows, Part, parts_of, rate_building
from pipeline.quality import is_of_map, score_quality
from pipeline.stages.logistic import FITTED, WEIGHTS, LogisticModel, Models, load_models, source_of
from research import quality_fit
from research.confidence_fit import collect, table_of, weights_of
from research.quality_fit import corpus_rows, quality_table
from tests.builders import judged
from tests.builders.judged import FOLDS, Judged
from tests.builders.kinds.registry import KINDS

HEADING = "Written by python -m research.weights_fit; see pipeline/stages/confidence.py."
SECOND = "corpus 2"

_OF_ROOM = frozenset({"odd_room", "jutting_wall"})
"""What doors say of their rooms. Of entrances left out of the fit, it makes the probabilities worse."""


def is_of_model(name: str, part: str) -> bool:
    """Whether the model of a part has a feature: doors weigh the grounds of the plan, others its quality (F5)."""
    if name.startswith(SPACE):
        return False
    if name == "doubtful_plan":
        return part in {"entrance", "room"}
    if part == "entrance" and name in _OF_ROOM:
        return False
    return part == "door" or not name.startswith("plan_")


def fit_all(rows: Sequence[HouseRows]) -> Models:
    """Fit all models of ``weights.toml`` on houses."""
    space = _fit([part for row in rows for part in row.spaces], "space")
    return {"space": space} | {name: _fit(parts_of(rows, name, space), name) for name in FITTED if name != "space"}


def _fit(parts: Sequence[Part], name: str) -> LogisticModel:
    names = sorted({n for each in parts for n, value in each.features.items() if value and is_of_model(n, name)})
    return fit(parts, names, weights_of(parts))


def judged_plans(rows: Sequence[HouseRows], space: LogisticModel) -> list[Judged]:
    """Return the plans, but maps, of which somebody knows whether they are right, with the scores of today's model."""
    known = [plan for row in rows for plan in row.plans if plan.right is not None and not is_of_map(plan.grounds)]
    plans = [rate_building(plan, space) for plan in known]
    scores = [score_quality(plan.grounds).score for plan in plans]
    return [
        Judged(plan.repository, plan.group, bool(plan.right), score, plan.grounds, plan.file)
        for plan, score in zip(plans, scores, strict=True)
    ]


def left_out(rows: Sequence[HouseRows]) -> list[tuple[Part, float]]:
    """Rate the parts of files, each by models that were fitted without its repository's fold."""
    real = [row for row in rows if _is_real(row)]
    folds = np.array([zlib.crc32(row.plans[0].repository.encode()) % FOLDS for row in real])
    scored: list[tuple[Part, float]] = []
    for k in np.unique(folds):
        out = [row for row, fold in zip(real, folds, strict=True) if fold == k]
        these = {id(row) for row in out}
        scored += score(out, fit_all([row for row in rows if id(row) not in these]))
    return scored


def score(rows: Sequence[HouseRows], models: Models) -> list[tuple[Part, float]]:
    """Return the parts of houses with the confidences that models give them."""
    parts = [part for row in rows for plan in row.plans for part in rate_building(plan, models["space"]).parts]
    parts += [part for row in rows for part in row.spaces]
    return [(part, models[part.part].confidence(part.features)) for part in parts]


def _is_real(row: HouseRows) -> bool:
    return any(plan.file for plan in row.plans)


def main() -> None:
    """Fit, show what comes of it on what was left out, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=3, help="so many made houses of each kind")
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--built", type=Path)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--labels", type=Path, help="labels of reviewed houses, which houseexpo labels has written")
    parser.add_argument("--both-halves", action="store_true", help="count the corpus's second half too")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    corpus = given.corpus.absolute() if given.corpus else None
    every = collect(
        given.kinds.split(","),
        given.members,
        given.seed,
        corpus,
        given.built,
        both_halves=given.both_halves,
        labels=given.labels,
    )
    second = [row for row in every if any(plan.group == SECOND for plan in row.plans)]
    rows = [row for row in every if row not in second]
    models = fit_all(rows)
    text = source_of({**models, "map": load_models()["map"]}, HEADING)
    console = Console(width=120)
    parts = score([row for row in rows if not _is_real(row)], models) + left_out(rows) + score(second, models)
    console.print(table_of(parts))
    plans, counted = (judged_plans(each, models["space"]) for each in (rows, second))
    quality = judged.fit(plans)
    console.print(quality_table(corpus_rows(plans, counted, quality)))
    console.print(quality_fit.source_of(quality), highlight=False, markup=False)
    if given.write:
        WEIGHTS.write_text(text, encoding="utf-8")
    else:
        console.print(text, highlight=False, markup=False)


if __name__ == "__main__":
    main()
