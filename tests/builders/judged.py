"""Plans of which it is known whether they are right, of the cases and of the kit, and the fit of the model of quality.

A plan that no storey of its house is like is judged too: it does not meet the table. Every third house of the kit is
damaged before it is planned (``damage``): of sound ones too few plans are wrong to learn from.
"""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from houseexpo.plan.parts import SURE
from pipeline.executors.local import Failure, Limits, run
from pipeline.quality import GROUNDS, counted
from pipeline.values import Level
from tests.builders.damage import damaged
from tests.builders.kinds.measuring import columns_failing, overlap, paired, plans_of
from tests.builders.kinds.registry import make_member
from tests.builders.shared import CASES, DATA, case, of_building, scorer

WORKERS = 2
LIMITS = Limits(seconds=60.0, memory=8 << 30)
CASE = "case"
DAMAGED = 3
"""Every so many-th house of the kit is damaged."""


def judged(kinds: Sequence[str], members: int, seed: int, folder: Path) -> Iterator[Judged]:
    """Plan so many members of each kind and the cases in worker processes, and judge every plan that says its quality.

    A house that takes too long, or whose worker dies, gives no plan.
    """
    tasks = [(kind, number) for number in range(members) for kind in kinds]
    tasks += [(CASE, number) for number in range(len(CASES))]
    found = dict(run(partial(judge, seed=seed, folder=folder), tasks, workers=WORKERS, limits=LIMITS))
    for task in tasks:
        result = found[task]
        if not isinstance(result, Failure):
            yield from result


def judge(task: tuple[str, int], seed: int, folder: Path) -> list[Judged]:
    """Judge the plans of a case, or of a member of a kind."""
    kind, number = task
    return _of_case(CASES[number]) if kind == CASE else _of_member(kind, number, seed, folder / kind)


def damage_of(kind: str, number: int, seed: int) -> Callable[[Level], Level] | None:
    """Return what is done to the levels of a member of a kind before they are planned; None for sound members."""
    rng = np.random.default_rng([seed, number, zlib.crc32(kind.encode())])
    return partial(damaged, rng=rng) if number % DAMAGED == DAMAGED - 1 else None


def _of_case(name: str) -> list[Judged]:
    """Judge what the mesh gives, and what the IFC file does, where there is one; buildings one by one."""
    found, truth = [], case(name)
    house = re.sub(r"(_\d+)?(_leaves)?$", "", name)
    for source in dict.fromkeys(truth[key] for key in ("mesh", "ifc") if key in truth):
        known = {**truth, "zones": None, "kind": "ifc"} if source.endswith(".ifc") else truth
        plans = [plan for plan in plans_of(DATA / source)[0] if overlap(known, plan) > 0]
        for plan in plans:
            its = of_building(known, plan) if len(plans) > 1 else known
            found += _judged(house, CASE, plan, met=not columns_failing(scorer()(plan, its), its))
    return found


def _of_member(kind: str, number: int, seed: int, folder: Path) -> list[Judged]:
    """Judge a member; every ``DAMAGED``-th one is damaged first."""
    member = make_member(kind, number, seed, folder)
    damage = damage_of(kind, number, seed)
    plans, _ = plans_of(member.path, damage)
    scores, _, _ = paired(member.truths, plans)
    met = {score["plan"]: not score["failing"] for score in scores if "plan" in score}
    house, kind = f"{kind} {number}", "damaged" if damage else kind
    return [one for k, plan in enumerate(plans) for one in _judged(house, kind, plan, met=met.get(k, False))]


def _judged(house: str, kind: str, plan: dict[str, Any], *, met: bool) -> list[Judged]:
    quality = plan.get("quality")
    return [Judged(house, kind, met, quality["score"], quality["grounds"])] if quality else []


# Fitting the model of ``pipeline.quality``, and how good it is on plans of which is known whether they are right.


Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

NAMES = tuple(ground.name for ground in GROUNDS)
MOST = {ground.name: ground.most for ground in GROUNDS}
PRECISION = 0.98
"""Of the plans with a score of at least ``SURE``, so many are to be right; of files that no fit has used 90% are."""
RIDGE = 0.3
"""How strongly weights are kept small, in plans."""
CAUTION = 0.3
"""By so much the log odds are lowered further: other files are right less often than those at hand."""
REAL = 3.0
"""All files of the corpus together count so many times as much as all made houses: they are what users have."""
FOLDS = 8


@dataclass(frozen=True)
class Judged:
    """A plan of a house: the grounds that it gives, its score, and whether it meets the table.

    ``file`` is the file of the corpus that it is of, whose ``house`` is its repository; "" for made houses and cases.
    """

    house: str
    kind: str
    met: bool
    score: float
    grounds: Mapping[str, float] = field(default_factory=dict)
    file: str = ""


@dataclass(frozen=True)
class Model:
    """What ``pipeline.quality`` holds: a bias, a weight of at most 0 for each ground, and how scores are spread."""

    bias: float
    weights: Mapping[str, float]
    spread: float = 1.0

    def scores(self, plans: Sequence[Judged]) -> Floats:
        """Score plans anew, (n,) from 0 to 1."""
        log_odds = self.bias + _table(plans) @ [self.weights[name] for name in NAMES]
        found: Floats = 1 / (1 + np.exp(-(logit(SURE) + (log_odds - logit(SURE)) / self.spread)))
        return found

    def lowered(self, by: float) -> Model:
        """Return a model whose log odds are lower by so much, spread such that what scored 0.5 still does.

        No weight is more than its ground may have at most.
        """
        weights = {name: min(weight, MOST[name]) for name, weight in self.weights.items()}
        return Model(self.bias - by, weights, 1 + by / logit(SURE))


