"""How far made homes are from published plans, measure by measure, and whether a classifier tells them apart.

    python -m research.home_comparison plans_33717.jsonl.gz [HOUSES]

Both are looked at as ``home_measures`` says. Distances are Wasserstein-1 in standard deviations of the published plans
(plain where they have none), total variation for labels.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table
from scipy.stats import wasserstein_distance
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.inspection import permutation_importance
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import StratifiedKFold
from threadpoolctl import threadpool_limits

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from research.home_measures import Seen, as_published, features, measure_plan, pooled_labels
from research.home_statistics import measure_published
from stats.report import total_variation

SEED = 2026
ASKED = {
    **dict.fromkeys(("area_m2", "long_side_m", "short_side_m", "rooms", "extent"), 0.10),
    "labels": 0.05,
    **dict.fromkeys(("area by label", "doors_per_room", "degree", "loops", "depth"), 0.15),
    **dict.fromkeys(("oblique_share", "notches", "bays", "corners"), 0.20),
}
AUC = 0.70
STEP_M = 0.05
COMMON = 0.01
"""A label with a smaller share of the published rooms is left out of the mean distance of areas."""


@dataclass(frozen=True)
class Line:
    """One measure: the published mean, the made one, how far apart, how far it may be; None where nothing is asked."""

    name: str
    published: float
    made: float
    distance: float
    asked: float | None


@dataclass(frozen=True)
class Verdict:
    """The cross-validated area under the curve, and what tells most: (name, how much AUC is lost without it)."""

    auc: float
    tells: list[tuple[str, float]]


def made_plans(count: int, seed: int = SEED) -> Iterator[FloorPlan]:
    """Build ``count`` homes; those that give no plan are passed over."""

    def build_plans() -> Iterator[FloorPlan]:
        for item in find("procedural:1000000?style=published", seed=str(seed)):
            for level in reader(item.reader).read(item):
                try:
                    found = plan_level(level, PipelineConfig(), np.random.default_rng(seed))
                except Rejection:
                    continue
                yield from (plan for plan in found if isinstance(plan, FloorPlan))

    return islice(build_plans(), count)


def compare_measures(ours: list[Seen], theirs: list[Seen]) -> list[Line]:
    """Return every measure of both, those with a bound first."""
    lines = []
    for name in theirs[0].numbers:
        here, there = ([v for house in side for v in house.numbers[name]] for side in (ours, theirs))
        if here and there:
            lines.append(Line(name, np.mean(there), np.mean(here), _apart(here, there), ASKED.get(name)))
    labels = total_variation(pooled_labels(theirs), pooled_labels(ours))
    lines.append(Line("labels", np.nan, np.nan, labels, ASKED["labels"]))
    lines.append(Line("area by label", np.nan, np.nan, _areas_apart(ours, theirs), ASKED["area by label"]))
    return sorted(lines, key=lambda line: (line.asked is None, -line.distance / (line.asked or 1)))


def _apart(here: list[float], there: list[float]) -> float:
    return float(wasserstein_distance(here, there)) / (float(np.std(there)) or 1.0)


def _areas_apart(ours: list[Seen], theirs: list[Seen]) -> float:
    """Return the distance of rooms' areas label by label, in the mean over the labels, by their share."""
    both = [{}, {}]
    for pooled, houses in zip(both, (ours, theirs), strict=True):
        for house in houses:
            for label, areas in house.areas.items():
                pooled.setdefault(label, []).extend(areas)
    total = sum(map(len, both[1].values()))
    common = [
        label for label, areas in both[1].items() if len(areas) > COMMON * total and len(both[0].get(label, ())) > 1
    ]
    weights = [len(both[1][label]) for label in common]
    return float(np.average([_apart(both[0][label], both[1][label]) for label in common], weights=weights))


@threadpool_limits.wrap(limits=1)  # threads that wait for each other on a busy machine take longer than one
def cross_validate(ours: list[Seen], theirs: list[Seen], *, step_m: float = 0.0, tells: bool = True) -> Verdict:
    """Cross-validate gradient boosting on all measures; permutation importance on what each fold has not seen."""
    data, names = features(ours + theirs, step_m)
    truth = np.repeat([0, 1], [len(ours), len(theirs)])
    scores = np.zeros(len(truth))
    lost: list[npt.NDArray[np.float64]] = []
    folds = StratifiedKFold(5, shuffle=True, random_state=SEED).split(data, truth)
    for train, test in folds:
        model = HistGradientBoostingClassifier(random_state=SEED, early_stopping=False).fit(data[train], truth[train])
        scores[test] = model.predict_proba(data[test])[:, 1]
        if tells and not lost:
            found = permutation_importance(
                model, data[test], truth[test], scoring="roc_auc", n_repeats=3, random_state=1
            )
            lost.append(found.importances_mean)
    auc = float(roc_auc_score(truth, scores))
    mean = np.mean(lost, axis=0) if lost else np.zeros(len(names))
    return Verdict(auc, [(names[k], float(mean[k])) for k in np.argsort(mean)[::-1][:20]] if lost else [])


def show(lines: list[Line], verdict: Verdict, rounded: Verdict) -> None:
    """Print what was found beside what is asked."""
    table = Table(title="Made homes and published plans")
    for heading in ("measure", "published", "made", "distance", "asked", ""):
        table.add_column(heading, justify="left" if heading == "measure" else "right")
    for line in lines:
        asked = "" if line.asked is None else f"{line.asked:.2f}"
        held = "" if line.asked is None else "yes" if line.distance <= line.asked else "NO"
        means = ("" if np.isnan(value) else f"{value:.3g}" for value in (line.published, line.made))
        table.add_row(line.name, *means, f"{line.distance:.3f}", asked, held)
    table.add_row(
        "AUC of a classifier", "", "", f"{verdict.auc:.3f}", f"{AUC:.2f}", "yes" if verdict.auc <= AUC else "NO"
    )
    table.add_row(f"the same, widths to {STEP_M:.2f} m", "", "", f"{rounded.auc:.3f}", "", "")
    console = Console(width=110)
    console.print(table)
    for name, loss in verdict.tells:
        console.print(f"  {loss:.4f}  {name}")


def measure_all(plans: Iterator[FloorPlan], see: Callable[[FloorPlan], Seen] = measure_plan) -> list[Seen]:
    """Measure made plans as if they were published."""
    return [see(as_published(plan)) for plan in plans]


def main() -> None:
    """Compare and print."""
    path, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2000
    theirs, ours = measure_published(path, count, last=True), measure_all(made_plans(count))
    rounded = cross_validate(ours, theirs, step_m=STEP_M, tells=False)
    show(compare_measures(ours, theirs), cross_validate(ours, theirs), rounded)


if __name__ == "__main__":
    main()
