"""Fit the model of the quality of plans of robots' maps: the table ``map`` of ``pipeline/stages/weights.toml``.

::

    python -m research.map_quality_fit --corpus checkouts --write

It learns from the maps of the corpus's first half on which there is a verdict. A right plan is right; one that is
partly right, wrong, or of no house is not. ``--counted`` names a file with the names of maps, one a line, from which
it does not learn: it only counts them, with those of the second half. The other tables of ``weights.toml`` stay as
they are, and two runs write the same bytes.

It shows how good the model is on the first half, each repository left out in turn.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from scipy.optimize import minimize

from houseexpo.plan.parts import SURE
from pipeline.quality import MAP_MOST, MAP_WHOLE, counted_of_map
from pipeline.stages.logistic import WEIGHTS, LogisticModel, load_models, source_of
from research.built_houses import built_file
from research.weights_fit import HEADING
from tests.builders.judged import Bools, Floats, area_under_curve
from tests.corpus import manifest, runs

RIDGE = 0.5
"""How strongly weights are kept small: of 0.5 and 1.5 the likelier on repositories that were left out."""
NAMES = tuple(MAP_WHOLE)


class Row(msgspec.Struct, frozen=True):
    """A map: its repository, whether its plans are right, and the grounds of the least sure of them."""

    repository: str
    right: bool
    grounds: dict[str, float]
    score: float = 1.0


def rows_of(files: Sequence[manifest.File], folder: Path, built: Path | None = None) -> list[Row]:
    """Return the maps among files that have a plan and a verdict on it, built anew."""
    found = []
    for file in files:
        house = built_file(file, folder, built)
        verdict, _ = runs.verdict_of(file, house.outcome)
        rated = [building.plan.quality for _, buildings in house.storeys for building in buildings]
        least = min((each for each in rated if each is not None), key=lambda each: each.score, default=None)
        if verdict and least is not None:
            right = verdict is manifest.Verdict.RIGHT
            found.append(Row(file.repository.lower(), right, dict(least.grounds), least.score))
    return found


def fit(rows: Sequence[Row]) -> LogisticModel:
    """Return the likeliest model, in two digits: ``RIDGE`` keeps weights small, and none is more than it may be."""
    table, right = _table(rows), _right(rows)

    def loss(x: Floats) -> tuple[float, Floats]:
        odds = x[0] + table @ x[1:]
        slope = 1 / (1 + np.exp(-odds)) - right
        value = np.logaddexp(0, np.where(right, -odds, odds)).sum() + RIDGE * (x[1:] ** 2).sum() / 2
        return float(value), np.concatenate([[slope.sum()], table.T @ slope + RIDGE * x[1:]])

    most = [MAP_MOST.get(name, 0.0) for name in NAMES]
    bounds = [(None, None), *((None, each) for each in most)]
    found = minimize(loss, np.array([0.0, *most]), jac=True, method="L-BFGS-B", bounds=bounds).x
    weights = dict(zip(NAMES, (round(min(float(each), 0.0), 2) for each in found[1:]), strict=True))
    return LogisticModel(round(float(found[0]), 2), {name: weight for name, weight in weights.items() if weight})


def scores_of(model: LogisticModel, rows: Sequence[Row]) -> Floats:
    """Return the probabilities (n,) that a model gives maps."""
    odds = model.bias + _table(rows) @ [model.weights.get(name, 0.0) for name in NAMES]
    return np.asarray(1 / (1 + np.exp(-odds)))


def left_out(rows: Sequence[Row]) -> Floats:
    """Return the probabilities (n,) of maps, each by a model that saw nothing of its repository."""
    scores = np.zeros(len(rows))
    for repository in {row.repository for row in rows}:
        own = np.array([row.repository == repository for row in rows])
        model = fit([row for row in rows if row.repository != repository])
        scores[own] = scores_of(model, [row for row in rows if row.repository == repository])
    return scores


def told(name: str, scores: Floats, right: Bools) -> str:
    """Say how good scores are."""
    chosen = {least: scores >= least for least in (SURE, 0.5)}
    counts = [f"{right[these].sum()} of {these.sum()} right from {least:g}" for least, these in chosen.items()]
    area = area_under_curve(scores, right)
    return f"{name}: {right.sum()} of {len(right)} right; area {area:.3f}; {'; '.join(counts)}"


def _table(rows: Sequence[Row]) -> Floats:
    found = [[counted_of_map(name, row.grounds.get(name, 0.0)) for name in NAMES] for row in rows]
    return np.array(found).reshape(-1, len(NAMES))


def _right(rows: Sequence[Row]) -> Bools:
    return np.array([row.right for row in rows], bool)


def main() -> None:
    """Fit, show what comes of it on what was left out, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--built", type=Path, help="keeps the maps as they were built")
    parser.add_argument("--counted", type=Path, help="names of maps that are only counted")
    parser.add_argument("--both-halves", action="store_true", help="count what is not learnt from, too")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    folder = given.corpus.absolute()
    names = set(given.counted.read_text(encoding="utf-8").split()) if given.counted else set[str]()
    maps = [file for file in manifest.load() if file.kind == "map" and file.is_in(folder)]
    learnt = rows_of([f for f in maps if f.half == 1 and f.name not in names], folder, given.built)
    model = fit(learnt)
    console = Console(soft_wrap=True, markup=False, highlight=False)
    console.print(told("as they carry it", np.array([row.score for row in learnt]), _right(learnt)))
    console.print(told("repositories left out", left_out(learnt), _right(learnt)))
    if given.both_halves:
        for name, files in (
            ("second half", [f for f in maps if f.half == 2 and f.name not in names]),
            ("only counted", [f for f in maps if f.name in names]),
        ):
            rows = rows_of(files, folder, given.built)
            console.print(told(name, scores_of(model, rows), _right(rows)))
    text = source_of({**load_models(), "map": model}, HEADING)
    if given.write:
        WEIGHTS.write_text(text, encoding="utf-8")
    else:
        console.print(source_of({"map": model}, HEADING))


if __name__ == "__main__":
    main()