def fit(plans: Sequence[Judged], precision: float = PRECISION) -> Model:
    """Fit by greatest likelihood, weights kept from growing by a ridge and from being more than 0.

    The bias is lowered at the end until enough of what scores ``SURE`` or more is right: of the corpus's files, each
    scored by a model that saw nothing of its repository; of the plans themselves where there are no such files. Then it
    is lowered by ``CAUTION`` more.
    """
    model = likeliest_model(plans).lowered(0.0)
    real = [plan for plan in plans if plan.file]
    if real:
        scores, met = per_file(real, left_out_scores(plans))
    else:
        scores, met = model.scores(plans), _met(plans)
    return model.lowered(max(0.0, logit(threshold(scores, met, precision)) - logit(SURE)) + CAUTION)


def left_out_scores(plans: Sequence[Judged], lowered: float = 0.0) -> Floats:
    """Return the scores of the plans of the corpus, each of a model that was fitted without its repository's fold."""
    real = [plan for plan in plans if plan.file]
    folds = np.array([zlib.crc32(plan.house.lower().encode()) % FOLDS for plan in real])
    scores = np.zeros(len(real))
    for k in np.unique(folds):
        out = {plan.file for plan, fold in zip(real, folds, strict=True) if fold == k}
        model = likeliest_model([plan for plan in plans if plan.file not in out]).lowered(lowered)
        scores[folds == k] = model.scores([plan for plan in real if plan.file in out])
    return scores


def per_file(plans: Sequence[Judged], scores: Floats) -> tuple[Floats, Bools]:
    """Return the score of each file's least sure plan, and whether the file is right, in the order of the files."""
    files: dict[str, list[int]] = {}
    for k, plan in enumerate(plans):
        files.setdefault(plan.file, []).append(k)
    return np.array([scores[ks].min() for ks in files.values()]), np.array([plans[ks[0]].met for ks in files.values()])


def likeliest_model(plans: Sequence[Judged]) -> Model:
    """Fit the model; all plans of a file that is not right count as not right, each as one of so many."""
    return _most_likely(plans, _weights(plans))


def _weights(plans: Sequence[Judged]) -> Floats:
    """Return the weight of each plan: a file of the corpus counts once, made houses ``1 / REAL`` of all files."""
    count = Counter(plan.file for plan in plans)
    files = len(count) - ("" in count)
    made = files / (REAL * count[""]) if files and count[""] else 1.0
    return np.array([1.0 / count[plan.file] if plan.file else made for plan in plans])


def _most_likely(plans: Sequence[Judged], weight: Floats) -> Model:
    table, met = _table(plans), _met(plans)

    def loss(x: Floats) -> tuple[float, Floats]:
        exponent = x[0] + table @ x[1:]
        value = (weight * np.logaddexp(0, np.where(met, -exponent, exponent))).sum() + RIDGE * (x[1:] ** 2).sum() / 2
        slope = weight * (1 / (1 + np.exp(-exponent)) - met)
        return float(value), np.concatenate([[slope.sum()], table.T @ slope + RIDGE * x[1:]])

    bounds = [(None, None)] + [(None, 0.0)] * len(NAMES)
    found = minimize(loss, np.zeros(len(NAMES) + 1), jac=True, method="L-BFGS-B", bounds=bounds)
    return Model(float(found.x[0]), dict(zip(NAMES, np.minimum(found.x[1:], 0.0).tolist(), strict=True)))


def threshold(scores: Floats, met: Bools, precision: float) -> float:
    """Return the lowest score of which, and of what is above it, enough plans are right; else the highest score."""
    values = np.unique(scores)
    good = [value for value in values if met[scores >= value].mean() >= precision]
    return float(min(good, default=values[-1]))


def precision_at(scores: Floats, met: Bools, least: float = SURE) -> float:
    """Share of the plans with at least this score that are right; NaN where there are none."""
    chosen = scores >= least
    return float(met[chosen].mean()) if chosen.any() else float("nan")


def area_under_curve(scores: Floats, met: Bools) -> float:
    """How often a plan that is right scores above one that is not; ties count half; NaN without plans of both sorts."""
    right, wrong = scores[met], scores[~met]
    if not len(right) or not len(wrong):
        return float("nan")
    above = (right[:, None] > wrong).mean() + (right[:, None] == wrong).mean() / 2
    return float(above)


def split(plans: Sequence[Judged], held_out: float = 0.4) -> tuple[list[Judged], list[Judged]]:
    """Return plans to fit on and plans to look at, all plans of one house on one side, the same ones every time."""
    parts: tuple[list[Judged], list[Judged]] = [], []
    for plan in plans:
        parts[zlib.crc32(plan.house.encode()) % 1000 < 1000 * held_out].append(plan)
    return parts


def met_of(plans: Sequence[Judged]) -> tuple[Floats, Bools]:
    """Return the scores that the plans carry, (n,), and whether each meets the table, (n,)."""
    return np.array([plan.score for plan in plans]), _met(plans)


def _met(plans: Sequence[Judged]) -> Bools:
    return np.array([plan.met for plan in plans], dtype=bool)


def _table(plans: Sequence[Judged]) -> Floats:
    return np.array([[counted(plan.grounds.get(name, 0.0)) for name in NAMES] for plan in plans]).reshape(
        -1, len(NAMES)
    )


def logit(score: float) -> float:
    """Return the log odds of a score."""
    clear = min(max(score, 1e-6), 1 - 1e-6)
    return float(np.log(clear / (1 - clear)))
